"""Everything that was measured about one fitted hypothesis, as plain numbers under a key."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ...structures import AccelerationBias, AccelerationGain, ForceGain, Preload, Structure
from ..hypotheses.effect import Effect
from ..hypotheses.law_classes import classes_of
from .between_records import differences
from .fitted import Trial
from .own_values import at_bounds, offset_cost, prior_cost
from .plain import as_plain
from .prediction import Prediction
from .setup import Problem

GIVEN, REFITTED = "given", "refitted"
"""Keys of the model as given, and with its own values refitted."""
LAW, SENSOR, CONSTANT_FORCE = "law", "sensor", "constant force"
FORCE_GAIN, ACCELERATION_GAIN, ACCELERATION_BIAS = "force gain", "acceleration gain", "acceleration bias"
_ROLES: Mapping[type, str] = {
    Preload: CONSTANT_FORCE,
    ForceGain: FORCE_GAIN,
    AccelerationGain: ACCELERATION_GAIN,
    AccelerationBias: ACCELERATION_BIAS,
}


class EffectCard(NamedTuple):
    """A cause at its place, as far as a verdict depends on it; its classes are the narrowest first."""

    cause: str
    at: tuple
    family: str
    label: str
    role: str
    is_sensor: bool
    classes: tuple[str, ...] = ()

    @classmethod
    def of(cls, effect: Effect, classes: tuple[str, ...] = ()) -> "EffectCard":
        cause = effect.cause
        role = _ROLES.get(cause.effect, SENSOR if cause.is_sensor else LAW)
        return cls(cause.id, tuple(effect.at), cause.family, effect.label, role, cause.is_sensor, classes)


class OtherShapes(NamedTuple):
    """What forces of other shapes would gain beside a hypothesis.

    `nats` beyond what noise lets them in the mean, the `share` of the innovations' power that they explain; and how far
    its run over what was fitted strays, as a share of the signal.
    """

    nats: float
    share: float = 0.0
    strays: float = 0.0

    @property
    def told(self) -> bool:
        """Whether the records tell; coarse digits and imposed motions do not."""
        return self.nats != 0.0


@dataclass(frozen=True)
class Scorecard:
    """What was measured about a hypothesis.

    Attributes
    ----------
    key : str
        ``given``, ``refitted``, or its effects: ``cubic_hardening@0-1+accel_gain@acceleration:1``.
    evidence : float
        Log-evidence [nats].
    prediction : Prediction
        Errors of multi-step predictions, and what noise explains of them.
    whiteness : float
        Largest lag-one correlation of a channel's innovations.
    noise_scale : float
        Largest departure of a channel's fitted noise from its known floor, as a logarithm.
    unknowns : int
        Numbers that were fitted.
    at_bounds : tuple of str
        Own values that ended at a bound.
    prior_cost, force_offset_cost, acceleration_offset_cost : float
        Nats that own values and offsets cost beside what is believed of them.
    is_really : str
        What else its law is with the numbers found, in words; empty if it is itself.
    timed : bool
        Whether its law depends on time.
    in_step : bool
        Whether it is a load of the drive's own line.
    not_identifiable : str
        Why these records cannot show it, in words; empty if they can.
    special_cases : tuple of str
        Keys of the hypotheses that it holds as special cases.
    differs : float
        Largest size of a number of its law in one record, in those of the smallest in another, of numbers that differ
        by more than their errors; 1 if none does.
    """

    key: str
    effects: tuple[EffectCard, ...]
    evidence: float
    prediction: Prediction
    whiteness: float
    noise_scale: float
    unknowns: int
    at_bounds: tuple[str, ...] = ()
    prior_cost: float = 0.0
    force_offset_cost: float = 0.0
    acceleration_offset_cost: float = 0.0
    is_really: str = ""
    timed: bool = False
    in_step: bool = False
    not_identifiable: str = ""
    special_cases: tuple[str, ...] = ()
    differs: float = 1.0

    @property
    def laws(self) -> tuple[EffectCard, ...]:
        """The effects that are no sensor's."""
        return tuple(effect for effect in self.effects if not effect.is_sensor)

    @property
    def label(self) -> str:
        """Its effects in words."""
        return " and ".join(effect.label for effect in self.effects) or f"the model {self.key}"

    @property
    def plain(self) -> dict[str, Any]:
        """For JSON, without loss."""
        return as_plain(self)

    @classmethod
    def of_plain(cls, written: Mapping[str, Any]) -> "Scorecard":
        """What `plain` was made of."""
        effects = tuple(
            EffectCard(**{**e, "at": tuple(e["at"]), "classes": tuple(e["classes"])}) for e in written["effects"]
        )
        sets = {name: np.array([float(v) for v in values]) for name, values in written["prediction"].items()}
        numbers = {name: float(v) for name, v in written.items() if isinstance(v, float | str) and name in _NUMBERS}
        tuples = {name: tuple(written[name]) for name in ("at_bounds", "special_cases")}
        return cls(**{**written, **numbers, **tuples, "effects": effects, "prediction": Prediction(**sets)})


_NUMBERS = {
    "evidence", "whiteness", "noise_scale", "prior_cost", "force_offset_cost", "acceleration_offset_cost", "differs",
}  # fmt: skip


def classes_in(trial: Trial, problem: Problem) -> list[tuple[str, ...]]:
    """Classes of every effect of a trial, the narrowest first, for the motion of the first record."""
    peak = problem.first.crest * problem.first.length
    both = zip(trial.effects, trial.parts, strict=True)
    return [classes_of(effect.cause, part, peak, peak * problem.first.omega) for effect, part in both]


def scorecard(
    trial: Trial, among: Sequence[Trial], problem: Problem, *, in_step: bool = False, not_identifiable: str = ""
) -> Scorecard:
    """The scorecard of a trial among others, beside the model of a problem."""
    really = (law.otherwise(trial.structure.stiffness_of(law.at)) for law in trial.laws)
    return Scorecard(
        key=trial.key,
        effects=tuple(
            EffectCard.of(effect, classes)
            for effect, classes in zip(trial.effects, classes_in(trial, problem), strict=True)
        ),
        evidence=trial.evidence,
        prediction=trial.prediction,
        whiteness=trial.whiteness,
        noise_scale=trial.noise_scale,
        unknowns=len(trial.unknowns),
        at_bounds=tuple(sorted(at_bounds(trial))),
        prior_cost=prior_cost(trial),
        force_offset_cost=offset_cost(trial, "force"),
        acceleration_offset_cost=offset_cost(trial, "acceleration"),
        is_really=next((what for what in really if what), ""),
        timed=any(law.timed for law in trial.laws),
        in_step=in_step,
        not_identifiable=not_identifiable,
        special_cases=tuple(t.key for t in among if _is_special_case(t, trial)),
        differs=_differs(trial, problem.model),
    )


def _is_special_case(t: Trial, of: Trial) -> bool:
    """Whether the single law of a trial is that of another one for certain of its numbers."""
    if len(of.effects) != 1 or len(t.effects) != 1 or not of.laws or not t.laws:
        return False
    law, [other] = of.laws[0], t.laws
    return other.at == law.at and isinstance(other, law.contains)


def _differs(trial: Trial, model: Structure) -> float:
    own = model.entries()
    return max((d.ratio for d in differences(trial) if d.path not in own), default=1.0)
