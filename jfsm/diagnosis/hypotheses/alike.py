"""What a cause is confused with, as far as the definitions of the laws tell."""

from collections.abc import Iterator

from ...structures import AbstractSensor, AbstractTerm, Cause, Scale, causes
from .law_classes import NARROWEST_FIRST, classes_of

_SCALE = Scale(force=1.0, length=1.0, peak=1.0, omega=1.0, begin=0.0, end=100.0)
"""A motion to look at laws of a natural size along."""
_WIDE = NARROWEST_FIRST[NARROWEST_FIRST.index("a nonlinear spring") :]
"""Classes that say little more than the family."""


def confused_with(cause: Cause) -> list[str]:
    """Sentences on what records confuse a cause with, as far as the code knows.

    A law is confused with its special cases and with what it is a special case of, and with the laws of its classes,
    as which it is named where a record cannot tell them apart. A class of springs and dampers is that of the curve of
    the force, here of a law of a natural size.

    Parameters
    ----------
    cause : Cause

    Returns
    -------
    list of str
    """
    if cause.is_value:
        return [
            "A record without a measured force tells stiffness, damping and mass but for one common factor; a gain "
            "error of the force sensor looks like all of them wrong alike."
        ]
    return [*_special_cases(cause), *_of_one_class(cause)]


def _special_cases(cause: Cause) -> Iterator[str]:
    contains = getattr(cause.effect, "contains", ())
    inside = [each.id for each in causes().values() if each.effect in contains and not each.is_value]
    around = [each.id for each in causes().values() if cause.effect in getattr(each.effect, "contains", ())]
    if inside:
        yield f"For some of its numbers it is {', '.join(inside)}: small records name that."
    if around:
        yield f"It is a special case of {', '.join(around)}."


def _of_one_class(cause: Cause) -> Iterator[str]:
    known, own = _known(), _classes(cause)
    for name in own:
        if name in _WIDE and len(own) > 1:
            continue
        others = [each for each, classes in known.items() if name in classes and each != cause.id]
        if others:
            yield f"As {name} it is confused with {', '.join(others)}."


def _known() -> dict[str, tuple[str, ...]]:
    """The classes of every cause in the catalogue but for wrong values."""
    return {each.id: _classes(each) for each in causes().values() if not each.is_value}


def _classes(cause: Cause) -> tuple[str, ...]:
    """The classes of a cause of a natural size."""
    part = _example(cause)
    return classes_of(cause, part, _SCALE.peak, _SCALE.speed)


def _example(cause: Cause) -> AbstractTerm | AbstractSensor:
    """An effect of a natural size, with the sign of the cause."""
    if cause.is_sensor:
        numbers = {p.name: 0.1 for p in cause.effect.parameters}
        return cause.effect(**numbers, at=(cause.effect.channels[0], 1))
    shapes = cause.effect.shapes(_SCALE)
    first = cause.effect.parameters[0].name
    shape = shapes[len(shapes) // 2]
    return cause.effect(**shape | {first: (cause.sign or 1) * abs(shape[first])}, at=(0, 1))
