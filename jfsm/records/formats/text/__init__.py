"""Columns of numbers in a text file, with whatever stands above them."""

import csv
import json
from pathlib import Path
from typing import ClassVar

import numpy as np

from jfsm.records.formats.base import AbstractFormat, Contents
from jfsm.records.formats.text.lines import encoding_of
from jfsm.records.formats.text.reading import MARK, text_contents

BLOCK = 20_000  # rows that are text at one time when a file is written


class TextFormat(AbstractFormat):
    """CSV, tab- or blank-separated columns; delimiter, decimal mark, headings, units and sampling rate are found."""

    name: ClassVar[str] = "text"
    suffixes: ClassVar[tuple[str, ...]] = (".csv", ".txt", ".dat", ".tsv")

    def recognises(self, begins_with: bytes, path: Path) -> bool:
        return encoding_of(begins_with) is not None

    def load(self, path: Path) -> Contents:
        return text_contents(path)

    def save(self, path: Path, contents: Contents) -> None:
        columns = [np.asarray(array, dtype=np.float64) for array in contents.arrays.values()]
        with path.open("w", encoding="utf-8", newline="") as stream:
            stream.write(MARK + json.dumps(dict(contents.about)) + "\n")
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(contents.arrays)
            writer.writerow(f"[{contents.units.get(name, '1')}]" for name in contents.arrays)
            for begin in range(0, columns[0].size, BLOCK):
                block = np.stack([column[begin : begin + BLOCK] for column in columns], axis=1)
                writer.writerows(map(repr, row) for row in block.tolist())
