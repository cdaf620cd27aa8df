"""The look of the pictures, and their way into a page: SVG whose colours follow the reader's light or dark theme."""

import io
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from numpy.typing import NDArray

from jfsm.reporting._quantities import power_of_ten

# Colours that everyone can tell apart (Okabe, Ito). On a page each becomes the style variable of the same name.
INK, MUTED, GRID, PAPER = "#1c2733", "#64717f", "#dde3e9", "#fefefe"
MEASURED, BEFORE, REFITTED, AFTER, FLOOR = "#aab4bf", "#d95f02", "#b07aa1", "#0072b2", "#8c98a4"
VARIABLES = {
    INK: "ink",
    MUTED: "muted",
    GRID: "grid",
    PAPER: "paper",
    MEASURED: "measured",
    BEFORE: "before",
    REFITTED: "refitted",
    AFTER: "after",
    FLOOR: "floor",
}

STYLE: dict[Any, Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": MUTED,
    "axes.facecolor": "none",
    "axes.formatter.useoffset": False,
    "axes.grid": True,
    "axes.labelcolor": INK,
    "axes.labelsize": 9.0,
    "axes.linewidth": 0.6,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlecolor": INK,
    "axes.titlelocation": "left",
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.unicode_minus": True,
    "figure.facecolor": "none",
    "figure.titlesize": 10.0,
    "font.family": ["DejaVu Sans"],
    "font.size": 9.0,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "legend.edgecolor": "none",
    "legend.facecolor": "none",
    "legend.fontsize": 8.5,
    "legend.framealpha": 0.0,
    "legend.labelcolor": INK,
    "lines.solid_capstyle": "round",
    "savefig.facecolor": "none",
    "svg.fonttype": "none",
    "text.color": INK,
    "text.parse_math": False,  # a dollar sign in a channel's name is a dollar sign
    "text.usetex": False,
    "xtick.color": MUTED,
    "xtick.labelcolor": INK,
    "xtick.labelsize": 8.5,
    "ytick.color": MUTED,
    "ytick.labelcolor": INK,
    "ytick.labelsize": 8.5,
}


@contextmanager
def house_style() -> Iterator[None]:
    """Our settings while a picture is made, whatever style the caller has chosen; theirs again afterwards."""
    with mpl.rc_context(STYLE):
        yield


def svg(figure: Figure, name: str) -> str:
    """A figure as an ``<svg>`` element for the inside of a page.

    Ids carry `name`, so that several pictures live on one page; colours are style variables, text is text in the page's
    own font. Nothing points outside the page, and the same figure gives the same characters.
    """
    stream = io.StringIO()
    with mpl.rc_context({**STYLE, "svg.hashsalt": name}):
        absent = dict.fromkeys(("Creator", "Date", "Format", "Type"))
        figure.savefig(stream, format="svg", metadata=absent, dpi=160)
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r'\s(?:xmlns(?::xlink)?|version)="[^"]*"', "", text)
    text = re.sub(r'^<svg[^>]*?(viewBox="[^"]*")[^>]*>', r'<svg \1 aria-hidden="true" focusable="false">', text)
    text = text.replace("xlink:href", "href")
    text = re.sub(r'(\bid="|\bhref="#|url\(#)', rf"\g<1>{name}-", text)
    # Hundredths of a point are finer than any screen, and half the size.
    text = re.sub(r' d="[^"]*"', lambda path: re.sub(r"(\.\d\d)\d+", r"\1", path[0]).replace("\n", " "), text)
    text = re.sub(r"'DejaVu Sans'(?:, [^;\"]*)?", "inherit", text)
    for colour, variable in VARIABLES.items():
        text = text.replace(colour, f"var(--{variable})")
    return text.strip()


def label(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)


def log_axis(axes: Axes, which: Literal["x", "y"]) -> None:
    """Make an axis logarithmic, with powers of ten in the page's own font."""
    axes.set(**{f"{which}scale": "log"})
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_formatter(lambda value, _: power_of_ten(value))
    axis.set_minor_formatter(lambda value, _: "")


def key_on_top(figure: FigureBase, panels: Iterable[Axes]) -> None:
    """One legend for all panels, above them."""
    entries = {}
    for axes in panels:
        entries |= {str(text): handle for handle, text in zip(*axes.get_legend_handles_labels(), strict=True)}
    figure.legend(
        list(entries.values()), list(entries), loc="outside upper right", ncols=len(entries), handlelength=1.6
    )


def key_above(axes: Axes, columns: int) -> None:
    """Legend in one line above the axes, flush right, where no data are."""
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=columns, borderaxespad=0.1, handlelength=1.6)


def dots(
    axes: Axes, x: NDArray[np.float64], y: NDArray[np.float64], colour: str, text: str, width: float = 2.0
) -> None:
    """Points, and an entry in the legend; with a marker each, a page would be ten times as large."""
    points = np.column_stack([x, y])
    points = points[np.isfinite(points).all(axis=1)]
    # One path of dots: strokes hardly long, with round ends.
    half = np.array([np.abs(points[:, 0]).max(initial=0.0) / 2000.0, 0.0])
    ends = np.stack([points - half, points + half], axis=1).reshape(-1, 2)
    strokes = Path(ends, np.tile([Path.MOVETO, Path.LINETO], len(points)))
    strokes.should_simplify = False
    axes.add_patch(PathPatch(strokes, fill=False, edgecolor=colour, linewidth=width, capstyle="round", alpha=0.6))
    axes.plot([], [], ".", color=colour, alpha=0.6, label=text)
