"""Every hypothesis fitted: those that share a program side by side, the hopeless ones only so far."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..identification import Maximum, Nuisances, Posterior, approach, finish, lanes_of
from ..structures import Structure
from ._candidates import Candidate, hypothesis
from ._trial import Trial, trial

_LADDER = (0.3, 0.03, 0.01)
"""Rungs for a candidate: the refit has been at the top already."""
_FAR_BEHIND = 200.0
"""Nats behind the leader, one per cent of unmodelled force forgiven, from which a candidate is not pursued,"""
_ALWAYS_PURSUED = 3
"""unless it is among the best of them."""


@dataclass(frozen=True)
class _Approached:
    """Starts of one law, brought to the last rung that forgives unmodelled force."""

    candidates: tuple[Candidate, ...]
    posterior: Posterior
    rung: Maximum

    @property
    def best(self) -> float:
        return float(np.min(self.rung.value))


def fit_model(name: str, model: Structure, records: Sequence[Nuisances], until: Sequence[int], *, refit: bool) -> Trial:
    """The model as given, or with its own values refitted, the better of two climbs.

    One comes down the ladder, for values that are far off; one begins at the values as given, for a model that lacks
    something, whose top rungs lead astray.
    """
    both = min(2, lanes_of(model))
    posterior = Posterior(hypothesis(model, [model] * both, records, refit=refit), records, until)
    rung = approach(posterior)
    theta = np.vstack([rung.theta[:1], posterior.initial()[1:]])
    found = finish(posterior, replace(rung, theta=theta))
    best = int(np.argmin(found.value))
    return trial(posterior, found, best, None, (name,), float(rung.value[0]))


Beginning = tuple[Candidate, Structure, Mapping[str, float] | None]
"""A candidate, the structure with the size of its effect, and the own values to begin with (None: as given)."""


def groups(tried: Sequence[Candidate], own: Mapping[str, float] | None) -> list[list[Beginning]]:
    """Starts that can share a program, in lots of its lanes: one law, whatever its sign and place.

    A law starts twice, from the own values as given and from those of the refit: either may be far from what is right
    beside it. A gain lies on a ridge with the own values, and only a climb from those as given ends at its own end.
    """
    by_law: dict[type, list[Beginning]] = {}
    for candidate in tried:
        begins = [None] if candidate.cause.is_sensor or own is None else [None, own]
        lot = by_law.setdefault(candidate.cause.effect, [])
        lot += [(candidate, s, begin) for begin in begins for s in candidate.starts]
    lots = []
    for starts in by_law.values():
        lanes = lanes_of(starts[0][1])
        lots += [starts[i : i + lanes] for i in range(0, len(starts), lanes)]
    return lots


def search(
    tried: Sequence[Candidate],
    model: Structure,
    given: Trial,
    refitted: Trial,
    records: Sequence[Nuisances],
    until: Sequence[int],
    tell: Callable[[str, int], None],
) -> list[Trial]:
    """The best trial of every candidate; those far behind stay at the values of their rung."""
    approached = []
    values = refitted.structure.values()
    own = {p: values[p] for p in model.entries()} if refitted.evidence > given.evidence else None
    lots = groups(tried, own)
    for lot in lots:
        first = lot[0][0]
        tell(f"{first.cause.label} at {'-'.join(map(str, first.at))}", 2 * len(lots))
        approached.append(_approach(lot, model, records, until))
    leader = min([refitted.rung, *(lot.best for lot in approached)])
    trials, best = [], refitted.value
    for rank, lot in enumerate(sorted(approached, key=lambda lot: lot.best)):
        tell("the best candidates", 2 * len(lots))
        behind = lot.best - leader
        pursued = rank < _ALWAYS_PURSUED or behind < _FAR_BEHIND
        found = finish(lot.posterior, lot.rung, best=best) if pursued else lot.rung
        for lane, candidate in enumerate(lot.candidates):
            done = trial(lot.posterior, found, lane, candidate.cause, candidate.at, float(lot.rung.value[lane]))
            if pursued:
                best = min(best, done.value)
            else:
                done = replace(done, evidence=refitted.evidence - behind, converged=False)
            trials.append(done)
    return _best_of_each(trials)


def _approach(lot: Sequence[Beginning], model: Structure, records, until) -> _Approached:
    candidates, starts, begins = zip(*lot, strict=True)
    records = [n.resolving(starts) for n in records]
    posterior = Posterior(hypothesis(model, starts, records, begins=begins), records, until)
    return _Approached(candidates, posterior, approach(posterior, _LADDER))


def _best_of_each(trials: Sequence[Trial]) -> list[Trial]:
    """The most probable start of every cause at every place."""
    best: dict[tuple, Trial] = {}
    for t in trials:
        name = (t.name, t.at)
        if name not in best or t.evidence > best[name].evidence:
            best[name] = t
    return list(best.values())
