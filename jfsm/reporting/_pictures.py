"""The pictures of a diagnosis, each made only if the diagnosis holds what it shows."""

from collections.abc import Iterator, Mapping
from typing import Any

from matplotlib.figure import Figure

from jfsm.reporting._canvas import house_style
from jfsm.reporting._course_picture import describe_course, draw_course
from jfsm.reporting._curves import first_channels
from jfsm.reporting._force_pictures import describe_map, describe_residual, draw_map, draw_residual, draw_residual_on
from jfsm.reporting._plots import axes_for
from jfsm.reporting._quantities import percent
from jfsm.reporting._record_picture import describe_record, draw_record
from jfsm.reporting._score_pictures import describe_gain, describe_ranking, draw_gain, draw_ranking, ranked_size
from jfsm.reporting._sketch import WIDTH, Picture, Sketch, drawn
from jfsm.reporting._wording import checked_verdict

MOST_CHANNELS = 3


def pictures(d: Mapping[str, Any]) -> tuple[Picture, ...]:
    """Every picture that a diagnosis has data for, in the order of the page.

    Parameters
    ----------
    d : mapping
        What ``Diagnosis.to_json`` writes; parts may be None or missing, except the verdict.

    Raises
    ------
    ValueError
        If `d` is not the dictionary of a diagnosis.
    """
    return drawn(_sketches(d))


def plot_diagnosis(d: Mapping[str, Any]) -> Figure:
    """All pictures of a diagnosis on one sheet; an empty sheet that says so if there is nothing to draw.

    Raises
    ------
    ValueError
        If `d` is not the dictionary of a diagnosis.
    """
    sketches = list(_sketches(d))
    with house_style():
        if not sketches:
            figure = Figure(figsize=(WIDTH, 1.5), facecolor="white")
            figure.text(0.5, 0.5, "This diagnosis holds no curves to draw.", ha="center", va="center")
            return figure
        heights = [sketch.height for sketch in sketches]
        figure = Figure(figsize=(WIDTH, sum(heights)), layout="constrained", facecolor="white")
        sheets = figure.subfigures(len(sketches), 1, height_ratios=heights, squeeze=False)[:, 0]
        for sheet, sketch in zip(sheets, sketches, strict=True):
            sheet.suptitle(sketch.title, x=0.01, ha="left", fontweight="bold")
            sketch.draw(sheet)
    return figure


def plot_force(d: Mapping[str, Any], ax: Any) -> Any:
    """The two axes with the force that the model lacks over displacement and velocity, and the law that was found.

    Raises
    ------
    ValueError
        If `d` is not the dictionary of a diagnosis, or holds no such force, or `ax` is not two axes.
    """
    checked_verdict(d)
    axes, curves = axes_for(2, ax), d.get("curves") or {}
    residual = curves.get("residual")
    if not residual or not residual.get("force"):
        raise ValueError("`ax` must be left out: this diagnosis holds no force to draw on axes.")
    draw_residual_on(list(axes), residual, curves.get("law"))
    return axes


def _what_runs(holdout: Mapping[str, Any]) -> str:
    forces = all(name.split()[0] == "force" for name in holdout["channels"])
    return "The force that the imposed motion needs," if forces else "Free runs"


def _agreement(residual: Mapping[str, Any]) -> str:
    share = residual.get("agreement")
    return "" if share is None else f" The law lies within twice the map's error at {percent(share)} of the readings."


def _sketches(d: Mapping[str, Any]) -> Iterator[Sketch]:
    checked_verdict(d)
    curves = d.get("curves") or {}
    if (holdout := curves.get("holdout")) and holdout.get("channels"):
        holdout, left_out = first_channels(holdout, MOST_CHANNELS)
        yield Sketch(
            "record",
            "The held-out record",
            f"{_what_runs(holdout)} over data that took no part in the fit; below each, its error." + left_out,
            describe_record(holdout),
            0.4 + 3.6 * len(holdout["channels"]),
            lambda figure: draw_record(figure, holdout),
        )
    residual, law = curves.get("residual"), curves.get("law")
    if residual and residual.get("force"):
        yield Sketch(
            "residual",
            "The residual force",
            "What the simulation leaves over, estimated without assuming a law. The stronger points, where the other "
            "coordinate is near zero, are those to compare with a law's line." + _agreement(residual),
            describe_residual(residual, law),
            3.9,
            lambda figure: draw_residual(figure, residual, law),
        )
    if course := curves.get("course"):
        unit = ((residual or {}).get("unit") or {}).get("force")
        yield Sketch(
            "course",
            "The residual force over time, frequency and past",
            "The band is twice its standard error. What a map of displacement and velocity leaves is correlated with "
            "its own past for a moment, as its error is, and on and on where the force follows time or what drives.",
            describe_course(course, unit),
            5.4,
            lambda figure: draw_course(figure, course, unit),
        )
    if force_map := curves.get("map"):
        units = (residual or {}).get("unit") or {}
        yield Sketch(
            "map",
            "Map of the residual force",
            "Full colours inside the dashed line, where the record has been; veiled colours are extrapolated. "
            "The solid line is zero force.",
            describe_map(force_map, units),
            4.4,
            lambda figure: draw_map(figure, force_map, units),
        )
    if channels := (d.get("gain") or {}).get("channels"):
        yield Sketch(
            "gain",
            "The gain, channel by channel",
            "The floor is what noise in the drive and an uncertain start would leave of a perfect model.",
            describe_gain(channels),
            0.9 + 0.95 * len(channels),
            lambda figure: draw_gain(figure, channels),
        )
    if candidates := d.get("candidates"):
        yield Sketch(
            "ranking",
            "The candidates side by side",
            "A cause has to explain the error on the left and to lead by evidence on the right.",
            describe_ranking(candidates),
            1.0 + 0.3 * ranked_size(candidates),
            lambda figure: draw_ranking(figure, candidates),
        )
