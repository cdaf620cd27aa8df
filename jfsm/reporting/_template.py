"""Templates of the pages, and what all pages put into them."""

from collections.abc import Iterable
from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, FunctionLoader, StrictUndefined, Template
from markupsafe import Markup

from jfsm.reporting._canvas import svg
from jfsm.reporting._sketch import Picture
from jfsm.reporting._tables import Table


@cache
def template(name: str) -> Template:
    """The template of one kind of page."""
    environment = Environment(
        loader=FunctionLoader(_source), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.globals["is_words"] = _is_words
    environment.filters["unbroken"] = _unbroken
    return environment.get_template(name)


def inline(pictures: Iterable[Picture]) -> dict[str, dict[str, Any]]:
    """Pictures by name, as the templates draw them."""
    return {
        picture.name: {
            "title": picture.title,
            "caption": picture.caption,
            "alt": picture.alt,
            # Safe to take as it is: matplotlib escapes the texts that it writes into an SVG.
            "svg": Markup(svg(picture.figure, picture.name)),
        }
        for picture in pictures
    }


def _source(name: str) -> str:
    return files("jfsm.reporting").joinpath(name).read_text(encoding="utf-8")


def _unbroken(detail: str) -> str:
    """ "displacement 1: 6.83 → 0.298 mm" with its figures on one line."""
    head, colon, figures = detail.rpartition(": ")
    return head + colon + figures.replace(" ", "\N{NO-BREAK SPACE}") if colon else detail


def _is_words(table: Table, column: int) -> bool:
    return column in table.text_columns
