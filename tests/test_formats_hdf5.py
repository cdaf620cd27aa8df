"""HDF5 files, and the MATLAB files that are such."""

import h5py
import numpy as np
import pytest

from jfsm.records import Record, read

T = np.arange(100) * 0.02
U = np.cos(3.0 * T)
Y = np.sin(3.0 * T)


def test_datasets_are_named_by_their_path_and_keep_their_units(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["time"] = 7 * T
        file["run/time"] = T
        file["run/load"] = U.astype(np.float32)
        file["run/load"].attrs["units"] = "kN"
        file["run/tip"] = np.stack([Y, U])  # channels first
        file["run/tip"].attrs["unit"] = np.bytes_(b"mm")
        file["run/operator"] = "K."
    record = read(tmp_path / "a.h5", force="run/load", displacement="run/tip", units={"run/load": "N"})
    np.testing.assert_array_equal(record.time, T)
    np.testing.assert_array_equal(record.channels["force", 1], U.astype(np.float32))
    np.testing.assert_allclose(np.asarray(record.displacement), 1e-3 * np.stack([Y, U], 1), rtol=1e-15)
    with pytest.raises(
        ValueError, match=r"which holds 'run/load', 'run/time', 'run/tip', 'time'; it was 'run/operator'"
    ):
        read(tmp_path / "a.h5", force="run/operator")


def test_one_column_of_a_matrix_has_the_unit_of_the_matrix(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["fs"] = 50.0
        file["tip"] = np.stack([Y, U], 1)
        file["tip"].attrs["units"] = "mm"
    record = read(tmp_path / "a.h5", displacement="tip[1]")
    np.testing.assert_allclose(record.channels["displacement", 1], 1e-3 * U, rtol=1e-15)


def test_fields_of_a_table_have_dotted_names(tmp_path):
    table = np.zeros(100, dtype=[("time", "f8"), ("load", "f4"), ("state", "S3")])
    table["time"], table["load"] = T, U
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["run/table"] = table
    record = read(tmp_path / "a.h5", force="run/table.load")
    np.testing.assert_array_equal(record.time, T)
    np.testing.assert_array_equal(record.channels["force", 1], table["load"])


def test_a_dataset_that_nobody_asks_for_is_not_read(tmp_path):
    Record(T, force=U).write(tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5", "a") as file:
        file.create_dataset("film", shape=(10**6, 10**6), chunks=(1000, 1000), dtype="f8")  # 8 TB if it were
    np.testing.assert_array_equal(read(tmp_path / "a.h5").channels["force", 1], U)


def test_a_written_file_says_its_units_to_others(tmp_path):
    Record(T, force=U, displacement=Y, units={"displacement": "mm"}).write(tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5") as file:
        assert {name: item.attrs["units"] for name, item in file.items()} == {
            "time": "s",
            "force_1": "N",
            "displacement_1": "m",
        }


def _matlab_7_3(path):
    """A file as MATLAB saves it with -v7.3: a line of text, then HDF5 whose arrays are transposed."""
    with h5py.File(path, "w", userblock_size=512) as file:

        def put(name, array, kind=b"double"):
            file[name] = array
            file[name].attrs["MATLAB_class"] = np.bytes_(kind)

        put("time", T[None, :])
        put("run/tip", np.stack([Y, U]))  # (100, 2) in MATLAB
        put("run/on", np.ones((1, 100), np.uint8), b"logical")
        put("run/comment", np.frombuffer(b"shaker", np.uint8)[:, None].astype(np.uint16), b"char")
        put("nothing", np.zeros(2, np.uint64))
        file["nothing"].attrs["MATLAB_empty"] = np.uint8(1)
        put("sparse/data", np.ones(3))
        file["sparse"].attrs["MATLAB_sparse"] = np.uint64(3)
        put("#refs#/a", U[None, :])
        file["cells"] = np.array([[file["#refs#/a"].ref]], dtype=h5py.ref_dtype)
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    return path


def test_matlab_files_of_version_seven_three_are_read_like_older_ones(tmp_path):
    record = read(_matlab_7_3(tmp_path / "a.mat"), displacement="run.tip", force="run.tip[1]")
    np.testing.assert_array_equal(record.time, T)
    np.testing.assert_array_equal(record.displacement, np.stack([Y, U], 1))
    np.testing.assert_array_equal(record.channels["force", 1], U)


def test_only_numbers_of_a_matlab_file_of_version_seven_three_are_channels(tmp_path):
    with pytest.raises(ValueError, match="which holds 'cells.1.', 'run.on', 'run.tip', 'time'; it was 'run.comment'"):
        read(_matlab_7_3(tmp_path / "a.mat"), force="run.comment")


def test_cells_arrays_of_structs_texts_and_units_of_version_seven_three_are_kept_and_the_rest_is_named(tmp_path):
    path = tmp_path / "a.mat"
    with h5py.File(path, "w", userblock_size=512) as file:

        def put(name, array, kind=b"double"):
            file[name] = array
            if kind:
                file[name].attrs["MATLAB_class"] = np.bytes_(kind)
            return file[name].ref

        def text(name, words):
            return put(name, np.frombuffer(words.encode("utf-16-le"), np.uint16)[:, None], b"char")

        put("t", T[None, :])
        runs = [put("#refs#/a", U[None, :]), put("#refs#/b", 2 * U[None, :])]
        put("cells", np.array(runs, dtype=h5py.ref_dtype)[:, None], b"cell")  # 1 x 2 in MATLAB
        labels = [text("#refs#/c", "tip"), text("#refs#/d", "root")]
        values = [put("#refs#/e", Y[None, :]), put("#refs#/f", -Y[None, :])]
        units = [text("#refs#/g", "mm"), text("#refs#/h", "mm")]
        for field, refs in (("label", labels), ("values", values), ("unit", units)):
            put(f"scope/{field}", np.array(refs, dtype=h5py.ref_dtype)[:, None], b"")  # an array of structs
        file["scope"].attrs["MATLAB_class"] = np.bytes_(b"struct")
        put("series", np.zeros((1, 6), np.uint32), b"timeseries")
        file["series"].attrs["MATLAB_object_decode"] = np.int32(3)
        file["elsewhere"] = h5py.ExternalLink("other.h5", "/x")
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    record = read(path, force="cells{2}", displacement={1: "root", 2: "scope{1}.values"}, time="t")
    np.testing.assert_array_equal(record.force, 2 * U[:, None])
    np.testing.assert_allclose(np.asarray(record.displacement), np.stack([-1e-3 * Y, 1e-3 * Y], 1), rtol=1e-12)
    assert any("series (an object of class timeseries)" in note for note in record.notes)


def test_a_matlab_file_of_version_seven_three_that_is_cut_short_is_refused(tmp_path):
    path = _matlab_7_3(tmp_path / "a.mat")
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(ValueError, match=r"a\.mat must be a MATLAB file; .*may be cut short\. Write or copy it again"):
        read(path, force="run.tip")


def test_what_the_library_says_of_a_damaged_type_is_one_refusal_that_names_the_file(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["F"], file["time"] = U, T
    content = bytearray((tmp_path / "a.h5").read_bytes())
    double = bytes([0, 0, 64, 0, 52, 11, 0, 52, 255, 3, 0, 0])  # how HDF5 spells the parts of a double
    content[content.index(double) + 9] = 0x83  # no type of NumPy has such an exponent
    (tmp_path / "a.h5").write_bytes(content)
    with pytest.raises(ValueError, match=r"a\.h5 must be an HDF5 file; parts of it cannot be read .*Write or copy it"):
        read(tmp_path / "a.h5", force="F")
