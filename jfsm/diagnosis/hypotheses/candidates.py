"""Candidates for a diagnosis: every cause at every place where it could sit, with its starts."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import chain

import numpy as np

from ..._threads import side_by_side
from ...estimation import Latent
from ...identification import Nuisances
from ...records import Record
from ...structures import (
    AbstractSensor,
    AbstractTerm,
    AccelerationBias,
    AccelerationGain,
    Cause,
    CauseLike,
    ChannelDelay,
    Clipping,
    CommandDelay,
    CoulombAsymmetric,
    ElasticJoint,
    ForceDelay,
    ForceGain,
    LinearDamping,
    LinearStiffness,
    Preload,
    Ripple,
    Structure,
    causes,
    causes_of,
)
from .candidate import Candidate
from .effect import Effect
from .natural_starts import natural_starts
from .placement import Laws

_NOT_BESIDE_A_MOTION = (ForceGain, ChannelDelay, AccelerationBias, AccelerationGain, Preload, CoulombAsymmetric)
"""Effects that an imposed motion does not show: a gain of the force is that of all own values, a constant force its
offset, asymmetric friction friction beside an offset, a late motion an early force, and what is wrong with an
accelerometer shows beside the displacement."""
_GAINS = (ForceGain, AccelerationGain)
"""Faults that a clipped channel hides: below its limit noise makes it smaller."""


def chosen_causes(selection: Iterable[CauseLike] | CauseLike | None) -> dict[str, Cause]:
    """The causes to try, by id, with the examples of all that are the same; wrong own values are always tried.

    Raises
    ------
    ValueError
        If an id is not in the catalogue, or a law cannot be a cause.
    """
    found: dict[str, Cause] = {}
    if selection is None:
        selection = list(causes())
    for item in [selection] if isinstance(selection, str | Cause | type | AbstractTerm | AbstractSensor) else selection:
        for cause in causes_of(item):
            examples = found[cause.id].examples + cause.examples if cause.id in found else cause.examples
            found[cause.id] = cause._replace(examples=examples)
    return {name: cause for name, cause in found.items() if not cause.is_value}


def asked_for(
    selection: Iterable[CauseLike] | CauseLike | None, model: Structure, records: Sequence[Record]
) -> Iterable[CauseLike] | CauseLike:
    """What is looked for: by default the whole catalogue, without laws of joints where there can be none, and of late
    forces and commands those that there are.

    A ripple is looked for where a coordinate goes round: over less than a turn a spring that softens is one as well.
    A late reading of the one response that was measured is what a late command is, and the less likely.
    """
    if selection is not None:
        return selection
    without = _late_otherwise(model, records) | _not_of_joints(model, records)
    return [cause for cause in causes().values() if cause.effect not in without]


def _late_otherwise(model: Structure, records: Sequence[Record]) -> set[type]:
    """Delays that stand for another one: of commands where forces drive, and the other way round."""
    if not model.commands:
        return {CommandDelay}
    alone = all(len(record.responses) == 1 for record in records)
    return {ForceDelay, ChannelDelay} if alone else {ForceDelay}


def _not_of_joints(model: Structure, records: Sequence[Record]) -> set[type]:
    """Laws of joints that these coordinates cannot have, or not show."""
    angles = [record for record in records if record.units["displacement"] == "rad"]
    without: set[type] = set() if any(map(_goes_round, angles)) else {Ripple}
    return without if angles or model.own is not None else {ElasticJoint, *without}


def _goes_round(record: Record) -> bool:
    """Whether a coordinate, an angle, goes round once."""
    return any(kind == "displacement" and np.ptp(y) > 2 * np.pi for (kind, _), y in record.channels.items())


def candidates(
    model: Structure,
    records: Sequence[Nuisances],
    selection: Mapping[str, Cause],
    places: Sequence[tuple] | None = None,
    missing: Latent | None = None,
) -> list[Candidate]:
    """Every cause of `selection` at every place: laws on links or masses, sensor effects on the channels.

    Laws are placed by the force `missing` in the first record, which is estimated where it is not known.
    """
    first = records[0]
    fitted = _fitted(selection, imposed=first.path is not None)
    laws = [Effect(cause, at) for cause in fitted if not cause.is_sensor for at in _links(cause, model, places)]
    faults = [Effect(cause, at) for cause in fitted if cause.is_sensor for at in _channels(cause, model, records)]
    placed = chain.from_iterable(side_by_side(Laws(model, first, missing).of, laws)) if laws else ()
    return [*placed, *(Candidate((fault,), natural_starts(model, *fault, first)) for fault in faults)]


def _fitted(selection: Mapping[str, Cause], *, imposed: bool) -> list[Cause]:
    """Causes that have a number to fit (a clipped channel shows by itself) and that an `imposed` motion shows."""
    excluded = _NOT_BESIDE_A_MOTION if imposed else ()
    return [c for c in selection.values() if any(p.free for p in c.effect.parameters) and c.effect not in excluded]


def _links(cause: Cause, model: Structure, places: Sequence[tuple] | None) -> list[tuple]:
    """Places of a law: those of its examples; the links; the masses if it hangs on one or loads it from outside."""
    if cause.examples:
        return list(dict.fromkeys(at for at, _ in cause.examples))
    if cause.effect in (LinearStiffness, LinearDamping):
        return _among(places, model.untied(cause.effect))
    masses = [(0, j) for j in range(1, model.dof + 1)]
    if cause.effect.hangs:
        return _among(places, masses)
    return list(places if places is not None else masses if cause.family == "input" else model.links)


def _among(places: Sequence[tuple] | None, possible: Sequence[tuple]) -> list[tuple]:
    """The possible places that were asked for; all of them where none were."""
    return [at for at in possible if places is None or at in places]


def _channels(cause: Cause, model: Structure, records: Sequence[Nuisances]) -> list[tuple[str, int]]:
    """Channels that may have a sensor's fault."""
    imposed = records[0].path is not None
    kinds = ("force",) if imposed else [kind for kind in cause.effect.channels if _shows(cause.effect, kind, records)]
    channels = dict.fromkeys(c for n in records for c in n.record.channels if c[0] in kinds)
    hidden = _hiding(cause.effect, model)
    return [at for at in channels if at not in hidden]


def _hiding(effect: type, model: Structure) -> set[tuple]:
    """Channels whose clipping hides the fault, or that are not commanded."""
    if effect is CommandDelay and model.commands:
        return {("force", j) for j in range(1, model.dof + 1)} - {("force", j) for j in model.commands}
    return {sensor.at for sensor in model.sensors if isinstance(sensor, Clipping)} if effect in _GAINS else set()


def _shows(effect: type, kind: str, records: Sequence[Nuisances]) -> bool:
    """Whether anything but the channels of this kind tells how large and how late they are; a bias needs none."""
    if kind == "force":
        return any(n.driven for n in records)
    return effect is AccelerationBias or any(n.driven or any(c[0] != kind for c in n.channels) for n in records)
