"""From evidence to a verdict: checks in stages, then one table of verdicts.

A cause must do three things: be more probable than its absence, explain at least half of the power that a refit of the
model leaves, and do so on every set of samples, held-out ones included. Where the winner leaves only noise, its
evidence is trusted as it is; where it does not, evidence counts no more than some tens of independent looks, and no
cause is more probable than the share of the power that it explains. A cause is rejected if a score test shows that
forces of another shape would add more than a small fraction of its own gain in log-likelihood, or would explain half of
its residual; below that limit its probability is reduced, at most by half. Of measured structures no law is exactly
true: where what a law of the wrong shape leaves is negligible, though not noise, its class is right if nothing else
stands and runs over held-out readings confirm it.
"""

from collections.abc import Sequence
from dataclasses import replace

from ..evidence import excess
from ..evidence.evidence import Evidence, has_map
from ..evidence.scorecard import GIVEN, REFITTED
from ..thresholds import THRESHOLDS, Thresholds
from .bench import Bench
from .checks import checked
from .confirmed import MOST_NEAR, confirm, stays_in_step
from .decision import MODEL, Decision
from .judgement import decided
from .late_forces import beside_late_forces
from .right_shape import WRONG_SHAPE


def judge(evidence: Evidence, limits: Thresholds = THRESHOLDS) -> Decision:
    """The verdict that follows from the evidence, with every check that led to it."""
    return after_looks(judge_in_sign(evidence, limits), evidence)


def judge_in_sign(evidence: Evidence, limits: Thresholds = THRESHOLDS) -> Decision:
    """The verdict on all but what was looked at before: the signs of the channels are right.

    It is reached anew where predictions over some periods make the model consistent and a run over all held-out
    readings does not.
    """
    return beside_late_forces(_judged(evidence, limits), evidence.setting, limits)


def after_looks(decision: Decision, evidence: Evidence) -> Decision:
    """The verdict with what was looked at before it; a channel of the wrong sign is a cause, whatever else is."""
    decision = decision.after(evidence.looks)
    return replace(decision, verdict="cause", stopped_by=None) if evidence.setting.turned else decision


def _judged(evidence: Evidence, limits: Thresholds) -> Decision:
    """The verdict on all but the times of the forces."""
    decision = _concluded(evidence, limits, long_run=False)
    row = stays_in_step(evidence_behind(decision, evidence), limits) if decision.verdict == "consistent" else None
    if row is None:
        return decision
    if row.passed:
        return replace(decision, checks=(*decision.checks, row))
    again = _concluded(evidence, limits, long_run=True)
    return again.after((*decision.checks, row))


def evidence_behind(decision: Decision, evidence: Evidence) -> Evidence:
    """The evidence that a decision rests on: where a model error was admitted, that with it."""
    other = evidence.with_model_error() if decision.model_error else None
    return evidence if other is None else other


def _concluded(evidence: Evidence, limits: Thresholds, *, long_run: bool) -> Decision:
    decision = _with_model_error(_decided(evidence, limits, long_run), evidence, limits, long_run)
    behind = evidence_behind(decision, evidence)
    decision = _beside_clipping(decision, evidence.setting.clipped)
    return confirm(decision, behind, limits, long_run=long_run)


def _with_model_error(decision: Decision, evidence: Evidence, limits: Thresholds, long_run: bool) -> Decision:
    """Where no cause was named, the verdict on evidence that admits some model error to all hypotheses.

    If measurement noise is the only admitted error, an almost-right model converges to biased values or not at all, and
    log-evidences are not comparable.
    """
    if not evidence.setting.finished:
        return _cut_short(decision)
    if decision.winner not in (GIVEN, REFITTED) and not has_map(decision.winner):
        return decision
    other = evidence.with_model_error()
    if other is None:
        return decision
    if not other.setting.finished:
        return _cut_short(decision)
    again = _decided(other, limits, long_run)
    reasons = {**decision.reasons, **again.reasons}  # some are not compared once more
    return replace(again, reasons=reasons).after(decision.checks)


def _decided(evidence: Evidence, limits: Thresholds, long_run: bool) -> Decision:
    """The verdict over all candidates, or over single effects where two were likelier, and not of the right shape.

    What the second one should be is open then, not the first, if that explains almost all. Nothing changes where a map
    stands for both.
    """
    decision = decided(Bench(evidence, limits, evidence.candidates, long_run))
    if _may_be_one_of_two(decision, evidence, limits):
        singles = [c for c in evidence.candidates if len(c.effects) == 1]
        alone = decided(Bench(evidence, limits, singles, long_run))
        if alone.verdict == "cause" and excess.almost_all(evidence.cards[alone.winner], evidence.refitted, limits):
            explained = {**decision.explained, **alone.explained}
            reasons = {**decision.reasons, **alone.reasons}
            decision = replace(alone, explained=explained, reasons=reasons).after(decision.checks)
    return _same_in_all_records(decision, evidence, limits)


def _pair_refused(decision: Decision, evidence: Evidence) -> bool:
    """Whether two effects were refused for their shape, or as these records cannot show them."""
    pairs, by = [c.key for c in evidence.candidates if len(c.effects) > 1], decision.stopped_by
    unseen = by is not None and by.name == "identifiable_here" and by.of in pairs
    return unseen or any(decision.reasons[key] == WRONG_SHAPE for key in pairs)


def _may_be_one_of_two(decision: Decision, evidence: Evidence, limits: Thresholds) -> bool:
    """Whether two effects were refused, and held-out readings do not confirm their classes."""
    if decision.verdict != "undecided" or not _pair_refused(decision, evidence):
        return False
    errors = (evidence.held_out(near) for near in decision.near[:MOST_NEAR])
    return not any(one is not None and one.closed >= limits.nearly_all for one in errors)


def _same_in_all_records(decision: Decision, evidence: Evidence, limits: Thresholds) -> Decision:
    """What a law depends on is open where its numbers are not the same in all records."""
    card = evidence.cards.get(decision.winner)
    if card is None or decision.verdict != "cause" or card.differs == 1.0:
        return decision
    times, most = card.differs, 1.0 + limits.differs
    says = f"a number of its law in one record is {times:.3g} times that in another; {most:.3g} times at most"
    row = checked("same_in_all_records", card.key, times, most, says)
    decision = replace(decision, checks=(*decision.checks, row))
    return decision if row.passed else decision.less_sure("records differ in its numbers")


def _cut_short(decision: Decision) -> Decision:
    """The verdict of a search that was not finished: half as sure of a cause, and undecided without one."""
    says = "the search was not finished, and what was not tried may explain it as well"
    row = checked("finished", MODEL, 0, 1, says)
    instead = replace(
        decision.less_sure("the search was not finished"), near=(), finished=False, checks=(*decision.checks, row)
    )
    if decision.verdict == "cause":
        return instead
    winner = decision.winner if decision.winner in (GIVEN, REFITTED) or has_map(decision.winner) else REFITTED
    return replace(instead, verdict="undecided", winner=winner, stopped_by=row)


def _beside_clipping(decision: Decision, clipped: Sequence[tuple[str, int]]) -> Decision:
    """The verdict once channels are known to be clipped: a cause, whatever else cannot be told.

    A clipped force drives with peaks that are guessed: what they leave is no effect of its own.
    """
    rows = tuple(
        checked("no_clipping", f"clipping@{kind}:{j}", 1, 0, f"{kind} {j} is cut off at a limit") for kind, j in clipped
    )
    if not rows:
        return decision
    decision = decision.after(rows)
    if decision.verdict in ("consistent", "parameters"):
        return replace(decision, verdict="cause")
    guessed = any(kind == "force" for kind, _ in clipped)
    if decision.verdict == "undecided" or (decision.verdict == "unnamed" and guessed):
        return replace(decision, verdict="cause", winner=REFITTED, stopped_by=None)
    return decision
