"""The log of a decision: what its checks are of, which of them decided, and how near the nearest law came."""

import difflib
import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from jfsm.reporting._quantities import number, percent
from jfsm.reporting._tables import Table
from jfsm.reporting._wording import cause_name, place_name

Dictionary = Mapping[str, Any]

MODEL, GIVEN, REFITTED = "model", "given", "refitted"
MAP = " with a map"
STAGES = {
    "searched": "searched", "sensors": "sensors", "detected": "something is wrong", "admissible": "admissible",
    "named": "named", "sufficient": "sufficient", "confirmed": "held-out readings",
}  # fmt: skip
OPEN = ("undecided", "unnamed")
"""Verdicts that name no cause though something is wrong."""
CHOOSES = "leaves_only_noise"
"""A check that chooses which ones are made next, and is no failure."""
OF_ITS_CLASS = ("probability_of_class", "class_closes_half", "class_found_again", "class_as_large_again")
"""Checks that ask whether the class of a law is named where the law is not."""


def decision_of(d: Dictionary) -> Dictionary:
    """How the verdict was reached; empty where that is not known."""
    return d.get("decision") or {}


# Names


def hypothesis_name(key: str) -> str:
    """A key in words."""
    if key in (MODEL, GIVEN, REFITTED):
        return {MODEL: "the model", GIVEN: "the model as given", REFITTED: "the model refitted"}[key]
    if key.endswith(MAP):
        return f"{hypothesis_name(key.removesuffix(MAP))}, with a map"
    return " and ".join(_effect_name(part) for part in key.split("+"))


def _effect_name(part: str) -> str:
    if "@" not in part:  # a channel, or the record
        return part
    cause, _, place = part.partition("@")
    kind, colon, j = place.partition(":")
    at = (kind, j) if colon else tuple(int(end) for end in place.split("-"))
    return f"{cause_name(cause)} at {place_name(at)}"


def typeset(says: str) -> str:
    """What a check says, with its percentages and negative numbers as they are written elsewhere."""
    return re.sub(r"(?<![\w–.)])-(?=\d)", "−", re.sub(r"(?<=\d)%", " %", says))


# Which checks


def decisive_checks(d: Dictionary) -> list[Dictionary]:
    """The checks that the verdict rests on: those of the model, then of the hypotheses, each in their order.

    Of hypotheses it is the one that the verdict rests on; where none is named the nearest law, and the one that was
    stopped, with the check that stopped it last.
    """
    decision = decision_of(d)
    stopped = decision.get("stopped_by")
    rows = [row for of in _decisive(d) for row in standing(decision, of) if row != stopped and not _fine(row)]
    return [*rows, *([stopped] if stopped is not None else [])]


def _fine(row: Dictionary) -> bool:
    """Whether a look at a sensor found nothing."""
    return row["stage"] == "sensors" and row["passed"]


def _decisive(d: Dictionary) -> dict[str, None]:
    """Keys of the hypotheses that a verdict rests on."""
    decision = decision_of(d)
    looked_at = (row["of"] for row in decision.get("checks") or () if row["stage"] == "sensors" and not row["passed"])
    stopped = (decision.get("stopped_by") or {}).get("of")
    winner = decision.get("winner", "").removesuffix(MAP)
    return dict.fromkeys(filter(None, (MODEL, *looked_at, winner, nearest(d), stopped)))


def standing(decision: Dictionary, of: str) -> list[Dictionary]:
    """The checks of a hypothesis that stand, the last of each name, in the order in which they were made."""
    rows = decision.get("checks") or ()
    since = decision.get("since", 0)
    looks = [row for row in rows[:since] if row["stage"] == "sensors"]
    rows = rows if of == MODEL else [*looks, *rows[since:]]
    last: dict[str, Dictionary] = {}
    for row in rows:
        if row["of"] == of:
            last.pop(row["name"], None)
            last[row["name"]] = row
    return list(last.values())


def failed(row: Dictionary, decision: Dictionary) -> bool:
    """Whether a check speaks against something; one that chooses what is asked next does so where it stopped all."""
    return not row["passed"] and (row["name"] != CHOOSES or row == decision.get("stopped_by"))


def checks_of(d: Dictionary, cause: str) -> dict[str, list[Dictionary]]:
    """The checks of every hypothesis with a cause, by its key, the likeliest first; single effects before pairs.

    `cause` is an id or a name in any case, ``map``, or the key of a hypothesis: ``given``, ``coulomb@0-1``.

    Raises
    ------
    LookupError
        If no hypothesis has it; the message names those that come close.
    """
    decision = decision_of(d)
    reasons, factors = decision.get("reasons") or {}, decision.get("factors") or {}
    keys = dict.fromkeys([*(row["of"] for row in decision.get("checks") or ()), *reasons, *factors])
    wanted = _plain(cause)
    chosen = [key for key in keys if wanted == _plain(key) or wanted in _called(key)]
    if not chosen:
        known = sorted({one for key in keys for one in _causes(key)} | {MODEL, GIVEN, REFITTED})
        close = difflib.get_close_matches(wanted, known, 3) or known
        raise LookupError(f"No hypothesis with `{cause}` is in this verdict. There are {', '.join(close)}.")
    chosen.sort(key=lambda key: (key.count("+"), -chance(factors.get(key) or ())))
    return {key: [row for row in decision.get("checks") or () if row["of"] == key] for key in chosen}


def _called(key: str) -> set[str]:
    """All that a hypothesis is called by one of its parts."""
    parts = {_plain(name) for one in _causes(key) for name in (one, cause_name(one))}
    return parts | ({"map"} if key.endswith(MAP) else set())


def _causes(key: str) -> list[str]:
    return [part.split("@")[0] for part in key.removesuffix(MAP).split("+") if "@" in part]


def _plain(name: str) -> str:
    return re.sub(r"[ _–-]", "_", name.strip().lower())


# How probable, and how near


def chance(factors: Sequence[Dictionary]) -> float:
    """The probability that is the product of factors; 0 where there are none."""
    return math.prod(float(factor["size"]) for factor in factors) if factors else 0.0


def leader(decision: Dictionary) -> str:
    """Key of the most probable hypothesis; empty where none has a probability."""
    factors = decision.get("factors") or {}
    return max(factors, key=lambda key: chance(factors[key]), default="")


def probability_line(d: Dictionary, key: str) -> str:
    """The probability of a hypothesis as the product of its factors; empty for one that is no alternative, or was
    refused before it had any."""
    factors = (decision_of(d).get("factors") or {}).get(key) or ()
    if not factors or (len(factors) == 1 and chance(factors) == 0.0):
        return ""
    product = " × ".join(f"{number(float(factor['size']), 3)} ({factor['name']})" for factor in factors)
    return f"Probability of {hypothesis_name(key)}: {percent(chance(factors))} = {product}"


def nearest(d: Dictionary) -> str:
    """Where no cause is named, the law that came nearest: that of the right class, else the most probable one before
    anything refused it, else the one that explains most. Empty where there is none, or a cause is named."""
    decision = decision_of(d)
    if d["verdict"] not in OPEN:
        return ""
    if decision.get("near"):
        return decision["near"][0]
    factors = {key: _unrefused(each) for key, each in (decision.get("factors") or {}).items() if "@" in key}
    explained = {key: float(each) for key, each in (decision.get("explained") or {}).items() if not key.endswith(MAP)}
    ranked = factors or {key: share for key, share in explained.items() if share > 0.0}
    return max(ranked, key=lambda key: ranked[key], default="")


def _unrefused(factors: Sequence[Dictionary]) -> float:
    return chance([factor for factor in factors if float(factor["size"]) > 0.0])


def nearest_lines(d: Dictionary) -> list[str]:
    """The law that came nearest where no cause is named, and why it was not named: all checks that it does not pass."""
    key, decision = nearest(d), decision_of(d)
    if not key:
        return []
    rows = [row for row in standing(decision, key) if failed(row, decision)]
    itself = [row["says"] for row in rows if row["name"] not in OF_ITS_CLASS]
    its_class = [row["says"] for row in rows if row["name"] in OF_ITS_CLASS]
    reason = [(decision.get("reasons") or {}).get(key, "")] if not rows else []
    why = [
        f"{intro}: {typeset('; and '.join(says))}."
        for intro, says in (("Not named", itself or [*filter(None, reason)]), ("As a class", its_class))
        if says
    ]
    return [" ".join([f"{_how_near(decision, key)}.", *why])]


def _how_near(decision: Dictionary, key: str) -> str:
    """In what way a law is the nearest one, and how probable it is."""
    factors = (decision.get("factors") or {}).get(key) or ()
    kind = "cause" if ":" in key else "law"
    if not factors:
        share = percent(float((decision.get("explained") or {}).get(key, 0.0)))
        return f"The {kind} that explains most: {hypothesis_name(key)} ({share} of what the refitted model leaves)"
    now, before = chance(factors), _unrefused(factors)
    sure = percent(now) if now else f"{percent(before)} before it was refused"
    rivals = [_unrefused(each) for other, each in decision["factors"].items() if "@" in other]
    intro = f"Most probable {kind}" if before >= max(rivals) else f"Nearest {kind}"
    return f"{intro}: {hypothesis_name(key)} ({sure})"


def stopping_line(decision: Dictionary) -> str:
    """The check that left a decision open, with the limit that comes next; empty for any other."""
    stopped = decision.get("stopped_by")
    if stopped is None:
        return ""
    return f"Stopped by the check `{stopped['name']}` of {hypothesis_name(stopped['of'])}: {typeset(stopped['says'])}."


def became(d: Dictionary, key: str) -> str:
    """What became of a hypothesis in a few words; empty where nothing is to be said."""
    decision = decision_of(d)
    reason, rests = (decision.get("reasons") or {}).get(key), key == decision.get("winner")
    if reason:
        return typeset(reason)
    if rests and d["verdict"] != "undecided":
        return "named" if d["verdict"] == "cause" else "the verdict rests on it"
    likeliest = leader(decision)
    if key not in (decision.get("factors") or {}):
        return ""
    return "the most probable hypothesis" if key == likeliest else f"less probable than {hypothesis_name(likeliest)}"


# As a table


def checks_table(rows: Sequence[Dictionary], title: str, decision: Dictionary) -> Table:
    """Checks as a table: stage, of which hypothesis, what was found, the limit, and the outcome."""
    cells = tuple(
        (
            STAGES[row["stage"]],
            hypothesis_name(row["of"]),
            typeset(row["says"]),
            _measured(row),
            _outcome(row, decision),
        )
        for row in rows
    )
    strong = frozenset(k for k, row in enumerate(rows) if failed(row, decision))
    return Table(title, ("stage", "of", "finding", "measured", "outcome"), cells, frozenset({0, 1, 2, 4}), strong)


def _measured(row: Dictionary) -> str:
    return f"{number(float(row['measured']), 4)} {row['relation']} {number(float(row['threshold']), 4)}"


def _outcome(row: Dictionary, decision: Dictionary) -> str:
    if row["passed"]:
        return "passed"
    return "failed" if failed(row, decision) else "more than noise"
