"""File formats, by suffix. A new one is a file in this folder and a line here."""

from pathlib import Path

from jfsm.records.formats.base import AbstractFormat
from jfsm.records.formats.base import Contents as Contents
from jfsm.records.formats.hdf5 import Hdf5Format
from jfsm.records.formats.mat import MatFormat
from jfsm.records.formats.mdf import MdfFormat
from jfsm.records.formats.npz import NpzFormat
from jfsm.records.formats.tdms import TdmsFormat
from jfsm.records.formats.text import TextFormat
from jfsm.records.formats.uff import UffFormat

FORMATS: tuple[AbstractFormat, ...] = (
    TextFormat(),
    NpzFormat(),
    MatFormat(),
    Hdf5Format(),
    UffFormat(),
    TdmsFormat(),
    MdfFormat(),
)


def format_of(path: Path) -> AbstractFormat:
    """The format that a file's suffix stands for.

    Raises
    ------
    ValueError
        If there is none.
    """
    for candidate in FORMATS:
        if path.suffix.lower() in candidate.suffixes:
            return candidate
    known = " ".join(suffix for candidate in FORMATS for suffix in candidate.suffixes)
    raise ValueError(f"`path` must end in one of {known}; it was {path.name!r}. Rename or convert the file.")
