"""The first page of an examination says what is wrong with a record, and nothing when nothing is."""

import json
import re

import numpy as np
import pytest
from scipy.signal import lfilter

from jfsm.records import Record, noise_floor, silent_forces
from jfsm.records._figures import plus_minus, share

T = np.arange(2000) * 0.01
RNG = np.random.default_rng(0)
FORCE = np.cos(6.0 * T) + np.cos(11.0 * T + 1.0) + 0.01 * RNG.standard_normal(T.size)
MOTION = np.sin(6.0 * T) + 0.5 * np.sin(11.0 * T) + 0.01 * RNG.standard_normal(T.size)


def messages(record, severity=None, channel=None):
    return [
        finding.message
        for finding in record.inspect().findings
        if severity in (None, finding.severity) and channel in (None, finding.channel)
    ]


def test_a_sound_record_raises_no_warning_and_has_its_figures():
    inspection = Record(T, force=FORCE, displacement=MOTION, name="run 7").inspect()
    assert [finding for finding in inspection.findings if finding.severity == "warning"] == []
    assert (inspection.name, inspection.samples) == ("run 7", 2000)
    assert inspection.sample_rate == pytest.approx(100.0)
    force, motion = inspection.channels
    assert (force.channel, motion.channel, motion.unit) == ("force 1", "displacement 1", "m")
    assert motion.noise == pytest.approx(0.01, rel=0.1)
    assert motion.frequency == pytest.approx(6.0 / (2 * np.pi), abs=0.05)
    assert (motion.clipped, motion.spikes, motion.quantisation, motion.noise_only) == (0, 0, 0.0, False)


@pytest.mark.parametrize(
    ("samples", "severity", "message"),
    [
        (np.clip(MOTION, -0.8, 0.8), "warning", "sit at the limit of -0.8 or 0.8 m: clipped"),
        (MOTION + 9.0 * (np.arange(2000) == 700), "warning", "1 of 2000 samples are spikes"),
        (MOTION + 0.3, "info", "Offset of 0.3"),
        (np.round(MOTION / 0.25) * 0.25, "warning", "Quantised in steps of 0.25 m"),
        (np.round(MOTION / 0.02) * 0.02, "info", "Quantised in steps of 0.02 m"),
        (np.full(2000, 4.0), "warning", "Displacement 1 is constant (4 m): nothing was measured there"),
        (MOTION + 0.3 * RNG.standard_normal(2000), "warning", "Noise of 0.3"),
        (RNG.standard_normal(2000), "info", "Noise only"),
        (np.sin(2 * np.pi * 20.0 * T), "warning", "Much of the signal has fewer than 8 samples a period"),
        (np.sin(2 * np.pi * 20.0 * T), "warning", "Strongest at 20 Hz: 400 periods of only 5 samples"),
        (np.sin(6.0 * T), "info", "Amplitude stays within 1 of 10 bands"),
    ],
)
def test_what_is_wrong_with_a_channel_is_said(samples, severity, message):
    assert any(message in found for found in messages(Record(T, displacement=samples), severity, "displacement 1"))


def test_a_decay_covers_its_amplitudes():
    record = Record(T, displacement=np.exp(-0.2 * T) * np.sin(6.0 * T))
    assert not any("Amplitude" in found for found in messages(record))
    assert record.inspect().channels[0].coverage == 1.0


@pytest.mark.parametrize("force", [None, 0.1 * RNG.standard_normal(2000), np.zeros(2000)])
def test_a_record_without_force_is_called_a_free_decay(force):
    record = Record(T, force=force, displacement=np.exp(-0.1 * T) * MOTION)
    assert any("free decay" in found for found in messages(record, "info", "record"))


def _driven(force):
    """Displacement of a lightly damped oscillator at 2 Hz under a force held over each sample."""
    omega, zeta, dt = 4 * np.pi, 0.02, T[1]
    pole = np.exp((-zeta + 1j * np.sqrt(1 - zeta**2)) * omega * dt)
    return np.asarray(lfilter([0.0, dt**2], [1.0, -2 * pole.real, abs(pole) ** 2], force))


def test_a_white_force_that_the_response_follows_is_not_silent():
    white = np.random.default_rng(1).standard_normal(T.size)
    motion = _driven(white)
    noise = 0.02 * motion.std() * np.random.default_rng(2).standard_normal(T.size)
    assert noise_floor(white, T[1]).silent
    assert silent_forces(Record(T, force=white, displacement=motion + noise)) == ()
    assert silent_forces(Record(T, force=white)) == ()  # nothing contradicts it


def test_noise_that_no_response_follows_is_silent_however_often_one_looks():
    decay = np.exp(-0.2 * T) * np.sin(6.0 * T)
    found = [
        silent_forces(Record(T, force=np.random.default_rng(seed).standard_normal(T.size), displacement=decay))
        for seed in range(100)
    ]
    assert found == [(1,)] * 100


def test_a_driven_record_is_not_called_a_free_decay():
    assert not any("free decay" in found for found in messages(Record(T, force=FORCE, displacement=MOTION)))
    assert not any("free decay" in found for found in messages(Record(T, base_acceleration=FORCE, displacement=MOTION)))


def test_a_record_without_response_is_warned_of():
    assert any("No response was measured" in found for found in messages(Record(T, force=FORCE), "warning"))


def test_gaps_and_uneven_steps_are_reported_with_the_remedy():
    kept = np.delete(np.arange(2000), [500, *range(1000, 1040)])
    record = Record(T[kept], displacement=MOTION[kept])
    warnings = messages(record, "warning", "record")
    assert any("record.resample(100)" in found for found in warnings)
    assert any("2 gaps, of at most 0.41 s (after t = 9.99 s). Do not fit across it" in found for found in warnings)
    few = Record(np.delete(T, 500), displacement=np.delete(MOTION, 500))
    assert any("1 gap, of at most 0.02 s" in found for found in messages(few, "info", "record"))
    assert record.inspect().channels[0].noise == pytest.approx(0.01, rel=0.15)


def test_warnings_come_first_and_findings_stand_by_channel():
    rough = MOTION + 0.3 * RNG.standard_normal(2000)
    coloured = 0.02 * np.diff(RNG.standard_normal(2001))  # which is said after all that is said of one channel
    record = Record(T, force=FORCE + coloured, displacement={1: MOTION + 0.3, 2: rough + 0.3}).noted("cut by hand")
    places = ["record", "force 1", "displacement 1", "displacement 2"]
    order = [(finding.severity, places.index(finding.channel)) for finding in record.inspect().findings]
    assert order == sorted(order, key=lambda one: (one[0] == "info", one[1]))
    assert {severity for severity, _ in order} == {"info", "warning"}


def test_the_samples_are_kept_with_their_defects():
    y = np.clip(MOTION, -0.8, 0.8)
    y[700] += 9.0
    inspection = Record(T, force=FORCE, displacement=y).inspect()
    force, motion = inspection.traces
    assert (force.channel, motion.unit) == ("force 1", "m")
    np.testing.assert_array_equal(motion.samples, y)
    np.testing.assert_array_equal(np.flatnonzero(motion.spikes), [700])
    np.testing.assert_array_equal(np.flatnonzero(motion.lost), np.flatnonzero(motion.clipped | motion.spikes))
    assert not force.lost.any()
    assert inspection.drives == ("force 1",)
    assert Record(T, displacement=MOTION).inspect().drives == ()


def test_a_report_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    inspection = Record(T, displacement=MOTION).inspect()
    path = tmp_path / "page.html"
    path.write_text("old")
    monkeypatch.setattr("jfsm.reporting.render_inspection", lambda d: "x" * len(d["name"]))  # the name is None
    with pytest.raises(TypeError):
        inspection.report(path)
    assert path.read_text() == "old"
    monkeypatch.undo()
    inspection.report(str(path))
    assert path.read_text().startswith("<!DOCTYPE html>")
    with pytest.raises(FileNotFoundError, match="must be a file in a folder"):
        inspection.report(tmp_path / "gone" / "page.html")


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (0.00612, 1.2e-4, "0.0061 ± 0.0001"),
        (0.4, 0.02, "0.40 ± 0.02"),
        (-14.2, 3.0, "-14 ± 3"),
        (1234.0, 20.0, "1234 ± 20"),
        (1.79e-7, 2e-9, "1.79e-07 ± 2e-09"),
        (0.0, 1e-9, "0e+00 ± 1e-09"),
        (0.400133, 1e-6, "0.4001 ± 1e-06"),
        (4.0, 0.0, "4"),
    ],
)
def test_a_figure_ends_where_its_error_begins(value, error, text):
    assert plus_minus(value, error) == text


def test_shares_too_small_to_show_say_so():
    assert [share(part) for part in (1e-6, 0.0023, 0.276)] == ["less than 0.01%", "0.23%", "27.6%"]


def test_notes_of_the_record_are_repeated():
    assert messages(Record(T, displacement=MOTION).noted("cut by hand"), "info", "record")[0] == "cut by hand"


def test_a_very_short_record_is_examined_without_its_noise():
    inspection = Record(T[:10], displacement=MOTION[:10]).inspect()
    assert inspection.channels[0].noise is None
    assert any("Fewer than 16 samples" in finding.message for finding in inspection.findings)


def test_the_page_is_plain_data_and_can_be_printed(capsys):
    inspection = Record(T, force=FORCE, displacement=MOTION + 0.3, base_acceleration=FORCE, name="run 7").inspect()
    plain = json.loads(json.dumps(inspection.to_dict()))
    assert [channel["channel"] for channel in plain["channels"]] == ["force 1", "displacement 1", "base_acceleration"]
    assert set(plain["findings"][0]) == {"severity", "channel", "message"}
    inspection.print()
    shown = capsys.readouterr().out
    assert "run 7  2000 samples, 19.99 s, 100 Hz" in shown
    assert "displacement 1: Offset of 0.3" in shown


def test_of_a_very_long_record_the_loudest_part_is_examined_and_it_is_said(monkeypatch):
    monkeypatch.setattr("jfsm.records._loudest.ENOUGH", 4000)
    rng = np.random.default_rng(4)
    t = np.arange(20_000) / 100.0
    loud = np.where((t > 90.0) & (t < 140.0), 1.0, 0.2)
    y = loud * np.sin(2 * np.pi * t) + rng.normal(scale=1e-3, size=t.size)
    y[300] += 0.5
    inspection = Record(t, loud * np.cos(2 * np.pi * t), displacement=y).inspect()
    said = [finding.message for finding in inspection.findings if finding.channel == "record"]
    assert any(re.search(r"those of 4000 of the 20000 samples.* t = 100 to 139.99 s", message) for message in said)
    figures = {channel.channel: channel for channel in inspection.channels}["displacement 1"]
    assert figures.spikes == 1 and figures.maximum > 0.99  # of the whole record
    assert figures.noise == pytest.approx(1e-3, rel=0.1) and inspection.samples == 20_000
    assert inspection.spectra[0].frequency[0] > 1 / 40  # of the part


def test_up_to_half_a_million_samples_all_are_examined():
    t = np.arange(3000) / 100.0
    said = Record(t, np.sin(t), displacement=np.cos(t)).inspect().findings
    assert not any("of the 3000 samples" in finding.message for finding in said)
