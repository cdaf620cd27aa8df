"""A picture before and after it is drawn."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from matplotlib.figure import Figure, FigureBase

from jfsm.reporting._canvas import house_style

WIDTH = 10.0  # inches


@dataclass(frozen=True)
class Sketch:
    """A picture to be drawn: what it is called and says, its height in inches, and how it is drawn."""

    name: str
    title: str
    caption: str
    alt: str
    height: float
    draw: Callable[[FigureBase], None]


@dataclass(frozen=True)
class Picture:
    """A drawn picture.

    Attributes
    ----------
    name : str
        Its id on a page: of a diagnosis "record", "residual", "course", "map", "gain" or "ranking".
    title, caption : str
    alt : str
        The picture in words, numbers included.
    figure : matplotlib.figure.Figure
        Not registered with pyplot: ``figure.savefig(path)`` writes it.
    """

    name: str
    title: str
    caption: str
    alt: str
    figure: Figure


def drawn(sketches: Iterable[Sketch]) -> tuple[Picture, ...]:
    """Each sketch on a sheet of its own."""
    made = []
    for sketch in sketches:
        with house_style():
            figure = Figure(figsize=(WIDTH, sketch.height), layout="constrained")
            sketch.draw(figure)
        made.append(Picture(sketch.name, sketch.title, sketch.caption, sketch.alt, figure))
    return tuple(made)
