"""Noise on every channel: coefficients and map errors of several maps, before and after the motion is estimated."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from ..records import Record
from ..structures import LinearDamping, LinearStiffness, Saturation, SmoothCoulomb, Structure
from ..surrogates import RKPM, AbstractForceStateMap, Kriging, Polynomial
from ..surrogates.rkpm.basis import multi_indices
from ..systems import ALL, GROUND
from ._cases import COEFFICIENTS
from ._kriging import krige
from ._rows import Coefficient, NoiseRow, Outcome, Tell
from ._simulated import MOTION, Run, noisy_oscillator, oscillator

Fit = Callable[[Any, Any], AbstractForceStateMap]
"""Map from states (n, 2) and force (n,)."""

FITS: dict[str, Fit] = {
    "RKPM 3, n* = 10 (72)": lambda states, force: RKPM.fit(states, force, order=3, neighbours=10),
    "RKPM 3, n* = 80": lambda states, force: RKPM.fit(states, force, order=3, neighbours=80),
    "RKPM 3, n* = 320": lambda states, force: RKPM.fit(states, force, order=3, neighbours=320),
    "RKPM, leave-one-out": lambda states, force: RKPM.select(states, force).force_map,
    "kriging, cubic trend": krige,
    "cubic polynomial": lambda states, force: Polynomial.fit(states, force, order=3),
}
"""Maps that are compared, by name."""

LEVELS = 0.0, 0.02, 0.05
"""Standard deviation of the noise over the largest value of each channel, as in section 5."""
SEEDS = 3
"""Drives, each with its own draw of the noise."""
WITHIN = 1.96


def saturating() -> Structure:
    """A truth that is no polynomial: 9 N/m up to ±0.5 m and 3 N/m beyond, 0.12 N s/m, friction 10 N·tanh(v/(1 m/s))."""
    springs = LinearStiffness(9.0, at=GROUND), Saturation(6.0, gap=0.5, at=GROUND)
    return Structure([1.0], [*springs, LinearDamping(0.12, at=GROUND), SmoothCoulomb(10.0, 1.0, at=GROUND)])


SYSTEMS: dict[str, Callable[[], Structure]] = {
    **{name: ALL[name] for name in ("duffing", "negative_duffing", "van_der_pol")},
    "tanh friction, saturating spring": saturating,
}
"""Truths, by name."""


def section_noise(tell: Tell) -> Iterator[Outcome]:
    """The table of `noise_rows` with its defaults, system by system."""
    for before, (name, system) in enumerate(SYSTEMS.items()):

        def told(what: str, done: int, total: int, before: int = before) -> None:
            tell(what, before * total + done, len(SYSTEMS) * total)

        yield Outcome(noise=noise_rows(systems={name: system}, progress=told))


def noise_rows(
    fits: Mapping[str, Fit] = FITS,
    systems: Mapping[str, Callable[[], Structure]] = SYSTEMS,
    levels: Sequence[float] = LEVELS,
    seeds: int = SEEDS,
    progress: Tell = lambda what, done, total: None,
) -> tuple[NoiseRow, ...]:
    """Medians over several drives and draws of the noise, for every system, level, treatment and map.

    Parameters
    ----------
    fits : mapping of name to function
        Each makes a map from states (n, 2) and force (n,).
    systems : mapping of name to function
        Each returns a structure of one degree of freedom; coefficients are read for names in `COEFFICIENTS`.
    levels : sequence of float
        Standard deviation of the noise on every channel over the channel's largest value, as in section 5; 0 leaves
        the readings as they are.
    seeds : int
        Number of drives.

    Returns
    -------
    tuple of NoiseRow

    Notes
    -----
    Raw states and force are the readings and (2). Smoothed ones are those of `estimate_motion`, the force g - m a with
    the smoothed acceleration and the force channel as it was read. Their errors are correlated in time, which the
    standard error of a map does not know: `covered` tells how often it is enough. Noise in the states also draws
    coefficients towards zero, whichever way the map is made.
    """
    trials: dict[tuple[str, float, str, str], list[_Trial]] = {}
    runs = list(product(systems, range(seeds)))
    for done, (name, seed) in enumerate(runs):
        run = oscillator(systems[name](), seed)
        for part, level in enumerate(levels):
            progress(
                f"noise on {name}: drive {seed + 1}, {level:.0%}", done * len(levels) + part, len(runs) * len(levels)
            )
            if systems[name] is ALL.get(name):
                readings = noisy_oscillator(name, seed, level)
            else:
                readings = run.noisy(level, np.random.default_rng([seed, round(1e6 * level)]))
            for treated, seen in {"raw": readings, **({"smoothed": smoothed(readings)} if level else {})}.items():
                for fit, learn in fits.items():
                    trial = _Trial.of(name, run, learn(seen.states, seen.force[:, 0]))
                    trials.setdefault((name, level, treated, fit), []).append(trial)
    order = sorted(trials, key=lambda key: (list(systems).index(key[0]), key[1]))  # stable: the rest as it came
    return tuple(_row(*key, trials[key]) for key in order)


def smoothed(run: Run) -> Run:
    """The run with displacement, velocity and acceleration as `estimate_motion` finds them."""
    motion: dict[str, Any] = {kind: getattr(run.motion, kind) for kind in MOTION}
    return replace(run, record=Record(run.record.time, force=run.record.force, **motion))


@dataclass(frozen=True)
class _Trial:
    """One map: its errors, and (value, standard error or None) of each coefficient."""

    cells: float
    readings: float
    coefficients: dict[str, tuple[float, float | None]]

    @classmethod
    def of(cls, name: str, run: Run, force_map: AbstractForceStateMap) -> "_Trial":
        origin = np.zeros(2)
        found = {}
        for symbol, _, orders, factor, _, _ in COEFFICIENTS.get(name, ()):
            if isinstance(force_map, RKPM) and sum(orders) > force_map.rule.order:
                continue  # a lower order was chosen, which has no such derivative
            value = factor * float(force_map.derivative(origin, orders))
            error = _standard_error(force_map, origin, orders)
            found[symbol] = value, error and abs(factor) * error
        at_readings = run.error_of(force_map, run.states)
        return cls(run.error_of(force_map, run.visited_cells()), at_readings, found)


def _standard_error(force_map: AbstractForceStateMap, state: np.ndarray, orders: tuple[int, int]) -> float | None:
    """Standard error of a derivative, where the map states one."""
    if isinstance(force_map, RKPM) and force_map.rule.neighbours <= len(multi_indices(2, force_map.rule.order)):
        return None  # no residual is left to tell it by
    return float(force_map.std(state, orders)) if isinstance(force_map, RKPM | Kriging) else None


def _row(name: str, level: float, states: str, fit: str, trials: list[_Trial]) -> NoiseRow:
    errors = [trial.cells for trial in trials]
    coefficients = {}
    for symbol, _, _, _, _, truth in COEFFICIENTS.get(name, ()):
        pairs = [trial.coefficients[symbol] for trial in trials if symbol in trial.coefficients]
        if not pairs:
            continue
        spreads = [(value, error) for value, error in pairs if error is not None]
        coefficients[symbol] = Coefficient(
            float(np.median([value for value, _ in pairs])),
            truth,
            float(np.median([error for _, error in spreads])) if spreads else None,
            float(np.mean([abs(value - truth) <= WITHIN * error for value, error in spreads])) if spreads else None,
        )
    at_readings = float(np.median([trial.readings for trial in trials]))
    return NoiseRow(
        name, level, states, fit, float(np.median(errors)), float(np.max(errors)), at_readings, coefficients
    )
