"""A cause at a place, and how several of them are called."""

from collections.abc import Sequence
from typing import NamedTuple

from ...reporting import cause_name, place_name
from ...structures import Cause


class Effect(NamedTuple):
    """A cause at a link, or at a channel."""

    cause: Cause
    at: tuple

    @property
    def label(self) -> str:
        """Name and place in words."""
        return f"{cause_name(self.cause.id)} at {place_name(self.at)}"


def names(effects: Sequence[Effect]) -> str:
    """Their ids; of several as a sum."""
    return " + ".join(effect.cause.id for effect in effects)


def key_of(effects: Sequence[Effect]) -> str:
    """Their ids with their places: ``coulomb@0-1+accel_gain@acceleration:1``."""
    return "+".join(f"{e.cause.id}@{(':' if e.cause.is_sensor else '-').join(map(str, e.at))}" for e in effects)


def places(effects: Sequence[Effect]) -> tuple:
    """The place of one effect, the places of several."""
    return effects[0].at if len(effects) == 1 else tuple(effect.at for effect in effects)


def families(effects: Sequence[Effect]) -> list[str]:
    """Their families, in order."""
    return sorted(effect.cause.family for effect in effects)
