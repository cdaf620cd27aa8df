"""Plain dictionaries for the page and for JSON."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from ...identification import Nuisances
from ...records import Record
from ...structures import AbstractTerm, Structure
from ..evidence.free_runs import Gain
from ..evidence.missing_force import Residual, curves
from ..evidence.plain import as_plain
from .force_shape import shape_of
from .residual_signals import course

_SHOWN = 2000
"""Points of a curve in the report."""


@dataclass(frozen=True)
class Drawn:
    """Everything that pages draw, computed when it is called.

    This is the missing force of a record of some `period`, the law `term` that explains it, runs over held-out
    readings, and with `with_shape` the force's shape in words.
    """

    missing: Residual
    runs: list[dict]
    term: AbstractTerm | None
    record: Record
    period: float
    with_shape: bool

    def __call__(self) -> dict[str, Any]:
        shape, start = shape_of(self.missing) if self.with_shape else None, float(self.record.time[0])
        return {
            "shape": None if shape is None else {**as_plain(shape._asdict(), lossless=False), "words": shape.words},
            "curves": {
                "holdout": _plain_runs(self.runs),
                **curves(self.missing, self.record.units, self.term),
                "course": course(self.missing, start, self.record.dt, self.period),
            },
        }


def jfsm_version() -> str:
    """The installed version of jfsm."""
    try:
        return version("jfsm")
    except PackageNotFoundError:  # run from a source tree that is not installed
        return "unknown"


def written_model(model: Structure) -> str | None:
    """A structure as the text of its file; None where it holds a map or a function, which are no text."""
    try:
        return model.to_toml()
    except ValueError:
        return None


def plain_record(records: Sequence[Nuisances]) -> dict[str, Any]:
    """Length, channels and noise of the first of the records, with the samples of all."""
    first = records[0]
    record = first.record
    channels = [
        {"name": f"{kind} {j}", "unit": record.units[kind], "rms": float(s), "noise": float(f)}
        for (kind, j), s, f in zip(first.channels, first.spread, first.floor, strict=True)
    ]
    return {
        "name": record.name,
        "samples": sum(n.samples for n in records),
        "sample_rate": 1 / record.dt,
        "duration": record.duration,
        "channels": channels,
    }


def plain_gain(gain: Gain | None) -> dict[str, Any] | None:
    """Errors on held-out readings, in all and by channel; None where nothing was held out."""
    if gain is None:
        return None
    channels = {}
    for name, c in gain.channels.items():
        row = {"unit": c.unit, "spread": c.spread, "closed": c.closed}
        for key in ("before", "refitted", "after", "floor"):
            row[key], row[f"{key}_nrmse"] = getattr(c, key), getattr(c, key) / c.spread
        channels[name] = row
    return {
        "closed": gain.closed,
        "interval": list(gain.interval),
        "significant": gain.significant,
        "before": gain.before,
        "refitted": gain.refitted,
        "after": gain.after,
        "floor": gain.floor,
        "beyond_refit": gain.beyond_refit,
        "horizon": gain.horizon,
        "astray": gain.astray,
        "channels": channels,
    }


def _plain_runs(runs: list[dict]) -> dict[str, Any] | None:
    """The first held-out record with the runs over it, before and after; None where nothing was held out."""
    if not runs:
        return None
    record, before, after = (runs[0][k] for k in ("record", "before", "after"))
    take = slice(0, _SHOWN)
    channels = {
        f"{c[0]} {c[1]}": {
            "unit": record.units[c[0]],
            "measured": _finite(y[take]),
            "before": _finite(before[c][take]),
            "after": _finite(after[c][take]),
        }
        for c, y in record.answers.items()
    }
    return {"time": _finite(record.time[take]), "channels": channels}


def _finite(values) -> list:
    """Values as a list; None in place of those that are not finite, which JSON does not have."""
    return [float(v) if math.isfinite(v) else None for v in np.asarray(values).ravel()]
