"""Whether a diagnosis comes out the same when it is made again."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from ..records import Record, fingerprint, records_of
from ..reporting import read_diagnosis
from ..structures import Structure, causes
from ._diagnose import diagnose
from ._provenance import computed_with, jfsm_version, key_of, model_fingerprint
from .search.steps import Progress

OF_INTERVAL = 0.05
"""Difference of a size that counts as none on another machine, as a share of the width of its 95 % interval."""
NATS = 0.1
"""Difference of an evidence that counts as none on another machine: odds that differ by a tenth."""
_REPEATED = ("verdict", "findings", "candidates", "refitted", "modes", "gain", "detectable", "decision", "evidence")
"""What is compared bit for bit: all that is computed, but for what is drawn."""


class Compared(NamedTuple):
    """One thing that was compared, whether it is the same, and the difference in words."""

    what: str
    same: bool
    says: str


@dataclass(frozen=True)
class Verification:
    """What a repeated diagnosis has in common with the one that was written.

    Attributes
    ----------
    same : bool
        Whether everything is: bit for bit where it was made by the same packages on the same kind of machine, else
        within the tolerances.
    exact : bool
        Whether every number is the same to the last bit.
    compared : tuple of Compared
        Input, model, version, verdict, sizes and evidence, each by itself.
    """

    same: bool
    exact: bool
    compared: tuple[Compared, ...]

    def __str__(self) -> str:
        head = "The same, bit for bit." if self.exact and self.same else "The same." if self.same else "Not the same."
        return "\n".join([head, *(f"  {'✓' if c.same else '✗'} {c.what}: {c.says}" for c in self.compared)])

    def print(self) -> None:
        """The outcome on the terminal."""
        print(self)


def verify(
    numbers: str | Path,
    record: Record | Sequence[Record],
    model: Any = None,
    *,
    holdout: Record | Sequence[Record] | None = None,
    simulated: Record | Sequence[Record] | None = None,
    progress: Progress | bool | None = None,
) -> Verification:
    """Whether `diagnose` gives again what was written, from the same records with the same settings and key.

    Parameters
    ----------
    numbers : path
        What `Diagnosis.to_json` wrote.
    record : Record or sequence of them
        The records that were diagnosed, in their order. Others are told by their fingerprints, and nothing is repeated.
    model : Structure, Simulation or Simulation.from_runs(...), optional
        The model, where the file does not hold it as text: where it has a function or a map.
    holdout, simulated : Record or sequence of them, optional
        The records that were held out and the runs of the simulation, where there were any.
    progress : callable or bool, optional
        As for `diagnose`.

    Returns
    -------
    Verification
        A size may differ by 5 % of the width of its 95 % interval and an evidence by 0.1 nats where another version of
        jfsm or of the packages under it, or another machine made the file; else every number must be the same to the
        last bit.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it holds no diagnosis with its provenance, one that was ended before it was finished, or one whose model or
        held-out records have to be given and are not.

    Examples
    --------
    >>> jfsm.verify("run7.json", jfsm.read("run7.csv", force="u", displacement="y")).print()  # doctest: +SKIP
    """
    written = read_diagnosis(numbers)
    made = _provenance(written, numbers)
    parts = {"record": records_of(record), "held-out record": _given(holdout), "simulated run": _given(simulated)}
    inputs = [*_inputs(made, parts, numbers), *_model(made, model)]
    if not all(compared.same for compared in inputs):
        return Verification(False, False, tuple(inputs))
    settings = {**made["settings"], "time_limit": None}
    if settings["holdout"] == "records":
        settings["holdout"] = parts["held-out record"]
    if settings["places"] is not None:
        settings["places"] = [tuple(place) for place in settings["places"]]
    again = diagnose(
        parts["record"],
        _believed(made, model, numbers),
        key=key_of(made["key"]),
        simulated=parts["simulated run"] or None,
        progress=progress,
        **settings,
    )
    return compare(written, again.told, inputs)


def compare(written: Mapping[str, Any], again: Mapping[str, Any], inputs: Sequence[Compared] = ()) -> Verification:
    """What two diagnoses as dictionaries have in common; `inputs` is what was compared before."""
    made = written["provenance"]
    alike = made["jfsm"] == jfsm_version() and _same(made["computed_with"], dict(computed_with()))
    exact = all(_same(written[name], again[name]) for name in _REPEATED)
    by = Compared("made by", True, _made_by(made, alike=alike))
    outcomes = (_verdicts(written, again), _sizes(written, again), _evidence(written, again))
    close = all(compared.same for compared in (*inputs, *outcomes))
    bits = Compared("every number", exact or not alike, "the same to the last bit" if exact else "not all to the bit")
    return Verification(close and bits.same, exact, (*inputs, by, *outcomes, bits))


def _made_by(made: Mapping[str, Any], *, alike: bool) -> str:
    if alike:
        return f"jfsm {made['jfsm']} with the same packages on the same kind of machine, so bit for bit"
    now = {"jfsm": jfsm_version(), **dict(computed_with())}
    before = {"jfsm": made["jfsm"], **made["computed_with"]}
    changed = ", ".join(f"{name} {before.get(name)} → {now[name]}" for name in now if before.get(name) != now[name])
    return f"{changed}; so sizes to {OF_INTERVAL:.0%} of their intervals, evidence to {NATS:g} nats"


def _provenance(written: Mapping[str, Any], path: str | Path) -> Mapping[str, Any]:
    """Where a diagnosis comes from, if it can be made again from that."""
    if "provenance" not in written:
        raise ValueError(
            f"{path} must say what it was made of; the version of jfsm that wrote it ({written.get('jfsm')}) did not "
            "yet. Diagnose the record again with --json."
        )
    if not written["finished"]:
        raise ValueError(f"{path} holds a diagnosis that was ended before it was finished, which comes out the same "
                         "by chance only. Diagnose the record again without `time_limit`.")  # fmt: skip
    return written["provenance"]


def _given(records: Record | Sequence[Record] | None) -> list[Record]:
    return [] if records is None else records_of(records)


def _inputs(made: Mapping[str, Any], parts: Mapping[str, list[Record]], path: str | Path) -> Iterator[Compared]:
    """Records beside those that were diagnosed."""
    stated = zip(parts.items(), (made["records"], made["holdout"], made["simulated"]), strict=True)
    for (what, given), known in stated:
        if len(given) != len(known):
            raise ValueError(f"{path} was made with {len(known)} {what}s; got {len(given)}. Give each, in their order.")
        for place, (record, one) in enumerate(zip(given, known, strict=True), start=1):
            found = fingerprint(record)
            same = found == one["sha256"]
            says = f"sha256 {found[:12]}…" if same else f"another one: sha256 {found[:12]}…, not {one['sha256'][:12]}…"
            yield Compared(what if len(known) == 1 else f"{what} {place}", same, says)


def _model(made: Mapping[str, Any], model: Any) -> Iterator[Compared]:
    """The model that is given beside the one that was diagnosed with."""
    if model is not None:
        same = model_fingerprint(model) == made["model"]["sha256"]
        yield Compared("model", same, "as in the file" if same else "another one than in the file")


def _believed(made: Mapping[str, Any], model: Any, path: str | Path) -> Any:
    unknown = [name for name in made["settings"]["causes"] or () if name not in causes()]
    if unknown:
        raise ValueError(f"{path} was made with a cause of its own, {unknown[0]}, which it does not hold.")
    if model is not None or made["model"]["sha256"] is None:
        return model
    if made["model"]["toml"] is None:
        raise ValueError(f"`model` must be given: {path} does not hold it, for a function or a map has no text.")
    return Structure.from_toml(made["model"]["toml"])


def _verdicts(written: Mapping[str, Any], again: Mapping[str, Any]) -> Compared:
    before, now = _named(written), _named(again)
    return Compared("verdict", before == now, now if before == now else f"{before} in the file, {now} now")


def _named(d: Mapping[str, Any]) -> str:
    """A verdict with its causes and places."""
    found = ", ".join(f"{f['cause']}@{'-'.join(map(str, f['at']))}" for f in d["findings"])
    return f"{d['verdict']} ({found})" if found else d["verdict"]


def _sizes(written: Mapping[str, Any], again: Mapping[str, Any]) -> Compared:
    before, now = dict(_estimates(written)), dict(_estimates(again))
    if before.keys() != now.keys():
        return Compared("sizes", False, "not the same numbers were estimated")
    worst = max((_apart(before[name], now[name]) for name in before), default=0.0)
    return Compared("sizes", worst <= OF_INTERVAL, f"{_amount(worst)} of the width of an interval apart at most")


def _estimates(d: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    for place, finding in enumerate(d["findings"]):
        for name, estimate in finding["parameters"].items():
            yield f"{place} {finding['cause']}.{name}", estimate
    yield from d["refitted"].items()


def _apart(one: Mapping[str, Any], other: Mapping[str, Any]) -> float:
    """How far two estimates are apart, in widths of the interval of the first."""
    width = (one["high"] or 0.0) - (one["low"] or 0.0)
    apart = max(abs((one[name] or 0.0) - (other[name] or 0.0)) for name in ("value", "low", "high"))
    return apart / width if width > 0 else (0.0 if apart == 0.0 else math.inf)


def _evidence(written: Mapping[str, Any], again: Mapping[str, Any]) -> Compared:
    before, now = ({(c["cause"], str(c["at"])): c["evidence"] for c in d["candidates"]} for d in (written, again))
    if before.keys() != now.keys():
        return Compared("evidence", False, "not the same candidates were fitted")
    worst = max((abs((before[one] or 0.0) - (now[one] or 0.0)) for one in before), default=0.0)
    return Compared("evidence", worst <= NATS, f"{_amount(worst)} nats apart at most")


def _amount(value: float) -> str:
    return "0" if value == 0.0 else f"{value:.1g}"


def _same(one: Any, other: Any) -> bool:
    """Whether two plain values are the same, a list for a tuple, as JSON has them."""
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(_same(one[name], other[name]) for name in one)
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        return len(one) == len(other) and all(map(_same, one, other))
    return one == other
