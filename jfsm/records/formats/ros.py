"""ROS 1 and ROS 2 recordings (.bag, .mcap, .db3), through rosbags (an optional extra)."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from jfsm.records.formats.base import AbstractFormat, Contents, Lazy, optional_package

_ENDINGS = {b"#ROSBAG": ".bag", b"\x89MCAP0": ".mcap", b"SQLite format 3": ".db3"}
STANDARD = ("sensor_msgs/", "geometry_msgs/")
UNITS = {  # fields of the standard messages, which are in SI by ROS enhancement proposal 103
    "linear_acceleration": "m/s²",
    "angular_velocity": "rad/s",
    "force": "N",
    "torque": "N m",
}


class RosFormat(AbstractFormat):
    """Numbers of each topic as ``/topic.field.sub``, elements of arrays as ``/topic.field[0]``. Read only.

    The clock of a topic is the sensor's, ``header.stamp``, where its messages have one, else the recorder's; it counts
    from the first message of the recording.
    """

    name: ClassVar[str] = "ROS recording"
    suffixes: ClassVar[tuple[str, ...]] = (".bag", ".mcap", ".db3")

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        for mark, ending in _ENDINGS.items():
            if begins_with.startswith(mark):
                return ending != ".db3" or path.suffix.lower() == ".db3"
        return False

    def load(self, path: Path) -> Contents:
        highlevel: Any = optional_package("rosbags.highlevel", "ros", path)
        with path.open("rb") as stream:
            begins_with = stream.read(16)
        ending = next(ending for mark, ending in _ENDINGS.items() if begins_with.startswith(mark))
        if path.suffix.lower() != ending:
            raise ValueError(f"{path.name} is a ROS recording, which must end in {ending}. Rename it.")
        first: dict[str, Any] = {}
        sensor: set[str] = set()
        notes: list[str] = []
        counts: dict[str, int] = {}
        zero: int | None = None
        for topic, recorded, message in self._messages(highlevel, path, None):
            stamp = _stamp(message)
            zero = min(recorded, zero) if zero is not None else recorded
            counts[topic] = counts.get(topic, 0) + 1
            if topic not in first:
                first[topic] = message
                if stamp:
                    sensor.add(topic)
                    zero = min(zero, stamp)
        names = {name: (topic, field) for topic, message in first.items() for name, field in _numbers(topic, message)}
        if not names or zero is None:
            raise ValueError(f"{path.name} must hold messages with numbers; it holds none. Record the topics again.")
        begins = np.datetime64(zero, "ns")
        cache: dict[str, tuple[np.ndarray, list[Any]]] = {}

        def of_topic(topic: str) -> tuple[np.ndarray, list[Any]]:
            if topic not in cache:
                cache.clear()  # one topic at a time
                taken = [
                    ((_stamp(message) if topic in sensor else recorded) - zero, message)
                    for _, recorded, message in self._messages(highlevel, path, topic)
                ]
                taken.sort(key=lambda pair: pair[0])
                cache[topic] = np.array([at for at, _ in taken]) * 1e-9, [message for _, message in taken]
            return cache[topic]

        def samples(name: str) -> np.ndarray:
            topic, field = names[name]
            return np.array([_value(message, field) for message in of_topic(topic)[1]])

        if sensor:
            notes.append(f"Clocks are those of the sensors (header.stamp) on {', '.join(sorted(sensor)[:4])}.")
        if set(first) - sensor:
            notes.append(f"Clocks are those of the recorder on {', '.join(sorted(set(first) - sensor)[:4])}.")
        units = {
            name: UNITS[part]
            for name, (topic, field) in names.items()
            for part in field.split(".")
            if part in UNITS and getattr(first[topic], "__msgtype__", "").startswith(STANDARD)
        }
        return Contents(
            Lazy(names, samples),
            units,
            clocks=Lazy(names, lambda name: of_topic(names[name][0])[0]),
            notes=tuple(notes),
            begins=begins,
        )

    def _messages(self, highlevel: Any, path: Path, topic: str | None) -> Iterator[tuple[str, int, Any]]:
        """Topic, the recorder's stamp [ns] and message; of one topic, or of all that can be decoded."""
        try:
            with highlevel.AnyReader([path]) as reader:
                wanted = [each for each in reader.connections if topic is None or each.topic == topic]
                for connection, stamp, raw in reader.messages(connections=wanted):
                    yield connection.topic, stamp, reader.deserialize(raw, connection.msgtype)
        except Exception as error:  # whatever the reader stumbles over in bytes that are no such file
            raise ValueError(
                f"{path.name} must be a ROS recording with message definitions; it cannot be read as one ({error}). "
                f"Copy it again, or convert it by `ros2 bag convert` to mcap."
            ) from error


def _stamp(message: Any) -> int:
    """Nanoseconds of the sensor's stamp, 0 without one."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec) if stamp is not None else 0


def _numbers(topic: str, message: Any, before: str = "") -> Iterator[tuple[str, str]]:
    """Name and chain of fields of every number in a message; covariances and headers are left out."""
    for field in getattr(message, "__dataclass_fields__", {}):
        if field.startswith("__") or field == "header" or field.endswith("covariance"):
            continue
        value, chain = getattr(message, field), f"{before}.{field}" if before else field
        if isinstance(value, int | float) and not isinstance(value, bool):
            yield f"{topic}.{chain}", chain
        elif isinstance(value, np.ndarray) and value.dtype.kind in "iuf" and value.size <= 64:
            for place in range(value.size):
                yield f"{topic}.{chain}[{place}]", f"{chain}[{place}]"
        else:
            yield from _numbers(topic, value, chain)


def _value(message: Any, chain: str) -> float:
    """The number at the end of a chain of fields, NaN where an array is too short."""
    chain, _, place = chain.removesuffix("]").partition("[")
    for field in chain.split("."):
        message = getattr(message, field)
    if not place:
        return float(message)
    return float(message[int(place)]) if int(place) < len(message) else float("nan")
