"""One pass through the stages over a bench: admissible, named, sufficient, and the table of verdicts."""

from ..evidence import excess
from ..evidence.evidence import map_on
from ..evidence.scorecard import GIVEN, REFITTED, Scorecard
from ..nats import gains, many
from .admissible import judge_candidates
from .bench import Bench
from .checks import Check
from .decision import MODEL, Decision
from .ranking import is_sure_of, rank
from .right_shape import doubt, nearest, settle_shape

_DECIDING = ("map_adds_little", "visible_in_prediction", "better_than_given")
"""Checks that decide for a map or the model as given whatever else is likely."""


def decided(bench: Bench) -> Decision:
    """The verdict before held-out readings are asked."""
    return _Judgement(bench).decision()


class _Judgement:
    """One pass through the stages over a bench."""

    def __init__(self, bench: Bench):
        self.bench, self.near = bench, ()

    def decision(self) -> Decision:
        """Admissible, named, sufficient; then the table of verdicts."""
        bench = self.bench
        judge_candidates(bench)
        winner = rank(bench)
        verdict = self._by_prediction(winner)
        if verdict == "unnamed" and winner.effects:
            self._name_its_class(winner)
        if verdict == "cause" and not is_sure_of(winner, bench):
            verdict = "undecided"
        if verdict == "cause":
            verdict, winner = self._by_shape(winner)
        elif verdict == "parameters":
            verdict = self._values_are_right(winner)
        elif verdict == "consistent":
            verdict = self._nothing_has_a_shape()
        return self._concluded(verdict, winner)

    def _concluded(self, verdict: str, winner: Scorecard) -> Decision:
        bench = self.bench
        explained = {card.key: bench.explained(card) for card in bench.candidates}
        key = winner.key
        if verdict == "consistent":
            key = GIVEN
        elif verdict == "unnamed":
            key = self._map_for_all(winner)
            mapped = bench.evidence.with_map(key)
            assert mapped is not None
            key, explained = map_on(key), explained | {map_on(key): bench.explained(mapped)}
        elif verdict == "undecided" and winner.effects:
            key = REFITTED
        self._give_reasons(verdict, key)
        return Decision(
            verdict=verdict,
            winner=key,
            checks=tuple(bench.log),
            factors={of: tuple(factors) for of, factors in bench.factors.items()},
            explained=explained,
            reasons=dict(bench.reasons),
            stopped_by=bench.stopped_by if verdict == "undecided" else None,
            near=self.near,
            model_error=bench.evidence.setting.model_error,
        )

    def _give_reasons(self, verdict: str, winner: str) -> None:
        """Every candidate that is not named has a reason: the check that decided, where none speaks against itself."""
        bench = self.bench
        decisive = bench.stopped_by
        if decisive is None or verdict != "undecided":
            decisive = next((row for row in reversed(bench.log) if not row.passed and row.name in _DECIDING), None)
        for card in bench.passing:
            if card.key != winner and decisive is not None:
                bench.reasons[card.key] = decisive.says
        bench.reasons |= {one.key: one.why for one in bench.evidence.set_aside}

    # Detected, and what is left

    def _by_prediction(self, winner: Scorecard) -> str:
        """The verdict as far as evidence and predictions tell."""
        bench, noise_only = self.bench, self._leaves_only_noise(winner)
        if self._nothing_detected(winner, noise_only):
            return "consistent"
        if noise_only:
            return "cause" if winner.effects else "parameters" if winner is bench.refitted else "consistent"
        if not self._map_adds_little(winner):
            return "unnamed"
        if winner.effects:
            return "cause" if self._explains_enough(winner) else "undecided"
        return "parameters" if winner is bench.refitted and self._refit_explains_enough() else self._undecided(winner)

    def _leaves_only_noise(self, card: Scorecard) -> bool:
        """White innovations, of the size of the noise floor, and predictions that leave nothing; the row has the one of
        the three that is the furthest from its limit."""
        limits, left = self.bench.limits, self.bench.left(card)
        measures = (
            (card.whiteness, limits.white, "correlation"),
            (card.noise_scale, limits.noise_scale, "log of a ratio"),
            (left, limits.negligible, "share of the signal"),
        )
        measured, limit, unit = max(measures, key=lambda one: one[0] / one[1])
        says = (
            f"its innovations correlate by {card.whiteness:.2g} from sample to sample (below {limits.white:.2g} is "
            f"white), its noise departs from the floor by {card.noise_scale:.2g}, as a logarithm (below "
            f"{limits.noise_scale:.2g} is the floor), and its predictions leave {left:.2%} of the signal beyond noise "
            f"(below {limits.negligible:.0%} is nothing)"
        )
        return self.bench.check("leaves_only_noise", card.key, measured, limit, says, unit).passed

    def _nothing_detected(self, winner: Scorecard, noise_only: bool) -> bool:
        bench, limits = self.bench, self.bench.limits
        gain, left = winner.evidence - bench.given.evidence, bench.left(bench.given)
        says = f"{winner.label} {gains(gain)} over the model as given; {limits.significant:.4g} are needed"
        better = bench.check("better_than_given", MODEL, gain, limits.significant, says)
        least = limits.negligible
        says = f"predictions of the model as given leave {left:.2%} of the signal beyond noise; {least:.0%} is seen"
        visible = bench.check("visible_in_prediction", MODEL, left, least, says)
        slight = not visible.passed and not bench.long_run
        return (slight and not noise_only) or (not better.passed and (noise_only or slight))

    def _map_adds_little(self, winner: Scorecard) -> bool:
        """No evidence for a map: it was fitted beforehand, and held-out samples judge it.

        A map repeats even the small faults of a law along an imposed motion; and where a model error is admitted, the
        little that a law leaves.
        """
        bench, limits = self.bench, self.bench.limits
        if winner.effects:
            setting = bench.evidence.setting
            if setting.imposed and excess.almost_all(winner, bench.refitted, limits):
                return True
            if setting.model_error and bench.explained(winner) >= limits.nearly_all:
                return True
        mapped = bench.evidence.with_map(winner.key)
        if mapped is None:
            return True
        share = bench.explained(mapped, winner)
        says = f"a map would explain {share:.0%} of what it leaves; less than {limits.half:.0%} is little"
        row = bench.check("map_adds_little", winner.key, share, limits.half, says)
        return bool(row.passed)

    def _explains_enough(self, winner: Scorecard) -> bool:
        """The nearest neighbour of a law that is not in the catalogue explains much of it, and leaves much."""
        bench, limits = self.bench, self.bench.limits
        if bench.left(winner) <= limits.much:
            return True
        share = bench.explained(winner)
        says = (
            f"explains {share:.0%} of what the refitted model leaves, and leaves more than {limits.much:.0%} of the "
            f"signal; at least {limits.nearly_all:.0%} is needed"
        )
        row = bench.check("explains_nearly_all", winner.key, share, limits.nearly_all, says)
        if not row.passed:
            bench.stop(row)
            self._name_its_class(winner)
        return bool(row.passed)

    def _refit_explains_enough(self) -> bool:
        bench, limits = self.bench, self.bench.limits
        share, left = bench.explained(bench.refitted, bench.given), bench.left(bench.refitted)
        says = f"own values explain {share:.0%} of what the model as given leaves; at least {limits.half:.0%} is needed"
        half = bench.check("explains_half_of_excess", REFITTED, share, limits.half, says)
        much = 2 * limits.negligible
        says = f"the refitted model leaves {left:.2%} of the signal beyond noise; less than {much:.0%} is needed"
        little = bench.check("values_leave_little", REFITTED, left, much, says)
        for row in (half, little):
            if not row.passed:
                bench.stop(row)
        return bool(half.passed and little.passed)

    def _undecided(self, winner: Scorecard) -> str:
        """No candidate is an alternative, and the model leaves more than noise."""
        if self.bench.stopped_by is None:
            self.bench.stop(next(row for row in reversed(self.bench.log) if not row.passed and row.of == winner.key))
        return "undecided"

    # The right shape

    def _by_shape(self, winner: Scorecard) -> tuple[str, Scorecard]:
        bench = self.bench
        winner, failed, self.near = settle_shape(winner, bench)
        if failed is None:
            return "cause", winner
        bench.stop(failed)
        return ("unnamed", bench.refitted) if self._map_stands_for_all() else ("undecided", winner)

    def _name_its_class(self, winner: Scorecard) -> None:
        """Beside a map that does better, or where much is left, a class of laws that is sure."""
        if is_sure_of(winner, self.bench):
            self.near = nearest(winner, self.bench)

    def _map_stands_for_all(self) -> bool:
        mapped = self.bench.evidence.with_map(REFITTED)
        return mapped is not None and self.bench.explained(mapped) >= self.bench.limits.half

    def _map_for_all(self, winner: Scorecard) -> str:
        """The map stands for the whole effect, not for what a law left that was not right."""
        return REFITTED if winner.key == REFITTED or self._map_stands_for_all() else winner.key

    def _values_are_right(self, winner: Scorecard) -> str:
        bench, of = self.bench, [winner.key]
        far, check = doubt(winner, winner.evidence - bench.given.evidence, bench)
        bench.less_sure(of, "other shapes would gain beside it", 1.0 - 0.5 * min(far, 1.0))
        if not check.passed:
            bench.less_sure(of, "it is refused", 0.0)
        row = self._probability_of(winner)
        if row.passed:
            return "parameters"
        bench.stop(row if check.passed else check)
        return "undecided"

    def _probability_of(self, winner: Scorecard) -> Check:
        probability, least = self.bench.probability(winner.key), self.bench.limits.named
        says = f"wrong own values have a probability of {probability:.0%}; {least:.0%} are needed"
        return self.bench.check("probability", winner.key, probability, least, says)

    def _nothing_has_a_shape(self) -> str:
        """No cause is likelier than the model, and yet it may not be noise alone that is left."""
        bench, refitted = self.bench, self.bench.refitted
        if not bench.white(refitted):
            return "consistent"
        nats, most = bench.evidence.other_shapes(REFITTED).nats, 2 * bench.limits.other_shapes
        says = f"forces of any shape would gain {many(nats)} nats beside it; {most:.4g} at most may be noise"
        row = bench.check("refit_leaves_no_shape", REFITTED, nats, most, says)
        if not row.passed:
            bench.stop(row)
        return "consistent" if row.passed else "undecided"
