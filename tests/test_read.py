"""Records from files, and back."""

import json
import subprocess
import sys
import tracemalloc

import h5py
import numpy as np
import pytest
import scipy.io

from jfsm.records import Record, read
from jfsm.records.formats import text
from jfsm.records.formats.text import lines

T = np.arange(100) * 0.02
U = np.cos(3.0 * T)
Y = np.sin(3.0 * T)


def _save(path, **arrays):
    if path.suffix == ".npz":
        np.savez(path, **arrays)
    elif path.suffix == ".mat":
        scipy.io.savemat(path, arrays)
    elif path.suffix == ".h5":
        with h5py.File(path, "w") as file:
            for name, array in arrays.items():
                file[name] = array
    else:
        columns = np.column_stack(list(arrays.values()))
        np.savetxt(path, columns, delimiter=",", header=",".join(arrays), comments="", fmt="%.17g")
    return path


@pytest.mark.parametrize("suffix", [".csv", ".npz", ".mat", ".h5"])
def test_channels_are_named_and_their_units_converted(tmp_path, suffix):
    path = _save(tmp_path / f"run{suffix}", time=T, u=U, y=1e3 * Y)
    record = read(path, force="u", displacement="y", units={"u": "N", "y": "mm"}, at_rest=True)
    np.testing.assert_allclose(record.time, T, rtol=1e-15)
    np.testing.assert_allclose(record.channels["force", 1], U, rtol=1e-15)
    np.testing.assert_allclose(record.channels["displacement", 1], Y, rtol=1e-14)
    assert (record.name, record.at_rest, record.drive, record.units["displacement"]) == ("run", True, "force", "m")


@pytest.mark.parametrize("suffix", [".csv", ".txt", ".npz", ".mat", ".h5", ".hdf5", ".uff", ".unv"])
@pytest.mark.parametrize("units", [{}, {"force": "kip", "displacement": "deg"}, {"displacement": "mV", "force": "V"}])
def test_a_written_record_is_read_back_the_same(tmp_path, suffix, units):
    channels = {"force": {2: U}, "displacement": np.stack([Y, U], 1), "acceleration": Y / 3, "base_acceleration": U / 7}
    record = Record(T / 3 + 5, **channels, units=units, at_rest=True, drive="motion", name="Lauf 7, März").noted("cut")
    record.write(tmp_path / f"a{suffix}")
    again = read(tmp_path / f"a{suffix}")
    np.testing.assert_array_equal(again.time, record.time)
    assert list(again.channels) == list(record.channels)
    for key, samples in record.channels.items():
        np.testing.assert_array_equal(again.channels[key], samples)
    np.testing.assert_array_equal(again.base_acceleration, record.base_acceleration)
    assert dict(again.units) == dict(record.units)
    assert (again.at_rest, again.drive, again.name, again.notes) == (True, "motion", "Lauf 7, März", ("cut",))


@pytest.mark.parametrize("suffix", [".csv", ".npz", ".mat", ".h5", ".uff"])
def test_a_record_without_channels_is_read_back(tmp_path, suffix):
    Record(T).write(tmp_path / f"a{suffix}")
    again = read(tmp_path / f"a{suffix}")
    assert (len(again), dict(again.channels), again.name) == (100, {}, None)


def test_what_the_caller_says_overrides_what_the_file_says(tmp_path):
    Record(T, force=U, at_rest=True, name="old").write(tmp_path / "a.csv")
    record = read(tmp_path / "a.csv", displacement="force_1", units={"force_1": "V"}, at_rest=False, name="new")
    assert list(record.channels) == [("displacement", 1)]
    assert (record.units["displacement"], record.at_rest, record.name) == ("V", False, "new")


def test_a_file_is_replaced_only_by_a_complete_one(tmp_path, monkeypatch):
    path = tmp_path / "a.npz"
    Record(T, force=U).write(path)
    before = path.read_bytes()

    def interrupted(stream, **arrays):
        stream.write(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr(np, "savez", interrupted)
    with pytest.raises(KeyboardInterrupt):
        Record(T, force=Y).write(path)
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.npz"]


def test_an_unknown_suffix_is_not_written(tmp_path):
    with pytest.raises(ValueError, match=r"`path` must end in one of .*\.npz \.mat.*; it was 'a\.pdf'\. Choose"):
        Record(T).write(tmp_path / "a.pdf")


@pytest.mark.parametrize("suffix", [".csv", ".npz", ".mat", ".h5", ".uff"])
@pytest.mark.parametrize("called", ["a", "a.bin", "a.CSV", "a.tdms"])
def test_a_file_is_read_by_what_it_holds_whatever_its_name(tmp_path, suffix, called):
    Record(T, force=U).write(tmp_path / f"original{suffix}")
    (tmp_path / f"original{suffix}").rename(tmp_path / called)
    np.testing.assert_array_equal(read(tmp_path / called).channels["force", 1], U)


def test_a_missing_file_is_reported_as_such(tmp_path):
    with pytest.raises(FileNotFoundError):
        read(tmp_path / "a.csv", force="u")


@pytest.mark.parametrize("clock", [{"fs": 50.0}, {"sample_rate": 50.0}, {"dt": 0.02}])
def test_a_single_number_gives_the_clock(tmp_path, clock):
    for suffix in (".npz", ".mat", ".h5"):
        record = read(_save(tmp_path / f"a{suffix}", u=U, **clock), force="u")
        np.testing.assert_allclose(record.time, T, atol=1e-12)


def test_the_clock_may_be_a_rate_or_any_column(tmp_path):
    path = _save(tmp_path / "a.csv", T=T, u=U, other=1e3 * T)
    assert read(path, force="u").dt == pytest.approx(0.02)
    assert read(path, force="u", rate=200.0).dt == pytest.approx(0.005)
    assert read(path, force="u", time="other", units={"other": "ms"}).dt == pytest.approx(0.02)


def test_several_dofs_come_from_lists_mappings_matrices_and_their_columns(tmp_path):
    path = _save(tmp_path / "a.npz", t=T, y1=Y, y2=U, both=np.stack([Y, U]), fs=7.0)
    expected = np.stack([Y, U], 1)
    for names in (["y1", "y2"], {1: "y1", 2: "y2"}, "both", ["both[0]", "both[1]"]):
        np.testing.assert_array_equal(read(path, displacement=names).displacement, expected)
    assert list(read(path, displacement={3: "both[1]"}).channels) == [("displacement", 3)]


def test_columns_called_by_kind_need_no_names(tmp_path):
    path = _save(tmp_path / "a.csv", time=T, force=U, displacement_1=Y, displacement_2=U, note=T)
    assert list(read(path).channels) == [("force", 1), ("displacement", 1), ("displacement", 2)]


def test_fields_of_a_matlab_struct_have_dotted_names(tmp_path):
    scipy.io.savemat(tmp_path / "a.mat", {"run": {"time": T, "acc": {"tip": Y}, "comment": "shaker"}})
    record = read(tmp_path / "a.mat", time="run.time", acceleration="run.acc.tip")
    np.testing.assert_array_equal(record.channels["acceleration", 1], Y)


def test_pickled_objects_in_an_archive_are_left_alone(tmp_path):
    np.savez(tmp_path / "a.npz", t=T, u=U, trap=np.array([{}, []], dtype=object))
    assert len(read(tmp_path / "a.npz", force="u")) == 100
    with pytest.raises(ValueError, match="it was 'trap'"):
        read(tmp_path / "a.npz", force="trap")


ROWS = [(f"{t:.3f}", f"{u:.4f}") for t, u in zip(T, U, strict=True)]


def _text(delimiter, head="", decimal=".", end=""):
    return head + "".join(f"{t}{delimiter}{u}{end}\n".replace(".", decimal) for t, u in ROWS)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        (_text(",", "time,u\n"), "u"),
        (_text(", ", "time, u\n"), "u"),
        (_text("\t", "time\tu\n"), "u"),
        (_text(";", "time;u\n", decimal=","), "u"),
        (_text("  ", "% a comment\n% time u\n"), "u"),
        (_text(" ", "# time u\n"), "u"),
        (_text(",", "Recorder 12,,,\nOperator: K\n\nTime (sec),Load [N]\n"), "Load"),
        (_text(",", "time,u\ns,N\n"), "u"),
        (_text(",", "time,u\n[s],[N]\n"), "u"),
        (_text(",", "time,u,\n", end=","), "u"),
        (_text(",", "\ufefftime,u\n"), "u"),
        (_text(",", 'time,"u, front"\n'), "u, front"),
        (_text("\t", "time\tu\n", decimal=","), "u"),
        (_text("  ", "# time u\n# [s] [N]\n", decimal=","), "u"),
        (_text(",", "time,u\r\n").replace("\n", "\r\n").replace("\r\r", "\r"), "u"),
        (_text(";", "sep=;\ntime;u\ns;N\n", decimal=","), "u"),
    ],
    ids=["comma", "comma and blank", "tab", "semicolon", "percent", "hash", "preamble", "units", "[units]", "trailing",
         "byte order mark", "quoted", "tab and decimal comma", "units in a comment", "carriage returns", "sep="],
)  # fmt: skip
def test_layouts_of_text_are_found(tmp_path, text, name):
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    record = read(tmp_path / "a.csv", force=name)
    np.testing.assert_allclose(record.time, T, atol=1e-12)
    np.testing.assert_allclose(record.channels["force", 1], U, atol=5.1e-5)


@pytest.mark.parametrize("head", ["time,y\ns,mm\n", "time,y [mm]\n", "time,y (mm)\n", "time,y\n[s],[mm]\n"])
def test_units_that_the_file_states_are_used_unless_the_caller_knows_better(tmp_path, head):
    (tmp_path / "a.csv").write_text(_text(",", head))
    samples = read(tmp_path / "a.csv", displacement="y").channels["displacement", 1]
    np.testing.assert_allclose(samples, 1e-3 * U, atol=1e-7)
    for units in ({"y": "cm"}, {"displacement": "cm"}):
        samples = read(tmp_path / "a.csv", displacement="y", units=units).channels["displacement", 1]
        np.testing.assert_allclose(samples, 1e-2 * U, atol=1e-6)


def test_columns_without_a_name_are_numbered(tmp_path):
    (tmp_path / "a.txt").write_text(_text(" "))
    record = read(tmp_path / "a.txt", time="column 1", force="column 2")
    np.testing.assert_allclose(record.channels["force", 1], U, atol=5.1e-5)


def test_a_column_of_text_or_of_gaps_is_refused_only_when_it_is_used(tmp_path):
    lines = [f"{t},{u},{'ok' if i else 'bad'},{'' if i == 7 else u}" for i, (t, u) in enumerate(ROWS)]
    (tmp_path / "a.csv").write_text("time,u,state,w\n" + "\n".join(lines))
    assert len(read(tmp_path / "a.csv", force="u")) == 100
    with pytest.raises(ValueError, match=r"a\.csv must hold numbers in column 'state'; line 2 holds 'bad'\. Repair"):
        read(tmp_path / "a.csv", force="state")
    with pytest.raises(ValueError, match=r"`force dof 1` must be finite; 1 of 100.*is sample 7"):
        read(tmp_path / "a.csv", force="w")


@pytest.mark.parametrize("encoding", ["latin-1", "utf-16"])
def test_other_encodings_are_read(tmp_path, encoding):
    (tmp_path / "a.csv").write_bytes(_text(",", "time,Kraft für 3°\n").encode(encoding))
    assert len(read(tmp_path / "a.csv", force="Kraft für 3°")) == 100


def test_rows_that_begin_with_a_gap_belong_to_the_data(tmp_path):
    lines = [f"{t},{u},{'late' if i > 20 else ''}" for i, (t, u) in enumerate(ROWS)]
    (tmp_path / "a.csv").write_text("time,u,state\n" + "\n".join(lines))
    assert len(read(tmp_path / "a.csv", force="u")) == 100


def test_text_is_read_in_blocks(tmp_path, monkeypatch):
    monkeypatch.setattr(text, "BLOCK", 7)
    monkeypatch.setattr(lines, "CHUNK", 100)
    (tmp_path / "a.csv").write_text(_text(",", "time,u\n"))
    samples = read(tmp_path / "a.csv", force="u").channels["force", 1]
    np.testing.assert_allclose(samples, U, atol=5.1e-5)
    Record(T, force=U).write(tmp_path / "b.csv")
    np.testing.assert_array_equal(read(tmp_path / "b.csv").channels["force", 1], U)


def test_a_long_text_takes_twice_the_memory_of_its_numbers(tmp_path, monkeypatch):
    n = 200_000
    monkeypatch.setattr(lines, "CHUNK", 10_000)
    with (tmp_path / "a.csv").open("w") as stream:
        stream.write("time,u\n")
        stream.writelines(f"{0.001 * i:.3f},{i % 97}\n" for i in range(n))
    tracemalloc.start()
    record = read(tmp_path / "a.csv", force="u")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(record) == n
    assert peak < 2.5 * (2 * 8 * n)  # the table and the record, and one block of text; all text would take 20


def test_columns_of_one_name_stay_apart(tmp_path):
    (tmp_path / "a.csv").write_text("time,u,u\n" + "".join(f"{t},{u},1\n" for t, u in ROWS))
    assert read(tmp_path / "a.csv", force="u (3)").channels["force", 1][0] == 1.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time,u\n0,1\n1,2\n3\n2,3\n", r"a\.csv must have 2 columns in every row of data; line 4 has 1"),
        ("nothing\nto see\nhere\n", r"a\.csv must hold columns of numbers; no line .* the first is 'nothing'"),
        ("", r"a\.csv is empty\. Write or copy it again"),
        ("PK\x03\x04\x00\x01", r"a\.csv is a zip archive, which is not read\. Unpack it"),
        ("%PDF-1.4", r"a\.csv is a PDF document, which is not read\. Export the numbers as text"),
        ("\x01\x00\x02\x00", r"a\.csv is a binary file .* begins with the bytes 01 00 02 00\. Export it as text"),
        ("time,u\n0,1\n1,2\n2,bad\n3,3\n", r"a\.csv must hold numbers in column 'u'; line 4 holds 'bad'\. Repair"),
        ("time,u\n0,1\n1,2\n2,#N/A\n3,3\n", r"`force dof 1` must be finite; 1 of 4.*is sample 2"),
        ("time,u\n0,1\n1,2\n2,nan\n3,3\n", r"`force dof 1` must be finite; 1 of 4.*is sample 2"),
        ("time,u\n", r"a\.csv must hold columns of numbers; no line .* the first is 'time,u'"),
        ("time,u\n0,1\n", r"a\.csv must hold columns of numbers; it holds no two rows of them"),
        ("time,u\ns,N\n0,1\n1,2\n2,3,4\n3,4\n", r"a\.csv must have 2 columns in every row of data; line 5 has 3"),
    ],
)
def test_text_that_is_no_table_is_refused_and_left_as_it_was(tmp_path, text, message):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(ValueError, match=message):
        read(tmp_path / "a.csv", force="u")
    assert (tmp_path / "a.csv").read_text() == text
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.csv"]


def test_units_that_differ_within_a_kind_are_refused_by_channel(tmp_path):
    (tmp_path / "a.csv").write_text("time,y1,y2\ns,mm,m\n0,1,1\n1,2,2\n2,3,3\n")
    with pytest.raises(ValueError, match=r"`units` must be the same .* are \{'y1': 'mm', 'y2': 'm'\} in a\.csv\. Conv"):
        read(tmp_path / "a.csv", displacement=["y1", "y2"])


LONG = "specimen,run,time,u\n" + "".join(
    f"{specimen},{run},{i},{i + 10 * run + (100 if specimen == 'B 2' else 0)}\n"
    for specimen in ("A", "B 2")
    for run in (1, 2)
    for i in range(6)
)


def test_one_run_of_a_long_table_is_read_by_the_values_of_its_columns(tmp_path):
    (tmp_path / "a.csv").write_text(LONG)
    record = read(tmp_path / "a.csv", force="u", where={"specimen": "B 2", "run": 2})
    np.testing.assert_array_equal(record.time, np.arange(6))
    np.testing.assert_array_equal(record.channels["force", 1], 120 + np.arange(6))
    assert record.notes[0] == "Rows with specimen = B 2 and run = 2: 6 of 24."


def test_rows_of_columns_in_a_binary_file_are_chosen_alike(tmp_path):
    run = np.repeat([1, 2], 50)
    path = _save(tmp_path / "a.npz", run=run, t=np.tile(T[:50], 2), u=U, both=np.stack([Y, U]), fs=50.0)
    record = read(path, force="u", displacement="both", where={"run": 2})
    np.testing.assert_array_equal(record.time, T[:50])
    np.testing.assert_array_equal(record.displacement, np.stack([Y, U], 1)[50:])
    with pytest.raises(ValueError, match=r"`where` must name columns of one length; 'fs' in a\.npz has shape \(\)"):
        read(path, force="u", where={"fs": 50.0})


@pytest.mark.parametrize(
    ("where", "message"),
    [
        (
            {"specimen": "C"},
            r"`where` must leave rows of a\.csv; none has specimen = C\. 'specimen' holds 'A', 'B 2'\. A",
        ),
        ({"specimen": "A", "run": 3}, r"none has specimen = A and run = 3\. 'run' holds 1\.0, 2\.0"),
        ({"probe": "A"}, r"`where` must name a channel of a\.csv, which holds 'specimen', 'run'.*it was 'probe'"),
    ],
)
def test_rows_that_do_not_exist_are_refused_with_what_there_is(tmp_path, where, message):
    (tmp_path / "a.csv").write_text(LONG)
    with pytest.raises(ValueError, match=message):
        read(tmp_path / "a.csv", force="u", where=where)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, r"a\.npz must be told which channel is what.*it holds 't', 'force_in', 'm', 'scale'"),
        (dict(force="force_on"), r"`force` must name a channel .*; it was 'force_on'\. Did you mean 'force_in'\?"),
        (dict(force="m[2]"), r"`force` must name a column that exists; 'm' in a\.npz has shape \(100, 2\)"),
        (dict(force="force_in", units={"x": "m"}), "`units` must name channels that are read, .*; it names 'x'"),
        (dict(force="force_in", sensitivity={"t": "1 V/N"}), "`sensitivity` must name channels that are read, .* 't'"),
        (
            dict(force="force_in", sensitivity={"force": "100 mV"}),
            "`sensitivity` of force_in must be a number of raw.*mV'",
        ),
        (dict(force="force_in", sensitivity={"force": "9 mV/mm"}), "`sensitivity` of force_in must be .* of force, as"),
        (dict(force="force_in", sensitivity={"force": "9 mV/V"}), "`sensitivity` of force_in must be .*'9 mV/V'"),
        (dict(force="force_in", sensitivity={"force": "0 mV/N"}), "`sensitivity` of force_in must be .*'0 mV/N'"),
        (
            dict(force="force_in", units={"force": "N"}, sensitivity={"force": "9 mV/N"}),
            "`sensitivity` of force_in must be given for numbers in V; they are in N",
        ),
        (dict(force="force_in", units={"force_in": "ell"}), "`units` of force must be a unit of force.*'ell'"),
        (
            dict(displacement=["m[0]", "m[1]"], units={"m[0]": "mm"}),
            r"`units` must be the same for all channels of a kind; those of displ.* are .*'m\[1\]': None\} in a\.npz",
        ),
        (dict(force="force_in", time="t", rate=3.0), r"`time` and `rate` cannot both be given; they were 't' and 3\.0"),
        (dict(force="force_in", rate=-1.0), r"`rate` must be a positive number of samples per second; it was -1\.0"),
    ],
)
def test_a_wrong_request_is_refused_with_what_the_file_holds(tmp_path, arguments, message):
    path = _save(tmp_path / "a.npz", t=T, force_in=U, m=np.stack([U, Y], 1), scale=3.0)
    with pytest.raises(ValueError, match=message):
        read(path, **arguments)


def test_a_file_without_a_clock_is_refused(tmp_path):
    path = _save(tmp_path / "a.npz", u=U, y=Y)
    with pytest.raises(ValueError, match=r"a\.npz must say when its samples were taken; it holds 'u', 'y'\. Pass"):
        read(path, force="u")


def test_the_remarks_of_a_written_text_file_are_one_line_of_json(tmp_path):
    Record(T, force=U, units={"force": "kN"}).write(tmp_path / "a.csv")
    lines = (tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()
    remarks = json.loads(lines[0].removeprefix("# jfsm record "))
    assert remarks == {"at_rest": False, "drive": "force", "name": None, "notes": []}
    assert lines[1:3] == ["time,force_1", "[s],[N]"]


def test_a_unit_that_is_not_known_names_the_file_and_the_remedy(tmp_path):
    (tmp_path / "a.csv").write_text(_text(",", "time,u [EU]\n"))
    with pytest.raises(
        ValueError, match=r"a\.csv must state a unit of force for 'u'; it states 'EU'\. .*units=\{'u': "
    ):
        read(tmp_path / "a.csv", force="u")
    assert len(read(tmp_path / "a.csv", force="u", units={"u": "N"})) == 100


@pytest.mark.parametrize(
    ("head", "units", "text", "factor"),
    [
        ("time,a1\n", {}, "100 mV/g", 9.80665 / 100),  # readings in the unit of the sensitivity
        ("time,a1\ns,V\n", {}, "100 mV/g", 9.80665 / 0.1),  # in that of the file
        ("time,a1\ns,V\n", {"a1": "mV"}, "10.2 mV/(m/s²)", 1 / 10.2),  # in that of the caller
        ("time,a1\n", {}, "-1e-1 V/m/s^2", -10.0),
    ],
)
def test_a_sensitivity_makes_readings_what_the_sensor_measures(tmp_path, head, units, text, factor):
    (tmp_path / "a.csv").write_text(_text(",", head))
    for name in ("a1", "acceleration"):
        record = read(tmp_path / "a.csv", acceleration="a1", units=units, sensitivity={name: text})
        np.testing.assert_allclose(
            record.channels["acceleration", 1], factor * U, rtol=1e-12, atol=abs(factor) * 5.1e-5
        )
        assert record.units["acceleration"] == "m/s²"


def test_sensors_of_different_sensitivity_make_one_kind(tmp_path):
    path = _save(tmp_path / "a.npz", time=T, a1=100 * U, a2=51 * Y)
    record = read(path, acceleration=["a1", "a2"], sensitivity={"a1": "100 mV/g", "a2": "51 mV/g"})
    np.testing.assert_allclose(np.asarray(record.acceleration), 9.80665 * np.stack([U, Y], 1), rtol=1e-14)


def test_instants_beside_the_channels_come_before_those_at_the_top(tmp_path):
    scipy.io.savemat(tmp_path / "a.mat", {"time": 2 * T, "run": {"time": T, "u": U}, "v": U})
    assert read(tmp_path / "a.mat", force="run.u").dt == pytest.approx(0.02)
    assert read(tmp_path / "a.mat", force="v").dt == pytest.approx(0.04)


@pytest.mark.parametrize("suffix", [".npz", ".mat", ".h5", ".uff"])
@pytest.mark.parametrize("content", [b"", b"\x05\x00\x01\x00", "cut"])
def test_a_file_that_is_none_of_its_kind_is_refused_and_left_as_it_was(tmp_path, suffix, content):
    path = tmp_path / f"a{suffix}"
    Record(T, force=U).write(path)
    broken = path.read_bytes()[: path.stat().st_size // 2] if content == "cut" else content
    path.write_bytes(broken)
    with pytest.raises(ValueError, match=rf"a\{suffix} (must be|is) .*(Write or copy it again|Export)"):
        read(path, force="force_1")
    assert path.read_bytes() == broken


@pytest.mark.parametrize("suffix", [".npz", ".mat", ".h5", ".uff"])
def test_a_missing_file_of_any_kind_is_reported_as_such(tmp_path, suffix):
    with pytest.raises(FileNotFoundError):
        read(tmp_path / f"a{suffix}", force="u")


def test_reading_a_record_alone_loads_no_library_of_a_format():
    program = "import sys, jfsm; assert not {'h5py', 'pyuff', 'nptdms', 'asammdf'} & set(sys.modules)"
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
