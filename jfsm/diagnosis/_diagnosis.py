"""The outcome of a diagnosis, as a value."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import jax

from .._result import Estimate
from ..identification import Mode
from ..records import OutUnits, out_units
from ..structures import Cause, Structure, causes
from .advice.next_test import Leading, Proposal, proposals
from .evidence.free_runs import Gain
from .verdict.decision import Decision, Explanation

FOUND = 0.99
"""Probability of a sensor's fault that shows without a search: far beyond noise, and yet a record may lie."""


@dataclass(frozen=True)
class Finding:
    """One named cause, or one own value that is wrong.

    Attributes
    ----------
    cause, family : str
        Id of the cause, and of its family.
    at : tuple
        Its place: a link (i, j), or a channel.
    probability : float
        Of the cause, with or without other effects.
    parameters : dict
        Its numbers.
    rivals : tuple of Rival
        Causes that may stand in its place.
    sentence : str
    kind : str
        The narrowest class of laws that is sure to act there, in words.
    kind_probability : float
        Of the class.
    law_open : bool
        Whether the class is sure and the law is not: then `cause` is the most probable of its `members`.
    members : dict
        Probability of every cause of the class that has a chance.
    size : Estimate or None
        What all members share: friction [N] by the energy that it takes over the way, the damping or the stiffness that
        is added, or the rms of the force, along the motion that was measured. The interval holds that of every member.
    """

    cause: str
    family: str
    at: tuple
    probability: float
    parameters: dict[str, Estimate]
    rivals: tuple["Rival", ...] = ()
    sentence: str = ""
    kind: str = ""
    kind_probability: float = 0.0
    law_open: bool = False
    members: dict[str, float] = field(default_factory=dict)
    size: Estimate | None = None

    @classmethod
    def of_sensor(
        cls,
        cause: Cause,
        at: tuple,
        name: str,
        size: Estimate,
        sentence: str,
        kind: str,
        rivals: tuple["Rival", ...] = (),
    ) -> "Finding":
        """A sensor's fault that was found without a search: its one number by name, and what class it is of."""
        return cls(
            cause.id, cause.family, at, FOUND, {name: size}, rivals, sentence, kind, FOUND,
            members={cause.id: FOUND}, size=size,
        )  # fmt: skip


@dataclass(frozen=True)
class Rival:
    """Another cause that this record cannot rule out."""

    cause: str
    at: tuple
    probability: float


@dataclass(frozen=True)
class CandidateResult:
    """A candidate that was tried.

    `evidence` counts in nats from the refitted model, `error` is its multi-step prediction error per set as a share of
    the signal, `kappa` the smallest share of the refit's excess power that it explains, `why` the reason in words.
    Of one that was fitted, `left` is what it leaves beyond noise and chance, as a share of the signal, `whiteness` the
    largest lag-one correlation of its innovations, and `unfit` the nats that forces of other shapes would gain beside
    it, where that was asked.
    """

    cause: str
    at: tuple
    evidence: float
    error: dict[str, float]
    kappa: float
    probability: float
    parameters: dict[str, Estimate]
    why: str
    left: float | None = None
    whiteness: float | None = None
    unfit: float | None = None


@dataclass(frozen=True, repr=False)
class Diagnosis:
    """What is wrong, why, how sure, and what mending it is worth; see the fields' own classes."""

    verdict: str
    findings: tuple[Finding, ...]
    candidates: tuple[CandidateResult, ...]
    extended: Structure
    refitted: dict[str, Estimate]
    gain: Gain | None
    detectable: dict[str, Estimate]
    noise: dict[str, float]
    notes: tuple[str, ...]
    sentence: str
    advice: str
    told: dict[str, Any]
    """What `data` says, but for what is drawn."""
    drawn: Callable[[], dict[str, Any]]
    """Makes what is drawn. It takes a map of the missing force, which nothing else needs."""
    decision: Decision
    """How the verdict was reached: every check with what was measured, its limit and its outcome."""
    modes: tuple[Mode, ...] = ()
    """Frequency and damping ratio of the modes of the refitted masses, linear springs and dashpots."""
    leading: Leading | None = None
    """The two most probable explanations, where there are two; None otherwise."""
    finished: bool = True
    """Whether everything was looked into; if not, `notes` say what was not."""
    untried: tuple[str, ...] = ()
    """Ids of the causes that a search that was not finished did not try, or not to the end."""

    @cached_property
    def data(self) -> dict[str, Any]:
        """Everything that `to_json` writes and the page shows, as plain types."""
        return {**self.told, **self.drawn()}

    def __repr__(self) -> str:
        return f"<Diagnosis, {self.verdict}{'' if self.finished else ', not finished'}: {self.sentence}>"

    def next_tests(
        self, key: jax.Array | None = None, progress: Callable[[str, int, int], None] | None = None
    ) -> list[Proposal]:
        """Tests that would tell the two most probable causes apart, the one that tells most first.

        Each is simulated with either of them as the truth, and both are fitted to it: some ten seconds a test. Empty
        where there are no two causes to tell apart.

        Parameters
        ----------
        key : jax.random.key, optional
            Source of the noise of the simulated tests; always the same when None.
        progress : callable, optional
            Told of every test: what, tests done, tests in all.
        """
        if self.leading is None:
            return []
        return proposals(self.leading, jax.random.key(0) if key is None else key, progress)

    def why(self, cause: str | None = None) -> Explanation:
        """The checks that decided the verdict, or those of one cause, in words.

        Parameters
        ----------
        cause : str, optional
            Id or name of a cause, also of one that lost early or was never fitted, ``map``, or the key of a hypothesis
            (``given``, ``refitted``, ``coulomb@0-1``).

        Raises
        ------
        ValueError
            If there is no such cause.
        """
        try:
            return self.decision.why(cause)
        except LookupError as error:
            if cause in causes():
                return Explanation(f"{cause} was not looked for.\n")
            raise ValueError(f"`cause` must be the id of a cause; got {cause!r}. {error}") from None

    def print(self, units: OutUnits = None) -> None:
        """Verdict, findings and gain on the terminal, in other units if they are given, as ``"in,lbf,deg"``."""
        from ..reporting import print_diagnosis, shown_in

        with shown_in(out_units(units)):
            print_diagnosis(self.data)

    def plot(self, units: OutUnits = None) -> Any:
        """The pictures of the report as one matplotlib figure; `units` as of `print`."""
        from ..reporting import plot_diagnosis, shown_in

        with shown_in(out_units(units)):
            return plot_diagnosis(self.data)

    def report(self, path: str | Path, units: OutUnits = None) -> None:
        """Write a self-contained HTML page; the file appears whole or not at all. `units` as of `print`."""
        from ..reporting import render_page, shown_in, write_text_atomically

        with shown_in(out_units(units)):
            write_text_atomically(Path(path), render_page(self.data))

    def to_json(self, path: str | Path) -> None:
        """Write every number of the verdict as JSON, in the record's units, which stand beside each."""
        import json

        from ..reporting import write_text_atomically

        write_text_atomically(Path(path), json.dumps(self.data, indent=1, allow_nan=False))
