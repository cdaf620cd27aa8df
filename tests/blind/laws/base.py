"""What the integrator and the draw ask of a law."""

import abc
import dataclasses
from typing import Any, ClassVar, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Law(abc.ABC):
    """A force beside the linear spring and damper, on the left of m x'' + c x' + k x + force = g.

    A law that is not smooth is smooth in pieces: its *modes*, small integers. Inside a mode its force is analytic, so
    an integrator of high order keeps its order, and the ends of a mode are located as events. Subclasses are
    dataclasses whose fields are the parameters, under their names in the catalogue of causes.
    """

    cause: ClassVar[str]
    at: ClassVar[tuple[int, int]] = (0, 1)
    smooth: ClassVar[bool] = True

    @classmethod
    @abc.abstractmethod
    def draw(cls, rng: np.random.Generator, x: FloatArray, v: FloatArray, rms_force: float) -> Self:
        """A law whose force along the motion x [m], v [m/s], both (n,), has about the rms `rms_force` [N]."""

    @abc.abstractmethod
    def scaled(self, factor: float) -> Self:
        """The same law with `factor` times the force at every state, its signs kept."""

    @abc.abstractmethod
    def force(self, x: Any, v: Any, load: Any, mode: int) -> Any:
        """Force [N] inside a mode, at one state or along (n,) arrays; `load` is g - c v - k x [N]."""

    def reach(self, stiffness: float) -> float:
        """Largest abs(x) [m] at which a plant with this linear stiffness [N/m] is still taken for a fair question."""
        return np.inf

    def first_mode(self, v: float, load: float) -> int:
        """The mode that begins at velocity v [m/s] under `load` [N]."""
        return 0

    def guard(self, mode: int, x: float, v: float) -> float:
        """Positive while a moving mode lasts; a velocity [m/s], which sets how finely its zero is told."""
        raise NotImplementedError(f"{type(self).__name__} is not smooth and must say where its modes end")

    def next_mode(self, mode: int, load: float) -> int:
        """The mode that follows where the guard of `mode` has come to zero under `load` [N]."""
        raise NotImplementedError(f"{type(self).__name__} is not smooth and must say which mode follows")

    def holds(self, mode: int) -> bool:
        """Whether the mass is held still in this mode."""
        return False

    def release(self, load: FloatArray) -> FloatArray:
        """Positive while a held mass stays, (n,) [N], for loads (n,) [N]."""
        raise NotImplementedError(f"{type(self).__name__} holds the mass and must say when it lets go")


@dataclasses.dataclass(frozen=True)
class NoLaw(Law):
    """The linear plant as it is."""

    cause: ClassVar[str] = "none"

    @classmethod
    def draw(cls, rng: np.random.Generator, x: FloatArray, v: FloatArray, rms_force: float) -> Self:
        return cls()

    def scaled(self, factor: float) -> Self:
        return self

    def force(self, x: Any, v: Any, load: Any, mode: int) -> Any:
        return 0.0 * x


def rms(y: FloatArray) -> float:
    """Root of the mean square, in the unit of y (n,)."""
    return float(np.sqrt(np.mean(np.square(y))))
