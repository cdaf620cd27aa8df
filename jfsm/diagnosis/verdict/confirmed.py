"""What runs over held-out readings say of a verdict."""

from collections.abc import Callable
from dataclasses import replace

from ..evidence import excess
from ..evidence.evidence import Evidence, has_map
from ..evidence.held_out import HeldOutErrors
from ..evidence.scorecard import GIVEN, REFITTED, Scorecard
from ..thresholds import Thresholds
from .bench import Bench
from .checks import Check, checked
from .decision import MODEL, Decision

_NEAR = "is of the right class, though not quite of the right shape"
MOST_NEAR = 3
"""Laws that are near, at most, whose runs over held-out readings are made."""
Objection = tuple[Check, str] | None
"""A check that a verdict does not pass, and why it is refused then."""


def stays_in_step(evidence: Evidence, limits: Thresholds) -> Check | None:
    """Whether the model, right over some periods, is so in the whole run over held-out readings, refitted or not."""
    errors = evidence.held_out(GIVEN)
    if errors is None:
        return None
    times = min(errors.before, errors.refitted) / max(errors.floor, limits.negligible)
    what = "the force predicted" if evidence.setting.imposed else "a run"
    says = (
        f"{what} over all held-out readings is {times:.3g} times as wrong as noise makes it; {limits.worse:.3g} at most"
    )
    return checked("stays_in_step", MODEL, times, limits.worse, says)


def confirm(decision: Decision, evidence: Evidence, limits: Thresholds, *, long_run: bool) -> Decision:
    """The verdict as held-out readings leave it."""
    errors = evidence.held_out(GIVEN if decision.verdict == "consistent" else decision.winner)
    if errors is None:
        return decision
    hearing = _Hearing(decision, evidence, Bench(evidence, limits, evidence.candidates, long_run), errors)
    against = hearing.objection()
    if against is not None:
        decision = decision.refused(against[1], REFITTED, against[0])
    elif hearing.closes_too_little():
        decision = decision.less_sure("runs over held-out readings close less than half")
    open_yet = decision.verdict in ("undecided", "unnamed")
    by_class = _of_its_class(decision, hearing) if open_yet else None
    return replace(by_class or decision, checks=(*decision.checks, *hearing.bench.log))


def _of_its_class(decision: Decision, hearing: "_Hearing") -> Decision | None:
    """The decision with the first of the laws that are near named that runs over held-out readings confirm."""
    bench, least = hearing.bench, hearing.bench.limits.half
    for near in decision.near[:MOST_NEAR]:
        errors = bench.evidence.held_out(near)
        if errors is None:
            return None
        says = (
            f"closes {errors.closed:.0%} of the error on held-out readings; {least:.0%} are needed of a law of the "
            "right class alone"
        )
        if bench.check("class_closes_half", near, errors.closed, least, says).passed or _found_again(near, bench):
            reasons = {**decision.reasons, near: _NEAR}
            return replace(decision, verdict="cause", winner=near, reasons=reasons, stopped_by=None)
    return None


def _found_again(near: str, bench: Bench) -> bool:
    """Whether held-out readings alone show the class of a law again, and as large: of a law that is not of the right
    shape the numbers turn on the motion."""
    again, limits = bench.evidence.found_again(near), bench.limits
    if again is None:
        return False
    says = (
        f"{again.law}, fitted to the held-out readings alone, explains {again.explains:.0%} of what the refitted model "
        f"leaves there; {limits.nearly_all:.0%} are needed of a class whose laws have other numbers there"
    )
    if not bench.check("class_found_again", near, again.explains, limits.nearly_all, says).passed:
        return False
    most = 1.0 + limits.differs
    says = (
        f"is {again.size:.4g} large on the held-out readings and {again.before:.4g} in what was fitted; "
        f"{most:.3g} times that at most"
    )
    return bool(bench.check("class_as_large_again", near, again.apart, most, says).passed)


class _Hearing:
    """A verdict before runs over held-out readings."""

    def __init__(self, decision: Decision, evidence: Evidence, bench: Bench, errors: HeldOutErrors):
        self.decision, self.bench, self.errors = decision, bench, errors
        self.imposed = evidence.setting.imposed
        self.winner = None if has_map(decision.winner) else evidence.cards[decision.winner]
        self.names = decision.verdict == "cause"
        self.leaves_something = self.names and self.winner is not None and not bench.noise_only(self.winner)

    def objection(self) -> Objection:
        """The first check that the verdict does not pass."""
        checks: tuple[Callable[[], Objection], ...] = (
            self._not_worse,
            self._not_harmful,
            self._gains_where_unsure,
            self._gains_where_unseen,
            self._closes_half,
        )
        return next((found for check in checks if (found := check()) is not None), None)

    def closes_too_little(self) -> bool:
        """Whether a cause that leaves more than noise closes less than half of the error on held-out readings.

        Where it leaves only noise, it is the motion that no run follows for long.
        """
        if not (self.leaves_something and self.winner is not None and self.winner.effects and self.errors.closable):
            return False
        high, half = self.errors.interval[1], self.bench.limits.half
        says = f"closes {high:.0%} of the error on held-out readings at most; at least {half:.0%} is needed"
        return not self._check("closes_half", high, half, says).passed

    def _check(self, name: str, measured: float, limit: float, says: str) -> Check:
        return self.bench.check(name, self.decision.winner, measured, limit, says)

    def _not_worse(self) -> Objection:
        if self.decision.verdict not in ("parameters", "cause", "unnamed"):
            return None
        most, errors = self.bench.limits.worse, self.errors
        times = errors.after / max(errors.before, errors.floor)
        error = "its error of the predicted force" if self.imposed else "its error"
        says = (
            f"{error} on held-out readings is {errors.after:.0%} of the signal; the model as given has "
            f"{errors.before:.0%}, noise leaves {errors.floor:.0%}: {times:.3g} times the larger; {most:.3g} at most"
        )
        return self._refused(self._check("not_worse", times, most, says))

    def _not_harmful(self) -> Objection:
        if not self.leaves_something or not self.errors.closable:
            return None
        high = self.errors.interval[1]
        says = f"closes {high:.0%} of the error on held-out readings at most; it must not add to it"
        return self._refused(self._check("gains_something", high, 0.0, says))

    def _refused(self, row: Check) -> Objection:
        how = "predicts" if self.imposed else "runs"
        return None if row.passed else (row, f"{how} worse on held-out readings than the model as given")

    def _gains_where_unsure(self) -> Objection:
        if not self.leaves_something or self.decision.probability(self.decision.winner) >= self.bench.limits.named:
            return None
        return self._gains("is not likely, leaves something, and is not confirmed by held-out readings")

    def _gains_where_unseen(self) -> Objection:
        card = self.winner
        if not self.names or card is None or not card.laws or self.decision.explained[card.key] != 0.0:
            return None
        if self._is_beyond_question(card):
            return None
        return self._gains("explains nothing that predictions leave, and is not confirmed by held-out readings")

    def _is_beyond_question(self, card: Scorecard) -> bool:
        bench = self.bench
        ahead = card.evidence - max(bench.given.evidence, bench.refitted.evidence)
        return ahead > bench.limits.beyond_question and excess.is_noise_only(card, bench.limits)

    def _gains(self, why: str) -> Objection:
        low = self.errors.interval[0] if self.errors.closable else 0.0
        says = f"closes {low:.0%} of the error on held-out readings at least; it must close some"
        row = self._check("gains_something", low, 0.0, says)
        return None if row.passed else (row, why)

    def _closes_half(self) -> Objection:
        """Of a map; and of anything where the model is wrong in the long run alone."""
        if not (self.decision.verdict == "unnamed" or self.bench.long_run) or not self.errors.closable:
            return None
        closed, half = self.errors.closed, self.bench.limits.half
        says = f"closes {closed:.0%} of the error on held-out readings; at least {half:.0%} is needed"
        row = self._check("closes_half", closed, half, says)
        return None if row.passed else (row, "closes less than half of the error on held-out readings")
