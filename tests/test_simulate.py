"""Free runs: against SciPy, against what physics demands, and what is refused."""

import dataclasses
import functools

import jax.numpy as jnp
import numpy as np
import pytest
from references import held, rows, smooth_motion, sticking_motion, straight

import jfsm
from jfsm._result import Result
from jfsm.plant import InterpolatedInput, lower, run_grid
from jfsm.structures import AccelerationGain, ForceGain, MapTerm, Offset

N, DT = 300, 0.05
TIME = DT * np.arange(N)
MASS, STIFFNESS, DAMPING = 1.3, 9.0, 0.3
MODEL = jfsm.Structure.sdof(MASS, STIFFNESS, DAMPING)
LINK = (0, 1)
ROUNDING = 1e-13  # of motions of the order of one, over some hundred samples


def tones(t):
    return 5.0 * np.sin(1.3 * t) + 3.0 * np.sin(2.9 * t + 0.4)


FORCE = tones(TIME)
RECORD = jfsm.Record(time=TIME, force=FORCE, at_rest=True)
SMOOTH = {
    "linear": (MODEL, lambda x, v: 0.0),
    "cubic hardening": (MODEL + jfsm.CubicStiffness(4.0, at=LINK), lambda x, v: 4.0 * x**3),
    "cubic softening": (MODEL + jfsm.CubicStiffness(-0.1, at=LINK), lambda x, v: -0.1 * x**3),
    "quadratic stiffness": (MODEL + jfsm.QuadraticStiffness(-1.0, at=LINK), lambda x, v: -(x**2)),
    "quadratic damping": (MODEL + jfsm.QuadraticDamping(0.5, at=LINK), lambda x, v: 0.5 * v * abs(v)),
    "all together": (
        MODEL
        + jfsm.CubicStiffness(4.0, at=LINK)
        + jfsm.QuadraticStiffness(-1.0, at=LINK)
        + jfsm.QuadraticDamping(0.5, at=LINK),
        lambda x, v: 4.0 * x**3 - x**2 + 0.5 * v * abs(v),
    ),
}


def apart(found, true) -> float:
    """Largest difference, in standard deviations of the truth."""
    return float(np.max(np.abs(found - true)) / np.std(true))


def law(extra):
    return lambda x, v: STIFFNESS * x + DAMPING * v + extra(x, v)


@pytest.mark.parametrize("name", SMOOTH)
def test_a_run_agrees_with_scipy_for_every_smooth_law(name):
    model, extra = SMOOTH[name]
    x, v = smooth_motion(MASS, law(extra), straight(TIME, FORCE[:, None]), TIME, 0.0, 0.0)
    run = jfsm.simulate(model, RECORD, reconstruction="linear")
    assert run.result.ok
    # Corners at every sample cost the step control something; the tolerance of 1e-8 is per step.
    assert apart(run.displacement, x) < 5e-5
    assert apart(run.velocity, v) < 5e-5
    a = (FORCE[:, None] - law(extra)(x, v)) / MASS
    assert apart(run.acceleration, a) < 1e-4
    grid = jfsm.simulate(model, RECORD, reconstruction="linear", solver="grid")
    assert apart(grid.displacement, x) < 2e-4


def test_a_held_force_acts_until_the_next_sample_and_not_longer():
    steps = np.sign(FORCE)[:, None]
    x, v = smooth_motion(MASS, law(lambda x, v: 0.0), held(TIME, steps), TIME, 0.0, 0.0)
    for solver in ("reference", "grid"):
        run = jfsm.simulate(MODEL, jfsm.Record(TIME, steps, at_rest=True), reconstruction="hold", solver=solver)
        assert apart(run.displacement, x) < 1e-4
        assert apart(run.velocity, v) < 1e-4


def test_a_band_limited_force_gives_the_motion_of_the_continuous_one():
    x, _ = smooth_motion(MASS, law(lambda x, v: 0.0), lambda t: np.array([tones(t)]), TIME, 0.0, 0.0)
    assert apart(jfsm.simulate(MODEL, RECORD).displacement, x) < 1e-4


def test_a_tighter_tolerance_brings_a_run_closer_to_scipy():
    x, _ = smooth_motion(MASS, law(SMOOTH["all together"][1]), straight(TIME, FORCE[:, None]), TIME, 0.0, 0.0)
    model = SMOOTH["all together"][0]
    errors = [
        apart(jfsm.simulate(model, RECORD, reconstruction="linear", tolerance=tolerance).displacement, x)
        for tolerance in (1e-4, 1e-11)
    ]
    assert errors[1] < 1e-7 < errors[0]


@pytest.mark.parametrize("others", ["linear", pytest.param("all together", marks=pytest.mark.slow)])
def test_a_run_with_friction_agrees_with_events_located_by_scipy(others):
    model, extra = SMOOTH[others]
    x, v, events = sticking_motion(
        MASS, DAMPING, STIFFNESS, [[1.0]], [2.0], straight(TIME, FORCE[:, None]), TIME, 0.0, 0.0, extra
    )
    assert events > 10, "the reference must stick and slide for the test to mean anything"
    run = jfsm.simulate(model + jfsm.Coulomb(2.0, at=LINK), RECORD, reconstruction="linear")
    assert apart(run.displacement, x) < 2e-4
    assert apart(run.velocity, v) < 2e-4


def exact_drive(force, time, substeps: int) -> InterpolatedInput:
    """A drive whose half steps are the force itself, with no error of reconstruction."""
    step = time[1] - time[0]
    inner = time[:, None] + step * np.arange(2 * substeps + 1) / (2 * substeps)
    values = force(inner)[..., None]
    return InterpolatedInput(jnp.asarray(values), jnp.zeros(inner.shape), jnp.asarray(time), jnp.asarray(step))


@pytest.mark.parametrize("friction", [0.0, pytest.param(2.0, marks=pytest.mark.slow)])
def test_halving_the_steps_divides_the_error_by_sixteen_with_and_without_friction(friction):
    time = 0.15 * np.arange(100)
    model = MODEL + jfsm.Coulomb(friction, at=LINK) if friction else MODEL
    x, _, events = sticking_motion(
        MASS, DAMPING, STIFFNESS, [[1.0]], [friction], lambda t: np.array([tones(t)]), time, 0.3, 0.0, tolerance=1e-11
    )
    assert events > 10 or not friction
    errors = []
    for substeps in (1, 2, 4, 8):
        inputs = exact_drive(tones, time, substeps)
        found, _, _ = run_grid(lower(model), inputs, jnp.asarray([0.3]), jnp.zeros(1))
        errors.append(np.sqrt(np.mean((np.asarray(found) - x) ** 2)))
    rate = np.log2(errors[0] / errors[-1]) / 3
    assert rate == pytest.approx(4.0, abs=0.5), errors


CHAIN = jfsm.Structure.chain(mass=[1.0, 1.0], stiffness=[100.0, 200.0], damping=[0.4, 0.3])
CHAIN_MATRICES = (np.eye(2), np.array([[0.7, -0.3], [-0.3, 0.3]]), np.array([[300.0, -200.0], [-200.0, 200.0]]))
CHAIN_TIME = 0.02 * np.arange(200)
CHAIN_FORCE = np.column_stack([30 * np.sin(6 * CHAIN_TIME), 15 * np.sin(11 * CHAIN_TIME + 1)])
CHAIN_RECORD = jfsm.Record(time=CHAIN_TIME, force=CHAIN_FORCE, at_rest=True)


@pytest.mark.parametrize(
    "friction", [{(1, 2): 5.0}, {(0, 1): 8.0, (1, 2): 5.0}, {(0, 1): 8.0, (0, 2): 5.0}], ids=["one", "series", "ground"]
)
def test_friction_on_the_links_of_a_chain_agrees_with_events_located_by_scipy(friction):
    model = CHAIN
    for at, limit in friction.items():
        model = model + jfsm.Coulomb(limit, at=at)
    x, v, events = sticking_motion(
        *CHAIN_MATRICES,
        rows(list(friction), 2),
        list(friction.values()),
        straight(CHAIN_TIME, CHAIN_FORCE),
        CHAIN_TIME,
        np.zeros(2),
        np.zeros(2),
    )
    assert events > 10
    run = jfsm.simulate(model, CHAIN_RECORD, reconstruction="linear")
    assert apart(run.displacement, x) < 2e-4
    assert apart(run.velocity, v) < 2e-4


def test_two_sliders_side_by_side_are_one_of_both_their_forces():
    double = CHAIN + jfsm.Coulomb(4.0, at=(1, 2)) + jfsm.Coulomb(4.0, at=(1, 2))
    one = jfsm.simulate(CHAIN + jfsm.Coulomb(8.0, at=(1, 2)), CHAIN_RECORD)
    # Both reverse at once, and rounding decides which is first: the three modes of a step may not suffice for both.
    assert apart(jfsm.simulate(double, CHAIN_RECORD).displacement, one.displacement) < 1e-3


def test_a_smooth_chain_agrees_with_scipy():
    mass, damping, stiffness = CHAIN_MATRICES

    def restoring(x, v):
        stretch = 400.0 * (x[1] - x[0]) ** 3
        return stiffness @ x + damping @ v + np.array([-stretch, stretch])

    x, _ = smooth_motion(
        mass, restoring, straight(CHAIN_TIME, CHAIN_FORCE), CHAIN_TIME, np.array([0.02, 0.0]), np.array([0.0, -0.1])
    )
    run = jfsm.simulate(
        CHAIN + jfsm.CubicStiffness(400.0, at=(1, 2)),
        CHAIN_RECORD,
        initial_state=([0.02, 0.0], [0.0, -0.1]),
        reconstruction="linear",
    )
    assert apart(run.displacement, x) < 2e-5


def test_a_full_mass_matrix_couples_the_accelerations():
    mass = np.array([[2.0, 0.5], [0.5, 1.0]])
    _, damping, stiffness = CHAIN_MATRICES
    x, _ = smooth_motion(
        mass, lambda x, v: stiffness @ x + damping @ v, straight(CHAIN_TIME, CHAIN_FORCE), CHAIN_TIME, [0, 0], [0, 0]
    )
    run = jfsm.simulate(jfsm.Structure(mass, CHAIN.terms), CHAIN_RECORD, reconstruction="linear")
    assert apart(run.displacement, x) < 2e-5


QUIET = jfsm.Record(time=TIME, force=np.zeros(N))


def energy(run: jfsm.dynamics.Response, k3: float = 0.0) -> np.ndarray:
    x, v = run.displacement[:, 0], run.velocity[:, 0]
    return MASS * v**2 / 2 + STIFFNESS * x**2 / 2 + k3 * x**4 / 4


def test_without_damping_energy_is_kept():
    model = jfsm.Structure.sdof(MASS, STIFFNESS) + jfsm.CubicStiffness(4.0, at=LINK)
    kept = energy(jfsm.simulate(model, QUIET, initial_state=(1.0, 0.5)), 4.0)
    np.testing.assert_allclose(kept, kept[0], rtol=1e-6)


@pytest.mark.parametrize("term", [jfsm.Coulomb(0.7, at=LINK), jfsm.QuadraticDamping(0.4, at=LINK)])
def test_damping_and_friction_never_add_energy(term):
    left = energy(jfsm.simulate(jfsm.Structure.sdof(MASS, STIFFNESS) + term, QUIET, initial_state=(1.0, 0.5)))
    assert np.max(np.diff(left)) < 1e-9 * left[0], "beyond what a step's own error can add"
    assert left[-1] < 0.3 * left[0]


def test_friction_holds_a_mass_still_below_its_limit_and_lets_go_above():
    model = MODEL + jfsm.Coulomb(4.0, at=LINK)
    run = jfsm.simulate(model, jfsm.Record(TIME, 3.99 * np.sin(TIME), at_rest=True))
    assert np.max(np.abs(run.displacement)) < ROUNDING and np.max(np.abs(run.velocity)) < ROUNDING
    free = jfsm.simulate(model, jfsm.Record(TIME, 4.2 * np.sin(TIME), at_rest=True))
    assert np.max(np.abs(free.displacement)) > 1e-3


def test_a_free_decay_with_friction_loses_a_fixed_amplitude_each_half_turn_and_stops():
    k, limit, x0 = STIFFNESS, 0.7, 1.0
    run = jfsm.simulate(jfsm.Structure.sdof(MASS, k) + jfsm.Coulomb(limit, at=LINK), QUIET, initial_state=(x0, 0.0))
    # Each half turn swings about ±limit/k: the amplitude falls by 2 limit/k, until the spring cannot overcome it.
    rest, side = x0, 1.0
    while abs(rest) * k > limit:
        rest, side = -(rest - side * 2 * limit / k), -side
    assert run.displacement[-1, 0] == pytest.approx(rest, abs=1e-4)
    assert np.max(np.abs(run.velocity[-20:])) < ROUNDING


def test_a_free_decay_is_the_analytic_one():
    omega, zeta = np.sqrt(STIFFNESS / MASS), DAMPING / 2 / np.sqrt(STIFFNESS * MASS)
    turning = omega * np.sqrt(1 - zeta**2)
    expected = np.exp(-zeta * omega * TIME) * (
        0.4 * np.cos(turning * TIME) + (-1.1 + zeta * omega * 0.4) / turning * np.sin(turning * TIME)
    )
    run = jfsm.simulate(MODEL, jfsm.Record(TIME, displacement=np.zeros(N)), initial_state=(0.4, -1.1))
    assert apart(run.displacement[:, 0], expected) < 1e-6


def test_a_mode_faster_than_the_samples_is_still_followed():
    omega = 83.0
    run = jfsm.simulate(jfsm.Structure.sdof(1.0, omega**2), QUIET, initial_state=(1.0, 0.0), solver="grid")
    # Runge-Kutta shifts a frequency by 2e-5 at the longest step that is taken, over 1200 rad.
    assert apart(run.displacement[:, 0], np.cos(omega * TIME)) < 0.05


ROUGH = SMOOTH["all together"][0] + jfsm.Coulomb(2.0, at=LINK)


def test_other_units_give_the_same_motion_in_those_units():
    newton, metre = 1e-3, 1e3  # kN, mm
    scaled = jfsm.Structure([MASS * newton / metre])
    for term in ROUGH.terms:
        (parameter,) = term.parameters
        size = float(term.values[0]) * newton**parameter.force * metre**parameter.length
        scaled = scaled + type(term)(size, at=LINK)
    run = jfsm.simulate(ROUGH, RECORD)
    other = jfsm.simulate(scaled, jfsm.Record(TIME, FORCE * newton, at_rest=True))
    np.testing.assert_allclose(other.displacement, run.displacement * metre, rtol=1e-7, atol=1e-7)


def test_a_later_clock_changes_nothing_but_the_times():
    later = jfsm.simulate(MODEL, jfsm.Record(TIME + 100.0, FORCE, at_rest=True))
    assert np.array_equal(later.time, TIME + 100.0)
    assert apart(later.displacement, jfsm.simulate(MODEL, RECORD).displacement) < 1e-6


def test_the_opposite_force_gives_the_opposite_motion_where_laws_are_odd():
    model = MODEL + jfsm.CubicStiffness(4.0, at=LINK) + jfsm.Coulomb(2.0, at=LINK)
    run = jfsm.simulate(model, RECORD)
    mirrored = jfsm.simulate(model, jfsm.Record(TIME, -FORCE, at_rest=True))
    np.testing.assert_allclose(mirrored.displacement, -run.displacement, atol=1e-12)


def test_swapping_the_ends_of_a_link_mirrors_its_law():
    there = jfsm.simulate(MODEL + jfsm.QuadraticStiffness(-1.0, at=(0, 1)), RECORD)
    back = jfsm.simulate(MODEL + jfsm.QuadraticStiffness(1.0, at=(1, 0)), RECORD)
    assert apart(back.displacement, there.displacement) < 1e-9


@pytest.mark.parametrize("n", [2, 64, 65])
def test_the_length_of_a_record_does_not_change_the_motion_it_shares_with_a_longer_one(n):
    run = jfsm.simulate(MODEL, RECORD[:n], reconstruction="linear", solver="grid")
    assert run.displacement.shape == run.acceleration.shape == (n, 1)
    whole = jfsm.simulate(MODEL, RECORD, reconstruction="linear", solver="grid").displacement
    np.testing.assert_allclose(run.displacement, whole[:n], atol=1e-13)


START = (0.7, -1.9)


@functools.cache
def moving() -> jfsm.dynamics.Response:
    return jfsm.simulate(MODEL, RECORD, initial_state=START)


def measured(kind: str, **options) -> jfsm.Record:
    return jfsm.Record(TIME, FORCE, **{kind: getattr(moving(), kind)}, **options)


def started(record: jfsm.Record, *args, model: jfsm.Structure = MODEL, **options) -> tuple[float, float]:
    run = jfsm.simulate(model, record, *args, **options)
    return float(run.displacement[0, 0]), float(run.velocity[0, 0])


def test_a_stated_initial_state_comes_before_everything_else():
    record = measured("displacement", at_rest=True)
    assert started(record, (0.2, 0.3)) == started(record, ([0.2], np.array([0.3]))) == (0.2, 0.3)


def test_a_record_that_begins_at_rest_starts_there_whatever_was_measured():
    assert started(measured("displacement", at_rest=True)) == (0.0, 0.0)


@pytest.mark.parametrize("kind", ["displacement", "velocity", "acceleration"])
def test_without_a_stated_start_any_measured_response_tells_it(kind):
    assert started(measured(kind)) == pytest.approx(START, abs=1e-3)


def test_only_the_first_samples_tell_the_start():
    torn = moving().displacement.copy()
    torn[30:] = 99.0
    record = jfsm.Record(TIME, FORCE, displacement=torn)
    assert started(record, window=30) == pytest.approx(START, abs=1e-3)
    assert started(record) != pytest.approx(START, abs=1e-1)


def test_a_record_without_any_response_starts_at_rest():
    assert started(jfsm.Record(TIME, FORCE)) == (0.0, 0.0)


def test_the_start_is_found_behind_offsets_and_gains():
    model = MODEL + Offset(0.3, at=("acceleration", 1)) + AccelerationGain(0.2, at=("acceleration", 1))
    record = jfsm.Record(TIME, FORCE, acceleration=1.2 * moving().acceleration + 0.3)
    assert started(record, model=model) == pytest.approx(START, abs=1e-3)


def test_the_start_of_a_sliding_mass_is_found():
    model = MODEL + jfsm.Coulomb(1.0, at=LINK)
    run = jfsm.simulate(model, RECORD, initial_state=START)
    record = jfsm.Record(TIME, FORCE, displacement=run.displacement)
    assert started(record, model=model) == pytest.approx(START, abs=1e-2)


def test_a_moving_base_acts_as_a_force_of_inertia_and_accelerations_are_absolute():
    base = tones(TIME)
    shaken = jfsm.simulate(MODEL, jfsm.Record(TIME, base_acceleration=base, at_rest=True), solver="grid")
    pushed = jfsm.simulate(MODEL, jfsm.Record(TIME, -MASS * base, at_rest=True), solver="grid")
    np.testing.assert_allclose(shaken.displacement, pushed.displacement, atol=1e-12)
    np.testing.assert_allclose(shaken.velocity, pushed.velocity, atol=1e-12)
    np.testing.assert_allclose(shaken.acceleration, pushed.acceleration + base[:, None], atol=1e-11)


def test_a_moving_base_drives_every_mass_of_a_coupled_mass_matrix():
    mass, base = np.array([[2.0, 0.5], [0.5, 1.0]]), np.sin(9 * CHAIN_TIME)
    model = jfsm.Structure(mass, CHAIN.terms)
    shaken = jfsm.simulate(model, jfsm.Record(CHAIN_TIME, base_acceleration=base, at_rest=True), solver="grid")
    pushed = jfsm.simulate(model, jfsm.Record(CHAIN_TIME, -np.outer(base, mass.sum(1)), at_rest=True), solver="grid")
    np.testing.assert_allclose(shaken.displacement, pushed.displacement, atol=1e-9)


def test_what_the_model_says_of_the_force_sensor_is_undone():
    read = 1.2 * FORCE + 0.5
    model = MODEL + ForceGain(0.2, at=("force", 1)) + Offset(0.5, at=("force", 1))
    run = jfsm.simulate(model, jfsm.Record(TIME, read, at_rest=True), solver="grid")
    true = jfsm.simulate(MODEL, RECORD, solver="grid")
    np.testing.assert_allclose(run.displacement, true.displacement, atol=1e-12)


def test_offsets_are_part_of_the_motion_and_gains_of_the_readings_only():
    record = jfsm.Record(TIME, FORCE, displacement=np.zeros(N), acceleration=np.zeros(N), at_rest=True)
    true = jfsm.simulate(MODEL, record)
    model = MODEL + Offset(0.3, at=("displacement", 1)) + Offset(2.0, at=("acceleration", 1))
    run = jfsm.simulate(model + AccelerationGain(0.2, at=("acceleration", 1)), record)
    np.testing.assert_allclose(run.displacement, true.displacement + 0.3, rtol=1e-12)
    np.testing.assert_allclose(run.acceleration, true.acceleration + 2.0, rtol=1e-12)
    readings = run.readings(record)
    assert set(readings) == {("displacement", 1), ("acceleration", 1)}
    np.testing.assert_allclose(readings["displacement", 1], true.displacement[:, 0] + 0.3, rtol=1e-12)
    np.testing.assert_allclose(readings["acceleration", 1], 1.2 * true.acceleration[:, 0] + 2.0, rtol=1e-12)


def test_two_effects_of_one_sensor_add_up():
    record = jfsm.Record(TIME, FORCE, acceleration=np.zeros(N), at_rest=True)
    at = ("acceleration", 1)
    twice = (
        MODEL + AccelerationGain(0.1, at=at) + AccelerationGain(0.1, at=at) + Offset(1.0, at=at) + Offset(1.0, at=at)
    )
    once = MODEL + AccelerationGain(0.2, at=at) + Offset(2.0, at=at)
    found, expected = (jfsm.simulate(model, record).readings(record)[at] for model in (twice, once))
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_a_map_runs_like_the_law_that_it_holds():
    model = MODEL + MapTerm(lambda state: 4.0 * state[0] ** 3, at=LINK)
    law = jfsm.simulate(SMOOTH["cubic hardening"][0], RECORD)
    assert apart(jfsm.simulate(model, RECORD).displacement, law.displacement) < 1e-6


def test_a_run_that_escapes_ends_there_and_says_when():
    # x'' = 2 x³ from (1, 1) is x = 1 / (1 - t): it leaves every bound at t = 1.
    model = jfsm.Structure([1.0], [jfsm.CubicStiffness(-2.0, at=LINK)])
    run = jfsm.simulate(model, QUIET, initial_state=(1.0, 1.0))
    assert run.result is Result.diverged
    assert run.escape_time is not None and run.escape_time == pytest.approx(1.0, abs=2 * DT)
    assert run.time[-1] == pytest.approx(run.escape_time - DT)
    for values in (run.displacement, run.velocity, run.acceleration):
        assert values.shape == (len(run.time), 1)
        assert np.all(np.isfinite(values))
    early = run.time < 0.5
    np.testing.assert_allclose(run.displacement[early, 0], 1 / (1 - run.time[early]), rtol=1e-3)


@pytest.mark.parametrize("model", [MODEL, jfsm.Structure([MASS])], ids=["spring", "free mass"])
@pytest.mark.parametrize("kind", ["force", "base_acceleration"])
def test_a_mass_that_waits_for_its_drive_has_not_escaped(model, kind):
    late = np.where(TIME > 10.0, 1.0, 0.0)
    run = jfsm.simulate(model, jfsm.Record(TIME, at_rest=True, **{kind: late}))  # pyright: ignore[reportArgumentType]
    assert run.result.ok and len(run.time) == N


def test_a_motion_that_grows_within_bounds_is_no_escape():
    run = jfsm.simulate(jfsm.Structure.sdof(MASS, STIFFNESS, -0.2), RECORD)
    assert run.result.ok and run.escape_time is None


def test_the_response_of_a_record_at_rest_has_no_part_in_its_run():
    quiet = measured("displacement", at_rest=True)
    assert np.array_equal(jfsm.simulate(MODEL, quiet).displacement, jfsm.simulate(MODEL, RECORD).displacement)


@pytest.mark.parametrize(
    ("model", "record", "options", "message"),
    [
        (MODEL, jfsm.Record(TIME, {2: FORCE}), {}, "`record` names degree of freedom 2; the structure has 1"),
        (jfsm.Structure([0.0]), RECORD, {}, r"`mass` must be positive for the structure to move; got \[0\.0\]"),
        (MODEL, jfsm.Record(TIME, FORCE, drive="motion"), {}, '`record` has drive="motion", so it must hold the disp'),
        (jfsm.Structure.sdof(1.0, 1e8), RECORD, {}, r"`model` must move slowly enough .* fastest mode .* 10000 rad/s"),
        (
            jfsm.Structure.sdof(1.0, 1.0, 1e3),
            RECORD,
            {},
            r"`model` must move slowly enough for the record's steps of 0",
        ),
        (MODEL, RECORD, {"initial_state": 1.0}, r"`initial_state` must be a pair \(displacement, velocity\); got 1\.0"),
        (MODEL, RECORD, {"initial_state": ([0.0, 1.0], 0.0)}, r"displacement must have one value per degree .*\(1\)"),
        (CHAIN, CHAIN_RECORD, {"initial_state": ([0.0, 1.0], 0.0)}, r"velocity must have one value .* \(2\); got 1"),
        (MODEL, RECORD, {"initial_state": (0.0, np.nan)}, "`initial_state velocity` must be finite"),
        (
            MODEL,
            RECORD,
            {"reconstruction": "cubic"},
            "`reconstruction` must be .band-limited., .linear. or .hold.; got",
        ),
        (MODEL, jfsm.Record(TIME**1.2, FORCE), {}, r"`time` must have uniform steps .* record\.resample\("),
    ],
)
def test_what_cannot_be_run_is_refused_with_the_reason(model, record, options, message):
    with pytest.raises(ValueError, match=message):
        jfsm.simulate(model, record, **options)


def test_a_record_of_another_size_of_structure_names_the_force_that_has_no_place():
    with pytest.raises(ValueError, match="`record` names degree of freedom 2"):
        jfsm.simulate(MODEL, CHAIN_RECORD)


def test_a_response_is_a_record_that_drives_the_same_run():
    time = np.arange(300) * 0.01
    record = jfsm.Record(
        time, 1e-3 * np.sin(7 * time), units={"force": "kN", "displacement": "mm"}, at_rest=True, name="rig"
    )
    model = jfsm.Structure.sdof(mass=1.0, stiffness=90.0, damping=0.4)
    response = jfsm.simulate(model, record)
    again = response.to_record()
    np.testing.assert_array_equal(again.channels["displacement", 1], response.displacement[:, 0])
    np.testing.assert_array_equal(again.channels["force", 1], record.channels["force", 1])
    assert (again.at_rest, again.name, again.units["force"]) == (True, "rig, simulated", record.units["force"])
    np.testing.assert_array_equal(jfsm.simulate(model, again).displacement, response.displacement)
    other = jfsm.simulate(model, record, force=2 * record.channels["force", 1]).to_record()
    np.testing.assert_allclose(other.channels["force", 1], 2 * record.channels["force", 1])
    with pytest.raises(ValueError, match="made by hand"):
        dataclasses.replace(response, _record=None).to_record()
