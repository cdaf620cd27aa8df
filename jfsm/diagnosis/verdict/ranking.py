"""How probable the alternatives are, and which of them a name belongs to."""

import math
from collections.abc import Sequence

import numpy as np

from ..evidence import excess
from ..evidence.scorecard import CONSTANT_FORCE, Scorecard
from ..nats import many
from ..thresholds import THRESHOLDS, Thresholds
from .admissible import is_possible
from .bench import Bench
from .claims import Claim, alike, claims_of, holds, shares_a_class, words
from .decision import EXPLAINED

TRACE = "is a trace: laws of other classes gain about as much, where the refitted model leaves nothing"


def rank(bench: Bench) -> Scorecard:
    """The most probable alternative; of a law and its special case that are about as probable, the latter."""
    winner = _most_probable(bench)
    if _is_a_trace(winner, bench):
        for card in bench.passing:
            if card.laws:
                bench.reasons[card.key] = TRACE
        winner = _most_probable(bench)
    passing = bench.passing
    for card in passing:
        if card is not winner:
            bench.reasons[card.key] = "explains it too, but is less probable"
    special = _special_case(winner, passing, bench)
    if special is None:
        return winner
    bench.reasons |= {winner.key: "is hardly more probable than its special case", special.key: ""}
    share = bench.probability(winner.key) / bench.probability(special.key)
    bench.less_sure([special.key], "stands for the wider law, too", 1.0 + share)
    bench.less_sure([winner.key], "its special case stands for it", 0.0)
    return special


def _most_probable(bench: Bench) -> Scorecard:
    alternatives = [bench.given, bench.refitted, *bench.passing]
    _share_out(alternatives, bench)
    return max(alternatives, key=lambda card: bench.probability(card.key))


def _is_a_trace(winner: Scorecard, bench: Bench) -> bool:
    """Whether laws of other classes gain nearly all that the winner gains over a refit that leaves nothing.

    What so many unlike laws explain is a little that the noise's model lacks, and no cause.
    """
    if all(law.role == CONSTANT_FORCE for law in winner.laws) or not bench.noise_only(bench.refitted):
        return False
    known = max(bench.given.evidence, bench.refitted.evidence)
    likeliest = max((card.evidence for card in _single_laws(bench) if not shares_a_class(card, winner)), default=known)
    share = (likeliest - known) / (winner.evidence - known)
    says = f"laws of other classes gain {share:.0%} of what it gains, where the refitted model leaves nothing"
    row = bench.check("more_than_a_trace", winner.key, share, bench.limits.nearly_all, says)
    if not row.passed:
        bench.stop(row)
    return not row.passed


def _single_laws(bench: Bench) -> list[Scorecard]:
    """Alternatives of one law that is possible, and takes no drive's place."""
    return [c for c in bench.apart_from_the_drive if len(c.effects) == 1 and c.laws and is_possible(c, bench)]


def kin_of(winner: Scorecard, bench: Bench) -> list[Scorecard]:
    """The alternatives whose effects are of the same classes as the winner's."""
    return [card for card in bench.candidates if card.key in bench.factors and alike(card, winner)]


def is_sure_of(winner: Scorecard, bench: Bench) -> bool:
    """Whether a name, or at least a class of laws, is probable enough to be said."""
    _beside_likelier_laws(winner, bench)
    likely = {claim: _probability_of(claim, bench) for claim in claims_of(winner)}
    if not bench.noise_only(winner):
        # The rest may be the work of another law than the catalogue's: no name is surer than what it explains.
        name = f"{EXPLAINED} {winner.label} explains"
        bench.less_sure(list(bench.factors), name, bench.explained(winner))
    probability, limits = bench.probability(winner.key), bench.limits
    says = f"has a probability of {probability:.0%}; {limits.named:.0%} are needed"
    named = bench.check("probability", winner.key, probability, limits.named, says)
    if named.passed:
        return True
    for claim, chance in likely.items():
        says = f"{words(claim)} has a probability of {chance:.0%}; {limits.class_named:.0%} are needed"
        if bench.check("probability_of_class", winner.key, chance, limits.class_named, says).passed:
            return True
    bench.stop(named)
    return False


def _probability_of(claim: Claim, bench: Bench) -> float:
    """Probability that something of these classes acts, with or without something else."""
    return sum(bench.probability(card.key) for card in bench.candidates if holds(card, claim))


def _beside_likelier_laws(winner: Scorecard, bench: Bench) -> None:
    """Among the alternatives of a sensor's fault are laws that only want a margin to be named beside the refit.

    The fault needs none, as it does what own values do that are all off by the same share.
    """
    if winner.laws or not winner.effects or not bench.noise_only(bench.refitted):
        return
    likelier = [card for card in bench.apart_from_the_drive if _wants_a_margin(card, winner, bench)]
    if likelier:
        keys = dict.fromkeys([*bench.factors, *(card.key for card in likelier)])
        _share_out([bench.evidence.cards[key] for key in keys], bench)
        why = "is likelier than a sensor's fault, but not than own values that are off by enough to be named"
        bench.reasons |= {card.key: why for card in likelier}


def _wants_a_margin(card: Scorecard, winner: Scorecard, bench: Bench) -> bool:
    """Whether a single law that leaves only noise is likelier than the winner, but not by enough over the refit."""
    single = len(card.effects) == 1 and bool(card.laws) and card.evidence > winner.evidence
    return single and bench.noise_only(card) and is_possible(card, bench)


def _special_case(winner: Scorecard, passing: Sequence[Scorecard], bench: Bench) -> Scorecard | None:
    """The special case of the winner's law beside which its further numbers are not seen, if there is one."""
    cases = [card for card in passing if card.key in winner.special_cases]
    best = max(cases, key=lambda card: card.evidence, default=None)
    if best is None:
        return None
    nats = math.log(bench.probability(winner.key) / bench.probability(best.key))
    least = bench.limits.special_case
    says = f"is {many(nats)} nats likelier than its special case, {best.label}; at least {least:.3g} are needed"
    seen = bench.check("no_simpler_law_as_good", winner.key, nats, least, says)
    return None if seen.passed else best


def _share_out(alternatives: Sequence[Scorecard], bench: Bench) -> None:
    shares = probabilities(alternatives, bench.evidence.setting.periods, bench.limits)
    bench.share_out({card.key: float(p) for card, p in zip(alternatives, shares, strict=True)})


def probabilities(cards: Sequence[Scorecard], periods: float, limits: Thresholds = THRESHOLDS) -> np.ndarray:
    """Probability of each hypothesis among them.

    Where the likeliest leaves only noise its evidence is trusted, tempered; where it does not, evidence counts no more
    than some tens of independent looks at the error of prediction.
    """
    evidence = np.array([card.evidence for card in cards])
    best = cards[int(np.argmax(evidence))]
    if excess.is_noise_only(best, limits):
        score = evidence / limits.tempering
    else:
        looks = min(max(periods / limits.periods_per_look, limits.fewest_looks), limits.most_looks)
        error = np.array([math.sqrt(float(np.mean(card.prediction.error))) for card in cards])
        size = np.array([card.unknowns for card in cards])
        score = -looks * np.log(error) - 0.5 * size * math.log(looks)
    share = np.exp(score - np.max(score))
    return (1.0 - limits.unlisted) * share / np.sum(share) + limits.unlisted / len(cards)
