"""All that a verdict rests on: scorecards, and what is measured only when it is asked for."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ..._result import Check
from .found_again import FoundAgain
from .held_out import HeldOutErrors
from .plain import as_plain
from .prediction import Prediction
from .scorecard import GIVEN, REFITTED, OtherShapes, Scorecard

_MAP = " with a map"


class NotMeasuredError(LookupError):
    """Recorded evidence lacks what is asked of it."""


class SetAside(NamedTuple):
    """A candidate that was not fitted to its end, and why in words.

    It was `nats` behind the best when it was set aside, or explained this `share` of the missing force; None where that
    is not known.
    """

    key: str
    why: str
    nats: float | None = None
    share: float | None = None


class Predicted(NamedTuple):
    """A hypothesis of which only predictions are known."""

    prediction: Prediction


class Setting(NamedTuple):
    """What is the same for all hypotheses.

    `periods` of motion in the records; whether the motion is `imposed`; the share of the elastic force that is admitted
    as `model_error` to all; whether the search was `finished`; channels that are `clipped`, as (kind, number); forces
    that are `late`, and the share of the signal by which that changes a run of the model as given; channels that were
    `turned`, since their signs are wrong.
    """

    periods: float
    imposed: bool = False
    model_error: float = 0.0
    finished: bool = True
    clipped: tuple[tuple[str, int], ...] = ()
    late: tuple[tuple[str, int], ...] = ()
    late_changes: float = 0.0
    turned: tuple[tuple[str, int], ...] = ()


class Measure(NamedTuple):
    """How what is costly is measured, each by the key of a hypothesis."""

    other_shapes: Callable[[str], OtherShapes]
    with_map: Callable[[str], Prediction | None]
    held_out: Callable[[str], HeldOutErrors | None]
    found_again: Callable[[str], FoundAgain | None]
    with_model_error: Callable[[], "Evidence | None"]


@dataclass
class Evidence:
    """Scorecards by key, and costly measurements, each made once, when it is first asked for; and the looks at the
    records before any of them."""

    setting: Setting
    cards: Mapping[str, Scorecard]
    measure: Measure
    set_aside: tuple[SetAside, ...] = ()
    asked: dict[str, dict[str, Any]] = field(default_factory=dict)
    looks: tuple[Check, ...] = ()

    @property
    def given(self) -> Scorecard:
        return self.cards[GIVEN]

    @property
    def refitted(self) -> Scorecard:
        return self.cards[REFITTED]

    @property
    def candidates(self) -> list[Scorecard]:
        """All but the model as given and refitted, in the order in which they were found."""
        return [card for key, card in self.cards.items() if key not in (GIVEN, REFITTED)]

    def other_shapes(self, key: str) -> OtherShapes:
        """What forces of other shapes would gain beside a hypothesis."""
        return self._asked("other_shapes", key, self.measure.other_shapes)

    def with_map(self, key: str) -> Predicted | None:
        """Predictions of a hypothesis with a map of the force that it leaves; None where there is no map."""
        found = self._asked("with_map", key, self.measure.with_map)
        return None if found is None else Predicted(found)

    def held_out(self, key: str) -> HeldOutErrors | None:
        """Errors of runs over held-out readings with a hypothesis; None where nothing was held out."""
        return self._asked("held_out", key, self.measure.held_out)

    def found_again(self, key: str) -> FoundAgain | None:
        """A law fitted to held-out readings alone; None where there are none, or it is not one law."""
        return self._asked("found_again", key, self.measure.found_again)

    def with_model_error(self) -> "Evidence | None":
        """The same where all hypotheses are admitted some model error; None where that does not help."""
        return self._asked("with_model_error", "", lambda _: self.measure.with_model_error())

    def _asked(self, what: str, key: str, measure: Callable[[str], Any]) -> Any:
        known = self.asked.setdefault(what, {})
        if key not in known:
            known[key] = measure(key)
        return known[key]

    @property
    def plain(self) -> dict[str, Any]:
        """For JSON, without loss: scorecards, and what was asked."""
        return {
            "setting": as_plain(self.setting),
            "cards": [card.plain for card in self.cards.values()],
            "set_aside": as_plain(self.set_aside),
            "looks": as_plain(self.looks),
            "asked": {
                what: {
                    key: found.plain if isinstance(found, Evidence) else as_plain(found) for key, found in each.items()
                }
                for what, each in self.asked.items()
            },
        }

    @classmethod
    def of_plain(cls, written: Mapping[str, Any]) -> "Evidence":
        """What `plain` was made of; of what was not asked then it raises `NotMeasuredError`."""
        stated = written["setting"]
        channels = {name: tuple((k, n) for k, n in stated.get(name, ())) for name in ("clipped", "late", "turned")}
        setting = Setting(**{**stated, **channels})
        cards = [Scorecard.of_plain(card) for card in written["cards"]]
        made = {what: _MADE[what] for what in written["asked"]}
        asked = {
            what: {key: None if found is None else made[what](found) for key, found in each.items()}
            for what, each in written["asked"].items()
        }
        set_aside = tuple(SetAside(**each) for each in written["set_aside"])
        looks = tuple(map(Check.of_plain, written["looks"]))
        return cls(setting, {card.key: card for card in cards}, _NOTHING_MORE, set_aside, asked, looks)


def map_on(key: str) -> str:
    """Key of a hypothesis with a map of the force that it leaves."""
    return key + _MAP


def has_map(key: str) -> bool:
    return key.endswith(_MAP)


def _numbers(written: Mapping[str, Any]) -> dict[str, Any]:
    return {name: _number(value) for name, value in written.items()}


def _number(value: Any) -> Any:
    if isinstance(value, list):
        return [float(v) for v in value]
    return value if value is None or isinstance(value, bool) else float(value)


_MADE: Mapping[str, Callable[[Any], Any]] = {
    "other_shapes": lambda written: OtherShapes(**_numbers(written)),
    "with_map": lambda written: Prediction(**{name: np.array(v) for name, v in _numbers(written).items()}),
    "held_out": lambda written: HeldOutErrors(
        **{**_numbers(written), "interval": tuple(_numbers(written)["interval"])}
    ),
    "found_again": lambda written: FoundAgain(
        **{**written, **_numbers({n: v for n, v in written.items() if n != "law"})}
    ),
    "with_model_error": Evidence.of_plain,
}


def _missing(what: str) -> Callable[..., Any]:
    def measure(key: str = "") -> Any:
        raise NotMeasuredError(f"`{what}` of {key or 'this record'} was not asked when this evidence was recorded.")

    return measure


_NOTHING_MORE = Measure(*(_missing(what) for what in Measure._fields))
