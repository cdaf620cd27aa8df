"""What can be wrong on the measuring side: gain, delay, bias and range of a channel."""

import operator
from typing import Any, ClassVar

import equinox as eqx

from .._types import as_scalar, is_traced
from ._term import ABOVE_ZERO, Parameter, Scalar
from ._written import part_text

CHANNEL_KINDS = ("force", "displacement", "velocity", "acceleration")
RESPONSES = CHANNEL_KINDS[1:]


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
    """An effect of one measuring channel; `channels` are the kinds of channel that can have it."""

    at: eqx.AbstractVar[tuple[str, int]]
    kind: ClassVar[str]
    channels: ClassVar[tuple[str, ...]]
    parameters: ClassVar[tuple[Parameter, ...]]

    @property
    def place(self) -> str:
        """The channel as it stands in a path, ``force-1``."""
        return f"{self.at[0]}-{self.at[1]}"

    @property
    def value(self) -> Any:
        """The effect's one number: a float, unless it is being traced."""
        number = getattr(self, self.parameters[0].name)
        return number if is_traced(number) else float(number)

    def __repr__(self) -> str:
        return part_text(self)

    def __check_init__(self):
        if self.at[0] not in self.channels or self.at[1] < 1:
            kinds = " or ".join(self.channels)
            raise ValueError(f"`at` of {self.kind} must be ({kinds}, degree of freedom from 1); got {self.at!r}.")
        self.parameters[0].check(self.value, self.kind)


class ForceGain(AbstractSensor):
    """The force sensor reads (1 + eps) times the force."""

    eps: Scalar = eqx.field(converter=as_scalar)
    at: tuple[str, int] = eqx.field(converter=as_channel, static=True, kw_only=True)
    kind = "force_gain"
    channels = ("force",)
    parameters = (
        Parameter("eps", positive=False, meaning="relative gain error of the force sensor", low=-0.8, high=2.0),
    )


class AccelerationGain(AbstractSensor):
    """The accelerometer reads (1 + eps) times the acceleration."""

    eps: Scalar = eqx.field(converter=as_scalar)
    at: tuple[str, int] = eqx.field(converter=as_channel, static=True, kw_only=True)
    kind = "accel_gain"
    channels = ("acceleration",)
    parameters = (
        Parameter("eps", positive=False, meaning="relative gain error of the accelerometer", low=-0.8, high=2.0),
    )


class ForceDelay(AbstractSensor):
    """The force sensor is late: it reads the force of tau ago."""

    tau: Scalar = eqx.field(converter=as_scalar)
    at: tuple[str, int] = eqx.field(converter=as_channel, static=True, kw_only=True)
    kind = "force_delay"
    channels = ("force",)
    parameters = (Parameter("tau", time=1, positive=False, meaning="delay of the force sensor", usual=1),)


class CommandDelay(ForceDelay):
    """The drive is late: what it was told to do, which is the force that was recorded, acts tau later.

    To the plant it is a force that reads early by as much.
    """

    kind = "command_delay"
    parameters = (Parameter("tau", time=1, positive=False, meaning="delay of the command", usual=1),)

    @property
    def value(self) -> Any:
        """How late the force reads."""
        return -super().value


class ChannelDelay(AbstractSensor):
    """A response channel is late: it reads the motion of tau ago."""

    tau: Scalar = eqx.field(converter=as_scalar)
    at: tuple[str, int] = eqx.field(converter=as_channel, static=True, kw_only=True)
    kind = "channel_delay"
    channels = RESPONSES
    parameters = (Parameter("tau", time=1, positive=False, meaning="delay of the channel", usual=1),)


class AccelerationBias(AbstractSensor):
    """The accelerometer reads `b` more than there is."""

    b: Scalar = eqx.field(converter=as_scalar)
    at: tuple[str, int] = eqx.field(converter=as_channel, static=True, kw_only=True)
    kind = "accel_bias"
    channels = ("acceleration",)
    parameters = (Parameter("b", length=1, time=-2, positive=False, meaning="bias of the accelerometer"),)


class Clipping(AbstractSensor):
    """The channel shows nothing beyond ±limit.

    The motion is not changed by it; of a clipped force the lost arcs are reconstructed before it drives anything.
    """

    limit: Scalar = eqx.field(converter=as_scalar)
    at: tuple[str, int] = eqx.field(converter=as_channel, static=True, kw_only=True)
    kind = "clipping"
    channels = CHANNEL_KINDS
    parameters = (Parameter("limit", meaning="largest reading, in the channel's unit", least=ABOVE_ZERO, free=False),)


class Offset(AbstractSensor):
    """The channel reads `b` more than there is: a nuisance that fits carry along, never a finding by itself."""

    b: Scalar = eqx.field(converter=as_scalar)
    at: tuple[str, int] = eqx.field(converter=as_channel, static=True, kw_only=True)
    kind = "offset"
    channels = CHANNEL_KINDS
    parameters = (Parameter("b", positive=False, meaning="offset of the channel, in its unit"),)

    @staticmethod
    def path(kind: str, place: int) -> str:
        """What a structure calls the offset of a channel."""
        return f"offset@{kind}-{place}.b"


def is_offset(path: str, *kinds: str) -> bool:
    """Whether a structure's number of that path is the offset of a channel, of any kind or of these."""
    return path.startswith(tuple(f"offset@{kind}-" for kind in kinds or CHANNEL_KINDS))


SENSORS = (ForceGain, AccelerationGain, ForceDelay, CommandDelay, ChannelDelay, AccelerationBias, Clipping, Offset)
