"""Texts and numbers in attributes of HDF5 objects, read where the library can read them safely.

A text of variable length lies in a heap of the file. In a heap that is damaged the library may run for ever, or end the
process, so the reference of a text is looked up and its heap is walked before, after the public specification of the
format. Attributes in dense storage, which newer files use for more than eight of an object, are found by their names.
"""

import functools
import mmap
import os
import struct
from collections.abc import Iterator
from typing import Any, BinaryIO, NamedTuple

import numpy as np

_ATTRIBUTE, _CONTINUATION = 0x0C, 0x10  # kinds of messages in the header of an object
_SHARED = 0x02  # flag of a message that lies elsewhere
_MANY = 1000  # blocks of one header, more than there ever are
_NOWHERE = (0, 2**64 - 1)


def text_of(item: Any, name: str) -> str:
    """The text of an attribute; empty if there is none, it is none, or it holds several.

    Raises
    ------
    ValueError
        If it is damaged.
    """
    found = texts_of(item, name)
    return found[0] if len(found) == 1 else ""


def texts_of(item: Any, name: str) -> list[str]:
    """The texts of an attribute, one or several; none if it holds anything else.

    Raises
    ------
    ValueError
        If one is damaged.
    """
    import h5py

    if name not in item.attrs:
        return []
    attribute = h5py.h5a.open(item.id, name.encode())
    kind = attribute.get_type()
    count = attribute.get_space().get_simple_extent_npoints()
    if kind.get_class() != h5py.h5t.STRING or not 0 < count <= _MANY:
        return []
    if kind.is_variable_str() and not _is_sound(item, name, count):
        raise ValueError(f"the text {name!r} of {item.name!r} is damaged")
    values = np.ravel(np.asarray(item.attrs[name])).tolist()
    return [(each.decode("utf-8", "replace") if isinstance(each, bytes) else str(each)).strip() for each in values]


def numbers_of(item: Any, name: str) -> np.ndarray:
    """The numbers of an attribute; empty if there is none, or it holds none."""
    import h5py

    if name not in item.attrs:
        return np.empty(0)
    kind = h5py.h5a.open(item.id, name.encode()).get_type().get_class()
    return np.ravel(item.attrs[name]) if kind in (h5py.h5t.INTEGER, h5py.h5t.FLOAT) else np.empty(0)


class _Message(NamedTuple):
    kind: int
    flags: int
    body: bytes


def _is_sound(item: Any, name: str, count: int) -> bool:
    """Whether texts lie where their references say, in heaps that are whole."""
    import h5py.h5o

    base, path = item.file.userblock_size, item.file.filename
    try:
        with open(path, "rb") as stream:
            references = _references(stream, base, h5py.h5o.get_info(item.id).addr, name.encode(), count)
            if references is None:
                stat = os.stat(path)
                return _are_sound_anywhere(path, base, name.encode(), count, (stat.st_size, stat.st_mtime_ns))
            return _are_sound(stream, base, references)
    except (struct.error, ValueError):
        return False


def _are_sound(stream: BinaryIO, base: int, references: bytes) -> bool:
    for length, heap, index in struct.iter_unpack("<IQI", references):
        if heap not in _NOWHERE and length > _sizes(stream, base + heap).get(index, -1):
            return False
    return True


def _references(stream: BinaryIO, base: int, address: int, name: bytes, count: int) -> bytes | None:
    """The bytes that stand for texts in the header of an object, 16 for each; None where they lie elsewhere."""
    for message in _messages(stream, base, address):
        if message.kind == _ATTRIBUTE and not message.flags & _SHARED:
            if (found := _referred(message.body, 0, name, count)) is not None:
                return found
    return None


def _referred(block: Any, start: int, name: bytes, count: int) -> bytes | None:
    """The references in a message on an attribute that begins at a place; None if it is on none of this name."""
    version, _, *sizes = struct.unpack_from("<BBHHH", block, start)
    place = start + (9 if version == 3 else 8)
    if block[place : place + sizes[0]].rstrip(b"\0") != name:
        return None
    rounded = sizes if version != 1 else [(size + 7) // 8 * 8 for size in sizes]
    place += sum(rounded)
    return block[place : place + 16 * count]


@functools.lru_cache(maxsize=256)
def _are_sound_anywhere(path: str, base: int, name: bytes, count: int, _: tuple[int, int]) -> bool:
    """Whether the texts of all attributes of this name in dense storage are sound, of whatever objects they are.

    What the last argument says of the file only keeps an answer from outliving it.
    """
    with open(path, "rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as content:
        at = content.find(name + b"\0")
        while at >= 0:
            if at >= 9 and content[at - 9] == 3 and struct.unpack_from("<H", content, at - 7) == (len(name) + 1,):
                references = _referred(content, at - 9, name, count)
                if references is not None and not _are_sound(stream, base, references):
                    return False
            at = content.find(name + b"\0", at + 1)
    return True


def _messages(stream: BinaryIO, base: int, address: int) -> Iterator[_Message]:
    """The messages of the header of an object, of either version, also those in its further blocks."""
    stream.seek(base + address)
    head = stream.read(64)
    if head[:4] != b"OHDR":
        (size,) = struct.unpack_from("<I", head, 8)
        yield from _walked(stream, base, (base + address + 16, size), "<HHB3x", b"")
        return
    flags = head[5]
    place = 6 + (16 if flags & 0x20 else 0) + (4 if flags & 0x10 else 0)
    width = 1 << (flags & 3)
    size = int.from_bytes(head[place : place + width], "little")
    yield from _walked(stream, base, (base + address + place + width, size), "<BHB2x" if flags & 4 else "<BHB", b"OCHK")


def _walked(stream: BinaryIO, base: int, first: tuple[int, int], layout: str, mark: bytes) -> Iterator[_Message]:
    """Messages of one block after the other; later blocks of newer files have a mark and a checksum."""
    blocks, step = [first], struct.calcsize(layout)
    for number in range(_MANY):
        if number >= len(blocks):
            return
        start, size = blocks[number]
        stream.seek(start)
        block = stream.read(size)
        if number and mark:
            block = block[len(mark) : -4]
        place = 0
        while place + step <= len(block):
            kind, length, flags = struct.unpack_from(layout, block, place)
            body = block[place + step : place + step + length]
            place += step + length
            if kind == _CONTINUATION:
                further, size = struct.unpack_from("<QQ", body)
                blocks.append((base + further, size))
            yield _Message(kind, flags, body)


def _sizes(stream: BinaryIO, start: int) -> dict[int, int]:
    """Sizes of the objects in a heap by their number.

    Raises
    ------
    ValueError
        If they do not fill the heap one behind the other.
    """
    stream.seek(start)
    head = stream.read(16)
    if head[:4] != b"GCOL":
        raise ValueError("no heap")
    (size,) = struct.unpack_from("<Q", head, 8)
    length = stream.seek(0, 2)
    if size < 16 or start + size > length:
        raise ValueError("a heap beyond the end of the file")
    stream.seek(start)
    heap, place, sizes = stream.read(size), 16, {}
    while place + 16 <= size:
        index, _, held = struct.unpack_from("<HH4xQ", heap, place)
        step = 16 + (held + 7) // 8 * 8 if index else held
        if step < 16 or place + step > size or index in sizes:
            raise ValueError("objects that do not fill the heap")
        sizes[index] = held
        place += step
    return sizes
