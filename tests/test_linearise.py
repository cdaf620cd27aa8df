"""Small motion about a state: matrices, modes, and where there is no slope."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

import jfsm
from jfsm.dynamics import linearise
from jfsm.structures import MapTerm

LINK = (0, 1)
CHAIN = jfsm.Structure.chain([1.0, 2.0], [120.0, 240.0], [0.4, 0.3])
M, K, C = np.diag([1.0, 2.0]), np.array([[360.0, -240.0], [-240.0, 240.0]]), np.array([[0.7, -0.3], [-0.3, 0.3]])


def test_the_matrices_of_a_linear_structure_are_its_own():
    linear = linearise(CHAIN)
    for found, true in ((linear.mass, M), (linear.stiffness, K), (linear.damping, C)):
        np.testing.assert_allclose(found, true, rtol=1e-14)
    true = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    np.testing.assert_allclose(linear.matrix, true, rtol=1e-13)


def test_every_mode_solves_the_quadratic_eigenvalue_problem():
    linear = linearise(CHAIN)
    values = linear.frequencies * (-linear.damping_ratios + 1j * np.sqrt(1 - linear.damping_ratios**2))
    for value, shape in zip(values, linear.shapes.T, strict=True):
        assert np.max(np.abs((value**2 * M + value * C + K) @ shape)) < 1e-10 * np.max(K)
        assert np.isin(value.round(9), linear.eigenvalues.round(9))
    np.testing.assert_allclose(np.max(np.abs(linear.shapes), 0), 1.0)
    np.testing.assert_allclose(linear.shapes[np.argmax(np.abs(linear.shapes), 0), [0, 1]], 1.0)
    assert np.all(np.diff(linear.frequencies) > 0)


def test_without_damping_the_modes_are_those_of_mass_and_stiffness():
    squares, shapes = scipy.linalg.eigh(K, M)
    linear = linearise(jfsm.Structure.chain([1.0, 2.0], [120.0, 240.0]))
    np.testing.assert_allclose(linear.frequencies, np.sqrt(squares), rtol=1e-12)
    np.testing.assert_allclose(linear.damping_ratios, 0.0, atol=1e-12)
    largest = shapes[np.argmax(np.abs(shapes), 0), [0, 1]]
    np.testing.assert_allclose(linear.shapes, shapes / largest[None], atol=1e-12)


def test_one_mass_has_the_frequency_and_damping_ratio_of_the_textbook():
    linear = linearise(jfsm.Structure.sdof(2.0, 8.0, 0.4))
    np.testing.assert_allclose(linear.frequencies, [2.0], rtol=1e-14)
    np.testing.assert_allclose(linear.damping_ratios, [0.4 / (2 * 2.0 * 2.0)], rtol=1e-13)


def test_an_overdamped_mass_has_two_rates_of_damping_ratio_one():
    linear = linearise(jfsm.Structure.sdof(1.0, 9.0, 10.0))
    np.testing.assert_allclose(linear.frequencies, [1.0, 9.0], rtol=1e-13)
    np.testing.assert_allclose(linear.damping_ratios, 1.0)


@pytest.mark.parametrize("x", [-1.2, 0.0, 0.7])
def test_about_another_state_the_springs_have_their_slope_there(x):
    model = jfsm.Structure.sdof(1.0, 9.0, 0.12) + jfsm.CubicStiffness(10.0, at=LINK)
    linear = linearise(model, state=[x, 0.3])
    np.testing.assert_allclose(linear.stiffness, [[9.0 + 30.0 * x**2]], rtol=1e-14)
    np.testing.assert_allclose(linear.damping, [[0.12]], rtol=1e-14)


def test_a_damper_that_depends_on_place_gives_stiffness_where_there_is_speed():
    model = jfsm.Structure.sdof(1.0, 9.0) + jfsm.VanDerPol(2.0, 0.5, at=LINK)
    x, v = 0.7, -1.1
    linear = linearise(model, state=[x, v])
    np.testing.assert_allclose(linear.damping, [[2.0 * ((x / 0.5) ** 2 - 1)]], rtol=1e-13)
    np.testing.assert_allclose(linear.stiffness, [[9.0 + 2.0 * 2 * x / 0.25 * v]], rtol=1e-13)


def test_at_the_origin_a_map_gives_back_the_linear_part_of_what_it_learned():
    x, v = np.meshgrid(np.linspace(-1.0, 1.0, 11), np.linspace(-1.0, 1.0, 9))
    states = np.column_stack([x.ravel(), v.ravel()])
    force_map = jfsm.RKPM.fit(states, 9.0 * states[:, 0] + 10.0 * states[:, 0] ** 3 + 0.12 * states[:, 1], order=3)
    linear = linearise(jfsm.Structure([1.0]) + force_map.on(at=LINK))
    np.testing.assert_allclose([linear.stiffness[0, 0], linear.damping[0, 0]], [9.0, 0.12], rtol=1e-8)


class CubeRoot(eqx.Module):
    def __call__(self, state):
        return jnp.cbrt(state[0])


REFUSED = {
    "friction": (CHAIN + jfsm.Coulomb(1.0, at=(1, 2)), None, "must hold no friction that sticks: coulomb@1-2"),
    "time": (CHAIN + jfsm.PeriodicDisturbance(1.0, 2.0, 0.0, at=(0, 2)), None, "must not depend on time"),
    "state": (CHAIN, [0.0, 0.0], "`state` must hold 2 displacements, then 2 velocities; got 2 values"),
    "no slope": (CHAIN + MapTerm(CubeRoot(), at=LINK), None, "must have a slope at the state"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_has_no_linear_part_is_refused_with_its_reason(name):
    model, state, message = REFUSED[name]
    with pytest.raises(ValueError, match=message):
        linearise(model, state)
