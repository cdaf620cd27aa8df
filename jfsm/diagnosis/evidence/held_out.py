"""Errors of runs over held-out readings, beside what noise leaves, and the share of them that is closed."""

from dataclasses import dataclass

_CLOSABLE = 1.05
"""Error before, in floors, from which there is anything to close."""


@dataclass(frozen=True)
class HeldOutErrors:
    """Root mean square errors of free runs, as shares of the channels' spreads (root of the mean over channels).

    `before` is the model as given, `refitted` its own values refitted, `after` the hypothesis, `floor` what noise in
    the drive, in the start and in the readings would leave; `interval` is the 95 % one of `closed`. What an effect
    closes counts `beyond_refit`. Runs are `horizon` long [s] where noise alone makes longer ones part, or where every
    model's goes `astray`: farther from the motion than that is wide.
    """

    before: float
    refitted: float
    after: float
    floor: float
    interval: tuple[float, float]
    beyond_refit: bool = False
    horizon: float | None = None
    astray: bool = False

    @property
    def without(self) -> float:
        """Error of what the hypothesis is an effect beside: the refitted model, else the model as given."""
        return self.refitted if self.beyond_refit else self.before

    @property
    def closable(self) -> bool:
        """Whether the model without the hypothesis leaves more than noise would."""
        return closable(self.without, self.floor)

    @property
    def significant(self) -> bool:
        """Whether the hypothesis predicts better by more than chance."""
        return self.interval[0] > 0

    @property
    def closed(self) -> float:
        """Share of the closable error that is closed: (without - after) / (without - floor), at most 1.

        0 where there was nothing to close.
        """
        return share_closed(self.without, self.after, self.floor)


def share_closed(before: float, after: float, floor: float) -> float:
    """Share of an error above its floor that is closed, at most 1; 0 where there is nothing to close."""
    return min((before - after) / (before - floor), 1.0) if closable(before, floor) else 0.0


def closable(before: float, floor: float) -> bool:
    """Whether an error is above its floor by more than its own uncertainty."""
    return before > _CLOSABLE * floor
