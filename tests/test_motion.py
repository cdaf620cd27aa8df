"""Motion from whatever was measured of it: against motions made by SciPy, and the smoother against plain algebra."""

import re
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jfsm
from jfsm.estimation._kalman import LinearModel, log_likelihood, smoothed
from jfsm.estimation._motion import Motion, _untold

DT = 0.04
KINDS = ("displacement", "velocity", "acceleration")
TIME = DT * np.arange(1500)


def force(t):
    return 3 * np.sin(0.8 * t + 0.3) + 2 * np.sin(2.1 * t + 1.1) + np.sin(3.7 * t)


def motion(law, push=force):
    """True x, v and a of a unit mass with stiffness 4 and damping 0.15."""

    def rate(t, y):
        return [y[1], push(t) - 4 * y[0] - 0.15 * y[1] - law(*y)]

    y = solve_ivp(rate, (0, TIME[-1]), [0.4, -0.2], t_eval=TIME, rtol=1e-9, atol=1e-9, method="DOP853").y
    return np.array([*y, [rate(t, q)[1] for t, q in zip(TIME, y.T, strict=True)]])


def noisy(y, level, seed=0):
    return y + level * np.std(y) * np.random.default_rng(seed).standard_normal(y.shape)


def errors(found, truth):
    shown = (found.displacement[:, 0], found.velocity[:, 0], found.acceleration[:, 0])
    return [float(np.std(q - z) / np.std(z)) for q, z in zip(shown, truth, strict=True)]


@pytest.fixture(scope="module")
def hardening():
    return motion(lambda x, v: 0.3 * x**3)


@pytest.mark.parametrize(
    ("kinds", "largest"),
    [
        (("displacement", "velocity", "acceleration"), (0.003, 0.003, 0.008)),
        pytest.param(("displacement",), (0.006, 0.015, 0.055), marks=pytest.mark.slow),
        pytest.param(("velocity",), (0.018, 0.007, 0.025), marks=pytest.mark.slow),
        (("acceleration",), (0.07, 0.011, 0.009)),
    ],
)
def test_what_was_not_measured_is_found_from_what_was(hardening, kinds, largest):
    names = ("displacement", "velocity", "acceleration")
    channels = {kind: noisy(hardening[names.index(kind)], 0.01, seed) for seed, kind in enumerate(kinds)}
    found = jfsm.estimate_motion(jfsm.Record(TIME, noisy(force(TIME), 0.01, 9), **channels))
    assert np.all(np.array(errors(found, hardening)) < largest)
    for place, truth in enumerate(hardening):
        shown = (found.displacement, found.velocity, found.acceleration)[place][:, 0]
        assert 0.85 < np.mean(np.abs(shown - truth) < 1.96 * found.std[:, 0, place])
    assert len(found.notes) == ("displacement" not in kinds)
    assert found.drift == {}  # a drift that is not there is not bought
    for kind in kinds:
        assert found.noise[kind][0] == pytest.approx(0.01 * np.std(hardening[names.index(kind)]), rel=0.2)


@pytest.mark.parametrize(("kind", "times"), [pytest.param("velocity", 1, marks=pytest.mark.slow), ("acceleration", 2)])
def test_a_displacement_that_no_channel_shows_is_said_to_drown_when_its_noise_is_integrated_so_long(
    hardening, kind, times
):
    record = jfsm.Record(TIME, **{kind: noisy(hardening[times], 0.05)})
    found = jfsm.estimate_motion(record)
    [seconds] = map(float, re.findall(r"slower than about (\S+) s", " ".join(found.notes)))
    strayed = found.noise[kind][0] * np.random.default_rng(0).standard_normal((500, round(seconds / DT)))
    for _ in range(times):
        strayed = DT * np.cumsum(strayed, 1)
    assert np.std(strayed[:, -1]) == pytest.approx(np.std(found.displacement), rel=0.15)


def test_a_bias_of_an_accelerometer_moves_nothing_and_is_told(hardening):
    bias = 0.2 * np.std(hardening[2])
    record = jfsm.Record(TIME, force(TIME), acceleration=noisy(hardening[2], 0.01) + bias)
    found = jfsm.estimate_motion(record)
    assert found.bias["acceleration", 1] == pytest.approx(bias, rel=0.1)
    assert errors(found, hardening)[0] < 0.07


@pytest.mark.parametrize(("slow", "kinds"), [("ramp", KINDS[2:]), pytest.param("walk", KINDS, marks=pytest.mark.slow)])
def test_a_drift_of_an_accelerometer_moves_nothing_and_is_told(hardening, slow, kinds):
    walk = np.cumsum(np.random.default_rng(5).standard_normal(TIME.size))
    drift = {"ramp": np.linspace(-1, 1, TIME.size), "walk": walk - np.mean(walk)}[slow]
    drift *= 0.15 * np.std(hardening[2]) / np.std(drift)
    channels = {kind: noisy(hardening[KINDS.index(kind)], 0.01, KINDS.index(kind)) for kind in kinds}
    channels["acceleration"] = channels["acceleration"] + drift
    found = jfsm.estimate_motion(jfsm.Record(TIME, noisy(force(TIME), 0.01, 9), **channels))
    assert list(found.drift) == [("acceleration", 1)]
    assert np.all(np.array(errors(found, hardening)) < (0.08, 0.03, 0.02))
    miss, std = found.drift["acceleration", 1] - drift, found.drift_std["acceleration", 1]
    assert np.std(miss) < 0.2 * np.std(drift)
    assert np.mean(np.abs(miss) < 1.96 * std) > 0.9


@pytest.mark.slow
def test_a_model_tells_the_motion_of_a_mass_that_nothing_measures():
    model = jfsm.Structure.chain(mass=[1.0, 0.7], stiffness=[9.0, 6.0], damping=[0.2, 0.1])
    pushed = np.column_stack([force(TIME), 0 * TIME])
    truth = jfsm.simulate(model, jfsm.Record(TIME, pushed), ([0.3, -0.1], [0.0, 0.2]))
    record = jfsm.Record(TIME, pushed, displacement={1: noisy(truth.displacement[:, 0], 0.01)})
    found = jfsm.estimate_motion(record, model)
    assert found.displacement.shape == (1500, 2) and found.covariance.shape == (1500, 2, 3, 3)
    miss = found.displacement[:, 1] - truth.displacement[:, 1]
    assert np.std(miss) < 0.05 * np.std(truth.displacement[:, 1])
    assert np.mean(np.abs(miss) < 1.96 * found.std[:, 1, 0]) > 0.85
    assert np.mean(found.std[:, 1, 0]) > np.mean(found.std[:, 0, 0])


def test_on_a_moving_base_the_acceleration_is_absolute(hardening):
    base = 0.5 * np.sin(1.3 * TIME)
    truth = motion(lambda x, v: 0.0, lambda t: -0.5 * np.sin(1.3 * t))
    record = jfsm.Record(TIME, displacement=noisy(truth[0], 0.01), base_acceleration=base)
    found = jfsm.estimate_motion(record)
    assert np.std(found.acceleration[:, 0] - truth[2] - base) < 0.05 * np.std(truth[2] + base)
    assert np.std(found.acceleration[:, 0] - truth[2]) > 0.1 * np.std(truth[2])


def test_the_smoother_is_what_conditioning_all_samples_at_once_gives():
    rng, n = np.random.default_rng(3), 7
    step, rows = np.array([[0.9, 0.3], [-0.2, 0.8]]), np.array([[1.0, 0.0], [0.4, 1.0]])
    noise, start, variance = np.diag([0.1, 0.3]), np.diag([2.0, 1.0]), np.array([0.2, 0.5])
    pushed, seen = rng.normal(size=(n, 2)), rng.normal(size=(n, 2))
    use = (rng.random((n, 2)) > 0.3).astype(float)
    # All states stacked: their mean and covariance from the first state and the noises that drive them.
    make, mean = np.zeros((2 * n, 2 * n)), np.zeros(2 * n)
    make[:2, :2] = np.eye(2)
    for k in range(1, n):
        now, before = slice(2 * k, 2 * k + 2), slice(2 * k - 2, 2 * k)
        make[now] = step @ make[before]
        make[now, now] = np.eye(2)
        mean[now] = step @ mean[before] + pushed[k - 1]
    prior = make @ np.kron(np.eye(n), noise) @ make.T + make[:, :2] @ (start - noise) @ make[:, :2].T
    keep = use.ravel() > 0
    h = np.kron(np.eye(n), rows)[keep]
    spread = h @ prior @ h.T + np.diag(np.tile(variance, n)[keep])
    error = seen.ravel()[keep] - h @ mean
    gain = prior @ h.T @ np.linalg.inv(spread)
    parts = {"step": step, "noise": noise, "rows": rows, "variance": variance, "start": start}
    model = LinearModel(**{name: jnp.asarray(q) for name, q in parts.items()})
    data = {"pushed": jnp.asarray(pushed), "seen": jnp.asarray(seen), "use": jnp.asarray(use)}
    found, covariance = smoothed(model, **data, watch=jnp.eye(2))
    np.testing.assert_allclose(np.ravel(found), mean + gain @ error, rtol=1e-9)
    expected = prior - gain @ h @ prior
    for k in range(n):
        np.testing.assert_allclose(covariance[k], expected[2 * k : 2 * k + 2, 2 * k : 2 * k + 2], rtol=1e-8)
    sign, logdet = np.linalg.slogdet(2 * np.pi * spread)
    assert sign > 0 and log_likelihood(model, **data) == pytest.approx(
        -0.5 * (error @ np.linalg.solve(spread, error) + logdet)
    )


def test_a_record_that_tells_no_motion_is_refused(hardening):
    with pytest.raises(ValueError, match="`record` must hold a response .*; it has none to start from"):
        jfsm.estimate_motion(jfsm.Record(TIME, force(TIME)))
    with pytest.raises(ValueError, match="`record` must hold at least 32 samples; it has 20"):
        jfsm.estimate_motion(jfsm.Record(TIME[:20], displacement=hardening[0, :20]))
    with pytest.raises(ValueError, match="`model` must be given where a degree of freedom is measured by nothing; 2"):
        jfsm.estimate_motion(jfsm.Record(TIME, {2: force(TIME)}, displacement=hardening[0]))
    uneven = np.cumsum(np.random.default_rng(0).uniform(0.01, 0.03, 600))
    with pytest.raises(ValueError, match=r"Make them so first: record\.resample"):
        jfsm.estimate_motion(jfsm.Record(uneven, displacement=hardening[0, :600]))


@pytest.mark.slow
def test_the_missing_force_is_known_as_well_as_its_error_bar_says(hardening):
    channels = {kind: noisy(y, 0.01, i) for i, (kind, y) in enumerate(zip(KINDS, hardening, strict=True))}
    record = jfsm.Record(TIME, noisy(force(TIME), 0.01, 9), **channels)
    linear = jfsm.Structure.sdof(mass=1.0, stiffness=4.0, damping=0.15)
    truth = 0.3 * hardening[0] ** 3
    # What the model has of it is taken off, and what its argument's error makes of it is in the error bar.
    for model, missing in ((linear, truth), (linear + jfsm.CubicStiffness(0.2, at=(0, 1)), truth / 3)):
        found = jfsm.estimate_motion(record, model)
        assert found.places == ((0, 1),) and found.latent_force is not None and found.latent_force_std is not None
        miss = found.latent_force[:, 0] - missing
        assert 0.8 < np.sqrt(np.mean((miss / found.latent_force_std[:, 0]) ** 2)) < 1.25
        assert np.std(miss) < 0.05 * np.std(truth)


def test_what_the_model_says_of_its_sensors_is_undone(hardening):
    channels = {kind: noisy(y, 0.01, i) for i, (kind, y) in enumerate(zip(KINDS, hardening, strict=True))}
    channels["acceleration"] = 1.1 * channels["acceleration"]
    model = jfsm.Structure.sdof(mass=1.0, stiffness=4.0, damping=0.15)
    model = model + jfsm.AccelerationGain(0.1, at=("acceleration", 1))
    found = jfsm.estimate_motion(jfsm.Record(TIME, noisy(force(TIME), 0.01, 9), **channels), model)
    assert errors(found, hardening)[2] < 0.008


@pytest.mark.parametrize(("kind", "times"), [("velocity", 1), ("acceleration", 2)])
def test_a_shift_that_the_estimate_leaves_out_is_said_where_noise_alone_does_not_make_it(kind, times):
    time = 0.01 * np.arange(1500)
    swing, shift = 0.02 * np.sin(9 * time), 0.05 * (1 + np.tanh((time - 7) / 0.4))
    for motion, estimate, is_said in (
        (swing + shift, swing, True),
        (swing + shift, swing + shift, False),
        (swing, swing, False),
    ):
        readings = motion
        for _ in range(times):
            readings = np.gradient(readings, 0.01)
        level = 0.01 * np.std(readings)
        readings = readings + level * np.random.default_rng(0).standard_normal(time.size)
        column = estimate[:, None]
        found = Motion(time, column, column, column, np.zeros((1500, 1, 3, 3)), {kind: np.array([level])}, {}, {}, {})
        channels: dict[str, Any] = {kind: readings}
        notes = _untold(found, jfsm.Record(time, **channels))
        assert any("does not tell apart" in note for note in notes) == is_said
