"""Sensors that misread, and the noise on all of them."""

import dataclasses
from typing import TypeAlias

import numpy as np

from .laws.base import FloatArray, rms

Channels: TypeAlias = dict[str, FloatArray]

GAINS = {"force_gain": "force", "accel_gain": "acceleration"}
UNITS = {"force": "N", "displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}


@dataclasses.dataclass(frozen=True)
class Gain:
    """One channel shows (1 + eps) times the truth."""

    channel: str
    eps: float

    @classmethod
    def draw(cls, rng: np.random.Generator, channel: str) -> "Gain":
        """5 to 40 % (log-uniform), too much or too little."""
        return cls(channel, float(rng.choice((-1.0, 1.0)) * np.exp(rng.uniform(np.log(0.05), np.log(0.4)))))

    @property
    def at(self) -> tuple[str, int]:
        return self.channel, 1

    def shown(self, channels: Channels) -> Channels:
        return {**channels, self.channel: (1.0 + self.eps) * channels[self.channel]}


def with_noise(rng: np.random.Generator, channels: Channels, level: float) -> Channels:
    """White Gaussian noise on every channel (n,), `level` of that channel's rms."""
    return {kind: y + level * rms(y) * rng.standard_normal(y.size) for kind, y in channels.items()}
