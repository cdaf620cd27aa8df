"""Files of imc FAMOS, imc STUDIO and imc devices (.raw, .dat), after the public description of their keys."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import ClassVar, NamedTuple

import numpy as np

from jfsm.records._units import seconds_in
from jfsm.records.formats.base import AbstractFormat, Contents, Lazy, left_out, told_apart
from jfsm.records.formats.imc_components import Component, components, count_of, values_of

EPOCH = np.datetime64("1980-01-01T00:00:00", "ns")  # stands for no date where no seconds are added to it
EQUIDISTANT, PAIRS = 1, (2, 3)  # kinds of fields: over an even axis, over a component of their own


class ImcFormat(AbstractFormat):
    """Channels by name, ``group/name`` in groups, with the unit and clock of each. Read only.

    The clock counts from the trigger. It is step and pre-trigger, or the second component of a pair where that is in a
    unit of time.
    """

    name: ClassVar[str] = "imc FAMOS"
    suffixes: ClassVar[tuple[str, ...]] = ()

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        return re.match(rb"\|CF,\s*\d+\s*,", begins_with) is not None

    def load(self, path: Path) -> Contents:
        found, notes = components(path)
        channels = list(_channels(found))
        read = [channel for channel in channels if not channel.left_out]
        left = [f"{channel.name} ({channel.left_out})" for channel in channels if channel.left_out]
        if not read:
            raise ValueError(
                f"{path.name} must hold channels over time; it holds {', '.join(left[:6]) or 'none'}. Export what you "
                f"need from FAMOS as text."
            )
        names, aliases = told_apart([channel.name for channel in read])
        by_name = dict(zip(names, read, strict=True))
        timed = {name: channel for name, channel in by_name.items() if channel.step or channel.over}
        starts = {name: channel.begins for name, channel in timed.items() if channel.begins is not None}
        begins = min(starts.values(), default=None)

        def samples(name: str) -> np.ndarray:
            return values_of(path, by_name[name].component)

        def clock(name: str) -> np.ndarray:
            channel = timed[name]
            late = 0.0 if begins is None or name not in starts else _seconds_between(begins, starts[name])
            if channel.over is not None:
                return late + channel.factor * np.asarray(values_of(path, channel.over), dtype=np.float64)
            return late + channel.factor * (channel.first + channel.step * np.arange(count_of(channel.component)))

        return Contents(
            Lazy(names, samples),
            {name: channel.component.unit for name, channel in by_name.items() if channel.component.unit},
            clocks=Lazy(timed, clock),
            notes=(*notes, *_notes(by_name, left, starts)),
            aliases=aliases,
            begins=begins,
        )


class _Channel(NamedTuple):
    """A channel, and where its instants come from: an even axis, or another component."""

    name: str
    component: Component
    left_out: str = ""
    first: float = 0.0
    step: float = 0.0
    factor: float = 1.0  # seconds in a unit of the axis
    over: Component | None = None
    begins: np.datetime64 | None = None


def _channels(found: list[Component]) -> Iterator[_Channel]:
    """The channels of a file, field by field."""
    fields: dict[int, list[Component]] = {}
    for component in found:
        fields.setdefault(component.within, []).append(component)
    for members in fields.values():
        kind = members[0].kind
        if kind == EQUIDISTANT:
            yield from map(_even, members)
        elif kind in PAIRS:
            yield from _paired(members)
        else:
            yield from (_Channel(_name(member), member, "complex") for member in members[:1])


def _name(component: Component) -> str:
    return f"{component.group}/{component.name}" if component.group and component.name else component.name


def _even(component: Component) -> _Channel:
    """A channel whose samples follow one another at even steps."""
    name, axis = _name(component), component.axis
    reason = component.unreadable or axis.unreadable
    if reason:
        return _Channel(name, component, reason)
    factor = seconds_in(axis.unit)
    if factor is None and axis.unit:
        return _Channel(name, component, f"over {axis.unit}, not over time")
    if factor is None or not axis.step > 0:
        return _Channel(name, component)  # a clock that nobody states
    first = {1: component.buffer.first, 2: axis.first}.get(axis.pretrigger, 0.0)
    return _Channel(name, component, "", first, axis.step, factor, None, _begins(component))


def _paired(members: list[Component]) -> Iterator[_Channel]:
    """Channels over one component: it is their clock where it is in a unit of time, else a channel beside them."""
    over = [member for member in members if member.part == 2]
    factor = seconds_in(over[0].unit) if len(over) == 1 else None
    for member in members:
        if member.part == 2 and factor is not None:
            continue
        name = _name(member) or f"{_name(members[0])}.x"
        reason = member.unreadable or (over[0].unreadable if factor is not None else "")
        if reason or factor is None:
            yield _Channel(name, member, reason)
        else:
            yield _Channel(name, member, factor=factor, over=over[0], begins=_begins(member))


def _begins(component: Component) -> np.datetime64 | None:
    """When the clock of a channel reads zero: the trigger, in whose date or in seconds since 1980 it is kept."""
    if component.triggered is None or (component.triggered == EPOCH and component.buffer.added == 0):
        return None
    return component.triggered + np.timedelta64(round(component.buffer.added * 1e9), "ns")


def _seconds_between(one: np.datetime64, other: np.datetime64) -> float:
    return float((other - one) / np.timedelta64(1, "ns")) * 1e-9


def _notes(channels: Mapping[str, _Channel], left: list[str], starts: Mapping[str, np.datetime64]) -> Iterator[str]:
    yield from left_out(left)
    if len(set(starts.values())) > 1:
        yield "The channels of the file began at different instants; their clocks count from the first of them."
    for name, channel in channels.items():
        component = channel.component
        if component.kind == EQUIDISTANT and not channel.step:
            yield (
                f"{name!r} states a step of {component.axis.step:g} without a unit of time; in seconds that is "
                f"rate={1 / component.axis.step:.9g}."
                if component.axis.step > 0
                else f"{name!r} states no step."
            )
        if not component.scaled and (component.factor not in (0.0, 1.0) or component.offset):
            yield (
                f"{name!r} states a factor of {component.factor:g} and an offset of {component.offset:g}, and that "
                f"they are not to be used."
            )
