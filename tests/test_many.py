"""Many runs at once: the same as one by one, and what is refused."""

import numpy as np
import pytest

import jfsm

N, DT = 200, 0.05
TIME = DT * np.arange(N)
FORCE = 5.0 * np.sin(1.3 * TIME) + 3.0 * np.sin(2.9 * TIME + 0.4)
RECORD = jfsm.Record(TIME, FORCE, at_rest=True)
LINK = (0, 1)
ROUNDING = 1e-10  # of motions of the order of one: sums in another order, over some hundred samples


def duffing(mass=1.3, k=9.0, c=0.3, k3=4.0) -> jfsm.Structure:
    return jfsm.Structure.sdof(mass, k, c) + jfsm.CubicStiffness(k3, at=LINK)


DUFFINGS = [duffing(), duffing(k3=0.0), duffing(mass=2.0, k=7.0), duffing(c=1.0, k3=-0.1), duffing(k=11.0, k3=6.0)]
STARTS = (np.linspace(-1.0, 1.0, 5)[:, None], np.linspace(0.5, -2.0, 5)[:, None])


def rough(share: float) -> jfsm.Structure:
    """Two masses with friction, a yielding link, a late force, a dying spring and a wrong force sensor."""
    model = jfsm.Structure.chain(mass=[1.0, 1.5 * share], stiffness=[20.0, 30.0 * share], damping=[0.4, 0.3])
    model = model + jfsm.Coulomb(1.0 * share, at=(0, 2)) + jfsm.Jenkins(8.0, 0.1 * share, at=(1, 2))
    model = model + jfsm.DelayedForce(2.0 * share, 5.0 * share, at=(0, 1)) + jfsm.StiffnessDrop(5.0, 6.0, at=(0, 1))
    return model + jfsm.structures.ForceGain(0.2 * share - 0.2, at=("force", 1))


def apart(many, runs: dict[int, jfsm.Structure], starts=None) -> float:
    """Largest difference from `simulate` taken one by one."""
    worst = 0.0
    for k, model in runs.items():
        start = None if starts is None else (starts[0][k], starts[1][k])
        run = jfsm.simulate(model, RECORD, start, solver="grid")
        for kind in ("displacement", "velocity", "acceleration"):
            worst = max(worst, float(np.max(np.abs(getattr(many, kind)[k] - getattr(run, kind)))))
    return worst


def test_many_parameter_sets_run_as_one_by_one():
    many = jfsm.simulate_many(DUFFINGS, RECORD)
    assert many.displacement.shape == many.acceleration.shape == (5, N, 1)
    assert np.array_equal(many.time, TIME) and np.all(np.isinf(many.escape_time))
    assert apart(many, dict(enumerate(DUFFINGS))) < ROUNDING


def test_many_initial_states_run_as_one_by_one():
    many = jfsm.simulate_many(duffing(), RECORD, STARTS)
    assert apart(many, dict.fromkeys(range(5), duffing()), starts=STARTS) < ROUNDING


def test_structures_and_initial_states_go_in_pairs():
    many = jfsm.simulate_many(DUFFINGS, RECORD, STARTS)
    assert apart(many, dict(enumerate(DUFFINGS)), starts=STARTS) < ROUNDING


def test_more_runs_than_fit_side_by_side_are_all_there():
    x0 = np.linspace(-1.0, 1.0, 70)[:, None]
    many = jfsm.simulate_many(duffing(), RECORD, (x0, 0 * x0))
    few = jfsm.simulate_many(duffing(), RECORD, (x0[[0, 63, 64, 69]], np.zeros((4, 1))))
    np.testing.assert_allclose(many.displacement[[0, 63, 64, 69]], few.displacement, atol=ROUNDING)


@pytest.mark.slow
def test_laws_of_every_class_run_as_one_by_one():
    base = 0.1 * FORCE
    record = jfsm.Record(TIME, {1: 4 * FORCE, 2: FORCE}, base_acceleration=base, at_rest=True)
    models = [rough(share) for share in (1.0, 0.7, 1.3)]
    many = jfsm.simulate_many(models, record)
    for k, model in enumerate(models):
        run = jfsm.simulate(model, record, solver="grid")
        np.testing.assert_allclose(many.displacement[k], run.displacement, atol=ROUNDING)
        relative = run.acceleration - base[:, None]
        np.testing.assert_allclose(many.acceleration[k], relative, atol=1e3 * ROUNDING)


def test_the_fastest_structure_sets_the_steps_for_all():
    stiff = duffing(mass=0.01, k=100.0, c=0.02)
    many = jfsm.simulate_many([duffing(), stiff, duffing(k=8.0)], RECORD)
    assert apart(many, {1: stiff}) < ROUNDING


def test_the_error_falls_with_the_fourth_power_of_the_steps():
    truth = jfsm.simulate(duffing(), RECORD, tolerance=1e-12).displacement
    errors = [
        np.max(np.abs(jfsm.simulate_many(duffing(), RECORD, substeps=steps).displacement[0] - truth))
        for steps in (1, 2)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.5)


def test_a_run_that_escapes_says_when_and_stays_there():
    # x'' = 2 x³ from (1, 1) is x = 1 / (1 - t): it leaves every bound at t = 1.
    quiet = jfsm.Record(TIME, np.zeros(N))
    models = [jfsm.Structure([1.0], [jfsm.CubicStiffness(k3, at=LINK)]) for k3 in (-2.0, 2.0)]
    many = jfsm.simulate_many(models, quiet, (np.ones((2, 1)), np.ones((2, 1))))
    assert many.escape_time[0] == pytest.approx(1.0, abs=2 * DT)
    assert np.isinf(many.escape_time[1])
    for values in (many.displacement, many.velocity, many.acceleration):
        assert np.all(np.isfinite(values))
    gone = TIME >= many.escape_time[0]
    assert np.all(many.displacement[0, gone] == many.displacement[0, ~gone][-1])


def other(at=LINK) -> jfsm.Structure:
    return jfsm.Structure.sdof(1.3, 9.0, 0.3) + jfsm.QuadraticStiffness(1.0, at=at)


@pytest.mark.parametrize(
    ("models", "states", "options", "message"),
    [
        ([], None, {}, "`models` must hold at least one structure; the sequence is empty"),
        ([duffing(), other()], None, {}, "`models` must differ in their numbers only: the same laws"),
        ([other(), other(at=(1, 0))], None, {}, "`models` must differ in their numbers only: the same laws"),
        (
            [duffing(), jfsm.Structure.chain([1, 1], [9, 9])],
            None,
            {},
            "`models` must differ in their numbers only: the same laws",
        ),
        (DUFFINGS, (np.zeros((3, 1)), np.zeros((3, 1))), {}, "`initial_states` must hold one state, or .* 5 struc.* 3"),
        (duffing(), (np.zeros((3, 2)), np.zeros((3, 2))), {}, r"`initial_states` must be two arrays \(runs, 1\); got"),
        (duffing(), (np.zeros((3, 1)), np.zeros((2, 1))), {}, r"`initial_states` must be two arrays \(runs, 1\); got"),
        (duffing(), None, {"substeps": 0}, "`substeps` must be at least 1, a whole number; got 0"),
        (jfsm.Structure([0.0]), None, {}, "`mass` must be positive for the structure to move"),
    ],
)
def test_what_cannot_be_run_is_refused_with_the_reason(models, states, options, message):
    with pytest.raises(ValueError, match=message):
        jfsm.simulate_many(models, RECORD, states, **options)


def test_a_clipped_force_must_be_clipped_alike():
    clipped = [duffing() + jfsm.structures.Clipping(limit, at=("force", 1)) for limit in (1.0, 2.0)]
    with pytest.raises(ValueError, match="the same limits of a clipped force"):
        jfsm.simulate_many(clipped, RECORD)
