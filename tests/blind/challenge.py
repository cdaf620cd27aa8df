"""One challenge is one seed: a plant, what is wrong about the belief in it, and a noisy record."""

import dataclasses
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from .arrays import FloatArray, rms
from .beliefs import WRONG_VALUES, roughly_known, wrong_value
from .drives import DRIVES, Drive
from .exact import integrate
from .laws import FIRST_LAWS, LAWS, OUTSIDE, Law, NoLaw, Scene
from .plants import EscapeError, Motion, Plant, State, UnfairError
from .sensors import DELAYS, FIRST_SENSORS, SENSORS, UNITS, Channels, Sensor, with_noise
from .sketch import sketch

Hidden = TypeVar("Hidden")

CAUSES = ("none", *LAWS, *SENSORS, *WRONG_VALUES)
# Nothing, seven hidden effects and the wrong values. A seed draws among the causes that it is asked for, so what it
# draws from these does not change as the catalogue grows.
FIRST_CAUSES = ("none", *FIRST_LAWS, *FIRST_SENSORS, *WRONG_VALUES)
CHANNEL_SETS = {
    "xva": ("displacement", "velocity", "acceleration"),
    "x": ("displacement",),
    "a": ("acceleration",),
}
NOISE_LEVELS = (0.001, 0.01, 0.02, 0.05)
SAMPLES = 3000
# Below this share of the link's force no other k and c would have to be believed wrong.
LEAST_LEFT = 0.015
# How many times the peak of the motion without the law a motion may reach: beyond it the plant is another one.
FARTHEST = 10.0
# How many times a small shift of the start, as a share of the motion's rms, may grow where motions may part
# exponentially: the exact motion, good to 1e-11 a step, then is exact still.
SMALL_SHIFT, LARGEST_PARTING = 1e-6, 1e3
# Told from a sensor's offset only by the swing with which it sets in.
NEEDS_REST = ("preload",)


@dataclasses.dataclass(frozen=True)
class Effect:
    """One of two hidden effects; its fields mean what they mean in a challenge."""

    cause: str
    at: tuple[int | str, ...]
    parameters: dict[str, Any]
    share: float
    left: float


@dataclasses.dataclass(frozen=True)
class Challenge:
    """A record with its hidden truth; everything in SI.

    `channels` is what the tool is given and `clean` the same before noise, both by kind, (n,) each; `model` is what the
    owner believes and `truth` the plant. `share` is the rms of the effect over that of k x + c v, and `left` what of it
    no other k and c take up; both are 0 where no law is hidden. `motion` is the exact motion, sensors apart. Among the
    parameters, `side` is an integer and `channel` the place of a sensor, as ("displacement", 1); all others are floats.

    Where two effects are hidden, `cause` to `parameters`, `share` and `left` are those of the first, and `law` is the
    sum of all laws among them.
    """

    seed: int
    cause: str
    at: tuple[int | str, ...]
    parameters: dict[str, Any]
    time: FloatArray
    channels: Channels
    clean: Channels
    units: dict[str, str]
    model: Plant
    truth: Plant
    noise: float
    channel_set: str
    excitation: str
    at_rest: bool
    share: float
    left: float
    law: Law
    drive: Drive
    start: State
    motion: Motion
    beside: Effect | None = None

    @property
    def causes(self) -> tuple[str, ...]:
        """Ids of all causes, (1,) or (2,); "none" is one as well."""
        return (self.cause,) if self.beside is None else (self.cause, self.beside.cause)

    @property
    def noise_floor(self) -> dict[str, float]:
        """Rms of the noise that was put on each channel, in the channel's unit."""
        return {kind: rms(y - self.clean[kind]) for kind, y in self.channels.items()}


def draw(
    seed: int,
    causes: str | Sequence[str] = CAUSES,
    noise: float | Sequence[float] = NOISE_LEVELS,
    channels: str | Sequence[str] = tuple(CHANNEL_SETS),
    excitation: str | Sequence[str] | None = None,
) -> Challenge:
    """The challenge of a seed: the same for the same arguments, and the same plant under any noise level.

    Parameters
    ----------
    seed : int
    causes : of `CAUSES`, or of `OUTSIDE`; one is drawn among those that the channel sets and excitations can tell
    noise : share of each channel's rms; one is drawn
    channels : of "xva", "x", "a"; one is drawn
    excitation : of `DRIVES`; one is drawn, of all by default

    Raises
    ------
    ValueError
        If a name is unknown, or if no cause asked for can be told from the records asked for.
    """
    choice, physics, static = (np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(3))
    wanted = {cause: (cause,) for cause in named("causes", causes, (*CAUSES, *OUTSIDE))}
    cause, channel_set, excitation = drawn_setting(choice, "causes", wanted, channels, excitation)
    level = float(choice.choice(np.atleast_1d(noise)))

    plant, drive, start, law, motion = _fair_question(physics, cause, excitation)
    share, left = motion.shares(plant)
    kinds = (() if excitation == "free_decay" else ("force",)) + CHANNEL_SETS[channel_set]
    at: tuple[int | str, ...] = ()
    parameters: dict[str, Any] = {}
    model = plant
    clean = true_channels(drive, motion, kinds)
    readings: Channels = {}
    if cause in WRONG_VALUES:
        field, name, at = WRONG_VALUES[cause]
        model, parameters = wrong_value(physics, plant, field), {name: getattr(plant, field)}
    elif cause != "none":
        model = roughly_known(physics, plant)
        if cause in SENSORS:
            kind, places = SENSORS[cause]
            sensor = kind.draw(physics, clean, [k for k in kinds if k in places], float(motion.time[1]))
            at, parameters = sensor.at, sensor.parameters
            motion, earlier = with_earlier(sensor, plant, NoLaw(), drive, start, motion)
            if sensor.early:
                start = (float(motion.x[0]), float(motion.v[0]))
            truth = true_channels(drive, motion, kinds)
            clean = sensor.shown(truth, earlier)
            if sensor.after_noise:
                readings = sensor.shown(with_noise(static, truth, level), earlier)
        else:
            at, parameters = law.at, dataclasses.asdict(law)
    return Challenge(
        seed=seed, cause=cause, at=at, parameters=parameters, time=motion.time,
        channels=readings or with_noise(static, clean, level), clean=clean,
        units={kind: UNITS[kind] for kind in kinds}, model=model, truth=plant, noise=level, channel_set=channel_set,
        excitation=excitation,
        at_rest=start == (0.0, 0.0) and (bool(choice.random() < 0.5) or cause in NEEDS_REST),
        share=share, left=left, law=law, drive=drive, start=start, motion=motion,
    )  # fmt: skip


def drawn_setting(
    choice: np.random.Generator,
    argument: str,
    wanted: Mapping[Hidden, Sequence[str]],
    channels: str | Sequence[str],
    excitation: str | Sequence[str] | None,
    known: Collection[str] = tuple(CHANNEL_SETS),
    tells: Callable[[str, str, str], bool] | None = None,
) -> tuple[Hidden, str, str]:
    """One of what may be hidden, each with its causes, and a channel set and an excitation that can tell them all.

    `known` are the channel sets there are, and `tells` says of a cause whether one of them and an excitation do; it is
    `can_tell` by default.

    Raises
    ------
    ValueError
        If a name is unknown, or if none of `argument` can be told from the records asked for.
    """
    sets, tells = named("channels", channels, known), tells or can_tell
    drives = named("excitation", tuple(DRIVES) if excitation is None else excitation, DRIVES)
    settings = {
        hidden: [(s, e) for s in sets for e in drives if all(tells(cause, s, e) for cause in causes)]
        for hidden, causes in wanted.items()
    }
    able = [hidden for hidden, records in settings.items() if records]
    if not able:
        raise ValueError(
            f"`{argument}` must hold one that can be told from channels {sets} under {drives}; got {tuple(settings)}. "
            "Allow more channel sets or excitations."
        )
    hidden = able[choice.integers(len(able))]
    return hidden, *settings[hidden][choice.integers(len(settings[hidden]))]


def true_channels(drive: Drive, motion: Motion, kinds: Sequence[str]) -> Channels:
    """What perfect sensors of these kinds would show, (n,) each."""
    everything = {
        "force": drive(motion.time),
        "displacement": motion.x,
        "velocity": motion.v,
        "acceleration": motion.acceleration,
    }
    return {kind: everything[kind] for kind in kinds}


def with_earlier(
    sensor: Sensor, plant: Plant, law: Law, drive: Drive, start: State, motion: Motion
) -> tuple[Motion, Any]:
    """The motion and a function that gives any channel some time before each sample.

    For a sensor that is late the plant is started before the record begins, so that there is a motion to be late with.
    """
    time = motion.time
    if not sensor.early:
        return motion, None
    step, tau = float(time[1]), sensor.parameters["tau"]
    begin = -np.ceil(max(DELAYS)) * step
    every = np.unique(np.concatenate([[begin], time - tau, time]))
    longer = integrate(plant, law, drive, start, every, rms(motion.x))

    def at(times: FloatArray) -> Motion:
        i = np.searchsorted(every, times)
        within = longer.instants[longer.instants >= times[0]]
        return Motion(times, longer.x[i], longer.v[i], longer.acceleration[i], longer.effect[i], within)

    late = at(time - tau)

    def earlier(kind: str, tau: float) -> FloatArray:
        return true_channels(drive, late, (kind,))[kind]

    return at(time), earlier


def named(argument: str, given: str | Sequence[str], known: Collection[str]) -> tuple[str, ...]:
    names = (given,) if isinstance(given, str) else tuple(given)
    unknown = [name for name in names if name not in known]
    if unknown or not names:
        raise ValueError(f"`{argument}` must be one or more of {tuple(known)}; got {given!r}. Use one of these names.")
    return names


def can_tell(cause: str, channel_set: str, excitation: str) -> bool:
    """Whether the record of a linear plant can show this cause and no other in its place.

    With acceleration alone the gains of force and accelerometer are one and the same. Without a force channel a plant
    is known up to one scale: the mass cannot be wrong by itself, nor a force sensor that is not there. A single
    response channel that is late is a shifted clock where nothing else tells the time, and under one line the phase of
    another damping. So is a late force, and a law that is linear but for its memory. A change with time is a change
    with amplitude in a single decay. A preload is an offset, but for the swing with which it sets in on a plant that is
    known to be at rest. Friction that differs with the direction is even friction about another point of rest, of which
    acceleration alone tells nothing.
    """
    decays, one_line = excitation == "free_decay", excitation == "harmonic"
    if cause == "force_gain":
        return not decays and channel_set != "a"
    if cause == "accel_gain":
        return channel_set == "xva"
    if cause == "accel_bias":
        return channel_set != "x"
    if cause == "mass_value":
        return not decays
    if cause == "channel_delay":
        return channel_set == "xva" or not (decays or one_line)
    if cause in ("force_delay", "maxwell", "delayed_force"):
        return not (decays or one_line)
    if cause == "attached_oscillator":
        return not one_line
    if cause in ("stiffness_drift", "stiffness_drop", "damping_drift", "parametric_stiffness"):
        return not decays
    if cause == "preload":
        return not decays and channel_set != "a"
    return cause != "coulomb_asymmetric" or channel_set != "a"


def _fair_question(rng: np.random.Generator, cause: str, excitation: str) -> tuple[Plant, Drive, State, Law, Motion]:
    """A plant under a drive with a law whose effect is of the wanted size, redrawn until it is."""
    kind = (LAWS | OUTSIDE).get(cause)
    for _ in range(50):
        plant, time = draw_plant(rng)
        drive, start, plain = draw_motion(rng, plant, excitation, time)
        scale, limit = rms(plain.x), FARTHEST * plain.peak
        if kind is None:
            return plant, drive, start, NoLaw(), integrate(plant, NoLaw(), drive, start, time, scale)
        if cause in NEEDS_REST:
            start = (0.0, 0.0)
        for _ in range(20):
            try:
                law = _sized(rng, kind, Scene(plant, drive, plain), start, limit)
                begin = law.start(*start, plant.stiffness)
                motion = trusted_motion(plant, law, drive, begin, time, scale, limit)
            except EscapeError:
                continue
            if is_fair(law, Scene(plant, drive, motion), law.shares):
                return plant, drive, begin, law, motion
    raise UnfairError(f"no fair {cause} under {excitation} in 50 plants; its law's draw must be made to suit it.")


def is_fair(law: Law, scene: Scene, shares: tuple[float, float]) -> bool:
    """Whether a law is of the size and the nature that are wanted, along the motion that has come about under it."""
    share, left = scene.motion.shares(scene.plant)
    smallest, largest = shares
    return smallest <= share <= largest and left >= LEAST_LEFT and law.fits(scene)


def trusted_motion(
    plant: Plant, law: Law, drive: Drive, start: State, time: FloatArray, scale: float, limit: float
) -> Motion:
    """The exact motion, within `limit` [m]; `scale` [m] is a typical displacement.

    Raises
    ------
    EscapeError
        If it passes the limit, or parts from a near one so fast that it cannot be trusted.
    """
    if not law.chaotic:
        return integrate(plant, law, drive, start, time, scale, limit=limit)
    aside = (start[0] + SMALL_SHIFT * scale, start[1])
    here, there = (sketch(plant, law, drive, state, time, limit) for state in (start, aside))
    _stay_near(here, there, scale)
    motion = integrate(plant, law, drive, start, time, scale, limit=limit)
    _stay_near(motion, integrate(plant, law, drive, aside, time, scale, 1e-8, limit), scale)
    return motion


def _stay_near(one: Motion, other: Motion, scale: float) -> None:
    if float(np.abs(one.x - other.x).max()) > LARGEST_PARTING * SMALL_SHIFT * scale:
        raise EscapeError("motions from starts a small shift apart go so far apart that neither can be trusted")


def draw_plant(rng: np.random.Generator) -> tuple[Plant, FloatArray]:
    """Constants over decades, so that no number is at home in any unit; and the sample times, (SAMPLES,) [s]."""
    frequency_hz = np.exp(rng.uniform(np.log(0.3), np.log(100.0)))
    mass = float(np.exp(rng.uniform(np.log(0.1), np.log(1000.0))))
    omega = 2.0 * np.pi * frequency_hz
    plant = Plant(mass, float(mass * omega**2), float(2.0 * rng.uniform(0.005, 0.08) * mass * omega))
    return plant, np.arange(SAMPLES) / (rng.uniform(30.0, 70.0) * frequency_hz)


def draw_motion(
    rng: np.random.Generator, plant: Plant, excitation: str, time: FloatArray
) -> tuple[Drive, State, Motion]:
    """A drive and a start that move the plant without a law by 10 um to 100 mm rms, and a sketch of that motion."""
    size = float(np.exp(rng.uniform(np.log(1e-5), np.log(0.1))))
    drive = DRIVES[excitation](rng, plant.omega, float(time[-1]))
    if excitation == "free_decay":
        start = (float(size * rng.choice((-1.0, 1.0))), 0.0)
        return drive, start, sketch(plant, NoLaw(), drive, start, time)
    drive = drive.scaled(size / rms(sketch(plant, NoLaw(), drive, (0.0, 0.0), time).x))
    x, v = rng.standard_normal(2)
    start = (0.0, 0.0) if rng.random() < 0.8 else (float(size * x), float(size * plant.omega * v))
    return drive, start, sketch(plant, NoLaw(), drive, start, time)


def _sized(rng: np.random.Generator, kind: type[Law], scene: Scene, start: State, limit: float) -> Law:
    """A law of the size that is wanted, for one mass; raises what `sized` does."""
    plant, drive, time = scene.plant, scene.drive, scene.motion.time
    return sized(rng, kind, scene, kind.shares, lambda law: sketch(plant, law, drive, start, time, limit))


def sized(
    rng: np.random.Generator, kind: type[Law], scene: Scene, shares: tuple[float, float],
    sketched: Callable[[Law], Motion],
) -> Law:  # fmt: skip
    """A law whose effect has a share of the link's force, drawn from `shares`, along the motion that it changes itself.

    `scene` holds the motion without it, whose scales are natural to the law, and `sketched` gives that under it.

    Raises
    ------
    EscapeError
        If there is no such law within its reach, or if too little of it would be left.
    """
    plant, plain = scene.plant, scene.motion
    share = float(np.exp(rng.uniform(*np.log(shares))))
    link = rms(plant.stiffness * plain.x + plant.damping * plain.v)
    law = kind.draw(rng, scene, share * link)
    if not kind.sized:
        return law
    for _ in range(4):
        motion = sketched(law)
        found, left = motion.shares(plant)
        if not found > 0.0:  # a gap that the motion stays in
            break
        if abs(np.log(found / share)) < 0.1:
            if left < 0.9 * LEAST_LEFT or not law.fits(Scene(plant, scene.drive, motion)):
                break
            return law
        law = law.scaled(float(np.clip((share / found) ** 0.8, 0.3, 3.0)))
    raise EscapeError(f"no {kind.cause} of this size")
