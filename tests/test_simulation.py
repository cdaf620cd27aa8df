"""Simulations of a user's own: a function that answers a force with an acceleration, and what is added to it."""

import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jfsm
from jfsm.diagnosis.evidence.setup import Problem
from jfsm.estimation import _latent
from jfsm.identification import missing_force, prepare

STEP, SAMPLES = 0.02, 600
TIME = STEP * np.arange(SAMPLES)
MASS, STIFFNESS, DAMPING = (1.3, 0.8), (40.0, 60.0), (0.3, 0.2)
GRAVITY, ROD, INERTIA, BRAKE = 9.81, 0.5, 0.25, 0.02
"""Of a pendulum; and two that hang on each other."""
UPPER, LOWER = (1.0, 0.4), (0.6, 0.35)
NUMBERS = {"m1": UPPER[0], "m2": LOWER[0], "c1": 0.02, "c2": 0.015}
CHAIN = jfsm.Structure.chain(MASS, STIFFNESS, DAMPING)


def pushes(time, count: int):
    """Three tones at every coordinate (..., count)."""
    return np.stack([4 * np.sin((2.3 + j) * time) + 3 * np.cos((6.1 - j) * time + j) for j in range(count)], -1)


RECORD = jfsm.Record(TIME, force=pushes(TIME, 2), at_rest=True)


def chained(q, v, force, t, p):
    """The same as `CHAIN`."""
    d, w = jnp.diff(q, prepend=0.0), jnp.diff(v, prepend=0.0)
    links = jnp.array(STIFFNESS) * d + jnp.array([p["c1"], p["c2"]]) * w
    net = force + jnp.append(links[1:], 0.0) - links
    return net / jnp.array([p["m1"], p["m2"]])


OWN = jfsm.Simulation(chained, 2, {"m1": MASS[0], "m2": MASS[1], "c1": DAMPING[0], "c2": DAMPING[1]})


def swinging(q, v, force, t, p):
    return (force - p["brake"] * v - GRAVITY * ROD * jnp.sin(q)) / p["inertia"]


PENDULUM = jfsm.Simulation(swinging, 1, {"inertia": INERTIA, "brake": BRAKE})


def hanging(xp, q, v, p):
    """Mass matrix and forces of two pendulums that hang on each other, by their angles to the vertical."""
    (_, l1), (_, l2) = UPPER, LOWER
    c, s, w = xp.cos(q[0] - q[1]), xp.sin(q[0] - q[1]), p["c2"] * (v[1] - v[0])
    across, total = p["m2"] * l1 * l2, p["m1"] + p["m2"]
    mass = xp.array([[total * l1**2, across * c], [across * c, p["m2"] * l2**2]])
    upper = across * s * v[1] ** 2 + total * GRAVITY * l1 * xp.sin(q[0]) + p["c1"] * v[0] - w
    return mass, xp.array([upper, -across * s * v[0] ** 2 + p["m2"] * GRAVITY * l2 * xp.sin(q[1]) + w])


def double(q, v, force, t, p):
    mass, forces = hanging(jnp, q, v, p)
    return jnp.linalg.solve(mass, force - forces)


DOUBLE = jfsm.Simulation(double, 2, NUMBERS)


def scipy_double(law, time=TIME):
    """Angles and speeds (n, 4) of the double pendulum with a law of the angle and speed between both."""

    def rate(t, y):
        mass, forces = hanging(np, y[:2], y[2:], NUMBERS)
        f = law(y[1] - y[0], y[3] - y[2])
        return np.r_[y[2:], np.linalg.solve(mass, 0.3 * pushes(t, 2) - forces - np.array([-f, f]))]

    return solve_ivp(
        rate, (0, time[-1]), np.zeros(4), t_eval=time, rtol=1e-9, atol=1e-11, max_step=0.01, method="LSODA"
    ).y.T


@pytest.mark.parametrize(
    "term",
    [None, jfsm.Coulomb(2.0, at=(1, 2)), jfsm.Maxwell(5.0, 0.2, at=(0, 1)), jfsm.DelayedForce(3.0, 0.05, at=(0, 2))],
    ids=lambda term: getattr(term, "kind", "alone"),
)
def test_a_chain_as_a_function_moves_as_the_structure(term):
    both = [model if term is None else model + term for model in (OWN, CHAIN)]
    own, structure = (jfsm.simulate(model, RECORD) for model in both)
    assert own.solver == structure.solver
    # Steps are chosen by the fastest motion about rest, of the function by its derivatives: they may differ.
    np.testing.assert_allclose(own.displacement, structure.displacement, atol=2e-7)
    np.testing.assert_allclose(own.acceleration, structure.acceleration, atol=2e-5)


def test_two_pendulums_move_as_scipy_has_them_and_with_a_spring_between():
    time = TIME[:200]
    record = jfsm.Record(time, force=0.3 * pushes(time, 2), at_rest=True)
    run = jfsm.simulate(DOUBLE + jfsm.CubicStiffness(8.0, at=(1, 2)), record)
    np.testing.assert_allclose(run.displacement, scipy_double(lambda d, w: 8.0 * d**3, time)[:, :2], atol=1e-3)
    assert np.max(np.abs(run.displacement)) > 0.5  # far from where it is linear


def test_two_pendulums_whose_joint_sticks_move_as_one():
    held = DOUBLE + jfsm.Coulomb(1e3, at=(1, 2))
    run = jfsm.simulate(held, jfsm.Record(TIME, force=0.3 * pushes(TIME, 2), at_rest=True))
    assert np.ptp(run.displacement[:, 0]) > 0.1
    np.testing.assert_allclose(run.displacement[:, 1], run.displacement[:, 0], atol=1e-9)
    free = jfsm.simulate(DOUBLE, jfsm.Record(TIME, force=0.3 * pushes(TIME, 2), at_rest=True))
    assert np.max(np.abs(free.displacement[:, 1] - free.displacement[:, 0])) > 0.1


def noisy(law=lambda d, w: 0.0 * d) -> jfsm.Record:
    """The chain's run with a law between its masses, read with one per cent of noise."""

    def rate(t, y):
        d, w = np.diff(y[:2], prepend=0.0), np.diff(y[2:], prepend=0.0)
        links = np.array(STIFFNESS) * d + np.array(DAMPING) * w + np.array([0.0, law(d[1], w[1])])
        return np.r_[y[2:], (pushes(t, 2) + np.append(links[1:], 0.0) - links) / np.array(MASS)]

    y = solve_ivp(rate, (0, TIME[-1]), np.zeros(4), t_eval=TIME, rtol=1e-9, atol=1e-11, max_step=0.02).y.T
    a = np.array([rate(t, q)[2:] for t, q in zip(TIME, y, strict=True)])
    rng = np.random.default_rng(0)
    x, a, g = (q + 0.01 * q.std(0) * rng.standard_normal(q.shape) for q in (y[:, :2], a, pushes(TIME, 2)))
    return jfsm.Record(TIME, force=g, displacement=x, acceleration=a, at_rest=True)


@pytest.mark.parametrize("term", [None, jfsm.Coulomb(1.0, at=(1, 2))], ids=["alone", "coulomb"])
def test_the_likelihood_is_that_of_the_structure(term):
    record, values = noisy(), []
    nuisances = prepare(record, CHAIN)
    for model in (CHAIN, OWN):
        problem = Problem(model, [nuisances], [SAMPLES])
        posterior = problem.posterior([model if term is None else model + term], refit=False)
        values.append(float(posterior.evaluate(posterior.initial())[0][0]))
    assert values[0] == pytest.approx(values[1], rel=1e-9)


def test_the_force_that_is_missing_is_that_of_the_structure():
    record = noisy(lambda d, w: 300.0 * d**3)
    nuisances = prepare(record, CHAIN)
    found, expected = (missing_force(model, nuisances) for model in (OWN, CHAIN))
    np.testing.assert_allclose(found.force, expected.force, atol=1e-6 * float(np.std(expected.force)))
    np.testing.assert_allclose(found.std, expected.std, rtol=1e-6)
    closely = 1e-6 * float(np.std(expected.acceleration))
    np.testing.assert_allclose(found.acceleration, expected.acceleration, atol=closely)


def test_amplitudes_with_which_the_smoother_breaks_down_are_passed_over(monkeypatch):
    nuisances, likelihoods = prepare(noisy(lambda d, w: 300.0 * d**3), CHAIN), _latent._likelihoods
    calls = list[int]()

    def breaks_down(models, *rest):
        calls.append(len(models.by_force))
        found = np.array(likelihoods(models, *rest))
        return found if len(calls) < 4 else np.full_like(found, np.nan)

    whole = missing_force(CHAIN, nuisances)
    monkeypatch.setattr(_latent, "_likelihoods", breaks_down)
    found = missing_force(CHAIN, nuisances)
    assert len(calls) == 4 and np.all(np.isfinite(found.force))
    assert np.std(found.force - whole.force) < np.std(whole.force)


def test_numbers_of_the_function_are_found_and_a_base_is_refused():
    model = jfsm.Simulation(chained, 2, {"m1": 1.4, "m2": 0.78, "c1": 0.2, "c2": 0.3})
    found = jfsm.fit(model, noisy())
    for name, truth in {"m1": MASS[0], "m2": MASS[1], "c1": DAMPING[0], "c2": DAMPING[1]}.items():
        low, high = found.intervals[name]
        assert low - (high - low) < truth < high + (high - low) and high - low < 0.3 * truth
    with pytest.raises(ValueError, match="moving base"):
        jfsm.simulate(model, jfsm.Record(TIME, base_acceleration=np.sin(TIME)))


def test_it_has_values_by_name_and_keeps_its_function_when_parts_are_added():
    model = PENDULUM.uncertain(inertia=0.05) + jfsm.Coulomb(0.1, at=(0, 1))
    assert model.values() == {"inertia": INERTIA, "brake": BRAKE, "coulomb@0-1.F": 0.1}
    heavier = model.with_values({"inertia": 0.3, "coulomb@0-1.F": 0.2})
    assert heavier.values() == {"inertia": 0.3, "brake": BRAKE, "coulomb@0-1.F": 0.2}
    assert heavier.trust == (("inertia", 0.05),) and heavier.links == ((0, 1),)
    np.testing.assert_allclose(heavier.mass, [[0.3]])
    np.testing.assert_allclose(np.asarray(heavier.without(heavier.terms[0]).mass), [[0.3]])
    with pytest.raises(ValueError, match="cannot be written as TOML"):
        model.save("model.toml")


def asked(change, dof: int = 2):
    def acceleration(q, v, force, t, p):
        return change(chained(q, v, force, t, {"m1": 1.0, "m2": 1.0, "c1": 0.1, "c2": 0.1}), q, v, force)

    return lambda: jfsm.Simulation(acceleration, dof)


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: jfsm.Simulation(3.0, 1), TypeError, "`acceleration` must be a function"),  # pyright: ignore
        (lambda: jfsm.Simulation(chained, 0), ValueError, "`dof` must be the number of coordinates"),
        (lambda: jfsm.Simulation(chained, 2, {"two words": 1.0}), ValueError, "`parameters` must have names"),
        (asked(lambda a, q, v, f: a[:1]), ValueError, r"one acceleration per coordinate, shape \(2,\); it gives"),
        (asked(lambda a, q, v, f: a / q[0]), ValueError, "must be finite"),
        (asked(lambda a, q, v, f: a + f**3), ValueError, "must be additive in `force`"),
        (asked(lambda a, q, v, f: a + jnp.flip(f) * jnp.array([0.0, 0.5])), ValueError, "symmetric positive definite"),
        (asked(lambda a, q, v, f: a + np.random.default_rng().normal()), ValueError, "whenever it is asked the same"),
        (asked(lambda a, q, v, f: a if float(q[0]) > 0 else -a), TypeError, "JAX can trace"),
    ],
)
def test_what_is_promised_of_a_function_is_tried(make, error, message):
    with pytest.raises(error, match=message):
        make()


def recorded(model: jfsm.Simulation, y: np.ndarray, drive: np.ndarray, time: np.ndarray) -> jfsm.Record:
    rng = np.random.default_rng(2)
    x, g = (q + 0.01 * q.std(0) * rng.standard_normal(q.shape) for q in (y[:, : model.dof], drive))
    return jfsm.Record(time, force=g, displacement=x, at_rest=True)


def test_points_of_rest_and_natural_motions_are_those_of_the_function():
    found = jfsm.fixed_points(PENDULUM, within=(-4, 4))
    np.testing.assert_allclose([p.state[0] for p in found], [-np.pi, 0.0, np.pi], atol=1e-9)
    assert [p.stable for p in found] == [False, True, False]
    mass, _ = hanging(np, np.zeros(2), np.zeros(2), NUMBERS)
    (m1, l1), (m2, l2) = UPPER, LOWER
    stiffness = GRAVITY * np.diag([(m1 + m2) * l1, m2 * l2])
    expected = np.sort(np.sqrt(np.linalg.eigvals(np.linalg.solve(mass, stiffness))))
    np.testing.assert_allclose(jfsm.linearise(DOUBLE).frequencies, expected, rtol=1e-4)  # lightly damped
    with pytest.raises(ValueError, match="got a simulation"):
        jfsm.forced_response(PENDULUM, amplitude=1.0, frequencies=(1.0, 2.0))


def test_many_runs_are_those_of_one_after_the_other():
    models = [OWN + jfsm.CubicStiffness(k3, at=(1, 2)) for k3 in (10.0, 200.0)]
    together = jfsm.simulate_many(models, RECORD)
    for run, model in zip(together.displacement, models, strict=True):
        np.testing.assert_allclose(run, jfsm.simulate(model, RECORD).displacement, atol=1e-6)


@pytest.mark.slow
def test_friction_is_named_in_a_pendulum_and_the_page_shows_it(tmp_path):
    time = STEP * np.arange(900)
    drive = 0.15 * pushes(time, 1)

    def rate(t, y):
        torque = 0.15 * pushes(t, 1)[0] - BRAKE * y[1] - GRAVITY * ROD * np.sin(y[0]) - 0.05 * np.tanh(y[1] / 0.01)
        return [y[1], torque / INERTIA]

    y = solve_ivp(rate, (0, time[-1]), [0, 0], t_eval=time, rtol=1e-8, atol=1e-10, max_step=0.01).y.T
    causes = ["coulomb", "quadratic_damping", "cubic_hardening"]
    wrong, record = PENDULUM.with_values({"inertia": 0.255}), recorded(PENDULUM, y, drive, time)
    d = jfsm.diagnose(record, wrong, causes=causes, key=jax.random.key(0))
    [found] = d.findings
    assert (found.cause, found.at) == ("coulomb", (0, 1)) and found.probability > 0.9
    assert found.parameters["F"].value == pytest.approx(0.05, rel=0.05)
    assert d.refitted["inertia"].value == pytest.approx(INERTIA, rel=0.01)
    assert isinstance(d.extended, jfsm.Simulation)
    d.report(tmp_path / "d.html")
    d.to_json(tmp_path / "d.json")
    assert "Coulomb" in (tmp_path / "d.html").read_text()


@pytest.mark.slow
def test_a_number_of_the_function_that_is_off_is_said_and_nothing_else():
    time = STEP * np.arange(900)
    run = jfsm.simulate(PENDULUM, jfsm.Record(time, force=0.15 * pushes(time, 1), at_rest=True))
    record = recorded(PENDULUM, run.displacement, 0.15 * pushes(time, 1), time)
    wrong = PENDULUM.with_values({"inertia": 0.3})
    d = jfsm.diagnose(record, wrong, causes=["coulomb", "cubic_hardening"], key=jax.random.key(0))
    assert d.verdict == "parameters" and [f.cause for f in d.findings] == ["own_value"]
    assert d.findings[0].parameters["inertia"].value == pytest.approx(INERTIA, rel=0.01)
    right = jfsm.diagnose(record, PENDULUM, causes=["coulomb", "cubic_hardening"], key=jax.random.key(0))
    assert right.verdict == "consistent"


@pytest.mark.slow
def test_friction_is_named_in_the_joint_of_two_pendulums_where_it_is():
    time = 0.01 * np.arange(2000)
    y = scipy_double(lambda d, w: 0.15 * np.tanh(w / 0.01), time)
    wrong = DOUBLE.with_values({"m1": 1.01, "m2": 0.594, "c1": 0.025, "c2": 0.012})
    d = jfsm.diagnose(
        recorded(DOUBLE, y, 0.3 * pushes(time, 2), time),
        wrong,
        places=[(0, 1), (1, 2)],
        causes=["coulomb", "cubic_hardening", "quadratic_damping", "smooth_coulomb", "stribeck"],
        key=jax.random.key(0),
    )
    [found] = d.findings
    assert d.verdict == "cause" and found.at == (1, 2) and re.search("friction", found.kind)
    assert found.parameters["F"].value == pytest.approx(0.15, rel=0.1)
