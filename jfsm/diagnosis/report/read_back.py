"""The parts of a diagnosis from the file of its numbers."""

from collections.abc import Mapping
from functools import partial
from typing import Any

from ..._result import Estimate
from ...identification import Mode
from ...structures import Structure
from .._finding import CandidateResult, Finding
from ..evidence.free_runs import ChannelGain, Gain
from ..evidence.plain import made_of
from ..verdict.decision import Decision

_ERRORS = ("before", "refitted", "after", "floor")
_DRAWN = ("shape", "curves")


def fields_of(numbers: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of a `Diagnosis` from what its `to_json` wrote."""
    model = numbers["extended_toml"]
    return dict(
        verdict=numbers["verdict"],
        findings=made_of(tuple[Finding, ...], numbers["findings"]),
        candidates=made_of(tuple[CandidateResult, ...], numbers["candidates"]),
        extended=None if model is None else Structure.from_toml(model),
        refitted=made_of(dict[str, Estimate], numbers["refitted"]),
        gain=_gain(numbers["gain"]),
        detectable={
            cause: Estimate(size["value"], size["value"], size["value"], size["unit"])
            for cause, size in numbers["detectable"].items()
        },
        noise={channel["name"]: channel["noise"] for channel in numbers["record"]["channels"]},
        notes=tuple(numbers["notes"]),
        sentence=numbers["sentence"],
        advice=numbers["advice"],
        told={name: each for name, each in numbers.items() if name not in _DRAWN},
        drawn=partial(_drawn, numbers),
        decision=Decision.of_plain(numbers["decision"]),
        modes=made_of(tuple[Mode, ...], numbers["modes"]),
        finished=numbers["finished"],
        untried=tuple(numbers["untried"]),
    )


def _drawn(numbers: Mapping[str, Any]) -> dict[str, Any]:
    """What was made for pictures only; a function of a module, so that a diagnosis can be pickled."""
    return {name: numbers[name] for name in _DRAWN}


def _gain(written: Mapping[str, Any] | None) -> Gain | None:
    if written is None:
        return None
    beyond_refit = written["beyond_refit"]
    channels = {
        name: ChannelGain(row["unit"], row["spread"], *(row[error] for error in _ERRORS), beyond_refit=beyond_refit)
        for name, row in written["channels"].items()
    }
    low, high = written["interval"]
    errors = {error: written[error] for error in (*_ERRORS, "horizon", "astray")}
    return Gain(**errors, interval=(low, high), beyond_refit=beyond_refit, channels=channels)
