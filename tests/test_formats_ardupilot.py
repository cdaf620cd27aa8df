"""Logs of ArduPilot, made here after the description of the format."""

import struct

import numpy as np
import pytest

from jfsm.records import read
from jfsm.records.formats.ardupilot import ArduPilotFormat

N = 50
T = 2.0 + 0.0025 * np.arange(N)
A = 9.0 * np.sin(30 * T)
ANGLE = 12.34 * np.cos(5 * T)


def _message(number: int, body: bytes) -> bytes:
    return b"\xa3\x95" + bytes([number]) + body


def _layout(number: int, name: str, letters: str, fields: str, size: int) -> bytes:
    body = struct.pack("<BB4s16s64s", number, size + 3, name.encode(), letters.encode(), fields.encode())
    return _message(128, body)


def log(sensors: int = 1, sampled: bool = False) -> bytes:
    """Accelerations of some sensors and an angle in hundredths, with units and multipliers."""
    head = _layout(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns", 86)
    head += _layout(1, "UNIT", "QbZ", "TimeUS,Id,Label", 73) + _layout(2, "MULT", "Qbd", "TimeUS,Id,Mult", 17)
    head += _layout(3, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds", 41)
    head += _layout(10, "IMU", "QQBfh", "TimeUS,SampleUS,I,AccX,Raw", 23)
    head += _layout(11, "ATT", "Qcc", "TimeUS,Roll,Pitch", 12)
    for letter, label in ((b"s", b"s"), (b"o", b"m/s/s"), (b"d", b"deg"), (b"n", b"m/s"), (b"#", b"instance")):
        head += _message(1, struct.pack("<Qc64s", 0, letter, label))
    for letter, size in ((b"F", 1e-6), (b"B", 1e-2), (b"C", 1e-3), (b"-", 0.0)):
        head += _message(2, struct.pack("<Qcd", 0, letter, size))
    head += _message(3, struct.pack("<QB16s16s", 0, 10, b"ss#on", b"FF--C"))
    head += _message(3, struct.pack("<QB16s16s", 0, 11, b"sd-", b"FBB"))
    for t, a, angle in zip(T, A, ANGLE, strict=True):
        stamp = round(t * 1e6)
        for i in range(sensors):
            late = stamp - 500 if sampled else 0
            head += _message(10, struct.pack("<QQBfh", stamp, late, i, a * (i + 1), round(1000 * a)))
        head += _message(11, struct.pack("<Qhh", stamp, round(100 * angle), round(100 * angle)))
    return head


def test_units_and_multipliers_of_the_log_count(tmp_path):
    (tmp_path / "flight.bin").write_bytes(log())
    record = read(tmp_path / "flight.bin", acceleration="IMU.AccX")
    np.testing.assert_allclose(record.channels["acceleration", 1], A, rtol=1e-6)
    np.testing.assert_allclose(record.time, T, atol=1e-9)
    speed = read(tmp_path / "flight.bin", velocity="IMU.Raw")  # millimetres in 16 bits
    np.testing.assert_allclose(speed.channels["velocity", 1], A, atol=6e-4)
    angle = read(tmp_path / "flight.bin", displacement="ATT.Roll")  # the multiplier of its letter is not taken twice
    np.testing.assert_allclose(np.degrees(angle.channels["displacement", 1]), ANGLE, atol=6e-3)
    implied = read(tmp_path / "flight.bin", displacement="ATT.Pitch", units={"ATT.Pitch": "deg"})
    np.testing.assert_allclose(np.degrees(implied.channels["displacement", 1]), ANGLE, atol=6e-3)


def test_sensors_are_apart_and_on_the_clock_of_the_sensor(tmp_path):
    (tmp_path / "flight.bin").write_bytes(log(2, sampled=True))
    record = read(tmp_path / "flight.bin", acceleration="IMU[1].AccX")
    np.testing.assert_allclose(record.channels["acceleration", 1], 2 * A, rtol=1e-6)
    np.testing.assert_allclose(record.time, T - 5e-4, atol=1e-9)
    with pytest.raises(ValueError, match=r"'IMU\[0\].AccX' or 'IMU\[1\].AccX'"):
        read(tmp_path / "flight.bin", acceleration="IMU.AccX")
    with pytest.raises(ValueError, match="one clock"):
        read(tmp_path / "flight.bin", acceleration="IMU[0].AccX", displacement="ATT.Roll")


def test_bytes_that_are_no_message_and_a_cut_end_are_told(tmp_path):
    whole = log()
    at = whole.rindex(b"\xa3\x95\x0b", 0, len(whole) // 2)
    (tmp_path / "flight.bin").write_bytes(whole[:at] + b"\0\0\0" + whole[at + 3 : -5])
    record = read(tmp_path / "flight.bin", displacement="ATT.Roll")
    assert len(record) == N - 2
    assert any("belong to no message" in note for note in record.notes)
    assert any("ends within a message" in note for note in record.notes)
    (tmp_path / "flight.bin").write_bytes(whole[:89])
    with pytest.raises(ValueError, match="must hold messages with numbers"):
        read(tmp_path / "flight.bin", displacement="ATT.Roll")


def test_it_is_told_by_its_first_bytes(tmp_path):
    assert ArduPilotFormat().recognises(log()[:4096], tmp_path / "x.dat")
    assert not ArduPilotFormat().recognises(b"\xa3\x95\x10", tmp_path / "x.bin")
