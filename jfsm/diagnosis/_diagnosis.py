"""The outcome of a diagnosis, as a value."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import jax

from .._result import Estimate
from ..identification import Mode
from ..records import OutUnits, out_units
from ..structures import ForceTable, Structure, causes
from ._finding import CandidateResult, Finding
from .advice.next_test import Leading, Proposal, proposals
from .evidence.free_runs import Gain
from .report.read_back import fields_of
from .verdict.decision import Decision, Explanation


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

    def _repr_html_(self) -> str:
        """What `print` shows, for a notebook."""
        from html import escape

        from ..reporting import diagnosis_text

        return f"<pre>{escape(diagnosis_text(self.told))}</pre>"

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

    def plot(self, ax: Any = None, units: OutUnits = None) -> Any:
        """The pictures of the report as one matplotlib figure, or the force that the model lacks on axes of yours.

        Parameters
        ----------
        ax : two matplotlib axes, optional
            For that force over displacement and over velocity, with the law that was found.
        units : optional
            As of `print`.

        Returns
        -------
        matplotlib figure, or the axes

        Raises
        ------
        ValueError
            If another number of axes is given, or the diagnosis holds no such force.
        """
        from ..reporting import plot_diagnosis, plot_force, shown_in

        with shown_in(out_units(units)):
            return plot_diagnosis(self.data) if ax is None else plot_force(self.data, ax)

    def table(
        self, displacement: Any = None, velocity: Any = None, at: Any = None, path: str | Path | None = None
    ) -> ForceTable:
        """The force that was found over displacement and velocity: of the named laws, or of the map; the model's own
        terms are not in it. Written to `path`, a csv, if given.

        Parameters
        ----------
        displacement, velocity : (n,), (m,) arrays, optional
            By default over the range of the motion that was measured.
        at : (int, int), optional
            The link; by default the only one where something was found.
        path : path, optional

        Raises
        ------
        ValueError
            If no force was found, or it is no function of displacement and velocity; see `Structure.to_table`.
        """
        from .report.found_table import found_table

        table = found_table(self.extended, self.findings, lambda: self.data["curves"], displacement, velocity, at)
        if path is not None:
            table.write(path)
        return table

    def report(self, path: str | Path, units: OutUnits = None) -> None:
        """Write a self-contained HTML page; the file appears whole or not at all. `units` as of `print`."""
        from ..reporting import render_page, shown_in, write_text_atomically

        with shown_in(out_units(units)):
            write_text_atomically(path, render_page(self.data))

    def to_json(self, path: str | Path) -> None:
        """Write every number of the verdict as JSON, in the record's units, which stand beside each."""
        import json

        from ..reporting import write_text_atomically

        write_text_atomically(path, json.dumps(self.data, indent=1, allow_nan=False))

    @classmethod
    def load(cls, path: str | Path) -> "Diagnosis":
        """A diagnosis from what `to_json` wrote.

        What needs the record is not in it: there are no `next_tests`, and `extended` is None where it holds a map or a
        function, which JSON has no place for.

        Raises
        ------
        OSError
            If the file cannot be read.
        ValueError
            If it does not hold the numbers of a diagnosis, is cut short, or another version wrote it.
        """
        from ..reporting import read_diagnosis

        return cls(**fields_of(read_diagnosis(path)))
