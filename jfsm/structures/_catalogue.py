"""The catalogue of causes: stable names for what a model may lack."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from ._sensors import AbstractSensor, AccelerationGain, ForceGain
from ._structure import Structure
from .terms import Coulomb, CubicStiffness, QuadraticDamping, QuadraticStiffness


class Cause(NamedTuple):
    """One entry: a law or a sensor effect, its sign, and its sentence.

    `sign` is +1 or -1 where the cause is one sign of the law, 0 where both are the same cause.
    """

    id: str
    family: str
    label: str
    effect: type[Any]
    sign: int
    sentence: str

    @property
    def is_sensor(self) -> bool:
        """Whether it sits on the measuring side."""
        return issubclass(self.effect, AbstractSensor)

    def term(self, at: tuple[int, int], **parameters: float) -> Any:
        """The term (or sensor effect) with these numbers.

        Raises
        ------
        TypeError
            If a parameter is missing or unknown.
        ValueError
            If a parameter has the sign of another cause.
        """
        names = [p.name for p in self.effect.parameters]
        if set(parameters) != set(names):
            raise TypeError(f"{self.id} takes {', '.join(names)}; got {', '.join(parameters) or 'nothing'}.")
        first = parameters[names[0]]
        if self.sign and math.copysign(1, first) != self.sign:
            raise ValueError(
                f"`{names[0]}` of {self.id} must be {'positive' if self.sign > 0 else 'negative'}; got {first}."
            )
        return self.effect(**parameters, at=at)

    def apply(self, model: Structure, at: tuple, **parameters: float) -> Structure:
        """The model extended by this cause."""
        return model + self.term(at, **parameters)


_CAUSES = (
    Cause(
        "cubic_hardening", "stiffness", "a cubic hardening spring", CubicStiffness, 1,
        "the spring grows stiffer with the square of the displacement",
    ),
    Cause(
        "cubic_softening", "stiffness", "a cubic softening spring", CubicStiffness, -1,
        "the spring grows softer with the square of the displacement",
    ),
    Cause(
        "quadratic_stiffness", "stiffness", "a quadratic spring", QuadraticStiffness, 0,
        "the spring is stiffer to one side than to the other",
    ),
    Cause("coulomb", "damping", "Coulomb friction", Coulomb, 1, "dry friction of constant size, which sticks"),
    Cause(
        "quadratic_damping", "damping", "quadratic damping", QuadraticDamping, 1,
        "a drag that grows with the square of the velocity",
    ),
    Cause(
        "force_gain", "sensor", "a gain error of the force sensor", ForceGain, 0,
        "it reads too much or too little by a fixed share",
    ),
    Cause(
        "accel_gain", "sensor", "a gain error of the accelerometer", AccelerationGain, 0,
        "it reads too much or too little by a fixed share",
    ),
)  # fmt: skip

PARAMETER_CAUSES = {"stiffness": "stiffness_value", "damping": "damping_value", "mass": "mass_value"}
"""Cause id of an own value that is wrong, by the kind in its path."""


def causes() -> Mapping[str, Cause]:
    """Every cause that `diagnose` can name, by its id; the wrong own values of a model come on top."""
    return {cause.id: cause for cause in _CAUSES}
