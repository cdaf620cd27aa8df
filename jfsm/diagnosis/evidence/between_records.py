"""Whether records of one structure differ in what they should share."""

import math
from typing import NamedTuple

import numpy as np

from ..thresholds import THRESHOLDS
from .excess import explained, is_noise_only, unexplained
from .fitted import Trial

_APART = 3.0
"""Standard errors between two records from which a number differs between them."""


class Difference(NamedTuple):
    """A number that records do not share, by its path: value and 95 % interval in each."""

    path: str
    intervals: tuple[tuple[float, float, float], ...]

    @property
    def ratio(self) -> float:
        """Its largest size in a record, in those of the smallest in another."""
        sizes = [abs(value) for value, _, _ in self.intervals]
        return max(sizes) / min(sizes) if min(sizes) > 0 else math.inf


def differ(apart: Trial, shared: Trial) -> bool:
    """Whether records differ in what they share in a trial, beside the same where they need not.

    No two measured records are quite alike: they must explain half of what the other leaves, if it leaves anything.
    """
    noise_only = not np.any(unexplained(shared)) and is_noise_only(apart)
    return apart.evidence - shared.evidence > THRESHOLDS.searched and (
        noise_only or explained(apart, shared) >= THRESHOLDS.half
    )


def differences(t: Trial) -> list[Difference]:
    """Numbers of a trial that differ between records by more than their errors."""
    found = []
    for path, records in t.apart.items():
        mine = [k for k, u in enumerate(t.unknowns) if u.path == path]
        theta, variance = t.theta[mine], np.diag(t.covariance)[mine]
        if np.max(np.abs(theta[:, None] - theta) / np.sqrt(variance[:, None] + variance)) > _APART:
            found.append(Difference(path, tuple(t.interval(path, record) for record in records)))
    return found
