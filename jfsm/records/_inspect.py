"""The first page of an examination: is this record what its owner thinks it is?"""

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from jfsm.records._checks import ChannelSummary, Finding, examine
from jfsm.records._silence import silent_forces

if TYPE_CHECKING:
    from jfsm.records._record import Record

GAP, LONG_GAP = 1.5, 3.5  # median steps: from here on samples are missing; more than two in a row


@dataclass(frozen=True)
class Inspection:
    """What a record shows by itself.

    Attributes
    ----------
    name : str or None
    samples : int
    duration : float
        Seconds.
    sample_rate : float
        Mean rate [Hz].
    channels : tuple of ChannelSummary
        Figures of each channel.
    findings : tuple of Finding
        (severity, channel, message); severity is "info" or "warning".
    """

    name: str | None
    samples: int
    duration: float
    sample_rate: float
    channels: tuple[ChannelSummary, ...]
    findings: tuple[Finding, ...]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, text, lists and dictionaries, as JSON has them."""
        plain = asdict(self)
        return {
            **plain,
            "channels": list(plain["channels"]),
            "findings": [finding._asdict() for finding in self.findings],
        }

    def print(self) -> None:
        """Show the page in the terminal."""
        from rich.console import Console  # only a terminal needs it
        from rich.table import Table

        extent = f"{self.samples} samples over {self.duration:.6g} s at {self.sample_rate:.6g} Hz"
        table = Table(title=f"{self.name or 'Record'}: {extent}", title_justify="left")
        for heading in ("channel", "unit", "minimum", "maximum", "mean", "s.d.", "noise"):
            table.add_column(heading, justify="left" if heading in ("channel", "unit") else "right", no_wrap=True)
        for row in self.channels:
            figures = (row.minimum, row.maximum, row.mean, row.std, row.noise)
            table.add_row(row.channel, row.unit, *("–" if figure is None else f"{figure:.4g}" for figure in figures))
        console = Console()
        console.print(table)
        for severity, channel, message in self.findings:
            style = "bold yellow" if severity == "warning" else "dim"
            console.print(f"{severity:7} {channel}: {message}", style=style, markup=False, highlight=False)


def inspect(record: "Record") -> Inspection:
    """Sampling, gaps, clipping, spikes, offsets, quantisation, noise and coverage of a record."""
    steps = np.diff(record.time)
    findings = [Finding("info", "record", note) for note in record.notes]
    try:
        uniform = record
        dt = record.dt
    except ValueError as error:
        findings.append(Finding("warning", "record", str(error)))
        uniform = record.resample(1.0 / float(np.median(steps)))
        dt = uniform.dt
    missing = np.flatnonzero(steps > GAP * np.median(steps))
    if missing.size:
        longest = int(np.argmax(steps))
        long = steps[longest] > LONG_GAP * np.median(steps)
        message = (
            f"{missing.size} gaps, of at most {steps[longest]:.4g} s (after t = {record.time[longest]:.6g} s). "
            f"{'Do not fit across it: cut the record there.' if long else 'Resampling bridges them.'}"
        )
        findings.append(Finding("warning" if long else "info", "record", message))

    summaries = []
    even = _every_channel(uniform)
    for channel, (unit, samples) in _every_channel(record).items():
        summary, found = examine(channel, unit, samples, even[channel][1], dt)
        summaries.append(summary)
        findings.extend(found)
    findings.extend(_of_the_test(uniform))
    rate = (len(record) - 1) / record.duration
    return Inspection(record.name, len(record), record.duration, rate, tuple(summaries), tuple(findings))


def _every_channel(record: "Record") -> dict[str, tuple[str, np.ndarray]]:
    """Unit and samples of every channel, the base too, by the name shown."""
    shown = {f"{kind} {dof}": (record.units[kind], samples) for (kind, dof), samples in record.channels.items()}
    if record.base_acceleration is not None:
        shown["base_acceleration"] = (record.units["base_acceleration"], record.base_acceleration)
    return shown


def _of_the_test(record: "Record") -> list[Finding]:
    """What the channels together say of the kind of test."""
    forces = [dof for kind, dof in record.channels if kind == "force"]
    silent = silent_forces(record)
    findings = [
        Finding("info", f"force {dof}", "Silent: noise that no response follows counts as zero.") for dof in silent
    ]
    if not record.responses and record.drive == "force":
        findings.append(Finding("warning", "record", "No response was measured: nothing can be compared with a model."))
    if len(silent) == len(forces) and record.base_acceleration is None:
        findings.append(Finding("info", "record", "No force acts: the record is a free decay."))
    return findings
