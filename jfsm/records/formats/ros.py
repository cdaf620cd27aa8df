"""ROS 1 and ROS 2 recordings (.bag, .mcap, .db3), through rosbags (an optional extra)."""

import math
from collections import Counter
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
        return _Recording(highlevel, path).contents()


class _Recording:
    """A recording whose topics were looked through once; samples are read topic by topic.

    `first` holds the first message of each topic, `sensor` the topics that have the sensor's stamps, `zero` the first
    of all stamps [ns].
    """

    def __init__(self, highlevel: Any, path: Path):
        self._highlevel, self._path = highlevel, path
        self.first: dict[str, Any] = {}
        self.sensor: set[str] = set()
        self._announced: dict[str, int] = {}
        counted, zero = Counter[str](), math.inf
        for topic, recorded, message in self._messages(None):
            zero = min(recorded, zero)
            counted[topic] += 1
            if topic in self.first:
                continue
            self.first[topic] = message
            if stamp := _stamp(message):
                self.sensor.add(topic)
                zero = min(stamp, zero)
        self.names = {
            name: (topic, field) for topic, message in self.first.items() for name, field in _numbers(topic, message)
        }
        if not self.names:
            raise ValueError(f"{path.name} must hold messages with numbers; it holds none. Record the topics again.")
        self.zero = int(zero)
        self._missing = {
            topic: announced - counted[topic]
            for topic, announced in self._announced.items()
            if announced != counted[topic]
        }
        self._read: dict[str, tuple[np.ndarray, list[Any]]] = {}

    def contents(self) -> Contents:
        """Every number with its unit, on the clock of its topic."""
        return Contents(
            Lazy(self.names, self._samples),
            {name: unit for name in self.names if (unit := self._unit(name))},
            clocks=Lazy(self.names, lambda name: self._topic(self.names[name][0])[0]),
            notes=tuple(self._notes()),
            begins=np.datetime64(self.zero, "ns"),
        )

    def _samples(self, name: str) -> np.ndarray:
        topic, field = self.names[name]
        return np.array([_value(message, field) for message in self._topic(topic)[1]])

    def _topic(self, topic: str) -> tuple[np.ndarray, list[Any]]:
        """Instants [s] and messages of a topic, in the order of its stamps."""
        if topic not in self._read:
            self._read.clear()  # one topic at a time
            taken = [
                ((_stamp(message) if topic in self.sensor else recorded) - self.zero, message)
                for _, recorded, message in self._messages(topic)
            ]
            taken.sort(key=lambda pair: pair[0])
            self._read[topic] = np.array([at for at, _ in taken]) * 1e-9, [message for _, message in taken]
        return self._read[topic]

    def _unit(self, name: str) -> str | None:
        topic, field = self.names[name]
        if not getattr(self.first[topic], "__msgtype__", "").startswith(STANDARD):
            return None
        return next((UNITS[part] for part in reversed(field.split(".")) if part in UNITS), None)

    def _notes(self) -> Iterator[str]:
        for topic, missing in self._missing.items():
            yield f"{topic} announces {missing} more messages than can be read: the recording is damaged."
        if self.sensor:
            yield f"Clocks are those of the sensors (header.stamp) on {', '.join(sorted(self.sensor)[:4])}."
        if others := set(self.first) - self.sensor:
            yield f"Clocks are those of the recorder on {', '.join(sorted(others)[:4])}."

    def _messages(self, topic: str | None) -> Iterator[tuple[str, int, Any]]:
        """Topic, the recorder's stamp [ns] and message; of one topic, or of all that can be decoded."""
        try:
            with self._highlevel.AnyReader([self._path]) as reader:
                wanted = [each for each in reader.connections if topic is None or each.topic == topic]
                self._announced = dict.fromkeys((each.topic for each in wanted), 0)
                for each in wanted:
                    self._announced[each.topic] += each.msgcount
                for connection, stamp, raw in reader.messages(connections=wanted):
                    yield connection.topic, stamp, reader.deserialize(raw, connection.msgtype)
        except Exception as error:  # whatever the reader stumbles over in bytes that are no such file
            raise ValueError(
                f"{self._path.name} must be a ROS recording with message definitions; it cannot be read as one "
                f"({error}). Copy it again, or convert it by `ros2 bag convert` to mcap."
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
