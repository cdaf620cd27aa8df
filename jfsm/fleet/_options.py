"""The options of a batch: those of `read` for its files, and those of `diagnose` for every record."""

import difflib
import hashlib
import json
from collections.abc import Mapping, Sequence
from typing import Any, TypedDict

import jax

from ..diagnosis import check_settings, held_records, key_of, plain_input, plain_key, plain_settings
from ..plant import Reconstruction
from ..records import READ, Reading, Record, as_instant
from ..records.formats.lookup import ChannelName
from ..structures import Cause, check_places


class Options(TypedDict, total=False):
    """Options of `diagnose`, for every record, and of `read`, for files."""

    holdout: float | Record | Sequence[Record] | None
    causes: Sequence[str | Cause] | None
    max_causes: int
    key: jax.Array | None
    since: float | None
    until: float | None
    places: Sequence[tuple[int, int]] | None
    reconstruction: Reconstruction | None
    time_limit: float | None
    time: str | None
    force: ChannelName
    displacement: ChannelName
    velocity: ChannelName
    acceleration: ChannelName
    base_acceleration: str | None
    units: Mapping[str, str] | None
    sensitivity: Mapping[str, str] | None
    rate: float | None
    where: Mapping[str, str | float] | None
    run: int | str | None
    sheet: int | str | None
    at_rest: bool | None
    drive: str | None
    resample: float | str | None
    every: int | None


_OF_READING = (*READ, "resample", "every")
_DEFAULTS: dict[str, Any] = {
    "holdout": 0.3, "causes": None, "max_causes": 2, "key": None, "since": None, "until": None, "places": None,
    "reconstruction": None, "time_limit": None,
}  # fmt: skip
"""Of `diagnose`."""


class Settings(dict[str, Any]):
    """Arguments of `diagnose` that go to every record, the key as plain types, so that they travel to any process."""

    @classmethod
    def of(cls, **options: Any) -> "Settings":
        """Those that are given, and the defaults of `diagnose` for the others."""
        settings = cls({name: options.get(name, default) for name, default in _DEFAULTS.items()})
        check_settings(*(settings[name] for name in ("causes", "max_causes", "key", "reconstruction", "time_limit")))
        held_records(settings["holdout"])
        check_places(settings["places"])
        for name in ("since", "until"):
            if settings[name] is not None:
                as_instant(name, settings[name])
        if settings["key"] is not None:
            settings["key"] = plain_key(settings["key"])
        return settings

    @property
    def arguments(self) -> dict[str, Any]:
        """As `diagnose` takes them."""
        key = self["key"]
        return {**self, "key": None if key is None else key_of(key)}

    @property
    def fingerprint(self) -> str:
        """SHA-256 of what tells settings apart, held-out records by their content."""
        others = {name: value for name, value in self.items() if name != "key"}
        held = self["holdout"]
        records = [] if held is None or isinstance(held, int | float) else held
        told = {
            **plain_settings(**others),
            "key": self["key"],
            "held": [plain_input(one)["sha256"] for one in ([records] if isinstance(records, Record) else records)],
        }
        return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()


def sorted_options(options: Mapping[str, Any]) -> tuple[Reading, Settings]:
    """How files are read, and how records are diagnosed.

    Raises
    ------
    TypeError
        If there is no such option.
    """
    for name in options:
        if name not in Options.__annotations__:
            near = difflib.get_close_matches(name, Options.__annotations__, 1)
            meant = f" Did you mean {near[0]}?" if near else ""
            raise TypeError(f"`diagnose_many` takes the options of `diagnose` and of `read`, not {name!r}.{meant}")
    reading = Reading({name: options[name] for name in _OF_READING if options.get(name) is not None})
    return reading, Settings.of(**{name: options[name] for name in _DEFAULTS if name in options})
