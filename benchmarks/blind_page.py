"""The blind examination as a page: table, who was taken for whom, calibration, gain, time; the figures as JSON."""

import html
import io
import json
import math
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.blind_table import Row, Share, calibration, exact, figures, hidden, kind, said, table

_PAGE = """<!doctype html>
<html lang="en"><meta charset="utf-8"><title>Blind examination</title>
<style>body {{ font: 16px/1.5 sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem }}
pre {{ font-size: 13px; overflow-x: auto }} svg {{ max-width: 100%; height: auto }}</style>
<h1>Blind examination</h1>
<p>{challenges} challenges, seeds {first} to {last}. Right or wrong is seen from the hidden truth.</p>
<h2>Who was taken for whom</h2>{confusion}
<h2>Probability said and share of right answers</h2>{calibration}
<h2>Share of the closable error closed, and time</h2>{gain}
<h2>Figures</h2><pre>{table}</pre>
</html>
"""


def write_page(rows: Sequence[Row], path: Path) -> None:
    """The page at `path`, and beside it the figures as JSON."""
    seeds = [row["seed"] for row in rows]
    page = _PAGE.format(
        challenges=len(rows),
        first=min(seeds),
        last=max(seeds),
        confusion=_confusion(rows),
        calibration=_calibration(rows),
        gain=_gain_and_time(rows),
        table=html.escape(table(rows)),
    )
    path.write_text(page, encoding="utf-8")
    plain = {name.strip(): _plain(figure) for name, figure in figures(rows).items()}
    path.with_suffix(".json").write_text(json.dumps(plain, indent=1), encoding="utf-8")


def _plain(figure: Share | float) -> dict[str, float] | float | None:
    if isinstance(figure, Share):
        low, high = figure.interval()
        return {"hits": figure.hits, "count": figure.count, "low": low, "high": high}
    return None if math.isnan(figure) else figure


def _svg(figure: Figure) -> str:
    """The picture for a page; its text stays text."""
    buffer = io.StringIO()
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": "blind"}):
        figure.savefig(buffer, format="svg", bbox_inches="tight", metadata={"Date": None})
    written = buffer.getvalue()
    return written[written.index("<svg") :]


def _confusion(rows: Sequence[Row]) -> str:
    """Hidden causes down, answers across, with what was never said left out."""
    truths, answers = sorted({hidden(row) for row in rows}), sorted({said(row) for row in rows})
    answers = [t for t in truths if t in answers] + [a for a in answers if a not in truths]
    counts = np.zeros((len(truths), len(answers)), int)
    for row in rows:
        counts[truths.index(hidden(row)), answers.index(said(row))] += 1
    figure = Figure(figsize=(2 + 0.26 * len(answers), 2 + 0.24 * len(truths)))
    axes = figure.add_subplot()
    axes.imshow(np.where(counts, counts / counts.sum(1, keepdims=True), np.nan), cmap="Blues", vmin=0, vmax=1)
    for i, j in zip(*np.nonzero(counts), strict=True):
        shade = "white" if counts[i, j] > counts[i].sum() / 2 else "black"
        axes.text(j, i, str(counts[i, j]), ha="center", va="center", fontsize=7, color=shade)
    axes.set_xticks(range(len(answers)), answers, rotation=90, fontsize=7)
    axes.set_yticks(range(len(truths)), truths, fontsize=7)
    axes.set(xlabel="said", ylabel="hidden")
    return _svg(figure)


def _calibration(rows: Sequence[Row]) -> str:
    """Share of right answers over the probability of the first finding, with Wilson's intervals."""
    figure = Figure(figsize=(5, 4))
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], color="0.7", lw=1)
    for p, share in calibration(rows):
        axes.plot([p, p], share.interval(), color="C0", lw=1)
        axes.plot(p, share.hits / share.count, "o", color="C0", ms=3 + np.sqrt(share.count))
    axes.set(xlabel="probability said", ylabel="share right", xlim=(0, 1.02), ylim=(0, 1.02))
    return _svg(figure)


def _gain_and_time(rows: Sequence[Row]) -> str:
    closed = [row["closed"] for row in rows if kind(row) != "none" and row["closed"] is not None]
    right = [row["seconds"] for row in rows if exact(row)]
    wrong = [row["seconds"] for row in rows if not exact(row)]
    figure = Figure(figsize=(9, 3))
    left, centre = figure.subplots(1, 2)
    _histogram(left, [np.clip(closed, 0, 1)], [""], "share closed")
    _histogram(centre, [right, wrong], ["right", "wrong"], "seconds")
    centre.legend()
    return _svg(figure)


def _histogram(axes: Axes, values: Sequence[Sequence[float] | np.ndarray], labels: Sequence[str], name: str) -> None:
    axes.hist(list(values), bins=20, stacked=True, label=list(labels))
    axes.set(xlabel=name, ylabel="challenges")
