"""Flight logs, motion capture, and recorders whose files are refused by what they are."""

import struct

import numpy as np
import pytest

from jfsm.records import align, read

N = 200
T = np.arange(N)


def _message(kind: bytes, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), ord(kind)) + body


def _ulog(path, dropout=0, order=T):
    """A log by the letter of the format: two sensors and the one command, on clocks of their own."""
    log = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 5_000_000)
    log += _message(b"B", bytes(40))
    for text in (
        b"sensor_accel:uint64_t timestamp;uint64_t timestamp_sample;float x;float[2] raw;",
        b"actuator:uint64_t timestamp;float force;",
    ):
        log += _message(b"F", text)
    for instance, number, name in ((0, 0, b"sensor_accel"), (1, 1, b"sensor_accel"), (0, 2, b"actuator")):
        log += _message(b"A", struct.pack("<BH", instance, number) + name)
    for i in order:
        sent, sampled = 6_000_000 + 4000 * i + 1000 * (i % 3), 6_000_000 + 4000 * i
        for number in (0, 1):
            values = np.array([(number + 1) * i, 1.0, 2.0], "<f4").tobytes()
            log += _message(b"D", struct.pack("<HQQ", number, sent, sampled) + values)
        log += _message(b"D", struct.pack("<HQf", 2, 6_000_000 + 8000 * i, -i))
    if dropout:
        log += _message(b"O", struct.pack("<H", dropout))
    path.write_bytes(log)
    return path


def test_topics_of_a_px4_log_have_names_clocks_and_units(tmp_path):
    record = read(_ulog(tmp_path / "a.ulg"), acceleration={1: "sensor_accel.x", 2: "sensor_accel_1.x"})
    np.testing.assert_allclose(record.time, 1.0 + 0.004 * T, atol=1e-12)
    np.testing.assert_array_equal(record.channels["acceleration", 2], 2.0 * T)
    assert "acceleration" in record.stated
    assert any("timestamp_sample" in note for note in record.notes)
    with pytest.raises(ValueError, match="channels of one clock"):
        read(tmp_path / "a.ulg", force="actuator.force", acceleration="sensor_accel.x")
    both = align([read(tmp_path / "a.ulg", force="actuator.force"), record])
    assert both.sample_rate == pytest.approx(125)


def test_a_px4_log_under_another_name_out_of_order_or_with_dropouts_is_read_with_notes(tmp_path):
    order = np.concatenate([T[:50], T[60:70], T[50:60], T[70:]])
    record = read(_ulog(tmp_path / "a.bin", 35, order), acceleration="sensor_accel.x")
    np.testing.assert_array_equal(record.channels["acceleration", 1], 1.0 * T)
    assert any("not in the order of their stamps" in note for note in record.notes)
    assert any("dropped messages 1 times, for 35 ms" in note for note in record.notes)


def test_a_px4_log_that_is_none_is_refused(tmp_path):
    (tmp_path / "a.ulg").write_bytes(b"ULog\x01\x12\x35\x01" + bytes(8))
    with pytest.raises(ValueError, match=r"a\.ulg must (be|hold) "):
        read(tmp_path / "a.ulg", force="F")


def _c3d(path, gap=None, first=0):
    ezc3d = pytest.importorskip("ezc3d")
    file = ezc3d.c3d()
    points = np.ones((4, 2, N // 10))
    points[:3] = np.arange(3 * 2 * N // 10).reshape(3, 2, -1)
    if gap is not None:
        points[:3, 1, gap] = np.nan
    for group, rate, labels, units in (
        ("POINT", 100, ("heel", "toe"), ["mm"]),
        ("ANALOG", 1000, ("Fz1", "Mx1"), ["N", "Nmm"]),
    ):
        file["parameters"][group]["RATE"]["value"] = [rate]
        file["parameters"][group]["LABELS"]["value"] = labels
        file["parameters"][group]["UNITS"]["value"] = units
    file["data"]["points"] = points
    file["data"]["analogs"] = np.arange(2.0 * N).reshape(1, 2, N)
    file["header"]["points"]["first_frame"] = first
    file.write(str(path.with_suffix(".c3d")))
    return path.with_suffix(".c3d").rename(path)


def test_markers_and_analogue_channels_of_motion_capture_have_clocks_of_their_own(tmp_path):
    path = _c3d(tmp_path / "walk.c3d", first=7)
    plate = read(path, force="Fz1")
    np.testing.assert_allclose(plate.time, 0.07 + 0.001 * T, atol=1e-12)
    np.testing.assert_allclose(plate.channels["force", 1], T)
    toe = read(path, displacement="toe.Z")
    np.testing.assert_allclose(toe.time, 0.07 + 0.01 * np.arange(N // 10), atol=1e-12)
    np.testing.assert_allclose(toe.channels["displacement", 1], 1e-3 * (5 * N // 10 + np.arange(N // 10)))
    np.testing.assert_allclose(read(path, force="Mx1").channels["force", 1], 1e-3 * (N + T))
    assert any("first frame of the file is number 8" in note for note in toe.notes)
    with pytest.raises(ValueError, match="channels of one clock"):
        read(path, force="Fz1", displacement="toe.Z")


def test_a_marker_that_was_hidden_is_a_gap(tmp_path):
    path = _c3d(tmp_path / "walk.dat", gap=5)
    assert len(read(path, displacement="heel.X")) == N // 10
    with pytest.raises(ValueError, match="must be finite; 1 of 20 samples"):
        read(path, displacement="toe.X")


@pytest.mark.parametrize(
    "kept, words",
    [(700, "must be a file of C3D"), (1100, "must be a C3D file"), (-400, "cut short: it holds 19 of the 20 frames")],
)
def test_motion_capture_that_is_cut_short_is_refused(tmp_path, kept, words):
    path = _c3d(tmp_path / "walk.c3d")
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(ValueError, match=rf"walk\.c3d .*{words}"):
        read(path, displacement="toe.Z")


def _record_of_c3d(name, number, body=b"", order="<"):
    """A group (number below 0) or a parameter."""
    step = struct.pack(f"{order}h", 2 + len(body))
    return struct.pack("bb", len(name), number) + name + step + body


def _texts(*words):
    length = max(map(len, words))
    return struct.pack("bBBB", -1, 2, length, len(words)) + b"".join(word.ljust(length) for word in words) + b"\0"


def _integers(order, kind=84):
    """Ten frames of one marker in steps of 0.5 mm and of two channels, two samples a frame, as integers."""

    def numbers(letter, kind, *values):
        return struct.pack(f"{order}bBB{len(values)}{letter}", kind, 1, len(values), *values) + b"\0"

    parameters = bytes((1, 80, 2, kind))
    for record in (
        (b"POINT", -1, b"\0"), (b"LABELS", 1, _texts(b"toe")), (b"UNITS", 1, _texts(b"mm")),
        (b"RATE", 1, numbers("f", 4, 50.0)),
        (b"ANALOG", -2, b"\0"), (b"LABELS", 2, _texts(b"Fz", b"EMG")), (b"UNITS", 2, _texts(b"N", b"V")),
        (b"SCALE", 2, numbers("f", 4, 0.25, 3.0)), (b"GEN_SCALE", 2, numbers("f", 4, 0.1)),
        (b"OFFSET", 2, numbers("h", 2, 2048, -7)),
    ):  # fmt: skip
        parameters += _record_of_c3d(*record, order=order)
    header = bytes((2, 80)) + struct.pack(f"{order}5Hf2Hf", 1, 4, 1, 10, 0, 0.5, 4, 2, 50.0)
    frames = b"".join(
        struct.pack(f"{order}8h", 2 * i, 4 * i, -i, -1 if i == 7 else 0, 2048 + i, -7, 2049 + i, -6) for i in range(10)
    )
    return header.ljust(512, b"\0") + (parameters + bytes(2)).ljust(1024, b"\0") + frames


@pytest.mark.parametrize(("order", "kind"), [("<", 84), (">", 86)])
def test_motion_capture_in_integers_is_scaled_as_it_states(tmp_path, order, kind):
    (tmp_path / "a.c3d").write_bytes(_integers(order, kind))
    force = read(tmp_path / "a.c3d", force="Fz")
    np.testing.assert_allclose(force.time, 0.01 * np.arange(20))
    counted = np.stack([np.arange(10), np.arange(10) + 1], 1).ravel()
    np.testing.assert_allclose(force.channels["force", 1], 0.025 * counted)
    with pytest.raises(ValueError, match="must be finite; 1 of 10"):
        read(tmp_path / "a.c3d", displacement="toe.Y")
    marker = read(tmp_path / "a.c3d", acceleration="EMG", sensitivity={"EMG": "0.3 V/g"})
    np.testing.assert_allclose(marker.channels["acceleration", 1], 9.80665 * np.tile([0.0, 1.0], 10))
    (tmp_path / "a.c3d").write_bytes(_integers("<", 85))
    with pytest.raises(ValueError, match="written on a DEC"):
        read(tmp_path / "a.c3d", force="Fz")


def test_more_frames_than_the_header_can_say_are_read(tmp_path):
    header = bytes((2, 80)) + struct.pack("<5Hf2Hf", 1, 0, 1, 0xFFFF, 0, -1.0, 4, 0, 100.0)
    frames = np.zeros((70_000, 4), "<f4")
    frames[:, 0] = np.arange(70_000)
    whole = header.ljust(512, b"\0") + bytes((1, 80, 2, 84)).ljust(1024, b"\0") + frames.tobytes()
    (tmp_path / "a.c3d").write_bytes(whole)
    record = read(tmp_path / "a.c3d", displacement="point 1.X")
    np.testing.assert_array_equal(record.channels["displacement", 1], np.arange(70_000))


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("run.dxd", b"\x01\x02\0\x03\0", "is a Dewesoft file that does not begin as one.*Export it from DewesoftX"),
        ("run.dxz", b"PK\x03\x04\0", "is a packed Dewesoft file.*Export it from DewesoftX"),
        ("run.tdm", b"PK\x03\x04\0", "is a DIAdem file.*TDMS"),
        ("LOG00001.BFL", b"H Product:Blackbox flight data recorder\n\0", "is a Betaflight log.*blackbox_decode"),
        ("run.wfm", b"\0\x0f:WFM#003", "is a file of an oscilloscope.*csv"),
    ],
)
def test_recorders_whose_files_are_not_read_are_named_with_the_way_out(tmp_path, name, content, words):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=words):
        read(tmp_path / name, force="F")


def test_text_under_the_ending_of_a_recorder_is_read_as_text(tmp_path):
    (tmp_path / "run.dxd").write_text("time [s],F [N]\n" + "".join(f"{0.1 * i:.1f},{i}\n" for i in range(12)))
    assert len(read(tmp_path / "run.dxd", force="F")) == 12
