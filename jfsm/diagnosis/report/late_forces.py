"""Forces that act later than they were recorded, in words."""

from collections.abc import Iterator

from ...structures import causes
from .._diagnosis import Estimate, Finding, Rival
from ..channels.clock import lateness
from ..evidence.evidence import Setting
from ..evidence.fitted import Trial
from ..evidence.setup import Problem
from ..thresholds import THRESHOLDS
from .law_class import class_of

PROBABILITY = 0.99
"""That a force is late that was found so: its evidence is beyond doubt, and a law that looks like it was tried."""


def late_forces(beside: Trial, problem: Problem, setting: Setting) -> tuple[Finding, ...]:
    """The forces that are late, as findings, where that changes a run of the model as given by more than is negligible.

    Where one response alone was measured, it may be that one which is late.
    """
    if setting.late_changes <= THRESHOLDS.negligible:
        return ()
    known, record, found = causes(), problem.first.record, list[Finding]()
    for at, tau in lateness(beside, problem).items():
        cause, sensor = known["force_delay"], known["force_delay"].term(at, tau=tau[0])
        values = {"tau": Estimate(*tau, "s")}
        rivals = [Rival("channel_delay", c, 1 - PROBABILITY) for c in record.responses if len(record.responses) == 1]
        kind = class_of(cause, sensor)
        sentence = _when(tau[0], record.dt, held=problem.first.reconstruction == "hold")
        found.append(
            Finding(cause.id, cause.family, at, PROBABILITY, values, tuple(rivals), sentence, kind, PROBABILITY)
        )
    return tuple(found)


def times_of_forces(beside: Trial, problem: Problem, assumed: str) -> Iterator[str]:
    """What is to be said of when forces act, where it is otherwise than was recorded and `assumed`."""
    first = problem.first
    if first.reconstruction == "linear" and assumed != "linear":
        yield "The force goes straight from sample to sample; all runs but that of the model as given take it so."
    for (kind, j), (tau, _, _) in lateness(beside, problem).items():
        when = _when(tau, first.record.dt, held=first.reconstruction == "hold")
        yield f"{kind} {j}: {when}; all runs but that of the model as given take it so."


def _when(tau: float, dt: float, *, held: bool) -> str:
    """When a force acts that is read so much later than it is [s]."""
    much, late = f"{abs(tau):.3g} s ({abs(tau) / dt:.2g} samples)", "later" if tau < 0 else "earlier"
    acts = f"it acts {much} {late} than it was recorded"
    return f"the force is held between its samples: {acts}" if held else acts.replace("it", "the force", 1)
