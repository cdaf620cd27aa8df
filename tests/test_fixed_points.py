"""Points of rest: against roots of polynomials, and what has none to list."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

import jfsm
from jfsm.dynamics import fixed_points
from jfsm.structures import MapTerm

LINK = (0, 1)
DUFFING = jfsm.Structure.sdof(1.0, -9.0, 0.12) + jfsm.CubicStiffness(10.0, at=LINK)
WELLS = np.sqrt(0.9)
ROUNDING = 1e-13


class Pendulum(eqx.Module):
    def __call__(self, state):
        return jnp.sin(state[0]) + state[1]


def places(points) -> np.ndarray:
    return np.array([point.state[: point.state.size // 2] for point in points])


def real_roots(*coefficients: float) -> np.ndarray:
    roots = np.roots(coefficients)
    return np.sort(np.real(roots[np.abs(np.imag(roots)) < 1e-9]))


def test_a_duffing_oscillator_with_a_hump_rests_in_its_two_wells():
    left, middle, right = fixed_points(DUFFING)
    np.testing.assert_allclose(places((left, middle, right))[:, 0], [-WELLS, 0.0, WELLS], rtol=0, atol=ROUNDING)
    assert (left.stable, middle.stable, right.stable) == (True, False, True)
    assert np.all(np.array([point.residual for point in (left, middle, right)]) < 1e-12)
    np.testing.assert_allclose(np.sort(np.real(middle.eigenvalues)), np.sort(np.roots([1.0, 0.12, -9.0])), rtol=1e-12)
    np.testing.assert_allclose(np.real(left.eigenvalues), -0.06, rtol=1e-12)  # c/2m
    assert all(np.all(point.state[1:] == 0.0) for point in (left, middle, right))


@pytest.mark.parametrize("seed", range(6))
def test_the_points_are_the_real_roots_of_the_force_in_any_units(seed):
    rng = np.random.default_rng(seed)
    k, k2, k3 = rng.normal(size=3) * 10.0 ** rng.uniform(-3, 3, 3)
    model = jfsm.Structure.sdof(1.0, k, 0.1) + jfsm.QuadraticStiffness(k2, at=LINK) + jfsm.CubicStiffness(k3, at=LINK)
    found = places(fixed_points(model))[:, 0]
    true = real_roots(k3, k2, k, 0.0)
    np.testing.assert_allclose(found, true, rtol=1e-10, atol=1e-12 * np.max(np.abs(true)))


@pytest.mark.parametrize("force", [0.3, -4.0])
def test_a_constant_force_moves_the_points(force):
    found = places(fixed_points(DUFFING, force=force))[:, 0]
    np.testing.assert_allclose(found, real_roots(10.0, 0.0, -9.0, -force), rtol=1e-11)


def test_a_preload_is_a_constant_force_the_other_way_round():
    with_term = places(fixed_points(DUFFING + jfsm.Preload(0.3, at=LINK)))
    np.testing.assert_allclose(with_term, places(fixed_points(DUFFING, force=[0.3])), rtol=1e-12)


def test_two_links_with_two_wells_each_make_nine_points():
    model = jfsm.Structure.chain([1.0, 2.0], [-9.0, -9.0], [0.1, 0.1])
    model = model + jfsm.CubicStiffness(10.0, at=LINK) + jfsm.CubicStiffness(10.0, at=(1, 2))
    points = fixed_points(model)
    x = places(points)
    stretched = np.column_stack([x[:, 0], x[:, 1] - x[:, 0]])
    true = np.array([(a, b) for a in (-WELLS, 0.0, WELLS) for b in (-WELLS, 0.0, WELLS)])
    np.testing.assert_allclose(stretched, true, rtol=0, atol=ROUNDING)
    assert [p.stable for p in points] == [abs(a) > 0 and abs(b) > 0 for a, b in true]


def test_only_points_between_the_given_displacements_are_listed():
    assert places(fixed_points(DUFFING, within=(0.5, 2.0))).shape == (1, 1)
    assert fixed_points(DUFFING, within=([0.1], [0.5])) == ()


def test_a_linear_structure_rests_at_the_origin_and_without_damping_no_disturbance_dies_out():
    (damped,), (undamped,) = (fixed_points(jfsm.Structure.sdof(2.0, 8.0, c)) for c in (0.1, 0.0))
    assert damped.stable and not undamped.stable
    np.testing.assert_allclose(np.imag(undamped.eigenvalues), [-2.0, 2.0])
    assert np.all(damped.state == 0.0)


def test_a_spring_without_slope_at_rest_rests_at_one_point():
    (point,) = fixed_points(jfsm.Structure.sdof(1.0, 0.0, 0.1) + jfsm.CubicStiffness(10.0, at=LINK))
    assert abs(point.state[0]) < 1e-10


def test_a_map_without_a_box_has_the_points_of_its_formula():
    model = jfsm.Structure.sdof(1.0, 0.0, 0.1) + MapTerm(Pendulum(), at=LINK)
    found = places(fixed_points(model, within=(-7.0, 7.0)))[:, 0]
    np.testing.assert_allclose(found, np.pi * np.arange(-2, 3), rtol=1e-12, atol=ROUNDING)


def test_a_learned_map_has_the_points_of_what_it_learned_and_none_where_it_has_not_been():
    x, v = np.meshgrid(np.linspace(-0.5, 1.5, 11), np.linspace(-1.0, 1.0, 9))
    states = np.column_stack([x.ravel(), v.ravel()])
    force_map = jfsm.RKPM.fit(states, -9.0 * states[:, 0] + 10.0 * states[:, 0] ** 3 + 0.12 * states[:, 1], order=3)
    points = fixed_points(jfsm.Structure([1.0]) + force_map.on(at=LINK))
    np.testing.assert_allclose(places(points)[:, 0], [0.0, WELLS], rtol=0, atol=1e-10)
    assert [point.stable for point in points] == [False, True]


SDOF = jfsm.Structure.sdof(1.0, 9.0, 0.1)
REFUSED = {
    "friction": (SDOF + jfsm.Coulomb(1.0, at=LINK), {}, "coulomb@0-1 holds it at rest anywhere within its limits"),
    "memory": (SDOF + jfsm.Maxwell(1.0, 1.0, at=LINK), {}, "maxwell@0-1 remembers the past"),
    "delay": (SDOF + jfsm.DelayedForce(1.0, 0.1, at=LINK), {}, "remembers the past"),
    "drift": (SDOF + jfsm.StiffnessDrift(1.0, 0.0, at=LINK), {}, "must not depend on time; the force of stiffness"),
    "drop": (SDOF + jfsm.StiffnessDrop(1.0, 12.3, at=LINK), {}, "must not depend on time; the force of stiffness"),
    "no mass": (jfsm.Structure([0.0]), {}, r"`mass` must be positive for the structure to move; got \[0.0\]"),
    "force": (SDOF, {"force": [1.0, 2.0]}, r"one constant force per degree of freedom \(1\); got 2"),
    "starts": (SDOF, {"starts": 0}, "`starts` must be 1 or more, a whole number; got 0"),
    "pair": (SDOF, {"within": 3.0}, r"`within` must be a pair \(low, high\) of displacements.*got 3.0"),
    "order": (SDOF, {"within": (1.0, -1.0)}, "with low below high"),
    "free": (jfsm.Structure.chain([1.0, 1.0], [0.0, 5.0]), {}, "rests anywhere along .* a continuum"),
    "gap": (jfsm.Structure([1.0]) + jfsm.EndStop(5.0, 0.2, at=LINK), {}, "rests anywhere along .* a continuum"),
    "pendulum": (jfsm.Structure([1.0]) + jfsm.SineStiffness(9.0, 1.0, at=LINK), {}, "`within` must be given"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_listed_is_refused_with_its_reason(name):
    model, options, message = REFUSED[name]
    with pytest.raises(ValueError, match=message):
        fixed_points(model, **options)
