"""Ids, places and verdicts in words."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from jfsm.reporting._quantities import number


class Verdict(NamedTuple):
    """A verdict as a reader meets it; `tone` is the class of its colours."""

    label: str
    tone: str
    meaning: str


VERDICTS: Mapping[str, Verdict] = {
    "consistent": Verdict(
        "Consistent", "good", "The simulation explains the record down to its noise; nothing has to be added."
    ),
    "parameters": Verdict("Parameters", "change", "The form of the simulation is right; some of its values are off."),
    "cause": Verdict("Cause found", "change", "The simulation lacks an effect, which is named here."),
    "unnamed": Verdict(
        "Unnamed effect", "open", "A real effect is missing that no known cause explains; a map stands in for it."
    ),
    "undecided": Verdict("Undecided", "open", "This record cannot tell what is wrong."),
}

# Names that are not their ids with spaces: people, and the customary spelling.
PROPER = {
    "coulomb": "Coulomb friction",
    "coulomb_asymmetric": "asymmetric Coulomb friction",
    "smooth_coulomb": "smooth Coulomb friction",
    "stribeck": "Stribeck friction",
    "lugre": "LuGre friction",
    "bouc_wen": "Bouc-Wen hysteresis",
    "jenkins": "Jenkins slider",
    "maxwell": "Maxwell element",
    "van_der_pol": "van der Pol damping",
    "accel_bias": "accelerometer bias",
    "accel_gain": "accelerometer gain",
}


def checked_verdict(d: Mapping[str, Any]) -> Verdict:
    """The verdict of a diagnosis, and whether that is the best so far of one that was not finished.

    Raises
    ------
    ValueError
        If `d` is not the dictionary of a diagnosis.
    """
    found = d.get("verdict")
    if not isinstance(found, str) or found not in VERDICTS:
        raise ValueError(
            f"`d` must be the dictionary that `Diagnosis.to_json` writes, with 'verdict' one of {', '.join(VERDICTS)}; "
            f"its 'verdict' was {found!r}. Load the file with `json.load` and pass it whole."
        )
    verdict = VERDICTS[found]
    return verdict if d.get("finished", True) else Verdict(f"{verdict.label}, not finished", "open", verdict.meaning)


def cause_name(cause: str) -> str:
    """A cause's id in words: "cubic hardening"; several stay a sum, ids outside the catalogue lose their "_"."""
    return " + ".join(PROPER.get(one, one.replace("_", " ")) for one in cause.split(" + "))


def place_name(at: Sequence[Any] | None) -> str:
    """Where: "link ground–1" for (0, 1), "mass 1" for (1,), "force channel 1" for ("force", 1)."""
    match list(at or ()):
        case []:
            return ""
        case [str(kind), *rest]:
            return " ".join([kind.replace("_", " "), "channel", *map(str, rest)])
        case [single]:
            return f"mass {single}"
        case [[*_], *_] as several:
            return ", ".join(dict.fromkeys(map(place_name, several)))
        case ends:
            return "link " + "–".join("ground" if end == 0 else str(end) for end in ends)


def capitalised(text: str) -> str:
    """First letter large, the others as they are: "van der Pol" has its own."""
    return text[:1].upper() + text[1:]


def extent(record: Mapping[str, Any]) -> tuple[str, ...]:
    """How long a record is: samples, seconds and samples per second, as far as they are known."""
    samples, duration, rate = (record.get(key) for key in ("samples", "duration", "sample_rate"))
    parts = (
        f"{samples} samples" if samples is not None else "",
        f"{number(duration, 4)} s" if duration is not None else "",
        f"{rate:.6g} Hz" if rate is not None else "",
    )
    return tuple(filter(None, parts))


def listed(names: Sequence[str]) -> str:
    """ "a", "a and b", "a, b and c"."""
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last


def counted(count: int, word: str) -> str:
    """ "No gaps", "1 gap", "2 gaps"."""
    return f"{count or 'No'} {word}{'' if count == 1 else 's'}"
