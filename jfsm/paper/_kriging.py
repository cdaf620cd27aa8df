"""Section 5: kriging under noise on every channel, after the motion is estimated; coefficients, rest and cycles."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.interpolate import RectBivariateSpline
from scipy.stats import t as student

from ..dynamics import Response, simulate
from ..estimation._motion import Motion, motion_and_smoother
from ..records import Record, noise_floor
from ..structures import LinearDamping, LinearStiffness, Structure
from ..surrogates import Kriging
from ..surrogates.rkpm.basis import multi_indices
from ..systems import GROUND
from ._cases import COEFFICIENTS, CYCLE, REST
from ._rows import Outcome, Row, Tell
from ._simulated import MOTION, Run, oscillator

LEVELS = 0.02, 0.05
"""Standard deviation of the noise over the largest value of each channel."""
REPETITIONS = 5
"""Drives, each with its own draw of the noise."""
DRAWS = 20
"""Records drawn anew from what was found, for bias and interval of every number."""
PASSES = 2
"""How often bias and scatter are found, each time for the map that the last pass has cleared."""
SECTION = 801
"""Points along v = 0 between which points of rest are looked for."""
TABLE, STEPS, ROUNDS = 64, 2000, 12.0
"""Points of a map's table along each axis, steps of a free motion, and its length [s]: four periods."""

TITLES = {
    "duffing": "Section 5, Duffing's oscillator (75)",
    "negative_duffing": "Section 5, Duffing's oscillator with negative stiffness (76)",
    "van_der_pol": "Section 5, van der Pol's oscillator (77)",
}
PRINTED = {  # at 5 % noise
    "duffing": {"k": "10.50", "c": "0.39", "α": "9.78"},
    "negative_duffing": {"k": "-3.75", "c": "-0.01", "α": "9.57"},
    "van_der_pol": {"k": "9.40", "ε from v": "9.29", "ε from x² v": "-0.09"},
}
"""Coefficients of the paper's trends: β of x, v, x³ and x²v, in the order 1, x, v, x², xv, v², x³, x²v, xv², v³."""
NUMBERS = {
    "duffing": (("51.203", "30.653"), "1637", ("0.1439", "1.3917", "28.657", "4.494")),
    "negative_duffing": (("51.203", "30.653"), "1637", ("0.1439", "1.3917", "28.657", "4.494")),
    "van_der_pol": (("32.789", "41.352"), "2114", ("0.0812", "0.835", "11.764", "4.494")),
}
"""θ of x and v, σ², and noise on displacement, velocity, acceleration and force, as printed."""


@dataclass(frozen=True)
class Finding:
    """A number read off a map.

    Attributes
    ----------
    value : float
        Cleared of its bias.
    low, high : float
        95 % interval.
    truth : float
    """

    value: float
    low: float
    high: float
    truth: float

    @property
    def covered(self) -> bool:
        """Whether the interval holds the truth."""
        return self.low <= self.truth <= self.high


def section_5(tell: Tell) -> Outcome:
    """Duffing's oscillators and van der Pol's at 2 % and 5 % noise, and what is amiss in the printed numbers."""
    rows: list[Row] = []
    cases = list(product(TITLES, LEVELS))
    for done, (name, level) in enumerate(cases):
        tell(f"{TITLES[name]}, {level:.0%} noise", done, len(cases))
        rows += kriging_rows(name, level)
    return Outcome(tuple(rows))


def kriging_rows(name: str, level: float, repetitions: int = REPETITIONS, draws: int = DRAWS) -> list[Row]:
    """Medians over several drives and draws of the noise, beside the paper's numbers, which are at 5 %.

    Parameters
    ----------
    name : str
        In `TITLES`.
    level : float
        Standard deviation of the noise over the largest value of each channel.
    repetitions : int
        Number of drives.
    draws : int
        Records drawn anew for every pass of `findings`.
    """
    case, found = f"{TITLES[name]}, {level:.0%} noise", []
    for seed in range(repetitions):
        run = oscillator(name, seed)
        noisy = run.noisy(level, np.random.default_rng([seed, round(1e6 * level)]))
        found.append(findings(name, noisy, draws, seed))
    printed = PRINTED[name] if level == 0.05 else {}
    rows = []
    for quantity in dict.fromkeys(quantity for one, _ in found for quantity in one):
        every = [one[quantity] for one, _ in found if quantity in one]
        half = np.median([(one.high - one.low) / 2.0 for one in every])
        remark = f"± {half:.2g} in the median; {sum(one.covered for one in every)} of {repetitions} cover the truth"
        truth, unit = every[0].truth, _unit(name, quantity)
        value = float(np.median([one.value for one in every]))
        rows.append(Row(case, quantity, unit, printed.get(quantity), value, truth, remark, abs(truth) or 1.0))
    return rows + (_amiss(name, case, [force_map for _, force_map in found]) if level == 0.05 else [])


def _unit(name: str, quantity: str) -> str:
    units = {symbol: unit for symbol, unit, *_ in COEFFICIENTS[name]} | {"period": "s"}
    return units.get(quantity, "m")


def _amiss(name: str, case: str, maps: Sequence[Kriging]) -> list[Row]:
    """The paper's hyper-parameters and noise levels."""
    theta, variance, noise = NUMBERS[name]
    ours = np.median([0.5 / np.asarray(one.length_scale) ** 2 for one in maps], axis=0)
    copied = "printed alike for both of Duffing's oscillators: copied" if "duffing" in name else ""
    scaled = "θ = 1/(2ℓ²); the paper does not say how x and v are scaled. " + copied
    names = ("displacement", "m"), ("velocity", "m/s"), ("acceleration", "m/s²"), ("force", "N")
    rows = [
        Row(case, "θ of x", "1/m²", theta[0], float(ours[0]), remark=scaled),
        Row(case, "θ of v", "s²/m²", theta[1], float(ours[1]), remark=scaled),
        Row(case, "σ²", "N²", variance, float(np.median([one.process_variance for one in maps])), remark=copied),
        Row(case, "p", "", "10", 10, 10, "called quadratic; ten functions of two columns are a full cubic"),
        *(
            Row(case, f"noise on {kind}", unit, value, remark=copied)
            for (kind, unit), value in zip(names, noise, strict=True)
        ),
    ]
    if "duffing" in name:
        largest = [float(value) / 0.05 for value in noise]
        bound = 9.0 * largest[0] + 10.0 * largest[0] ** 3 + 0.12 * largest[1] + largest[3]
        impossible = f"is 5 % of {largest[2]:.0f} m/s²: no more than {bound:.0f} can go with the other maxima"
        rows.append(Row(case, "noise on acceleration", "m/s²", noise[2], remark=impossible))
    else:
        rows.append(Row(case, "β", remark="no slot of the list holds the 10 of x² v; 0.90 stands in that of x v²"))
    return rows


def krige(states: Any, force: Any, like: Kriging | None = None) -> Kriging:
    """The paper's map: Gaussian correlation, cubic trend; hyper-parameters of `like` are kept.

    Parameters
    ----------
    states, force : (n, 2) and (n,) arrays
        m, m/s; N.
    """
    kept = {} if like is None else {"length_scale": like.length_scale, "nugget": float(like.nugget)}
    return Kriging.fit(states, force, trend="cubic", **kept)


def findings(name: str, readings: Run, draws: int = DRAWS, seed: int = 0) -> tuple[dict[str, Finding], Kriging]:
    """Coefficients, points of rest and period of a map of noisy readings, with intervals, and the map itself.

    Parameters
    ----------
    name : str
        In `TITLES`.
    readings : Run
        Displacement, velocity, acceleration and force with noise.
    draws : int
        At least 2.

    Returns
    -------
    findings : dict of name to Finding
        Coefficients are those of the cubic nearest to the map over the readings. Of every true point of rest the
        nearest found, with all displacements about it at which a force of zero cannot be refused; it is left out if
        there is none, a period if half of the draws have none.

    Notes
    -----
    Errors of smoothed states are neither white nor independent of those of the force, and a smoother flattens peaks:
    standard errors of the map are too small for what is read off it, and coefficients are drawn towards zero. So a
    motion that the map makes, near the estimated one, is simulated, noise as large as was found is added to every
    channel `draws` times, and each record goes the same way, with the smoother and the hyper-parameters kept. The mean
    of what comes out, less what went in, is the bias; the scatter makes the interval, by Student's t. A second pass
    sets out from the map that the first has cleared, whose bias is that of the truth more nearly. Points of rest are
    where the force at v = 0, cleared of its own bias, is zero: they may vanish in a draw, the force does not.
    """
    motion, again = motion_and_smoother(readings.record)
    force = np.asarray(readings.record.force)
    states, forces = _readings_of(motion, force)
    force_map = krige(states, forces)
    low, high = np.asarray(force_map.box)[:, 0]
    line = np.linspace(low, high, SECTION)
    first = _numbers(name, force_map, states, line)
    time, rng = np.asarray(readings.record.time), np.random.default_rng([seed, 5])
    rough, source, sent, drawn = noise_floor(force[:, 0], float(time[1] - time[0])).std, force_map, first, []
    for _ in range(PASSES):
        led, drive = _led(source, motion, force, states)
        drawn, mean = [], np.zeros(len(states))
        for _ in range(draws):
            channels: Any = {
                kind: np.asarray(getattr(led, kind)) + motion.noise[kind] * rng.standard_normal(force.shape)
                for kind in MOTION
            }
            noisy = drive + rough * rng.standard_normal(force.shape)
            found_states, found_forces = _readings_of(again(Record(time, force=noisy, **channels)), noisy)
            one = krige(found_states, found_forces, force_map)
            drawn.append(_numbers(name, one, found_states, line))
            mean += np.asarray(one.evaluate(states)) / draws
        sent = _numbers(name, source, states, line)
        source = krige(states, np.asarray(force_map.evaluate(states) + source.evaluate(states)) - mean, force_map)
    value, half = _cleared(first, sent, np.array(drawn))
    rest = len(first) - SECTION
    truths = [truth for _, _, _, _, _, truth in COEFFICIENTS[name]] + [CYCLE[0]] * (name == "van_der_pol")
    symbols = [symbol for symbol, *_ in COEFFICIENTS[name]] + ["period"] * (name == "van_der_pol")
    found = {
        symbol: Finding(float(value[i]), float(value[i] - half[i]), float(value[i] + half[i]), truth)
        for i, (symbol, truth) in enumerate(zip(symbols, truths, strict=True))
        if np.isfinite(half[i])
    }
    for x, _, stable in REST[name]:
        interval = _crossing(line, value[rest:], half[rest:], x)
        if interval is not None:
            found[f"x* near {x:.2f}, {'' if stable else 'un'}stable"] = Finding(*interval, x)
    return found, force_map


def _cleared(
    first: Float[np.ndarray, " k"], sent: Float[np.ndarray, " k"], drawn: Float[np.ndarray, "draws k"]
) -> tuple[np.ndarray, np.ndarray]:
    """Numbers less the bias between what was sent and what was drawn, and half their 95 % intervals.

    NaN where half of the draws have none.
    """
    count = np.sum(np.isfinite(drawn), axis=0)
    enough = (count > max(1, len(drawn) // 2)) & np.isfinite(first) & np.isfinite(sent)
    drawn, many = np.where(enough, drawn, 0.0), np.maximum(count, 2)
    std = np.nanstd(drawn, axis=0, ddof=1) * np.sqrt(1.0 + 1.0 / many)
    value = first + sent - np.nanmean(drawn, axis=0)
    return np.where(enough, value, np.nan), np.where(enough, student.ppf(0.975, many - 1) * std, np.nan)


def _crossing(
    line: Float[np.ndarray, " k"], force: Float[np.ndarray, " k"], half: Float[np.ndarray, " k"], near: float
) -> tuple[float, float, float] | None:
    """Where the force along a line is zero, nearest to a place, and between what it may be."""
    i = np.flatnonzero((force[1:] < 0.0) != (force[:-1] < 0.0))
    if not i.size:
        return None
    places = line[i] - force[i] * (line[i + 1] - line[i]) / (force[i + 1] - force[i])
    one = int(np.argmin(np.abs(places - near)))

    def end(margin: np.ndarray, x: np.ndarray) -> float:
        """First place from the crossing outwards where zero is refused."""
        beyond = np.flatnonzero(margin > 0.0)
        if not beyond.size:
            return float(x[-1])
        k = int(beyond[0])
        if k == 0 or margin[k - 1] > 0.0:
            return float(x[k])
        return float(x[k - 1] - margin[k - 1] * (x[k] - x[k - 1]) / (margin[k] - margin[k - 1]))

    margin, k = np.abs(force) - half, int(i[one])
    place = float(places[one])
    low = end(np.append(-half[k], margin[k::-1]), np.append(place, line[k::-1]))
    high = end(np.append(-half[k], margin[k + 1 :]), np.append(place, line[k + 1 :]))
    return place, low, high


def _led(
    force_map: Kriging, motion: Motion, force: Float[np.ndarray, "n 1"], states: Float[np.ndarray, "n 2"]
) -> tuple[Response, Float[np.ndarray, "n 1"]]:
    """A motion of the map beside the estimated one, to which spring and dashpot draw it, and all force on the map.

    By itself it would part from that, in a double well soon, and show the map where it knows little.
    """
    spread = states.std(axis=0)
    rate = float(spread[1] / spread[0])
    leads = LinearStiffness(rate**2, at=GROUND), LinearDamping(2.0 * rate, at=GROUND)
    pull = rate**2 * motion.displacement + 2.0 * rate * motion.velocity
    led = simulate(Structure([1.0], [force_map.on(), *leads]), Record(motion.time, force=force + pull, at_rest=True))
    own = rate**2 * np.asarray(led.displacement) + 2.0 * rate * np.asarray(led.velocity)
    return led, force + pull - own


def _readings_of(motion: Motion, force: Float[np.ndarray, "n 1"]) -> tuple[np.ndarray, np.ndarray]:
    """States and restoring force (2) of a unit mass."""
    return np.concatenate([motion.displacement, motion.velocity], axis=1), (force - motion.acceleration)[:, 0]


def _numbers(
    name: str, force_map: Kriging, states: Float[np.ndarray, "n 2"], line: Float[np.ndarray, " k"]
) -> Float[np.ndarray, " numbers"]:
    """What a map says: coefficients, period of van der Pol's oscillator, force along v = 0."""
    exponents = multi_indices(2, 3)
    powers = np.stack([np.prod(states**e, axis=1) for e in map(np.array, exponents)], axis=1)
    cubic = np.linalg.lstsq(powers, np.asarray(force_map.evaluate(states)), rcond=None)[0]
    nearest = dict(zip(exponents, cubic, strict=True))
    found = [
        factor * math.prod(map(math.factorial, orders)) * float(nearest[orders])
        for _, _, orders, factor, _, _ in COEFFICIENTS[name]
    ]
    period = [period_of(force_map)] if name == "van_der_pol" else []
    force = np.asarray(force_map.evaluate(np.stack([line, np.zeros_like(line)], axis=1)))
    return np.concatenate([found, period, force])


def period_of(force_map: Kriging) -> float:
    """Time [s] between the last two upward passages of v = 0 of a free motion; NaN where there are no two."""
    low, high = np.asarray(force_map.box)
    x, v = (np.linspace(low[k], high[k], TABLE) for k in (0, 1))
    grid = np.stack(np.meshgrid(x, v, indexing="ij"), axis=-1).reshape(-1, 2)
    table = RectBivariateSpline(x, v, np.asarray(force_map.evaluate(grid)).reshape(TABLE, TABLE))

    def flow(state: np.ndarray) -> np.ndarray:
        return np.array([state[1], -float(table.ev(state[0], state[1]))])

    step, state, passed = ROUNDS / STEPS, np.array([min(1.0, high[0]), 0.0]), []
    for count in range(STEPS):
        a = flow(state)
        b = flow(state + 0.5 * step * a)
        c = flow(state + 0.5 * step * b)
        d = flow(state + step * c)
        after = state + step / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        if state[1] < 0.0 <= after[1]:
            passed.append((count + state[1] / (state[1] - after[1])) * step)
        state = after
    return passed[-1] - passed[-2] if len(passed) > 1 else math.nan
