"""Where a fit begins, apart from the numbers of its effects."""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

from ...identification import Unknown
from ..evidence.fitted import Trial, ended


class Start(NamedTuple):
    """A number to begin with, and the one about which it is believed to be."""

    value: float
    center: float


Begin = Mapping[tuple[str, int | None], Start]
"""Numbers to begin with where they are not begun with as given: the model's own values, and what one record has to
itself, by path and record (None: of all)."""


def found_in(t: Trial) -> Begin:
    """Where a trial ended. Numbers of effects are among these; another structure that has them begins with its own."""
    return {(u.path, u.record): Start(u.value(theta), u.value(u.center)) for u, theta in ended(t)}


def own_part(begin: Begin) -> Begin:
    """The part that all records share."""
    return {key: start for key, start in begin.items() if key[1] is None}


def begun(u: Unknown, begin: Begin | None) -> Unknown:
    """An unknown that begins there, if anything is said of it."""
    found = begin or {}
    start = found.get((u.path, u.record), found.get((u.path, None)))
    return u if start is None else replace(u, theta=u.coordinate(start.value), center=u.coordinate(start.center))
