"""Records looked at before anything is fitted: made sound, or refused with the reason."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

from ..._result import Check
from ...plant import check_pair
from ...records import Look, Record, look, mended, rest_words
from ...reporting import capitalised
from ...structures import AccelerationGain, ForceGain, Structure
from .sizes import beside_model

STOPS = ("channel_moves", "scales_agree", "right_size", "channels_in_place")
"""Looks that nothing can be fitted after: the record, or a unit, has to be put right first."""

SIGNS = ("signs_agree", "takes_energy", "pushes_forward", "follows_model")
"""Looks that tell a wrong sign."""
MENDED = {"force": ForceGain, "acceleration": AccelerationGain}
"""Sensors' laws that turn the sign of a kind of channel, with this gain error:"""
TURNED = -2.0


@dataclass(frozen=True)
class Looked:
    """Records that were looked at.

    Attributes
    ----------
    records : sequence of Record
        Torn and hung samples bridged and marked, rest before the motion left out, channels of the wrong sign turned.
    checks : tuple of Check
        Every look at every record.
    inverted : tuple of (kind, dof)
        Channels whose sign was turned.
    """

    records: list[Record]
    checks: tuple[Check, ...]
    inverted: tuple[tuple[str, int], ...]

    @property
    def turned_by(self) -> tuple[Check, ...]:
        """The looks that showed a wrong sign."""
        return tuple(check for check in self.checks if not check.passed and check.name in SIGNS)

    @property
    def undriven(self) -> str:
        """What is said of a motion that nothing measured drives; empty where nothing is."""
        found = (check.says for check in self.checks if check.name == "drive_measured" and not check.passed)
        return next(found, "")


def looked_at(records: Sequence[Record], model: Structure) -> Looked:
    """The records as they can be fitted, and every look at them.

    Raises
    ------
    ValueError
        If a channel is dead, or its size is off by a factor between units: nothing can be fitted then.
    """
    for record in records:
        check_pair(model, record, imposed=True)
    looks = [look(record) for record in records]
    checks = tuple(chain.from_iterable(one.checks for one in looks))
    inverted = tuple(dict.fromkeys(chain.from_iterable(one.inverted for one in looks)))
    _stop_at(checks, records)
    _stop_at_motion(inverted, checks)
    sound = [_sound(record, one, inverted) for record, one in zip(records, looks, strict=True)]
    if model.own is not None:  # what a simulation makes of a force is not asked of its linear part
        return Looked(sound, checks, inverted)
    asked = tuple(chain.from_iterable(beside_model(record, model) for record in sound))
    _stop_at(asked, records)
    opposed = _opposed(asked)
    return Looked([_turned(record, opposed) for record in sound], (*checks, *asked), (*inverted, *opposed))


def _opposed(checks: Sequence[Check]) -> tuple[tuple[str, int], ...]:
    """Forces that the model shows to have the wrong sign."""
    found = (check.of for check in checks if check.name == "follows_model" and not check.passed)
    return tuple(dict.fromkeys(("force", int(name.split()[1])) for name in found))


def held_out_alike(
    holdout: float | Record | Sequence[Record] | None, looked: Looked
) -> float | Sequence[Record] | None:
    """Held-out records, mended and turned as the fitted ones; a share, or None, as it is."""
    if holdout is None or isinstance(holdout, int | float):
        return holdout
    held = [holdout] if isinstance(holdout, Record) else list(holdout)
    for record in held:
        _stop_at(look(record).checks, [record], "holdout")
    return [_turned(mended(record), looked.inverted) for record in held]


def _stop_at(checks: Sequence[Check], records: Sequence[Record], name: str = "record") -> None:
    """Refuse records of which a look shows that nothing can be fitted."""
    found = [check for check in checks if not check.passed and check.name in STOPS]
    if found:
        assumed = "" if all(check.name == "channel_moves" for check in found) else _assumed(records)
        words = "; ".join(dict.fromkeys(check.says for check in found))
        raise ValueError(f"`{name}` cannot be used: {words}. {assumed}".strip())


def _stop_at_motion(inverted: Sequence[tuple[str, int]], checks: Sequence[Check]) -> None:
    """Refuse a displacement or a velocity of the wrong sign, which no sensor's law mends."""
    found = [channel for channel in inverted if channel[0] not in MENDED]
    if found:
        why = "; ".join(check.says for check in checks if not check.passed and check.name in SIGNS)
        turns = "".join(f".turned({channel!r})" for channel in found)
        raise ValueError(f"`record` cannot be used: {why}. Turn the sign where it is wrong: record{turns}.")


def _assumed(records: Sequence[Record]) -> str:
    """Units that nobody stated."""
    taken = {kind: record.units[kind] for record in records for kind, _ in record.channels if kind not in record.stated}
    if not taken:
        return ""
    return f"No unit was stated of {', '.join(taken)}: {', '.join(taken.values())} assumed. State it: units={{...}}."


def _sound(record: Record, found: Look, inverted: Sequence[tuple[str, int]]) -> Record:
    sound = mended(record)
    notes = [f"{capitalised(words)}." for words in rest_words(record, found.span)]
    part = sound[found.span.begin :] if found.span.begin > 0 else sound
    return _turned(part.noted(*notes) if notes else part, inverted)


def _turned(record: Record, inverted: Sequence[tuple[str, int]]) -> Record:
    for channel in inverted:
        if channel in record.channels:
            record = record.turned(channel)
    return record
