"""A force state map as a page and as terminal text: how it was learned, what it says at rest, how far to trust it."""

from collections.abc import Iterator, Mapping
from typing import Any

from rich.console import Console, Group
from rich.text import Text

from jfsm.reporting._force_pictures import AXES, describe_map, describe_residual, draw_map, draw_residual
from jfsm.reporting._quantities import digits_for, interval, percent, probability, quantity, with_error
from jfsm.reporting._sketch import Picture, Sketch, drawn
from jfsm.reporting._summary import Answer
from jfsm.reporting._tables import Table
from jfsm.reporting._template import inline, template
from jfsm.reporting._text import answer_grid, bullets, rich_table, terminal
from jfsm.reporting._wording import extent, place_name

Dictionary = Mapping[str, Any]


def render_force_map(d: Dictionary) -> str:
    """A force state map as one self-contained HTML page, made as `render_page` makes that of a diagnosis.

    Parameters
    ----------
    d : mapping
        ``MappedForce.data``.

    Returns
    -------
    str
        An HTML document.
    """
    return template("force_map.html.j2").render(
        version=None,
        badge="Force state map",
        tone="good",
        headline=_headline(d),
        remark="",
        advice="",
        title=d.get("name") or "a measured record",
        record_line=" · ".join(extent(d)),
        answers=_answers(d),
        pictures=inline(force_map_pictures(d)),
        coefficients=_coefficients_table(d),
        discontinuities=_discontinuities_table(d),
        notes=d["notes"],
        timing="",
    )


def force_map_pictures(d: Dictionary) -> tuple[Picture, ...]:
    """The map over the plane of states, and its cuts along both axes."""
    return drawn(_sketches(d))


def print_force_map(d: Dictionary, console: Console | None = None) -> None:
    """Show in the terminal what is to be known of a force state map, its pictures aside."""
    tables = (_coefficients_table(d), _discontinuities_table(d))
    (console or terminal()).print(
        Group(
            Text(_headline(d), style="bold"),
            Text(""),
            answer_grid(_answers(d)),
            *(rich_table(table) for table in tables if table.rows),
            *bullets("Notes", d["notes"]),
        )
    )


def _force_name(d: Dictionary) -> str:
    return "missing force" if d["lacking"] else "restoring force"


def _headline(d: Dictionary) -> str:
    lacking = " that the model lacks" if d["lacking"] else ""
    return f"The force{lacking} on the {place_name(d['at'])}, over its displacement and velocity"


def _answers(d: Dictionary) -> list[Answer]:
    learned, units = d["learned"], d["units"]
    share = percent(d["error"] / d["spread"]) if d["spread"] else ""
    jumps = len(d["discontinuities"])
    return [
        Answer("Learned by", f"{learned['method']}, order {learned['order']}", (learned["support"],)),
        Answer("Leave-one-out error", quantity(d["error"], units["force"]), (f"{share} of the force's s.d.",)),
        Answer("Discontinuities", str(jumps or "None"), () if jumps else ("the force is smooth",)),
        Answer("Visited", percent(d["visited"]), ("of the box of states",), d["visited"]),
    ]


def _coefficients_table(d: Dictionary) -> Table:
    """Derivatives at the centre."""
    rows = []
    for c in d["coefficients"]:
        value, error, low, high, unit = (c[key] for key in ("value", "error", "low", "high", "unit"))
        shown = quantity(value, unit, digits_for(value, low, high))
        rows.append(
            (f"{c['name']} {c['derivative']}", shown, quantity(error, unit, 2), interval(low, high, unit, value))
        )
    headings = ("coefficient", "value", "standard error", "95 % interval")
    return Table(f"The force at {_centre(d)}", headings, tuple(rows))


def _discontinuities_table(d: Dictionary) -> Table:
    """Where the force jumps or kinks."""
    rows = []
    for edge in d["discontinuities"]:
        unit = d["units"][edge["axis"]]
        size = d["units"]["force"] if edge["kind"] == "jump" else f"{d['units']['force']}/({unit})"
        rows.append(
            (
                edge["kind"],
                f"{edge['axis']} = {quantity(edge['offset'], unit)}",
                interval(edge["low"], edge["high"], unit, edge["offset"]),
                with_error(edge["size"], edge["size_error"], size),
                probability(edge["confidence"]),
            )
        )
    headings = ("kind", "at", "95 % interval", "size ± standard error", "probability")
    return Table("Discontinuities", headings, tuple(rows), frozenset({0, 1}))


def _sketches(d: Dictionary) -> Iterator[Sketch]:
    curves, name, edges = d["curves"], _force_name(d), d["discontinuities"]
    units, points, cuts = d["units"], curves["points"], curves["cuts"]
    yield Sketch(
        "map",
        f"Map of the {name}",
        "Full colours inside the dashed line, where the record has been, with its readings as dots; veiled colours are "
        "extrapolated. The solid line is zero force." + (" Discontinuities are dotted lines." if edges else ""),
        describe_map(curves["map"], units, name),
        5.0,
        lambda figure: draw_map(figure, curves["map"], units, name, points, edges),
    )
    yield Sketch(
        "cuts",
        "Cuts through the map",
        f"Along each axis, through {_centre(d)}; the band is the 95 % interval of the map, and the line "
        "breaks where the record has not been. Beside a discontinuity it is that of one side. The stronger points, "
        "where the other coordinate is near zero, are those to compare with the line.",
        describe_residual(points, cuts, name, "cut through the map"),
        3.9,
        lambda figure: draw_residual(figure, points, cuts, name, "map"),
    )


def _centre(d: Dictionary) -> str:
    x, v = (quantity(value, d["units"][kind]) for value, kind in zip(d["centre"], AXES, strict=True))
    return "rest" if not any(d["centre"]) else f"displacement {x} and velocity {v}, the visited state nearest to rest"
