"""File formats, told by what a file holds. A new one is a file in this folder and a line here."""

from pathlib import Path

from jfsm.records.formats.ardupilot import ArduPilotFormat
from jfsm.records.formats.arrow import ArrowFormat
from jfsm.records.formats.base import AbstractFormat
from jfsm.records.formats.base import Contents as Contents
from jfsm.records.formats.c3d import C3dFormat
from jfsm.records.formats.catman import CatmanFormat
from jfsm.records.formats.dewesoft import DewesoftFormat
from jfsm.records.formats.hdf5 import Hdf5Format
from jfsm.records.formats.imc import ImcFormat
from jfsm.records.formats.json_columns import JsonFormat
from jfsm.records.formats.lvm import LvmFormat
from jfsm.records.formats.mat import MatFormat
from jfsm.records.formats.mdf import MdfFormat
from jfsm.records.formats.npy import NpyFormat
from jfsm.records.formats.npz import NpzFormat
from jfsm.records.formats.opensim import OpenSimFormat
from jfsm.records.formats.ros import RosFormat
from jfsm.records.formats.scopes import RigolFormat, TektronixFormat
from jfsm.records.formats.spreadsheet import SpreadsheetFormat
from jfsm.records.formats.strangers import is_stranger, refusal
from jfsm.records.formats.strong_motion import CosmosFormat, KnetFormat, PeerFormat
from jfsm.records.formats.tdms import TdmsFormat
from jfsm.records.formats.text import TextFormat
from jfsm.records.formats.uff import UffFormat
from jfsm.records.formats.ulog import UlogFormat
from jfsm.records.formats.wav import WavFormat

# The first that recognises a file reads it; text, which is told by not being anything else, comes last.
FORMATS: tuple[AbstractFormat, ...] = (
    NpzFormat(),
    MatFormat(),
    Hdf5Format(),
    UffFormat(),
    TdmsFormat(),
    MdfFormat(),
    NpyFormat(),
    WavFormat(),
    SpreadsheetFormat(),
    ArrowFormat(),
    RosFormat(),
    UlogFormat(),
    ArduPilotFormat(),
    C3dFormat(),
    ImcFormat(),
    CatmanFormat(),
    DewesoftFormat(),
    LvmFormat(),
    JsonFormat(),
    PeerFormat(),
    CosmosFormat(),
    KnetFormat(),
    OpenSimFormat(),
    TektronixFormat(),
    RigolFormat(),
    TextFormat(),
)

BEGINNING = 4096  # bytes by which a file is told


def format_of(path: Path) -> AbstractFormat:
    """The format of a file, by its first bytes.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If it is of none that is read.
    """
    with path.open("rb") as stream:
        begins_with = stream.read(BEGINNING)
    if not begins_with:
        raise ValueError(f"{path.name} is empty. Write or copy it again.")
    for candidate in FORMATS[:-1]:
        if candidate.recognises(begins_with, path):
            return candidate
    if is_stranger(begins_with, path):
        raise refusal(begins_with, path, None)
    meant = next((each.name for each in FORMATS[:-1] if path.suffix.lower() in each.suffixes), None)
    if not FORMATS[-1].recognises(begins_with, path):
        raise refusal(begins_with, path, meant)
    return FORMATS[-1]


def format_to_write(path: Path) -> AbstractFormat:
    """The format that a file's ending stands for.

    Raises
    ------
    ValueError
        If there is none.
    """
    for candidate in FORMATS:
        if path.suffix.lower() in candidate.suffixes:
            return candidate
    writing = [candidate for candidate in FORMATS if type(candidate).save is not AbstractFormat.save]
    known = " ".join(suffix for candidate in writing for suffix in candidate.suffixes)
    raise ValueError(f"`path` must end in one of {known}; it was {path.name!r}. Choose another ending.")
