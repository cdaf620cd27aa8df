"""Every check that a verdict rests on: its stage, what it asks, and the thresholds that limit it."""

from collections.abc import Mapping
from typing import Literal, NamedTuple

from ..._result import Check as Check
from ..._result import Relation, holds
from ...records import LOOKS

Stage = Literal["searched", "sensors", "detected", "admissible", "named", "sufficient", "confirmed"]

STAGES: Mapping[Stage, str] = {
    "searched": "Was everything looked into?",
    "sensors": "Do the sensors show what happened?",
    "detected": "Is anything wrong with the model beyond noise?",
    "admissible": "Is this candidate an alternative to what is known without it?",
    "named": "Is its name sure enough?",
    "sufficient": "Is what it leaves only noise, and its shape right?",
    "confirmed": "Do runs over held-out readings agree?",
}


class Kind(NamedTuple):
    """What is the same wherever a check is made; `limits` are the names of thresholds."""

    stage: Stage
    relation: Relation
    unit: str
    asks: str
    limits: tuple[str, ...] = ()


CHECKS: Mapping[str, Kind] = {
    "finished": Kind(
        "searched",
        ">=",
        "searches that were finished",
        "The search went on to its end; else a cause is half as sure, and without one nothing is decided.",
    ),
    **{name: Kind("sensors", look.relation, look.unit, look.asks) for name, look in LOOKS.items()},
    "right_size": Kind(
        "sensors",
        ">",
        "log of a ratio",
        "No channel is off from what the model as given makes of the drive by a factor between units; asked where its "
        "shape is the model's, or it is a thousand times as large.",
        ("unit_thousand", "unit_large", "unit_about", "unit_follows", "unit_alike", "unit_near"),
    ),
    "follows_model": Kind(
        "sensors",
        ">",
        "cosine",
        "The motion of a driven point does not oppose what the model as given makes of the force, while that takes "
        "energy out of it.",
        ("opposed", "opposed_power"),
    ),
    "channels_in_place": Kind(
        "sensors",
        ">=",
        "ratio",
        "No two channels of a kind fit the model in each other's place far better than in their own.",
        ("in_place", "swapped"),
    ),
    "no_clipping": Kind(
        "sensors",
        "<=",
        "limits",
        "No channel is cut off at a limit of its recorder.",
    ),
    "acts_in_time": Kind(
        "sensors",
        "<=",
        "share of the signal",
        "If a force acts later than it was recorded, or is held between its samples, a run of the model as given "
        "hardly changes by it. If it does, that is a cause, also where nothing else is wrong.",
        ("negligible",),
    ),
    "better_than_given": Kind(
        "detected",
        ">=",
        "nats",
        "The best explanation is more probable than the model as given.",
        ("significant",),
    ),
    "visible_in_prediction": Kind(
        "detected",
        ">=",
        "share of the signal",
        "Predictions of the model as given leave an error beyond noise. Where they do not, only a "
        "hypothesis that leaves nothing but noise is a finding.",
        ("negligible", "chance"),
    ),
    "refit_leaves_no_shape": Kind(
        "detected",
        "<=",
        "nats",
        "Beside a model that is called consistent, forces of any shape gain no more than noise lets them.",
        ("other_shapes",),
    ),
    "stays_in_step": Kind(
        "detected",
        "<=",
        "ratio",
        "A run of a model that is called consistent over all held-out readings is as wrong as noise makes "
        "it. If not, the verdict is reached anew, and small errors over some periods count.",
        ("worse", "negligible"),
    ),
    "stays_bounded": Kind(
        "admissible",
        "<=",
        "runs that escape",
        "Its motion stays bounded.",
    ),
    "law_is_itself": Kind(
        "admissible",
        "<=",
        "other laws that it is",
        "With the numbers found, its law is not another one of the catalogue.",
    ),
    "own_values_within_bounds": Kind(
        "admissible",
        "<=",
        "own values at a bound",
        "It takes no own value to the end of what the model's owner believes, where the refitted model does not.",
    ),
    "better_than_refit": Kind(
        "admissible",
        ">",
        "nats",
        "It is more probable than the refitted model; by more where that one's predictions leave nothing, "
        "since of many candidates some gain a little by chance.",
        ("significant", "searched"),
    ),
    "explains_half_of_excess": Kind(
        "admissible",
        ">=",
        "share of excess power",
        "It explains half of the error power that the refitted model leaves beyond noise, on every set of samples; own "
        "values that leave more than noise, half of what the model as given leaves.",
        ("half", "noticeable", "chance"),
    ),
    "second_effect_pays": Kind(
        "admissible",
        ">",
        "nats",
        "Two effects are more probable than either alone and than the best single one.",
        ("searched", "significant"),
    ),
    "second_effect_explains_half": Kind(
        "admissible",
        ">=",
        "share of excess power",
        "Two effects explain half of what one alone leaves.",
        ("half",),
    ),
    "second_effect_predicts_better": Kind(
        "admissible",
        ">=",
        "share of the refit's error",
        "Two effects predict better than one by enough to be worth it.",
        ("second_effect", "second_effect_to_noise"),
    ),
    "no_bias_beside_it": Kind(
        "admissible",
        "<=",
        "nats",
        "Beside it no offset of an accelerometer is so large that it is a bias.",
        ("bias",),
    ),
    "identifiable_here": Kind(
        "admissible",
        "<=",
        "reasons why not",
        "These records can show it: no change with time in a single decay, nor by one record where a model error is "
        "admitted; no load in step with a single line that drives the structure; no two laws where predictions of the "
        "refitted model show nothing.",
    ),
    "no_simpler_law_as_good": Kind(
        "named",
        ">=",
        "nats",
        "No special case of its law, with fewer numbers, is about as probable.",
        ("special_case",),
    ),
    "probability": Kind(
        "named",
        ">=",
        "probability",
        "It is more likely than everything else together.",
        ("named", "tempering", "fewest_looks", "most_looks", "periods_per_look", "unlisted"),
    ),
    "probability_of_class": Kind(
        "named",
        ">=",
        "probability",
        "If it is not, laws of a class that it belongs to are likely together: the narrowest such class is named, and "
        "the law is open.",
        ("class_named",),
    ),
    "more_than_a_trace": Kind(
        "named",
        "<",
        "share of its gain",
        "Where the refitted model leaves nothing, laws of other classes do not gain nearly all that it gains: what "
        "unlike laws explain alike is a little that the noise's model lacks.",
        ("nearly_all",),
    ),
    "same_in_all_records": Kind(
        "named",
        "<=",
        "ratio",
        "The numbers of its law are the same in all records; else it is half as sure.",
        ("differs",),
    ),
    "leaves_only_noise": Kind(
        "sufficient",
        "<",
        "correlation, log of a ratio, or share of the signal",
        "What it leaves does not correlate from sample to sample, is as large as the noise floor of the channels, and "
        "shows in no prediction. The row has what is furthest from its limit. It chooses what is asked next, and is no "
        "failure by itself.",
        ("white", "noise_scale", "negligible", "chance"),
    ),
    "map_adds_little": Kind(
        "sufficient",
        "<",
        "share of excess power",
        "A map of the force that it leaves would not explain half of the rest. Not asked of a cause that explains "
        "almost all along an imposed motion and does not leave much, nor of one that explains nearly all where a model "
        "error is admitted.",
        ("half", "almost_all", "much", "nearly_all"),
    ),
    "explains_nearly_all": Kind(
        "sufficient",
        ">=",
        "share of excess power",
        "If it leaves much of the signal, it explains nearly all of the rest: else it is only the nearest law.",
        ("nearly_all", "much"),
    ),
    "values_leave_little": Kind(
        "sufficient",
        "<",
        "share of the signal",
        "Own values that leave more than noise leave less than twice what is negligible.",
        ("negligible",),
    ),
    "right_shape": Kind(
        "sufficient",
        "<=",
        "nats",
        "Forces of other shapes would gain only a small share of what it gains itself (a score test), and would not "
        "explain half of innovations that are not white. Two laws leave white ones.",
        (
            "other_shapes",
            "other_shapes_of_values",
            "other_shapes_of_one",
            "white",
            "other_shapes_white",
            "other_shapes_of_white",
            "rest_with_shape",
            "alike",
        ),
    ),
    "not_worse": Kind(
        "confirmed",
        "<=",
        "ratio",
        "Its error on held-out readings is not larger by this ratio than that of the model as given, or than what "
        "noise leaves, whichever is the larger.",
        ("worse",),
    ),
    "gains_something": Kind(
        "confirmed",
        ">",
        "share of held-out error",
        "If it leaves more than noise, its held-out run may close some of the error (the upper end of the interval); "
        "if it is not likely, or predictions do not show it, it does so for certain (the lower end).",
        ("named", "beyond_question"),
    ),
    "closes_half": Kind(
        "confirmed",
        ">=",
        "share of held-out error",
        "A map, or what only a long run shows, closes half of the held-out error; a cause that leaves more than noise "
        "may close it, else it is half as sure.",
        ("half",),
    ),
    "class_closes_half": Kind(
        "confirmed",
        ">=",
        "share of held-out error",
        "A law that is not of the right shape closes half of the held-out error; its class is named then.",
        ("half",),
    ),
    "class_found_again": Kind(
        "confirmed",
        ">=",
        "share of excess power",
        "If it closes less, its numbers may turn on the motion: a law of its class, fitted to held-out readings alone, "
        "explains nearly all of what the refitted model leaves there.",
        ("nearly_all",),
    ),
    "class_as_large_again": Kind(
        "confirmed",
        "<=",
        "ratio",
        "What the laws of the class have in common is as large there as in what was fitted; the class is named then.",
        ("differs",),
    ),
}
"""In the order of the stages."""


def checked(name: str, of: str, measured: float, limit: float, says: str, unit: str | None = None) -> Check:
    """The outcome of a check of `CHECKS`, of the hypothesis with the key `of`, in the check's unit or another one."""
    kind = CHECKS[name]
    passed = holds(measured, kind.relation, limit)
    return Check(kind.stage, name, of, float(measured), kind.relation, float(limit), unit or kind.unit, passed, says)
