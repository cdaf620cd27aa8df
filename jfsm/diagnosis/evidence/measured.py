"""Trials of records as evidence, and what is behind it: structures, maps and runs over held-out readings."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import jax
import numpy as np

from ..._result import Check
from ...plant import Channel, Reconstruction
from ...structures import Clipping, Structure
from ..channels.clock import Lateness, late_channels, lateness
from ..channels.delays import Late, showing_late
from ..hypotheses.effect import key_of
from ..nats import many
from ..search.climbing import LeftBehind
from ..search.held_out_alone import found_again
from ..search.rounds import Searched
from ..thresholds import THRESHOLDS
from ..verdict.decision import Decision
from .as_recorded import change_by_times
from .evidence import Evidence, Measure, SetAside, Setting, has_map, map_on
from .fitted import Trial
from .found_again import FoundAgain
from .free_runs import Gain, StructureOf, measure_gain
from .held_out import HeldOutErrors
from .identifiable import in_step, untold
from .missing_force import stand_in
from .model_error import forgiving
from .noise_draws import noise_levels
from .prediction import Prediction
from .scorecard import GIVEN, REFITTED, OtherShapes, Scorecard, scorecard
from .setup import Problem
from .split import HeldOut


@dataclass(frozen=True)
class HeldOutRuns:
    """What was held out, the model as it was `stated` and with the clipping that its records show, a source of noise,
    and how a force was `assumed` to go between its samples."""

    stated: Structure
    model: Structure
    held: Sequence[HeldOut]
    key: jax.Array
    assumed: Reconstruction


@dataclass
class Weighed:
    """What was found, as evidence, by the keys of the hypotheses; the looks at the records before, and the channels
    whose signs they turned."""

    found: Searched
    problem: Problem
    clipped: Sequence[Clipping]
    held_out: HeldOutRuns
    looks: Sequence[Check] = ()
    turned: Sequence[Channel] = ()
    model_error: float = 0.0
    maps: dict[str, Trial] = field(default_factory=dict)
    runs: dict[str, tuple[Gain, list[dict]]] = field(default_factory=dict)
    other: "Weighed | None" = None

    @cached_property
    def evidence(self) -> Evidence:
        """Scorecards, and what is measured when it is asked for."""
        measure = Measure(self._other_shapes, self._with_map, self._held_out, self._found_again, self._with_model_error)
        cards = {card.key: card for card in self._cards()}
        return Evidence(
            self._setting(),
            cards,
            measure,
            tuple(set_aside(self.found, cut=self.problem.limit.over)),
            looks=tuple(self.looks),
        )

    def behind(self, decision: Decision) -> "Weighed":
        """What a decision on this evidence rests on."""
        return self.other if decision.model_error and self.other is not None else self

    def trial(self, key: str) -> Trial:
        """The hypothesis of a key."""
        return self.maps[key] if has_map(key) else self._trials[key]

    def gain(self, decision: Decision) -> tuple[Gain | None, list[dict]]:
        """Gain of what is handed out over the model as stated, and the runs behind it, if anything is held out."""
        key = self._handed_out(decision)
        self._held_out(key)
        return self.runs.get(key, (None, []))

    def handed_out(self, decision: Decision) -> StructureOf:
        """What is handed out, by record."""
        key = self._handed_out(decision)
        return (lambda record: self.held_out.model) if key == GIVEN else self.trial(key).extended

    def late(self, decision: Decision) -> Lateness:
        """How late the forces are beside what was decided, by channel."""
        beside = self._trials.get(decision.winner, self.found.refitted)
        return lateness(beside, self.problem, self.held_out.assumed)

    def extended(self, decision: Decision, late: Late) -> Structure:
        """The structure to go on with, as it shows in channels that are so late."""
        key = self._handed_out(decision)
        structure = self.held_out.model if key == GIVEN else self.trial(key).extended()
        return structure if decision.verdict == "consistent" else showing_late(structure, late)

    def _handed_out(self, decision: Decision) -> str:
        """Key of the hypothesis to go on with: never one that runs worse over held-out readings than as given, nor a
        law whose numbers turn on the motion."""
        undecided = decision.verdict == "undecided" and self._refit_is_no_better()
        if decision.verdict == "consistent" or undecided:
            return GIVEN
        return REFITTED if decision.of_a_class_alone else decision.winner

    def _refit_is_no_better(self) -> bool:
        """Whether own values refitted are hardly likelier than as given, or run worse over held-out readings."""
        gained, errors = self.found.refitted.evidence - self.found.given.evidence, self._held_out(REFITTED)
        worse = errors is not None and errors.after > errors.before
        return gained < THRESHOLDS.significant or worse

    @cached_property
    def _trials(self) -> dict[str, Trial]:
        return {t.key: t for t in self.found.every}

    def _setting(self) -> Setting:
        records = self.problem.records
        return Setting(
            periods=float(sum(n.record.duration / n.period for n in records)),
            imposed=self.problem.imposed,
            model_error=self.model_error,
            finished=not self.problem.limit.over,
            clipped=tuple(sensor.at for sensor in self.clipped),
            late=tuple(late_channels(self.held_out.model, self.problem, self.held_out.assumed)),
            late_changes=change_by_times(self.held_out.stated, self.problem.first, self.held_out.assumed),
            turned=tuple(self.turned),
        )

    def _cards(self) -> Iterator[Scorecard]:
        every, problem = self.found.every, self.problem
        why_not_identifiable, stands_for_the_drive = untold(problem.records), in_step(problem.records)
        for t in every:
            if self.model_error:  # laws of time are none here, whatever the records show
                card = scorecard(t, every, problem)
            else:
                card = scorecard(
                    t, every, problem, in_step=stands_for_the_drive(t), not_identifiable=why_not_identifiable(t)
                )
            yield replace(card, prediction=card.prediction.at_floor(self._least_left))

    @cached_property
    def _least_left(self) -> np.ndarray:
        """Error power per set that the best hypothesis leaves."""
        errors = np.array([t.prediction.error for t in self.found.every])
        return np.min(np.where(np.isfinite(errors), errors, np.inf), axis=0)

    def _other_shapes(self, key: str) -> OtherShapes:
        return self.found.lack(self.trial(key))

    def _with_map(self, key: str) -> Prediction | None:
        found = None if self.problem.limit.over else stand_in(self.trial(key), self.problem)
        if found is None:
            return None
        self.maps[map_on(key)] = found
        return found.prediction.at_floor(self._least_left)

    def _held_out(self, key: str) -> HeldOutErrors | None:
        runs = self.held_out
        if not runs.held:
            return None
        if key not in self.runs:
            trial, refitted, first = self.trial(key), self.found.refitted, self.problem.first
            extended = (lambda record: runs.model) if key == GIVEN else trial.extended
            noise = noise_levels(trial, first)
            beyond_refit = has_map(key) or bool(trial.effects)
            self.runs[key] = measure_gain(
                runs.stated,
                refitted.extended,
                extended,
                runs.held,
                noise,
                first,
                runs.key,
                runs.assumed,
                beyond_refit=beyond_refit,
            )
        return self.runs[key][0].errors

    def _found_again(self, key: str) -> FoundAgain | None:
        held, kind = self.held_out.held, self.evidence.cards[key].effects[0].classes[0]
        return found_again(self.trial(key), kind, self.found.causes, self.problem, held) if held else None

    def _with_model_error(self) -> Evidence | None:
        again = None if self.model_error else forgiving(self.found.every, self.problem)
        if again is None:
            return None
        problem, (given, refitted, *trials) = again
        found = self.found.judged_in(problem, given, refitted, trials)
        self.other = Weighed(found, problem, self.clipped, self.held_out, model_error=problem.first.forgiven)
        return self.other.evidence


def set_aside(found: Searched, *, cut: bool) -> Iterator[SetAside]:
    """The candidates that were not fitted to their end, of a search that may have been `cut` short, and why."""
    for behind in found.behind:
        nats = behind.nats if math.isfinite(behind.nats) else None
        yield SetAside(key_of(behind.effects), _why_behind(behind), nats=nats)
    for candidate in found.left_out:
        share = candidate.share or 0.0
        yield SetAside(key_of(candidate.effects), _why_left_out(share, cut=cut), share=share)


def _why_behind(behind: LeftBehind) -> str:
    if math.isinf(behind.nats):
        return "not tried: the time was over"
    met = "not at its top when the time was over" if behind.cut else "not pursued"
    return f"{met}: {many(behind.nats)} nats behind the best where a misfit is still forgiven"


def _why_left_out(share: float, *, cut: bool) -> str:
    rest = "the time was over" if cut else "other laws more"
    return f"not fitted: explains {share:.0%} of the missing force, and {rest}"
