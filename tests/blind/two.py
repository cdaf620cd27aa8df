"""A challenge with two hidden effects at once."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from .arrays import FloatArray, rms
from .beliefs import roughly_known
from .challenge import (
    CHANNEL_SETS,
    FARTHEST,
    LEAST_LEFT,
    NEEDS_REST,
    NOISE_LEVELS,
    Challenge,
    Effect,
    draw_motion,
    draw_plant,
    drawn_setting,
    true_channels,
    trusted_motion,
    with_earlier,
)
from .drives import Drive
from .laws import LAWS, Both, Law, Scene
from .laws.base import log_uniform
from .plants import EscapeError, Motion, Plant, State, UnfairError
from .sensors import SENSORS, UNITS, Channels, Sensor, with_noise
from .sketch import sketch

# Rms of each law's force over that of the linear link's.
SHARES = (0.05, 0.35)
# How much of one force's power the other may explain, of what k and c leave of both: beyond it no record could tell two
# effects from one.
LARGEST_OVERLAP = 0.7
# Sizes are wanted to within this factor's logarithm, in a sketch.
CLOSE = 0.15

Pair = tuple[str, str]


def family(cause: str) -> str:
    """ "sensor", or the module of a law."""
    return "sensor" if cause in SENSORS else LAWS[cause].__module__.rpartition(".")[2]


def _can_be_paired(one: str, other: str) -> bool:
    """Whether two causes, a law first, make a fair question together.

    They are of different families; two laws that may hold the mass are too much alike. A double well is larger than a
    second effect may be, and clipping shows by itself. A late channel needs a plant that moves before the record
    begins, a law that remembers and a preload begin with it.
    """
    if family(one) == family(other) or {one, other} & {"double_well", "clipping"}:
        return False
    if other in SENSORS:
        return not (SENSORS[other][0].early and (family(one) == "memory" or one in NEEDS_REST))
    return not (LAWS[one].dry and LAWS[other].dry)


def _in_order(one: str, other: str) -> Pair:
    """Dry friction first, as `Both` wants it."""
    return (other, one) if other in LAWS and LAWS[other].dry else (one, other)


# All pairs of a law and another law or a sensor. Whether a record can tell them hangs on the record.
PAIRS: tuple[Pair, ...] = tuple(
    _in_order(one, other)
    for i, one in enumerate(LAWS)
    for other in (*list(LAWS)[i + 1 :], *SENSORS)
    if _can_be_paired(one, other)
)


@dataclasses.dataclass(frozen=True)
class _Question:
    """A plant with two effects and its motion; `clean` is what its sensors show, (n,) each."""

    plant: Plant
    drive: Drive
    start: State
    law: Law
    sensor: Sensor | None
    motion: Motion
    clean: Channels

    @property
    def effects(self) -> list[Effect]:
        laws = (self.law.first, self.law.second) if isinstance(self.law, Both) else (self.law,)
        effects = [
            Effect(law.cause, law.at, dataclasses.asdict(law), *part.shares(self.plant))
            for law, part in zip(laws, parts(self.law, self.motion), strict=True)
        ]
        if self.sensor is None:
            return effects
        known = SENSORS.items()
        cause = next(c for c, (kind, at) in known if kind is type(self.sensor) and self.sensor.channel in at)
        return [*effects, Effect(cause, self.sensor.at, self.sensor.parameters, 0.0, 0.0)]


def draw_two(
    seed: int,
    noise: float | Sequence[float] = NOISE_LEVELS,
    channels: str | Sequence[str] = tuple(CHANNEL_SETS),
    excitation: str | Sequence[str] | None = None,
    pairs: Sequence[Pair] | None = None,
) -> Challenge:
    """The challenge of a seed with two effects, the second under `beside`.

    The two are of different families, and each can be told by itself from the record. Each law's force is 5 to 35 % of
    the linear link's along the motion under both, and neither is a copy of the other.

    Parameters
    ----------
    seed, noise, channels, excitation : as of `draw`
    pairs : of `PAIRS`, in either order; one is drawn among those that the channel sets and excitations can tell

    Raises
    ------
    ValueError
        If a name or a pair is unknown, or if no pair asked for can be told from the records asked for.
    """
    choice, physics, static = (np.random.default_rng(s) for s in np.random.SeedSequence((seed, 2)).spawn(3))
    wanted = {pair: pair for pair in (PAIRS if pairs is None else _known(pairs))}
    pair, channel_set, excitation = drawn_setting(choice, "pairs", wanted, channels, excitation)
    level = float(choice.choice(np.atleast_1d(noise)))
    kinds = (() if excitation == "free_decay" else ("force",)) + CHANNEL_SETS[channel_set]

    question = _fair_question(physics, pair, excitation, kinds)
    first, second = question.effects
    plant, start, motion = question.plant, question.start, question.motion
    at_rest = start == (0.0, 0.0) and (bool(choice.random() < 0.5) or any(cause in NEEDS_REST for cause in pair))
    return Challenge(
        seed=seed, cause=first.cause, at=first.at, parameters=first.parameters, time=motion.time,
        channels=with_noise(static, question.clean, level), clean=question.clean,
        units={kind: UNITS[kind] for kind in kinds}, model=roughly_known(physics, plant), truth=plant, noise=level,
        channel_set=channel_set, excitation=excitation, at_rest=at_rest, share=first.share, left=first.left,
        law=question.law, drive=question.drive, start=start, motion=motion, beside=second,
    )  # fmt: skip


def _known(pairs: Sequence[Pair]) -> tuple[Pair, ...]:
    either_way = {frozenset(pair): pair for pair in PAIRS}
    unknown = [pair for pair in pairs if frozenset(pair) not in either_way]
    if unknown or not pairs:
        raise ValueError(
            f"`pairs` must hold two causes each, of different families, a law among them; got {unknown or pairs}. "
            "Give some of `PAIRS`."
        )
    return tuple(either_way[frozenset(pair)] for pair in pairs)


def parts(law: Law, motion: Motion) -> tuple[Motion, ...]:
    """The motion with the force of each law alone for its effect."""
    if not isinstance(law, Both):
        return (motion,)
    return tuple(dataclasses.replace(motion, effect=force) for force in law.parts(motion))


def overlap(plant: Plant, motion: Motion, one: FloatArray, other: FloatArray) -> float:
    """Share of the power of one force that the other explains, of what k and c leave of both, (n,) each [N].

    It is the same the other way round.
    """
    a, b = motion.left(plant, one), motion.left(plant, other)
    return float((a @ b) ** 2 / ((a @ a) * (b @ b)))


def _fair_question(rng: np.random.Generator, pair: Pair, excitation: str, kinds: Sequence[str]) -> _Question:
    """A plant under a drive with both effects, redrawn until their sizes are those that are wanted."""
    for _ in range(50):
        plant, time = draw_plant(rng)
        drive, start, plain = draw_motion(rng, plant, excitation, time)
        if any(cause in NEEDS_REST for cause in pair):
            start = (0.0, 0.0)
        for _ in range(20):
            try:
                return _question(rng, pair, Scene(plant, drive, plain), start, kinds)
            except EscapeError:
                continue
    raise UnfairError(f"no fair {pair[0]} with {pair[1]} under {excitation} in 50 plants; leave the pair out.")


def _question(rng: np.random.Generator, pair: Pair, scene: Scene, start: State, kinds: Sequence[str]) -> _Question:
    """Both effects on the plant of `scene`, which holds its motion without them.

    Raises
    ------
    EscapeError
        If the question is not fair.
    """
    plant, drive, time, scale = scene.plant, scene.drive, scene.motion.time, scene.x_rms
    limit = FARTHEST * scene.peak
    law = _sized(rng, [LAWS[cause] for cause in pair if cause in LAWS], scene, start, limit)
    start = law.start(*start, plant.stiffness)
    motion = trusted_motion(plant, law, drive, start, time, scale, limit)
    _must_be_fair(law, parts(law, motion), Scene(plant, drive, motion))
    truth = true_channels(drive, motion, kinds)
    if pair[1] not in SENSORS:
        return _Question(plant, drive, start, law, None, motion, truth)
    kind, places = SENSORS[pair[1]]
    sensor = kind.draw(rng, truth, [k for k in kinds if k in places], float(time[1]))
    motion, earlier = with_earlier(sensor, plant, law, drive, start, motion)
    truth = true_channels(drive, motion, kinds)
    clean = sensor.shown(truth, earlier)
    # What the force's sensor misses is a force on the believed plant as well.
    misread = truth["force"] - clean["force"] if sensor.channel == "force" else None
    _must_be_fair(law, parts(law, motion), Scene(plant, drive, motion), misread)
    if sensor.early:
        start = (float(motion.x[0]), float(motion.v[0]))
    return _Question(plant, drive, start, law, sensor, motion, clean)


def _sized(rng: np.random.Generator, kinds: Sequence[type[Law]], scene: Scene, start: State, limit: float) -> Law:
    """One law or two, each with a drawn share of the link's force along the motion that they change themselves.

    Raises
    ------
    EscapeError
        If there are none within their reach, or if they are not fair.
    """
    plant, plain = scene.plant, scene.motion
    link = rms(plant.stiffness * plain.x + plant.damping * plain.v)
    ranges = [(max(SHARES[0], kind.shares[0]), min(SHARES[1], kind.shares[1])) for kind in kinds]
    wanted = [log_uniform(rng, *ends) for ends in ranges]
    laws = [kind.draw(rng, scene, share * link) for kind, share in zip(kinds, wanted, strict=True)]
    for _ in range(6):
        law = Both(*laws) if len(laws) > 1 else laws[0]
        motion = sketch(plant, law, scene.drive, start, plain.time, limit)
        each = parts(law.twin, motion)
        found = [part.shares(plant)[0] for part in each]
        if not min(found) > 0.0:
            break
        if all(abs(np.log(f / share)) < CLOSE for f, share in zip(found, wanted, strict=True)):
            _must_be_fair(law, each, Scene(plant, scene.drive, motion))
            return law
        factors = [float(np.clip((share / f) ** 0.8, 0.3, 3.0)) for f, share in zip(found, wanted, strict=True)]
        laws = [one.scaled(factor) for one, factor in zip(laws, factors, strict=True)]
    raise EscapeError("no laws of these sizes")


def _must_be_fair(law: Law, each: Sequence[Motion], scene: Scene, misread: FloatArray | None = None) -> None:
    """Raise EscapeError if an effect is too small, too large, linear, unnatural, or much like the other.

    `each` is the motion with the force of one law alone, `misread` (n,) [N] what the force's sensor misses.
    """
    plant, motion = scene.plant, scene.motion
    for part in each:
        share, left = part.shares(plant)
        if not (SHARES[0] <= share <= SHARES[1] and left >= LEAST_LEFT):
            raise EscapeError("an effect is not of the size of one of two")
    forces = [part.effect for part in each] + ([] if misread is None else [misread])
    if len(forces) > 1 and overlap(plant, motion, *forces) > LARGEST_OVERLAP:
        raise EscapeError("one effect is much like the other")
    if not law.fits(scene):
        raise EscapeError("a law is not natural to the motion that has come about")
