"""Forces that act later than they were recorded, beside a verdict on the rest."""

from dataclasses import replace

from ..evidence.evidence import Setting
from ..thresholds import Thresholds
from .checks import checked
from .decision import Decision


def beside_late_forces(decision: Decision, setting: Setting, limits: Thresholds) -> Decision:
    """The verdict once forces are known to be late: a cause where nothing else is wrong, if that changes a run of the
    model as given."""
    says = f"its lateness changes a run of the model as given by {setting.late_changes:.2%} of the signal"
    rows = tuple(
        checked("acts_in_time", f"force_delay@{kind}:{j}", setting.late_changes, limits.negligible, says)
        for kind, j in setting.late
    )
    decision = replace(decision, checks=(*rows, *decision.checks))
    if decision.verdict == "consistent" and not all(row.passed for row in rows):
        return replace(decision, verdict="cause")
    return decision
