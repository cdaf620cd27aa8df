"""The part of a diagnosis that was not done when it was ended, in words."""

from collections.abc import Mapping
from typing import NamedTuple

from ..._limit import Limit
from ...structures import Cause
from ..search.rounds import Searched

_LISTED = 8
"""Causes that are listed in words, at most; the numbers hold all of them."""


class Unfinished(NamedTuple):
    """Ids of the causes that were not tried, and notes on all that was not done; both empty where everything was."""

    untried: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @classmethod
    def of(cls, chosen: Mapping[str, Cause], tried: Searched, limit: Limit, *, cut: bool, pairs: bool) -> "Unfinished":
        """The part of a search that was `cut` short that was not done, or of the work that follows it."""
        if cut:
            known = _known(tried)
            untried = tuple(name for name in _to_be_fitted(chosen) if name not in known)
            follow = "what is akin to the best" + ", and pairs of causes" * pairs
            return cls(untried, (f"Not finished: {_count(untried)} Nor was all of what may follow: {follow}.",))
        if limit.over:
            return cls((), ("Not finished: the smallest effects that would have been seen were not all looked for.",))
        return cls()


def _to_be_fitted(chosen: Mapping[str, Cause]) -> list[str]:
    """Ids of the causes that only a fit can find."""
    return [name for name, cause in chosen.items() if not cause.is_value and name != "clipping"]


def _known(tried: Searched) -> set[str]:
    """Ids of the causes that were fitted, or dismissed on good grounds."""
    fitted = [t.effects for t in tried.trials]
    dismissed = [behind.effects for behind in tried.behind if not behind.cut]
    return {effect.cause.id for effects in (*fitted, *dismissed) for effect in effects}


def _count(untried: tuple[str, ...]) -> str:
    """The causes that were not tried, as a sentence."""
    if not untried:
        return "every cause was tried, though not wherever and with whatever it may act."
    more = len(untried) - _LISTED
    rest = f" and {more} more." if more > 0 else "."
    return f"{len(untried)} causes were not tried to the end: {', '.join(untried[:_LISTED])}{rest}"
