"""Dewesoft files (.dxd, .d7d), through dwdatareader (an optional extra, for it brings a library of the maker)."""

import importlib.util
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from jfsm.records.formats.base import AbstractFormat, Contents, Lazy, left_out, told_apart

_PACKAGE = "dwdatareader"
_READER = Path(__file__).with_name("dewesoft_library.py")
_PATIENCE = {"list": 60.0, "read": 900.0}  # s
_EVEN = 1e-3  # of a step, within which instants are those of an even clock


class DewesoftFormat(AbstractFormat):
    """Channels by their long name, with the unit and clock of each. Read only.

    The maker's library ends the process on many damaged files, so it runs in one of its own.
    """

    name: ClassVar[str] = "Dewesoft"
    suffixes: ClassVar[tuple[str, ...]] = ()

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        return begins_with.startswith(b"MULTI_STREAM_FILE_VER")

    def load(self, path: Path) -> Contents:
        if importlib.util.find_spec(_PACKAGE) is None:
            raise ModuleNotFoundError(
                f"{path.name} is read by the package {_PACKAGE}, which is not installed. Run `pip install "
                f"jfsm[dewesoft]`."
            )
        listed = json.loads(_asked(path, "list"))
        channels = [channel for channel in listed["channels"] if not channel["left_out"]]
        left = [f"{channel['name']} ({channel['left_out']})" for channel in listed["channels"] if channel["left_out"]]
        if not channels:
            raise ValueError(f"{path.name} must hold channels over time; it holds {', '.join(left[:6]) or 'none'}.")
        names, aliases = told_apart([channel["name"] for channel in channels])
        by_name = dict(zip(names, channels, strict=True))
        read: dict[str, np.ndarray] = {}

        def both(name: str) -> np.ndarray:
            if name not in read:
                read[name] = np.frombuffer(_asked(path, "read", by_name[name]["key"])).reshape(2, -1)
            return read[name]

        begins, doubt = _begins(listed)
        return Contents(
            Lazy(names, lambda name: both(name)[1]),
            {name: channel["unit"] for name, channel in by_name.items() if channel["unit"]},
            clocks=Lazy(names, lambda name: _clock(both(name)[0], by_name[name]["rate"])),
            notes=(*left_out(left), *doubt),
            aliases=aliases,
            begins=begins,
        )


def _asked(path: Path, what: str, *more: str) -> bytes:
    """What the maker's library answers, in a process of its own.

    Raises
    ------
    ValueError
        If it does not answer.
    """
    with tempfile.TemporaryDirectory() as folder:
        answer = Path(folder) / "answer"
        command = [sys.executable, "-P", str(_READER), what, str(answer), str(path.resolve()), *more]
        try:
            ran = subprocess.run(command, capture_output=True, timeout=_PATIENCE[what], stdin=subprocess.DEVNULL)
        except subprocess.TimeoutExpired:
            words = f"does not answer within {_PATIENCE[what]:g} s"
        else:
            if ran.returncode == 0 and answer.exists():
                return answer.read_bytes()
            lines = ran.stderr.decode(errors="replace").strip().splitlines() if ran.returncode > 0 else []
            words = f"says: {lines[-1]}" if lines else "ends on it"
    raise ValueError(
        f"{path.name} must be a whole Dewesoft file; the maker's library {words}. It was cut short, is damaged or "
        f"newer than the library: copy it again, or export it from DewesoftX as text or MATLAB."
    )


def _clock(instants: np.ndarray, rate: float) -> np.ndarray:
    """Instants [s] as the library gives them; exactly even ones where they are so but for rounding."""
    if not rate > 0 or not instants.size:
        return instants
    even = instants[0] + np.arange(instants.size) / rate
    return even if np.all(np.abs(instants - even) <= _EVEN / rate) else instants


def _begins(listed: dict[str, Any]) -> tuple[np.datetime64 | None, tuple[str, ...]]:
    """The date at which clocks read zero, where measuring and storing began together."""
    measuring, storing = (np.datetime64(listed[key], "ns") for key in ("measuring", "storing"))
    if abs(measuring - storing) < np.timedelta64(1, "ms"):
        return storing, ()
    return None, (
        f"Measuring began at {measuring}, storing at {storing} (UTC); from which of them the clocks count is not "
        f"stated, and no date is kept. State it by record.dated(...).",
    )
