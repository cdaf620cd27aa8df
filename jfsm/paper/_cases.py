"""Section 4: the constants of each system read off its force state map by RKPM, (72) to (91)."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from ..dynamics import fixed_points, limit_cycles
from ..plant import lower
from ..structures import Coulomb, CubicStiffness, Structure
from ..surrogates import RKPM, Discontinuity, find_discontinuities
from ..surrogates.rkpm.basis import multi_indices
from ..systems import GROUND, cubic_chain
from ._figures import draw_free_vibration, draw_map, draw_orders, draw_section_of_chain
from ._rows import Outcome, Row, Tell, joined
from ._simulated import Run, chain, driven_frame, natural_frequencies, oscillator, rough_oscillator

NEIGHBOURS = 20
"""n* of the smooth oscillators: the paper's (72) gives 10, which some states of a trajectory cannot do with."""
SIDE = 1e-9
"""Distance from a line, as a share of the range, at which its two sides are read."""
CYCLE = 3.0992904174, 2.0234204141
"""Period [s] and amplitude [m] of van der Pol's oscillator with ε = 10, k = 9, by Newton's method on its equation."""

Coefficients = tuple[tuple[str, str, tuple[int, int], float, str, float], ...]
"""Symbol, unit, derivative at the origin, factor on it, printed, truth."""

_LINEAR: Coefficients = (("k", "N/m", (1, 0), 1.0, "9.00", 9.0), ("c", "N s/m", (0, 1), 1.0, "0.12", 0.12))
_CUBIC: Coefficients = (("α", "N/m³", (3, 0), 1 / 6, "10.00", 10.0),)
COEFFICIENTS: dict[str, Coefficients] = {
    "linear": _LINEAR,
    "duffing": _LINEAR + _CUBIC,
    "negative_duffing": (("k", "N/m", (1, 0), 1.0, "-9.00", -9.0), _LINEAR[1], *_CUBIC),
    "van_der_pol": (
        _LINEAR[0],
        ("ε from v", "N s/m", (0, 1), -1.0, "10.00", 10.0),
        ("ε from x² v", "N s/m³", (2, 1), 0.5, "10.00", 10.0),
    ),
}
"""What each smooth oscillator's map must show: Taylor coefficients of the restoring force."""

REST = {  # displacement, printed, stable
    "linear": ((0.0, "0", True),),
    "duffing": ((0.0, "0", True),),
    "negative_duffing": ((-math.sqrt(0.9), "-0.88", True), (0.0, "0", False), (math.sqrt(0.9), "0.89", True)),
    "van_der_pol": ((0.0, "0", False),),
}

TITLES = {
    "linear": "Case 1, linear oscillator (74)",
    "duffing": "Case 1, Duffing's oscillator (75)",
    "negative_duffing": "Case 1, Duffing's oscillator with negative stiffness (76)",
    "van_der_pol": "Case 1, van der Pol's oscillator (77)",
    "bilinear": "Case 4a, bilinear stiffness (90)",
    "coulomb": "Case 4b, dry friction (90)",
    "bilinear_coulomb": "Case 4c, bilinear stiffness and dry friction (90)",
}
FIGURES = {
    "linear": "9", "duffing": "10", "negative_duffing": "11", "van_der_pol": "12",
    "bilinear": "17_20_21", "coulomb": "18_20_22", "bilinear_coulomb": "19_20_23",
}  # fmt: skip


def section_4(tell: Tell) -> Iterator[Outcome]:
    """Cases 1 to 5."""
    parts: list[tuple[str, Callable[[], Outcome]]] = [
        *((TITLES[name], lambda name=name: smooth_case(name)) for name in COEFFICIENTS),
        ("Case 2, frame", frame_case),
        ("Case 3, two masses", cubic_chain_case),
        *((TITLES[name], lambda name=name: rough_case(name)) for name in ("bilinear", "coulomb", "bilinear_coulomb")),
        ("Case 5, two masses with dry friction", friction_chain_case),
    ]
    yield _choices()
    for done, (title, part) in enumerate(parts):
        tell(title, done, len(parts))
        yield part()


def _choices() -> Outcome:
    """n* by (72), and what the paper leaves open about section 4."""
    case = "Case 1, all oscillators"
    return Outcome(
        (
            Row(case, "n* for two columns, order 3", "", "10", len(multi_indices(2, 3)), 10, "(72)"),
            Row(case, "n* here", remark=f"{NEIGHBOURS}: with (72) as it stands some moment matrices are singular"),
            Row(case, "length of the record", remark="not printed; 15 s, as in sections 4.1 and 4.2"),
            Row(case, "a_s, b_s of (78)", remark="not printed; standard normal, drawn anew"),
            Row(case, "window, scaling of x and v", remark="not printed; radial (8) over standard deviations"),
        )
    )


def smooth_case(name: str, seed: int = 0) -> Outcome:
    """Coefficients, points of rest and cycles of one smooth oscillator of section 4.0.

    Parameters
    ----------
    name : str
        In `COEFFICIENTS`.
    seed : int
        Of the drive's coefficients in (78), which are not printed.
    """
    run, case = oscillator(name, seed), TITLES[name]
    force_map = RKPM.fit(run.states, run.force[:, 0], order=3, neighbours=NEIGHBOURS)
    rows = [*coefficient_rows(case, name, force_map), *_rest_rows(case, name, force_map)]
    figure = f"figure_{FIGURES[name]}"
    drawings = {f"{figure}_{name}": draw_map(run, force_map, case)}
    if name == "duffing":
        maps = {order: RKPM.fit(run.states, run.force[:, 0], order=order) for order in (1, 2, 3, 4)}
        rows += _order_rows(case, run, maps)
        drawings[f"{figure}_orders"] = draw_orders(run, maps)
    if name == "van_der_pol":
        rows += cycle_rows(case, force_map)
        drawings[f"{figure}_free_vibration"] = draw_free_vibration(run, force_map)
    return Outcome(tuple(rows), drawings=drawings)


def coefficient_rows(case: str, name: str, force_map: RKPM) -> list[Row]:
    """Taylor coefficients of a map of order 3 at the origin, and the largest of those that must vanish."""
    every = multi_indices(2, 3)
    found = dict(zip(every, np.asarray(force_map.evaluate_derivatives(np.zeros((1, 2)), every))[0], strict=True))
    rows = [
        Row(case, symbol, unit, printed, float(factor * found.pop(orders)), truth)
        for symbol, unit, orders, factor, printed, truth in COEFFICIENTS[name]
    ]
    others = max(abs(float(value)) / math.prod(map(math.factorial, orders)) for orders, value in found.items())
    largest = max(row.truth or 0.0 for row in rows)
    remark = 'the paper: "close to zero"'
    return [*rows, Row(case, "largest other coefficient", "", None, others, 0.0, remark, abs(largest))]


def _rest_rows(case: str, name: str, force_map: RKPM) -> list[Row]:
    """Points of rest of the map, and whether they are stable by (73)."""
    low, high = np.asarray(force_map.box)[:, 0]
    points = fixed_points(Structure([1.0], [force_map.on()]), within=(low, high))
    rows = [Row(case, "fixed points", "", str(len(REST[name])), len(points), len(REST[name]))]
    for x, printed, stable in REST[name]:
        near = min(points, key=lambda point: abs(point.state[0] - x), default=None)
        words = "stable" if stable else "unstable"
        remark = "" if near is None or near.stable == stable else "wrongly told to be " + ("un" * stable) + "stable"
        if abs(float(printed) - x) > 0.01:
            remark = f"√(k/α) of the paper's own k and α; no map of order 3 with these can give {printed}"
        rows.append(
            Row(
                case,
                f"x*, {words}",
                "m",
                printed,
                None if near is None else float(near.state[0]),
                x,
                remark,
                abs(x) or high - low,
            )
        )
    return rows


def _order_rows(case: str, run: Run, maps: dict[int, RKPM]) -> list[Row]:
    """What each order misses, relative to the standard deviation of the force over the visited cells."""
    rows = []
    for order, force_map in maps.items():
        error = run.error_of(force_map, run.visited_cells())
        remark = "the paper tells by eye that order 3 suffices" if order == 3 else ""
        rows.append(Row(case, f"map error, order {order}", "", None, error, 0.0 if order > 2 else None, remark, 1.0))
    return rows


def cycle_rows(case: str, force_map: RKPM) -> list[Row]:
    """Limit cycle of van der Pol's oscillator by its map."""
    cycles = limit_cycles(Structure([1.0], [force_map.on()]))
    cycle = cycles[0] if cycles else None
    remark = "the paper draws it without a number"
    return [
        Row(case, "limit cycles", "", "1", len(cycles), 1),
        Row(case, "period", "s", None, None if cycle is None else cycle.period, CYCLE[0], remark),
        Row(case, "amplitude", "m", None, None if cycle is None else float(cycle.amplitude[0]), CYCLE[1], remark),
    ]


def frame_case() -> Outcome:
    """Case 2: stiffness and damping matrices of the frame, (81).

    All nodes weigh in: a linear force calls for no locality, and the six columns of one short arc are nearly dependent.
    """
    run, case = driven_frame(), "Case 2, frame (82)"
    force_map = RKPM.fit(run.states, run.force, order=1, neighbours=len(np.unique(run.states, axis=0)))
    stiffness = (
        ("1.9539", "0", "0.0366"),
        ("0", "1.9539", "-0.0766"),
        ("0.0366", "-0.0766", "0.0792"),
    )
    damping = (
        ("11.3389", "-0.2256", "0.0035"),
        ("-0.2256", "11.7035", "-0.0072"),
        ("0.0034", "-0.0072", "0.1306"),
    )
    remark = "geometry not printed: M = diag(4.75, 4.75, 0.05032) chosen so that η₁ = 0.02; only I/m and η√m follow"
    found, plant = _slopes(force_map, np.zeros(6)), lower(run.structure)
    rows = [
        *_matrix_rows(case, "K", "10⁴ N/m", stiffness, found[0] / 1e4, np.asarray(plant.stiffness) / 1e4),
        *_matrix_rows(case, "C", "N s/m", damping, found[1], np.asarray(plant.damping)),
        Row(case, "M", "kg", remark=remark),
        Row(case, "(82)", remark="lacks the dot of θ beside c1, wrong sign beside c8; k* of (85) is not used"),
    ]
    return Outcome(tuple(rows))


def _matrix_rows(
    case: str,
    name: str,
    unit: str,
    printed: Sequence[Sequence[str | None]],
    found: Float[np.ndarray, "dof dof"],
    truth: Float[np.ndarray, "dof dof"],
    remarks: Mapping[tuple[int, int], str] = MappingProxyType({}),
) -> list[Row]:
    """Entries of a matrix; where the truth is zero, errors are relative to its diagonal."""
    rows = []
    for i, j in np.ndindex(truth.shape):
        scale = abs(float(truth[i, j])) or math.sqrt(truth[i, i] * truth[j, j])
        entry, words = f"{name}({i + 1},{j + 1})", remarks.get((i + 1, j + 1), "")
        rows.append(Row(case, entry, unit, printed[i][j], float(found[i, j]), float(truth[i, j]), words, scale))
    return rows


def _slopes(force_map: RKPM, state: Float[np.ndarray, " dim"]) -> tuple[np.ndarray, np.ndarray]:
    """K and C at a state, (81)."""
    slopes = np.asarray(force_map.gradient(state))
    return slopes[:, : len(slopes)], slopes[:, len(slopes) :]


def cubic_chain_case() -> Outcome:
    """Case 3: two masses with a cubic spring, (88), n* = 80."""
    run, case = chain("cubic_chain"), "Case 3, two masses with a cubic spring (88)"
    force_map = RKPM.fit(run.states, run.force, order=3, neighbours=80)
    found, plant = _slopes(force_map, np.zeros(4)), lower(run.structure)
    stiffness, damping = (("360.00", "-240.00"), ("-240.00", "240.00")), (("0.6913", "-0.3132"), ("-0.3132", "0.5347"))
    third = {(2, 2): "not -C(1,2) as in (88): a modal matrix needs a third dashpot, 0.2215 N s/m to ground"}
    rows = [
        *_matrix_rows(case, "K", "N/m", stiffness, found[0], np.asarray(plant.stiffness)),
        *_matrix_rows(case, "C", "N s/m", damping, found[1], np.asarray(plant.damping), third),
        _alpha_row(case, force_map, np.zeros(4)),
        Row(case, "(89)", remark="prints k12 and k21 as slopes of f2 along x2; meant are those of f1 and f2 crosswise"),
    ]
    return Outcome(tuple(rows))


def _alpha_row(case: str, force_map: RKPM, state: Float[np.ndarray, " 4"]) -> Row:
    found = float(force_map.derivative(state, (3, 0, 0, 0))[0]) / 6
    return Row(case, "α", "N/m³", "1000.00", found, 1000.0)


def rough_case(name: str) -> Outcome:
    """Case 4: bilinear stiffness, dry friction or both, (90), n* = 50, the lines found in the readings."""
    run, case = rough_oscillator(name), TITLES[name]
    values = run.structure.values()
    states, force = run.states[run.moving], run.force[run.moving, 0]
    lines = find_discontinuities(states, force)
    force_map = RKPM.fit(states, force, order=3, neighbours=50, across=lines)
    kink, jump = (_along(lines, axis) for axis in (0, 1))
    middle = np.array([float(line.offset) if line else 0.0 for line in (kink, jump)])
    side = SIDE * np.ptp(states, axis=0)
    before, after, below = (middle + side * signs for signs in ((-1, 1), (1, 1), (-1, -1)))
    slopes = {sign: np.asarray(force_map.gradient(state)) for sign, state in (("-", before), ("+", after))}
    no_number = 'the paper: "match very well", no number'
    rows = [
        Row(case, "lines found", "", None, len(lines), 2 if name == "bilinear_coulomb" else 1),
        Row(case, "k", "N/m", None, float(slopes["-"][0]), values["stiffness@0-1.k"], no_number),
        Row(case, "c", "N s/m", None, float(slopes["-"][1]), values["damping@0-1.c"], "0.02 of critical; not printed"),
        Row(case, "map error, enriched", "", None, run.error_of(force_map, run.visited_cells()), 0.0, scale=1.0),
        Row(case, "(90)", remark="omits k x; the text finds k from the map, and case 4b would have no spring"),
    ]
    told = "found, not told"
    if name != "coulomb":
        found = float(slopes["+"][0] - slopes["-"][0])
        rows += [
            Row(case, "knot", "m", "0", _offset(kink), 0.0, told, float(np.ptp(states[:, 0]))),
            Row(case, "k_s", "N/m", None, found, values["bilinear_stiffness@0-1.k"], no_number),
        ]
    if name != "bilinear":
        found = float(force_map(before) - force_map(below)) / 2
        rows += [
            Row(case, "jump at v", "m/s", "0", _offset(jump), 0.0, told, float(np.ptp(states[:, 1]))),
            Row(case, "μ", "N", None, found, values["coulomb@0-1.F"], no_number),
        ]
    return Outcome(
        tuple(rows), drawings={f"figures_{FIGURES[name]}_{name}": draw_map(run, force_map, case, across=True)}
    )


def _along(lines: Sequence[Discontinuity], axis: int) -> Discontinuity | None:
    return next((line for line in lines if np.argmax(np.abs(line.normal)) == axis), None)


def friction_chain_case() -> Outcome:
    """Case 5: case 3 with dry friction on the first mass, (91), n* = 120, by both readings of its damping matrix.

    The text takes all of case 3. The printed c₂ = 0.9359 is 2·0.02·ω₂, an entry of the diagonal modal matrix. The
    second reading takes it for the dashpot c₂ of (91), and c₁, which is not printed, for 2·0.02·ω₁ = 0.2901 likewise.
    """
    omega = natural_frequencies(cubic_chain())
    c1, c2 = 2 * 0.02 * omega
    dashpots = np.array([[c1 + c2, -c2], [-c2, c2]])
    modal = np.asarray(lower(cubic_chain()).damping)
    return joined(
        _friction_chain(modal, "Case 5 (91), damping of case 3"),
        _friction_chain(dashpots, "Case 5 (91), dashpots c1 = 2·0.02·ω1, c2 = 2·0.02·ω2"),
    )


def _friction_chain(damping: Float[np.ndarray, "2 2"], case: str) -> Outcome:
    springs = np.asarray(lower(cubic_chain()).stiffness)
    structure = Structure.from_matrices(np.eye(2), springs, damping)
    run = chain(structure + CubicStiffness(1000.0, at=GROUND) + Coulomb(5.0, at=GROUND))
    states, force = run.states[run.moving], run.force[run.moving]
    lines = find_discontinuities(states, force[:, 0])
    force_map = RKPM.fit(states, force, order=3, neighbours=120, across=lines)
    jump, velocity = _along(lines, 2), np.array([0, 0, 1, 0])
    middle, side = velocity * (_offset(jump) or 0.0), velocity * SIDE * np.ptp(states, axis=0)
    friction = float(force_map(middle + side)[0] - force_map(middle - side)[0]) / 2
    found = _slopes(force_map, middle + side)
    stiffness, wrong = (("360.00", "-238.09"), ("-240.00", "240.00")), {(1, 2): "contradicted by the paper's K(2,1)"}
    dashpots = (None, "-0.9359"), ("-0.9359", "-0.9359")
    sign = {(2, 2): "printed with a wrong sign: c22 = c2 in (89)", (1, 1): "not printed: Figure 24 has no number"}
    rows = [
        Row(case, "jump at v1", "m/s", "0", _offset(jump), 0.0, "found, not told", float(np.ptp(states[:, 2]))),
        *_matrix_rows(case, "K", "N/m", stiffness, found[0], springs, wrong),
        *_matrix_rows(case, "C", "N s/m", dashpots, found[1], damping, sign),
        _alpha_row(case, force_map, middle + side),
        Row(case, "μ", "N", None, friction, 5.0, "the paper reads it off Figure 24, without a number"),
    ]
    name = "dashpots" if np.isclose(damping[0, 1], -damping[1, 1]) else "modal"
    return Outcome(tuple(rows), drawings={f"figure_24_{name}": draw_section_of_chain(run, force_map)})


def _offset(line: Discontinuity | None) -> float | None:
    return None if line is None else float(line.offset)
