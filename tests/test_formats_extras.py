"""TDMS and MDF files, whose libraries are extras."""

import gc
import importlib
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from jfsm.records import Record, align, read

T = np.arange(100) * 0.02
U = np.cos(3.0 * T)


@pytest.mark.parametrize(
    ("suffix", "begins_with", "package", "extra"),
    [("tdms", b"TDSm", "nptdms", "tdms"), ("mf4", b"MDF     4.10", "asammdf", "mf4")],
)
def test_a_missing_package_is_named_with_the_line_that_installs_it(
    tmp_path, monkeypatch, suffix, begins_with, package, extra
):
    def missing(name):
        raise ModuleNotFoundError(name)

    monkeypatch.setattr(importlib, "import_module", missing)
    (tmp_path / f"a.{suffix}").write_bytes(begins_with)
    message = rf"a\.{suffix} is read by the package {package}, .*Run `pip install jfsm\[{extra}\]`"
    with pytest.raises(ModuleNotFoundError, match=message):
        read(tmp_path / f"a.{suffix}", force="F")


@pytest.mark.parametrize("suffix", ["tdms", "mf4", "mdf"])
def test_what_is_only_read_is_not_written(tmp_path, suffix):
    with pytest.raises(ValueError, match=rf"`path` must end in a format .*\.{suffix} is only read\. Write \.h5"):
        Record(T, force=U).write(tmp_path / f"a.{suffix}")
    assert list(tmp_path.iterdir()) == []


def _tdms(path):
    nptdms = pytest.importorskip("nptdms")
    clock = {"wf_increment": 0.02, "wf_start_offset": 1.0}
    channels = [
        nptdms.ChannelObject("run", "F", U, properties={"unit_string": "kN", **clock}),
        nptdms.ChannelObject("run", "A", 2 * U, properties=clock),
        nptdms.ChannelObject("run", "slow", U[:50], properties={**clock, "wf_increment": 0.04}),
        nptdms.ChannelObject("run", "comment", np.array(["on", "off"])),
    ]
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(channels)
    return path


def test_channels_of_a_tdms_file_have_names_units_and_clocks(tmp_path):
    path = _tdms(tmp_path / "a.tdms")
    record = read(path, force="run/F", acceleration="run/A")
    np.testing.assert_allclose(record.time, 1.0 + T, rtol=1e-14)
    np.testing.assert_array_equal(record.channels["force", 1], 1e3 * U)
    np.testing.assert_array_equal(record.channels["acceleration", 1], 2 * U)
    with pytest.raises(ValueError, match="channels of one clock .*'run/F' has 100 samples .*'run/slow' has 50 samples"):
        read(path, force="run/F", acceleration="run/slow")


@pytest.mark.parametrize("kept", [10, 1000, -1])
def test_a_tdms_file_that_is_cut_short_is_refused(tmp_path, kept):
    path = _tdms(tmp_path / "a.tdms")
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(ValueError, match=r"a\.tdms must be a whole TDMS file; .*Write or copy it again"):
        read(path, force="run/F")


def _mdf(path, begun=None, version="4.10"):
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version=version) as file:
        if begun is not None:
            file.header.start_time = begun
        file.append([asammdf.Signal(U, T, name="F", unit="kN"), asammdf.Signal(2 * U, T, name="A", unit="g")])
        file.append([asammdf.Signal(U[:50], 2 * T[:50], name="A", unit="g")])
        written = file.save(path.with_suffix(".mf4" if version[0] == "4" else ".mdf"), overwrite=True)
    return Path(written).rename(path)


def test_channels_of_an_mdf_file_have_names_units_and_clocks(tmp_path):
    path = _mdf(tmp_path / "a.mf4")
    record = read(path, force="F", acceleration="A")
    np.testing.assert_allclose(record.time, T, rtol=1e-14)
    np.testing.assert_array_equal(record.channels["force", 1], 1e3 * U)
    np.testing.assert_array_equal(record.channels["acceleration", 1], 9.80665 * (2 * U))
    with pytest.raises(ValueError, match=r"channels of one clock .*'F' has 100 samples .*'A \(3\)' has 50 samples"):
        read(path, force="F", acceleration="A (3)")


@pytest.mark.parametrize("version", ["4.10", "3.30"])
def test_files_of_mdf_that_began_apart_are_put_on_one_clock(version, tmp_path):
    pytest.importorskip("asammdf")
    begun = datetime(2024, 3, 5, 14, 30, tzinfo=UTC)
    first = read(_mdf(tmp_path / "a.mf4", begun, version), force="F")
    late = read(_mdf(tmp_path / "b.dat", begun + timedelta(seconds=0.25), version), acceleration="A")
    assert first.begins is not None and late.begins is not None
    assert (late.begins - first.begins) / np.timedelta64(1, "ms") == 250
    both = align([first, late])
    assert both.time[0] == pytest.approx(0.25, abs=1e-9)
    assert any("reads zero 0.25 s after that of 'a'" in note for note in both.notes)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # of the half-made file of asammdf
def test_an_mdf_file_that_is_cut_short_is_refused(tmp_path):
    path = _mdf(tmp_path / "a.mf4")
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(ValueError, match=r"a\.mf4 must be an MDF file; .*Write or copy it again"):
        read(path, force="F")
    gc.collect()
