"""Sound files (WAV), as recorded by USB accelerometers, sound cards and analysers."""

import struct
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from scipy.io import wavfile

from jfsm.records.formats.base import AbstractFormat, Contents, Lazy

_FORMAT = {order: struct.Struct(f"{mark}HHIIHH") for order, mark in (("little", "<"), ("big", ">"))}
FULL_SCALE = {"u1": 2.0**7, "i2": 2.0**15, "i4": 2.0**31, "i8": 2.0**63}  # SciPy shifts 24 bits to the top of 32


class WavFormat(AbstractFormat):
    """Channels ``channel 1``, ``channel 2`` in parts of full scale, on the clock of the file. Read only.

    What full scale is worth stands in the recorder, not in the file: say so by `sensitivity`, as ``{"channel 1":
    "0.2/g"}``.
    """

    name: ClassVar[str] = "sound (WAV)"
    suffixes: ClassVar[tuple[str, ...]] = (".wav",)

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        return begins_with[:4] in (b"RIFF", b"RIFX", b"RF64") and begins_with[8:12] == b"WAVE"

    def load(self, path: Path) -> Contents:
        notes: list[str] = []
        try:
            with warnings.catch_warnings(record=True) as said:
                warnings.simplefilter("always")
                rate, samples = wavfile.read(path)
        except Exception as error:  # whatever the reader stumbles over in bytes that are no such file
            raise ValueError(
                f"{path.name} must be a sound file of uncompressed samples; it cannot be read as one ({error}). "
                f"Export it as PCM or float, or copy it again."
            ) from error
        if any("prematurely" in str(warning.message) for warning in said):
            raise ValueError(f"{path.name} must hold the samples that it announces; it is cut short. Copy it again.")
        columns = samples[:, None] if samples.ndim == 1 else samples
        kind = columns.dtype.str[1:]
        if kind in FULL_SCALE:
            notes.append(
                "Numbers are parts of full scale, whose worth is not in the file: say it by sensitivity, as '0.2/g' "
                "where 0.2 of full scale is 1 g."
            )
        else:
            notes.append("Numbers are as in the file, whose unit is not stated.")
        notes += _of_strays(path)
        names = [f"channel {place}" for place in range(1, len(columns[0]) + 1)]

        def channel(name: str) -> np.ndarray:
            with np.errstate(invalid="ignore"):  # what is no number becomes one that is refused
                column = np.asarray(columns[:, names.index(name)], dtype=np.float64)
            if kind == "u1":
                column -= 128.0  # eight bits have no sign
            return column / FULL_SCALE.get(kind, 1.0)

        return Contents(
            Lazy(names, channel),
            dict.fromkeys(names, "1"),
            clocks=Lazy(names, lambda name: np.arange(columns.shape[0]) / rate),
            notes=tuple(notes),
        )


def _of_strays(path: Path) -> Iterator[str]:
    """What stands behind the last chunk that can be one, as where a length is damaged, and rates that differ."""
    whole = path.stat().st_size
    with path.open("rb") as stream:
        order: Literal["little", "big"] = "big" if stream.read(4) == b"RIFX" else "little"
        place = 12
        while place + 8 <= whole:
            stream.seek(place)
            name, size = stream.read(4), int.from_bytes(stream.read(4), order)
            if name == b"fmt " and size >= 16:
                _, _, rate, bytes_a_second, bytes_a_sample, _ = _FORMAT[order].unpack(stream.read(16))
                if bytes_a_second != rate * bytes_a_sample:
                    yield (
                        f"The file states {rate} samples of {bytes_a_sample} bytes a second and {bytes_a_second} bytes "
                        f"a second, which do not go together; the first counts."
                    )
            if not (name.isascii() and name.decode("ascii", "replace").isprintable()):
                yield f"{whole - place} bytes from byte {place} on are no part of the sound; they are left out."
                return
            place += 8 + size + size % 2
