"""Outcomes of a calculation: how it ended, values with their intervals, and comparisons with a limit."""

import enum
import operator
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple


class Result(enum.Enum):
    """How a calculation ended; the value is a message a person can act on."""

    successful = "converged"
    maximum_steps = "stopped at the largest number of iterations before it converged; the values may still move"
    stalled = "no further improvement was possible from the last values; the start may lie in the wrong basin"
    diverged = "the simulated motion left every bound; see the time of escape"
    unfinished = "the curve ends before the range that was asked for; narrow the range, or follow it in smaller steps"

    @property
    def ok(self) -> bool:
        """Whether the answer can be used without reserve."""
        return self is Result.successful


@dataclass(frozen=True)
class Estimate:
    """A value with its 95 % interval and unit."""

    value: float
    low: float
    high: float
    unit: str


Relation = Literal[">=", "<=", ">", "<"]
_HOLDS = {">=": operator.ge, "<=": operator.le, ">": operator.gt, "<": operator.lt}


def holds(measured: float, relation: Relation, limit: float) -> bool:
    """Whether what was measured stands in this relation to a limit."""
    return bool(_HOLDS[relation](measured, limit))


class Check(NamedTuple):
    """One comparison: what was measured of which channel or hypothesis, the limit, and the outcome."""

    stage: str
    name: str
    of: str
    measured: float
    relation: Relation
    threshold: float
    unit: str
    passed: bool
    says: str

    @classmethod
    def of_plain(cls, written: Mapping[str, Any]) -> "Check":
        """What was written to JSON, infinite numbers as words."""
        return cls(**{**written, "measured": float(written["measured"]), "threshold": float(written["threshold"])})
