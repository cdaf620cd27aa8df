"""From a record and a model to a verdict."""

import math
import secrets
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import jax
import numpy as np
import numpy as np

from .._types import require_x64
from ..identification import Maximum, Nuisances, Posterior, approach, finish, prepare
from ..records import Record
from ..structures import AbstractFriction, Cause, Structure
from ._candidates import Candidate, candidates, chosen_causes, hypothesis
from ._decide import decide
from ._diagnosis import Diagnosis
from ._gain import measure_gain
from ._report import assemble
from ._residual import residual, stand_in
from ._trial import Trial, trial

Progress = Callable[[str, int, int], None]

_CANDIDATE_LADDER = (0.3, 0.1, 0.03, 0.01)
"""Rungs for a candidate: the refit has been at the top already."""
_FAR_BEHIND = 200.0
"""Nats behind the leader, one per cent of unmodelled force forgiven, from which a candidate is not pursued."""


def diagnose(
    record: Record | Sequence[Record],
    model: Structure,
    holdout: float | Record | Sequence[Record] | None = 0.3,
    causes: Sequence[str | Cause] | None = None,
    max_causes: int = 1,
    key: jax.Array | None = None,
    *,
    places: Sequence[tuple[int, int]] | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """What `model` gets wrong about `record`, the name of the cause, and the gain of mending it.

    Parameters
    ----------
    record : Record or sequence of them
        One verdict that must hold on all.
    model : Structure
        The simulation that its owner believes in. Its own values are refitted within its trust (`Structure.uncertain`).
    holdout : float, Record, sequence of Records, or None
        A share is the last part in time; records are never fitted; None decides on the whole record and gives no gain.
    causes : sequence of ids or causes, optional
        What to look for; the whole catalogue by default.
    max_causes : int
        Effects that may act at once; 1 here.
    key : jax.random.key, optional
        Source of the few draws (the floor of the gain); made at the call when None.
    places : sequence of links, optional
        Where link laws are tried; the model's links by default.
    progress : callable, optional
        Told of every step: what, steps done, steps in all.

    Returns
    -------
    Diagnosis

    Raises
    ------
    ValueError
        If the record cannot be used, does not fit the model, or an argument is out of its range.
    """
    require_x64()
    if max_causes != 1:
        if max_causes < 1:
            raise ValueError(f"`max_causes` must be at least 1; got {max_causes}.")
    key = jax.random.key(secrets.randbits(32)) if key is None else key
    training, held = split(record, holdout)
    chosen = chosen_causes(causes)
    whole = [whole for whole, _ in training]
    until = [fit for _, fit in training]
    records = _prepare(whole, until, model)
    tried = candidates(model, records, chosen, places)
    steps = _Steps(progress, 5 + len(tried))

    steps.next("the model as given")
    given = _fit("given", model, records, until, refit=False)
    steps.next("the model refitted")
    refitted = _fit("refitted", model, records, until, refit=True)
    approached = []
    start = refitted.structure if refitted.evidence > given.evidence else model
    for candidate in tried:
        steps.next(f"{candidate.cause.label} at {candidate.at}")
        approached += list(_approach(candidate, model, start, records, until))
    trials = _best_of_each(_finished(approached, refitted, steps))
    steps.next("the missing force")
    missing = residual(refitted, model, records[0], until[0])
    periods = sum(n.record.duration for n in records) * records[0].omega / (2 * math.pi)
    decision = decide(given, refitted, trials, lambda: stand_in(missing, refitted, records, until), periods)
    extended = model if decision.verdict == "consistent" else decision.winner.extended()
    steps.next("the gain on held-out readings")
    gain, runs = None, []
    if held:
        first = records[0]
        noise = _noise_levels(decision.winner, first)
        gain, runs = measure_gain(model, refitted.extended(), extended, held, noise, first.omega, first.reconstruction, key)
    return assemble(decision, refitted, trials, model, extended, records, missing, gain, runs)


class _Steps:
    """Counts steps for a progress display."""

    def __init__(self, progress: Progress | None, total: int):
        self.progress, self.done, self.total = progress, 0, total

    def next(self, what: str) -> None:
        if self.progress is not None:
            self.progress(what, self.done, self.total)
        self.done += 1


def split(record: Record | Sequence[Record], holdout) -> tuple[list[tuple[Record, int]], list[Record]]:
    """Records with the number of their samples that are fitted, and the records on which the gain is measured."""
    records = [record] if isinstance(record, Record) else list(record)
    if not records:
        raise ValueError("`record` must hold at least one record; the sequence is empty.")
    for item in records:
        if not isinstance(item, Record):
            raise TypeError(f"`record` must be a jfsm.Record or a sequence of them; got {type(item).__name__}.")
    if holdout is None:
        return [(r, len(r)) for r in records], []
    if isinstance(holdout, Record):
        return [(r, len(r)) for r in records], [holdout]
    if isinstance(holdout, int | float):
        if not 0 < holdout < 1:
            raise ValueError(f"`holdout` as a share must lie between 0 and 1, e.g. 0.3; got {holdout}. None keeps nothing back.")
        ends = [int(round((1 - holdout) * len(r))) for r in records]
        return list(zip(records, ends, strict=True)), [r[end:] for r, end in zip(records, ends, strict=True)]
    return [(r, len(r)) for r in records], list(holdout)


def _prepare(records: Sequence[Record], until: Sequence[int], model: Structure) -> list[Nuisances]:
    """Nuisances of every record; how the drive runs between its samples is chosen once, on the model refitted."""
    first = [prepare(r, model) for r in records]
    return first


def _fit(name: str, model: Structure, records, until, *, refit: bool) -> Trial:
    posterior = Posterior(hypothesis(model, [model], records, refit=refit), records, until)
    rung = approach(posterior)
    return trial(posterior, finish(posterior, rung), 0, None, (name,), float(rung.value[0]))


def _approach(candidate: Candidate, model: Structure, start: Structure, records, until) -> Iterator[tuple[Candidate, Posterior, Maximum]]:
    """Every start of a candidate brought to the last rung that forgives unmodelled force."""
    sticks = issubclass(candidate.cause.effect, AbstractFriction)
    groups = [[s] for s in candidate.starts] if sticks else [list(candidate.starts)]
    # A gain lies on a ridge with the own values: only from the values as given does a climb end at its own end of it.
    own = None if candidate.cause.is_sensor else {p: v for p, v in start.values().items() if p in model.entries()}
    for starts in groups:
        posterior = Posterior(hypothesis(model, starts, records, begin=own), records, until)
        yield candidate, posterior, approach(posterior, _CANDIDATE_LADDER)


def _finished(approached: Sequence[tuple[Candidate, Posterior, Maximum]], refitted: Trial, steps: "_Steps") -> list[Trial]:
    """Trials of all candidates; those far behind on a rung that forgives a little stay at that rung's values."""
    steps.next("the best candidates")
    leader = min([refitted.rung, *(float(np.min(rung.value)) for _, _, rung in approached)])
    trials, best = [], refitted.value
    for candidate, posterior, rung in sorted(approached, key=lambda item: float(np.min(item[2].value))):
        behind = float(np.min(rung.value)) - leader
        found = rung if not behind < _FAR_BEHIND else finish(posterior, rung, best=best)
        for lane in range(posterior.lanes):
            done = trial(posterior, found, lane, candidate.cause, candidate.at, float(rung.value[lane]))
            if found is rung:
                done = replace(done, evidence=refitted.evidence - behind, converged=False)
            trials.append(done)
            best = min(best, done.value) if found is not rung else best
    return trials


def _best_of_each(trials: Sequence[Trial]) -> list[Trial]:
    """The most probable start of every cause at every place."""
    best: dict[tuple, Trial] = {}
    for t in trials:
        name = (t.name, t.at)
        if name not in best or t.evidence > best[name].evidence:
            best[name] = t
    return list(best.values())


def _noise_levels(winner: Trial, nuisances: Nuisances) -> dict[tuple, float]:
    """Standard deviation of the noise of every channel: of responses as the winner found it, of forces at their floor."""
    levels = {c: float(f * math.exp(s / 2)) for c, f, s in zip(nuisances.channels, nuisances.floor, winner.noise, strict=False)}
    for j, variance in enumerate(nuisances.noise.force_variance):
        levels["force", j + 1] = math.sqrt(float(variance))
    return levels
