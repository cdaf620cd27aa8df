"""The first page of an examination: is this record what its owner thinks it is?"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from jfsm._result import Check
from jfsm.records._abstract_record import AbstractRecord
from jfsm.records._checks import ChannelSummary, Finding, examine
from jfsm.records._coherence import Coherence, coherence
from jfsm.records._comparison import Comparison, Reading
from jfsm.records._consistency import KINDS, comparisons, of_comparisons
from jfsm.records._defects import bridged, spikes
from jfsm.records._figures import capitalised, plus_minus
from jfsm.records._look import look
from jfsm.records._loudest import loudest_part
from jfsm.records._mended import mended
from jfsm.records._noise_floor import SHORTEST, NoiseFloor, noise_floor
from jfsm.records._noise_spectrum import NoiseSpectrum, noise_spectrum
from jfsm.records._out_units import OutUnits, out_units
from jfsm.records._periods import Periods, average
from jfsm.records._plain import plain
from jfsm.records._polarity import is_inverted
from jfsm.records._repeats import copies
from jfsm.records._silence import is_silent
from jfsm.records._spectrum import Spectrum, spectrum
from jfsm.records._trace import Trace

GAP, LONG_GAP = 1.5, 3.5  # median steps: from here on samples are missing; more than two in a row
COHERENT = 0.9  # mean coherence below which it is worth a word
SLOW = 0.1  # of the velocity's standard deviation: below, a point is about to turn
SHOWN_LOOKS = {  # those that no other finding tells, and how serious they are
    "channel_moves": "warning",
    "no_torn_samples": "warning",
    "no_hung_samples": "warning",
    "moves_throughout": "info",
    "scales_agree": "warning",
    "takes_energy": "warning",
    "drive_measured": "info",
}
DISTURBED = 2.0  # times the noise above the signal, that periods differ by


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
    checks : tuple of Check
        What was looked at before anything else, each with its number, its limit and the outcome; `diagnose` does the
        same.
    comparisons : tuple of Comparison
        Displacement, velocity and acceleration of each point against one another.
    spectra : tuple of Spectrum
        Power of each channel over frequency.
    noise : tuple of NoiseSpectrum
        Noise over frequency, of the channels that leave room to see it.
    coherence : tuple of Coherence
        Of each response with the driving channels.
    periods : Periods or None
        Averages over periods, of a record that repeats itself.
    drives : tuple of str
        Channels that drive, silent forces left out; none in a free decay.
    gaps : tuple of (start, end)
        Instants [s] between which samples are missing.
    time : (n,) float array
        Instants of the samples [s].
    traces : tuple of Trace
        The samples of each channel, and which of them are clipped or spikes.
    """

    name: str | None
    samples: int
    duration: float
    sample_rate: float
    channels: tuple[ChannelSummary, ...]
    findings: tuple[Finding, ...]
    time: NDArray[np.float64]
    traces: tuple[Trace, ...]
    checks: tuple[Check, ...] = ()
    drives: tuple[str, ...] = ()
    gaps: tuple[tuple[float, float], ...] = ()
    comparisons: tuple[Comparison, ...] = ()
    spectra: tuple[Spectrum, ...] = ()
    noise: tuple[NoiseSpectrum, ...] = ()
    coherence: tuple[Coherence, ...] = ()
    periods: Periods | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, text, lists and dictionaries, as JSON has them; the samples themselves are left out."""
        return {field: plain(value) for field, value in vars(self).items() if field not in ("time", "traces")}

    def print(self, units: OutUnits = None) -> None:
        """Show channels and findings in the terminal, in other units if they are given, as ``"in,lbf,deg"``."""
        from jfsm.reporting import print_inspection, shown_in

        with shown_in(out_units(units)):
            print_inspection(self.to_dict())

    def report(self, path: str | Path, units: OutUnits = None) -> None:
        """Write a self-contained HTML page: findings, channels over time, noise, spectra and what else there is to see.

        The file appears under its name only when it is complete. `units` as of `print`.

        Raises
        ------
        OSError
            If `path` is not a file in a folder that can be written to; what stood there is still there.
        """
        from jfsm.reporting import render_inspection, shown_in, write_text_atomically

        curves = {"time": self.time, "channels": {trace.channel: vars(trace) for trace in self.traces}}
        with shown_in(out_units(units)):
            write_text_atomically(path, render_inspection({**self.to_dict(), "curves": curves}))


def inspect(record: AbstractRecord) -> Inspection:
    """All that a record shows by itself, with what is wrong first."""
    findings = [Finding("info", "record", note) for note in record.notes]
    gaps = tuple(_gaps(record.time))
    findings.extend(_of_the_clock(record, gaps))
    uniform = record
    try:
        dt = record.dt
    except ValueError:  # said already
        uniform = record.resample(1.0 / float(np.median(np.diff(record.time))))
        dt = uniform.dt
    checks = look(uniform).checks
    findings.extend(_of_looks(checks))
    sound = mended(record)
    uniform = sound if uniform is record else mended(uniform)
    record = sound
    whole, uniform = uniform, loudest_part(uniform)
    if uniform is not whole:
        findings.append(_of_the_part(uniform, len(whole)))

    traces: list[Trace] = []
    summaries: dict[str, ChannelSummary] = {}
    readings: dict[str, Reading] = {}
    spectra, noise = [], []
    even = _every_channel(uniform)
    pushing = [y for name, (_, y) in even.items() if name.startswith(("force", "base")) and record.drive == "force"]
    for channel, (unit, samples) in _every_channel(record).items():
        y = even[channel][1]
        floor = _floor(y, dt)
        traces.append(Trace.of(channel, unit, samples, floor))
        turning = _turning(record, channel) if channel.startswith("acceleration") else None
        pushed_by = pushing if channel.startswith("displacement") else ()
        summaries[channel], found = examine(traces[-1], y, dt, floor, turning, pushed_by)
        findings.extend(found)
        if floor is None or np.ptp(y) == 0:
            continue
        lost = (traces[-1] if uniform is record else Trace.of(channel, unit, y, floor)).lost
        readings[channel] = Reading(channel, y, floor.std, lost | _left_out(uniform, channel))
        spectra.append(spectrum(channel, y, dt))
        if floor.std > 0:
            noise.append(noise_spectrum(channel, y, floor))
    noise = tuple(one for one in noise if one is not None)
    findings.extend(_of_spectra(noise, summaries))
    findings.extend(_of_copies(readings))

    silent = _silent(uniform, summaries)
    findings.extend(_of_the_test(uniform, silent, checks))
    pairs, found = _of_points(uniform, readings, summaries, silent, dt)
    findings.extend(found)
    drives, responses = _causes_and_effects(uniform, readings, silent)
    coherent = tuple(_coherences(drives, responses, summaries, dt))
    findings.extend(_of_coherence(coherent))
    driving, answering = ({name: one.samples for name, one in side.items()} for side in (drives, responses))
    periods = average(driving, answering, dt)
    if periods is not None:
        findings.extend(_of_periods(periods, uniform, summaries))
    return Inspection(
        name=record.name,
        samples=len(record),
        duration=record.duration,
        sample_rate=(len(record) - 1) / record.duration,
        channels=tuple(summaries.values()),
        findings=_sorted(findings, list(summaries)),
        time=record.time,
        traces=tuple(traces),
        checks=checks,
        drives=tuple(drives),
        gaps=gaps,
        comparisons=pairs,
        spectra=tuple(one for one in spectra if one is not None),
        noise=noise,
        coherence=coherent,
        periods=periods,
    )


def _every_channel(record: AbstractRecord) -> dict[str, tuple[str, np.ndarray]]:
    """Unit and samples of every channel, the base too, by the name shown."""
    shown = {f"{kind} {dof}": (record.units[kind], samples) for (kind, dof), samples in record.channels.items()}
    if record.base_acceleration is not None:
        shown["base_acceleration"] = (record.units["base_acceleration"], record.base_acceleration)
    return shown


def _left_out(record: AbstractRecord, channel: str) -> NDArray[np.bool_]:
    """Samples of a channel that were bridged."""
    kind, _, dof = channel.partition(" ")
    return record.lost.get((kind, int(dof or 0)), np.zeros(len(record), dtype=bool))


def _gaps(time: NDArray[np.float64]) -> Iterator[tuple[float, float]]:
    """Instants between which samples are missing."""
    steps = np.diff(time)
    for i in np.flatnonzero(steps > GAP * np.median(steps)):
        yield float(time[i]), float(time[i + 1])


def _of_the_clock(record: AbstractRecord, gaps: tuple[tuple[float, float], ...]) -> Iterator[Finding]:
    """Uneven steps and gaps."""
    try:
        _ = record.dt
    except ValueError as error:
        yield Finding("warning", "record", str(error))
    if gaps:
        start, end = max(gaps, key=lambda gap: gap[1] - gap[0])
        long = end - start > LONG_GAP * np.median(np.diff(record.time))
        count = "1 gap" if len(gaps) == 1 else f"{len(gaps)} gaps"
        message = (
            f"{count}, of at most {end - start:.4g} s (after t = {start:.6g} s). "
            f"{'Do not fit across it: cut the record there.' if long else 'Resampling bridges them.'}"
        )
        yield Finding("warning" if long else "info", "record", message)


def _of_the_part(part: AbstractRecord, samples: int) -> Finding:
    """What of a very long record is told from a part."""
    message = (
        f"Noise, spectra, offsets and what compares channels are those of {len(part)} of the {samples} samples, the "
        f"loudest, t = {part.time[0]:.6g} to {part.time[-1]:.6g} s; extremes, gaps and lost samples those of all."
    )
    return Finding("info", "record", message)


def _floor(y: NDArray[np.float64], dt: float) -> NoiseFloor | None:
    """The noise floor of a channel; where spikes hide its signal, that of the channel without them."""
    if y.size < SHORTEST:
        return None
    floor = noise_floor(y, dt)
    return noise_floor(bridged(y, spikes(y, floor.std)), dt) if floor.silent else floor


def _turning(record: AbstractRecord, acceleration: str) -> np.ndarray | None:
    """Samples within two of which the point of an accelerometer turns or stands; None if nothing tells its velocity."""
    dof = int(acceleration.split()[1])
    rate = record.channels.get(("velocity", dof))
    if rate is None:
        position = record.channels.get(("displacement", dof))
        if position is None:
            return None
        rate = np.gradient(position, record.time)
    slow = np.abs(rate - rate.mean()) < SLOW * rate.std()
    slow[1:] |= np.diff(np.signbit(rate))
    return binary_dilation(slow, iterations=2)


def _silent(record: AbstractRecord, summaries: Mapping[str, ChannelSummary]) -> tuple[int, ...]:
    """Dofs whose force is noise that no response follows."""
    return tuple(
        dof
        for (kind, dof), force in record.channels.items()
        if kind == "force"
        and summaries[f"force {dof}"].noise_only
        and is_silent(force, record.responses.values(), record.dt)
    )


def _of_looks(checks: Iterable[Check]) -> Iterator[Finding]:
    """What a look shows, in its own words."""
    for check in checks:
        if not check.passed and check.name in SHOWN_LOOKS:
            severity = "info" if SHOWN_LOOKS[check.name] == "info" else "warning"
            yield Finding(severity, check.of, f"{capitalised(check.says)}.")


def _of_the_test(record: AbstractRecord, silent: tuple[int, ...], checks: Iterable[Check]) -> Iterator[Finding]:
    """What the channels together say of the kind of test."""
    forces = [dof for kind, dof in record.channels if kind == "force"]
    for dof in silent:
        yield Finding("info", f"force {dof}", "Silent: noise that no response follows counts as zero.")
    if not record.responses and record.drive == "force":
        yield Finding("warning", "record", "No response was measured: nothing can be compared with a model.")
    if len(silent) == len(forces) and record.base_acceleration is None:
        decays = {check.passed for check in checks if check.name == "drive_measured"}
        words = {True: "No force acts: the record is a free decay."}
        if False not in decays:
            yield Finding("info", "record", words.get(True in decays, "No force was measured."))


def _of_copies(readings: Mapping[str, Reading]) -> Iterator[Finding]:
    for one, other, factor in copies({name: reading.samples for name, reading in readings.items()}):
        message = f"The same as {one} but for a factor of {factor:.6g}: one channel under two names. Leave one out."
        yield Finding("warning", other, message)


def _of_points(
    record: AbstractRecord,
    readings: Mapping[str, Reading],
    summaries: Mapping[str, ChannelSummary],
    silent: tuple[int, ...],
    dt: float,
) -> tuple[tuple[Comparison, ...], list[Finding]]:
    """Channels of one point against one another, point after point."""
    pairs, findings = [], []
    for dof in range(1, record.dofs + 1):
        names = [f"{kind} {dof}" for kind in KINDS]
        motion = {
            kind: _relative(readings[name], readings.get("base_acceleration"), kind)
            for kind, name in zip(KINDS, names, strict=True)
            if name in readings and not summaries[name].noise_only
        }
        here = comparisons(motion, dt)
        found = list(of_comparisons(here, summaries, dt))
        pairs.extend(here)
        findings.extend(found)
        inverted = {finding.channel for finding in found if finding.message.startswith("Inverted")}
        trusted = [kind for kind in motion if f"{kind} {dof}" not in inverted]
        force = readings.get(f"force {dof}")
        if force is None or dof in silent or not trusted or any(pair.inverted for pair in here if not inverted):
            continue
        kind = trusted[0]
        frequency = summaries[f"{kind} {dof}"].frequency
        if frequency and is_inverted(force.samples, motion[kind].samples, KINDS.index(kind), dt, frequency):
            message = (
                f"Moves {kind} {dof} as if mass and stiffness were negative: turn the sign of the force, or of all "
                f"motion of this point."
            )
            channel = f"force {dof}" if len(trusted) > 1 else f"force {dof}, {kind} {dof}"
            findings.append(Finding("warning", channel, message))
    return tuple(pairs), findings


def _relative(reading: Reading, base: Reading | None, kind: str) -> Reading:
    """The acceleration relative to the base, as displacement and velocity are."""
    if base is None or kind != "acceleration":
        return reading
    noise = float(np.hypot(reading.noise, base.noise))
    return Reading(reading.channel, reading.samples - base.samples, noise, reading.lost | base.lost)


def _causes_and_effects(
    record: AbstractRecord, readings: Mapping[str, Reading], silent: tuple[int, ...]
) -> tuple[dict[str, Reading], dict[str, Reading]]:
    """The channels that drive, and those that answer."""
    quiet = {f"force {dof}" for dof in silent}
    forces = {name: one for name, one in readings.items() if name.startswith("force ") and name not in quiet}
    motion = {name: one for name, one in readings.items() if not name.startswith(("force ", "base"))}
    if record.drive == "motion":
        return motion, forces
    base = {name: one for name, one in readings.items() if name == "base_acceleration"}
    return forces | base, motion


def _coherences(
    drives: Mapping[str, Reading],
    responses: Mapping[str, Reading],
    summaries: Mapping[str, ChannelSummary],
    dt: float,
) -> Iterator[Coherence]:
    """Of the responses whose strongest frequency the record resolves."""
    for name, response in responses.items() if drives else ():
        found = coherence(name, response.samples, [one.samples for one in drives.values()], response.noise, dt)
        if found is not None and (summaries[name].frequency or np.inf) > 2.0 * found.resolution:
            yield found


def _of_coherence(found: tuple[Coherence, ...]) -> Iterator[Finding]:
    for one in found:
        if one.mean < COHERENT:
            message = (
                f"{one.mean:.0%} of it follows the drive linearly (mean coherence). The rest is nonlinear, noise, free "
                f"motion, or a resonance narrower than {one.resolution:.3g} Hz."
            )
            yield Finding("info", one.channel, message)


def _of_spectra(spectra: tuple[NoiseSpectrum, ...], summaries: Mapping[str, ChannelSummary]) -> Iterator[Finding]:
    for one in spectra:
        if one.coloured:
            (first, *_, last), (low, *_, high) = one.bands()
            message = (
                f"Noise is not white: {np.sqrt(low):.3g} {summaries[one.channel].unit}/√Hz at {first:.3g} Hz, "
                f"{np.sqrt(high):.3g} at {last:.3g} Hz. The noise level was read there; within the signal's band "
                f"it may differ."
            )
            yield Finding("info", one.channel, message)


def _of_periods(periods: Periods, record: AbstractRecord, summaries: Mapping[str, ChannelSummary]) -> Iterator[Finding]:
    message = f"Periodic: {periods.count} periods of {periods.samples} samples ({periods.seconds:.4g} s) agree."
    if periods.transient:
        settled = record.time[len(record) - periods.count * periods.samples]
        message += f" Before t = {settled:.6g} s the motion had not settled: leave that part out."
    yield Finding("info", "record", message)
    for one in periods.channels:
        unit, floor = summaries[one.channel].unit, summaries[one.channel].noise
        if one.noise == 0:
            yield Finding("info", one.channel, "The same in every period to the last digit: computed, not measured.")
        elif floor is not None and one.noise > DISTURBED * floor:
            message = (
                f"Changes by {plus_minus(one.noise, one.noise_error)} {unit} from period to period, "
                f"{one.noise / floor:.1f} times its noise above the signal: count on this much noise within the band."
            )
            yield Finding("info", one.channel, message)
        for name, size in (("even", one.even), ("odd", one.odd)):
            if size:
                message = f"Distortion by {name} nonlinearities, {-20 * np.log10(size):.0f} dB under the excited lines."
                yield Finding("info", one.channel, message)


def _sorted(findings: list[Finding], channels: list[str]) -> tuple[Finding, ...]:
    """Warnings first, then by channel: those on the whole record before those on its channels in their order."""

    def place(finding: Finding) -> tuple[bool, int]:
        first = finding.channel.split(",")[0]
        return finding.severity != "warning", 1 + channels.index(first) if first in channels else 0

    return tuple(sorted(findings, key=place))
