"""Records split into a part that is fitted and a part that is held out to measure the gain on."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...records import Record, noise_floor

_LATER = "What the model lacks shows in the last part only: that was fitted, and the gain is that of the first part."
_BLOCKS = 50
"""Pieces of a record whose power is compared with that of noise."""
_LOUD = 2.0
"""Power of a piece, in those of noise, from which a structure still moves."""
_LEAST = 0.2
"""Share of a released structure's record that is always used."""


@dataclass(frozen=True)
class HeldOut:
    """A record on which the gain is measured; samples before `begin` were fitted, and do no more than lead there.

    It is a part `of` a fitted record, or of none.
    """

    record: Record
    begin: int = 0
    of: int | None = None

    def led_by(self, samples: int) -> tuple[Record, int]:
        """The record from so many samples before what was held out, and where that begins in it.

        A released structure is led there from its release.
        """
        lead = min(samples, self.begin) if self.record.driven else self.begin
        return self.record[self.begin - lead :], lead


def split(
    record: Record | Sequence[Record], holdout, first: bool = False
) -> tuple[list[tuple[Record, int]], list[HeldOut]]:
    """Records with the number of their samples that are fitted, and the records on which the gain is measured.

    If `holdout` is a share, the samples belong to the records and are predicted, or with `first` are not seen.
    """
    records = _checked(_as_list(record))
    if not isinstance(holdout, int | float):
        whole = [] if holdout is None else _as_list(holdout)
        return [(r, len(r)) for r in records], [HeldOut(r) for r in whole]
    if not 0 < holdout < 1:
        raise ValueError(
            f"`holdout` as a share must lie between 0 and 1, e.g. 0.3; got {holdout}. None keeps nothing back."
        )
    part = _first if first else _last
    parts = [part(r, holdout, i) for i, r in enumerate(records)]
    return [fitted for fitted, _ in parts], [held for _, held in parts]


def _as_list(records: Record | Sequence[Record]) -> list[Record]:
    return [records] if isinstance(records, Record) else list(records)


def _checked(records: list[Record]) -> list[Record]:
    """The records to fit.

    Raises
    ------
    ValueError, TypeError
        If there are none, or one is no record.
    """
    if not records:
        raise ValueError("`record` must hold at least one record; the sequence is empty.")
    for item in records:
        if not isinstance(item, Record):
            raise TypeError(f"`record` must be a jfsm.Record or a sequence of them; got {type(item).__name__}.")
    return records


def _first(record: Record, share: float, which: int) -> tuple[tuple[Record, int], HeldOut]:
    """The first part held out."""
    begin = int(round(share * len(record)))
    return (record[begin:].noted(_LATER), len(record) - begin), HeldOut(record[:begin], of=which)


def _last(record: Record, share: float, which: int) -> tuple[tuple[Record, int], HeldOut]:
    """The last part held out; of a released structure that of its motion, which is run from the release."""
    moving = len(record) if record.driven else moves_for(record)
    end = int(round((1 - share) * moving))
    return (record, end), HeldOut(record[:moving], end, which)


def moves_for(record: Record) -> int:
    """Samples until every response has died away into noise."""
    if len(record) < 2 * _BLOCKS:
        return len(record)
    blocks, last = np.array_split(np.arange(len(record)), _BLOCKS), 0
    for y in record.responses.values():
        noise, rest = noise_floor(y, record.dt).std, np.mean(y[blocks[-1]])
        loud = [block[-1] + 1 for block in blocks if np.mean((y[block] - rest) ** 2) > _LOUD * noise**2]
        last = max(last, *loud) if loud else last
    return max(int(last), int(_LEAST * len(record))) if last else len(record)
