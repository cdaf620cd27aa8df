"""The lines of a text file, whatever its encoding."""

import codecs
from collections.abc import Iterator
from pathlib import Path

CHUNK = 1 << 20  # characters that are text at one time
_CONTROL = bytes(c for c in range(32) if c not in b"\t\n\r\f\v\x1a\x1b\x00")

Line = tuple[int, str]  # number in the file, from 1, and text


def encoding_of(begins_with: bytes) -> str | None:
    """How a text is encoded that begins so; None if it is none. UTF-8 stands for all that only its end can tell."""
    for mark, encoding in (
        (codecs.BOM_UTF8, "utf-8-sig"),
        (codecs.BOM_UTF32_LE, "utf-32"),  # begins as the mark of UTF-16 does
        (codecs.BOM_UTF16_LE, "utf-16"),
        (codecs.BOM_UTF16_BE, "utf-16"),
    ):
        if begins_with.startswith(mark):
            return encoding
    zeros = begins_with.count(0)
    if zeros:  # without a mark every second byte of plain letters is zero
        even, odd = begins_with[0::2].count(0), begins_with[1::2].count(0)
        encoding = "utf-16-be" if even > odd else "utf-16-le"
        letters = begins_with[: len(begins_with) // 2 * 2].decode(encoding, "replace")
        plain = sum(letter.isprintable() or letter.isspace() for letter in letters)
        return encoding if zeros > 0.4 * len(begins_with) and plain > 0.98 * len(letters) else None
    if sum(begins_with.count(c) for c in _CONTROL) > 0.01 * len(begins_with):
        return None
    return "utf-8"


class TextFile:
    """A text file that is read from its beginning as often as needed, a block of lines at a time."""

    def __init__(self, path: Path):
        self.path = path
        with path.open("rb") as stream:
            self._encoding = encoding_of(stream.read(4096)) or "latin-1"
        if self._encoding == "utf-8" and not self._is_utf_8():
            self._encoding = "latin-1"  # degrees and squares as older recorders write them

    def _is_utf_8(self) -> bool:
        decoder = codecs.getincrementaldecoder("utf-8")()
        with self.path.open("rb") as stream:
            try:
                while chunk := stream.read(CHUNK):
                    decoder.decode(chunk)
                decoder.decode(b"", final=True)
            except UnicodeDecodeError:
                return False
        return True

    @property
    def ends_in_a_line(self) -> bool:
        """Whether the last line is ended, as by a program that came to its end."""
        with self.path.open("rb") as stream:
            stream.seek(max(0, self.path.stat().st_size - 8))
            return stream.read().rstrip(b"\x00").endswith((b"\n", b"\r", b"\x1a"))

    def blocks(self) -> Iterator[tuple[int, list[str]]]:
        """Lines as they come, without their ends: the number of the first of a block, and the block."""
        number = 1
        with self.path.open(encoding=self._encoding, errors="replace") as stream:
            while lines := stream.readlines(CHUNK):
                yield number, [line.rstrip("\n") for line in lines]
                number += len(lines)

    def lines(self) -> Iterator[Line]:
        """Lines with their numbers."""
        for first, block in self.blocks():
            yield from enumerate(block, start=first)
