"""Two laws that act on one mass together."""

import dataclasses
from typing import Any, ClassVar, Literal, Self

import numpy as np

from ..arrays import FloatArray
from ..plants import Motion
from .base import Hidden, Law, Mode, Scene


@dataclasses.dataclass(frozen=True)
class Both(Law):
    """The sum of two laws; its mode is the pair of their modes, its hidden states are those of both.

    What it remembers are the hidden states of the first, those of the second, and the delayed displacement if one of
    them looks back. Of the two only the first may be dry friction, whose force at rest is what the other leaves of the
    load.

    Raises
    ------
    ValueError
        If the second is dry friction, or both look back: two frictions at rest share the load in no definite way.
    """

    cause: ClassVar[str] = "both"
    first: Law
    second: Law

    def __post_init__(self) -> None:
        names = f"{type(self.first).__name__} and {type(self.second).__name__}"
        if self.second.dry:
            raise ValueError(f"`second` must not be dry friction; got {names}. Give one at most, and first.")
        if self.first.delay and self.second.delay:
            raise ValueError(f"one of the two laws at most may have a delay; got {names}. Give another one of them.")

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, rms_force: float) -> Self:
        raise NotImplementedError("two laws are drawn one by one: give `Both` the two")

    def scaled(self, factor: float) -> Self:
        return dataclasses.replace(self, first=self.first.scaled(factor), second=self.second.scaled(factor))

    def fits(self, scene: Scene) -> bool:
        return self.first.fits(scene) and self.second.fits(scene)

    # what the two have in common

    @property
    def smooth(self) -> bool:
        return self.first.smooth and self.second.smooth

    @property
    def hidden(self) -> tuple[Literal["displacement", "velocity"], ...]:
        return self.first.hidden + self.second.hidden

    @property
    def slack(self) -> float:
        return max(self.first.slack, self.second.slack)

    @property
    def chaotic(self) -> bool:
        return self.first.chaotic or self.second.chaotic

    @property
    def creeps(self) -> bool:
        return self.first.creeps or self.second.creeps

    @property
    def dry(self) -> bool:
        return self.first.dry

    @property
    def delay(self) -> float:
        return self.first.delay or self.second.delay

    @property
    def twin(self) -> Law:
        return Both(self.first.twin, self.second.twin)

    def reach(self, stiffness: float) -> float:
        return min(self.first.reach(stiffness), self.second.reach(stiffness))

    def start(self, x: float, v: float, stiffness: float) -> tuple[float, float]:
        return self.second.start(*self.first.start(x, v, stiffness), stiffness)

    # force

    def force(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        beside = self._beside(x, v, z, t, mode)
        return beside + self.first.force(x, v, self._split(z)[0], t, load - beside, mode[0])

    def load_to_hold(self, x: Any, v: Any, z: Hidden, t: Any, load: Any, mode: Mode) -> Any:
        return load - self._beside(x, v, z, t, mode)

    def parts(self, motion: Motion) -> tuple[FloatArray, FloatArray]:
        """The force of each of the two along a motion under both, (n,) each [N]."""
        _, past = self._split(motion.hidden)
        instants = zip(*(y.tolist() for y in (motion.time, motion.x, motion.v, *past)), strict=True)
        beside = np.array([self._beside_now(x, v, z, t) for t, x, v, *z in instants])
        return motion.effect - beside, beside

    def _beside_now(self, x: float, v: float, z: Hidden, t: float) -> float:
        """Force of the second law [N] from the state alone; `z` is what the second remembers."""
        # A load decides on a mode only at rest on a kink, where the force of either side is the same.
        return float(self.second.force(x, v, z, t, 0.0, self.second.first_mode(x, v, z, t, 0.0)))

    def _beside(self, x: Any, v: Any, z: Hidden, t: Any, mode: Mode) -> Any:
        """Force of the second law [N], which is not dry friction and so is no matter of the load."""
        return self.second.force(x, v, self._split(z)[1], t, 0.0, mode[1])

    # what they remember

    def _split(self, z: Hidden) -> tuple[Hidden, Hidden]:
        """What each of the two remembers."""
        i = len(self.first.hidden)
        j = i + len(self.second.hidden)
        late = tuple(z[j:])
        return (
            (*z[:i], *late) if self.first.delay else z[:i],
            (*z[i:j], *late) if self.second.delay else z[i:j],
        )

    def hidden_start(self, x: float, v: float) -> Hidden:
        return *self.first.hidden_start(x, v), *self.second.hidden_start(x, v)

    def hidden_rates(self, x: Any, v: Any, z: Hidden, mode: Mode) -> Hidden:
        one, other = self._split(z)
        return *self.first.hidden_rates(x, v, one, mode[0]), *self.second.hidden_rates(x, v, other, mode[1])

    def hidden_at_rest(self, x: float, z: Hidden, elapsed: Any) -> Hidden:
        one, other = self._split(z)
        return *self.first.hidden_at_rest(x, one, elapsed), *self.second.hidden_at_rest(x, other, elapsed)

    def confined(self, z: Hidden) -> Hidden:
        one, other = self._split(z)
        return *self.first.confined(one), *self.second.confined(other)

    # modes

    def first_mode(self, x: float, v: float, z: Hidden, t: float, load: float) -> Mode:
        one, other = self._split(z)
        second = self.second.first_mode(x, v, other, t, load)
        beside = self.second.force(x, v, other, t, load, second)
        return self.first.first_mode(x, v, one, t, load - beside), second

    def velocity_guards(self, mode: Mode, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        (one, other), (first, second) = self._split(z), mode
        return self.first.velocity_guards(first, x, v, one) + self.second.velocity_guards(second, x, v, other)

    def displacement_guards(self, mode: Mode, x: Any, v: Any, z: Hidden) -> tuple[Any, ...]:
        one, other = self._split(z)
        return self.first.displacement_guards(mode[0], x, v, one) + self.second.displacement_guards(
            mode[1], x, v, other
        )

    def next_mode(self, mode: Mode, which: int, load: float) -> Mode:
        first, second = mode
        if which < 0:
            return self.first.next_mode(first, which, load), second
        speeds, lengths = _guards(self.first, first)
        speeds_of_second, _ = _guards(self.second, second)
        # In their order: speeds of the first and of the second, lengths of the first and of the second.
        if which < speeds:
            return self.first.next_mode(first, which, load), second
        if which < speeds + speeds_of_second:
            return first, self.second.next_mode(second, which - speeds, load)
        if which < speeds + speeds_of_second + lengths:
            return self.first.next_mode(first, which - speeds_of_second, load), second
        return first, self.second.next_mode(second, which - speeds - lengths, load)

    def holds(self, mode: Mode) -> bool:
        return self.first.holds(mode[0])

    def release(self, load: FloatArray) -> FloatArray:
        return self.first.release(load)

    # time

    def stops(self, begin: float, end: float) -> FloatArray:
        return np.union1d(self.first.stops(begin, end), self.second.stops(begin, end))

    def mode_after_stop(self, mode: Mode, t: float) -> Mode:
        return self.first.mode_after_stop(mode[0], t), self.second.mode_after_stop(mode[1], t)


def _guards(law: Law, mode: Mode) -> tuple[int, int]:
    """How many velocity and how many displacement guards a mode has, wherever the mass is."""
    z = (0.0,) * len(law.hidden)
    return len(law.velocity_guards(mode, 0.0, 0.0, z)), len(law.displacement_guards(mode, 0.0, 0.0, z))
