"""A measured record: the clock, what was read at each instant, and what is done with a record as a whole."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Self

from jfsm._files import as_path
from jfsm.records._abstract_record import AbstractRecord, Drive
from jfsm.records._contents import Asked, contents_of, record_of
from jfsm.records._fold import fold
from jfsm.records._inspect import Inspection, inspect
from jfsm.records._write import write
from jfsm.records.formats.frames import contents_of_frame, frame_of
from jfsm.records.formats.lookup import ChannelName
from jfsm.records.formats.rows import rows_where
from jfsm.records.formats.sep005 import channels_of, contents_of_channels


class Record(AbstractRecord):
    """One run of a test: channels sampled on one clock. Immutable.

    Parameters
    ----------
    time : (n,) array
        Instants [s], increasing; they need not start at 0.
    force, displacement, velocity, acceleration : (n,), (n, dof) or {dof: (n,)} arrays, optional
        What was measured; leave out what was not. Dofs count from 1. Without any force the record is a free decay.
    base_acceleration : (n,) array, optional
        Absolute acceleration of the base; displacement and velocity are then relative to it, acceleration is absolute.
    units : mapping of kind (or "time") to unit, optional
        Units of the numbers as passed, as ``{"force": "kN", "displacement": "mm"}``. They are converted to SI. Raw
        readings (V, A, px, 1) are kept as a set of their own. Without a unit the numbers are kept and taken for SI.
    at_rest : bool
        The structure is known to be at rest at the first sample.
    drive : "force" or "motion"
        Whether the force drives the structure, or the motion is imposed and the force is its answer.
    name : str, optional
        What to call the record in a report.

    Raises
    ------
    TypeError
        If samples are not real numbers.
    ValueError
        If samples are missing or not finite, lengths differ, time does not increase, or a unit or dof does not exist.
    """

    def folded(self, period: int | None = None, *, transient: int = 0) -> Self:
        """The mean period of a record of periodic excitation: n samples become `period` samples with less noise.

        Parameters
        ----------
        period : int, optional
            Length of a period in samples; by default that after which the driving channels repeat themselves.
        transient : int
            Whole periods to leave out at the beginning, before the structure has settled. What is more than a whole
            number of periods is left out there, too.

        Returns
        -------
        Record
            On the clock of the first period that is kept; not at rest. Its notes say what was averaged, by how much
            each channel changed from period to period, and whether the first of the periods had not settled.

        Raises
        ------
        TypeError
            If `period` is not an integer.
        ValueError
            If no period is found, two periods are not left, or time is uneven.
        """
        return fold(self, period, transient)

    def plot(self, ax: Any = None) -> Any:
        """The channels over time, the kinds below one another.

        Parameters
        ----------
        ax : matplotlib axes, optional
            As many as there are kinds of channel; a new figure without them.

        Returns
        -------
        matplotlib axes
            One, or an array of them.

        Raises
        ------
        ValueError
            If another number of axes is given.
        """
        from jfsm.reporting import Line, PanelOf, draw_panels

        panels = []
        for kind in dict.fromkeys(kind for kind, _ in self.channels):
            lines = [Line(f"{kind} {j}", self.time, y) for (other, j), y in self.channels.items() if other == kind]
            words = f"{kind.replace('_', ' ')} [{self.units[kind]}]"
            panels.append(PanelOf(f"time [{self.units.get('time', 's')}]", words, lines))
        return draw_panels(panels, ax)

    def _repr_html_(self) -> str:
        """The channels with their units and sizes, for a notebook."""
        from jfsm.reporting import channel_table

        named = ((f"{kind.replace('_', ' ')} {j}", self.units[kind], y) for (kind, j), y in self.channels.items())
        return channel_table(repr(self).strip("<>"), named)

    def inspect(self) -> Inspection:
        """What an engineer would want to know of the record before trusting it."""
        return inspect(self)

    def write(self, path: str | Path) -> None:
        """Write the record to a file whose suffix says the format; `read` gives it back the same.

        The file appears under its name only when it is complete.

        Raises
        ------
        ValueError
            If the suffix is not one of those that can be written.
        """
        write(self, as_path(path))

    @classmethod
    def from_sep005(
        cls,
        channels: Mapping[str, Any] | Iterable[Mapping[str, Any]],
        *,
        force: ChannelName = None,
        displacement: ChannelName = None,
        velocity: ChannelName = None,
        acceleration: ChannelName = None,
        base_acceleration: str | None = None,
        units: Mapping[str, str] | None = None,
        sensitivity: Mapping[str, str] | None = None,
        at_rest: bool = False,
        drive: Drive = "force",
        name: str | None = None,
    ) -> Self:
        """The record in a list of channels after SEP 5 of SDyPy: dictionaries with `name`, `data`, `unit_str`, and
        `time` [s] or `fs` [Hz].

        The other arguments are those of `jfsm.read`: ``Record.from_sep005(channels, force="F1", acceleration="A1")``.
        Without any name the channels called ``force``, ``displacement_2`` and the like are taken, else those whose
        `quantity` is f, d, v or a, each kind numbered from 1.

        Raises
        ------
        TypeError
            If a channel is not a dictionary.
        ValueError
            If a channel lacks a key, two have one name, clocks differ, or a name is not among them.
        """
        asked = Asked(
            wanted=(force, displacement, velocity, acceleration, base_acceleration),
            units=units,
            sensitivity=sensitivity,
            at_rest=at_rest,
            drive=drive,
            name=name,
        )
        return record_of(cls, contents_of_channels(channels), "`channels`", asked)

    def to_sep005(self) -> list[dict[str, Any]]:
        """The channels after SEP 5 of SDyPy, called ``force_1`` and the like; `from_sep005` takes them back.

        Each has `name`, `data`, `unit_str` and `quantity`, `fs` [Hz] if the clock is uniform, and `time` [s] if it is
        not or does not begin at 0. Whether the structure was at rest, what drives it, the name and the notes are not
        carried.
        """
        return channels_of(contents_of(self))

    @classmethod
    def from_dataframe(
        cls,
        frame: Any,
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
        at_rest: bool = False,
        drive: Drive = "force",
        name: str | None = None,
    ) -> Self:
        """The record in a table in memory, as `jfsm.read` reads it, which takes the same arguments.

        Parameters
        ----------
        frame : DataFrame, Series, Table, Dataset or DataArray
            Of pandas, polars, pyarrow or xarray. The clock is an index or a coordinate that holds instants (dates,
            timedeltas, or numbers [s]), else a column, as in a file. Units stand in the headings, in a second row of
            them, in ``frame.attrs["units"]`` by heading, or in ``attrs["units"]`` of an array of xarray.

        Raises
        ------
        TypeError
            If `frame` is none of these.
        ValueError
            As `jfsm.read`.
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
        contents, called = contents_of_frame(frame), f"the {type(frame).__name__}"
        return record_of(cls, rows_where(contents, called, where) if where else contents, called, asked)

    def to_dataframe(self) -> Any:
        """The channels as a DataFrame of pandas, which must be installed: columns called ``force_1`` and the like over
        the instants [s], and ``attrs["units"]`` with the unit of each; `jfsm.read` takes it back.

        Whether the structure was at rest, what drives it, the name and the notes are not carried.

        Raises
        ------
        ModuleNotFoundError
            If pandas is not installed.
        """
        return frame_of(contents_of(self))
