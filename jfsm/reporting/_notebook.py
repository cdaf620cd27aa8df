"""What a notebook shows of an object: a line and a table, as plain HTML."""

from collections.abc import Iterable, Sequence
from html import escape
from typing import Any


def notebook_table(caption: str, headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of words under a line of words."""
    head = "".join(f"<th>{escape(each)}</th>" for each in headings)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    title = f"<p>{escape(caption)}</p>" if caption else ""
    return f"{title}<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def channel_table(caption: str, channels: Iterable[tuple[str, str, Any]]) -> str:
    """Channels by name and unit, each with its range and rms; samples that were lost do not count."""
    import numpy as np

    rows = []
    for name, unit, values in channels:
        found = np.asarray(values, float)
        found = found[np.isfinite(found)]
        sizes = (found.min(), found.max(), np.sqrt(np.mean(found**2))) if found.size else ()
        rows.append((name, unit, *(f"{size:.4g}" for size in sizes)))
    return notebook_table(caption, ("channel", "unit", "lowest", "highest", "rms"), rows)
