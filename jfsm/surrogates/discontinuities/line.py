"""A line across which the force may jump or kink, and the functions that stand for it in a regression."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Kind = Literal["jump", "kink"]


@dataclass(frozen=True)
class Line:
    """A candidate along one direction, in coordinates where the range is [-1, 1]."""

    kind: Kind
    direction: int
    offset: float
    confidence: float = 0.0

    def columns(self, s: NDArray[np.float64], width: float = 0.0) -> NDArray[np.float64]:
        """Step and hinge of a jump, hinge of a kink; blurred to tanh and softplus over `width`."""
        step, hinge = step_and_hinge(s[self.direction] - self.offset, width)
        return np.stack([step, hinge] if self.kind == "jump" else [hinge], axis=1)

    def shift(self, s: NDArray[np.float64], width: float = 0.0) -> NDArray[np.float64]:
        """Minus the derivative of the first column by the offset, as the column that corrects it."""
        u = s[self.direction] - self.offset
        if self.kind == "jump":  # of a blurred one only
            return (0.5 / width / np.cosh(np.clip(u / width, -300.0, 300.0)) ** 2)[:, None]
        return step_and_hinge(u, width)[0][:, None]

    @property
    def price(self) -> float:
        """Parameters beyond the polynomial, in units of log n / 2: the place of a jump costs twice that of a kink."""
        return 4.0 if self.kind == "jump" else 2.0


def step_and_hinge(u: NDArray[np.float64], width: float = 0.0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """U(u) and u U(u), or tanh and softplus over `width`."""
    if width == 0.0:
        return (u >= 0.0).astype(float), np.maximum(u, 0.0)
    return 0.5 * (1.0 + np.tanh(u / width)), 0.5 * (u + width * np.logaddexp(u / width, -u / width))


def all_but(lines: Sequence[Line], k: int) -> list[Line]:
    """The lines without the k-th."""
    return [*lines[:k], *lines[k + 1 :]]
