"""HDF5 files."""

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from jfsm.records.formats.base import ABOUT, AbstractFormat, Contents, Lazy, left_out
from jfsm.records.formats.expansion import OversizeError, require_room
from jfsm.records.formats.hdf5_texts import numbers_of, text_of, texts_of
from jfsm.records.formats.preambles import names_rate, rate_by_name, stated_rate

if TYPE_CHECKING:
    import h5py

_COLUMN_NAMES = ("columns", "column_names", "names", "channels", "channel_names", "labels", "headers", "fields")
SIGNATURE = b"\x89HDF\r\n\x1a\n"
NUMERIC = "iufcb"  # kinds of dtype that hold numbers


class Hdf5Format(AbstractFormat):
    """Datasets by path, ``group/name``; a field of a table as ``group/table.field``; units by attribute."""

    name: ClassVar[str] = "HDF5"
    suffixes: ClassVar[tuple[str, ...]] = (".h5", ".hdf5")

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        return any(begins_with[place:].startswith(SIGNATURE) for place in (0, 512, 1024, 2048))

    def load(self, path: Path) -> Contents:
        units: dict[str, str] = {}
        places: dict[str, tuple[str, str | None]] = {}  # name -> dataset and, in a table, field
        packed: dict[str, _Packing] = {}
        notes: list[str] = []
        skipped: list[str] = []
        rates: dict[str, tuple[float, int]] = {}  # of a dataset, and its number of samples
        numbers: dict[str, float] = {}  # rates and steps of groups
        columns: dict[str, tuple[str, int]] = {}  # of matrices with names for them

        def visit(name: str, item: Any) -> None:
            if not hasattr(item, "dtype"):
                numbers.update({f"{name}/{key}": value for key, value in _rates(item)})
                skipped.extend(f"{name}/{other}" for other in _links(item))
                return
            if item.shape is None:
                return
            if not isinstance(name, str) or is_elsewhere(item):  # a name that is no text comes as bytes
                skipped.append(f"{name} (stored outside the file)" if isinstance(name, str) else repr(name))
                return
            places.update(_places(name, item))
            stated = _units(name, item)
            units.update(stated)
            if not stated and (ignored := [key for key in ("units", "unit") if key in item.attrs]):
                notes.append(f"The {ignored[0]} of {name!r} are {_shown(item, ignored[0])}, and are not used.")
            for key, value in _rates(item):
                if rate := rate_by_name(key, value):
                    rates[name] = (rate, max(item.shape, default=0))
            for place, (column, of_unit) in enumerate(_columns(item)):
                columns[f"{name}.{column}"] = (name, place)
                if of_unit:
                    units[f"{name}.{column}"] = of_unit
            if item.dtype.kind not in NUMERIC and not item.dtype.names:
                skipped.append(name)
            if packing := _packing(item):
                packed[name] = packing
                notes.append(f"{name!r} is packed; its numbers are unpacked by {packing.words}.")

        with opened(path, f"{path.name} must be an HDF5 file") as file:
            file.visititems(visit)
            numbers.update(_rates(file))
            skipped.extend(_links(file))
            if longer := longer_than_stated(file, path):
                notes.append(longer)
            about = json.loads(text_of(file, ABOUT)) if ABOUT in file.attrs else {}

        def array(name: str) -> np.ndarray:
            if name in numbers:
                return np.array(numbers[name])
            if name in columns:
                return array(columns[name][0])[:, columns[name][1]]
            place, column = places[name]
            with opened(path, f"{path.name} must be an HDF5 file") as file:
                values = dataset(file, place)
            if place in packed:
                return packed[place].unpacked(values)
            return values if column is None else values[column]

        for group, rate in _common({name: rate for name, (rate, _) in rates.items()}).items():
            numbers.setdefault(f"{group}fs", rate)  # where instants lie beside the samples, these count
            rates = {name: given for name, given in rates.items() if name.rpartition("/")[0] != group.rstrip("/")}
        return Contents(
            Lazy([*places, *(name for name in columns if name not in places), *numbers], array),
            units,
            about,
            clocks=Lazy(rates, lambda name: np.arange(rates[name][1]) / rates[name][0]),
            notes=(*notes, *left_out(skipped)),
        )

    def save(self, path: Path, contents: Contents) -> None:
        import h5py

        with h5py.File(path, "w", track_order=True) as file:
            file.attrs[ABOUT] = json.dumps(dict(contents.about))
            for name, array in contents.arrays.items():
                file.create_dataset(name, data=array)
                file[name].attrs["units"] = contents.units.get(name, "1")


def _units(name: str, item: Any) -> dict[str, str]:
    """The unit that a dataset states, or those of its columns, where it lists one for each."""
    listed = texts_of(item, "units") or texts_of(item, "unit")
    if len(set(listed)) == 1:
        return {name: listed[0]} if listed[0] else {}
    if item.ndim == 2 and len(listed) == min(item.shape):
        return {f"{name}[{place}]": unit for place, unit in enumerate(listed) if unit}
    return {}


def _shown(item: Any, key: str) -> str:
    """An attribute in words, in short."""
    listed = texts_of(item, key)
    return f"a list of {len(listed)}, {', '.join(map(repr, listed[:3]))}" if listed else "no text"


def is_elsewhere(item: Any) -> bool:
    """Whether numbers of a dataset lie in other files, which a file from a stranger could name at will."""
    return bool(item.external) or item.is_virtual and any(source.file_name != "." for source in item.virtual_sources())


def _places(name: str, item: Any) -> dict[str, tuple[str, str | None]]:
    """What a dataset holds of numbers: itself, or the fields of a table; by name the dataset and the field."""
    fields = {f"{name}.{field}": (name, field) for field in item.dtype.names or () if item.dtype[field].kind in NUMERIC}
    return {name: (name, None), **fields} if item.dtype.kind in NUMERIC else fields


def _links(group: Any) -> list[str]:
    """What a group names that lies in another file."""
    import h5py

    links = ((name, group.get(name, getlink=True)) for name in group if isinstance(name, str))
    return [f"{name} (a link to another file)" for name, link in links if isinstance(link, h5py.ExternalLink)]


def _rates(item: Any) -> Iterator[tuple[str, float]]:
    """Attributes that give a sampling rate or step, as a number or as a text that begins with one."""
    for key in (key for key in item.attrs if isinstance(key, str) and names_rate(key)):
        numbers = numbers_of(item, key)
        if numbers.size == 1:
            yield key, float(numbers[0])
        elif (text := text_of(item, key)) and (stated := stated_rate([f"rate: {text}"])):
            yield "fs", stated.hertz


def _common(rates: dict[str, float]) -> dict[str, float]:
    """The rate of each group, ``run/``, whose datasets all have one."""
    groups: dict[str, set[float]] = {}
    for name, rate in rates.items():
        groups.setdefault(name[: name.rfind("/") + 1], set()).add(rate)
    return {group: min(of_group) for group, of_group in groups.items() if len(of_group) == 1}


def _columns(item: Any) -> list[tuple[str, str]]:
    """Names and units of the columns of a matrix, where attributes give as many as it has."""
    if len(item.shape) != 2 or item.dtype.kind not in NUMERIC:
        return []
    lists = {key: texts_of(item, key) for key in (*_COLUMN_NAMES, "units", "unit")}
    names = next((lists[key] for key in _COLUMN_NAMES if len(lists[key]) == item.shape[1]), [])
    units = next((lists[key] for key in ("units", "unit") if len(lists[key]) == item.shape[1]), [""] * len(names))
    return list(zip(names, units, strict=True)) if names else []


def longer_than_stated(file: Any, path: Path) -> str:
    """A sentence on bytes beyond the end that the file states; empty if there are none."""
    with path.open("rb") as stream:
        stream.seek(file.userblock_size)
        head = stream.read(56)
    version, wide = head[8], head[13] if head[8] < 2 else head[9]
    end = {0: 24 + 2 * wide, 1: 28 + 2 * wide}.get(version, 12 + 2 * wide)
    stated = int.from_bytes(head[end : end + wide], "little")
    more = path.stat().st_size - stated
    if more <= 0:
        return ""
    return f"The file is {more} bytes longer than it states: if bytes came into it, numbers behind them are wrong."


class _Packing(NamedTuple):
    """How numbers are kept as integers: value = offset + scale × integer, and which integers stand for gaps."""

    scale: float
    offset: float
    gaps: tuple[float, ...]

    @property
    def words(self) -> str:
        """Scale, offset and gaps in words."""
        gaps = f", {', '.join(f'{gap:g}' for gap in self.gaps)} being gaps" if self.gaps else ""
        return f"scale_factor {self.scale:g} and add_offset {self.offset:g}{gaps}"

    def unpacked(self, values: np.ndarray) -> np.ndarray:
        """The numbers that are meant."""
        result = self.offset + self.scale * values.astype(np.float64)
        for gap in self.gaps:
            result[values == gap] = np.nan
        return result


def _packing(item: Any) -> _Packing | None:
    """How a dataset is packed, by the attributes of netCDF's conventions; None if it is not."""
    keys = ("scale_factor", "add_offset", "_FillValue", "missing_value")
    given = {key: value for key in keys if (value := numbers_of(item, key)).size and value.dtype.kind in "iuf"}
    if not given or item.dtype.kind not in "iuf":
        return None
    gaps = [float(gap) for key in keys[2:] for gap in given.get(key, ()) if np.isfinite(gap)]
    if not gaps and not set(given) & set(keys[:2]):
        return None
    scale, offset = (
        float(given[key][0]) if key in given else default for key, default in ((keys[0], 1.0), (keys[1], 0.0))
    )
    return _Packing(scale, offset, tuple(dict.fromkeys(gaps)))


@contextlib.contextmanager
def opened(path: Path, demand: str) -> Iterator["h5py.File"]:
    """The file, open for reading.

    Raises
    ------
    ValueError
        If it is no HDF5 file or a part of one, or parts of it cannot be read, beginning with `demand`.
    """
    import h5py  # loaded when a file asks for it, so that importing jfsm stays quick

    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise ValueError(
            f"{demand}; it cannot be opened as one ({error}), and may be cut short. Write or copy it again."
        ) from error
    with file:
        try:
            yield file
        except OversizeError:
            raise
        except Exception as error:  # whatever the library stumbles over in a part that is damaged
            raise ValueError(f"{demand}; parts of it cannot be read ({error}). Write or copy it again.") from error


def dataset(file: "h5py.File", name: str) -> np.ndarray:
    """All values of one dataset."""
    return whole(file[name])


def whole(item: Any) -> np.ndarray:
    """All values of a dataset, if there is room for them."""
    require_room(item.size * item.dtype.itemsize, Path(item.file.filename))
    return np.asarray(item[()])
