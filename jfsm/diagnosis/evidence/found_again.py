"""Whether a class of laws is found again in readings that took no part in a fit."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class FoundAgain:
    """The likeliest law of a class that is fitted to held-out readings alone, in words.

    It `explains` a share of what the refitted model leaves there; its `size`, as the class has it, is beside that of
    the law that was fitted `before`, along the motion that was fitted.
    """

    law: str
    explains: float
    size: float
    before: float

    @property
    def apart(self) -> float:
        """The larger of the two sizes in those of the smaller; infinite where their signs differ."""
        times = self.size / self.before if self.before else 0.0
        return max(times, 1 / times) if times > 0 else math.inf
