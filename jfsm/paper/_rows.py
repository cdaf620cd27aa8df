"""What a study returns: numbers beside each other, and drawings that are made when they are asked for."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Tell = Callable[[str, int, int], None]
"""Takes what is done, steps done, steps in all."""
Drawing = Callable[["Figure"], None]
"""Fills an empty figure."""


@dataclass(frozen=True)
class Row:
    """One number of the paper.

    Attributes
    ----------
    case : str
        Heading under which it stands.
    quantity, unit : str
    printed : str or None
        As the paper prints it, with all its digits; None where it prints none.
    ours, truth : float or None
        Found here, and what was simulated.
    remark : str
    scale : float or None
        What errors are relative to; the size of the truth when None.
    """

    case: str
    quantity: str
    unit: str = ""
    printed: str | None = None
    ours: float | None = None
    truth: float | None = None
    remark: str = ""
    scale: float | None = None

    @property
    def error(self) -> float | None:
        """Error of ours relative to `scale`; None where there is nothing to compare."""
        scale = self.scale if self.scale is not None else abs(self.truth or 0.0)
        if self.ours is None or self.truth is None or scale == 0.0:
            return None
        return abs(self.ours - self.truth) / scale

    @property
    def off(self) -> bool:
        """Whether the printed number is not the truth to the digits that are printed."""
        if self.printed is None or self.truth is None:
            return False
        last = 10.0 ** -len(self.printed.partition(".")[2])
        return abs(float(self.printed) - self.truth) > 0.501 * last

    def cells(self) -> tuple[str, ...]:
        """For a table: quantity, unit, paper, ours, truth, relative error."""
        printed = "" if self.printed is None else f"{self.printed} !" if self.off else self.printed
        error = "" if self.error is None else f"{self.error:.1e}"
        return self.quantity, self.unit, printed, _number(self.ours), _number(self.truth), error


@dataclass(frozen=True)
class NoiseRow:
    """How well one map does at one level of noise, over several drives and draws of the noise.

    Attributes
    ----------
    system, states, fit : str
        Truth, "raw" or "smoothed" readings, and name of the map.
    level : float
        Standard deviation of the noise as a share of each channel's largest value.
    map_error : float
        Median over the seeds of the root mean square error over the visited cells, relative to the force's standard
        deviation there.
    worst : float
        The largest of them.
    at_readings : float
        Median of the same over the noise-free states of the motion.
    coefficients : dict of name to Coefficient
        Empty where the truth is no polynomial.
    """

    system: str
    level: float
    states: str
    fit: str
    map_error: float
    worst: float
    at_readings: float
    coefficients: dict[str, "Coefficient"]

    @property
    def case(self) -> str:
        """Heading under which it stands."""
        return f"{self.system.replace('_', ' ')}, {self.level:.0%} noise on every channel"

    def cells(self) -> tuple[str, ...]:
        """For a table: states, map, median error, worst, at the readings."""
        found = self.map_error, self.worst, self.at_readings
        return self.states, self.fit, *(f"{error:.3f}" if error < 10 else f"{error:.0e}" for error in found)


@dataclass(frozen=True)
class Coefficient:
    """A derivative of the map at the origin: medians over the seeds.

    Attributes
    ----------
    value, truth : float
    std : float or None
        Standard error that the map states; None where it states none.
    covered : float or None
        Share of the seeds in which 1.96 of them reach from the value to the truth.
    """

    value: float
    truth: float
    std: float | None
    covered: float | None

    def __str__(self) -> str:
        return f"{self.value:.3g}" if self.std is None else f"{self.value:.3g} ± {self.std:.2g}"


class Table(NamedTuple):
    """What is shown of one case; `notes` are sentences below it."""

    title: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    notes: Sequence[str] = ()


@dataclass(frozen=True)
class Outcome:
    """One section: its rows, and its drawings by the name of their file."""

    rows: tuple[Row, ...] = ()
    noise: tuple[NoiseRow, ...] = ()
    drawings: dict[str, Drawing] = field(default_factory=dict)

    def tables(self) -> Iterator["Table"]:
        """Everything that is to be shown, case by case."""
        for case in dict.fromkeys(row.case for row in self.rows):
            rows = [row for row in self.rows if row.case == case]
            about: dict[str, list[str]] = {}
            for row in rows:
                if row.remark:
                    about.setdefault(row.remark, []).append(row.quantity)
            notes = tuple(f"{', '.join(quantities)}: {remark}" for remark, quantities in about.items())
            shown = [row.cells() for row in rows if row.ours is not None or row.truth is not None]
            yield Table(case, ("quantity", "unit", "paper", "ours", "truth", "error"), shown, notes)
        for case in dict.fromkeys(row.case for row in self.noise):
            noise = [row for row in self.noise if row.case == case]
            headings = ("states", "map", "error", "worst", "at readings")
            yield Table(f"{case}: errors of the map, medians", headings, [row.cells() for row in noise])
            truths = {name: found.truth for row in noise for name, found in row.coefficients.items()}
            if truths:
                headings = ("states", "map", *(f"{name} ({truth:g})" for name, truth in truths.items()))
                shown = [
                    (row.states, row.fit, *(str(row.coefficients.get(name, "")) for name in truths)) for row in noise
                ]
                yield Table(f"{case}: coefficients ± standard error, medians", headings, shown)

    def plain(self) -> dict[str, Any]:
        """For JSON: every field of every row, with the errors and marks that follow from them."""
        return {
            "rows": [asdict(row) | {"error": row.error, "off": row.off} for row in self.rows],
            "noise": [asdict(row) for row in self.noise],
        }


def joined(*outcomes: Outcome) -> Outcome:
    """Several outcomes as one, in their order."""
    drawings: dict[str, Drawing] = {}
    for outcome in outcomes:
        drawings |= outcome.drawings
    return Outcome(
        tuple(row for outcome in outcomes for row in outcome.rows),
        tuple(row for outcome in outcomes for row in outcome.noise),
        drawings,
    )


def _number(value: float | None) -> str:
    if value is None:
        return ""
    if value == 0.0 or abs(value) < 1e-12:
        return "0"
    return f"{value:.7g}" if 1e-3 <= abs(value) < 1e6 else f"{value:.2e}"
