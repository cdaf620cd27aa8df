"""Sensors that misread, and the noise on all of them."""

import abc
import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, ClassVar, Self, TypeAlias, TypeVar

import numpy as np

from .arrays import FloatArray, rms

Channels: TypeAlias = dict[str, FloatArray]
Key = TypeVar("Key")
Place: TypeAlias = tuple[str, int]  # kind of channel, degree of freedom

UNITS = {"force": "N", "displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}
# How late a channel is, in samples. No delay reaches further back than a record is started early.
DELAYS = (1.2, 4.0)
CLIPPED_SHARES = (0.01, 0.1)


@dataclasses.dataclass(frozen=True)
class Sensor(abc.ABC):
    """One channel that does not show the truth."""

    early: ClassVar[bool] = False  # whether the motion before the record's first sample is needed
    after_noise: ClassVar[bool] = False  # whether noise is misread as well
    channel: str
    mass: int = dataclasses.field(default=1, kw_only=True)  # which degree of freedom it sits at

    @classmethod
    @abc.abstractmethod
    def draw(cls, rng: np.random.Generator, clean: Channels, kinds: Sequence[str], step: float) -> Self:
        """A sensor of one of these `kinds` of channel, all in `clean`, (n,) each; `step` is the sampling's [s]."""

    @property
    def at(self) -> Place:
        return self.channel, self.mass

    @property
    @abc.abstractmethod
    def parameters(self) -> dict[str, Any]:
        """Under their names in the catalogue of causes."""

    @abc.abstractmethod
    def misread(self, channels: Channels, earlier: Callable[[str, float], FloatArray]) -> FloatArray:
        """What it shows, (n,); `earlier` gives a kind of channel as it was some seconds before each sample."""

    def shown(self, channels: Channels, earlier: Callable[[str, float], FloatArray]) -> Channels:
        """All channels as shown, (n,) each."""
        return {**channels, self.channel: self.misread(channels, earlier)}


@dataclasses.dataclass(frozen=True)
class Gain(Sensor):
    """One channel shows (1 + eps) times the truth."""

    eps: float

    @classmethod
    def draw(cls, rng: np.random.Generator, clean: Channels, kinds: Sequence[str], step: float) -> Self:
        """5 to 40 % (log-uniform), too much or too little."""
        return cls(kinds[0], float(rng.choice((-1.0, 1.0)) * np.exp(rng.uniform(np.log(0.05), np.log(0.4)))))

    @property
    def parameters(self) -> dict[str, Any]:
        return {"eps": self.eps}

    def misread(self, channels: Channels, earlier: Callable[[str, float], FloatArray]) -> FloatArray:
        return (1.0 + self.eps) * channels[self.channel]


@dataclasses.dataclass(frozen=True)
class Bias(Sensor):
    """One channel shows b more than the truth."""

    b: float

    @classmethod
    def draw(cls, rng: np.random.Generator, clean: Channels, kinds: Sequence[str], step: float) -> Self:
        """5 to 50 % of the channel's rms (log-uniform), of either sign."""
        size = np.exp(rng.uniform(np.log(0.05), np.log(0.5))) * rms(clean[kinds[0]])
        return cls(kinds[0], float(rng.choice((-1.0, 1.0)) * size))

    @property
    def parameters(self) -> dict[str, Any]:
        return {"b": self.b}

    def misread(self, channels: Channels, earlier: Callable[[str, float], FloatArray]) -> FloatArray:
        return channels[self.channel] + self.b


@dataclasses.dataclass(frozen=True)
class Delay(Sensor):
    """One channel shows at t the truth of t - tau."""

    early: ClassVar[bool] = True
    tau: float

    @classmethod
    def draw(cls, rng: np.random.Generator, clean: Channels, kinds: Sequence[str], step: float) -> Self:
        late = float(np.exp(rng.uniform(*np.log(DELAYS)))) * step
        return cls(kinds[int(rng.integers(len(kinds)))], late)

    @property
    def parameters(self) -> dict[str, Any]:
        return {"tau": self.tau}

    def misread(self, channels: Channels, earlier: Callable[[str, float], FloatArray]) -> FloatArray:
        return earlier(self.channel, self.tau)


@dataclasses.dataclass(frozen=True)
class ChannelDelay(Delay):
    """A response channel that is late; which one is a parameter too, as its place."""

    @property
    def parameters(self) -> dict[str, Any]:
        return {"channel": self.at, "tau": self.tau}


@dataclasses.dataclass(frozen=True)
class Clipping(Sensor):
    """One channel, force included, shows nothing beyond -limit and limit: 1 to 10 % of its samples are cut."""

    after_noise: ClassVar[bool] = True
    limit: float

    @classmethod
    def draw(cls, rng: np.random.Generator, clean: Channels, kinds: Sequence[str], step: float) -> Self:
        channel = kinds[int(rng.integers(len(kinds)))]
        return cls(channel, float(np.quantile(np.abs(clean[channel]), 1.0 - rng.uniform(*CLIPPED_SHARES))))

    @property
    def parameters(self) -> dict[str, Any]:
        return {"channel": self.at, "limit": self.limit}

    def misread(self, channels: Channels, earlier: Callable[[str, float], FloatArray]) -> FloatArray:
        return np.clip(channels[self.channel], -self.limit, self.limit)


RESPONSES = ("displacement", "velocity", "acceleration")
# cause id -> (the sensor, the kinds of channel it may sit on)
FIRST_SENSORS: dict[str, tuple[type[Sensor], tuple[str, ...]]] = {
    "force_gain": (Gain, ("force",)),
    "accel_gain": (Gain, ("acceleration",)),
}
SENSORS: dict[str, tuple[type[Sensor], tuple[str, ...]]] = FIRST_SENSORS | {
    "force_delay": (Delay, ("force",)),
    "accel_bias": (Bias, ("acceleration",)),
    "channel_delay": (ChannelDelay, RESPONSES),
    "clipping": (Clipping, ("force", *RESPONSES)),
}


def with_noise(rng: np.random.Generator, channels: dict[Key, FloatArray], level: float) -> dict[Key, FloatArray]:
    """White Gaussian noise on every channel (n,), `level` of that channel's rms."""
    return {kind: y + level * rms(y) * rng.standard_normal(y.size) for kind, y in channels.items()}
