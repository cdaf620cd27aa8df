"""The effects that the records of a batch show: the same one in several, with its size over them."""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ._outcome import Row
from ._spread import spread_of

_HALF = 1.959964
"""Standard errors in half a 95 % interval."""
_MAY_BE = 0.1
"""Probability from which a law of an open class may be the law of another record."""


class _Seen(NamedTuple):
    """A finding of a record."""

    record: str
    finding: Mapping[str, Any]

    @property
    def laws(self) -> set[str]:
        """The cause, and where its law is open what it may be instead."""
        members = self.finding.get("members") or {}
        open_to = {cause for cause, share in members.items() if share >= _MAY_BE}
        return {self.finding["cause"], *(open_to if self.finding.get("law_open") else ())}


@dataclass
class _Group:
    """Findings at one place that may be of one law."""

    at: tuple
    seen: list[_Seen] = field(default_factory=list)

    @property
    def laws(self) -> set[str]:
        return set().union(*(one.laws for one in self.seen))


def effects_of(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """What the records show, the most frequent effect first, as plain types.

    Findings at one place are one effect where their laws may be the same. Its `sizes` are those of the parameters if
    all records name one law, else the size that all laws of the class share; each with mean, spread between records,
    and the records that stand out, as `spread_of` has them.
    """
    groups = list[_Group]()
    for row in rows:
        for finding in row["findings"]:
            _put(groups, tuple(map(_hashable, finding["at"] or ())), _Seen(row["name"], finding))
    found = [_effect(group) for group in groups]
    return sorted(found, key=lambda effect: -len(effect["records"]))


def _put(groups: list[_Group], at: tuple, seen: _Seen) -> None:
    """Add a finding to the groups that may be of its law, which are one then."""
    akin = [group for group in groups if group.at == at and group.laws & seen.laws]
    groups[:] = [group for group in groups if group not in akin]
    groups.append(_Group(at, [*(one for group in akin for one in group.seen), seen]))


def _effect(group: _Group) -> dict[str, Any]:
    causes = Counter(one.finding["cause"] for one in group.seen)
    one_law = len(causes) == 1 and not any(one.finding.get("law_open") for one in group.seen)
    return {
        "cause": causes.most_common(1)[0][0],
        "causes": dict(causes),
        "kind": "" if one_law else _kind(group.seen),
        "at": _listed(group.at),
        "records": list(dict.fromkeys(one.record for one in group.seen)),
        "sizes": list(_sizes(group.seen, one_law=one_law)),
    }


def _kind(seen: Sequence[_Seen]) -> str:
    """The class of a law that is open, or differs between records; empty where no finding has one."""
    open_kinds = Counter(one.finding.get("kind") or "" for one in seen if one.finding.get("law_open"))
    kinds = open_kinds or Counter(one.finding.get("kind") or "" for one in seen)
    return kinds.most_common(1)[0][0]


def _sizes(seen: Iterable[_Seen], *, one_law: bool) -> Iterator[dict[str, Any]]:
    """Every size of an effect over the records, those with units apart from one another."""
    values: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for record, finding in seen:
        shared = {} if finding.get("size") is None else {"size": finding["size"]}
        for name, estimate in (finding["parameters"] if one_law else shared).items():
            if _is_whole(estimate):
                bounds = {bound: estimate[bound] for bound in ("value", "low", "high")}
                values.setdefault((name, estimate["unit"]), []).append({"record": record, **bounds})
    for (name, unit), each in values.items():
        yield {"parameter": name, "unit": unit, **_spread(each)}


def _spread(values: list[dict[str, Any]]) -> dict[str, Any]:
    found = spread_of(
        np.array([one["value"] for one in values]),
        np.array([(one["high"] - one["low"]) / (2 * _HALF) for one in values]),
    )
    numbers = {name: _number(getattr(found, name)) for name in found._fields[:6]}
    each = [{**one, "distance": _number(far)} for one, far in zip(values, found.distance, strict=True)]
    return {**numbers, "outliers": [values[place]["record"] for place in found.outliers], "values": each}


def _is_whole(estimate: Mapping[str, Any]) -> bool:
    """Whether a size has a value and an interval, which an end at a bound may not have."""
    return all(isinstance(estimate[name], int | float) and math.isfinite(estimate[name]) for name in
               ("value", "low", "high"))  # fmt: skip


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _hashable(part: Any) -> Any:
    return tuple(map(_hashable, part)) if isinstance(part, list | tuple) else part


def _listed(part: Any) -> Any:
    return list(map(_listed, part)) if isinstance(part, tuple) else part
