"""What one channel, or the drive and a response, show: level, repeats, coherence, noise over frequency."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import lfilter

from jfsm.records import Record, clipped, noise_floor
from jfsm.records._coherence import coherence
from jfsm.records._level import level
from jfsm.records._noise_spectrum import noise_spectrum
from jfsm.records._phase_plane import phase_plane
from jfsm.records._quantisation import quantisation_step
from jfsm.records._repeats import copies, longest_hold, repetition
from jfsm.records._spectrum import spectrum

DT, N = 0.01, 3000
T = DT * np.arange(N)
WAVE = np.sin(6.0 * T) + 0.5 * np.sin(11.0 * T)
TURNS = np.linspace(1.0, 0.1, 26) * (-1.0) ** np.arange(26)
SWING = np.concatenate([0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, 100))), np.ones(20)])
STICKING = np.concatenate([a + (b - a) * SWING for a, b in pairwise(TURNS)])  # a joint that rests where it turns


def white(seed, std=0.01, n=N):
    return std * np.random.default_rng(seed).standard_normal(n)


def messages(severity, channel="displacement 1", **channels):
    found = Record(T, **channels).inspect().findings
    return [finding.message for finding in found if (finding.severity, finding.channel) == (severity, channel)]


def test_offset_and_drift_are_right_within_their_errors():
    off = []
    for seed in range(50):
        found = level(WAVE + 0.1 + 0.3 * T / T[-1] + white(seed, 0.2), DT)
        off.append(((found.offset - 0.25) / found.offset_error, (found.drift - 0.3) / found.drift_error))
    assert np.abs(np.mean(off, axis=0)).max() < 0.5
    assert 0.85 < np.mean(np.abs(off) < 2.0)
    assert found.offset_error < 0.02 and found.drift_error < 0.1


def test_slow_motion_widens_the_error_of_the_offset():
    slow = WAVE + np.cumsum(white(1, 0.02))
    assert level(slow, DT).offset_error > 10 * level(WAVE + white(1), DT).offset_error


def pushed(seed):
    """A force without bounds in frequency, and the displacement of an oscillator at 2 Hz that it moves."""
    omega, zeta = 4.0 * np.pi, 0.03
    pole = np.exp((-zeta + 1j * np.sqrt(1 - zeta**2)) * omega * DT)
    force = np.convolve(white(seed, 1.0, N + 1007), np.hanning(8), "valid")
    motion = np.asarray(lfilter([0.0, 1.0], [1.0, -2 * pole.real, abs(pole) ** 2], force))
    return force[1000:], motion[1000:] / motion.std()


def test_slow_motion_that_follows_the_force_does_not_hide_an_offset():
    off = []
    for seed in range(40):
        force, motion = pushed(seed)
        y = motion + 0.05 + white(seed + 100)
        found = level(y, DT, [force])
        off.append((found.offset - 0.05) / found.offset_error)
        assert found.offset_error < 0.1 * level(y, DT).offset_error
        assert level(y, DT, [white(seed + 200)]).offset == level(y, DT).offset  # what it does not follow
    assert np.mean(np.abs(off) < 2.0) > 0.8  # six lines tell the error to a third
    force, motion = pushed(1)
    found = messages("info", displacement=motion + 0.05, force=force)
    assert any(words.startswith(("Offset of 0.049", "Offset of 0.050")) for words in found)
    assert not any(words.startswith("Offset") for words in messages("info", displacement=motion, force=force))


def test_an_offset_of_the_force_is_not_laid_to_the_displacement():
    force, motion = pushed(2)
    y = motion + white(3)
    assert level(y, DT, [force + 20.0 * force.std()]) == level(y, DT)


def test_a_drift_is_said_with_its_size():
    (message,) = [words for words in messages("info", displacement=WAVE + 0.4 * T / T[-1]) if "Drifts" in words]
    assert "Drifts by 0.4001 ± 1e-06 m over the record, 50.3% of" in message
    assert not any("Drifts" in words for words in messages("info", displacement=WAVE + white(2)))


def test_a_sensor_that_hung_is_warned_of():
    y = WAVE + white(3)
    y[1200:1212] = y[1200]
    assert longest_hold(y) == (1200, 12)
    assert any(
        "11 samples repeat the value before them" in words and "the sensor hung" in words
        for words in messages("warning", displacement=y)
    )


def test_a_sensor_that_hung_is_found_in_fine_steps_too():
    y = np.round((WAVE + white(3)) / 1e-4) * 1e-4
    y[1200:1212] = y[1200]
    assert longest_hold(y) == (1200, 12)


@pytest.mark.parametrize(
    "y",
    [
        WAVE + white(4),
        np.round((WAVE + white(4)) / 0.1) * 0.1,
        np.arctan2(np.round(20 * WAVE), 50.0),
        np.concatenate([np.zeros(300), WAVE[:-300]]),
        np.clip(WAVE + white(4), -1.0, 1.0),
        np.repeat(WAVE[::8] + white(4)[::8], 8),
        np.sign(WAVE),
        np.repeat(white(5)[:600], 5),
        np.repeat(white(5)[:300], np.tile([5, 10, 15], 100))[: T.size],
        STICKING,
        np.gradient(STICKING, T),
    ],
)
def test_rest_clipping_steps_and_slow_samples_are_no_hang(y):
    assert longest_hold(y) == (0, 0)


def test_a_channel_sampled_more_slowly_is_told():
    assert repetition(np.repeat(WAVE[::4], 4)) == 4
    assert any(
        "Every value stands 4 times" in words for words in messages("info", displacement=np.repeat(WAVE[::4], 4))
    )
    assert [repetition(y) for y in (WAVE, np.sign(WAVE), np.zeros(N), np.round(WAVE))] == [1, 1, 1, 1]


def test_one_channel_under_two_names_is_warned_of():
    y = WAVE + white(5)
    assert list(copies({"a": y, "b": -2.0 * y, "c": y + white(6)})) == [("a", "b", pytest.approx(-2.0))]
    found = messages("warning", "displacement 2", displacement={1: y, 2: y})
    assert found == ["The same as displacement 1 but for a factor of 1: one channel under two names. Leave one out."]


def test_coherence_is_the_share_that_follows_the_drives():
    drives = [np.convolve(white(seed), np.ones(5), "same") for seed in (7, 8)]
    clean = drives[0] - 0.5 * drives[1]
    strange = np.convolve(white(9), np.ones(5), "same")
    strange *= clean.std() / strange.std()
    whole = coherence("x", clean, drives, 1e-9, DT)
    half = coherence("x", clean + strange, drives, 1e-9, DT)
    none = coherence("x", strange, drives, 1e-9, DT)
    assert whole is not None and half is not None and none is not None
    assert whole.mean > 0.999
    assert half.mean == pytest.approx(0.5, abs=0.1)
    assert none.mean < 0.1
    assert coherence("x", clean[:200], [drives[0][:200]], 1e-9, DT) is None


def test_a_response_that_does_not_follow_the_force_is_mentioned():
    rng = np.random.default_rng(10)
    lines = rng.uniform(3.0, 12.0, 30)
    force, other = (np.cos(np.outer(T, lines * scale) + rng.uniform(0, 6, 30)).sum(1) for scale in (1.0, 1.013))
    assert any("follows the drive linearly" in words for words in messages("info", force=force, displacement=other))
    assert not any("linearly" in words for words in messages("info", force=force, displacement=force + white(11)))


def test_noise_over_frequency_has_the_density_of_white_noise():
    y = WAVE + white(12)
    found = noise_spectrum("x", y, noise_floor(y, DT))
    assert found is not None
    assert found.density.mean() == pytest.approx(2 * 0.01**2 * DT, rel=0.1)
    assert not found.coloured
    assert found.frequency.min() > 11.0 / (2 * np.pi)


def test_a_spectrum_holds_the_power_of_its_channel():
    y = WAVE + 3.0 + white(12, 0.3)
    found = spectrum("x", y, DT)
    assert found is not None
    assert found.density.sum() * found.frequency[0] / 3.0 == pytest.approx(y.var(), rel=0.1)
    assert found.frequency[np.argmax(found.density)] == pytest.approx(6.0 / (2 * np.pi), abs=found.frequency[0] / 3.0)
    assert found.density[found.frequency > 5.0].mean() == pytest.approx(2 * 0.3**2 * DT, rel=0.1)
    assert spectrum("x", y[:100], DT) is None


def test_the_phase_plane_tells_where_a_motion_has_been():
    circle = phase_plane(3.0 + 2.0 * np.sin(6.0 * T), DT)
    assert (circle.centre, circle.reach) == pytest.approx((3.0, 2.0), abs=0.02)
    assert circle.rate_reach == pytest.approx(12.0, rel=0.01)
    assert circle.time.sum() == pytest.approx(1.0)
    assert circle.time[4:6, 4:6].sum() == 0.0
    assert circle.time[-1, 4:6].sum() > 0.05
    decay = phase_plane(np.exp(-0.2 * T) * np.sin(6.0 * T), DT)
    assert circle.coverage < 0.5 < 0.9 < decay.coverage


def test_coloured_noise_is_told():
    rough = np.diff(white(13, n=N + 1)) / np.sqrt(2)
    assert any("Noise is not white" in words for words in messages("info", displacement=WAVE + rough))


@pytest.mark.parametrize("std", [0.002, 0.02])
def test_the_error_of_the_noise_holds_the_truth(std):
    off = []
    for seed in range(40):
        noise = white(seed, std)
        floor = noise_floor(WAVE + np.where(np.sin(1.9 * T) > 0, 0.3, 0.0) + noise, DT)
        off.append((floor.std - noise.std()) / floor.std_error)
    assert np.mean(np.abs(off) < 2.0) >= 0.9
    assert np.abs(off).max() > 0.2  # an error as large as that would be no statement


@pytest.mark.parametrize("reach", [0.4, 0.6, 0.8])
@pytest.mark.parametrize("std", [0.001, 0.02])
def test_the_error_of_the_noise_holds_the_truth_where_a_force_fills_the_band(reach, std):
    lines = np.arange(1, int(reach * N / 2))
    spectrum_ = np.zeros(N // 2 + 1, dtype=complex)
    spectrum_[lines] = np.exp(2j * np.pi * np.random.default_rng(18).random(lines.size))
    force = np.fft.irfft(spectrum_)
    floor = noise_floor(force / force.std() + white(19, std), DT)
    assert abs(floor.std - std) < 2.0 * floor.std_error


@pytest.mark.parametrize("step", [1e-4, 1e-3, 0.02])
def test_steps_are_found_however_fine_beside_the_motion(step):
    y = np.round((WAVE + 3.0 + white(20)) / step)
    for one in (y * step, (y * step).astype(np.float32).astype(float), y * step / 0.0254):
        unit = step / 0.0254 if one[0] > 10 else step
        assert quantisation_step(one) == pytest.approx(unit, rel=1e-3)
    (message,) = [words for words in messages("info", displacement=y * step) if "Quantised" in words]
    assert f"in steps of {step:.4g} m" in message


@pytest.mark.parametrize(
    "y",
    [
        WAVE + white(21),
        (WAVE + white(21)).astype(np.float32),
        np.linspace(0.0, 1.0, N),
        np.concatenate([np.zeros(300), WAVE[:-300]]),
        np.tile((WAVE + white(21))[:600], 5),
        np.array([float(f"{value:.3g}") for value in WAVE + white(21)]),
        np.arctan2(np.round(20 * WAVE), 50.0),
    ],
)
def test_what_is_stored_in_few_digits_or_repeats_itself_is_not_quantised(y):
    assert quantisation_step(np.asarray(y, dtype=float)) == 0.0


def test_steps_that_do_nothing_beside_the_noise_are_not_mentioned():
    y = np.round((WAVE + white(22, 0.1)) / 1e-4) * 1e-4
    assert quantisation_step(y) > 0
    assert not any("Quantised" in words for words in messages("info", displacement=y))


def test_a_noisy_crest_cut_off_at_one_level_is_clipped_however_gently_it_comes_there():
    y = np.sin(6.0 * T) + white(14)
    limit = np.quantile(y, 0.997)
    np.testing.assert_array_equal(clipped(np.minimum(y, limit)), y >= limit)
    assert not clipped(np.sin(2 * np.pi * np.arange(N) / 100)).any()


def test_crests_of_a_sample_each_are_clipped_on_both_sides():
    y = np.sin(2 * np.pi * np.arange(N) / 10.3) + white(14, 0.001)
    limit = np.quantile(np.abs(y), 0.94)
    np.testing.assert_array_equal(clipped(np.clip(y, -limit, limit)), np.abs(y) >= limit)


def test_bends_are_not_taken_for_a_signal_at_the_band_limit():
    bent = np.abs(np.sin(6.0 * T)) * np.sin(11.0 * T) + white(15, 1e-5)
    assert noise_floor(bent, DT).spacing == 2
    assert any("jumps within a sample" in words for words in messages("info", displacement=bent))
    assert messages("warning", displacement=bent) == []


@pytest.mark.parametrize(("at", "severity"), [("turning", "info"), ("elsewhere", "warning")])
def test_spikes_where_the_velocity_turns_are_put_down_to_friction(at, severity):
    x = -np.cos(2 * np.pi * T)
    acceleration = (2 * np.pi) ** 2 * np.cos(2 * np.pi * T) + white(16, 0.1)
    acceleration[(100 if at == "turning" else 125) * np.arange(2, 8)] -= 60.0
    found = messages(severity, "acceleration 1", displacement=x + white(17, 1e-3), acceleration=acceleration)
    assert any("6 of 3000 samples are spikes" in words for words in found)


def test_noise_of_a_signal_at_the_band_limit_is_no_fault_of_its_own():
    lines = np.arange(1, 650)
    fast = np.cos(np.outer(np.arange(N), lines * np.pi / 1000) + lines**2).sum(axis=1)
    warned = messages("warning", "force 1", force=fast, displacement=WAVE + white(1))
    assert any("part of the noise may be signal" in words for words in warned)
    assert not any("Noise of" in words for words in warned)


def test_motion_slower_than_two_periods_has_no_frequency():
    slow = np.cos(np.pi * T / T[-1]) + white(6)
    assert any(
        "below two periods in the record: its frequency" in words for words in messages("info", displacement=slow)
    )


def test_a_drive_in_steps_has_neither_noise_nor_a_spectrum_of_it():
    steps = np.repeat(white(5)[:300], np.tile([5, 10, 15], 100))[:N]
    page = Record(T, force=steps, displacement=WAVE + white(1)).inspect()
    assert page.channels[0].noise == 0.0
    assert "force 1" not in [one.channel for one in page.noise]


def test_a_decay_after_a_blow_is_not_called_narrow_in_amplitude_and_a_steady_motion_is():
    blow = np.exp(-T / 0.05) * np.cos(150.0 * T)  # far faster and larger than what goes on ringing
    ringing = np.exp(-T / 10.0) * np.cos(12.0 * T)
    assert not any("Amplitude stays" in words for words in messages("info", displacement=ringing + 5.0 * blow))
    assert any("Amplitude stays within" in words for words in messages("info", displacement=np.cos(12.0 * T)))
