"""The catalogue of causes: stable names for what a model may lack."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from ._sensors import (
    AbstractSensor,
    AccelerationBias,
    AccelerationGain,
    ChannelDelay,
    Clipping,
    ForceDelay,
    ForceGain,
)
from ._structure import MASS, Structure
from ._term import Parameter
from .terms import (
    AttachedOscillator,
    BilinearDamping,
    BilinearStiffness,
    BoucWen,
    Coulomb,
    CoulombAsymmetric,
    CubicDamping,
    CubicStiffness,
    DampingDrift,
    DeadZone,
    DelayedForce,
    DoubleWell,
    EndStop,
    FreePlay,
    Jenkins,
    LinearDamping,
    LinearStiffness,
    LuGre,
    Maxwell,
    ParametricStiffness,
    PeriodicDisturbance,
    PositionDamping,
    PowerDamping,
    Preload,
    QuadraticDamping,
    QuadraticStiffness,
    QuinticStiffness,
    Saturation,
    SineStiffness,
    SmoothCoulomb,
    SquareStiffness,
    StiffnessDrift,
    StiffnessDrop,
    Stribeck,
    VanDerPol,
)


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

    @property
    def is_value(self) -> bool:
        """Whether it is a wrong value of the model's own, which a refit mends."""
        return self.family == "parameters"

    def has_sign_of(self, first: float) -> bool:
        """Whether a number, the first of a law, has the sign of this cause; any has that of one with both."""
        return not self.sign or math.copysign(1, first) == self.sign

    def term(self, at: tuple, **parameters: float) -> Any:
        """The term (or sensor effect) with these numbers.

        Raises
        ------
        TypeError
            If a parameter is missing or unknown.
        ValueError
            If a parameter has the sign of another cause.
        """
        name, first = self._first(parameters)
        if not self.has_sign_of(first):
            must = "positive" if self.sign > 0 else "negative"
            raise ValueError(f"`{name}` of {self.id} must be {must}; got {first}.")
        return self.effect(**parameters, at=at)

    def apply(self, model: Structure, at: tuple, **parameters: float) -> Structure:
        """The model extended by this cause; of a wrong value, the model with this value.

        Raises
        ------
        TypeError, ValueError
            As `term`; or if the model has no such value of its own.
        """
        if not self.is_value:
            return model + self.term(at, **parameters)
        name = f"{self.effect.kind}@{'-'.join(map(str, at))}"
        paths = model.select(name)
        if not paths:
            raise ValueError(
                f"`at` of {self.id} must be where the model has one; got {at}, it has {', '.join(model.values())}."
            )
        return model.with_values({paths[0]: self._first(parameters)[1]})

    def _first(self, parameters: Mapping[str, float]) -> tuple[str, float]:
        """Name and value of the first number, once all names are the effect's own."""
        names = [p.name for p in self.effect.parameters]
        if set(parameters) != set(names):
            raise TypeError(f"{self.id} takes {', '.join(names)}; got {', '.join(parameters) or 'nothing'}.")
        return names[0], parameters[names[0]]


class _Mass:
    """Stands for the masses of a structure, which are no terms."""

    kind = "mass"
    parameters = (MASS,)


class _Own:
    """Stands for the numbers of a simulation's own function."""

    kind = "own"
    parameters = (Parameter("value"),)


_CAUSES = (
    Cause("stiffness_value", "parameters", "a wrong stiffness", LinearStiffness, 0,
          "a spring is stiffer or softer than stated"),
    Cause("damping_value", "parameters", "a wrong damping", LinearDamping, 0,
          "a dashpot is stronger or weaker than stated"),
    Cause("mass_value", "parameters", "a wrong mass", _Mass, 0, "a mass is larger or smaller than stated"),
    Cause("own_value", "parameters", "a wrong number", _Own, 0, "a number of a simulation's own function is off"),
    Cause("cubic_hardening", "stiffness", "a cubic hardening spring", CubicStiffness, 1,
          "the spring grows stiffer with the square of the displacement"),
    Cause("cubic_softening", "stiffness", "a cubic softening spring", CubicStiffness, -1,
          "the spring grows softer with the square of the displacement"),
    Cause("quadratic_stiffness", "stiffness", "a quadratic spring", QuadraticStiffness, 0,
          "the spring is stiffer to one side than to the other"),
    Cause("quintic_stiffness", "stiffness", "a quintic spring", QuinticStiffness, 0,
          "the spring changes with the fourth power of the displacement"),
    Cause("bilinear_stiffness", "stiffness", "a spring on one side", BilinearStiffness, 0,
          "the stiffness changes at a knot, on one side only"),
    Cause("dead_zone", "stiffness", "play in the spring", DeadZone, 1,
          "the spring acts only beyond a gap"),
    Cause("end_stop", "stiffness", "an elastic stop", EndStop, 1,
          "a second spring joins beyond a gap"),
    Cause("saturation", "stiffness", "a spring that saturates", Saturation, 1,
          "the spring's force stops growing beyond some displacement"),
    Cause("double_well", "stiffness", "a buckled spring", DoubleWell, 1,
          "the stiffness is negative at the centre, so that there are two wells"),
    Cause("sine_stiffness", "stiffness", "a pendulum's spring", SineStiffness, 0,
          "the force goes with the sine of the displacement"),
    Cause("square_stiffness", "stiffness", "an odd quadratic spring", SquareStiffness, 0,
          "the spring changes with the size of the displacement"),
    Cause("missing_stiffness", "stiffness", "a linear spring", LinearStiffness, 1,
          "a spring ties masses that the model does not tie"),
    Cause("coulomb", "damping", "Coulomb friction", Coulomb, 1,
          "dry friction of constant size, which sticks"),
    Cause("coulomb_asymmetric", "damping", "Coulomb friction that differs with the direction", CoulombAsymmetric, 1,
          "dry friction, larger one way than the other"),
    Cause("stribeck", "damping", "Stribeck friction", Stribeck, 1,
          "dry friction that falls with speed"),
    Cause("smooth_coulomb", "damping", "smooth Coulomb friction", SmoothCoulomb, 1,
          "friction that turns over smoothly and never sticks"),
    Cause("quadratic_damping", "damping", "quadratic damping", QuadraticDamping, 1,
          "a drag that grows with the square of the velocity"),
    Cause("cubic_damping", "damping", "cubic damping", CubicDamping, 1,
          "a drag that grows with the cube of the velocity"),
    Cause("power_damping", "damping", "power-law damping", PowerDamping, 1,
          "a drag that grows with a power of the velocity"),
    Cause("van_der_pol", "damping", "van der Pol damping", VanDerPol, 1,
          "small motions are driven, large ones braked"),
    Cause("position_damping", "damping", "damping that grows with displacement", PositionDamping, 1,
          "the damping grows with the square of the displacement"),
    Cause("bilinear_damping", "damping", "damping one way", BilinearDamping, 0,
          "the damping differs with the direction of motion"),
    Cause("missing_damping", "damping", "a linear dashpot", LinearDamping, 1,
          "a dashpot brakes a motion that the model leaves free"),
    Cause("bouc_wen", "memory", "Bouc-Wen hysteresis", BoucWen, 1,
          "a spring that yields smoothly and remembers it"),
    Cause("jenkins", "memory", "a Jenkins slider", Jenkins, 1,
          "a spring in series with a slider"),
    Cause("lugre", "memory", "LuGre friction", LuGre, 1,
          "friction with bristles that bend before they slide"),
    Cause("free_play", "memory", "play that drags a slider", FreePlay, 1,
          "a spring behind a gap drags a slider"),
    Cause("maxwell", "memory", "a Maxwell element", Maxwell, 1,
          "a spring that relaxes"),
    Cause("attached_oscillator", "memory", "an attached oscillator", AttachedOscillator, 1,
          "a mass on a spring of its own takes part"),
    Cause("delayed_force", "memory", "a force that comes late", DelayedForce, 0,
          "a force that answers the displacement of a moment ago"),
    Cause("stiffness_drift", "time", "a drifting stiffness", StiffnessDrift, 0,
          "the stiffness changes steadily with time"),
    Cause("stiffness_drop", "time", "a sudden change of stiffness", StiffnessDrop, 0,
          "part of the stiffness is lost at an instant"),
    Cause("damping_drift", "time", "a drifting damping", DampingDrift, 0,
          "the damping changes steadily with time"),
    Cause("parametric_stiffness", "time", "a pulsating stiffness", ParametricStiffness, 1,
          "the stiffness pulsates at a frequency of its own"),
    Cause("preload", "input", "a constant force", Preload, 0,
          "a constant force that nobody measured"),
    Cause("periodic_disturbance", "input", "a harmonic force", PeriodicDisturbance, 1,
          "a harmonic force that nobody measured"),
    Cause("force_gain", "sensor", "a gain error of the force sensor", ForceGain, 0,
          "it reads too much or too little by a fixed share"),
    Cause("force_delay", "sensor", "a delay of the force", ForceDelay, 0,
          "it is late or early by a fixed time"),
    Cause("accel_bias", "sensor", "a bias of the accelerometer", AccelerationBias, 0,
          "it reads too much or too little by a fixed amount"),
    Cause("accel_gain", "sensor", "a gain error of the accelerometer", AccelerationGain, 0,
          "it reads too much or too little by a fixed share"),
    Cause("channel_delay", "sensor", "a delay of a response channel", ChannelDelay, 0,
          "it is late or early by a fixed time"),
    Cause("clipping", "sensor", "a clipped channel", Clipping, 0,
          "it shows nothing beyond its range"),
)  # fmt: skip

OWN_VALUE = "own_value"
"""Cause id of a number of a simulation's own function that is wrong."""
PARAMETER_CAUSES = {"stiffness": "stiffness_value", "damping": "damping_value", "mass": "mass_value"}
"""Cause id of an own value that is wrong, by the kind in its path."""


def causes() -> Mapping[str, Cause]:
    """Every cause that `diagnose` can name, by its id."""
    return {cause.id: cause for cause in _CAUSES}
