"""A verdict with every step that led to it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from ...reporting import why_text
from ..evidence.plain import as_plain
from .checks import Check

MODEL = "model"
"""What a check is of that concerns no hypothesis but the model and its records."""


SHAPE = "other shapes would gain beside it"
EXPLAINED = "share of the excess that"
"""Names of the factors, or what they begin with, that doubt the shape of a law, and that it is all: neither speaks
against its class."""


class Factor(NamedTuple):
    """One of the factors whose product is a probability."""

    name: str
    size: float


def product_of(factors: Sequence[Factor]) -> float:
    """The probability of these factors; 0 where there are none."""
    return math.prod(factor.size for factor in factors) if factors else 0.0


class Explanation(str):
    """Text that shows itself as it reads, in lines."""

    def __repr__(self) -> str:
        return str(self)


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
        Every comparison in the order in which it was made; `stopped_by` is among them, not always the last.
    factors : mapping
        Factors of the probability of every alternative, by key.
    explained : mapping
        Share of the refitted model's excess that every candidate explains, by key.
    reasons : mapping
        Why a candidate was not named, by key; empty for one that was.
    stopped_by : Check, optional
        The check that left the verdict undecided.
    near : tuple of str
        Keys of laws that are of the right class though not of the right shape, the likeliest first.
    model_error : float
        Share of the elastic force that was admitted as model error to all hypotheses.
    finished : bool
        Whether the search behind it was finished.
    since : int
        Place in `checks` at which the judgement that stands begins: what comes before was judged anew.
    """

    verdict: str
    winner: str
    checks: tuple[Check, ...]
    factors: Mapping[str, tuple[Factor, ...]]
    explained: Mapping[str, float]
    reasons: Mapping[str, str]
    stopped_by: Check | None = None
    near: tuple[str, ...] = ()
    model_error: float = 0.0
    finished: bool = True
    since: int = 0

    def probability(self, key: str) -> float:
        """Probability of a hypothesis; 0 for one that is no alternative."""
        return product_of(self.factors.get(key, ()))

    def probability_of_class(self, key: str) -> float:
        """Probability that a hypothesis adds to those of its classes: that something of them acts says neither that its
        shape is right nor that it is all."""
        every = self.factors.get(key, ())
        return product_of([factor for factor in every if not factor.name.startswith((SHAPE, EXPLAINED))])

    @property
    def of_a_class_alone(self) -> bool:
        """Whether a class is found whose law has other numbers in other motions: as it was fitted it predicts none."""
        return any(row.name == "class_as_large_again" and row.passed and row.of == self.winner for row in self.checks)

    def less_sure(self, name: str, size: float = 0.5) -> "Decision":
        """The decision less sure of every cause, half as sure by default."""
        factors = {
            key: (*each, Factor(name, size)) if key in self.explained else each for key, each in self.factors.items()
        }
        return replace(self, factors=factors)

    def after(self, earlier: Sequence[Check]) -> "Decision":
        """The decision with the checks that were made before it."""
        return replace(self, checks=(*earlier, *self.checks), since=len(earlier) + self.since)

    def refused(self, why: str, instead: str, by: Check) -> "Decision":
        """The decision without its winner, which a check speaks against."""
        factors = {**self.factors, self.winner: (*self.factors.get(self.winner, ()), Factor(why, 0.0))}
        reasons = {**self.reasons, self.winner: why}
        return replace(self, verdict="undecided", winner=instead, factors=factors, reasons=reasons, stopped_by=by)

    def why(self, cause: str | None = None) -> Explanation:
        """The checks that decided, or those of one cause, in words.

        Parameters
        ----------
        cause : str, optional
            Id or name of a cause, ``map``, or the key of a hypothesis (``given``, ``refitted``, ``coulomb@0-1``).

        Raises
        ------
        LookupError
            If no hypothesis has it; the message names those that come close.
        """
        return Explanation(why_text({"verdict": self.verdict, "decision": self.plain}, cause))

    @property
    def plain(self) -> dict[str, Any]:
        """For JSON, without loss."""
        return as_plain(self)

    @classmethod
    def of_plain(cls, written: Mapping[str, Any]) -> "Decision":
        """What `plain` was made of."""
        stopped = written["stopped_by"]
        made = {
            "checks": tuple(map(Check.of_plain, written["checks"])),
            "factors": {
                k: tuple(Factor(f["name"], float(f["size"])) for f in v) for k, v in written["factors"].items()
            },
            "explained": {k: float(v) for k, v in written["explained"].items()},
            "near": tuple(written["near"]),
            "stopped_by": None if stopped is None else Check.of_plain(stopped),
        }
        return cls(**{**written, **made})
