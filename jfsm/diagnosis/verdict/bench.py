"""What is known while a verdict is reached: evidence, limits, the log, reasons, and probabilities by their factors."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from ..evidence import excess
from ..evidence.evidence import Evidence, Predicted
from ..evidence.scorecard import Scorecard
from ..thresholds import Thresholds
from .checks import Check, checked
from .decision import Factor, product_of


@dataclass
class Bench:
    """The state of one judgement over some of the candidates of the evidence.

    Where the model is wrong in the `long_run` over held-out readings, predictions over some periods that leave little
    do not make it consistent.
    """

    evidence: Evidence
    limits: Thresholds
    candidates: Sequence[Scorecard]
    long_run: bool = False
    log: list[Check] = field(default_factory=list)
    reasons: dict[str, str] = field(default_factory=dict)
    factors: dict[str, list[Factor]] = field(default_factory=dict)
    stopped_by: Check | None = None

    @property
    def given(self) -> Scorecard:
        return self.evidence.given

    @property
    def refitted(self) -> Scorecard:
        return self.evidence.refitted

    @property
    def apart_from_the_drive(self) -> list[Scorecard]:
        """Candidates that do not take the place of the drive."""
        return [card for card in self.candidates if not card.in_step]

    @property
    def passing(self) -> list[Scorecard]:
        """Candidates that nothing speaks against."""
        return [card for card in self.candidates if not self.reasons.get(card.key)]

    def check(self, name: str, of: str, measured: float, limit: float, says: str, unit: str | None = None) -> Check:
        """One comparison, which the log keeps."""
        self.log.append(checked(name, of, measured, limit, says, unit))
        return self.log[-1]

    def stop(self, check: Check) -> None:
        """Keep the check that leaves the verdict undecided; the first one does."""
        self.stopped_by = self.stopped_by or check

    # What the limits make of the evidence

    def noise_only(self, card: Scorecard) -> bool:
        return excess.is_noise_only(card, self.limits)

    def white(self, card: Scorecard) -> bool:
        return excess.white(card, self.limits)

    def left(self, card: Scorecard) -> float:
        return excess.left(card, self.limits)

    def explained(self, card: Scorecard | Predicted, baseline: Scorecard | None = None) -> float:
        """Share of a baseline's excess that is explained; of the refitted model's where none is given."""
        return excess.explained(card, baseline or self.refitted, self.limits)

    def shows(self, card: Scorecard) -> bool:
        """Whether predictions of a hypothesis leave anything to explain on any set."""
        return bool(excess.unexplained(card, self.limits).any())

    # Probabilities

    def share_out(self, shares: Mapping[str, float]) -> None:
        """Begin with these shares among the alternatives."""
        self.factors = {key: [Factor("share among the alternatives", share)] for key, share in shares.items()}

    def probability(self, key: str) -> float:
        """Probability of a hypothesis so far; 0 for one that is no alternative."""
        return product_of(self.factors.get(key, ()))

    def less_sure(self, keys: Iterable[str], name: str, size: float) -> None:
        """One more factor of the probabilities of some alternatives."""
        for key in keys:
            if key in self.factors:
                self.factors[key].append(Factor(name, size))

    def refuse(self, key: str, why: str) -> None:
        """No alternative any more, for this reason."""
        self.reasons[key] = why
        self.factors.setdefault(key, []).append(Factor(why, 0.0))
