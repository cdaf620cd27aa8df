"""The page of a batch: the verdict on all records first, then effects with their sizes, clusters and every record."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any
from urllib.parse import quote

from matplotlib.figure import FigureBase
from matplotlib.ticker import MaxNLocator
from rich.console import Group
from rich.padding import Padding
from rich.text import Text

from jfsm.reporting._batch_words import batch_sentence, change_lines, effect_name, named
from jfsm.reporting._canvas import AFTER, BEFORE, FLOOR, label
from jfsm.reporting._quantities import ABSENT, interval, percent, quantity, scale_for
from jfsm.reporting._sketch import Sketch, drawn
from jfsm.reporting._summary import Answer
from jfsm.reporting._tables import Table
from jfsm.reporting._template import inline, template
from jfsm.reporting._text import bullets, rich_table, terminal
from jfsm.reporting._wording import VERDICTS, capitalised, cause_name, counted, place_name

Dictionary = Mapping[str, Any]

MOST_PICTURES = 6  # sizes that are drawn
MOST_LINES = 10  # of a list in the terminal
WIDE, ESSENTIAL = 110, ("effect", "place", "records", "size", "mean", "from part to part")


def render_batch(d: Dictionary) -> str:
    """A batch as one self-contained HTML page, made as `render_page` makes that of a diagnosis.

    Parameters
    ----------
    d : mapping
        What ``summary.json`` holds: "records", "effects", "clusters", "changes" and "sentence".

    Returns
    -------
    str
        An HTML document, whose links lead to the pages of the records beside it.
    """
    rows = d["records"]
    judged = [row for row in rows if row["status"] == "done"]
    headline, _, remark = batch_sentence(d).partition(". ")
    return template("batch.html.j2").render(
        version=d.get("jfsm"),
        badge=counted(len(rows), "record"),
        tone=_tone(rows),
        headline=headline.removesuffix("."),
        remark=remark,
        advice="",
        title="Many records",
        record_line=f"{len(judged)} diagnosed",
        answers=list(_answers(d, judged)),
        pictures=inline(drawn(_sketches(d["effects"]))),
        effects=effects_table(d["effects"]),
        clusters=clusters_table(d["clusters"], len(rows)),
        failures=failures_table(rows),
        changes=list(change_lines(d)),
        rows=[_line(row) for row in rows],
        timing="",
    )


def print_batch(d: Dictionary) -> None:
    """The same on the terminal, in short."""
    tables = [
        effects_table(d["effects"]),
        clusters_table(d["clusters"], len(d["records"])),
        failures_table(d["records"]),
    ]
    console, changes = terminal(), list(change_lines(d))
    if console.width < WIDE:
        tables[0] = tables[0].only(*ESSENTIAL)
    more = [f"{len(changes) - MOST_LINES} more"] if len(changes) > MOST_LINES else []
    console.print(
        Group(
            Text(batch_sentence(d), style="bold"),
            Padding("", (0, 0, 0, 0)),
            *(rich_table(table) for table in tables if table.rows),
            *bullets("Since the last batch", [*changes[:MOST_LINES], *more]),
        )
    )


def effects_table(effects: Sequence[Dictionary]) -> Table:
    """One row for every size of every effect."""
    rows = []
    for effect in effects:
        head = (capitalised(effect_name(effect)), place_name(effect["at"]), f"{len(effect['records'])}")
        sizes = effect["sizes"] or [None]
        for place, size in enumerate(sizes):
            rows.append((*(head if place == 0 else ("", "", "")), *_size_cells(size)))
    headings = ("effect", "place", "records", "size", "mean", "95 % interval", "from part to part", "stand out")
    return Table("Effects and their sizes over the records", headings, tuple(rows), frozenset({0, 1, 3, 7}))


def _size_cells(size: Dictionary | None) -> tuple[str, ...]:
    if size is None:
        return (ABSENT,) * 5
    unit, mean = size["unit"], size["mean"]
    share = f" ({percent(size['between'] / abs(mean))})" if size["between"] is not None and mean else ""
    return (
        size["parameter"],
        quantity(mean, unit),
        interval(size["low"], size["high"], unit, mean),
        f"{quantity(size['between'], unit)}{share}",
        named(size["outliers"]) if size["outliers"] else "none",
    )


def clusters_table(clusters: Sequence[Dictionary], total: int) -> Table:
    """Equal verdicts, with the records that have them."""
    rows = tuple(
        (one["verdict"], f"{len(one['records'])}", percent(len(one["records"]) / total), named(one["records"]))
        for one in clusters
    )
    return Table("Records with equal verdicts", ("verdict", "records", "share", "which"), rows, frozenset({0, 3}))


def failures_table(rows: Sequence[Dictionary]) -> Table:
    """Records without a diagnosis, with the reason."""
    failed = tuple((row["name"], row["kind"], row["message"]) for row in rows if row["status"] == "failed")
    return Table("Records without a diagnosis", ("record", "kind", "reason"), failed, frozenset({0, 1, 2}))


def _tone(rows: Sequence[Dictionary]) -> str:
    """The colours of the page: those of the verdict that asks for most attention."""
    if any(row["status"] == "failed" for row in rows):
        return "open"
    tones = {VERDICTS[row["verdict"]].tone for row in rows}
    return next((tone for tone in ("open", "change") if tone in tones), "good")


def _answers(d: Dictionary, judged: Sequence[Dictionary]) -> Iterator[Answer]:
    rows, effects = d["records"], d["effects"]
    good = sum(row["verdict"] == "consistent" for row in judged)
    share = good / len(judged) if judged else None
    yield Answer("Consistent", f"{good} of {len(judged)}", ("nothing beyond noise",), share)
    if effects:
        first = effects[0]
        details = (f"at {place_name(first['at'])}", f"in {len(first['records'])} of {len(judged)} records")
        yield Answer("Most frequent effect", capitalised(effect_name(first)), details, None)
    sizes = [(effect, size) for effect in effects for size in effect["sizes"]]
    if sizes:
        _, size = sizes[0]
        spread = () if size["between"] is None else (f"± {quantity(size['between'], size['unit'])} from part to part",)
        yield Answer(f"Its size, {size['parameter']}", quantity(size["mean"], size["unit"]), spread)
    failed = len(rows) - len(judged)
    yield Answer("Without a diagnosis", f"{failed} of {len(rows)}", ())


def _line(row: Dictionary) -> dict[str, Any]:
    """A record in the table of all, with the link to its page."""
    found = [f"{capitalised(cause_name(one['cause']))} at {place_name(one['at'])}" for one in row["findings"]]
    sizes = [
        f"{name} = {quantity(one['value'], one['unit'])}"
        for finding in row["findings"]
        for name, one in finding["parameters"].items()
    ]
    failed = row["status"] == "failed"
    return {
        "name": row["name"],
        "link": None if failed or not row.get("page") else quote(row["page"]),
        "verdict": f"No diagnosis: {row['kind']}" if failed else VERDICTS[row["verdict"]].label,
        "found": "; ".join(found) or ABSENT,
        "sizes": "; ".join(sizes) or ABSENT,
        "closed": percent(row.get("closed")),
        "begins": (row.get("begins") or "")[:19].replace("T", " "),
    }


def _sketches(effects: Sequence[Dictionary]) -> Iterator[Sketch]:
    """A picture for every size that several records have: each with its interval, and the mean."""
    drawable = [(e, s) for e in effects for s in e["sizes"] if len(s["values"]) > 1][:MOST_PICTURES]
    for place, (effect, size) in enumerate(drawable):
        title = f"{capitalised(effect_name(effect))} at {place_name(effect['at'])}: {size['parameter']}"
        ends = [one["value"] for one in size["values"]]
        unit = size["unit"]
        yield Sketch(
            f"size{place}",
            title,
            "Each record in its order with its 95 % interval; the line is the mean, the band twice the standard "
            "deviation from part to part. Records that stand out are orange.",
            f"{len(ends)} records from {quantity(min(ends), unit)} to {quantity(max(ends), unit)}, "
            f"mean {quantity(size['mean'], unit)}.",
            2.6,
            lambda figure, size=size: _draw(figure, size),
        )


def _draw(figure: FigureBase, size: Dictionary) -> None:
    axes = figure.add_subplot()
    scale = scale_for(size["mean"], size["unit"])
    between = 2 * (size["between"] or 0.0)
    low, high = ((size["mean"] + side * between) / scale.factor for side in (-1, 1))
    axes.axhspan(low, high, color=FLOOR, alpha=0.2, linewidth=0)
    axes.axhline(size["mean"] / scale.factor, color=FLOOR, linewidth=1)
    for place, one in enumerate(size["values"], start=1):
        colour = BEFORE if one["record"] in size["outliers"] else AFTER
        value, low, high = (one[name] / scale.factor for name in ("value", "low", "high"))
        axes.plot([place, place], [low, high], color=colour, linewidth=1)
        axes.plot([place], [value], "o", color=colour, markersize=3.5)
        if one["record"] in size["outliers"]:
            axes.annotate(one["record"], (place, value), xytext=(5, 0), textcoords="offset points", va="center")
    label(axes, "record", f"{size['parameter']} [{scale.unit}]" if scale.unit else size["parameter"])
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
