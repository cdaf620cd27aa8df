"""Sensor faults: what they do to a run, to its readings, and that a fit finds them."""

import numpy as np
import pytest

import jfsm

T = np.arange(1500) * 0.05
MODEL = jfsm.Structure.sdof(1.0, 9.0, 0.4)
TAU = 0.037


def force(t):
    return np.cos(1.3 * t) + 0.8 * np.cos(2.7 * t + 0.6) + 0.5 * np.sin(4.4 * t)


def run(model, record, **options):
    return jfsm.simulate(model, record, initial_state=(0.1, 0.0), tolerance=1e-10, **options)


@pytest.mark.parametrize("solver", ["reference", "grid"])
@pytest.mark.parametrize("tau", [TAU, -TAU, 0.2])
def test_the_force_behind_a_late_sensor_is_that_of_later_readings(solver, tau):
    truth = run(MODEL, jfsm.Record(T, force(T)), solver=solver).displacement
    late = run(
        MODEL + jfsm.ForceDelay(tau, at=("force", 1)), jfsm.Record(T, force(T - tau)), solver=solver
    ).displacement
    inside = slice(20, -20)
    assert np.max(np.abs(late - truth)[inside]) < 2e-3 * np.std(truth)
    without = run(MODEL, jfsm.Record(T, force(T - tau)), solver=solver).displacement
    assert np.std(late - truth) < 0.05 * np.std(without - truth)


@pytest.mark.parametrize("kind", ["displacement", "velocity", "acceleration"])
def test_a_late_channel_reads_the_motion_of_before(kind):
    record = jfsm.Record(T, force(T), **{kind: np.zeros(T.size)})  # pyright: ignore[reportArgumentType]
    model = MODEL + jfsm.ChannelDelay(TAU, at=(kind, 1))
    response = run(model, record)
    fine = np.linspace(T[0], T[-1], 20 * (T.size - 1) + 1)
    exact = getattr(run(MODEL, jfsm.Record(fine, force(fine))), kind)[:, 0]
    expected = np.interp(T - TAU, fine, exact)
    shown = response.readings(record)[kind, 1]
    assert np.max(np.abs(shown - expected)[5:]) < 1e-3 * np.std(expected)
    assert np.max(np.abs(shown - getattr(response, kind)[:, 0])) > 0.05 * np.std(expected)


def test_bias_gain_and_range_are_in_the_readings_and_not_in_the_motion():
    record = jfsm.Record(T, force(T), acceleration=np.zeros(T.size))
    plain = run(MODEL, record).acceleration
    model = MODEL
    for effect in (
        jfsm.AccelerationGain(0.1, at=("acceleration", 1)),
        jfsm.AccelerationBias(0.3, at=("acceleration", 1)),
    ):
        model = model + effect
    model = model + jfsm.Clipping(0.9, at=("acceleration", 1))
    response = run(model, record)
    np.testing.assert_allclose(response.acceleration, plain, rtol=1e-12)
    expected = np.clip(1.1 * plain[:, 0] + 0.3, -0.9, 0.9)
    np.testing.assert_allclose(response.readings(record)["acceleration", 1], expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("effect", "path", "truth"), [
    (jfsm.ForceDelay(0.0, at=("force", 1)), "force_delay@force-1.tau", 0.06),
    (jfsm.ChannelDelay(0.0, at=("velocity", 1)), "channel_delay@velocity-1.tau", 0.04),
    (jfsm.AccelerationBias(0.0, at=("acceleration", 1)), "accel_bias@acceleration-1.b", 0.2),
], ids=["force_delay", "channel_delay", "accel_bias"])  # fmt: skip
def test_a_fit_finds_a_delay_or_a_bias(effect, path, truth):
    rng = np.random.default_rng(2)
    late = {"force": 0.0, "velocity": 0.0} | ({effect.at[0]: truth} if effect.kind.endswith("delay") else {})
    fine = np.linspace(-1.0, T[-1], 20 * (T.size - 1 + 20) + 1)
    motion = jfsm.simulate(MODEL, jfsm.Record(fine, force(fine)), initial_state=(0.1, 0.0))
    shown = {
        "displacement": np.interp(T, fine, motion.displacement[:, 0]),
        "velocity": np.interp(T - late["velocity"], fine, motion.velocity[:, 0]),
        "acceleration": np.interp(T, fine, motion.acceleration[:, 0]) + (truth if effect.kind == "accel_bias" else 0.0),
    }
    noisy = {k: y + 0.01 * np.std(y) * rng.standard_normal(T.size) for k, y in shown.items()}
    g = force(T - late["force"])
    found = jfsm.fit(MODEL + effect, jfsm.Record(T, g + 0.01 * np.std(g) * rng.standard_normal(T.size), **noisy))
    low, high = found.intervals[path]
    assert low - (high - low) < truth < high + (high - low)
    assert high - low < 0.2 * truth


def test_a_late_displacement_alone_is_told_no_better_than_an_early_force():
    tau, rng = 0.17, np.random.default_rng(5)  # three samples and a part
    fine = np.linspace(-1.0, T[-1], 20 * (T.size - 1 + 20) + 1)
    x = jfsm.simulate(MODEL, jfsm.Record(fine, force(fine)), initial_state=(0.1, 0.0)).displacement[:, 0]
    shown = np.interp(T - tau, fine, x) + 0.002 * np.std(x) * rng.standard_normal(T.size)
    record = jfsm.Record(T, force(T), shown)
    late = jfsm.fit(MODEL + jfsm.ChannelDelay(0.1, at=("displacement", 1)), record)
    early = jfsm.fit(MODEL + jfsm.ForceDelay(-0.1, at=("force", 1)), record)
    assert late.values["channel_delay@displacement-1.tau"] == pytest.approx(tau, rel=0.01)
    assert late.log_likelihood == pytest.approx(early.log_likelihood, abs=3.0)


@pytest.mark.parametrize("tau", [0.33, -0.33])
@pytest.mark.parametrize("kind", ["displacement", "velocity", "acceleration"])
def test_a_free_run_begins_where_a_late_channel_says_the_motion_was(kind, tau):
    fine = np.linspace(-1.0, T[-1] + 1.0, 20 * (T.size - 1 + 40) + 1)
    motion = jfsm.simulate(MODEL, jfsm.Record(fine, force(fine)), initial_state=(0.1, 0.0))
    shown = {kind: np.interp(T - tau, fine, getattr(motion, kind)[:, 0])}
    record = jfsm.Record(T, force(T), **shown)  # pyright: ignore[reportArgumentType]
    response = jfsm.simulate(MODEL + jfsm.ChannelDelay(tau, at=(kind, 1)), record, window=60)
    inside = slice(10, -10)
    error = response.readings(record)[kind, 1] - shown[kind]
    assert np.max(np.abs(error)[inside]) < 3e-3 * np.std(shown[kind])
    exact = np.interp(T, fine, motion.displacement[:, 0])
    assert np.max(np.abs(response.displacement[:, 0] - exact)) < 3e-3 * np.std(exact)
