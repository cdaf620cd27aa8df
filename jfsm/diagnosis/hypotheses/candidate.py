"""A hypothesis that may be fitted, and which of many are worth a fit."""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from ...structures import AbstractTerm, Structure
from .effect import Effect, places
from .initial_values import Begin

_FOLLOWED = 8
"""Laws that are fitted, the most promising ones."""
_UNSEEN, _NEARLY = 0.5, 0.5
"""Share of the missing force from which it is seen well; of one that is not those laws are fitted, too, that explain
such a part of what the best does, at its place."""
_HARDLY_LESS = 0.8
"""Share of what a law explains of the missing force, from which another may be as likely: regression is not the fit."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A cause at a place, or several at theirs; `starts` are the structures that a fit begins from.

    `share` is how much of the missing force the best of them explains by regression; None where regression cannot tell,
    as of sensors, which lack no force. A law that no shape of which explains any has no starts. `begin` is where a fit
    begins otherwise, where that is not as given.
    """

    effects: tuple[Effect, ...]
    starts: tuple[Structure, ...]
    share: float | None = None
    begin: Begin | None = None


def promising(tried: Sequence[Candidate]) -> tuple[list[Candidate], list[Candidate]]:
    """Candidates that are worth a fit, and those that are not: laws that explain least of the missing force."""
    least, near = _least_share(tried), _near_the_best(tried)
    chosen = [c for c in tried if c.starts and (c.share is None or c.share >= least or c.effects in near)]
    fitted = {c.effects for c in chosen}
    return chosen, [c for c in tried if c.effects not in fitted]


def _least_share(tried: Sequence[Candidate]) -> float:
    """Share of the missing force that the last of the laws explains that are worth a fit."""
    shares = dict[tuple[Effect, ...], float]()
    for c in tried:
        if c.share is not None:
            shares[c.effects] = max(c.share, shares.get(c.effects, -math.inf))
    ranked = sorted(shares.values(), reverse=True)
    return ranked[_FOLLOWED - 1] if len(ranked) > _FOLLOWED else -math.inf


def _near_the_best(tried: Sequence[Candidate]) -> set[tuple[Effect, ...]]:
    """Laws at the place of the one that explains most, and about as much, of a force that is not seen well."""
    shares = {c: c.share for c in tried if c.share}
    best = max(shares, key=lambda c: shares[c], default=None)
    if best is None or shares[best] >= _UNSEEN:
        return set()
    least = _NEARLY * shares[best]
    return {c.effects for c, share in shares.items() if share >= least and places(c.effects) == places(best.effects)}


def contained(laws: Sequence[AbstractTerm], among: Sequence[Candidate]) -> list[Candidate]:
    """Candidates that can begin and whose law is what one of `laws` is for certain of its numbers, at its place."""
    found = {(law.at, kind) for law in laws for kind in law.contains}
    return [c for c in alone_there(found, among) if c.starts]


def alone_there(laws: Collection[tuple[tuple, type]], among: Sequence[Candidate]) -> list[Candidate]:
    """Candidates of a single effect that is one of these laws, each at its place."""
    alone = [c for c in among if len(c.effects) == 1]
    return [c for c in alone if (c.effects[0].at, c.effects[0].cause.effect) in laws]


def as_promising(
    effects: tuple[Effect, ...], tried: Sequence[Candidate], left: Sequence[Candidate], least: float = _HARDLY_LESS
) -> list[Candidate]:
    """Candidates left out that explain `least` times as much of the missing force as the `effects` found, or more."""
    found = max((c.share for c in tried if c.effects == effects and c.share is not None), default=math.inf)
    return [c for c in left if c.starts and c.share is not None and c.share >= least * found]


def elsewhere(effects: tuple[Effect, ...], left: Sequence[Candidate]) -> list[Candidate]:
    """Candidates left out whose law is the one that was found, of either sign: as a rule at other places.

    Where not all motions are seen, regression tells the place less well than the law.
    """
    found = {effect.cause.effect for effect in effects}
    return [c for c in left if c.starts and all(effect.cause.effect in found for effect in c.effects)]
