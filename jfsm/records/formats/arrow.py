"""Columns in Parquet and Feather files, through pyarrow (an optional extra)."""

from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from jfsm.records.formats.base import AbstractFormat, Contents, Lazy, optional_package
from jfsm.records.formats.expansion import require_room
from jfsm.records.formats.headings import headings_of


class ArrowFormat(AbstractFormat):
    """Columns by name; those of instants keep their nanoseconds, and an index of pandas is a column. Read only."""

    name: ClassVar[str] = "Parquet or Feather"
    suffixes: ClassVar[tuple[str, ...]] = (".parquet", ".feather", ".arrow")

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        return begins_with.startswith((b"PAR1", b"ARROW1", b"FEA1"))

    def load(self, path: Path) -> Contents:
        arrow: Any = optional_package("pyarrow", "parquet", path)
        parquet: Any = optional_package("pyarrow.parquet", "parquet", path)
        feather: Any = optional_package("pyarrow.feather", "parquet", path)
        with path.open("rb") as stream:
            is_parquet = stream.read(4) == b"PAR1"

        def columns(names: list[str] | None) -> Any:
            try:
                if is_parquet:
                    require_room(8 * parquet.read_metadata(path).num_rows * len(names or ()), path)
                    return parquet.read_schema(path) if names is None else parquet.read_table(path, columns=names)
                if names is None:
                    _walk(arrow, path)
                table = feather.read_table(path, columns=names, memory_map=False)
                return table.schema if names is None else table
            except (arrow.ArrowInvalid, OSError) as error:
                raise ValueError(
                    f"{path.name} must be a {self.name} file; it cannot be opened as one ({error}), and may be cut "
                    f"short. Write or copy it again."
                ) from error

        schema = columns(None)
        numeric = [
            field.name
            for field in schema
            if arrow.types.is_integer(field.type)
            or arrow.types.is_floating(field.type)
            or arrow.types.is_timestamp(field.type)
            or arrow.types.is_duration(field.type)
        ]
        skipped = [field.name for field in schema if field.name not in numeric]
        headings = headings_of([numeric], len(numeric))
        original = dict(zip(headings.names, numeric, strict=True))

        def column(name: str) -> np.ndarray:
            chunks = columns([original[name]]).column(0)
            if arrow.types.is_timestamp(chunks.type):
                return chunks.cast(arrow.timestamp("ns")).to_numpy()
            return chunks.to_numpy()

        notes = [f"Not numbers, and left out: {', '.join(skipped[:6])}."] if skipped else []
        aliases = dict(headings.aliases)
        if "__index_level_0__" in original and headings.names:
            aliases["time"] = aliases.get("time", ("__index_level_0__",))
        return Contents(Lazy(original, column), headings.units, notes=tuple(notes), aliases=aliases)


def _walk(arrow: Any, path: Path) -> None:
    """Go through the batches one behind the other: what the end of the file says of their places may no longer hold.

    Raises
    ------
    ArrowInvalid
        If one does not begin where that before it ends.
    """
    with arrow.memory_map(str(path)) as source:
        if source.read(6) == b"ARROW1":
            source.seek(8)
            for _ in arrow.ipc.open_stream(source):
                pass
