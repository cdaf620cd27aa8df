"""The keys of which an imc FAMOS file consists, ``|CN,1,27,...;``: name, version, length and body of each."""

import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np

_HEAD = re.compile(rb"\s*\|([A-Za-z]{2}),\s*(\d{1,9})\s*,\s*(\d{1,15})\s*,")
_NUMBERED = re.compile(rb"\s*(\d{1,9})\s*,")
_LONGEST_HEAD = 256  # bytes, blanks in front included
_LONGEST_TEXT = 1 << 20
SAMPLES, EVENTS = "CS", "CV"  # the keys with a binary body


class Key(NamedTuple):
    """One key.

    Attributes
    ----------
    name, version : str, int
        As ``CN``, 1.
    body : bytes
        What it says; of samples only their number, and of events nothing.
    start, size : int
        Where the bytes of samples lie in the file, and how many there are.
    """

    name: str
    version: int
    body: bytes
    start: int
    size: int


class Fields:
    """What a key says, one thing after the other, divided by commas."""

    def __init__(self, body: bytes, encoding: str):
        self._body, self._encoding, self._place = body, encoding, 0

    def word(self) -> str:
        """Up to the next comma."""
        end = self._body.find(b",", self._place)
        end = len(self._body) if end < 0 else end
        if self._place > len(self._body):
            raise ValueError("it says less than it should")
        word, self._place = self._body[self._place : end], end + 1
        return word.decode(self._encoding, "replace").strip()

    def integer(self) -> int:
        """The next whole number."""
        return int(self.word())

    def real(self) -> float:
        """The next number, which is finite."""
        value = float(self.word())
        if not math.isfinite(value):
            raise ValueError(f"{value} in it")
        return value

    def text(self) -> str:
        """A length and as many bytes, in which commas may stand."""
        length = self.integer()
        end = self._place + length
        if length < 0 or end > len(self._body):
            raise ValueError("a text in it is longer than the key")
        text, self._place = self._body[self._place : end], end + 1
        return text.decode(self._encoding, "replace").strip(" \0")


def keys(path: Path) -> Iterator[Key]:
    """The keys of a file in their order; samples are passed over.

    Raises
    ------
    ValueError
        If the chain of keys breaks, or the last one is cut short.
    """
    size, place = path.stat().st_size, 0
    with path.open("rb") as stream:
        while place < size:
            stream.seek(place)
            head = stream.read(_LONGEST_HEAD)
            if not head.strip(b"\r\n\t \0\x1a"):
                place += len(head)
                continue
            found = _HEAD.match(head)
            if found is None:
                raise ValueError(
                    f"{path.name} must be an imc FAMOS file, of keys one behind the other; at byte {place} there is "
                    f"none. It is damaged or was cut short: copy it again."
                )
            key = _key(stream, found, place + found.end())
            end = place + found.end() + int(found[3])
            stream.seek(end)
            if end >= size or stream.read(1) != b";":
                raise ValueError(
                    f"{path.name} must be a whole imc FAMOS file; its key {key.name} at byte {place} announces "
                    f"{int(found[3])} bytes and does not end behind them. It is damaged or was cut short: copy it "
                    f"again."
                )
            yield key
            place = end + 1


def _key(stream: BinaryIO, found: re.Match[bytes], start: int) -> Key:
    name, version, size = found[1].decode(), int(found[2]), int(found[3])
    if name == EVENTS:
        return Key(name, version, b"", start, size)
    stream.seek(start)
    if name != SAMPLES:
        return Key(name, version, stream.read(min(size, _LONGEST_TEXT)), start, size)
    number = _NUMBERED.match(stream.read(64))
    if number is None:
        return Key(name, version, b"", start, size)
    return Key(name, version, number[1], start + number.end(), size - number.end())


def bytes_at(path: Path, start: int, size: int) -> np.ndarray:
    """Bytes of the file, read when they are used."""
    return np.memmap(path, np.uint8, "r", start, (size,)) if size else np.empty(0, np.uint8)
