"""Structures from matrices and from modes."""

import numpy as np
import pytest

import jfsm
from jfsm.plant import lower

M = np.diag([2.0, 1.0, 3.0])
K = np.array([[360.0, -240.0, 0.0], [-240.0, 300.0, -60.0], [0.0, -60.0, 60.0]])
C = np.array([[0.7, -0.3, 0.0], [-0.3, 0.3, 0.0], [0.0, 0.0, 0.2]])


def test_the_matrices_come_back_and_the_links_are_the_couplings():
    model = jfsm.Structure.from_matrices(M, K, C)
    plant = lower(model)
    for found, given in ((plant.mass, M), (plant.stiffness, K), (plant.damping, C)):
        np.testing.assert_allclose(found, given, rtol=1e-12, atol=1e-12)
    assert set(model.links) == {(0, 1), (1, 2), (2, 3), (0, 3)}
    assert model.values()["stiffness@2-3.k"] == pytest.approx(60.0)


def test_a_full_mass_matrix_is_kept():
    mass = np.array([[2.0, 0.3], [0.3, 1.0]])
    plant = lower(jfsm.Structure.from_matrices(mass, [[3.0, -1.0], [-1.0, 1.0]]))
    np.testing.assert_allclose(plant.mass, mass)
    assert not np.any(plant.damping)


@pytest.mark.parametrize("modal_masses", [None, [2.0, 0.5]])
def test_a_structure_from_modes_has_these_modes(modal_masses):
    shapes = np.array([[0.5, 1.0], [1.0, -0.4]])
    model = jfsm.Structure.from_modes(
        frequencies=[1.0, 2.5], damping_ratios=[0.01, 0.03], shapes=shapes, modal_masses=modal_masses
    )
    found = jfsm.linearise(model)
    np.testing.assert_allclose(np.sort(found.frequencies), 2 * np.pi * np.array([1.0, 2.5]), rtol=1e-10)
    np.testing.assert_allclose(np.sort(found.damping_ratios), [0.01, 0.03], rtol=1e-8)
    plant = lower(model)
    np.testing.assert_allclose(shapes.T @ plant.mass @ shapes, np.diag(modal_masses or [1.0, 1.0]), atol=1e-10)


@pytest.mark.parametrize(("call", "message"), [
    (lambda: jfsm.Structure.from_matrices(M, K[:2, :2]), r"`stiffness` must be symmetric and of the size of `mass`"),
    (lambda: jfsm.Structure.from_matrices(M, K + np.triu(K, 1)), r"`stiffness` must be symmetric"),
    (lambda: jfsm.Structure.from_modes([1.0, 2.0], [0.01], np.eye(2)), r"`damping_ratios` must have 2 modes"),
    (lambda: jfsm.Structure.from_modes([1.0, 2.0], [0.01, 0.01], np.ones((2, 2))), r"`shapes` must hold independent"),
])  # fmt: skip
def test_what_makes_no_structure_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
