"""Whether the elements of a MATLAB 5 file fit into one another: SciPy's reader takes a wrong tag for a place in memory.

After MathWorks' description of the format; only tags are read, and what is compressed is unpacked to see its checksum.
"""

import os
import zlib
from pathlib import Path
from typing import BinaryIO, Literal

from jfsm.records.formats.expansion import require_room

_HEADER, _TAG = 128, 8  # bytes ahead of the elements, and of a tag
_MATRIX, _COMPRESSED = 14, 15
_NUMBERS = (1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18)  # kinds of elements that hold numbers or text
_NESTING = (1, 2, 3, 16, 17)  # classes whose elements may be matrices: cells, structs, objects, functions, opaque
_CHUNK = 1 << 20

Order = Literal["little", "big"]
_ORDERS: dict[bytes, Order] = {b"IM": "little", b"MI": "big"}


def require_sound(path: Path) -> None:
    """Refuse a MATLAB 5 file whose elements do not fit; files of other versions are passed over.

    Raises
    ------
    ValueError
        With the place of the first element that does not.
    """
    with path.open("rb") as stream:
        head = stream.read(_HEADER)
        order = _ORDERS.get(head[126:128])
        if order is None or int.from_bytes(head[124:126], order) != 0x0100:
            return
        _Checked(stream, order, path).file(os.fstat(stream.fileno()).st_size)


class _Checked:
    def __init__(self, stream: BinaryIO, order: Order, path: Path):
        self._stream, self._path, self._unpacked = stream, path, 0
        self._order: Order = order

    def file(self, size: int) -> None:
        place = _HEADER
        while place < size:
            kind, start, end = self._tag(place)
            if end > size or kind not in (_MATRIX, _COMPRESSED, *_NUMBERS):
                raise ValueError(f"no variable begins at byte {place}")
            if kind == _COMPRESSED:
                self._unpack(start, end)
            elif kind == _MATRIX and end > start:
                self._matrix(start, end)
            place = end

    def _matrix(self, place: int, end: int) -> None:
        _, flags, _ = self._tag(place)
        self._stream.seek(flags)
        nesting = (int.from_bytes(self._stream.read(4), self._order) & 0xFF) in _NESTING
        while place < end:
            kind, start, after = self._tag(place)
            if after > end or kind not in (*_NUMBERS, *((_MATRIX,) if nesting else ())):
                raise ValueError(f"the element at byte {place} does not fit into its variable")
            if kind == _MATRIX and after > start:
                self._matrix(start, after)
            place = after if after - place == _TAG and start == place + 4 else start + -(-(after - start) // 8) * 8

    def _tag(self, place: int) -> tuple[int, int, int]:
        """Kind of the element at a place, and where its data begin and end; small ones stand in their tag."""
        self._stream.seek(place)
        first, second = (int.from_bytes(self._stream.read(4), self._order) for _ in range(2))
        if first >> 16:
            return first & 0xFFFF, place + 4, place + _TAG
        return first, place + _TAG, place + _TAG + second

    def _unpack(self, start: int, end: int) -> None:
        self._stream.seek(start)
        unpacking = zlib.decompressobj()
        for at in range(start, end, _CHUNK):
            packed = self._stream.read(min(_CHUNK, end - at))
            while packed:
                self._unpacked += len(unpacking.decompress(packed, _CHUNK))
                require_room(self._unpacked, self._path)
                packed = unpacking.unconsumed_tail
        if not unpacking.eof:
            raise ValueError(f"the variable at byte {start} is cut short")
