"""Recorders of test benches: imc FAMOS and catman, as files after the makers' descriptions."""

import re

import numpy as np
import pytest
from recorders import CatmanChannel, ImcChannel, catman_file, imc_file, imc_key
from typer.testing import CliRunner

from jfsm.cli import app
from jfsm.records import align, read
from jfsm.records._listing import listing

N = 100
T = np.arange(N)
F = np.sin(0.2 * T)


def _imc(path, *channels, **how):
    path.write_bytes(imc_file(channels, **how))
    return path


def test_imc_channels_have_names_units_and_clocks_of_full_precision(tmp_path):
    """Readers round the first instant to the digits of the step; then 416.004 of a step of 0.01 is lost."""
    force = ImcChannel("load", F, first=416.0037, step=0.01)
    path = 3 * T - 50
    record = read(
        _imc(tmp_path / "run.raw", force, force._replace(name="path", values=path, kind=4, unit="mm", scale=(0.5, 2))),
        force="load",
        displacement="path",
    )
    np.testing.assert_allclose(record.time, 416.0037 + 0.01 * T, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(record.channels["force", 1], F)
    np.testing.assert_allclose(record.channels["displacement", 1], 1e-3 * (0.5 * path + 2))
    assert record.begins == np.datetime64("2019-05-08T17:53:04")


def test_imc_dates_may_be_seconds_since_1980(tmp_path):
    in_seconds = ImcChannel("F", F, trigger="1,1,1980,0,0,0.0", added=1241805184.0)
    assert read(_imc(tmp_path / "run.raw", in_seconds), force="F").begins == np.datetime64("2019-05-08T17:53:04")
    undated = read(_imc(tmp_path / "run.raw", in_seconds._replace(added=0.0)), force="F")
    assert undated.begins is None


def test_imc_channels_of_devices_that_began_apart_are_refused_together_and_aligned_by_date(tmp_path):
    late = ImcChannel("x", F, unit="mm", trigger=" 8, 5,2019,17,53, 4.1")
    path = _imc(tmp_path / "run.dat", ImcChannel("F", F), late)
    with pytest.raises(ValueError, match=r"channels of one clock.*0\.1 s apart"):
        read(path, force="F", displacement="x")
    both = align([read(path, force="F"), read(path, displacement="x")])
    np.testing.assert_allclose(
        both.channels["force", 1][:5], F[20:25], atol=2e-3
    )  # aligning interpolates between samples


def test_an_imc_pair_over_time_takes_its_clock_from_the_second_component(tmp_path):
    ticks = np.cumsum(np.where(T % 2, 1000, 1004)).astype(np.uint64)
    pair = ImcChannel("F", F, 7, field=(2, 2))
    over = ImcChannel("", ticks, 13, "s", scale=(1e-6, 0), field=(2, 2), part=2)
    record = read(_imc(tmp_path / "xy.dat", pair, over), force="F")
    np.testing.assert_allclose(record.time, 1e-6 * ticks, atol=1e-12)
    path = _imc(tmp_path / "xy.dat", pair, over._replace(unit="mm", name="path"))
    record = read(path, force="F", displacement="path", rate=200.0)
    np.testing.assert_allclose(record.channels["displacement", 1], 1e-9 * ticks)
    with pytest.raises(ValueError, match="must say when its samples were taken"):
        read(path, force="F")


def test_imc_files_of_the_other_byte_order_and_in_groups_are_read(tmp_path):
    one = ImcChannel("F", 1000 * T, 6, group=1)
    path = _imc(tmp_path / "run.dat", one, one._replace(group=2, values=-T), order=">", groups=("front", "rear"))
    np.testing.assert_array_equal(read(path, force="front/F").channels["force", 1], 1000 * T)
    with pytest.raises(ValueError, match="'F' may be 'front/F' or 'rear/F'"):
        read(path, force="F")


def test_imc_channels_of_one_name_are_told_apart(tmp_path):
    path = _imc(tmp_path / "run.dat", ImcChannel("F", F), ImcChannel("F", 2 * F))
    with pytest.raises(ValueError, match=r"'F' may be 'F \(1\)' or 'F \(2\)'"):
        read(path, force="F")
    np.testing.assert_array_equal(read(path, force="F (2)").channels["force", 1], 2 * F)


@pytest.mark.parametrize(
    ("other", "words"),
    [
        ({"kind": 11}, r"Left out: other \(bits\)"),
        ({"axis": "0,1,0"}, r"Left out: other \(several events\)"),
        ({"axis": "2,0,0"}, r"Left out: other \(reduced when it was recorded\)"),
        ({"over": "Hz"}, r"Left out: other \(over Hz, not over time\)"),
        ({"bits": 12, "kind": 4}, r"Left out: other \(12 bits in numbers of 2 bytes\)"),
        ({"field": (1, 4)}, r"Left out: other \(complex\)"),
        ({"over": ""}, r"'other' states a step of 0\.005 without a unit of time; in seconds that is rate=200"),
    ],
)
def test_what_is_not_read_of_an_imc_file_is_told(tmp_path, other, words):
    path = _imc(tmp_path / "run.dat", ImcChannel("F", F), ImcChannel("other", T)._replace(**other))
    record = read(path, force="F")
    assert any(re.search(words, note) for note in record.notes), record.notes


def test_an_imc_file_of_bits_alone_and_one_that_was_not_closed_say_so(tmp_path):
    with pytest.raises(ValueError, match=r"must hold channels over time; it holds F \(bits\)"):
        read(_imc(tmp_path / "run.dat", ImcChannel("F", T, 11)), force="F")
    record = read(_imc(tmp_path / "run.dat", ImcChannel("F", F), closed=0), force="F")
    assert any("did not close the file" in note for note in record.notes)


def test_interleaved_samples_of_an_imc_file_are_told_apart(tmp_path):
    rows = np.stack([F, 2 * F], 1).astype("<f4").tobytes()
    file = b"|CF,2,1,1;|CK,1,3,1,1;"
    for place, name in enumerate("ab"):
        file += imc_key("CG", "1,1,1") + imc_key("CD", "0.01,1,1,s,0,0,0,0.5,2", 2) + imc_key("CC", "1,1")
        file += imc_key("CP", f"{place + 1},4,7,32,0,{4 * place},1,4")
        file += imc_key("Cb", f"1,0,{place + 1},1,0,{len(rows)},0,{len(rows)},1,0,0,") + imc_key(
            "CN", f"0,0,0,1,{name},0,"
        )
    (tmp_path / "run.dat").write_bytes(file + imc_key("CS", b"1," + rows))
    record = read(tmp_path / "run.dat", force="b", units={"b": "N"})
    np.testing.assert_allclose(record.channels["force", 1], 2 * F, rtol=1e-6)
    assert record.time[0] == 0.5  # of key CD, where it says so


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (lambda file: file[:-30], "must be a whole imc FAMOS file; its key CS"),
        (lambda file: file.replace(b"|CN,", b"?CN,"), "at byte .* there is none"),
        (lambda file: file.replace(b",0,800,0,800,", b",8,800,0,800,"), "'F' announces 800 bytes from byte 8"),
        (lambda file: file.replace(b"19,17,53, 4.0", b"19,17,53, x.0"), "its key NT cannot be made out"),
    ],
)
def test_damaged_imc_files_are_refused(tmp_path, edit, words):
    file = imc_file([ImcChannel("F", F)])
    (tmp_path / "run.dat").write_bytes(edit(file))
    assert edit(file) != file
    with pytest.raises(ValueError, match=rf"run\.dat .*{words}"):
        read(tmp_path / "run.dat", force="F")


def _catman(path, *channels, **how):
    path.write_bytes(catman_file(channels, **how))
    return path


CLOCK = CatmanChannel("Time  1 - default sample rate", 0.005 * T, "s")


@pytest.mark.parametrize(("export", "tolerance"), [(0, 1e-12), (1, 1e-6), (2, 3.2e-5)])
def test_catman_exports_of_eight_four_and_two_bytes_have_one_clock(tmp_path, export, tolerance):
    """In two bytes the column of times is rounded to one part in 32767 of its range; the step in the header is not.

    The tolerances are the rounding of each kind of number.
    """
    path = _catman(tmp_path / "run.bin", CLOCK, CatmanChannel("F", F), export=export)
    record = read(path, force="F")
    np.testing.assert_allclose(record.channels["force", 1], F, atol=tolerance)
    np.testing.assert_allclose(record.time, 0.005 * T, rtol=0, atol=1e-15)
    assert record.begins == np.datetime64("2021-11-04T12:00:00")


def test_catman_channels_of_one_length_and_two_rates_keep_their_clocks(tmp_path):
    slow = CatmanChannel("Time  2 - slow sample rate", 0.1 * T, "s", 0.1)
    path = _catman(tmp_path / "run.bin", CLOCK, CatmanChannel("F", F), slow, CatmanChannel("x", F, "mm", 0.1))
    assert read(path, force="F").sample_rate == pytest.approx(200)
    assert read(path, displacement="x").sample_rate == pytest.approx(10)
    with pytest.raises(ValueError, match="channels of one clock"):
        read(path, force="F", displacement="x")


def test_a_catman_column_of_times_that_runs_otherwise_counts_with_a_note(tmp_path):
    paused = CLOCK._replace(values=0.005 * T + np.where(T < 50, 0.0, 0.4))
    slow = CatmanChannel("Time  2 - slow sample rate", 0.1 * T, "s", 0.1)
    record = read(_catman(tmp_path / "run.bin", paused, slow, CatmanChannel("F", F)), force="F")
    np.testing.assert_allclose(record.time, paused.values)
    assert any("does not run in the steps of 0.005 s" in note for note in record.notes)


def test_catman_channels_without_a_step_take_the_one_column_of_times_or_none(tmp_path):
    bare = CatmanChannel("F", F, step=0.0)
    record = read(_catman(tmp_path / "run.bin", CLOCK._replace(step=0.0, unit="ms"), bare), force="F")
    np.testing.assert_allclose(record.time, 5e-6 * T)
    assert any("clock of channels with 100 samples is 'Time  1" in note for note in record.notes)
    two = (CLOCK._replace(step=0.0), CLOCK._replace(name="Time  2 - slow", values=0.1 * T, step=0.0), bare)
    with pytest.raises(
        ValueError, match="told which times belong to 'F', which states no step: 'Time  1 .*' or 'Time  2 - slow'"
    ):
        read(_catman(tmp_path / "two.bin", *two), force="F")
    np.testing.assert_allclose(read(tmp_path / "two.bin", force="F", time="Time  2 - slow").time, 0.1 * T)


def test_catman_overflow_is_a_gap(tmp_path):
    over = CatmanChannel("F", np.where(T == 7, -1e6, F))
    with pytest.raises(ValueError, match="must be finite; 1 of 100"):
        read(_catman(tmp_path / "run.bin", over), force="F")


def test_a_listing_proposes_neither_gaps_nor_times(tmp_path):
    hardware = CatmanChannel("A hardware time", 1.6e9 + 0.005 * T, "s")
    over, path = CatmanChannel("F", np.full(N, -1e6)), CatmanChannel("x", F, "mm")
    file = _catman(tmp_path / "run.bin", CLOCK, hardware, over, path)
    kinds = {channel.name: channel.kind for channel in listing(file).channels if channel.kind}
    assert kinds == {"x": "displacement"}
    result = CliRunner().invoke(app, ["inspect", str(file), "--report", str(tmp_path / "page.html")])
    assert result.exit_code == 0 and "gaps" in result.stdout
    assert ">inf<" not in (tmp_path / "page.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (lambda file: file[:-40], "must be a whole catman file; its 2 channels"),
        (lambda file: file[:500], "must be a catman file; its headers cannot be made out"),
        (lambda file: file.replace(b"d\0\0\0\x01\0F", b"c\0\0\0\x01\0F"), "it states"),
    ],
)
def test_damaged_catman_files_are_refused(tmp_path, edit, words):
    file = catman_file([CLOCK, CatmanChannel("F", F)])
    (tmp_path / "run.bin").write_bytes(edit(file))
    with pytest.raises(ValueError, match=rf"run\.bin .*{words}"):
        read(tmp_path / "run.bin", force="F")
