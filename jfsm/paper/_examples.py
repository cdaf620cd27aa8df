"""Section 2.3: Examples 1 to 3 with their jumps and kinks found, and section 3: how many functions a trend has."""

from collections.abc import Callable, Iterator

import numpy as np

from ..surrogates import RKPM, Discontinuity, PolynomialTrend, find_discontinuities
from ..systems import EXAMPLES
from ._figures import draw_example, draw_shape_functions
from ._rows import Outcome, Row, Tell

SPACING = 0.01
SUPPORT = 6
"""The paper's a = 6, read as spacings: (8) then reaches twelve of them, to 23 nodes about a state between the ends."""
ORDER = 2
NEIGHBOURS = 4 * SUPPORT - 1
LINES = {  # kind, place, jump or change of slope
    "example_1": (("jump", 6.0, 1.0),),
    "example_2": (("kink", 6.0, 1.6),),
    "example_3": (("jump", 5.0, 1.0), ("kink", 6.0, 1.6)),
}
FIGURES = {"example_1": 5, "example_2": 7, "example_3": 8}


def section_2(tell: Tell) -> Iterator[Outcome]:
    """The maps of the examples with and without enrichment, (47) to (51)."""
    for done, (name, law) in enumerate(EXAMPLES.items()):
        tell(f"section 2: {name.replace('_', ' ')}", done, len(EXAMPLES))
        yield _example(name, law)


def _example(name: str, law: Callable) -> Outcome:
    x = np.round(np.arange(4.0, 7.0 + SPACING / 2, SPACING), 2)[:, None]  # 5 and 6 themselves, as the paper divides
    case = f"{name.replace('_', ' ').capitalize()}"
    force, lines = law(x[:, 0]), find_discontinuities(x, law(x[:, 0]))
    plain = RKPM.fit(x, force, order=ORDER, neighbours=NEIGHBOURS)
    enriched = RKPM.fit(x, force, order=ORDER, neighbours=NEIGHBOURS, across=lines)
    queries = np.linspace(4.0, 7.0, 1201)[:, None]
    places = [place for kind, place, _ in LINES[name] if kind == "jump"]
    clear = np.all(np.abs(queries - np.array([places])) > SPACING, axis=1) if places else np.ones(1201, dtype=bool)
    queries = queries[clear]  # between two readings a jump has no place
    truth = law(queries[:, 0])
    slope = 0.0 if name == "example_1" else 0.8 * np.where(queries[:, 0] < 6.0, -1.0, 1.0)
    found = enriched.evaluate_derivatives(queries, ((0,), (1,)))
    rows = [
        Row(case, "dilation a", "spacings", "6", float(enriched.support(x[150:151]).dilation[0, 0]) / SPACING, 6.0,
            "the paper prints no unit; radius of (8) is 2a"),
        *_line_rows(case, lines, name),
        Row(case, "largest error, plain", "N", None, float(np.max(np.abs(plain.evaluate(queries) - truth))),
            remark="away from a jump by one spacing at least"),
        Row(case, "largest error, enriched", "N", None, float(np.max(np.abs(found[:, 0] - truth))), 0.0, scale=1.0),
        Row(case, "largest error of the slope, enriched", "N/m", None, float(np.max(np.abs(found[:, 1] - slope))), 0.0,
            scale=1.0),
    ]  # fmt: skip
    drawings = {f"figure_{FIGURES[name]}_{name}": draw_example(x, force, plain, enriched)}
    if name != "example_3":
        drawings[f"figure_{FIGURES[name] - 1}_shape_functions"] = draw_shape_functions(
            RKPM.fit(x, np.eye(len(x)), order=ORDER, neighbours=NEIGHBOURS, across=lines), range(196, 205)
        )
    return Outcome(tuple(rows), drawings=drawings)


def _line_rows(case: str, lines: tuple[Discontinuity, ...], name: str) -> list[Row]:
    rows = [Row(case, "lines found", "", str(len(LINES[name])), len(lines), len(LINES[name]))]
    for kind, place, size in LINES[name]:
        line = next((line for line in lines if line.kind == kind), None)
        what = "jump" if kind == "jump" else "change of slope"
        remark = "found without being told; between two readings" if kind == "jump" else "found without being told"
        rows += [
            Row(
                case,
                f"place of the {kind}",
                "m",
                f"{place:g}",
                None if line is None else float(line.offset),
                place,
                remark,
                scale=3.0,
            ),
            Row(
                case,
                what,
                "N" if kind == "jump" else "N/m",
                f"{size:g}",
                None if line is None else float(line.size),
                size,
            ),
        ]
    return rows


def section_3(tell: Tell) -> Iterator[Outcome]:
    """What can be counted in the theory of kriging, and what is amiss in its equations."""
    tell("section 3", 0, 1)
    quadratic, cubic = PolynomialTrend(2), PolynomialTrend(3)
    case = "Kriging, equations 52 to 69"
    yield Outcome(
        (
            Row(case, "p of a quadratic trend, l = 3", "", "10", len(quadratic.exponents(3)), 10, "(53)"),
            Row(case, "p of a quadratic trend, l = 2", "", "10", len(quadratic.exponents(2)), 6,
                "section 5 prints ten coefficients for l = 2: by its own formula p = 6, ten is a full cubic"),
            Row(case, "p of a cubic trend, l = 2", "", "10", len(cubic.exponents(2)), 10),
            Row(case, "(67)", remark="drops the n/2 that (66) leaves in (64); same minimum, another value"),
            Row(case, "(68)", remark="prints R r0 in the place of R"),
        )
    )  # fmt: skip
