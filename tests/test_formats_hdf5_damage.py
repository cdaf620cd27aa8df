"""Damaged texts in HDF5 files, in which the HDF5 library itself may run for ever or end the process."""

import struct
import subprocess
import sys

import h5py
import h5py.h5o
import numpy as np
import pytest

from jfsm.records import read
from jfsm.records.formats.hdf5_texts import _references, numbers_of, text_of, texts_of

N = 40


def _file(path, more=0, **how):
    with h5py.File(path, "w", **how) as file:
        for name, unit in (("time", "s"), ("F", "kN"), ("x", "mm")):
            file[name] = np.arange(1.0 * N)
            for place in range(more):
                file[name].attrs[f"more{place}"] = place
            file[name].attrs["units"] = unit
    return path


def _heap(file: bytes) -> int:
    return file.index(b"GCOL")


def _zeros_in_the_heap(file):
    """Its objects end before it does, and the next is none."""
    at = _heap(file) + 16 + 3 * 24
    return file[:at] + bytes(64) + file[at + 64 :]


def _long_object(file):
    """An object that ends behind its heap."""
    at = _heap(file) + 16 + 8
    return file[:at] + struct.pack("<Q", 10**6) + file[at + 8 :]


def _long_text(file):
    """A reference to three thousand million letters."""
    at = file.index(struct.pack("<IQI", 2, _heap(file), 2))
    return file[:at] + struct.pack("<I", 3 * 10**9) + file[at + 4 :]


def _no_text(file):
    """A row of numbers of any length where a text was."""
    at = file.index(b"units\0\0\0\x19\x01") + 9
    return file[:at] + b"\0" + file[at + 1 :]


DAMAGES = [_zeros_in_the_heap, _long_object, _long_text]


@pytest.mark.parametrize("how", [{}, {"libver": "latest"}, {"userblock_size": 512}])
def test_texts_of_variable_length_are_found_in_headers_of_either_version(tmp_path, how):
    path = _file(tmp_path / "a.h5", **how)
    with h5py.File(path) as file, path.open("rb") as stream:
        address = h5py.h5o.get_info(file["x"].id).addr
        reference = _references(stream, file.userblock_size, address, b"units", 1)
        assert reference is not None and struct.unpack("<IQI", reference)[::2] == (2, 3)
        file_texts = [text_of(file[name], "units") for name in ("time", "F", "x")]
        assert file_texts == ["s", "kN", "mm"]
        assert text_of(file["F"], "unit") == "" and numbers_of(file["F"], "units").size == 0


def test_texts_of_objects_with_many_attributes_are_found_by_their_names(tmp_path):
    """Newer files keep more than eight attributes apart from the header."""
    path = _file(tmp_path / "a.h5", more=12, libver="latest")
    with h5py.File(path) as file, path.open("rb") as stream:
        address = h5py.h5o.get_info(file["x"].id).addr
        assert _references(stream, 0, address, b"units", 1) is None
        assert text_of(file["x"], "units") == "mm"
    content = path.read_bytes()
    path.write_bytes(_long_text(content))
    with h5py.File(path) as file, pytest.raises(ValueError, match="'units' of '/[a-zA-Z]+' is damaged"):
        text_of(file["x"], "units")


def test_several_texts_of_one_attribute(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["data"] = np.stack([0.005 * np.arange(N), np.arange(N), 2.0 * np.arange(N)], 1)
        file["data"].attrs["columns"] = np.array(["time", "F", "x"], dtype=object)
        file["data"].attrs["units"] = np.array(["s", "kN", "mm"], dtype=object)
        assert texts_of(file["data"], "columns") == ["time", "F", "x"]
    record = read(tmp_path / "a.h5", force="F", displacement="x")
    assert record.sample_rate == 200 and record.channels["force", 1][1] == 1e3
    assert record.channels["displacement", 1][1] == 2e-3


def test_damaged_texts_are_refused_before_the_library_reads_them(tmp_path):
    """In a process of its own: the library does not come back from the first, and none of the others is harmless."""
    for number, damage in enumerate(DAMAGES):
        file = _file(tmp_path / "a.h5").read_bytes()
        (tmp_path / f"damaged{number}.h5").write_bytes(damage(file))
        assert damage(file) != file
    child = (
        "import sys, jfsm\n"
        "for path in sys.argv[1:]:\n"
        "    try: jfsm.read(path, force='F', displacement='x'); print('read')\n"
        "    except ValueError as error: print(error)\n"
    )
    paths = [str(tmp_path / f"damaged{number}.h5") for number in range(len(DAMAGES))]
    ran = subprocess.run([sys.executable, "-c", child, *paths], capture_output=True, text=True, timeout=600)
    lines = ran.stdout.splitlines()
    assert ran.returncode == 0 and len(lines) == len(DAMAGES)
    assert all("must be an HDF5 file; parts of it cannot be read (the text 'units' of" in line for line in lines)


def test_an_attribute_that_became_no_text_is_no_unit(tmp_path):
    file = _file(tmp_path / "a.h5").read_bytes()
    (tmp_path / "a.h5").write_bytes(_no_text(file))
    with h5py.File(tmp_path / "a.h5") as opened:
        kinds = [h5py.h5a.open(opened[name].id, b"units").get_type().get_class() for name in opened]
        assert kinds.count(h5py.h5t.VLEN) == 1
        assert [text_of(opened[name], "units") for name in opened].count("") == 1


def test_a_name_that_is_no_text_is_left_out(tmp_path):
    _file(tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5", "a") as file:
        file[b"\xff\xfe"] = np.arange(3.0)
    assert any(r"Left out: b'\xff\xfe'" in note for note in read(tmp_path / "a.h5", force="F").notes)
