"""What had not been done when a diagnosis was ended, and how that is said."""

from collections.abc import Mapping
from typing import NamedTuple

from ..._limit import Limit
from ...structures import Cause
from ..search.rounds import Searched

_LISTED = 8
"""Causes that are listed in words, at most; the numbers hold all of them."""


class Unfinished(NamedTuple):
    """Ids of the causes that had not been tried, and notes on all that had not been done; neither where nothing is."""

    untried: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @classmethod
    def of(cls, chosen: Mapping[str, Cause], tried: Searched, limit: Limit, *, cut: bool, pairs: bool) -> "Unfinished":
        """What had not been done of a search that was `cut` short, or of what follows it."""
        if cut:
            dismissed = [behind.effects for behind in tried.behind if not behind.cut]
            known = {e.cause.id for effects in (*(t.effects for t in tried.trials), *dismissed) for e in effects}
            physical = (name for name, cause in chosen.items() if not cause.is_value and name != "clipping")
            untried = tuple(name for name in physical if name not in known)
            follow = "what is akin to the best" + ", and pairs of causes" * pairs
            return cls(untried, (f"Not finished: {_count(untried)} Nor was all of what may follow: {follow}.",))
        if limit.over:
            return cls((), ("Not finished: the smallest effects that would have been seen were not all looked for.",))
        return cls()


def _count(untried: tuple[str, ...]) -> str:
    if not untried:
        return "every cause was tried, though not wherever and with whatever it may act."
    shown, more = ", ".join(untried[:_LISTED]), len(untried) - _LISTED
    return (
        f"{len(untried)} causes were not tried to the end: {shown}"
        + f" and {more} more." * (more > 0)
        + "." * (more <= 0)
    )
