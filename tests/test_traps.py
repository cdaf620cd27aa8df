"""Fifteen traps that readers of measured records have fallen into, each written out as its recorder writes it."""

import re
import struct
import wave
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io

import jfsm
from jfsm.records import read


def write(path, text, encoding="utf-8"):
    path.write_bytes(text.encode(encoding))
    return path


def said(record, words):
    assert any(re.search(words, note) for note in record.notes), (words, record.notes)


def test_1_channels_that_started_apart_are_refused_with_both_starts_and_align_by_them(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    start = np.datetime64("2023-11-02T20:13:43.596313")
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject(
                    "g", name, values, properties={"wf_start_time": s, "wf_start_offset": 0.0, "wf_increment": 0.1}
                )
                for name, values, s in (
                    ("A", np.arange(100.0), start),
                    ("B", np.sin(np.arange(100.0)), start + np.timedelta64(3_000_301, "us")),
                )
            ]
        )
    with pytest.raises(ValueError, match=r"'g/A'.*'g/B'.*20:13:43\.596313.*20:13:46\.596614.*3\.000301 s apart"):
        read(tmp_path / "a.tdms", force="g/A", displacement="g/B")
    a, b = read(tmp_path / "a.tdms", force="g/A"), read(tmp_path / "a.tdms", displacement="g/B")
    assert b.time[0] - a.time[0] == pytest.approx(3.000301, abs=1e-9)
    aligned = jfsm.align([a, b])
    assert aligned.time[0] == pytest.approx(3.000301, abs=1e-9)
    said(a, "2023-11-02 20:13:43.596313")


# Trap 2, the LabVIEW file, is in test_formats_more.


def test_3_a_counter_with_start_and_increment_is_no_clock(tmp_path):
    rows = "".join(f"{i},{0.12 + 0.01 * i:.2f},,\n" for i in range(8))
    path = write(tmp_path / "a.csv", "X,CH1,Start,Increment\nSequence,Volt,-1.0e-01,1.0e-03\n" + rows)
    record = read(path, acceleration="CH1")
    np.testing.assert_allclose(record.time, -0.1 + 0.001 * np.arange(8), atol=1e-15)
    np.testing.assert_allclose(record.channels["acceleration", 1], 0.12 + 0.01 * np.arange(8), atol=1e-12)
    assert record.units["acceleration"] == "V"


def test_4_a_header_beside_the_data_costs_no_samples(tmp_path):
    head = ["Record Length,8,Points", "Sample Interval,0.001,s", "Trigger Point,4,Samples", "Source,CH1,"]
    head += ["Vertical Units,V,", "Horizontal Units,s,", ",,", ",,"]
    text = "".join(f"{row},{-0.1 + 0.001 * i:.3f},{0.01 * (i + 1):.2f}\n" for i, row in enumerate(head))
    record = read(write(tmp_path / "a.csv", text), acceleration="CH1")
    np.testing.assert_allclose(record.time, -0.1 + 0.001 * np.arange(8), atol=1e-12)
    np.testing.assert_allclose(record.channels["acceleration", 1], 0.01 * np.arange(1, 9), atol=1e-12)
    assert record.units["acceleration"] == "V"


def test_4_rows_of_data_that_stand_above_the_table_are_counted_in_a_note(tmp_path):
    record = read(write(tmp_path / "a.csv", "0.00,1\n0.01,2,5\ntime,F\n0.02,3\n0.03,4\n0.04,5\n"), force="F")
    assert len(record) == 3
    said(record, r"[Ll]ine 1 .*stands alone|hold numbers and are left out")


AT2 = (
    "PEER STRONG MOTION DATABASE RECORD\nSAN FERNANDO, STATION 1\n{quantity} TIME HISTORY IN UNITS OF {unit}\n{npts}\n"
)


@pytest.mark.parametrize("npts", ["NPTS=    17, DT=   .0050 SEC,", "   17   0.0050   NPTS, DT"])
@pytest.mark.parametrize("called", ["RSN1.AT2", "a.txt"])
def test_5_five_columns_of_a_ground_motion_are_one_series(tmp_path, npts, called):
    values = [f"{0.001 * i:15.7E}" for i in range(17)]
    body = "\n".join("".join(values[i : i + 5]) for i in range(0, 17, 5)) + "\n"
    head = AT2.format(quantity="ACCELERATION", unit="G", npts=npts)
    record = read(write(tmp_path / called, head + body))
    np.testing.assert_allclose(np.asarray(record.base_acceleration), 9.80665e-3 * np.arange(17), rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(record.time, 0.005 * np.arange(17))
    with pytest.raises(ValueError, match=r"must hold the 17 samples that it announces; it holds 16"):
        read(write(tmp_path / called, head + body.replace(values[16], "")))
    with pytest.raises(ValueError, match=r"must hold numbers alone below its header; line 5 is '# note'\. Repair"):
        read(write(tmp_path / called, head + "# note\n" + body))


def _v2_block(channel, values, unit="cm/sec/sec"):
    rows = ["".join(f"{v:10.3f}" for v in values[i : i + 8]) for i in range(0, len(values), 8)]
    return (
        f"Corrected accelerogram\nChan {channel}: 90 Deg\n"
        f"{len(values):5d} points of accel data equally spaced at  .010 sec, in {unit}. (8f10.3)\n"
        + "\n".join(rows)
        + "\nEnd-of-data for channel\n"
    )


def test_6_numbers_that_touch_are_cut_by_their_width(tmp_path):
    values = np.array([-12345.678, -2345.678, 1.5] + [0.25 * i for i in range(14)])
    text = _v2_block(1, values) + _v2_block(2, values[::-1])
    path = write(tmp_path / "a.txt", text)
    names = ["channel 1 acceleration", "channel 2 acceleration"]
    with pytest.raises(ValueError, match="must be told which channel is what.*'channel 1.*'channel 2"):
        read(path)
    for name, expected in zip(names, (values, values[::-1]), strict=True):
        full = next(each for each in jfsm_names(path) if each.startswith(name.split(" acc")[0]))
        record = read(path, base_acceleration=full)
        np.testing.assert_allclose(np.asarray(record.base_acceleration), 0.01 * expected, atol=1e-9)
        assert record.dt == pytest.approx(0.01)
    record = read(write(tmp_path / "b.v2", _v2_block(1, values)))
    np.testing.assert_allclose(np.asarray(record.base_acceleration), 0.01 * values, atol=1e-9)


def jfsm_names(path):
    from jfsm.records.formats import format_of

    return list(format_of(path).load(path).arrays)


def _rows_of_time(stamps):
    return "".join(f"{stamp},{i}\n" for i, stamp in enumerate(stamps))


BEGIN = np.datetime64("2024-03-05T14:30:00", "ns")
STAMPS = BEGIN + np.arange(40) * np.timedelta64(5_000_000, "ns")
NS = STAMPS.astype(np.int64)


@pytest.mark.parametrize(
    ("text", "tolerance"),
    [
        ("time,F\n" + _rows_of_time(f"{str(s)[:-6]}Z" for s in STAMPS), 1e-9),
        ("time,F\n" + _rows_of_time(f"{str(s)[:-6]}+02:00" for s in STAMPS), 1e-9),
        ("Date,Time,F\n" + _rows_of_time(str(s)[:-6].replace("T", ",") for s in STAMPS), 1e-9),
        ("Zeit;F\n" + "".join(f"05.03.2024 14:30:00,{5 * i:03d};{i}\n" for i in range(40)), 1e-9),
        ("Time,F\n" + _rows_of_time(str(s)[11:-6] for s in STAMPS), 1e-9),
        ("Time,F\n" + _rows_of_time(f"{str(s)[11:-6].replace('14:', '2:')} PM" for s in STAMPS), 1e-9),
        ("timestamp,F\n" + _rows_of_time(NS // 1_000_000), 1e-9),
        ("timestamp,F\n" + _rows_of_time(NS // 1000), 1e-9),
        ("%time,F\n" + _rows_of_time(NS), 1e-9),
        ("timestamp,F\n" + _rows_of_time(f"{ns / 1e9:.6f}" for ns in NS), 1e-6),
        ("Time,F\n" + _rows_of_time(f"{45356 + (ns - NS[0] + 52_200_000_000_000) / 86400e9:.13f}" for ns in NS), 2e-6),
    ],
    ids=["iso Z", "iso zone", "date, time", "german", "of day", "pm", "ms", "us", "ns", "s", "excel"],
)  # fmt: skip
def test_7_one_clock_in_many_spellings(tmp_path, text, tolerance):
    path = write(tmp_path / "a.csv", text)
    record = read(path, force="F")
    np.testing.assert_allclose(record.time, 0.005 * np.arange(40), atol=tolerance)
    np.testing.assert_array_equal(record.channels["force", 1], np.arange(40))
    said(record, r"14:30:00|12:30:00|2:30:00" if "45356" not in text else "Excel")


def test_7_steps_of_nanoseconds_since_1970_are_exact_to_one(tmp_path):
    stamps = 1_593_335_798_138_876_361 + 2_532_500 * np.arange(200)
    record = read(write(tmp_path / "a.csv", "%time,F\n" + _rows_of_time(stamps)), force="F")
    np.testing.assert_allclose(np.diff(record.time), 2_532_500e-9, atol=1e-9)
    said(record, "nanoseconds since 1970")


def test_7_a_change_of_clocks_and_midnight_are_no_gaps(tmp_path):
    local = ["01:59:58", "01:59:59", "03:00:00", "03:00:01"]
    record = read(write(tmp_path / "a.csv", "time,F\n" + _rows_of_time(f"2024-03-31 {c}" for c in local)), force="F")
    np.testing.assert_allclose(record.time, np.arange(4))
    said(record, "jumps by .1 h")
    midnight = ["23:59:58.5", "23:59:59.5", "00:00:00.5", "00:00:01.5"]
    record = read(write(tmp_path / "b.csv", "time,F\n" + _rows_of_time(midnight)), force="F")
    np.testing.assert_allclose(record.time, np.arange(4))
    said(record, "passes midnight")


def test_8_columns_of_time_that_disagree_are_told_with_their_factor(tmp_path):
    rows = "".join(f"{i},{str(BEGIN + np.timedelta64(i, 'ms'))[:-6].replace('T', ' ')},{i}\n" for i in range(30))
    record = read(write(tmp_path / "a.csv", "time [s],DateTime,F\n" + rows), force="F")
    assert record.dt == pytest.approx(1.0)
    said(record, r"Warning: .*'time' and 'DateTime' disagree by a factor of 1000")
    assert read(tmp_path / "a.csv", force="F", time="DateTime").dt == pytest.approx(1e-3)


def test_9_stamps_of_too_few_digits_that_a_uniform_clock_gives_are_that_clock(tmp_path):
    true = 12 + 1e-4 * np.arange(1000)
    rows = "".join(f"{np.floor(t * 1e3 + 1e-6) / 1e3:.3f},{i}\n" for i, t in enumerate(true))
    record = read(write(tmp_path / "a.csv", "time [s],F\n" + rows), force="F")
    np.testing.assert_allclose(record.time, true, atol=6e-4)
    np.testing.assert_allclose(np.diff(record.time), 1e-4, rtol=1e-3)
    said(record, r"written to 0\.001 s only; a uniform clock of 1\d* Hz|uniform clock of 9999")
    jumping = rows.replace("12.050,", "12.049,")
    with pytest.raises(ValueError, match="`time` must increase from sample to sample; it repeats .* such places"):
        read(write(tmp_path / "b.csv", "time [s],F\n" + jumping), force="F")


@pytest.mark.parametrize("width", [32, 16])
def test_10_a_counter_that_wraps_goes_on(tmp_path, width):
    stamps = (2**width - 6 + 4 * np.arange(10)) % 2**width
    record = read(write(tmp_path / "a.csv", "time [us],F\n" + _rows_of_time(stamps)), force="F")
    np.testing.assert_allclose(np.diff(record.time), 4e-6, rtol=1e-6)
    said(record, "counter of the clock began anew")


def test_10_a_doubled_stamp_is_moved_with_a_note_and_a_clock_that_goes_back_makes_runs(tmp_path):
    stamps = [0, 2.5, 5, 5, 10, 12.5, 15]
    record = read(write(tmp_path / "a.csv", "time [ms],F\n" + _rows_of_time(stamps)), force="F")
    np.testing.assert_allclose(record.time, 2.5e-3 * np.arange(7), atol=1e-12)
    said(record, r"1 instants were written twice.*sample 3")
    path = write(tmp_path / "b.csv", "time [s],F\n" + _rows_of_time([0, 1, 2, 3, 0, 1, 2]))
    with pytest.raises(ValueError, match=r"`run` must name one of the 2 runs of b\.csv.*1 \(4 samples.*2 \(3 samples"):
        read(path, force="F")
    record = read(path, force="F", run=2)
    np.testing.assert_array_equal(record.channels["force", 1], [4, 5, 6])
    said(record, "Run 2 of 2")
    with pytest.raises(ValueError, match="run 3 was asked for"):
        read(path, force="F", run=3)


def test_11_lost_samples_are_told_and_their_gap_is_kept(tmp_path):
    steps = np.full(60, 198.0)
    steps[30] = 596.0
    stamps = np.concatenate([[0], np.cumsum(steps)])
    text = "# sample rate: 5000 Hz\ntime [us],a\n" + _rows_of_time(f"{s:.0f}" for s in stamps)
    record = read(write(tmp_path / "a.csv", text), acceleration="a")
    np.testing.assert_allclose(record.time, 1e-6 * stamps, atol=1e-12)
    said(record, r"2 samples are missing in 1 places, the first 2 behind sample 30 .*5050\.5\d* Hz")
    said(record, r"sample rate: 5000 Hz.*instants give 5050\.5\d* Hz, which counts")


def test_12_sensors_side_by_side_keep_clocks_of_their_own(tmp_path):
    rows = [f"{0.01 * i:.2f},{i}," + (f"{0.02 * i:.2f},{10 * i}" if i < 4 else ",") for i in range(8)]
    path = write(tmp_path / "a.csv", "Time (s),a,Time (s),b\n" + "\n".join(rows) + "\n")
    np.testing.assert_allclose(read(path, force="a").time, 0.01 * np.arange(8), atol=1e-12)
    b = read(path, force="b")
    np.testing.assert_allclose(b.time, 0.02 * np.arange(4), atol=1e-12)
    np.testing.assert_array_equal(b.channels["force", 1], 10 * np.arange(4))
    with pytest.raises(ValueError, match=r"channels of one clock .*'a' has 8 samples.*'b' has 4 samples.*jfsm\.align"):
        read(path, force="a", displacement="b")


def test_12_a_slow_channel_stands_on_its_instants_or_is_said_to_hold(tmp_path):
    values = np.sin(np.arange(40.0))
    empty = "".join(f"{0.01 * i:.2f},{i},{values[i] if i % 2 == 0 else ''}\n" for i in range(40))
    record = read(write(tmp_path / "a.csv", "time,fast,slow\n" + empty), force="slow")
    np.testing.assert_allclose(record.time, 0.02 * np.arange(20), atol=1e-12)
    np.testing.assert_allclose(record.channels["force", 1], values[::2])
    held = "".join(f"{0.01 * i:.2f},{i},{values[i - i % 2]}\n" for i in range(40))
    record = read(write(tmp_path / "b.csv", "time,fast,slow\n" + held), force="fast", displacement="slow")
    said(record, r"'slow' holds every value for 2 samples")


def test_13_commas_that_may_be_decimal_are_refused(tmp_path):
    path = write(tmp_path / "a.csv", "time,F,x\n" + "".join(f"0,{i:03d},1,05,2,07\n" for i in range(8)))
    with pytest.raises(ValueError, match=r"3 names \(time, F, x\) above rows of 6 fields"):
        read(path, force="F")


@pytest.mark.parametrize(
    ("field", "value", "delimiter"),
    [
        ("1.234,50", 1234.5, ";"),
        ('"1,234.50"', 1234.5, ","),
        ("1\u00a0234,5", 1234.5, ";"),
        ("−0.5", -0.5, ","),
        ("1.234", 1.234, ","),
        ("1,234E+02", 123.4, ";"),
        ("1'234.5", 1234.5, ";"),
    ],
)
def test_13_numbers_in_the_dress_of_their_country(tmp_path, field, value, delimiter):
    rows = "".join(f"{i}{delimiter}{field}\n" for i in range(5))
    record = read(write(tmp_path / "a.csv", f"time{delimiter}F\n{rows}"), force="F")
    np.testing.assert_allclose(record.channels["force", 1], value, rtol=1e-12)


def test_13_one_mark_throughout_a_column(tmp_path):
    path = write(tmp_path / "a.csv", "t;F\n0;998,50\n1;1.002\n2;1.005,25\n3;999\n")
    np.testing.assert_array_equal(read(path, force="F").channels["force", 1], [998.5, 1002, 1005.25, 999])


@pytest.mark.parametrize("gap", ["1.#QNAN", "-", "OVL", "nan", "--", "OVF", "#N/A"])
def test_13_what_is_no_reading_is_a_gap_and_counted(tmp_path, gap):
    rows = "".join(f"{i},{gap if i in (3, 7) else i}\n" for i in range(10))
    with pytest.raises(ValueError, match="`force dof 1` must be finite; 2 of 10 samples are not"):
        read(write(tmp_path / "a.csv", "time,F\n" + rows), force="F")


ROWS = [f"{0.1 * i:.1f},{i}\n" for i in range(12)]


def test_14_cut_ends_and_rows_below_are_left_out_with_their_lines(tmp_path):
    text = ",0.5\ntime,F\n" + "".join(ROWS) + "Min,0\nMax,11\nEOF\n"
    record = read(write(tmp_path / "a.csv", text), force="F")
    np.testing.assert_array_equal(record.channels["force", 1], np.arange(12))
    said(record, r"Left out below the table: line 15 'Min,0', line 16 'Max,11', line 17 'EOF'")
    record = read(write(tmp_path / "b.csv", "time,F,x\n" + "".join(f"{r[:-1]},1\n" for r in ROWS) + "1.2,"), force="F")
    assert len(record) == 12
    said(record, r"Left out below the table: line 14 '1\.2,'")
    said(read(write(tmp_path / "c.csv", "time,F\n" + "".join(ROWS) + "1.2,1"), force="F"), "its last number may be cut")


@pytest.mark.parametrize("place", range(2, 11))
@pytest.mark.parametrize("between", ["time,F\n", "Block 2\n", "\nBlock 2\n\ntime,F\n"])
def test_14_blocks_are_runs_wherever_they_part(tmp_path, place, between):
    path = write(tmp_path / "a.csv", "time,F\n" + "".join(ROWS[:place]) + between + "".join(ROWS[place:]))
    with pytest.raises(
        ValueError, match=rf"2 runs of a\.csv.*1 \({place} rows from line 2 on\); 2 \({12 - place} rows"
    ):
        read(path, force="F")
    record = read(path, force="F", run=2)
    np.testing.assert_array_equal(record.channels["force", 1], np.arange(place, 12))


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be", "utf-16", "utf-8-sig", "latin-1"])
def test_14_the_encoding_is_found(tmp_path, encoding):
    record = read(write(tmp_path / "a.csv", "time,F [°]\n" + "".join(ROWS), encoding), displacement="F")
    np.testing.assert_allclose(record.channels["displacement", 1], np.deg2rad(np.arange(12)))


@pytest.mark.parametrize(
    ("head", "factor"),
    [
        ("x-axis,1\nsecond,Volt\n", 1.0),
        ("time,a\ns,G\n", 9.80665),
        ("time,a\ns,gal\n", 0.01),
        ("time,a\ns,m/s/s\n", 1.0),
    ],
)
def test_14_units_of_recorders_are_known(tmp_path, head, factor):
    record = read(write(tmp_path / "a.csv", head + "".join(ROWS)), acceleration=head[:9].split(",")[1].split("\n")[0])
    np.testing.assert_allclose(record.channels["acceleration", 1], factor * np.arange(12))
    assert record.dt == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.dat", b"MDF     3.30    " + bytes(100), "asammdf|MDF file"),
        ("a.dat", b"|CF,2,1,1;|CK,1,3,1,1;" + bytes(50), "Export what you need from FAMOS"),
        (
            "a.tdm",
            b"PK\x03\x04" + bytes(26) + b"data.tdx" + bytes(50),
            "is a DIAdem file, which is not read. Export it",
        ),
    ],
)
def test_15_a_wrong_thing_under_a_right_name_is_refused_by_what_it_is(tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises((ValueError, ModuleNotFoundError), match=message):
        read(tmp_path / name, force="F")


def test_15_a_spectrum_is_no_record(tmp_path):
    path = write(tmp_path / "a.csv", "freq,psd_x,psd_y\n" + "".join(f"{i},{i},{i}\n" for i in range(10)))
    with pytest.raises(ValueError, match=r"a\.csv holds a spectrum over 'freq'.*Export the samples over time"):
        read(path, acceleration="psd_x")


def test_15_two_widths_of_one_tone_have_one_amplitude(tmp_path):
    tone = 0.5 * np.sin(0.3 * np.arange(400))
    for width, name in ((2, "a.wav"), (3, "b.wav")):
        with wave.open(str(tmp_path / name), "wb") as stream:
            stream.setparams((1, width, 8000, 0, "NONE", "not compressed"))
            counts = np.round(tone * 2 ** (8 * width - 1)).astype(int)
            stream.writeframes(b"".join(struct.pack("<i", c)[:width] for c in counts))
        record = read(tmp_path / name, acceleration="channel 1")
        np.testing.assert_allclose(record.channels["acceleration", 1], tone, atol=4e-5)
        said(record, "say it by sensitivity")


def test_15_packed_integers_are_unpacked_and_fill_values_are_gaps(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["time"] = 0.1 * np.arange(10)
        for name, values in (("a", np.arange(10)), ("b", np.where(np.arange(10) == 4, -999, np.arange(10)))):
            file[name] = values.astype(np.int16)
            packing = {"scale_factor": 2e-3, "add_offset": 1.0, "_FillValue": np.int16(-999)}
            file[name].attrs.update({"units": np.bytes_("g"), **packing})
    record = read(tmp_path / "a.h5", acceleration="a")
    np.testing.assert_allclose(record.channels["acceleration", 1], 9.80665 * (1 + 2e-3 * np.arange(10)))
    said(record, "'a' is packed; its numbers are unpacked by scale_factor 0.002")
    with pytest.raises(ValueError, match="must be finite; 1 of 10 .*is sample 4"):
        read(tmp_path / "a.h5", acceleration="b")


def test_15_angles_in_degrees_by_a_line_of_the_header(tmp_path):
    head = "Coordinates\nversion=1\nnRows=5\nnColumns=3\ninDegrees=yes\nendheader\n"
    rows = "".join(f"{0.1 * i:.1f}\t{10 * i}\t{0.5 * i}\n" for i in range(5))
    path = write(tmp_path / "a.mot", head + "time\tknee_angle\tpelvis_tx\n" + rows)
    record = read(path, displacement="knee_angle")
    np.testing.assert_allclose(record.channels["displacement", 1], np.deg2rad(10 * np.arange(5)))
    said(record, "inDegrees=yes")
    np.testing.assert_allclose(read(path, displacement="pelvis_tx").channels["displacement", 1], 0.5 * np.arange(5))


def test_15_what_a_matlab_file_holds_beside_numbers_is_named(tmp_path, monkeypatch):
    t = 0.1 * np.arange(10)
    kinds = np.dtype([("s0", "O"), ("s1", "O"), ("s2", "O"), ("arr", "O")])
    opaque = scipy.io.matlab.MatlabOpaque(np.array([(b"run", b"MCOS", b"timeseries", t)], dtype=kinds))
    given = {"time": t, "F": t, "who": "K", "none": np.zeros((0, 0)), "run": opaque}
    (tmp_path / "a.mat").write_bytes(b"MATLAB 5.0 MAT-file")
    monkeypatch.setattr(scipy.io, "loadmat", lambda path, **options: dict(given))
    record = read(tmp_path / "a.mat", force="F")
    assert len(record) == 10
    said(record, r"Not read of a\.mat: run \(an object of class timeseries\)")
    del given["F"], given["time"], given["none"]
    with pytest.raises(ValueError, match=r"must hold arrays .*class timeseries.*Save the numbers in MATLAB"):
        read(tmp_path / "a.mat", force="F")


def test_counts_of_a_japanese_record_are_multiplied_by_the_fraction_it_states(tmp_path):
    head = "Origin Time       2011/03/11 14:46:00\nLat.              38.103\nRecord Time       2011/03/11 14:46:47\n"
    head += (
        "Sampling Freq(Hz) 100Hz\nDuration Time(s)  300\nDir.              N-S\nScale Factor      3920(gal)/6182761\n"
    )
    head += "Max. Acc. (gal)   100.0\nMemo.             \n"
    counts = -23100 + 10 * np.arange(24)
    body = "\n".join(" ".join(f"{c:8d}" for c in counts[i : i + 8]) for i in range(0, 24, 8)) + "\n"
    record = read(write(tmp_path / "MYG0041103111446.NS", head + body))
    np.testing.assert_allclose(np.asarray(record.base_acceleration), 0.01 * counts * 3920 / 6182761)
    assert record.sample_rate == pytest.approx(100)
    said(record, r"multiplied by 3920\(gal\)/6182761")
    with pytest.raises(ValueError, match="must state Scale Factor, Sampling Freq"):
        read(write(tmp_path / "a.NS", (head + body).replace("3920(gal)/", "")))


@pytest.mark.parametrize(
    ("name", "kind", "factor"),
    [
        ("force_kN", "force", 1e3),
        ("x_mm", "displacement", 1e-3),
        ("disp um", "displacement", 1e-6),
        ("theta_deg", "displacement", np.pi / 180),
        ("acc_mg", "acceleration", 9.80665e-3),
        ("acc_mm_s2", "acceleration", 1e-3),
        ("y_in", "displacement", 1.0),
        ("a_g", "acceleration", 1.0),
        ("force_mm", "force", 1.0),
    ],
)
def test_a_unit_that_ends_a_name_is_taken_with_a_note(tmp_path, name, kind, factor):
    arrays: dict[str, Any] = {"time": 0.1 * np.arange(5), name: np.arange(5.0)}
    np.savez(tmp_path / "a.npz", **arrays)
    record = read(tmp_path / "a.npz", **{kind: name})
    np.testing.assert_allclose(record.channels[kind, 1], factor * np.arange(5))
    said(record, f"{name}' is taken to be in " + ("" if factor == 1 else ".*, by its name"))
    record = read(tmp_path / "a.npz", **{kind: name}, units={kind: "V"})
    np.testing.assert_allclose(record.channels[kind, 1], np.arange(5))


def _testlab(values, over="s", unit="g"):
    return {
        "x_values": {"start_value": 0.5, "increment": 0.01, "number_of_values": 20.0, "quantity": {"label": over}},
        "y_values": {"values": values, "quantity": {"label": unit}},
        "function_record": {"name": "Point:1:+Z"},
    }


def test_15_signals_of_testlab_have_their_axis_and_spectra_are_named(tmp_path):
    scipy.io.savemat(
        tmp_path / "a.mat", {"Signal": _testlab(np.arange(20.0)), "FRF": _testlab(np.arange(20.0), over="Hz")}
    )
    record = read(tmp_path / "a.mat", acceleration="Signal")
    np.testing.assert_allclose(record.time, 0.5 + 0.01 * np.arange(20))
    np.testing.assert_allclose(record.channels["acceleration", 1], 9.80665 * np.arange(20))
    said(record, r"FRF \(samples over Hz, which is no time\)")
