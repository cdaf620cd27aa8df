"""What can be wrong on the measuring side: gains of a channel."""

import operator
from typing import Any, ClassVar

import equinox as eqx

from .._types import as_scalar
from ._term import Parameter, Scalar

CHANNEL_KINDS = ("force", "displacement", "velocity", "acceleration")


def as_channel(at: Any) -> tuple[str, int]:
    """A pair (kind, degree of freedom) such as ("force", 1)."""
    try:
        kind, dof = at
        return str(kind), operator.index(dof)
    except (TypeError, ValueError):
        raise ValueError(
            f"`at` of a sensor effect must be (kind, degree of freedom), e.g. ('force', 1); got {at!r}."
        ) from None


class AbstractSensor(eqx.Module):
    """An effect of one measuring channel."""

    at: eqx.AbstractVar[tuple[str, int]]
    kind: ClassVar[str]
    channel: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]]

    @property
    def place(self) -> str:
        """The channel as it stands in a path, ``force-1``."""
        return f"{self.at[0]}-{self.at[1]}"

    @property
    def value(self) -> float:
        """The effect's one number."""
        return float(getattr(self, self.parameters[0].name))

    def __check_init__(self):
        allowed = CHANNEL_KINDS if self.channel == "any" else (self.channel,)
        if self.at[0] not in allowed or self.at[1] < 1:
            raise ValueError(
                f"`at` of {self.kind} must be ({' or '.join(allowed)}, degree of freedom from 1); got {self.at!r}."
            )


class ForceGain(AbstractSensor):
    """The force sensor reads (1 + eps) times the force."""

    eps: Scalar = eqx.field(converter=as_scalar)
    at: tuple[str, int] = eqx.field(converter=as_channel, static=True, kw_only=True)
    kind = "force_gain"
    channel = "force"
    parameters = (
        Parameter("eps", positive=False, meaning="relative gain error of the force sensor", low=-0.8, high=2.0),
    )


class AccelerationGain(AbstractSensor):
    """The accelerometer reads (1 + eps) times the acceleration."""

    eps: Scalar = eqx.field(converter=as_scalar)
    at: tuple[str, int] = eqx.field(converter=as_channel, static=True, kw_only=True)
    kind = "accel_gain"
    channel = "acceleration"
    parameters = (
        Parameter("eps", positive=False, meaning="relative gain error of the accelerometer", low=-0.8, high=2.0),
    )


class Offset(AbstractSensor):
    """The channel reads `b` more than there is: a nuisance that fits carry along, never a finding by itself."""

    b: Scalar = eqx.field(converter=as_scalar)
    at: tuple[str, int] = eqx.field(converter=as_channel, static=True, kw_only=True)
    kind = "offset"
    channel = "any"
    parameters = (Parameter("b", positive=False, meaning="offset of the channel, in its unit"),)


SENSORS = (ForceGain, AccelerationGain, Offset)
