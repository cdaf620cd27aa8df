"""Maps that are estimated together with their motion: error, error bars, and what they refuse."""

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jfsm

MASS = 1.3
KINDS = "displacement", "velocity", "acceleration"


def cubic(x, v):
    return 20.0 * x + 0.4 * v + 30.0 * x**3


def rubbing(x, v):
    return 20.0 * x + 0.4 * v + 4.0 * np.tanh(v / 0.2)


def moved(law, samples: int = 600, dt: float = 0.02, seed: int = 0, start=(0.0, 0.0), size: float = 10.0):
    """Time, motion, force, by SciPy, of a mass under a few harmonics."""
    rng = np.random.default_rng(seed)
    time, omega = dt * np.arange(samples), 2.4 * np.arange(1, 9)
    a, b = size * rng.standard_normal((2, 8))

    def force(t):
        angle = np.multiply.outer(t, omega)
        return np.cos(angle) @ a + np.sin(angle) @ b

    def flow(t, state):
        return [state[1], (force(t) - law(*state)) / MASS]

    x, v = solve_ivp(flow, (0.0, time[-1]), start, t_eval=time, rtol=1e-9, atol=1e-10, max_step=dt).y
    return time, {"displacement": x, "velocity": v, "acceleration": (force(time) - law(x, v)) / MASS}, force(time)


def seen(motion, level: float, kinds=KINDS, seed: int = 1, unit: float = 1.0) -> jfsm.Record:
    """A record of some channels, with noise of this share of each one's standard deviation."""
    time, channels, force = motion
    rng = np.random.default_rng(seed)
    noisy = {
        kind: unit * (y + level * np.std(y) * rng.standard_normal(y.size))
        for kind, y in {**channels, "force": force}.items()
    }
    driven = {"force": noisy["force"] / unit} if np.any(force) else {}
    return jfsm.Record(time, **{kind: noisy[kind] for kind in kinds}, **driven)


def coverage(force_map, motion, law) -> float:
    """Share of the states of a motion at which 1.96 standard errors reach from the map to the truth."""
    _, channels, _ = motion
    states = np.stack([channels["displacement"], channels["velocity"]], axis=1)
    away = np.abs(np.asarray(force_map.evaluate(states)) - law(*states.T))
    return float(np.mean(away < 1.96 * np.asarray(force_map.evaluate_std(states))))


def error_of(force_map, motion, law) -> float:
    _, channels, _ = motion
    truth = law(channels["displacement"], channels["velocity"])
    states = np.stack([channels["displacement"], channels["velocity"]], axis=1)
    return float(np.std(np.asarray(force_map.evaluate(states)) - truth) / np.std(truth))


@pytest.fixture(scope="module")
def motion():
    return moved(cubic)


@pytest.fixture(scope="module")
def estimated(motion):
    return jfsm.estimate_force_map(seen(motion, 0.05), MASS, trend="cubic")


@pytest.mark.slow
def test_from_displacement_alone_it_is_better_than_after_the_motion_and_its_error_bars_hold():
    covered, better = [], []
    for seed in range(2):
        motion = moved(cubic, seed=seed)
        record = seen(motion, 0.02, ("displacement",), seed)
        force_map = jfsm.estimate_force_map(record, MASS, trend="cubic")
        readings = jfsm.restoring_force(record, mass=MASS)
        after = jfsm.Kriging.fit(readings.states, readings.force, trend="cubic")
        better.append(error_of(force_map, motion, cubic) / error_of(after, motion, cubic))
        covered.append(coverage(force_map, motion, cubic))
    assert max(better) < 0.6
    assert np.mean(covered) > 0.8


@pytest.mark.slow
def test_with_all_channels_its_error_bars_hold_the_truth(estimated, motion):
    maps = [jfsm.estimate_force_map(seen(motion, 0.05, seed=seed), MASS, trend="cubic") for seed in (2, 3)]
    assert np.mean([coverage(one, motion, cubic) for one in (estimated, *maps)]) > 0.8
    assert max(error_of(one, motion, cubic) for one in (estimated, *maps)) < 0.02


def test_friction_that_turns_over_is_followed():
    motion = moved(rubbing)
    record = seen(motion, 0.02)
    assert error_of(jfsm.estimate_force_map(record, MASS, trend="cubic"), motion, rubbing) < 0.02


def test_maps_drawn_from_it_scatter_as_its_standard_error_says(estimated):
    states = np.array([[0.1, 0.5], [0.4, -1.0]])
    drawn = np.asarray(estimated.sample(states, 2000, jax.random.key(0)))
    np.testing.assert_allclose(drawn.std(axis=0), estimated.evaluate_std(states), rtol=0.1)
    np.testing.assert_allclose(drawn.mean(axis=0), estimated.evaluate(states), atol=0.1 * np.max(drawn.std(axis=0)))


def test_a_free_decay_needs_no_force():
    motion = moved(cubic, start=(1.0, 0.0), size=0.0)
    force_map = jfsm.estimate_force_map(seen(motion, 0.02), MASS, trend="cubic")
    assert error_of(force_map, motion, cubic) < 0.01


def test_the_unit_of_length_is_of_no_account(estimated, motion):
    millimetres = jfsm.estimate_force_map(seen(motion, 0.05, unit=1000.0), MASS / 1000.0, trend="cubic")
    state = np.array([0.2, 1.0])
    assert float(millimetres(1000.0 * state)) == pytest.approx(float(estimated(state)), rel=1e-3)
    assert float(millimetres.std(1000.0 * state)) == pytest.approx(float(estimated.std(state)), rel=2e-2)


def test_it_is_a_term_and_a_file_but_has_no_readings_to_leave_out(estimated, tmp_path):
    estimated.save(tmp_path / "map.npz")
    loaded = jfsm.load_map(tmp_path / "map.npz")
    state = np.array([0.3, -0.7])
    assert float(loaded(state)) == float(estimated(state)) and float(loaded.std(state)) == float(estimated.std(state))
    (rest,) = jfsm.fixed_points(jfsm.Structure([MASS], [loaded.on()]))
    assert abs(rest.state[0]) < 0.02 and rest.stable
    with pytest.raises(ValueError, match="no readings to leave out"):
        estimated.leave_one_out()


def test_what_it_cannot_do_is_refused(motion):
    record = seen(motion, 0.01)
    with pytest.raises(ValueError, match="`mass` must be positive; got -1"):
        jfsm.estimate_force_map(record, -1.0)
    with pytest.raises(ValueError, match="`nodes` must be an integer from 4 to 64; got 2"):
        jfsm.estimate_force_map(record, MASS, nodes=2)
    time, channels, force = motion
    short = jfsm.Record(time[:40], force=force[:40], displacement=channels["displacement"][:40])
    with pytest.raises(ValueError, match="64 to 16384 samples; it has 40"):
        jfsm.estimate_force_map(short, MASS)
    imposed = jfsm.Record(time, force=force, displacement=channels["displacement"], drive="motion")
    with pytest.raises(ValueError, match='drive "motion"'):
        jfsm.estimate_force_map(imposed, MASS)
