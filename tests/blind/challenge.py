"""One challenge is one seed: a plant, what is wrong about the belief in it, and a noisy record."""

import dataclasses
from collections.abc import Collection, Sequence

import numpy as np

from .beliefs import WRONG_VALUES, roughly_known, wrong_value
from .drives import DRIVES, Drive
from .exact import integrate
from .laws import LAWS, Law, NoLaw
from .laws.base import FloatArray, rms
from .plants import EscapeError, Motion, Plant, State, sketch
from .sensors import GAINS, UNITS, Channels, Gain, with_noise

CAUSES = ("none", *LAWS, *GAINS, *WRONG_VALUES)
CHANNEL_SETS = {
    "xva": ("displacement", "velocity", "acceleration"),
    "x": ("displacement",),
    "a": ("acceleration",),
}
NOISE_LEVELS = (0.001, 0.01, 0.02, 0.05)
SAMPLES = 3000
SMALLEST_SHARE, LARGEST_SHARE = 0.03, 0.5
# Below this share of the link's force no other k and c would have to be believed wrong.
LEAST_LEFT = 0.015


@dataclasses.dataclass(frozen=True)
class Challenge:
    """A record with its hidden truth; everything in SI.

    `channels` is what the tool is given and `clean` the same before noise, both by kind, (n,) each; `model` is what the
    owner believes and `truth` the plant. `share` is the rms of the effect over that of k x + c v, and `left` what of it
    no other k and c take up; both are 0 where no law is hidden. `motion` is the exact motion, sensors apart.
    """

    seed: int
    cause: str
    at: tuple[int | str, ...]
    parameters: dict[str, float]
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
    causes : of `CAUSES`; one is drawn among those that the channel sets and excitations can tell
    noise : share of each channel's rms; one is drawn
    channels : of "xva", "x", "a"; one is drawn
    excitation : of `DRIVES`; one is drawn, of all by default

    Raises
    ------
    ValueError
        If a name is unknown, or if no cause asked for can be told from the records asked for.
    """
    choice, physics, static = (np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(3))
    sets = _named("channels", channels, CHANNEL_SETS)
    drives = _named("excitation", tuple(DRIVES) if excitation is None else excitation, DRIVES)
    settings = {
        cause: [(s, e) for s in sets for e in drives if _can_tell(cause, s, e)]
        for cause in _named("causes", causes, CAUSES)
    }
    open_causes = [cause for cause, pairs in settings.items() if pairs]
    if not open_causes:
        raise ValueError(
            f"`causes` must hold one that can be told from channels {sets} under {drives}; got {tuple(settings)}. "
            "Allow more channel sets or excitations."
        )
    cause = open_causes[choice.integers(len(open_causes))]
    channel_set, excitation = settings[cause][choice.integers(len(settings[cause]))]
    level = float(choice.choice(np.atleast_1d(noise)))

    plant, drive, start, law, motion = _fair_question(physics, cause, excitation)
    share, left = motion.shares(plant)
    kinds = (() if excitation == "free_decay" else ("force",)) + CHANNEL_SETS[channel_set]
    everything = {
        "force": drive(motion.time),
        "displacement": motion.x,
        "velocity": motion.v,
        "acceleration": motion.acceleration,
    }
    clean = {kind: everything[kind] for kind in kinds}
    at: tuple[int | str, ...] = ()
    parameters: dict[str, float] = {}
    model = plant
    if cause in WRONG_VALUES:
        field, name, at = WRONG_VALUES[cause]
        model, parameters = wrong_value(physics, plant, field), {name: getattr(plant, field)}
    elif cause != "none":
        model = roughly_known(physics, plant)
        if cause in GAINS:
            gain = Gain.draw(physics, GAINS[cause])
            clean, at, parameters = gain.shown(clean), gain.at, {"eps": gain.eps}
        else:
            at, parameters = law.at, dataclasses.asdict(law)
    return Challenge(
        seed=seed, cause=cause, at=at, parameters=parameters, time=motion.time,
        channels=with_noise(static, clean, level), clean=clean, units={kind: UNITS[kind] for kind in kinds},
        model=model, truth=plant, noise=level, channel_set=channel_set, excitation=excitation,
        at_rest=start == (0.0, 0.0) and bool(choice.random() < 0.5),
        share=share, left=left, law=law, drive=drive, start=start, motion=motion,
    )  # fmt: skip


def _named(argument: str, given: str | Sequence[str], known: Collection[str]) -> tuple[str, ...]:
    names = (given,) if isinstance(given, str) else tuple(given)
    unknown = [name for name in names if name not in known]
    if unknown or not names:
        raise ValueError(f"`{argument}` must be one or more of {tuple(known)}; got {given!r}. Use one of these names.")
    return names


def _can_tell(cause: str, channel_set: str, excitation: str) -> bool:
    """Whether the record of a linear plant can show this cause and no other in its place.

    With acceleration alone the gains of force and accelerometer are one and the same. Without a force channel a plant
    is known up to one scale: the mass cannot be wrong by itself, nor a force sensor that is not there.
    """
    if cause == "force_gain":
        return excitation != "free_decay" and channel_set != "a"
    if cause == "accel_gain":
        return channel_set == "xva"
    if cause == "mass_value":
        return excitation != "free_decay"
    return True


def _fair_question(rng: np.random.Generator, cause: str, excitation: str) -> tuple[Plant, Drive, State, Law, Motion]:
    """A plant under a drive with a law whose effect is of the wanted size, redrawn until it is."""
    for _ in range(50):
        plant, time = _draw_plant(rng)
        drive, start, plain = _draw_motion(rng, plant, excitation, time)
        scale = rms(plain.x)
        if cause not in LAWS:
            return plant, drive, start, NoLaw(), integrate(plant, NoLaw(), drive, start, time, scale)
        for _ in range(20):
            share = float(np.exp(rng.uniform(np.log(SMALLEST_SHARE), np.log(LARGEST_SHARE))))
            try:
                law = _sized(rng, LAWS[cause], plant, drive, start, plain, share)
                motion = integrate(plant, law, drive, start, time, scale)
            except EscapeError:
                continue
            if _is_fair(plant, motion):
                return plant, drive, start, law, motion
    raise RuntimeError(f"no fair {cause} under {excitation} in 50 plants; its law's draw must be made to suit it.")


def _is_fair(plant: Plant, motion: Motion) -> bool:
    share, left = motion.shares(plant)
    return SMALLEST_SHARE <= share <= LARGEST_SHARE and left >= LEAST_LEFT


def _draw_plant(rng: np.random.Generator) -> tuple[Plant, FloatArray]:
    """Constants over decades, so that no number is at home in any unit; and the sample times, (SAMPLES,) [s]."""
    frequency_hz = np.exp(rng.uniform(np.log(0.3), np.log(100.0)))
    mass = float(np.exp(rng.uniform(np.log(0.1), np.log(1000.0))))
    omega = 2.0 * np.pi * frequency_hz
    plant = Plant(mass, float(mass * omega**2), float(2.0 * rng.uniform(0.005, 0.08) * mass * omega))
    return plant, np.arange(SAMPLES) / (rng.uniform(30.0, 70.0) * frequency_hz)


def _draw_motion(
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


def _sized(
    rng: np.random.Generator, kind: type[Law], plant: Plant, drive: Drive, start: State, plain: Motion, share: float
) -> Law:
    """A law whose effect has about this share of the link's force along the motion that it changes itself.

    Raises
    ------
    EscapeError
        If there is no such law within its reach, or if too little of it would be left.
    """
    link = rms(plant.stiffness * plain.x + plant.damping * plain.v)
    law = kind.draw(rng, plain.x, plain.v, share * link)
    for _ in range(4):
        found, left = sketch(plant, law, drive, start, plain.time).shares(plant)
        if abs(np.log(found / share)) < 0.1:
            if left < 0.9 * LEAST_LEFT:
                break
            return law
        law = law.scaled(float(np.clip((share / found) ** 0.8, 0.3, 3.0)))
    raise EscapeError(f"no {kind.cause} of this size")
