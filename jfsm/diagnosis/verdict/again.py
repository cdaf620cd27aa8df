"""A verdict reached again from what was written down, with other thresholds."""

from collections.abc import Mapping
from typing import Any

from ..evidence.evidence import Evidence, NotMeasuredError
from ..thresholds import Thresholds
from .decision import Decision
from .judge import judge


def judge_again(numbers: Mapping[str, Any], limits: Thresholds) -> Decision:
    """The verdict on the evidence in what ``Diagnosis.to_json`` wrote, with these thresholds.

    The search is not made again, though thresholds steer it, too: what it would have found with these is not asked.

    Raises
    ------
    ValueError
        If there is no evidence of this version in it, or the verdict rests on what was not measured then.
    """
    try:
        return judge(Evidence.of_plain(numbers["evidence"]), limits)
    except NotMeasuredError as error:
        raise ValueError(
            f"With these thresholds the verdict asks what was not measured: {error.args[0]} Diagnose again with them as"
            " the defaults in jfsm/diagnosis/thresholds.py."
        ) from None
    except (KeyError, TypeError) as error:
        raise ValueError(
            "`numbers` must be what `Diagnosis.to_json` of this version writes; these have no 'evidence' that can be "
            f"judged, as those of another version ({type(error).__name__}: {error}). Diagnose again with --json."
        ) from None
