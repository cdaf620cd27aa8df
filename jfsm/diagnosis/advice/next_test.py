"""What to measure next: the test that tells two rivals apart.

Each rival in turn is taken to be right. A test is simulated with it, noise included, and both are fitted to what the
sensors would show: the difference of their log-evidences is what the test is expected to say. It is the mean of that
with a draw of noise and with its opposite, in which most of what chance adds cancels. Which of the rivals is right is
not known, and against a law that holds the right one as a special case no test says much: the geometric mean of what it
says for either counts.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import jax
import numpy as np

from ..._result import Result
from ..._threads import side_by_side
from ...dynamics import simulate
from ...identification import LADDER, Nuisances, approach, finish, lanes_of, prepare
from ...plant import force_at
from ...records import Record
from ...structures import AbstractTerm, Structure
from ..evidence.course import remeasured
from ..evidence.fitted import Trial
from ..evidence.noise_draws import noise_levels
from ..evidence.setup import Problem
from ..hypotheses.initial_values import found_in, own_part
from ..hypotheses.placement import at_rest
from ..thresholds import THRESHOLDS
from .variation import LEVELS, Variation, planned_record, variations

RIVAL = 0.02
"""Probability from which another explanation is a rival."""
_LONGER, _PLENTY, _LONGEST = (4, 16), 20.0, 50_000
"""How much longer the best test is proposed as well, the nats, at least, from which it is long enough, and its samples
at most."""
_SAFELY = 1.5
"""How much louder a drive may be than it is meant to be, and no rival runs away."""
_SIDE = 21
"""States to a side on which forces are compared,"""
_SAME = 0.02
"""and share of a law's force up to which two are the same."""


@dataclass(frozen=True)
class Proposal:
    """A test, and what it is expected to say.

    Attributes
    ----------
    what : str
        The test in words.
    nats : float
        Difference of the rivals' log-evidences on its record alone: geometric mean of that with either as the truth.
    least : float
        That with the one for which it says less.
    reach : float
        Largest response to be expected, as a multiple of that in the record at hand.
    rivals : (str, str)
        The causes that it tells apart.
    record : Record
        Time and drive of the test; its responses are those of the more probable rival, without noise.
    """

    what: str
    nats: float
    least: float
    reach: float
    rivals: tuple[str, str]
    record: Record

    @property
    def tells(self) -> bool:
        """Whether the test is worth doing."""
        return self.nats > THRESHOLDS.significant


@dataclass(frozen=True)
class Leading:
    """The two most probable explanations of a record, and the first `samples` of it, on which tests are modelled."""

    model: Structure
    rivals: tuple[Trial, Trial]
    nuisances: Nuisances
    samples: int

    @classmethod
    def of(
        cls,
        model: Structure,
        trials: Sequence[Trial],
        share: Callable[[Trial], float],
        nuisances: Nuisances,
        until: int,
    ) -> "Leading | None":
        """The most probable of the trials and the next that is another force, where both have a chance."""
        first, *others = sorted(trials, key=share, reverse=True)
        second = next((t for t in others if share(t) >= RIVAL and not same_force(first, t, nuisances)), None)
        return None if second is None else cls(model, (first, second), nuisances, until)


def proposals(leading: Leading, key: jax.Array, tell: Callable[[str, int, int], None] | None = None) -> list[Proposal]:
    """Every test that could be simulated, the one that tells most first."""
    tests = variations(leading.nuisances)

    def tried(test: Variation, done: int) -> list[tuple[Proposal, Variation]]:
        words = test.words(leading.nuisances.record)
        if tell is not None:
            tell(words, done, max(len(tests), done + 1))
        return [(proposal, test) for proposal in _tried(leading, test, words, jax.random.fold_in(key, done))]

    found = [one for done, test in enumerate(tests) for one in tried(test, done)]
    for length in _lengths(leading) if found else ():
        best, test = max(found, key=lambda one: one[0].nats)
        if best.least >= _PLENTY:
            break
        found += tried(replace(test, length=length), len(tests) + length)
    return sorted((proposal for proposal, _ in found), key=lambda p: -p.nats)


def _lengths(leading: Leading) -> list[int]:
    """How many times as long the best test may be; of a release or an imposed motion none."""
    record = leading.nuisances.record
    if not record.driven or record.drive != "force":
        return []
    return [length for length in _LONGER if length * leading.samples <= _LONGEST]


def _tried(leading: Leading, test: Variation, words: str, key: jax.Array) -> list[Proposal]:
    """A test as a proposal, or nothing where a rival runs away in it."""
    seeds = np.random.default_rng(np.asarray(jax.random.key_data(key)).astype(np.uint32).tolist()).spawn(2)
    one, other = (_made(leading, test, truth, seed) for truth, seed in zip(leading.rivals, seeds, strict=True))
    if not one or not other:
        return []
    each = _expected(leading, one), -_expected(leading, other)
    if not np.all(np.isfinite(each)):
        return []
    least = min(each)
    # One nat more for either, which is chance. A truth that loses by far did not find back to its numbers.
    nats = math.sqrt(float(np.prod(np.maximum(each, 0.0) + 1.0))) - 1.0 if least > -THRESHOLDS.significant else least
    names = leading.rivals[0].name, leading.rivals[1].name
    return [Proposal(words, nats, least, _reach(leading, one[0]), names, one[0])]


def _expected(leading: Leading, made: Sequence[Record]) -> float:
    """Nats that the noisy ones of the records speak for the first of the rivals, in the mean."""
    return float(np.mean([separation(leading, record) for record in made[1:]]))


def same_force(one: Trial, other: Trial, nuisances: Nuisances) -> bool:
    """Whether two explanations are one force under two names wherever a test may lead, as one law may contain another.

    Only what displacement and velocity tell is compared, of one degree of freedom.
    """
    if not (_follows_state(one) and _follows_state(other)):
        return False
    farthest = max(LEVELS) * nuisances.crest * nuisances.length
    side = np.linspace(-1.0, 1.0, _SIDE)
    d, w = (a.ravel() for a in np.meshgrid(farthest * side, farthest * nuisances.omega * side))

    def force(terms: Sequence[AbstractTerm]) -> np.ndarray:
        return sum((force_at(term, d, w) for term in terms), np.zeros(d.size))

    # A device without a mass is judged by its force itself.
    masses = [float(np.ravel(t.structure.mass)[0]) or 1.0 for t in (one, other)]
    per_mass = [force(t.structure.terms) / mass for t, mass in zip((one, other), masses, strict=True)]
    added = force(one.laws) / masses[0]
    return bool(np.linalg.norm(per_mass[0] - per_mass[1]) < _SAME * np.linalg.norm(added))


def _follows_state(t: Trial) -> bool:
    """Whether a trial's effects are laws of displacement and velocity alone, of one degree of freedom."""
    laws = t.laws
    if not laws or len(laws) != len(t.effects) or t.structure.dof > 1:
        return False
    return not any(law.states or law.timed or law.delay is not None for law in laws)


def separation(leading: Leading, record: Record) -> float:
    """Nats by which a record speaks for the first of the rivals."""
    nuisances = prepare(record, leading.model, leading.nuisances.reconstruction)
    one, other = side_by_side(partial(_evidence, leading.model, nuisances), leading.rivals)
    return one - other


def _evidence(model: Structure, nuisances: Nuisances, rival: Trial) -> float:
    """Log-evidence of a rival on another record, from where the one at hand left its numbers, in either well."""
    start, own = rival.effects_on(model), own_part(found_in(rival))
    lanes = lanes_of(start)
    begins = [{**own, **at_rest(at, rest)} for at, rest in _rests(start)] if not nuisances.at_rest else []
    problem = Problem(model, [nuisances], [nuisances.samples]).resolving([start])
    posterior = problem.posterior([start] * lanes, [*begins, *[own] * lanes][:lanes])
    return finish(posterior, approach(posterior, LADDER[-1:])).evidence(0)


def _made(leading: Leading, test: Variation, truth: Trial, rng: np.random.Generator) -> tuple[Record, ...]:
    """The test's record had `truth` been right: without noise, with it, and with its opposite.

    Nothing where the structure runs away, or would if it were driven somewhat harder.
    """
    nuisances, structure = leading.nuisances, truth.extended()
    rests = _rests(structure)
    sure = not any(_rests(rival.structure) for rival in leading.rivals)

    def followed(test: Variation):
        planned = planned_record(nuisances.record[: leading.samples], test, known=sure)
        state = None if planned.driven else _start(truth, nuisances, test.level)
        if planned.driven and rests:  # what is buckled rests in one of its wells
            state = np.array([at_rest(*rests[0])["x0@1", None].value]), np.zeros(1)
        return planned, simulate(structure, planned, state, reconstruction=nuisances.reconstruction, solver="grid")

    planned, response = followed(test)
    known = replace(test, kind="") == Variation()
    harder = response if known else followed(replace(test, level=_SAFELY * test.level, length=1))[1]
    if not response.result == harder.result == Result.successful:
        return ()
    shown = response.readings(planned)
    levels = _noise_of(truth, nuisances, shown)
    clean = {channel: shown.get(channel, y) for channel, y in planned.channels.items()}
    seed = int(rng.integers(2**63))
    noisy = [
        remeasured(planned, clean, {c: sign * level for c, level in levels.items()}, np.random.default_rng(seed))
        for sign in (1.0, -1.0)
    ]
    return remeasured(planned, clean, {}, rng), *noisy


def _noise_of(truth: Trial, nuisances: Nuisances, shown: Mapping[tuple, np.ndarray]) -> dict[tuple, float]:
    """Standard deviation of every channel's noise in a test that shows this; of a new channel the same share."""
    levels = noise_levels(truth, nuisances)
    share = float(np.median([levels[c] / s for c, s in zip(nuisances.channels, nuisances.spread, strict=True)]))
    return levels | {channel: share * float(np.std(y)) for channel, y in shown.items() if channel not in levels}


def _rests(structure: Structure) -> list[tuple[tuple[int, int], float]]:
    """Where a structure of one mass may rest, other than at zero."""
    return structure.rests() if structure.dof == 1 else []


def _start(truth: Trial, nuisances: Nuisances, level: float) -> tuple[np.ndarray, np.ndarray]:
    """State from which a structure is released, `level` times as far as it was."""
    values = {u.path: u.value(theta) for u, theta in zip(truth.unknowns, truth.theta, strict=True)}

    def start(name: str, guess: np.ndarray) -> np.ndarray:
        found = [values.get(f"{name}@{j + 1}") for j in range(guess.size)]
        return level * np.array([one if one is not None else other for one, other in zip(found, guess, strict=True)])

    return start("x0", nuisances.x0), start("v0", nuisances.v0)


def _reach(leading: Leading, test: Record) -> float:
    """Largest answer of a test beside that of the record at hand, in the first of its channels."""
    there = leading.nuisances.record.answers
    channel = next(iter(there))
    return _peak(test.answers[channel]) / max(_peak(there[channel]), 1e-300)


def _peak(y: np.ndarray) -> float:
    return float(np.max(np.abs(y)))
