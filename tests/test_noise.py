"""The noise floor, and samples that are no readings."""

import numpy as np
import pytest

import jfsm
from jfsm.diagnosis.channels.clipping import limited
from jfsm.identification._channels import driving
from jfsm.records import clipped, noise_floor, spikes
from jfsm.records._flat_top import flat_top_std
from jfsm.records._resting import resting_std

DT = 0.02


def friction_oscillator(friction: float, seed: int, n: int = 3000) -> dict[str, np.ndarray]:
    """Channels of a hardening oscillator with a Coulomb slider, integrated in small steps."""
    rng = np.random.default_rng(seed)
    steps = 20
    frequency, phase = rng.uniform(0.5, 9.0, (12, 1)), rng.uniform(0.0, 2 * np.pi, (12, 1))
    force = np.cos(frequency * np.arange(n * steps) * DT / steps + phase).sum(0) / 3.0
    x = v = 0.0
    rows = np.empty((n, 4))
    for i, g in enumerate(force.tolist()):
        applied = g - 9.0 * x - 0.12 * v - 10.0 * x**3
        sticks = friction > 0 and abs(v) < 3e-3 and abs(applied) <= friction
        if sticks:
            v = 0.0
        acceleration = 0.0 if sticks else applied - friction * np.sign(v or applied)
        if i % steps == 0:
            rows[i // steps] = x, v, acceleration, g
        v += acceleration * DT / steps
        x += v * DT / steps
    return dict(zip(("displacement", "velocity", "acceleration", "force"), rows.T, strict=True))


OSCILLATORS = {friction: friction_oscillator(friction, seed=3) for friction in (0.0, 0.5)}


@pytest.mark.parametrize("friction", [0.0, 0.5])
@pytest.mark.parametrize("kind", ["displacement", "velocity", "acceleration", "force"])
@pytest.mark.parametrize("level", [0.001, 0.01, 0.05])
def test_noise_is_found_within_ten_percent_also_where_friction_makes_jumps(friction, kind, level):
    signal = OSCILLATORS[friction][kind]
    std = level * signal.std()
    floor = noise_floor(signal + std * np.random.default_rng(1).standard_normal(signal.size), DT)
    assert floor.std == pytest.approx(std, rel=0.1)
    # Jumps are isolated losses: the curve explains the rest.
    assert floor.explained > 0.95 - level
    assert not floor.silent


def test_the_smooth_curve_is_nearer_to_the_truth_than_the_samples():
    signal = OSCILLATORS[0.0]["displacement"]
    std = 0.05 * signal.std()
    floor = noise_floor(signal + std * np.random.default_rng(2).standard_normal(signal.size), DT)
    expected = std * np.sqrt(floor.effective_parameters / signal.size)
    assert np.std(floor.smooth - signal) == pytest.approx(expected, rel=0.3)
    assert floor.spacing > 6


def test_the_floor_scales_with_the_unit_and_ignores_the_offset():
    y = OSCILLATORS[0.5]["acceleration"] + 0.01 * np.random.default_rng(3).standard_normal(3000)
    one, other = noise_floor(y, DT), noise_floor(1e3 * y + 5e4, DT)
    assert other.std == pytest.approx(1e3 * one.std, rel=1e-6)
    assert other.explained == pytest.approx(one.explained, rel=1e-6)


def test_pure_noise_is_silent_and_a_signal_in_it_is_not():
    noise = np.random.default_rng(4).standard_normal(3000)
    assert noise_floor(noise, DT).silent
    assert noise_floor(noise, DT).std == pytest.approx(1.0, rel=0.05)
    assert not noise_floor(noise + np.sin(np.arange(3000) * 0.1), DT).silent
    constant = noise_floor(np.full(100, 3.0), DT)
    assert constant.silent and constant.std < 1e-12


def test_quantisation_bounds_the_floor_from_below():
    t = np.arange(3000) * DT
    step = 0.01
    floor = noise_floor(np.round(np.exp(-0.3 * t) * np.sin(t) / step) * step, DT)
    assert floor.std >= step / np.sqrt(12.0)


@pytest.mark.parametrize("quiet", [0.25, 0.3])
def test_readings_that_rest_on_a_level_at_the_end_of_a_decay_hide_no_noise(quiet):
    time, step = np.arange(3000) * DT, 0.05
    signal = np.exp(-0.1 * time) * np.cos(7.0 * time)
    noisy = signal + quiet * step * np.random.default_rng(5).standard_normal(time.size)
    y = step * np.round(noisy / step)
    moving = np.std((y - signal)[:1000])
    assert np.mean(y[-1000:] == 0.0) > 0.8
    assert noise_floor(y, DT).std == pytest.approx(moving, rel=0.2)


def test_intensity_is_the_variance_times_the_interval():
    floor = noise_floor(np.random.default_rng(5).standard_normal(500), 0.25)
    assert floor.intensity == pytest.approx(floor.std**2 * 0.25)


def broad(top: float, seed: int, n: int = 3000) -> np.ndarray:
    """A sum of 200 sines of any frequency up to `top` of the band, of unit size."""
    rng = np.random.default_rng(seed)
    phase = np.multiply.outer(np.arange(n), np.pi * top * rng.random(200)) + rng.uniform(0.0, 2 * np.pi, 200)
    return np.cos(phase).sum(-1) / 10.0


@pytest.mark.parametrize("top", [0.3, 0.5, 0.7])
@pytest.mark.parametrize("level", [1e-3, 5e-3, 0.1])
@pytest.mark.parametrize("n", [700, 3000])
def test_noise_beyond_a_signal_that_reaches_far_up_is_the_flat_end_of_the_spectrum(top, level, n):
    found = [
        noise_floor(broad(top, k, n) + level * np.random.default_rng(9 + k).standard_normal(n), DT) for k in (0, 1)
    ]
    for floor in found:
        assert not floor.fills_band
        assert floor.std == pytest.approx(level, rel=0.15)
        assert floor.explained == pytest.approx(1 - level**2, abs=0.1 * level)
        assert abs(floor.std - level) < 3 * floor.std_error


@pytest.mark.parametrize("kind", ["full", "square", "impacts", "walk", "torn"])
def test_what_falls_slowly_or_jumps_has_no_flat_end_that_is_noise(kind):
    t, rng = np.arange(3000), np.random.default_rng(2)
    impacts = np.zeros(3000)
    impacts[np.arange(100, 3000, 250)[:, None] + np.arange(5)] = np.sin(np.pi * np.arange(1, 6) / 6)
    signal = {
        "full": broad(0.98, 1),
        "square": np.sign(np.sin(0.09 * t)),
        "impacts": impacts,
        "walk": np.cumsum(rng.standard_normal(3000)),
        "torn": broad(0.3, 1) + 0.5 * (t % 300 == 150),
    }[kind]
    assert flat_top_std(signal / signal.std() + 1e-4 * rng.standard_normal(3000)) is None


@pytest.mark.parametrize("level", [1e-3, 1e-2])
@pytest.mark.parametrize("held", [3, 5, 12])
def test_noise_of_a_force_that_is_held_shows_between_its_jumps(held, level):
    rng = np.random.default_rng(6)
    force = np.repeat(rng.standard_normal(3000 // held), held) + level * rng.standard_normal(3000)
    floor = noise_floor(force, DT)
    assert not floor.fills_band
    assert floor.std == pytest.approx(level, rel=0.1)
    assert driving(force, DT).floor == pytest.approx(level, rel=0.1)


@pytest.mark.parametrize(
    "signal", [broad(0.98, 1), np.random.default_rng(2).standard_normal(3000), np.sin(np.arange(3e3))]
)
def test_a_signal_that_never_rests_shows_no_noise_between_neighbours(signal):
    assert resting_std(signal + 1e-3 * np.random.default_rng(7).standard_normal(3000)) is None


def test_a_force_that_reaches_beyond_a_spline_runs_as_it_was_measured():
    noisy = {top: broad(top, 3) + 0.005 * np.random.default_rng(4).standard_normal(3000) for top in (0.3, 0.8)}
    white = np.random.default_rng(5).standard_normal(3000)
    jumps = np.repeat(np.random.default_rng(6).standard_normal(600), 5) + 0.01 * white
    for force in (*noisy.values(), white, jumps):
        np.testing.assert_array_equal(driving(force, DT).samples, force)
    assert driving(noisy[0.3], DT).floor == pytest.approx(0.005, rel=0.1)
    assert driving(white, DT).floor == pytest.approx(0.001, rel=0.1)  # nothing in it tells how noisy it is
    smooth = broad(0.05, 3)
    found = driving(smooth + 0.005 * np.random.default_rng(4).standard_normal(3000), DT)
    assert np.std(found.samples - smooth) < 0.003


def test_the_result_is_read_only():
    with pytest.raises(ValueError, match="read-only"):
        noise_floor(np.arange(50.0) ** 2, DT).smooth[0] = 1.0


def test_the_noise_of_a_long_channel_is_known_well():
    y = np.sin(np.arange(100_000) * 0.1) + 0.01 * np.random.default_rng(6).standard_normal(100_000)
    assert noise_floor(y, DT).std == pytest.approx(0.01, rel=0.03)


@pytest.mark.parametrize("y", [np.zeros(15), np.zeros((50, 2)), np.full(50, np.nan)])
def test_what_is_no_channel_is_refused(y):
    with pytest.raises(ValueError, match="`y` must be one channel of at least 16 finite samples; it has shape"):
        noise_floor(y, DT)


@pytest.mark.parametrize("dt", [0.0, -1.0, np.nan])
def test_an_interval_that_is_not_positive_is_refused(dt):
    with pytest.raises(ValueError, match="`dt` must be a positive number of seconds; it is"):
        noise_floor(np.arange(50.0), dt)


def test_clipped_samples_are_those_at_the_limit():
    y = OSCILLATORS[0.0]["displacement"]
    limit = 0.7 * np.abs(y).max()
    noisy = y + 0.01 * y.std() * np.random.default_rng(7).standard_normal(y.size)
    np.testing.assert_array_equal(clipped(np.clip(noisy, -limit, limit)), np.abs(noisy) >= limit)
    assert not clipped(noisy).any()


def test_one_sided_limits_are_found():
    y = np.sin(np.arange(2000) * 0.05)
    np.testing.assert_array_equal(clipped(np.minimum(y, 0.8)), y >= 0.8)


def test_torn_samples_beyond_the_limit_do_not_hide_that_a_channel_is_clipped():
    y, std, torn = torn_at([200, 701, 1500, 2400], lambda rng: np.array([6.0, -6.0, 6.0, -6.0]))
    level = 0.6 * np.max(np.abs(y[~torn]))
    y[~torn] = np.clip(y[~torn], -level, level)
    cut = np.abs(y) == level
    assert cut.sum() > 50 and not clipped(y).any()
    np.testing.assert_array_equal(clipped(y, spikes(y, std)), cut)
    record = jfsm.Record(DT * np.arange(y.size), force=np.zeros(y.size), displacement=y)
    (sensor,) = limited([record], jfsm.Structure.sdof(1.0, 1.0, 0.1))
    assert sensor.at == ("displacement", 1) and sensor.value == level


def test_a_record_too_short_to_be_fitted_is_refused_as_a_record():
    time = DT * np.arange(10)
    record = jfsm.Record(time, force=np.sin(time), displacement=np.cos(3 * time))
    with pytest.raises(ValueError, match="`record` must hold at least 32 samples"):
        jfsm.diagnose(record, jfsm.Structure.sdof(1.0, 1.0, 0.1))


def test_a_quantised_channel_is_not_clipped_for_meeting_its_end_levels():
    y = np.sin(np.arange(20_000) * 0.013)
    coarse = np.round(y / 0.02) * 0.02
    assert np.count_nonzero(coarse == coarse.max()) > 12
    assert not clipped(coarse).any()
    cut = np.clip(coarse, -0.5, 0.5)
    np.testing.assert_array_equal(clipped(cut), np.abs(cut) == 0.5)


def _decay(samples: int) -> np.ndarray:
    """Motion after release from 1 without speed, 20 samples a period."""
    omega, zeta = 2 * np.pi / 20.0, 0.02
    k = np.arange(samples)
    return np.exp(-zeta * omega * k) * (np.cos(omega * k) + zeta * np.sin(omega * k))


UNCLIPPED = {
    "switched input": np.sign(np.sin(np.arange(500) * 0.1)),
    "dead channel": np.full(100, 2.0),
    "held and released": np.concatenate([np.ones(300), _decay(700)]),
    "impact": np.concatenate([np.zeros(300), np.sin(np.arange(40) * np.pi / 40), np.zeros(300)]),
    "positioning move": np.cos(np.interp(np.arange(900), [0, 300, 600, 900], [0, np.pi, np.pi, 2 * np.pi])),
}


@pytest.mark.parametrize("case", UNCLIPPED)
def test_levels_that_are_reached_gently_or_switched_are_not_clipped(case):
    assert not clipped(UNCLIPPED[case]).any()


def torn_at(places: list[int], heights_of) -> tuple[np.ndarray, float, np.ndarray]:
    """A motion with spikes whose heights are drawn, in its standard deviations; its noise, and which are torn."""
    rng = np.random.default_rng(8)
    y = OSCILLATORS[0.0]["velocity"].copy()
    std = 0.01 * y.std()
    y += std * rng.standard_normal(y.size)
    torn = np.zeros(y.size, dtype=bool)
    torn[places] = True
    y[torn] += heights_of(rng) * y.std()
    return y, std, torn


def test_spikes_of_one_and_two_samples_are_found_and_nothing_else():
    y, std, torn = torn_at([200, 700, 701, 1500, 2400, 2401], lambda rng: 3.0)
    np.testing.assert_array_equal(spikes(y, std), torn)


def test_spikes_are_found_in_crowds_and_at_the_ends():
    def heights_of(rng: np.random.Generator) -> np.ndarray:
        return rng.choice([-1.0, 1.0], 8) * rng.uniform(5.0, 12.0, 8)

    y, std, torn = torn_at([0, 700, 702, 740, 1500, 1501, 1504, -2], heights_of)
    np.testing.assert_array_equal(spikes(y, std), torn)


def test_a_curve_that_begins_steeply_has_no_spike_at_its_ends():
    rng = np.random.default_rng(8)
    for phase in rng.uniform(0.0, 2 * np.pi, 50):
        y = np.sin(2 * np.pi * np.arange(3000) / 12 + phase) + 0.01 * rng.standard_normal(3000)
        assert not spikes(y, 0.01).any()


@pytest.mark.parametrize("samples_per_period", [9, 20, 200])
def test_crests_of_an_oscillation_are_no_spikes(samples_per_period):
    y = np.sin(2 * np.pi * np.arange(3000) / samples_per_period)
    assert not spikes(y, 1e-6).any()


def test_the_jumps_of_friction_are_no_spikes():
    y = OSCILLATORS[0.5]["acceleration"]
    std = 0.01 * y.std()
    found = spikes(y + std * np.random.default_rng(9).standard_normal(y.size), std)
    assert found.sum() <= 2  # of some hundred jumps


def test_the_crests_of_chatter_are_no_spikes_and_a_spike_beside_is_one():
    for seed in range(5):
        rng = np.random.default_rng(seed)
        y = OSCILLATORS[0.0]["displacement"] + 1e-4 * rng.standard_normal(3000)
        for start in range(100, 2900, 140):
            y[start : start + 12] += 0.02 * rng.standard_normal(12)
        std = noise_floor(y, DT).std
        assert spikes(y, std).sum() <= 1  # of 240 samples of chatter
        y[[290, 1270, 2250]] += 0.5
        assert spikes(y, std)[[290, 1270, 2250]].all()


@pytest.mark.parametrize("kind", ["displacement", "velocity", "force"])
def test_a_record_without_noise_has_no_spikes_where_friction_bends_it(kind):
    y = OSCILLATORS[0.5][kind]
    assert spikes(y, noise_floor(y, DT).std).sum() <= 2


def test_a_channel_too_short_to_judge_has_no_spikes():
    assert not spikes(np.array([0.0, 0.0, 9.0, 0.0]), 0.1).any()
