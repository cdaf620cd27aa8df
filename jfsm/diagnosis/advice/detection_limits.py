"""The smallest effect that a record would have shown.

Nine of ten records, alike but for their noise, let it pass each of two hurdles of a verdict:

* at two thirds of its size its evidence beats that of the refit and that of the model as given by what is significant
  of one law among many. An effect that is f times as large as in some structure moves the readings by f√J standard
  deviations more than what is refitted can follow, and gains half the square of so many nats; chance adds a normal
  deviate before the square is taken. Its numbers cost what they cost in Laplace's evidence: Σ z²/2 + ln |1 + W S W| /
  2, z and W being where they stand and how wide they are believed to be beforehand, S the information that the
  readings hold on them. Own values are free beside an effect; the model as given, where they are not, is ahead of the
  refit by what they cost, and follows less.
* without it the model as given predicts noticeably worse than noise lets it.

At two thirds of the stated size laws of other families explain nearly as much where nats decide, and the name stays
open; twice as many nats tell them apart. Silence is worth something only if an effect of the stated size seldom goes
unnamed. A third of the size brings a ninth of the nats, which is hardly significant. The nats are exact for a law that
is linear in its size, and an estimate for friction and large effects.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..._threads import compiled_once, side_by_side
from ...identification import Posterior, prior
from ...structures import Preload, Structure, is_offset
from ..evidence.fitted import SLACKS, Trial, ended, extent, sets, windows
from ..evidence.setup import Problem
from ..hypotheses.candidate import Candidate
from ..hypotheses.effect import Effect
from ..hypotheses.natural_starts import modest
from ..hypotheses.parametrisation import own_paths
from ..thresholds import THRESHOLDS

_SPARED = 1.28
"""Standard deviations of chance that an effect has to spare: nine of ten then pass."""
_NAMED = 1.5
"""How many times a size that is likelier than nothing has a name: there laws of other families are nearly as likely."""
_GONE = 30.0
"""Logarithm of the factor by which an effect is made smaller to see what it does."""
_FAR, _FARTHEST = 3.0, 10.0
"""Factor to another size from which an effect is looked at once more in that size, and the largest such one. Beyond a
second time nothing is said."""
_ROUNDS = 30
"""The cost of an effect's numbers grows with the logarithm of its size, and settles soon."""


class Smallest(NamedTuple):
    """The structure with an effect of the smallest size that would have been found, and the effect's numbers by path.

    That at `path` stands for its size; all that hold a force grow together.
    """

    effects: tuple[Effect, ...]
    structure: Structure
    path: str
    numbers: dict[str, float]

    @property
    def size(self) -> float:
        """The number at `path`, without its sign."""
        return abs(self.numbers[self.path])


class Silence(NamedTuple):
    """The model as given and its refit, which an effect has to beat to be found."""

    given: Trial
    refitted: Trial
    problem: Problem

    @property
    def spared(self) -> float:
        """Nats by which the model as given is ahead of the refit."""
        return self.given.evidence - self.refitted.evidence

    @property
    def nuisances(self) -> dict[tuple[str, int | None], float]:
        """Those of every record, by path and record, as fitted beside the model as given."""
        return {(u.path, u.record): theta for u, theta in ended(self.given) if u.record is not None}


def detectable(trials: Sequence[Trial], silence: Silence) -> list[Smallest]:
    """Smallest sizes of single effects that were fitted, in the shapes that the fits gave them; as many as the time
    allows."""

    def smallest(t: Trial) -> Smallest | None:
        if silence.problem.limit.over:
            return None
        seen = _Seen(t.effects, silence.problem.posterior_of(t), silence)
        return seen.smallest(t.theta, seen.factor(t.theta, t.information))

    found = side_by_side(smallest, [t for t in trials if len(t.effects) == 1])
    return [one for one in found if one is not None]


def naturally_detectable(candidates: Sequence[Candidate], silence: Silence) -> list[Smallest]:
    """The same of any candidates, each in a natural shape: nothing speaks for that with which a fit of noise ends."""
    problem, every = silence.problem, []
    for candidate in candidates:
        if problem.limit.over:
            break
        start = modest(candidate, problem.model, problem.first)
        posterior = problem.resolving([start]).posterior([start])
        every.append(_Seen(candidate.effects, posterior, silence))
    found = [one for together in compiled_once(every) for one in side_by_side(_Seen.natural, together)]
    return [one for one in found if one is not None]


class _Seen:
    """An effect as the readings see it. Sizes among its numbers are logarithms, and grow together."""

    def __init__(self, effects: tuple[Effect, ...], posterior: Posterior, silence: Silence):
        self.effects, self.posterior, self.silence = effects, posterior, silence
        self.unknowns, self.program = posterior.hypothesis.unknowns[0], posterior.program
        own, entries = silence.problem.model.entries(), posterior.hypothesis.structures[0].entries()
        self.own = own_paths(silence.problem.model, silence.problem.records)
        added = [path for path in entries if path not in own]
        self.mine = [k for k, u in enumerate(self.unknowns) if u.path in added and not is_offset(u.path)]
        self.path = self.unknowns[self.mine[0]].path
        part = self.path.split(".")[0] + "."
        self.paths = [path for path in added if path.startswith(part)]
        sizes = self._sizes(entries)
        self.grows = np.array([self.unknowns[k].path in sizes for k in self.mine])

    def _sizes(self, entries: Mapping[str, tuple]) -> set[str]:
        """Its numbers that hold a force; of a sensor's fault, which has none, the only one that it has."""
        return {path for path in self.paths if entries[path][0].force} or {self.path}

    def natural(self) -> Smallest | None:
        """Its smallest size from a modest one; from that found, where it is far from modest.

        None where it would have to be so large that nothing is known of what it does there, or the time is over.
        """
        if self.silence.problem.limit.over:
            return None
        nuisances = self.silence.nuisances
        theta = np.array([nuisances.get((u.path, u.record), u.theta) for u in self.unknowns])
        factor = self.factor(theta, self._information(theta))
        if factor < 1 / _FAR or _FAR < factor < math.inf:
            theta = self.grown(theta, math.log(min(factor, _FARTHEST)))
            factor = self.factor(theta, self._information(theta))
        return self.smallest(theta, factor) if factor < _FAR else None

    def _information(self, theta: np.ndarray) -> np.ndarray:
        return self.posterior.evaluate(theta[None])[2][0]

    def smallest(self, theta: np.ndarray, factor: float) -> Smallest | None:
        """The effect in so many sizes that it has; None where no size would do, or where it is another law then."""
        if not math.isfinite(factor):
            return None
        structure = self.posterior.structure(self.grown(theta, math.log(factor)))
        if not self.effects[0].cause.is_sensor:
            law = structure.terms[-1]
            if law.otherwise(structure.stiffness_of(law.at)):
                return None
        values = structure.values()
        return Smallest(self.effects, structure, self.path, {p: values[p] for p in self.paths})

    def grown(self, theta: np.ndarray, more: float) -> np.ndarray:
        """Unknowns with an effect that is larger by such a logarithm."""
        grown = theta.copy()
        grown[np.array(self.mine)[self.grows]] += more
        return grown

    def factor(self, theta: np.ndarray, information: np.ndarray) -> float:
        """How many times as large it has to be to be named."""
        if not np.all(np.isfinite(information)):
            return math.inf
        believed, mine, grows = prior(self.unknowns, theta)[2], self.mine, self.grows
        width, center = (np.array([getattr(self.unknowns[k], name) for k in mine]) for name in ("width", "center"))
        free = [k for k in range(theta.size) if k not in mine]
        nuisances = [k for k in free if self.unknowns[k].path not in self.own]
        beside_refit, beside_given = (_told(information, believed, mine, others) for others in (free, nuisances))
        scaled = np.maximum(np.linalg.eigvalsh(width[:, None] * beside_refit * width), 0.0)

        def cost(factor: float) -> float:
            far = (theta[mine] + grows * math.log(factor) - center) / width
            return 0.5 * float(np.sum(far**2) + np.sum(np.log1p(factor**2 * scaled)))

        over_refit, over_given = self._needed()
        return max(
            _NAMED * _significant(beside_refit[np.ix_(grows, grows)], over_refit, cost),
            _NAMED * _significant(beside_given[np.ix_(grows, grows)], over_given, cost),
            _noticeable(self.posterior, theta, self.grown(theta, -_GONE), self.silence.given),
        )

    def _needed(self) -> tuple[float, float]:
        """Nats that the effect has to gain over the refit, and over the model as given.

        Own values may make up for a sensor's fault: it has to be likelier than they are, by no margin. A law may have
        to beat a refit that leaves nothing.
        """
        [effect] = self.effects
        sensor = effect.cause.is_sensor
        least = THRESHOLDS.significant if sensor or effect.cause.effect is Preload else THRESHOLDS.searched
        return 0.0 if sensor else least, least + self.silence.spared


def _told(information: np.ndarray, believed: np.ndarray, mine: list[int], free: list[int]) -> np.ndarray:
    """Information of the readings alone on an effect's numbers, beside which others are refitted."""
    cross = information[np.ix_(free, mine)]
    taken = cross.T @ np.linalg.lstsq(information[np.ix_(free, free)], cross, rcond=None)[0]
    return information[np.ix_(mine, mine)] - np.diag(believed[mine]) - taken


def _significant(told: np.ndarray, needed: float, cost: Callable[[float], float]) -> float:
    """Factor from which an effect gains what is `needed` and what it costs; what it does is proportional to it."""
    strength = float(np.sum(told))  # sizes are logarithms: all grow alike
    if strength <= 0:
        return math.inf
    factor = _SPARED / math.sqrt(strength)
    for _ in range(_ROUNDS):
        factor = (_SPARED + math.sqrt(2 * max(needed + cost(factor), 0.0))) / math.sqrt(strength)
    return factor


def _noticeable(posterior: Posterior, theta: np.ndarray, gone: np.ndarray, given: Trial) -> float:
    """Factor from which the model as given, which lacks the effect, predicts noticeably worse on some set.

    It is judged by the best of its predictions, the looser ones too: these err more by themselves, and by less where
    something is missing.
    """
    left, moved = (np.array(part) for part in zip(*(_powers(posterior, theta, gone, s) for s in SLACKS), strict=True))
    least = THRESHOLDS.noticeable * given.prediction.expected + _SPARED * given.prediction.scatter
    with np.errstate(divide="ignore", invalid="ignore"):
        needed = np.maximum(least - (left - left[0]), 0.0) / moved
    return math.sqrt(float(np.min(np.max(np.nan_to_num(needed, nan=math.inf, posinf=math.inf), 0))))


def _powers(posterior: Posterior, theta: np.ndarray, gone: np.ndarray, slack: float) -> tuple[np.ndarray, np.ndarray]:
    """Error without the effect, and how the effect moves predictions, as powers per set, (sets,) each."""
    left, moved = [], []
    for index, nuisances in enumerate(posterior.records):
        use, scored = windows(nuisances)
        both = np.stack([theta, gone])
        there, error = posterior.many_innovations(
            both, index, use=use, noise_scales=False, slack=np.full(2, slack)
        ).error
        alive = np.asarray(nuisances.readings.use)[: nuisances.samples] > 0
        for chosen in sets(nuisances, posterior.until[index]):
            mask = (scored & chosen)[:, None] & alive
            for found, readings in ((left, error), (moved, there - error)):
                with np.errstate(over="ignore"):  # of a motion that runs away
                    power = np.where(mask, (readings / extent(nuisances)) ** 2, 0.0)
                found.append(np.sum(np.sum(power, 0) / np.maximum(mask.sum(0), 1)))
    return np.array(left), np.array(moved)
