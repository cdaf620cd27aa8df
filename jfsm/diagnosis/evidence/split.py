"""Records split into a part that is fitted and a part that is held out to measure the gain on."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...records import Record, drives_until, records_of, span_of_motion, way_gone

_LATER = "What the model lacks shows in the last part only: that was fitted, and the gain is that of the first part."
_STILL = (
    "The last {} of the time hold {:.0%} of the motion only: the part held out begins earlier, where {:.0%} are left."
)
LITTLE = 0.5
"""What the last part of a driven record moves, in its share of the time, below which the way splits it."""


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
    records = records_of(record)
    if not isinstance(holdout, int | float):
        whole = [] if holdout is None else records_of(holdout)
        return [(r, span_of_motion(r).end) for r in records], [HeldOut(r[: span_of_motion(r).end]) for r in whole]
    if not 0 < holdout < 1:
        raise ValueError(
            f"`holdout` as a share must lie between 0 and 1, e.g. 0.3; got {holdout}. None keeps nothing back."
        )
    part = _first if first else _last
    parts = [part(r, holdout, i) for i, r in enumerate(records)]
    return [fitted for fitted, _ in parts], [held for _, held in parts]


def _first(record: Record, share: float, which: int) -> tuple[tuple[Record, int], HeldOut]:
    """The first part held out."""
    moving = span_of_motion(record).end
    begin = int(round(share * moving))
    return (record[begin:].noted(_LATER), moving - begin), HeldOut(record[:begin], of=which)


def _last(record: Record, share: float, which: int) -> tuple[tuple[Record, int], HeldOut]:
    """The last part of the motion held out; that of a released structure is run from the release.

    A structure that a force drives all the time and that hardly moves in that part, as a machine does that is held at
    its goal, would tell nothing there: the last part of its way is held out instead.
    """
    moving = span_of_motion(record).end
    end = int(round((1 - share) * moving))
    if record.driven and drives_until(record) > end:
        gone = way_gone(record[:moving])
        if 1 - gone[end] < LITTLE * share:
            record = record.noted(_STILL.format(f"{share:.0%}", 1 - gone[end], share))
            end = int(np.searchsorted(gone, 1 - share))
    return (record, end), HeldOut(record[:moving], end, which)
