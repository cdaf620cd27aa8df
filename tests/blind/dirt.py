"""Records as laboratories have them: what comes on top of white noise, on a challenge that was drawn clean."""

import dataclasses
from collections.abc import Callable

import numpy as np
from scipy.signal import lfilter

from .arrays import FloatArray, rms
from .challenge import Challenge, true_channels
from .exact import integrate
from .plants import Motion
from .sensors import Channels

MEMORY = 0.9  # correlation of coloured noise from sample to sample
LEVELS = 15  # of a quantised channel, in its rms
TORN, FARTHEST_TORN = 0.01, (4.0, 12.0)  # share of outliers, and how far off they are, in rms of the channel
SHORT = 700  # samples
LOUD = 0.1  # noise in rms of the channel
DRIFT = (0.1, 0.4)  # how far a channel goes off over the record, in its rms
LATE = 0.5  # samples


def soiled(challenge: Challenge, dirt: str) -> Challenge:
    """The challenge with one kind of `DIRT` on its record; the same for the same seed.

    Raises
    ------
    ValueError
        If the kind is unknown, or the hidden fault of a sensor is one that this dirt would undo or be taken for.
    """
    if dirt not in DIRT:
        raise ValueError(f"`dirt` must be one of {tuple(DIRT)}; got {dirt!r}. Use one of these names.")
    if challenge.cause in TAKEN_FOR.get(dirt, ()):
        raise ValueError(f"`dirt` must leave {challenge.cause} to be seen; {dirt} does not. Draw other causes.")
    rng = np.random.default_rng([challenge.seed, list(DIRT).index(dirt)])
    return DIRT[dirt](rng, challenge)


def _with_channels(challenge: Challenge, channels: Channels, clean: Channels | None = None) -> Challenge:
    return dataclasses.replace(challenge, channels=channels, clean=challenge.clean if clean is None else clean)


def _coloured(rng: np.random.Generator, challenge: Challenge) -> Challenge:
    """Noise with a memory of ten samples, as strong as the white noise was."""

    def noise(n: int) -> FloatArray:
        white = rng.standard_normal(n + 100)
        return np.sqrt(1.0 - MEMORY**2) * np.asarray(lfilter([1.0], [1.0, -MEMORY], white))[100:]

    level = challenge.noise
    return _with_channels(challenge, {kind: y + level * rms(y) * noise(y.size) for kind, y in challenge.clean.items()})


def _quantised(rng: np.random.Generator, challenge: Challenge) -> Challenge:
    """Every channel in steps, noise included."""
    steps = {kind: rms(y) / LEVELS for kind, y in challenge.clean.items()}
    return _with_channels(challenge, {k: steps[k] * np.round(y / steps[k]) for k, y in challenge.channels.items()})


def _torn(rng: np.random.Generator, challenge: Challenge) -> Challenge:
    """Samples of the responses far off the curve, each by itself."""

    def torn(y: FloatArray) -> FloatArray:
        where = rng.choice(y.size, int(round(TORN * y.size)), replace=False)
        away = rms(y) * rng.uniform(*FARTHEST_TORN, where.size) * rng.choice((-1.0, 1.0), where.size)
        found = y.copy()
        found[where] += away
        return found

    return _with_channels(challenge, {k: y if k == "force" else torn(y) for k, y in challenge.channels.items()})


def _short(rng: np.random.Generator, challenge: Challenge) -> Challenge:
    """The first samples alone."""
    kept, motion = slice(SHORT), challenge.motion
    time, hidden = motion.time[kept], tuple(z[kept] for z in motion.hidden)
    rows = (motion.x[kept], motion.v[kept], motion.acceleration[kept], motion.effect[kept])
    shorter = Motion(time, *rows, motion.instants[motion.instants <= time[-1]], hidden)
    channels, clean = ({k: y[kept] for k, y in c.items()} for c in (challenge.channels, challenge.clean))
    return dataclasses.replace(challenge, time=time, motion=shorter, channels=channels, clean=clean)


def _loud(rng: np.random.Generator, challenge: Challenge) -> Challenge:
    """More noise."""
    channels = {kind: y + LOUD * rms(y) * rng.standard_normal(y.size) for kind, y in challenge.clean.items()}
    return dataclasses.replace(challenge, channels=channels, noise=LOUD)


def _drifting(rng: np.random.Generator, challenge: Challenge) -> Challenge:
    """A response whose zero goes away slowly."""
    kinds = [kind for kind in challenge.channels if kind != "force"]
    kind = kinds[int(rng.integers(len(kinds)))]
    y = challenge.channels[kind]
    u = np.linspace(0.0, 1.0, y.size)
    way = u if rng.random() < 0.5 else np.sin(np.pi * (0.5 + rng.random()) * u)
    size = rms(challenge.clean[kind]) * np.exp(rng.uniform(*np.log(DRIFT))) * rng.choice((-1.0, 1.0))
    return _with_channels(challenge, {**challenge.channels, kind: y + size * way})


def _late(rng: np.random.Generator, challenge: Challenge) -> Challenge:
    """A response that shows what was half a sample before; before it began, what began at rest was at rest."""
    kinds = [kind for kind in challenge.channels if kind != "force"]
    kind = kinds[int(rng.integers(len(kinds)))]
    time = challenge.time
    between = np.unique(np.concatenate([time, time - LATE * (time[1] - time[0])]))[1:]  # from sample 0 on
    plant, law, drive = challenge.truth, challenge.law, challenge.drive
    motion = integrate(plant, law, drive, challenge.start, between, rms(challenge.motion.x))
    shown = true_channels(drive, motion, (kind,))[kind][np.searchsorted(between, time[1:]) - 1]
    before = 0.0 if challenge.at_rest else challenge.clean[kind][0]
    late = np.concatenate([[before], shown])
    if challenge.cause == "accel_gain" and kind == "acceleration":
        late *= 1.0 + challenge.parameters["eps"]
    elif challenge.cause == "accel_bias" and kind == "acceleration":
        late += challenge.parameters["b"]
    noise = challenge.channels[kind] - challenge.clean[kind]
    return _with_channels(challenge, {**challenge.channels, kind: late + noise}, {**challenge.clean, kind: late})


DIRT: dict[str, Callable[[np.random.Generator, Challenge], Challenge]] = {
    "coloured": _coloured,
    "quantised": _quantised,
    "outliers": _torn,
    "short": _short,
    "loud": _loud,
    "drift": _drifting,
    "late": _late,
}
# Clipping cuts the noise as well, which this dirt would put back; a bias is a part of a drift; late is late.
TAKEN_FOR = {
    "coloured": ("clipping",),
    "loud": ("clipping",),
    "drift": ("accel_bias", "preload"),
    "late": ("clipping", "force_delay", "channel_delay"),
}
