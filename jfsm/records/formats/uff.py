"""Universal files (UFF, UNV): what is read of them. How they are written is in `uff_writing`."""

import re
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from jfsm.records._units import find_unit
from jfsm.records.formats.base import ABOUT, AbstractFormat, Contents, Lazy, point_name, unique_names
from jfsm.records.formats.uff_writing import KINDS, about_from, save_uff

TIME_UNITS = ("ms", "us", "µs", "min")  # seconds otherwise
TIME = 17  # specific data type of an abscissa of instants
HISTORIES = (0, 1)  # function types: general, time response
REAL = (2, 4)  # ordinate data types: single and double precision

Header = dict[str, Any]


class UffFormat(AbstractFormat):
    """Time histories of dataset 58 and 58b, named ``3:+Z`` by node and direction.

    A name that two of them share is followed by what they measure (``3:+Z force``); a channel without a node has the
    name of its first description line. Units are those of the label of the ordinate, else of dataset 164.
    """

    name: ClassVar[str] = "universal file (UFF)"
    suffixes: ClassVar[tuple[str, ...]] = (".uff", ".unv")

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        return re.match(rb"\s*-1\s*\r?\n\s*\d+[b ]?", begins_with) is not None

    def load(self, path: Path) -> Contents:
        import pyuff  # loaded when a file asks for it, so that importing jfsm stays quick

        _require_complete(path)
        file = pyuff.UFF(str(path))
        types = [int(number) for number in file.get_set_types()]
        heads = {i: _set(file, path, i, header_only=True) for i, number in enumerate(types) if number == 58}
        about = next((i for i, head in heads.items() if head["id1"] == ABOUT), None)
        histories = {i: head for i, head in heads.items() if _is_history(head)}
        if not histories:
            functions = sorted({head["func_type"] for head in heads.values()})
            raise ValueError(
                f"{path.name} must hold time responses (real functions of type 1 in dataset 58); it holds datasets "
                f"{sorted(set(types))}{f', with functions of type {functions}' if functions else ''}. "
                f"Export the time histories."
            )
        if about is not None:
            names = [head["id1"] for head in histories.values()]
            remarks = about_from(_samples(file, path, about, heads[about]), path)
        else:
            names, remarks = _names(list(histories.values())), {}
        places = dict(zip(names, histories, strict=True))
        system = next((_set(file, path, i) for i, number in enumerate(types) if number == 164), {})
        scales: dict[str, float] = {}
        units: dict[str, str] = {}
        for name, i in places.items():
            unit, scales[name] = _unit(heads[i], system)
            if unit:
                units[name] = unit

        def samples(name: str) -> np.ndarray:
            return _samples(file, path, places[name], heads[places[name]]) * scales[name]

        def clock(name: str) -> np.ndarray:
            head = heads[places[name]]
            label = _given(head["abscissa_axis_units_lab"])
            second = find_unit(label, "time").factor if label in TIME_UNITS else 1.0
            if head["abscissa_spacing"]:
                return second * (head["abscissa_min"] + np.arange(head["num_pts"]) * head["abscissa_inc"])
            return second * np.asarray(_set(file, path, places[name])["x"])[: head["num_pts"]]

        title = [_set(file, path, i) for i, number in enumerate(types) if number == 151 and about is None]
        return Contents(
            Lazy(names, samples),
            units,
            remarks,
            clocks={} if about is not None else Lazy(names, clock),
            kinds={name: kind for name, i in places.items() if (kind := _kind(heads[i]))},
            points={name: (heads[i]["rsp_node"], heads[i]["rsp_dir"]) for name, i in places.items()},
            notes=tuple(_title(head) for head in title[:1]),
        )

    def save(self, path: Path, contents: Contents) -> None:
        save_uff(path, contents)


def _require_complete(path: Path) -> None:
    """Refuse a file whose last dataset does not end: it would be left out without a word."""
    with path.open("rb") as stream:
        stream.seek(max(0, path.stat().st_size - 4096))
        if not stream.read().rstrip().endswith(b"    -1"):
            raise ValueError(
                f"{path.name} must be a universal file, whose last line is '    -1'; it ends otherwise, and may be cut "
                f"short. Write or copy it again."
            )


def _set(file: Any, path: Path, number: int, header_only: bool = False) -> Header:
    """One dataset as pyuff gives it."""
    try:
        return file.read_sets(number, header_only=header_only)
    except Exception as error:  # pyuff raises nothing more special
        raise ValueError(
            f"{path.name} must be a universal file; its dataset number {number + 1} cannot be read ({error}). "
            f"Write or copy it again."
        ) from error


def _samples(file: Any, path: Path, number: int, head: Header) -> np.ndarray:
    """Ordinates of one dataset, as many as it announces."""
    samples, announced = np.asarray(_set(file, path, number)["data"]), head["num_pts"]
    if samples.size < announced:
        raise ValueError(
            f"{path.name} must hold the {announced} samples that its dataset number {number + 1} announces; it holds "
            f"{samples.size}. Write or copy it again."
        )
    return samples[:announced]  # what follows binary samples may read like a few more


def _is_history(head: Header) -> bool:
    against_time = head["abscissa_spec_data_type"] == TIME or head["func_type"] == 1
    return head["func_type"] in HISTORIES and against_time and head["ord_data_type"] in REAL


def _kind(head: Header) -> str | None:
    return KINDS.get(head["ordinate_spec_data_type"])


def _given(text: str) -> str:
    """A label of a universal file, empty where it says that there is none."""
    return "" if text.strip().upper() == "NONE" else text.strip()


def _names(heads: list[Header]) -> list[str]:
    """``3:+Z``, then with what is measured where that is needed to tell two channels apart."""
    names, points = [], []
    for head in heads:
        node, direction, title = head["rsp_node"], head["rsp_dir"], _given(head["id1"])
        names.append(point_name(node, direction) or title)
        points.append(point_name(node, abs(direction)) or title)  # either way round is the same place
    return unique_names(
        f"{name} {_kind(head)}" if points.count(point) > 1 and _kind(head) else name
        for name, point, head in zip(names, points, heads, strict=True)
    )


def _unit(head: Header, system: Header) -> tuple[str | None, float]:
    """Unit of the samples, and the factor that brings them to it: as labelled, else by the file's system of units."""
    label, kind = _given(head["ordinate_axis_units_lab"]), _kind(head)
    if label or not system or kind is None:
        return label or None, 1.0
    length, force = 1.0 / system["length"], 1.0 / system["force"]  # dataset 164 gives what to divide by
    if abs(head["rsp_dir"]) > 3:
        return {"force": ("N m", force * length), "displacement": ("rad", 1.0), "velocity": ("rad/s", 1.0)}.get(
            kind, ("rad/s²", 1.0)
        )
    return {"force": ("N", force), "displacement": ("m", length), "velocity": ("m/s", length)}.get(
        kind, ("m/s²", length)
    )


def _title(head: Header) -> str:
    """What the header of the file says of its origin."""
    parts = [_given(head[key]) for key in ("model_name", "description", "db_app")]
    return f"The file calls itself {', '.join(repr(part) for part in parts if part) or 'nothing'}."
