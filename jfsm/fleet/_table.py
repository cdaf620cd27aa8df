"""The results of a batch as a table."""

import csv
import io
from collections.abc import Iterator, Sequence
from typing import Any

from ._outcome import Row

COLUMNS = (
    "record", "source", "status", "verdict", "finished", "cause", "at", "probability", "parameter", "value", "low",
    "high", "unit", "closed", "message",
)  # fmt: skip


def csv_of(rows: Sequence[Row]) -> str:
    """One line for every number of every finding; a record without findings has one line."""
    stream = io.StringIO(newline="")
    table: csv.DictWriter[str] = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
    table.writeheader()
    table.writerows(lines_of(rows))
    return stream.getvalue()


def lines_of(rows: Sequence[Row]) -> Iterator[dict[str, Any]]:
    """The lines of the table as dictionaries; what a line has not is left out."""
    for row in rows:
        head = {name: row[name] for name in COLUMNS[1:] if row.get(name) is not None}
        head["record"] = row["name"]
        if not row["findings"]:
            yield head
        for finding in row["findings"]:
            found = {**head, "cause": finding["cause"], "probability": finding["probability"]}
            found["at"] = "-".join(map(str, finding["at"] or ()))
            for name, estimate in finding["parameters"].items() or [("", {})]:
                yield {**found, "parameter": name, **estimate}
