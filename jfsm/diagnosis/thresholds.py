"""Every number that the judge uses, each with its unit, what it means, and where it comes from.

They are an argument of the judge (`verdict.judge`), so that recorded evidence can be judged anew with others.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from difflib import get_close_matches
from typing import Any, NamedTuple

_BLIND = "blind cases"
"""Source of a number that was set so that simulated cases with known causes are judged right."""


def _number(default: float, unit: str, means: str, source: str) -> Any:
    return field(default=default, metadata={"unit": unit, "means": means, "source": source})


@dataclass(frozen=True)
class Thresholds:
    """The numbers behind a verdict; `explained()` gives unit, meaning and source of each."""

    unit_thousand: float = _number(
        500.0, "ratio", "Factors between units from here on are believed of a motion far larger than the model has it, "
        "whatever its shape.", "no value of a model that anybody believes in is so far off",
    )  # fmt: skip
    unit_large: float = _number(
        30.0, "ratio", "Factors between units from here on need not be met to a few per cent.",
        "no calibration and hardly a value is so far off",
    )  # fmt: skip
    unit_about: float = _number(
        1.2, "log of a ratio", "Distance from a factor of a thousand at which it is that factor.",
        "a factor of 3.3: what friction, or a resonance, makes of a size",
    )  # fmt: skip
    unit_follows: float = _number(
        0.3, "cosine", "Phase that a motion a thousand times too large keeps with the model's, at least.", _BLIND
    )
    unit_alike: float = _number(
        0.2, "log of a ratio", "Spread over frequencies, distance from a large factor, and what the phase's cosine may "
        "lack of one, for it to be that factor.", "values that are off by a fifth",
    )  # fmt: skip
    unit_near: float = _number(
        0.05, "log of a ratio", "The same of the small factors, which a wrong value may be as well.", _BLIND
    )
    opposed: float = _number(
        -0.7, "cosine", "Phase between a motion and the model's, below which they oppose each other.",
        "three quarters of a right angle from opposite",
    )  # fmt: skip
    opposed_power: float = _number(
        -5.0, "standard errors", "Mean power of a force at its own point, below which it takes energy out.",
        "one in a million by chance",
    )  # fmt: skip
    in_place: float = _number(
        0.05, "share of the power", "What two channels leave in each other's place, at most, for them to be swapped.",
        _BLIND,
    )  # fmt: skip
    swapped: float = _number(
        0.1, "ratio", "That, in what they leave where they stand, below which they are swapped.", _BLIND
    )
    significant: float = _number(
        5.0, "nats", "Gain in log-evidence of one hypothesis over another that was named beforehand.",
        "R. E. Kass, A. E. Raftery, J. Am. Stat. Assoc. 90 (1995) 773, table in 3.2: above 5 is very strong evidence",
    )  # fmt: skip
    searched: float = _number(
        15.0, "nats",
        "Gain in log-evidence of the best of many hypotheses: of a law where predictions of the refitted model leave "
        "nothing, of two effects over either of them.",
        "significant + ln(number of hypotheses) is 9 for the some 60 single effects and 12 for 1500 pairs; blind cases",
    )  # fmt: skip
    beyond_question: float = _number(
        30.0, "nats", "Gain at which a law that leaves only noise needs no held-out reading to confirm it.",
        "twice `searched`",
    )  # fmt: skip
    bias: float = _number(
        50.0, "nats", "Gain at which the offset of an accelerometer is a bias, whatever else is left.", _BLIND
    )
    special_case: float = _number(
        0.1, "nats", "Gain below which a law gives way to its special case with fewer numbers.", _BLIND
    )
    half: float = _number(
        0.5, "share", "Share of the excess error power that a cause or a map explains at least, on every set of "
        "samples, and of the held-out error that it closes.", "more than everything else together",
    )  # fmt: skip
    nearly_all: float = _number(
        0.8, "share", "Share of the excess error power from which a law that leaves much is not only near.", _BLIND
    )
    almost_all: float = _number(
        0.95, "share", "Share of the excess, or of the held-out error, from which a law stands though its shape is "
        "not quite right.", _BLIND,
    )  # fmt: skip
    negligible: float = _number(
        0.02, "share of the signal", "Error beyond noise and chance below which a prediction leaves nothing.",
        "below what own values, sensors and mounting of a careful test leave",
    )  # fmt: skip
    much: float = _number(
        0.1, "share of the signal", "Error beyond noise and chance above which a law leaves much.", _BLIND
    )
    noticeable: float = _number(
        0.1, "share of the noise's power", "Excess from which a set of samples says anything about an effect.", _BLIND
    )
    chance: float = _number(
        2.0, "standard deviations", "By which noise may leave more error than it does in the mean.",
        "a one-sided level of 2.3 per cent",
    )  # fmt: skip
    white: float = _number(
        0.1, "correlation", "Lag-one correlation of the innovations below which they count as white.",
        "four standard errors of 1600 samples",
    )  # fmt: skip
    noise_scale: float = _number(
        0.5, "log of a ratio", "Departure of the fitted noise from the noise floor up to which it is the floor.",
        "a factor of 1.65",
    )  # fmt: skip
    other_shapes: float = _number(
        20.0, "nats", "Gain of forces of other shapes beside a hypothesis, beyond chance, from which it is doubted.",
        _BLIND,
    )  # fmt: skip
    other_shapes_of_values: float = _number(
        0.02, "share", "That gain as a share of what refitted own values gain, at which they are refused.", _BLIND
    )
    other_shapes_of_one: float = _number(
        0.1, "share", "That gain as a share of what the last effect gains, at which it is refused.", _BLIND
    )
    other_shapes_white: float = _number(
        15.0, "nats", "The same as `other_shapes` where innovations are white, and chance is known.",
        "one of a hundred right laws leaves as many; blind cases",
    )  # fmt: skip
    other_shapes_of_white: float = _number(
        0.005, "share", "That gain as a share of what the last effect gains, where innovations are white.", _BLIND
    )
    rest_with_shape: float = _number(
        0.5, "share", "Share of the innovations' power that other shapes may explain where innovations are not white.",
        "as `half`",
    )  # fmt: skip
    second_effect: float = _number(
        0.03, "share of the refit's error", "Gain in prediction that a second effect brings at least.", _BLIND
    )
    second_effect_to_noise: float = _number(
        0.01, "share of the refit's error", "The same where two effects leave only noise.", _BLIND
    )
    alike: float = _number(
        0.3,
        "share",
        "Probability of another law of the class, in those of the leader, that may take its place.",
        _BLIND,
    )
    named: float = _number(0.5, "probability", "Probability from which a cause is named.", "more likely than not")
    class_named: float = _number(
        0.8,
        "probability",
        "Probability from which a class of laws is named where no law is sure; a law below it is open.",
        _BLIND,
    )
    fewest_looks: float = _number(
        10.0, "looks", "Independent looks, at least, that the prediction error of a record stands for.", _BLIND
    )
    most_looks: float = _number(40.0, "looks", "Independent looks, at most.", _BLIND)
    periods_per_look: float = _number(
        5.0, "periods", "Periods of motion that make one independent look.", "length of a window of prediction"
    )
    tempering: float = _number(
        1.5, "ratio", "By which log-evidence is divided where the leader leaves only noise.",
        "noise levels and priors are known to ten per cent; with 2, of 63 blind cases given 0.7 to 0.9, all were right",
    )  # fmt: skip
    unlisted: float = _number(
        0.005, "probability", "Probability that is shared evenly by all hypotheses, whatever their evidence.", _BLIND
    )
    differs: float = _number(
        0.3, "share", "Difference of a law's number between records from which its form is open.", _BLIND
    )
    worse: float = _number(
        1.5, "ratio", "Held-out error, in errors of the model as given and of noise, from which it is worse.", _BLIND
    )

    def changed(self, written: Iterable[str]) -> "Thresholds":
        """The same numbers but for those that are written as ``name=value``.

        Raises
        ------
        ValueError
            If a text is not of that form, or the name is not that of a threshold; the message has the names.
        """
        known, values = [f.name for f in fields(self)], {}
        for text in written:
            name, _, value = text.partition("=")
            if name not in known:
                close = [f"Did you mean {near}? " for near in get_close_matches(name, known, 1)]
                raise ValueError(
                    f"A threshold must be written as name=value; got {text!r}. {''.join(close)}"
                    f"Names: {', '.join(known)}."
                )
            try:
                values[name] = float(value)
            except ValueError:
                raise ValueError(f"The threshold `{name}` must be a number, as in {name}=0.5; got {text!r}.") from None
        return replace(self, **values)

    def explained(self) -> dict[str, "Number"]:
        """Value, unit, meaning and source of every number, by name."""
        return {f.name: Number(getattr(self, f.name), **f.metadata) for f in fields(self)}


class Number(NamedTuple):
    """A number that decides, with its unit, its meaning and its source."""

    value: float
    unit: str
    means: str
    source: str


THRESHOLDS = Thresholds()
"""The numbers of every diagnosis."""
