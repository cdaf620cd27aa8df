"""What a batch found, in words: one verdict on all of its records."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from jfsm.reporting._quantities import interval, percent, quantity
from jfsm.reporting._wording import VERDICTS, capitalised, cause_name, listed, place_name

Dictionary = Mapping[str, Any]

MOST_EFFECTS, MOST_NAMES = 3, 4  # that one sentence names


def batch_sentence(d: Dictionary) -> str:
    """Which effects the records have in common, how large they are, how they spread, and who stands out."""
    rows, effects = d["records"], d["effects"]
    judged = [row for row in rows if row["status"] == "done"]
    parts = [_shown(effect, len(judged)) for effect in effects[:MOST_EFFECTS]]
    if len(effects) > MOST_EFFECTS:
        parts.append(f"{len(effects) - MOST_EFFECTS} more effects show in fewer records.")
    without = [row for row in judged if not row["findings"]]
    if without:
        parts.append(_others(without, alone=not effects))
    return " ".join([*parts, *_failed(len(rows) - len(judged), len(rows))])


def _failed(failed: int, total: int) -> Iterator[str]:
    """How many records have no diagnosis, where some have none."""
    if failed:
        yield f"{failed} of {total} records {'has' if failed == 1 else 'have'} no diagnosis."


def effect_name(effect: Dictionary) -> str:
    """An effect in words; where its law is open, or differs between records, its class."""
    return effect["kind"] or cause_name(effect["cause"])


def named(names: Sequence[str]) -> str:
    """Some names, and how many more there are."""
    shown = [*names[:MOST_NAMES]]
    return listed([*shown, f"{len(names) - MOST_NAMES} more"] if len(names) > MOST_NAMES else shown)


def _shown(effect: Dictionary, judged: int) -> str:
    """Where an effect shows, and its first size."""
    head = f"{capitalised(effect_name(effect))} at {place_name(effect['at'])} shows in {len(effect['records'])} of "
    head += f"{judged} record{'' if judged == 1 else 's'}"
    return " ".join([f"{head}{_law(effect)}.", *(_size(one) for one in effect["sizes"][:1])])


def _law(effect: Dictionary) -> str:
    """The laws that records name, where they differ."""
    if len(effect["causes"]) == 1:
        return f", its law open, most likely {cause_name(effect['cause'])}" if effect["kind"] else ""
    return f" ({', '.join(f'{cause_name(cause)} {count}' for cause, count in effect['causes'].items())})"


def _size(size: Dictionary) -> str:
    """Mean, spread and outliers of a size as a sentence or two."""
    mean, unit = size["mean"], size["unit"]
    words = f"{size['parameter']} = {quantity(mean, unit)} {interval(size['low'], size['high'], unit, mean)}"
    if size["between"] is not None:
        words += f" in the mean, {_between(size)}"
    stand_out = [one for one in size["values"] if one["record"] in size["outliers"]]
    parts = [f"{one['record']} ({quantity(one['value'], unit)}, {abs(one['distance']):.1f} standard deviations away)"
             for one in stand_out]  # fmt: skip
    verb = "stands" if len(parts) == 1 else "stand"
    return f"{words}." + (f" {named(parts)} {verb} out." if parts else "")


def _between(size: Dictionary) -> str:
    if size["between"] == 0.0:
        return "and parts differ by no more than the errors of the fits"
    share = f" ({percent(size['between'] / abs(size['mean']))})" if size["mean"] else ""
    return f"{quantity(size['between'], size['unit'])}{share} from part to part beyond the errors of the fits"


def _others(rows: Sequence[Dictionary], *, alone: bool) -> str:
    """Records in which nothing is named, by verdict."""
    counts: dict[str, list[str]] = {}
    for row in rows:
        counts.setdefault(row["verdict"], []).append(row["name"])
    return " ".join(_of_verdict(verdict, names, alone=alone) for verdict, names in counts.items())


def _of_verdict(verdict: str, names: Sequence[str], *, alone: bool) -> str:
    label, one = VERDICTS[verdict].label.lower(), len(names) == 1
    which = "" if verdict == "consistent" else f" ({named(names)})"
    records = f"{'' if alone else 'other '}record{'' if one else 's'}"
    return f"{len(names)} {records} {'is' if one else 'are'} {label}{which}."


def change_lines(d: Dictionary) -> Iterator[str]:
    """Verdicts that differ from those of the batch before, one line each."""
    for change in d["changes"]:
        before, now = change["before"], change["now"]
        if before is None:
            yield f"{change['record']} is new: {now}"
        elif now is None:
            yield f"{change['record']} is no longer among the records; it was {before}"
        else:
            yield f"{change['record']}: {before} → {now}"
