"""Dewesoft files. The maker's library reads no file but its own, so that a small stand-in takes its place here."""

import numpy as np
import pytest

from jfsm.records import read

STAND_IN = """
import os, sys, time, enum
from datetime import datetime, timedelta, timezone
import numpy as np

class DataType(enum.Enum): dtSingle = 5; dtText = 11
class ChannelType(enum.Enum): DW_CH_TYPE_SYNC = 0; DW_CH_TYPE_ASYNC = 1; DW_CH_TYPE_SV = 2

class Channel:
    def __init__(self, name, unit="N", kind=0, data=5, size=1, index="AI;0", count=50, long_name="", gap=0.0):
        self.name, self.unit, self.array_size, self.channel_index = name, unit, size, index
        self.channel_type, self.data_type, self.number_of_samples = ChannelType(kind), DataType(data), count
        self.long_name, self.gap = long_name or name, gap
        self.sample_rate = 100.0 if kind == 0 else 0.0

    def scaled(self):
        k = np.arange(self.number_of_samples)
        uneven = 0.0003 * (k % 3) if self.sample_rate == 0.0 else 1e-9 * (k % 3)
        return k / 100 + uneven + self.gap * (k >= 25), 1.0 * k

class DWFile(dict):
    def __init__(self, path):
        text = open(path, "rb").read().split(b"|")[1].decode()
        if text == "crash": os.abort()
        if text == "refuse": raise RuntimeError("file corrupt")
        if text == "hang": time.sleep(60)
        begun = datetime(2023, 11, 2, 10, 12, 13, tzinfo=timezone.utc)
        class info: pass
        self.info = info
        info.start_measure_time, info.start_store_time = begun, begun + timedelta(seconds=5.0 * (text == "late"))
        if text == "bits":
            self["t"] = Channel("t", data=11)
            return
        self["a"], self["b"] = Channel("F"), Channel("F", unit="kN", long_name="F")
        self["x"], self["y"] = Channel("x", unit="mm"), Channel("slow", kind=1)
        self["gap"] = Channel("gap", gap=1.0)
        self["rows"], self["bus"] = Channel("rows", size=4), Channel("bus", index="CAN;1")
        self["one"], self["none"] = Channel("one", kind=2), Channel("none", kind=1, count=0)

    def __enter__(self): return self
    def __exit__(self, *what): return None
"""


@pytest.fixture
def written(tmp_path, monkeypatch):
    """A function that writes a file which the stand-in treats as the word in it says."""
    (tmp_path / "library").mkdir()
    (tmp_path / "library" / "dwdatareader.py").write_text(STAND_IN)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "library"))
    monkeypatch.syspath_prepend(str(tmp_path / "library"))

    def write(word="good"):
        (tmp_path / "run.dat").write_bytes(b"MULTI_STREAM_FILE_VER0200-\0\0|" + word.encode() + b"|")
        return tmp_path / "run.dat"

    return write


def test_channels_have_units_clocks_and_dates_and_what_is_left_out_is_told(written):
    record = read(written(), displacement="x")
    np.testing.assert_array_equal(record.time, np.arange(50) / 100)  # the even clock, without the rounding of instants
    np.testing.assert_allclose(record.channels["displacement", 1], 1e-3 * np.arange(50))
    assert record.begins == np.datetime64("2023-11-02T10:12:13")
    left = next(note for note in record.notes if note.startswith("Left out"))
    for words in ("rows (4 numbers at a time)", "bus (messages of a bus)", "one (one value)", "none (no samples)"):
        assert words in left


def test_channels_of_one_name_of_other_clocks_and_with_gaps_are_told_apart(written):
    with pytest.raises(ValueError, match=r"'F' may be 'F \(1\)' or 'F \(2\)'"):
        read(written(), force="F")
    assert read(written(), force="F (2)").channels["force", 1][1] == 1000
    uneven = read(written(), force="slow")
    np.testing.assert_allclose(uneven.time[:3], [0, 0.0103, 0.0206])
    gap = read(written(), force="gap")
    assert gap.time[25] - gap.time[24] == pytest.approx(1.01)


def test_a_file_that_was_stored_late_has_no_date_but_a_note(written):
    record = read(written("late"), displacement="x")
    assert record.begins is None
    assert any("storing at 2023-11-02T10:12:18" in note and "record.dated" in note for note in record.notes)


@pytest.mark.parametrize(
    ("word", "words"),
    [
        ("crash", "the maker's library ends on it"),
        ("refuse", "the maker's library says: RuntimeError: file corrupt"),
        ("bits", r"hold channels over time; it holds t \(numbers of kind Text\)"),
    ],
)
def test_files_on_which_the_library_fails_are_refused(written, word, words):
    with pytest.raises(ValueError, match=rf"run\.dat must .*{words}"):
        read(written(word), force="F")


def test_a_library_that_does_not_answer_is_not_waited_for(written, monkeypatch):
    monkeypatch.setattr("jfsm.records.formats.dewesoft._PATIENCE", {"list": 0.5, "read": 0.5})
    with pytest.raises(ValueError, match=r"does not answer within 0\.5 s"):
        read(written("hang"), force="F")


def test_without_the_library_one_line_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    (tmp_path / "run.dxd").write_bytes(b"MULTI_STREAM_FILE_VER0200-\0\0")
    with pytest.raises(ModuleNotFoundError, match=r"dwdatareader, which is not installed.*jfsm\[dewesoft\]"):
        read(tmp_path / "run.dxd", force="F")
