"""A record from a file, or from a table in memory."""

from collections.abc import Mapping
from typing import Any

from jfsm.records._abstract_record import Drive
from jfsm.records._contents import Asked
from jfsm.records._record import Record
from jfsm.records._sources import record_from
from jfsm.records.formats.lookup import ChannelName


def read(
    source: Any,
    *,
    time: str | None = None,
    force: ChannelName = None,
    displacement: ChannelName = None,
    velocity: ChannelName = None,
    acceleration: ChannelName = None,
    base_acceleration: str | None = None,
    units: Mapping[str, str] | None = None,
    sensitivity: Mapping[str, str] | None = None,
    rate: float | None = None,
    where: Mapping[str, str | float] | None = None,
    run: int | str | None = None,
    sheet: int | str | None = None,
    at_rest: bool | None = None,
    drive: Drive | None = None,
    name: str | None = None,
) -> Record:
    """The record in a file, or in a table in memory.

    Parameters
    ----------
    source : str, Path, DataFrame, Dataset or sequence of dict
        A file, told by what it holds, whatever its ending: text, LabVIEW, WAV, NumPy, JSON, MATLAB, HDF5, UFF,
        strong-motion and OpenSim text, motion capture; with extras (``jfsm[excel]``, ``[tdms]``, ``[mf4]``,
        ``[parquet]``, ``[ros]``, ``[px4]``) spreadsheets, TDMS, MDF, Parquet, ROS bags and logs of PX4. docs/files.md
        says what is read of each. In memory: a DataFrame or Series of pandas, a DataFrame of polars, a Table of
        pyarrow, a Dataset or DataArray of xarray, channels after SEP 5. An index, or a coordinate, that holds instants
        is the clock.
    time : str, optional
        Name of the column of instants; otherwise the clock that the channels have in the file, then a column called
        time, t, Zeit, Timestamp and the like, then a single number ``fs`` [Hz] or ``dt`` [s]: beside the channels
        first, then around them; at last the rate that the head of the file states.
    force, displacement, velocity, acceleration : str, sequence of str, or {dof: str}, optional
        Name of the channel: the head of a column with or without its unit, ``column 3`` or ``3``, a variable, a field
        ``struct.field``, a dataset ``group/name``, a node and direction ``3:+Z`` (with the opposite sign if the file
        has it as ``3:-Z``). The columns of a matrix (n, dof) are taken together, or one by one as ``name[0]``,
        ``name[1]``. Without any name the columns called ``force``, ``displacement_2`` and the like are taken, as
        `Record.write` calls them, or all that a universal file says the kind of, their dofs numbered by node.
    base_acceleration : str, optional
        Name of the channel.
    units : mapping, optional
        Unit of each channel by the name it has in the file, or by its kind. What the file itself states is the default.
    sensitivity : mapping, optional
        Of a channel that the file has in raw units, by its name or kind: ``{"a1": "100 mV/g", "force": "2.25 mV/N"}``.
        The numbers are in the raw unit of the sensitivity (mV) unless the file or `units` says another (V).
    rate : float, optional
        Samples per second [Hz] of a file without instants; the clock then begins at 0.
    where : mapping of column to value, optional
        Which rows of a long table to take, as ``{"specimen": "B", "run": 3}``; columns of text may be named, too.
    run : int or str, optional
        Which of several runs that follow one another in the file to take, from 1: segments under headings of their
        own, or stretches between which the clock goes back.
    sheet : int or str, optional
        Which sheet of a spreadsheet, by name or number from 1; needed only where several hold numbers.
    at_rest, drive, name : optional
        As for `Record`. By default what the file says, otherwise not at rest, driven by force, and the file's name.

    Returns
    -------
    Record

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    TypeError
        If `source` is none of these.
    ModuleNotFoundError
        If its format needs an extra that is not installed.
    ValueError
        If the file is of no kind that is read, several runs or sheets leave a choice, a name is not in the file, no
        row is left by `where`, no clock is found, channels have clocks that differ, or the numbers make no `Record`.

    Notes
    -----
    Input and output in two files, or channels of one file on clocks of their own, are read into a record each and
    brought to one clock; pieces of one run are joined::

        record = jfsm.align([jfsm.read("input.mat", force="u"), jfsm.read("output.mat", displacement="y")])
        record = jfsm.join([jfsm.read(path, force="u", displacement="y") for path in ("run_1.csv", "run_2.csv")])

    For anything more involved load the arrays and call `Record` with them.
    """
    asked = Asked(
        wanted=(force, displacement, velocity, acceleration, base_acceleration),
        units=units,
        sensitivity=sensitivity,
        time=time,
        rate=rate,
        run=run,
        at_rest=at_rest,
        drive=drive,
        name=name,
    )
    return record_from(Record, source, asked, where, sheet)
