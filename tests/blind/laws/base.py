"""What the integrator and the draw ask of a law."""

import abc
import dataclasses
from collections.abc import Sequence
from typing import Any, ClassVar, Literal, Self, TypeAlias

import numpy as np

from ..arrays import FloatArray, rms
from ..drives import Drive
from ..plants import Motion, Plant

Mode: TypeAlias = Any  # a small integer, or a tuple of signs
Hidden: TypeAlias = Sequence[Any]  # hidden states at one instant or (n,) each, or the delayed displacement


# Rms of an effect over that of the linear link's force. Below, it goes under in noise; above, the plant is another one.
SMALLEST_SHARE, LARGEST_SHARE = 0.03, 0.5


def sign(y: float) -> int:
    return int(y > 0.0) - int(y < 0.0)


@dataclasses.dataclass(frozen=True)
class Scene:
    """What a law is made for: a plant, the drive on it, and a motion whose scales are natural to the law."""

    plant: Plant
    drive: Drive
    motion: Motion

    @property
    def x_rms(self) -> float:
        return rms(self.motion.x)

    @property
    def v_rms(self) -> float:
        return rms(self.motion.v)

    @property
    def peak(self) -> float:
        """Largest abs(x) [m]."""
        return self.motion.peak

    @property
    def duration(self) -> float:
        """Length of the record [s]."""
        return float(self.motion.time[-1] - self.motion.time[0])


@dataclasses.dataclass(frozen=True)
class Law(abc.ABC):
    """A force beside the linear spring and damper, on the left of m x'' + c x' + k x + force = g.

    A law that is not smooth is smooth in pieces: its *modes*. Inside a mode its force is analytic, so an integrator of
    high order keeps its order, and the ends of a mode are located as events. Subclasses are dataclasses whose fields
    are the parameters, under their names in the catalogue of causes.

    What a law remembers is `z`: its hidden states, whose rates it gives, or for a law with a `delay` the displacement
    that long ago.
    """

    cause: ClassVar[str]
    at: ClassVar[tuple[int, int]] = (0, 1)
    smooth: ClassVar[bool] = True  # apart from its `stops`
    hidden: ClassVar[tuple[Literal["displacement", "velocity"], ...]] = ()  # what each hidden state is, for tolerances
    shares: ClassVar[tuple[float, float]] = (SMALLEST_SHARE, LARGEST_SHARE)
    # A guard counts as zero at minus this share of the typical velocity or displacement: no mode ends at the instant at
    # which it begins.
    slack: ClassVar[float] = 1e-13
    sized: ClassVar[bool] = True  # whether `scaled` brings its force to a share that was drawn
    chaotic: ClassVar[bool] = False  # whether motions under it may part exponentially
    creeps: ClassVar[bool] = False  # whether its slope at rest is infinite, so that a mass may come near rest and creep
    dry: ClassVar[bool] = False  # whether it, or its twin, may hold the mass still

    @property
    def delay(self) -> float:
        """How long ago the displacement counts [s]; 0 for a law that does not look back."""
        return 0.0

    @classmethod
    @abc.abstractmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        """A law of natural shape whose force along the scene's motion has about the rms `rms_force` [N].

        Raises
        ------
        EscapeError
            If there is no such law.
        """

    @abc.abstractmethod
    def scaled(self, factor: float) -> Self:
        """A law of the same shape with about `factor` times the force, its signs kept."""

    def fits(self, scene: Scene) -> bool:
        """Whether its values are natural to the plant and to a motion that has come about under it."""
        return True

    @abc.abstractmethod
    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        """Force [N] inside a mode, at one instant or along (n,) arrays; `load` is g - c v - k x [N]."""

    def reach(self, stiffness: float) -> float:
        """Largest abs(x) [m] at which a plant with this linear stiffness [N/m] is still taken for a fair question."""
        return np.inf

    def start(self, x: float, v: float, stiffness: float) -> tuple[float, float]:
        """Where a motion under this law begins that would begin at x [m] and v [m/s] without it."""
        return x, v

    @property
    def twin(self) -> "Law":
        """A law of about the same force, tame enough for one step a sample."""
        return self

    # what it remembers

    def hidden_start(self, x: float, v: float) -> Hidden:
        """Hidden states at a start from x [m] and v [m/s]: relaxed."""
        return (0.0,) * len(self.hidden)

    def hidden_rates(self, x: Any, v: Any, z: Hidden, mode: Mode) -> Hidden:
        """Rates of the hidden states inside a mode."""
        return ()

    def hidden_at_rest(self, x: float, z: Hidden, elapsed: Any) -> Hidden:
        """Hidden states `elapsed` [s], (n,) or one, after they were `z`, the mass held at x [m] since."""
        return z

    def confined(self, z: Hidden) -> Hidden:
        """Hidden states put back within their bounds, for a stepper that is blind to the ends of modes."""
        return z

    # modes

    def first_mode(self, x: float, v: float, z: Hidden, t: float, load: float) -> Mode:
        """The mode that begins in this state at t [s] under `load` [N]."""
        return 0

    def velocity_guards(self, mode: Mode, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        """Velocities [m/s], at one instant or (n,) each, that are all positive while a moving mode lasts."""
        return ()

    def displacement_guards(self, mode: Mode, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        """Displacements [m], at one instant or (n,) each, that are all positive while a moving mode lasts."""
        return ()

    def next_mode(self, mode: Mode, which: int, load: float) -> Mode:
        """The mode that follows under a `load_to_hold` [N] where guard number `which` of `mode` has come to zero.

        The guards are counted velocities first; `which` is -1 where a mass that was held is let go.
        """
        raise NotImplementedError(f"{type(self).__name__} is not smooth and must say which mode follows")

    def holds(self, mode: Mode) -> bool:
        """Whether the mass is held still in this mode."""
        return False

    def load_to_hold(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        """What of `load` [N] is left to a law that holds the mass: all of it, unless another force acts beside it."""
        return load

    def release(self, load: FloatArray) -> FloatArray:
        """Positive while a held mass stays, (n,) [N], for a `load_to_hold` (n,) [N]."""
        raise NotImplementedError(f"{type(self).__name__} holds the mass and must say when it lets go")

    # time

    def stops(self, begin: float, end: float) -> FloatArray:
        """Instants [s] between `begin` and `end` that no step of an integrator may pass over, (stops,), ascending."""
        return np.empty(0)

    def mode_after_stop(self, mode: Mode, t: float) -> Mode:
        """The mode from a stop at t [s] on; it need not be one of this law's own."""
        return mode


@dataclasses.dataclass(frozen=True)
class KinkedLaw(Law):
    """A law with kinks where some displacements or velocities pass zero; its mode is the tuple of their signs."""

    smooth: ClassVar[bool] = False

    def velocity_kinks(self, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        """Velocities [m/s] at whose sign changes the law has a kink."""
        return ()

    def displacement_kinks(self, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        """Displacements [m] at whose sign changes the law has a kink; they grow with x."""
        return ()

    def first_mode(self, x: float, v: float, z: Hidden, t: float, load: float) -> Mode:
        kinks = self.velocity_kinks(x, v, z) + self.displacement_kinks(x, v, z)
        return tuple([sign(y) or sign(v) or sign(load) or 1 for y in kinks])

    def velocity_guards(self, mode: Mode, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        return tuple(side * y for side, y in zip(mode, self.velocity_kinks(x, v, z), strict=False))

    def displacement_guards(self, mode: Mode, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        kinks = self.displacement_kinks(x, v, z)
        return tuple(side * y for side, y in zip(mode[len(mode) - len(kinks) :], kinks, strict=True))

    def next_mode(self, mode: Mode, which: int, load: float) -> Mode:
        return tuple(-side if i == which else side for i, side in enumerate(mode))


@dataclasses.dataclass(frozen=True)
class NoLaw(Law):
    """The linear plant as it is."""

    cause: ClassVar[str] = "none"

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        return cls()

    def scaled(self, factor: float) -> Self:
        return self

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return 0.0 * x


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def either_sign(rng: np.random.Generator) -> float:
    return float(rng.choice((-1.0, 1.0)))
