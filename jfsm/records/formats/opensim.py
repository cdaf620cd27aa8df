"""Storage and motion files of OpenSim (.sto, .mot)."""

from pathlib import Path
from typing import ClassVar

import numpy as np

from jfsm.records.formats.base import AbstractFormat, Contents, unique_names
from jfsm.records.formats.text.lines import TextFile, encoding_of

END = "endheader"
TRANSLATIONS = ("_tx", "_ty", "_tz")  # endings of coordinates that are never in degrees


class OpenSimFormat(AbstractFormat):
    """Columns by label on the column ``time``; angles are in degrees or radians as the header says. Read only."""

    name: ClassVar[str] = "OpenSim storage"
    suffixes: ClassVar[tuple[str, ...]] = (".sto", ".mot")

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        lines = begins_with.decode("latin-1").lower().splitlines() if encoding_of(begins_with) else []
        return any(line.strip() == END for line in lines[:60])

    def load(self, path: Path) -> Contents:
        lines = [line.strip() for _, line in TextFile(path).lines()]
        end = next(place for place, line in enumerate(lines) if line.lower() == END)
        head = dict(_key(line) for line in lines[:end] if "=" in line)
        rows = [(place, line.split()) for place, line in enumerate(lines[end + 1 :], start=end + 2) if line]
        if len(rows) < 3:
            raise ValueError(f"{path.name} must hold labels and rows of numbers below its header. Copy it again.")
        (_, labels), data = rows[0], rows[1:]
        names = unique_names(labels)
        values = np.empty((len(data), len(names)))
        for row, (number, fields) in enumerate(data):
            try:
                values[row] = [float(field) for field in fields]
            except ValueError as error:
                raise ValueError(
                    f"{path.name} must hold {len(names)} numbers in every row; line {number} is "
                    f"{' '.join(fields)[:60]!r}. Repair or remove that line."
                ) from error
        announced = head.get("nrows", head.get("datarows", ""))
        notes: list[str] = []
        if announced.isdigit() and int(announced) != len(data):
            notes.append(f"The file announces {announced} rows; {len(data)} stand in it.")
        units = {"time": "s"} if "time" in names else {}
        degrees = head.get("indegrees", "").lower()
        if degrees in ("yes", "no"):
            unit = "deg" if degrees == "yes" else "rad"
            notes.append(
                f"The header says inDegrees={degrees}: coordinates are in {unit}, those that end in "
                f"{', '.join(TRANSLATIONS)} in m."
            )
            for name in names:
                if name != "time":
                    units[name] = "m" if name.endswith(TRANSLATIONS) else unit
        return Contents({name: values[:, place] for place, name in enumerate(names)}, units, notes=tuple(notes))


def _key(line: str) -> tuple[str, str]:
    key, _, value = line.partition("=")
    return key.strip().lower(), value.strip()
