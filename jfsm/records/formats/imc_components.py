"""The components of an imc FAMOS file: where the numbers of each lie, and what the keys say of them."""

import codecs
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from jfsm.records.formats.imc_keys import SAMPLES, Fields, Key, bytes_at, keys

# Numbers by their kind: 11 are bits, 9 and 10 are records and texts.
_NUMBERS = {1: "u1", 2: "i1", 3: "u2", 4: "i2", 5: "u4", 6: "i4", 7: "f4", 8: "f8", 12: "u8", 13: "u6", 14: "i8"}
_LATEST = 1e10  # s, three hundred years
_SIX = 6  # bytes of a number that NumPy does not have
_UNREAD = {9: "a recording of transitions", 10: "texts", 11: "bits"}


@dataclass(frozen=True)
class Axis:
    """Key CD: the even axis of a field."""

    step: float = 0.0
    unit: str = ""
    first: float = 0.0
    pretrigger: int = 1  # whose first instant counts: 1 that of the buffer, 2 this one, 0 none
    unreadable: str = ""


@dataclass(frozen=True)
class Buffer:
    """Key Cb: bytes behind a key CS."""

    block: int = 0
    offset: int = 0
    length: int = 0
    begins_at: int = 0  # of a ring
    filled: int = 0
    first: float = 0.0
    added: float = 0.0  # s, to the date of the trigger


@dataclass(frozen=True)
class Component:
    """One row of numbers, and what the keys between its CC and the next say of it."""

    within: int  # number of its field
    kind: int
    part: int
    axis: Axis
    triggered: np.datetime64 | None
    name: str = ""
    group: str = ""
    unit: str = ""
    scaled: bool = False
    factor: float = 1.0
    offset: float = 0.0
    number: str = ""  # NumPy's name of the kind of number, u6 for one of six bytes
    mask: int = 0
    skip: int = 0
    together: int = 1
    gap: int = 0
    buffer: Buffer = field(default_factory=Buffer)
    reference: int = 0
    start: int = 0  # of the block of samples in the file
    unreadable: str = ""


def components(path: Path) -> tuple[list[Component], list[str]]:
    """The components of a file in their order, and what its reader should know.

    Raises
    ------
    ValueError
        If the file is damaged, cut short, or of another version.
    """
    scan = _Scan()
    for key in keys(path):
        try:
            scan.take(key)
        except ValueError as error:
            raise ValueError(
                f"{path.name} must be an imc FAMOS file; its key {key.name} cannot be made out ({error}). Copy it "
                f"again."
            ) from error
    return [_placed(component, scan, path) for component in scan.found], scan.notes


def _placed(component: Component, scan: "_Scan", path: Path) -> Component:
    """A component with its buffer, whose bytes lie in the file."""
    if component.unreadable:
        return component
    buffers = scan.buffers.get(component.reference, [])
    if len(buffers) != 1:
        return replace(component, unreadable=f"{len(buffers)} stretches" if buffers else "no samples")
    (buffer,) = buffers
    if buffer.block in scan.compressed:
        return replace(component, unreadable="compressed")
    start, size = scan.blocks.get(buffer.block, (0, 0))
    inside = 0 <= buffer.offset <= buffer.offset + buffer.length <= size
    if not inside or not (0 <= buffer.filled <= buffer.length and 0 <= buffer.begins_at <= buffer.length):
        raise ValueError(
            f"{path.name} must be a whole imc FAMOS file; {component.name!r} announces {buffer.length} bytes from byte "
            f"{buffer.offset} of samples on, of which there are {size}. Copy it again."
        )
    return replace(component, buffer=buffer, start=start)


def count_of(component: Component) -> int:
    """How many numbers a component has."""
    width, filled = int(component.number[2]), component.buffer.filled - component.skip
    if not component.gap:
        return max(filled, 0) // width
    used = component.together * width
    return max((filled + component.gap) // (used + component.gap), 0) * component.together


def values_of(path: Path, component: Component) -> np.ndarray:
    """The numbers of one component, as the file means them.

    Raises
    ------
    ValueError
        If they do not fill the bytes that are announced.
    """
    buffer = component.buffer
    raw = np.asarray(bytes_at(path, component.start + buffer.offset, buffer.length))
    raw = (np.roll(raw, -buffer.begins_at) if buffer.begins_at else raw)[: buffer.filled]
    order, kind, width = component.number[0], component.number[1], int(component.number[2])
    used = component.together * width
    if component.gap:  # the last row may lack its end
        rows = count_of(component) // component.together
        whole = np.zeros(rows * (used + component.gap), np.uint8)
        whole[: raw.size] = raw[: whole.size]
        raw = whole.reshape(rows, -1)[:, component.skip : component.skip + used].reshape(-1) if rows else raw[:0]
    else:
        raw = raw[component.skip :]
    if raw.size % width:
        raise ValueError(
            f"{path.name} must be a whole imc FAMOS file; {component.name!r} has {raw.size} bytes of numbers of "
            f"{width}. Copy it again."
        )
    if width == _SIX:
        wide = np.zeros((raw.size // width, 8), np.uint8)
        wide[:, 2:] = raw.reshape(-1, width)[:, :: 1 if order == ">" else -1]
        values = wide.view(">u8")[:, 0]
    else:
        values = np.ascontiguousarray(raw).view(f"{order}{kind}{width}")
    if component.mask and kind in "ui":
        values = values & ~np.array(component.mask).astype(values.dtype)
    if not component.scaled:
        return values
    return values.astype(np.float64) * component.factor + component.offset


class _Scan:
    """What the keys that were passed say of those that follow."""

    def __init__(self) -> None:
        self.found: list[Component] = []
        self.buffers: dict[int, list[Buffer]] = {}
        self.blocks: dict[int, tuple[int, int]] = {}
        self.compressed: set[int] = set()
        self.notes: list[str] = []
        self._order, self._encoding = "<", "cp1252"
        self._field, self._kind = 0, 0
        self._axis, self._triggered = Axis(), None
        self._groups: dict[int, str] = {}
        self._open = False  # whether keys speak of the last component
        self._unread = ""  # what holds for a whole field
        self._take: dict[str, Callable[[Key, Fields], None]] = {
            "CF": self._format, "CK": self._closed, "NL": self._language, "CB": self._group, "CG": self._begin_field,
            "CD": self._even_axis, "CZ": self._segments, "NT": self._trigger, "CC": self._begin, "CP": self._packing,
            "Cb": self._buffer, "CR": self._range, "CN": self._name, "Cv": self._events, SAMPLES: self._samples,
        }  # fmt: skip

    def take(self, key: Key) -> None:
        """One more key."""
        if key.name in self._take:
            self._take[key.name](key, Fields(key.body, self._encoding))
        elif key.name in ("CT", "CI"):
            self._open = False

    def _of_last(self, **said: object) -> None:
        if self._open:
            self.found[-1] = replace(self.found[-1], **said)

    def _format(self, key: Key, fields: Fields) -> None:
        if key.version != 2:
            raise ValueError(f"version {key.version}, where 2 is known")
        self._order = "<" if fields.integer() == 1 else ">"

    def _closed(self, key: Key, fields: Fields) -> None:
        fields.word()
        if fields.word() == "0":
            self.notes.append("The recorder did not close the file; samples may be missing at its end.")

    def _language(self, key: Key, fields: Fields) -> None:
        codepage = fields.word()
        try:
            self._encoding = codecs.lookup("utf-8" if codepage == "65001" else f"cp{codepage}").name
        except LookupError:
            self.notes.append(f"Texts are in a code page {codepage!r} that is not known.")

    def _group(self, key: Key, fields: Fields) -> None:
        index = fields.integer()
        self._groups[index] = fields.text()

    def _begin_field(self, key: Key, fields: Fields) -> None:
        fields.word()
        self._field, self._kind, self._open, self._unread = self._field + 1, fields.integer(), False, ""
        self._axis, self._triggered = Axis(), None

    def _even_axis(self, key: Key, fields: Fields) -> None:
        step, _, unit = fields.real(), fields.word(), fields.text()
        reduced, several, _ = fields.word(), fields.word(), fields.word()
        first, pretrigger = (fields.real(), fields.integer()) if key.version == 2 else (0.0, 1)
        unreadable = "reduced when it was recorded" if reduced != "0" else ""
        unreadable = "several events" if several == "1" else unreadable
        unreadable = "an axis of another kind" if pretrigger not in (0, 1, 2) else unreadable
        self._axis = Axis(step, unit, first, pretrigger, unreadable)
        self._of_last(axis=self._axis)

    def _segments(self, key: Key, fields: Fields) -> None:
        self._unread = "segments over a further axis"
        self._of_last(unreadable=self._unread)

    def _events(self, key: Key, fields: Fields) -> None:
        self._of_last(unreadable="several events")

    def _trigger(self, key: Key, fields: Fields) -> None:
        day, month, year, hour, minute = (fields.integer() for _ in range(5))
        second = fields.real()
        date = np.datetime64(f"{year:04d}-{month:02d}-{day:02d}T{hour:02d}:{minute:02d}", "ns")
        zone = fields.integer() if key.version == 2 else 0  # minutes ahead of UTC
        if not 0 <= second <= 60 or abs(zone) > 24 * 60:
            raise ValueError(f"second {second:g} and {zone} minutes ahead of UTC")
        self._triggered = date + np.timedelta64(round(second * 1e9), "ns") - np.timedelta64(zone, "m")
        self._of_last(triggered=self._triggered)

    def _begin(self, key: Key, fields: Fields) -> None:
        part, digital = fields.integer(), fields.integer() == 2
        unreadable = "bits" if digital else self._unread
        self.found.append(Component(self._field, self._kind, part, self._axis, self._triggered, unreadable=unreadable))
        self._open = True

    def _packing(self, key: Key, fields: Fields) -> None:
        reference, width, kind, bits, mask = (fields.integer() for _ in range(5))
        skip, together, gap = (fields.integer() for _ in range(3))
        number, unreadable = _NUMBERS.get(kind, ""), self.found[-1].unreadable if self.found else ""
        if not number:
            unreadable = _UNREAD.get(kind, f"numbers of kind {kind}")
        elif number[1] != str(width) or bits != 8 * width:
            unreadable = f"{bits} bits in numbers of {width} bytes"
        elif min(skip, gap) < 0 or together < 1 or (gap and skip > gap):
            raise ValueError(f"{together} numbers, {skip} bytes from the first on and {gap} apart")
        self._of_last(
            reference=reference, number=self._order + number, mask=mask, skip=skip, together=together, gap=gap,
            unreadable=unreadable,
        )  # fmt: skip

    def _buffer(self, key: Key, fields: Fields) -> None:
        count, more = fields.integer(), fields.integer()
        if more and count > 1:
            self._of_last(unreadable="several buffers with remarks")
            return
        for _ in range(count):
            reference, block, offset, length, begins_at, filled = (fields.integer() for _ in range(6))
            fields.word()
            first, added = fields.real(), fields.real()
            if abs(added) > _LATEST:
                raise ValueError(f"{added:g} s after the trigger")
            buffer = Buffer(block, offset, length, begins_at, filled, first, added)
            self.buffers.setdefault(reference, []).append(buffer)
            if not more:
                fields.word()

    def _range(self, key: Key, fields: Fields) -> None:
        scaled, factor, offset = fields.word() == "1", fields.real(), fields.real()
        fields.word()
        self._of_last(scaled=scaled, factor=factor, offset=offset, unit=fields.text())
        if scaled and not factor:
            self._of_last(unreadable="a factor of 0")

    def _name(self, key: Key, fields: Fields) -> None:
        group, _, _ = fields.integer(), fields.word(), fields.word()
        self._of_last(group=self._groups.get(group, ""), name=fields.text())

    def _samples(self, key: Key, fields: Fields) -> None:
        self._open = False
        number = fields.integer()
        self.blocks[number] = key.start, key.size
        if key.version != 1:
            self.compressed.add(number)
