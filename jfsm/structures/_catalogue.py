"""The catalogue of causes: stable names for what a model may lack."""

import math
from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any, NamedTuple

from ._definition import FAMILIES
from ._sensors import (
    AbstractSensor,
    AccelerationBias,
    AccelerationGain,
    ChannelDelay,
    Clipping,
    CommandDelay,
    ForceDelay,
    ForceGain,
)
from ._structure import MASS, Structure
from ._term import AbstractFriction, AbstractTerm, Parameter
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
    ElasticJoint,
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
    Ripple,
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

    `sign` is +1 or -1 where the cause is one sign of the law, 0 where both are the same cause. `examples` are places
    and numbers of the law to begin from; where there are any, it is looked for at these places alone.
    """

    id: str
    family: str
    label: str
    effect: type[Any]
    sign: int
    sentence: str
    examples: tuple[tuple[tuple, tuple[float, ...]], ...] = ()

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

    def examples_at(self, at: tuple) -> list[Any]:
        """The terms at a place that a search begins from as well."""
        return [self.effect(*numbers, at=at) for place, numbers in self.examples if place == at]

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


CauseLike = str | Cause | type[AbstractTerm] | type[AbstractSensor] | AbstractTerm | AbstractSensor
"""What may be named as a cause: an id, a cause, a law or a sensor's fault as a class or as an object."""


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
    Cause("ripple", "stiffness", "a force that repeats with the position", Ripple, 1,
          "it comes back so many times a turn, or at equal distances, as cogging and errors of gears do"),
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
    Cause("elastic_joint", "memory", "an elastic joint", ElasticJoint, 1,
          "part of the mass moves behind a spring that the model takes as rigid"),
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
    Cause("command_delay", "drive", "a late command", CommandDelay, 0,
          "what the drive is told takes effect later, or earlier, by a fixed time"),
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


def causes_of(item: CauseLike) -> list[Cause]:
    """The causes that an id, a cause, a law or a sensor effect stands for.

    A law is a class or an object; it may be one of the user's own. An object is looked for at its place alone, and from
    its numbers as well. A law of which either sign has its own entry stands for both; an object for that of its sign.

    Raises
    ------
    ValueError
        If it is no cause, or a law whose family cannot be told.
    """
    known = causes()
    if isinstance(item, Cause):
        return [item]
    if isinstance(item, str) and item in known:
        return [known[item]]
    law = item if isinstance(item, type) else type(item)
    if not issubclass(law, AbstractTerm | AbstractSensor):
        raise ValueError(_no_cause(item, known))
    found = [each for each in known.values() if each.effect is law and not each.is_value] or [_of_own(law)]
    if isinstance(item, str | type):
        return found
    numbers = tuple(float(getattr(item, p.name)) for p in law.parameters)
    example = ((item.at, numbers),)
    return [each._replace(examples=example) for each in found if each.has_sign_of(numbers[0])]


def _no_cause(item: Any, known: Mapping[str, Cause]) -> str:
    close = get_close_matches(item, known, 1) if isinstance(item, str) else []
    meant = f"Did you mean {close[0]}? " if close else ""
    return (
        "`causes` must name causes of the catalogue, or be laws such as jfsm.Coulomb or one of your own; got "
        f"{item!r}. {meant}The catalogue holds {', '.join(known)}."
    )


def _of_own(law: Any) -> Cause:
    """The cause that a law outside the catalogue is."""
    if law.__abstractmethods__ or not issubclass(law, AbstractTerm) or not law.parameters:
        raise ValueError(f"`causes` must hold laws with numbers of their own; got {law.__name__}.")
    family = law.family or _family_of(law)
    if not family:
        raise ValueError(
            f"`family` of {law.__name__} must be one of {', '.join(FAMILIES)} for it to be a cause; write e.g. "
            'family = "stiffness" in the class.'
        )
    if law.kind in causes():
        raise ValueError(f"`kind` of {law.__name__} must not be the id of a cause in the catalogue; got {law.kind!r}.")
    words = (law.__doc__ or "").strip().partition("\n")[0].rstrip(".")
    label = law.label or law.kind.replace("_", " ")
    return Cause(law.kind, family, label, law, law.sign, words or label)


def _family_of(law: type[AbstractTerm]) -> str:
    """What a law that says nothing counts as, where what it is tells; else empty."""
    if issubclass(law, AbstractFriction):
        return "damping"
    return "memory" if law.states or law.delay is not AbstractTerm.delay else "time" if law.timed else ""
