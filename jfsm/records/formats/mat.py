"""MATLAB files, of version 7.3 (which are HDF5) and before."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import scipy.io

from jfsm._files import parsed_json
from jfsm.records.formats import mat73
from jfsm.records.formats.base import ABOUT, AbstractFormat, Contents, Lazy
from jfsm.records.formats.expansion import OversizeError
from jfsm.records.formats.hdf5 import NUMERIC
from jfsm.records.formats.mat5 import require_sound
from jfsm.records.formats.mat_texts import Column, described


class MatFormat(AbstractFormat):
    """Variables by name; ``struct.field``, ``cell{2}``, ``structs{2}.field``; labels and units beside numbers."""

    name: ClassVar[str] = "MATLAB"
    suffixes: ClassVar[tuple[str, ...]] = (".mat",)

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        return begins_with.startswith(b"MATLAB ") or _is_version_4(begins_with)

    def load(self, path: Path) -> Contents:
        try:
            require_sound(path)
            variables = scipy.io.loadmat(path, squeeze_me=True, struct_as_record=False)
        except NotImplementedError:  # of version 7.3
            found, remark = mat73.variables(path)
            return _found(found).contents({}, path, remark)
        except OversizeError:
            raise
        except Exception as error:  # whatever the reader stumbles over in bytes that are no such file
            raise ValueError(
                f"{path.name} must be a MATLAB file; it cannot be opened as one ({error}), and may be cut short. "
                f"Write or copy it again."
            ) from error
        try:
            remarks = parsed_json(str(variables.pop(ABOUT))) if ABOUT in variables else {}
        except ValueError as error:
            raise ValueError(f"{path.name} must hold JSON in {ABOUT}; {error}. Write or copy it again.") from error
        return _found(variables).contents(remarks, path)

    def save(self, path: Path, contents: Contents) -> None:
        remarks = json.dumps({"units": dict(contents.units), **contents.about})
        variables = {name: np.atleast_1d(array) for name, array in contents.arrays.items()}
        scipy.io.savemat(path, {**variables, ABOUT: remarks}, oned_as="column", do_compression=True)


def _is_version_4(begins_with: bytes) -> bool:
    """Whether a file begins with the header of a matrix of MATLAB 4, whose files have no mark of their own.

    Five integers: the type (thousands for the byte order, tens for the number format), rows, columns, whether complex,
    and the length of a name that ends in a zero.
    """
    for order in ("little", "big"):
        kind, rows, columns, imaginary, length = (
            int.from_bytes(begins_with[at : at + 4], order) for at in range(0, 20, 4)
        )
        if kind in (0, 10, 20, 30, 40, 50, 1000, 1010, 1020, 1030, 1040, 1050) and imaginary in (0, 1):
            name = begins_with[20 : 20 + length]
            if 0 < length < 64 and rows and columns and name.endswith(b"\0") and name[:-1].isalnum():
                return True
    return False


class _Found:
    """What lies below the variables of a file: numbers by dotted name, their labels and units, and what was skipped."""

    def __init__(self) -> None:
        self._arrays: dict[str, np.ndarray | mat73.Late | Column] = {}
        self._texts: dict[str, list[str]] = {}
        self._units: dict[str, str] = {}
        self._labels: dict[str, list[str]] = {}
        self._skipped: list[str] = []
        self._clocks: dict[str, np.ndarray] = {}

    def take(self, name: str, value: Any) -> None:
        """Take up one value and what it is made of: fields of structs, elements of cells and of arrays of structs."""
        if {"x_values", "y_values"} <= set(getattr(value, "_fieldnames", ())):
            self._take_testlab(name, value)
        elif hasattr(value, "_fieldnames"):
            self._describe(name, value)
            for field in value._fieldnames:
                self.take(f"{name}.{field}", getattr(value, field))
        elif texts := _texts(value):
            self._texts[name] = texts
        elif isinstance(value, np.ndarray) and value.dtype.kind == "O":
            for place, item in enumerate(value.ravel(order="F"), start=1):
                self.take(f"{name}{{{place}}}", item)
        elif isinstance(value, mat73.Late):
            self._arrays[name] = value
        elif isinstance(value, int | float | np.ndarray | np.number) and np.asarray(value).dtype.kind in NUMERIC:
            if np.size(value):
                self._arrays[name] = np.asarray(value)
        elif not isinstance(value, str) and not (isinstance(value, np.ndarray) and value.dtype.kind in "USO"):
            self._skipped.append(f"{name} ({_class_name(value)})")

    def contents(self, remarks: dict[str, Any], path: Path, doubt: str = "") -> Contents:
        """The contents of the file.

        Raises
        ------
        ValueError
            If nothing in it can be read, with what was skipped.
        """
        skipped = f"Not read of {path.name}: {', '.join(self._skipped[:8])}" if self._skipped else ""
        if skipped and not self._arrays:
            raise ValueError(
                f"{path.name} must hold arrays or structs of numbers; {skipped}. Save the numbers in MATLAB, as "
                f"s.time = x.Time; s.data = x.Data."
            )
        said = described(self._texts, {n: a for n, a in self._arrays.items() if not isinstance(a, Column)})
        self._arrays |= {name: column for name, column in said.columns.items() if name not in self._arrays}
        for name, label in said.labels.items():
            self._labels.setdefault(label, []).append(name)
        rates = {name: rate for name, rate in said.rates.items() if name in self._arrays and name not in self._clocks}
        units = {n: unit for n, unit in {**said.units, **self._units}.items() if n in self._arrays}
        aliases = {text: tuple(n for n in names if n in self._arrays) for text, names in self._labels.items()}
        return Contents(
            Lazy(self._arrays, lambda name: np.asarray(self._arrays[name])),
            {**units, **remarks.pop("units", {})},
            remarks,
            clocks=Lazy(
                [name for name in (*self._clocks, *rates) if name in self._arrays],
                lambda name: self._clocks[name] if name in self._clocks else self._counted(name, rates[name]),
            ),
            notes=tuple(filter(None, (skipped and skipped + ".", doubt))),
            aliases={text: names for text, names in aliases.items() if names and text not in self._arrays},
        )

    def _counted(self, name: str, rate: float) -> np.ndarray:
        return np.arange(np.shape(self._arrays[name])[0]) / rate

    def _take_testlab(self, name: str, signal: Any) -> None:
        """A signal as Simcenter Testlab writes it: samples, and an axis of start, step and number."""
        axis, ordinate = signal.x_values, signal.y_values
        over = _text(axis, "quantity", "label") or "s"
        if over != "s":
            self._skipped.append(f"{name} (samples over {over}, which is no time)")
            return
        values = np.asarray(ordinate.values)
        columns = values.T if values.ndim == 2 and values.shape[0] < values.shape[1] else values
        place = f"{name}.y_values.values"
        self._arrays[place] = columns
        start, step = float(getattr(axis, "start_value", 0.0)), float(axis.increment)
        self._clocks[place] = start + step * np.arange(columns.shape[0])
        if unit := _text(ordinate, "quantity", "label"):
            self._units[place] = unit
        self._labels.setdefault(name, []).append(place)

    def _describe(self, name: str, struct: Any) -> None:
        """Labels and units that stand beside numbers, as Simulink and others put them."""
        fields = {field.lower(): field for field in struct._fieldnames}
        holders = [f"{name}.{fields[key]}" for key in ("values", "data", "y", "value") if key in fields]
        for key in ("label", "name", "signalname"):
            text = getattr(struct, fields[key]) if key in fields else ""
            if isinstance(text, str) and text.strip():
                for holder in holders:
                    self._labels.setdefault(text.strip(), []).append(holder)
        for key in ("unit", "units"):
            text = getattr(struct, fields[key]) if key in fields else ""
            if isinstance(text, str) and text.strip():
                for holder in holders:
                    self._units[holder] = text.strip()


def _found(variables: Mapping[str, Any]) -> _Found:
    found = _Found()
    for name, value in variables.items():
        if not name.startswith("__"):
            found.take(name, value)
    return found


def _texts(value: Any) -> list[str]:
    """A text, or the texts of a cell or of the rows of a matrix of letters; empty if it holds anything else."""
    if isinstance(value, str):
        return [value.strip()]
    if not isinstance(value, np.ndarray) or value.dtype.kind not in "UO":
        return []
    items = value.ravel(order="F").tolist()
    return [item.strip() for item in items] if items and all(isinstance(item, str) for item in items) else []


def _text(struct: Any, *fields: str) -> str:
    """The text at the end of a chain of fields, empty where it breaks off."""
    for field in fields:
        struct = getattr(struct, field, "")
    return struct.strip() if isinstance(struct, str) else ""


def _class_name(value: Any) -> str:
    """What MATLAB calls the class of something that is not read."""
    kind = type(value).__name__
    if isinstance(value, mat73.Unread):
        return value.what
    if isinstance(value, scipy.io.matlab.MatlabFunction):
        return "a function"
    if isinstance(value, scipy.io.matlab.MatlabOpaque):
        names = [item for row in value for item in row if isinstance(item, str | bytes)] if value.size else []
        known = [n.decode() if isinstance(n, bytes) else n for n in names if n not in ("MCOS", b"MCOS")]
        return f"an object of class {known[-1]}" if known else "an object"
    return kind
