"""A verdict with every step that led to it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from ..evidence.plain import as_plain
from .checks import Check

MODEL = "model"
"""What a check is of that concerns no hypothesis but the model and its records."""


SHAPE = "other shapes would gain beside it"
"""Name of the factor that doubts the shape of a law, and says nothing against its class."""


class Factor(NamedTuple):
    """One of the factors whose product is a probability."""

    name: str
    size: float


def product_of(factors: Sequence[Factor]) -> float:
    """The probability of these factors; 0 where there are none."""
    return math.prod(factor.size for factor in factors) if factors else 0.0


@dataclass(frozen=True)
class Decision:
    """A verdict, and how it was reached.

    Attributes
    ----------
    verdict : str
        ``consistent``, ``parameters``, ``cause``, ``unnamed`` or ``undecided``.
    winner : str
        Key of the hypothesis that it rests on.
    checks : tuple of Check
        Every comparison in the order in which it was made. The last row of a verdict that is ``undecided`` by a check
        is `stopped_by`.
    factors : mapping
        Factors of the probability of every alternative, by key.
    explained : mapping
        Share of the refitted model's excess that every candidate explains, by key.
    reasons : mapping
        Why a candidate was not named, by key; empty for one that was.
    stopped_by : Check, optional
        The check that left the verdict undecided.
    near : str, optional
        Key of a law that is of the right class though not of the right shape.
    model_error : float
        Share of the elastic force that was admitted as model error to all hypotheses.
    finished : bool
        Whether the search behind it was finished.
    """

    verdict: str
    winner: str
    checks: tuple[Check, ...]
    factors: Mapping[str, tuple[Factor, ...]]
    explained: Mapping[str, float]
    reasons: Mapping[str, str]
    stopped_by: Check | None = None
    near: str | None = None
    model_error: float = 0.0
    finished: bool = True

    def probability(self, key: str) -> float:
        """Probability of a hypothesis; 0 for one that is no alternative."""
        return product_of(self.factors.get(key, ()))

    def probability_of_class(self, key: str) -> float:
        """Probability that a hypothesis adds to those of its classes: whether its shape is right does not matter."""
        return product_of([factor for factor in self.factors.get(key, ()) if factor.name != SHAPE])

    def less_sure(self, name: str, size: float = 0.5) -> "Decision":
        """The decision less sure of every cause, half as sure by default."""
        factors = {
            key: (*each, Factor(name, size)) if key in self.explained else each for key, each in self.factors.items()
        }
        return replace(self, factors=factors)

    def refused(self, why: str, instead: str, by: Check) -> "Decision":
        """The decision without its winner, which a check speaks against."""
        factors = {**self.factors, self.winner: (*self.factors.get(self.winner, ()), Factor(why, 0.0))}
        reasons = {**self.reasons, self.winner: why}
        return replace(self, verdict="undecided", winner=instead, factors=factors, reasons=reasons, stopped_by=by)

    @property
    def plain(self) -> dict[str, Any]:
        """For JSON, without loss."""
        return as_plain(self)

    @classmethod
    def of_plain(cls, written: Mapping[str, Any]) -> "Decision":
        """What `plain` was made of."""

        def check(row: Mapping[str, Any]) -> Check:
            return Check(**{**row, "measured": float(row["measured"]), "threshold": float(row["threshold"])})

        stopped = written["stopped_by"]
        made = {
            "checks": tuple(check(row) for row in written["checks"]),
            "factors": {
                k: tuple(Factor(f["name"], float(f["size"])) for f in v) for k, v in written["factors"].items()
            },
            "explained": {k: float(v) for k, v in written["explained"].items()},
            "stopped_by": None if stopped is None else check(stopped),
        }
        return cls(**{**written, **made})
