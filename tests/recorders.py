"""Writers of files of recorders for the tests, after the public descriptions of their formats."""

import struct
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np


class ImcChannel(NamedTuple):
    """One component of an imc FAMOS file, by itself in a field or the first or second of a pair."""

    name: str
    values: np.ndarray
    kind: int = 8  # of number: 4 is two bytes with a sign, 7 and 8 are real
    unit: str = "N"
    step: float = 0.005
    over: str = "s"
    first: float = 0.0
    added: float = 0.0
    trigger: str = " 8, 5,2019,17,53, 4.0"
    scale: tuple[float, float] | None = None
    group: int = 0
    field: tuple[int, int] = (1, 1)  # components, kind
    part: int = 1
    axis: str = "0,0,0"
    bits: int = 0


_IMC = {2: "i1", 3: "u2", 4: "i2", 6: "i4", 7: "f4", 8: "f8", 11: "u2", 13: "u6"}


def imc_key(name: str, body: str | bytes, version: int = 1) -> bytes:
    """A key with its length, and a line end, which the format allows behind it."""
    body = body.encode("cp1252") if isinstance(body, str) else body
    return f"|{name},{version},{len(body)},".encode() + body + b";\r\n"


def _text(text: str) -> str:
    return f"{len(text)},{text}"


def imc_file(channels: Sequence[ImcChannel], order: str = "<", closed: int = 1, groups: Iterable[str] = ()) -> bytes:
    """A file of version 2 with all samples in one key CS."""
    heads, samples = b"", b""
    for number, channel in enumerate(channels, start=1):
        if channel.kind == 13:
            raw = np.asarray(channel.values, "<u8").view("u1").reshape(-1, 8)[:, :6].tobytes()
        else:
            raw = np.asarray(channel.values).astype(f"{order}{_IMC[channel.kind]}").tobytes()
        width = int(_IMC[channel.kind][1])
        if channel.part == 1:
            heads += imc_key("CG", f"{channel.field[0]},{channel.field[1]},{min(channel.field[1], 2)}")
            heads += imc_key("CD", f"{channel.step!r},1,{_text(channel.over)},{channel.axis}")
            heads += imc_key("NT", channel.trigger)
        heads += imc_key("CC", f"{channel.part},{2 if channel.kind == 11 else 1}")
        heads += imc_key("CP", f"{number},{width},{channel.kind},{channel.bits or 8 * width},0,0,1,0")
        buffer = f"{number},1,{len(samples)},{len(raw)},0,{len(raw)},1,{channel.first!r},{channel.added!r},"
        heads += imc_key("Cb", f"1,0,{buffer}")
        factor, offset = channel.scale or (0, 0)
        heads += imc_key("CR", f"{int(channel.scale is not None)},{factor},{offset},1,{_text(channel.unit)}")
        heads += imc_key("CN", f"{channel.group},0,0,{_text(channel.name)},0,")
        samples += raw
    head = b"|CF,2,1,%d;|CK,1,3,1,%d;" % (1 if order == "<" else 2, closed)
    for index, group in enumerate(groups, start=1):
        head += imc_key("CB", f"{index},{_text(group)},0,")
    return head + heads + imc_key("CS", b"1," + samples)


class CatmanChannel(NamedTuple):
    """One channel of a catman file."""

    name: str
    values: np.ndarray
    unit: str = "N"
    step: float = 0.005  # s
    begins: float = 44504.5  # days since 1899-12-30
    kind: int = 0


def catman_file(channels: Sequence[CatmanChannel], export: int = 0, version: int = 5012, post: bool = True) -> bytes:
    """A file with all numbers as `export` has it: 0 in 8 bytes, 1 in 4, 2 in 2 between limits."""

    def text(words: str, kind: str = "h") -> bytes:
        return struct.pack(f"<{kind}", len(words)) + words.encode("cp1252")

    heads, numbers = b"", b""
    for place, channel in enumerate(channels):
        more = bytearray(148)
        struct.pack_into("<2d", more, 0, channel.begins, 1e3 * channel.step)
        more[140], more[141:148] = export, b"\x03  \x00  \x00"
        heads += struct.pack("<hi", place, len(channel.values)) + text(channel.name) + text(channel.unit) + text("")
        heads += struct.pack("<hhdi", channel.kind, 8, channel.begins + 0.01, len(more)) + bytes(more)
        heads += bytes((1, 0, 0)) + struct.pack("<h", 0) + text("") + text(" " * 68, "i")
        values = np.asarray(channel.values, dtype=np.float64)
        if export == 2:
            low, high = values.min(), max(values.max(), values.min() + 1e-12)
            numbers += struct.pack("<2d", low, high)
            numbers += np.round((values - low) / (high - low) * 32767).astype("<u2").tobytes()
        else:
            numbers += values.astype("<f4" if export else "<f8").tobytes()

    def start(end: str) -> bytes:
        return text("run 7") + text(end.ljust(12)) + text(" ") * 31 + struct.pack("<hi", len(channels), 0)

    places = bytes(4 * len(channels)) + struct.pack("<i", 0)
    offset = 6 + len(start("")) + len(places) + len(heads)
    end = str(offset + len(numbers)) if post else " "
    return struct.pack("<hi", version, offset) + start(end) + places + heads + numbers + b"\xa1\x0f\0\0"


def write_mat73(path: Path, run: Mapping[str, np.ndarray]) -> None:
    """A MATLAB 7.3 file with a struct `run` of arrays and a text."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in run.items():
            file[f"run/{name}"] = values[None]
            file[f"run/{name}"].attrs["MATLAB_class"] = np.bytes_("double")
        file["run/note"] = np.array([[ord(letter)] for letter in "run 7"], "u2").T
        file["run/note"].attrs["MATLAB_class"] = np.bytes_("char")
        file["run"].attrs["MATLAB_class"] = np.bytes_("struct")
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\0\2IM")
