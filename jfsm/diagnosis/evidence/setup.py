"""What hypotheses are fitted to: a model, records of what it simulates, and how much of each is fitted."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from ..._limit import UNLIMITED, Limit
from ...identification import Colour, Hypothesis, Nuisances, Posterior, prepare_all
from ...plant import Channel, Reconstruction, Swing
from ...records import Record
from ...structures import Structure
from ..hypotheses.initial_values import Begin
from ..hypotheses.parametrisation import Apart, hypothesis
from .fitted import Trial


class Problem(NamedTuple):
    """A model, records as the likelihood sees them, how many samples of each are fitted, what they do not share, and
    how long that may go on.

    `ways` are those in which a force may go between its samples, as long as that is not known.
    """

    model: Structure
    records: Sequence[Nuisances]
    until: Sequence[int]
    apart: Apart = Apart.nothing
    limit: Limit = UNLIMITED
    ways: Sequence[Reconstruction] = ()

    @property
    def first(self) -> Nuisances:
        """The record from whose motion a search begins."""
        return self.records[0]

    @property
    def imposed(self) -> bool:
        """Whether the motion is imposed."""
        return self.first.path is not None

    def resolving(self, starts: Sequence[Structure]) -> "Problem":
        """The same, in steps that are short enough for all of these structures."""
        return self._replace(records=[n.resolving(starts) for n in self.records])

    def weighed(self, structure: Structure) -> "Problem":
        """The same, the noise of its forces acting through the masses of another structure."""
        return self._replace(records=[n.weighed(structure) for n in self.records])

    def of(self, records: Sequence[Record], weighed: Structure) -> "Problem":
        """The same of other records of the same channels, seen as those that they stand for."""
        prepared = prepare_all(records, self.model, self.first.reconstruction)
        both = zip(prepared, self.records, strict=True)
        return self._replace(records=[n.weighed(weighed).knowing(known) for n, known in both])

    def moving(self, swing: Swing) -> "Problem":
        """The same, it being known how the structure moves."""
        return self._replace(records=[replace(n, swing=swing) for n in self.records])

    def knowing(self, other: "Problem") -> "Problem":
        """The same, with what another problem of the same channels tells of these."""
        return self._replace(records=[n.knowing(other.first) for n in self.records])

    def timed(self, reconstruction: Reconstruction, late: Mapping[Channel, float]) -> "Problem":
        """The same, it being known how the force goes between its samples, and which channels of it are so late [s]."""
        return self._replace(records=[n.timed(reconstruction, late) for n in self.records], ways=())

    def as_timed(self, other: "Problem") -> "Problem":
        """The same, with the times of its forces that another problem of the same channels knows."""
        now, then = self.first, other.first
        if (now.reconstruction, dict(now.late)) == (then.reconstruction, dict(then.late)):
            return self._replace(ways=other.ways)
        return self.timed(then.reconstruction, then.late)._replace(ways=other.ways)

    def with_wandering(self, channel: int) -> "Problem":
        """The same, the zero of one more channel wandering."""
        return self._replace(records=[n.with_wandering(sorted((*n.readings.wandering, channel))) for n in self.records])

    def with_colour(self, colour: Colour) -> "Problem":
        """The same, the channels' noise having this colour."""
        return self._replace(records=[n.with_colour(colour) for n in self.records])

    def posterior(
        self, starts: Sequence[Structure], begins: Sequence[Begin | None] = (), *, refit: bool = True
    ) -> Posterior:
        """The posterior of structures that climb side by side."""
        posed = hypothesis(self.model, starts, self.records, refit=refit, begins=begins, apart=self.apart)
        return Posterior(posed, self.records, self.until)

    def posterior_of(self, trial: Trial) -> Posterior:
        """The posterior of a trial, in steps that are short enough for what was found, none longer than fitted."""
        steps = zip(self.records, trial.steps, strict=True)
        records = [n.resolving([trial.structure], least) for n, least in steps]
        return Posterior(Hypothesis((trial.structure,), (trial.unknowns,)), records, self.until)
