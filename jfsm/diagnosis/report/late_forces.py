"""Forces that act later than they were recorded, in words."""

from collections.abc import Iterator, Sequence

from ..._result import Estimate
from ...identification import Nuisances
from ...plant import Channel, Reconstruction
from ...structures import causes
from .._finding import FOUND, Finding, Rival
from ..channels.clock import Lateness
from ..evidence.evidence import Setting
from ..hypotheses.law_classes import DELAY
from ..thresholds import THRESHOLDS
from .sentences import finding_sentence


def late_forces(late: Lateness, first: Nuisances, setting: Setting) -> tuple[Finding, ...]:
    """The forces that are late, as findings, where that changes a run of the model as given by more than is negligible.

    Where one response alone was measured, it may be that one which is late.
    """
    if setting.late_changes <= THRESHOLDS.negligible:
        return ()
    cause, responses = causes()["force_delay"], list(first.record.responses)
    rivals = tuple(Rival("channel_delay", at, 1 - FOUND) for at in responses if len(responses) == 1)

    def finding(at: Channel, tau: tuple[float, float, float]) -> Finding:
        return Finding.of_sensor(cause, at, "tau", Estimate(*tau, "s"), _when(tau[0], first), DELAY, rivals)

    return tuple(finding(at, tau) for at, tau in late.items())


def beside_late_forces(sentence: str, verdict: str, found: Sequence[Finding]) -> str:
    """The sentence of a verdict that names no finding, with these."""
    named = [] if verdict in ("cause", "parameters") else [finding_sentence(one, causes()) for one in found]
    return " ".join([sentence, *named])


def times_of_forces(late: Lateness, first: Nuisances, assumed: Reconstruction) -> Iterator[str]:
    """What is to be said of when forces act, where it is otherwise than was recorded and `assumed`."""
    if first.reconstruction == "linear" and assumed != "linear":
        yield "The force goes straight from sample to sample; all runs but that of the model as given take it so."
    for (kind, j), (tau, _, _) in late.items():
        yield f"{kind} {j}: {_when(tau, first)}; all runs but that of the model as given take it so."


def _when(tau: float, first: Nuisances) -> str:
    """When a force acts that is so late [s]."""
    dt, held = first.record.dt, first.reconstruction == "hold"
    much, late = f"{abs(tau):.3g} s ({abs(tau) / dt:.2g} samples)", "later" if tau < 0 else "earlier"
    acts = f"it acts {much} {late} than it was recorded"
    return f"the force is held between its samples: {acts}" if held else acts.replace("it", "the force", 1)
