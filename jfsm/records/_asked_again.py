"""What was found of a channel, for whoever asks the same again."""

from collections.abc import Callable
from functools import lru_cache, wraps
from hashlib import blake2b
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

Found = TypeVar("Found")

_KEPT = 16
"""Answers of a function that are kept, those asked for last."""


class _Channel:
    """Samples with a step, equal to every other with the same numbers; only what tells them apart is kept."""

    def __init__(self, y: np.ndarray, dt: float):
        self.y, self.dt = y, dt
        self.key = y.shape, dt, blake2b(y.tobytes()).digest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Channel) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)


def kept(find: Callable[[np.ndarray, float], Found]) -> Callable[[ArrayLike, float], Found]:
    """A function of the samples and the step of a channel that finds the same thing once; it may not be changed."""

    @lru_cache(_KEPT)
    def once(channel: _Channel) -> Found:
        y, channel.y = channel.y, np.empty(0)
        return find(y, channel.dt)

    @wraps(find)
    def asked(y: ArrayLike, dt: float) -> Found:
        return once(_Channel(np.asarray(y, dtype=np.float64), dt))

    return asked
