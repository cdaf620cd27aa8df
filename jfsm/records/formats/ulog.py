"""Flight logs of PX4 (.ulg), through pyulog (an optional extra)."""

import contextlib
import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from jfsm.records.formats.base import AbstractFormat, Contents, Lazy, optional_package

MICROSECOND = 1e-6
_HEADER, _KINDS = 16, b"BFIMPQARDLCSO"  # bytes ahead of the messages, and their kinds
CLOCKS = ("timestamp_sample", "timestamp")  # when the sensor read, when the message was sent
# Fields of PX4's messages and their units, by its definitions.
_UNITS = (
    (r"sensor_accel(?:_fifo)?\.[xyz]|.*_m_s2(?:\[\d+\])?|vehicle_acceleration\.xyz\[\d\]", "m/s²"),
    (r"sensor_gyro(?:_fifo)?\.[xyz]|.*gyro_rad(?:\[\d+\])?|vehicle_angular_velocity\.xyz\[\d\]", "rad/s"),
    (r"vehicle_local_position\.[xyz]|distance_sensor\.current_distance", "m"),
    (r"vehicle_local_position\.v[xyz]|.*_m_s(?:\[\d+\])?", "m/s"),
    (r"vehicle_local_position\.a[xyz]", "m/s²"),
)


class UlogFormat(AbstractFormat):
    """Fields of each topic as ``topic.field``, of its second instance ``topic_1.field``. Read only.

    The clock of a topic is that of the sensor (`timestamp_sample`) where it has one, else of the message; it counts
    from the start of the log.
    """

    name: ClassVar[str] = "PX4 log"
    suffixes: ClassVar[tuple[str, ...]] = (".ulg",)

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        return begins_with.startswith(b"ULog\x01\x125")

    def load(self, path: Path) -> Contents:
        log = _opened(path)
        topics = {f"{each.name}{f'_{each.multi_id}' if each.multi_id else ''}": each.data for each in log.data_list}
        fields = {
            f"{topic}.{field}": (topic, field)
            for topic, data in topics.items()
            for field, values in data.items()
            if field not in CLOCKS and values.dtype.kind in "iufb" and len(values) > 1
        }
        if not fields:
            raise ValueError(f"{path.name} must hold topics with numbers; it holds none. Log them, or copy it again.")
        orders = {topic: np.argsort(_stamps(topics[topic]), kind="stable") for topic, _ in fields.values()}

        def samples(name: str) -> np.ndarray:
            topic, field = fields[name]
            return topics[topic][field][orders[topic]]

        def clock(name: str) -> np.ndarray:
            topic = fields[name][0]
            stamps = _stamps(topics[topic])[orders[topic]].astype(np.int64)
            return (stamps - int(log.start_timestamp)) * MICROSECOND

        units = {name: unit for name, (topic, field) in fields.items() if (unit := _unit(topic, field))}
        return Contents(
            Lazy(fields, samples),
            units,
            clocks=Lazy(fields, clock),
            notes=(*_notes(log, topics, orders), *_of_damage(path)),
        )


def _opened(path: Path) -> Any:
    pyulog: Any = optional_package("pyulog", "px4", path)
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # it prints what it stumbles over
            log = pyulog.ULog(str(path))
    except Exception as error:  # whatever the reader stumbles over in bytes that are no such file
        raise ValueError(
            f"{path.name} must be a PX4 log; it cannot be read as one ({error}), and may be cut short. Copy it again."
        ) from error
    if log.file_corruption:
        raise ValueError(
            f"{path.name} must be a whole PX4 log; parts of it cannot be read. Copy it again, or cut out what can be "
            f"read by `ulog2csv`."
        )
    return log


def _stamps(data: dict[str, np.ndarray]) -> np.ndarray:
    """The stamps [µs] of a topic: of the sensor, unless it has none."""
    return next(data[name] for name in CLOCKS if name in data and np.all(data[name] > 0) or name == CLOCKS[-1])


def _notes(log: Any, topics: dict[str, dict[str, np.ndarray]], orders: dict[str, np.ndarray]) -> list[str]:
    notes = []
    sensed = [topic for topic in orders if _stamps(topics[topic]) is topics[topic].get(CLOCKS[0])]
    if sensed:
        notes.append(f"Clocks are those of the sensors ({CLOCKS[0]}) on {', '.join(sensed[:4])}.")
    mixed = [topic for topic, order in orders.items() if np.any(np.diff(order) != 1)]
    if mixed:
        notes.append(f"Messages were not in the order of their stamps, and are put in it, on {', '.join(mixed[:4])}.")
    lost = sum(dropout.duration for dropout in log.dropouts)
    if lost:
        notes.append(f"The logger dropped messages {len(log.dropouts)} times, for {lost} ms in all; the gaps are kept.")
    return notes


def _of_damage(path: Path) -> Iterator[str]:
    """What is amiss in the chain of messages: the reader passes over it."""
    data, place = path.read_bytes(), _HEADER
    while place < len(data):
        head = data[place : place + 3]
        size = int.from_bytes(head[:2], "little")
        if len(head) < 3 or place + 3 + size > len(data):
            yield f"The log ends within a message, {len(data) - place} bytes before its end: it was cut short."
            return
        if head[2] not in _KINDS:
            yield f"The log is damaged from byte {place} on; what cannot be made out behind is missing."
            return
        place += 3 + size


def _unit(topic: str, field: str) -> str:
    whole = f"{re.sub(r'_[0-9]+$', '', topic)}.{field}"
    return next((unit for pattern, unit in _UNITS if re.fullmatch(pattern, whole)), "")
