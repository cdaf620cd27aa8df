"""Maps behind one contract: moving least squares, radial basis functions, one polynomial, and RKPM beside them."""

import io
import json
import os
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import RBFInterpolator

from jfsm.structures import MapTerm
from jfsm.surrogates import (
    RKPM,
    CubicSplineWindow,
    GaussianWindow,
    Kriging,
    Matern52,
    MovingLeastSquares,
    Plane,
    Polynomial,
    PowerExponential,
    RadialBasis,
    find_discontinuities,
    load_map,
    tabulate,
)

FAMILIES = (RKPM, MovingLeastSquares, RadialBasis, Polynomial)
UNITS = np.array([0.02, 3.0])


def scattered(n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (n, 2)) * UNITS


def quadratic(states):
    x, v = states[..., 0] / UNITS[0], states[..., 1] / UNITS[1]
    return 1.0 + 2.0 * x - v + 3.0 * x * v - 0.5 * v**2


def smooth_force(states):
    """A truth that is no polynomial."""
    return jnp.tanh(40.0 * states[..., 0]) + jnp.sin(states[..., 1]) * jnp.cos(30.0 * states[..., 0])


STATES, QUERIES = scattered(300), 0.8 * scattered(7, seed=1)
TWO_OUTPUTS = np.stack([quadratic(STATES), STATES[:, 1]], axis=1)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_polynomial_of_the_order_is_reproduced_with_its_derivatives(family):
    force_map = family.fit(STATES, quadratic(STATES), order=2)
    for query in QUERIES[:3]:
        exact = jax.grad(quadratic)(jnp.asarray(query))
        np.testing.assert_allclose(force_map(query), quadratic(query), atol=1e-9)
        np.testing.assert_allclose(force_map.gradient(query) * UNITS, exact * UNITS, atol=1e-8)
    found = np.asarray(force_map.evaluate_derivatives(QUERIES, ((0, 0), (1, 1), (0, 2))))
    found = found * np.array([1.0, UNITS.prod(), UNITS[1] ** 2])
    np.testing.assert_allclose(found[:, 0], quadratic(QUERIES), atol=1e-9)
    np.testing.assert_allclose(found[:, 1:], np.tile([3.0, -1.0], (7, 1)), atol=1e-6)


@pytest.mark.parametrize("family", FAMILIES)
def test_every_map_keeps_the_contract_of_shapes_boxes_and_terms(family):
    force_map = family.fit(STATES, TWO_OUTPUTS, order=2)
    query = QUERIES[0]
    assert force_map(query).shape == force_map.std(query).shape == (2,)
    assert force_map.gradient(query).shape == (2, 2)
    assert force_map.derivative(query, orders=(1, 1)).shape == (2,)
    assert force_map.evaluate(QUERIES).shape == (7, 2)
    assert force_map.evaluate(QUERIES[:0]).shape == (0, 2)
    assert np.array_equal(force_map.box, [STATES.min(axis=0), STATES.max(axis=0)])
    assert np.all(force_map.visited(QUERIES)) and not np.any(force_map.visited(QUERIES + 5.0 * UNITS))
    assert isinstance(force_map.on(at=(0, 1)), MapTerm)
    one_by_one = np.stack([force_map(q) for q in QUERIES])
    np.testing.assert_allclose(force_map.evaluate(QUERIES), one_by_one, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(eqx.filter_jit(force_map)(query), one_by_one[0], rtol=1e-10)
    np.testing.assert_allclose(jax.vmap(force_map)(jnp.asarray(QUERIES)), one_by_one, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("family", FAMILIES)
def test_the_error_of_every_map_falls_as_readings_are_added(family):
    orders = (4, 9) if family is Polynomial else (3, 3)
    errors = [
        np.max(np.abs(family.fit(s, smooth_force(s), order).evaluate(QUERIES) - smooth_force(QUERIES)))
        for s, order in zip((scattered(120), scattered(2000)), orders, strict=True)
    ]
    assert errors[1] < 0.2 * errors[0] and errors[1] < 5e-3, errors


def test_moving_least_squares_has_the_values_of_the_kernel_and_the_derivatives_of_its_own_value():
    window = CubicSplineWindow()
    force = smooth_force(STATES)
    moving = MovingLeastSquares.fit(STATES, force, order=2, window=window)
    np.testing.assert_allclose(moving.evaluate(QUERIES), RKPM.fit(STATES, force, order=2).evaluate(QUERIES), rtol=1e-12)
    for axis in (0, 1):
        step = np.eye(2)[axis] * 1e-5 * UNITS
        difference = (moving(QUERIES[0] + step) - moving(QUERIES[0] - step)) / (2.0 * step[axis])
        np.testing.assert_allclose(moving.gradient(QUERIES[0])[axis], difference, rtol=1e-6)


def test_a_radial_basis_map_is_that_of_scipy_with_the_same_neighbours():
    force = np.asarray(smooth_force(STATES))
    scale = STATES.std(axis=0)
    theirs = RBFInterpolator(STATES / scale, force, neighbors=40, kernel="quintic", degree=3)
    ours = RadialBasis.fit(STATES, force, order=3, neighbours=40)
    np.testing.assert_allclose(ours.evaluate(QUERIES), theirs(QUERIES / scale), rtol=1e-7, atol=1e-8)
    np.testing.assert_allclose(ours.evaluate(STATES[:5]), force[:5], atol=1e-9)


def test_the_standard_error_of_a_spline_is_zero_at_a_reading_and_grows_away_from_all():
    force_map = RadialBasis.fit(STATES, smooth_force(STATES), order=3)
    at_reading, between, outside = (float(force_map.std(s)) for s in (STATES[4], QUERIES[0], 1.3 * UNITS))
    assert at_reading < 1e-6 < between < outside


def test_the_standard_error_of_a_polynomial_is_the_scatter_of_repeated_experiments():
    noise = np.random.default_rng(3).normal(scale=0.3, size=(300, 400))
    force_map = Polynomial.fit(STATES, noise, order=2)
    stated = np.sqrt(np.mean(np.asarray(force_map.std(QUERIES[0])) ** 2))
    assert abs(stated / np.std(np.asarray(force_map(QUERIES[0]))) - 1.0) < 0.12  # three s.d. from 400 experiments


def test_smoothing_takes_a_spline_towards_the_polynomial_of_its_neighbours():
    noisy = quadratic(STATES) + 0.2 * np.random.default_rng(4).normal(size=300)
    maps = [RadialBasis.fit(STATES, noisy, order=2, neighbours=100, smoothing=s) for s in (0.0, 100.0)]
    errors = [np.std(force_map.evaluate(QUERIES) - quadratic(QUERIES)) for force_map in maps]
    assert errors[1] < 0.7 * errors[0], errors


@pytest.mark.parametrize("family", FAMILIES)
def test_every_map_is_differentiable_by_readings_and_states_through_the_map(family):
    force_map = family.fit(STATES, quadratic(STATES) ** 2, order=2)
    query = jnp.asarray(QUERIES[0])
    slope = eqx.filter_grad(lambda tree: tree(query))(force_map)
    if family is not Polynomial:  # whose coefficients are kept, not its readings
        np.testing.assert_allclose(jnp.vdot(slope.nodes.force, force_map.nodes.force), force_map(query), rtol=1e-8)

    def by_force(scale):
        return family.fit(STATES, scale * quadratic(STATES) ** 2, order=2)(query)

    np.testing.assert_allclose(jax.grad(by_force)(1.0), force_map(query), rtol=1e-8)


@pytest.mark.parametrize(
    ("family", "arguments", "message"),
    [
        (RadialBasis, {"neighbours": 5}, "`neighbours` must be an integer of 6 or more; got 5"),
        (RadialBasis, {"neighbours": 301}, r"`neighbours` must be 300 \(all distinct states\) at most; got 301"),
        (RadialBasis, {"smoothing": -1.0}, "`smoothing` must not be negative; got -1"),
        (Polynomial, {"order": 0}, "`order` must be an integer of 1 or more; got 0"),
        (Polynomial, {"order": 30}, "at least 496 distinct points for order 30"),
        (MovingLeastSquares, {"neighbours": 5}, "`neighbours` must be an integer from 6"),
    ],
)
def test_a_wrong_fit_of_another_map_is_refused(family, arguments, message):
    with pytest.raises(ValueError, match=message):
        family.fit(STATES, quadratic(STATES), **{"order": 2, **arguments})


def test_a_spline_without_spare_nodes_has_no_standard_error():
    with pytest.raises(ValueError, match="`std` needs more neighbours than the 6 monomials"):
        RadialBasis.fit(STATES, quadratic(STATES), order=2, neighbours=6).std(QUERIES[0])


def jumping(states):
    return quadratic(states) + 5.0 * np.sign(states[..., 1])


SAVED = {
    "RKPM": lambda: RKPM.fit(STATES, quadratic(STATES), order=2),
    "RKPM, window": lambda: RKPM.fit(STATES, TWO_OUTPUTS, window=GaussianWindow(0.3), across=[Plane((1, 0), 0.001)]),
    "RKPM, robust": lambda: RKPM.fit(
        STATES, jumping(STATES), across=find_discontinuities(STATES, jumping(STATES)), robust=True
    ),
    "moving least squares": lambda: MovingLeastSquares.fit(STATES, TWO_OUTPUTS),
    "radial basis": lambda: RadialBasis.fit(STATES, TWO_OUTPUTS, smoothing=0.1),
    "polynomial": lambda: Polynomial.fit(STATES, TWO_OUTPUTS),
    "kriging": lambda: Kriging.fit(STATES[:60], smooth_force(STATES[:60])),
    "kriging, outputs": lambda: Kriging.fit(
        STATES[:60], TWO_OUTPUTS[:60], PowerExponential(1.5), "pure quadratic", length_scale=UNITS, nugget=0.1
    ),
    "kriging, shared": lambda: Kriging.fit(
        STATES[:60], TWO_OUTPUTS[:60], Matern52(), length_scale=UNITS, nugget=0.1, outputs="shared"
    ),
    "table": lambda: tabulate(RKPM.fit(STATES, quadratic(STATES), order=2), nodes=12),
}


@pytest.mark.parametrize("make", SAVED.values(), ids=SAVED)
def test_a_file_gives_a_map_back_to_the_last_bit(make, tmp_path):
    force_map = make()
    force_map.save(tmp_path / "map.npz")
    loaded = load_map(tmp_path / "map.npz")
    assert jax.tree.structure(loaded) == jax.tree.structure(force_map)
    for mine, theirs in zip(jax.tree.leaves(loaded), jax.tree.leaves(force_map), strict=True):
        assert mine.dtype == theirs.dtype and np.array_equal(mine, theirs)
    for query in QUERIES[:2]:
        assert np.array_equal(loaded(query), force_map(query))
    assert [path.name for path in tmp_path.iterdir()] == ["map.npz"]


def test_a_map_with_an_interface_of_its_owner_is_not_written(tmp_path):
    force_map = RKPM.fit(STATES, jumping(STATES), order=2, across=[lambda state: state[1]])
    with pytest.raises(ValueError, match=r"can be written if all its parts are those of jfsm; its rule\.across\.0 is"):
        force_map.save(tmp_path / "map.npz")
    assert list(tmp_path.iterdir()) == []


class Trap:
    """Leaves a file behind when it is unpickled."""

    def __init__(self, path: Path):
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


def changed(change, tmp_path: Path) -> Path:
    """The file of an RKPM map whose arrays and header were changed by hand."""
    path = tmp_path / "map.npz"
    RKPM.fit(STATES, quadratic(STATES), order=2).save(path)
    with np.load(path) as archive:
        arrays = dict(archive)
    header = json.loads(str(arrays["header"]))
    change(arrays, header["map"])
    np.savez(path, **{**arrays, "header": np.array(json.dumps(header))})
    return path


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda arrays, parts: arrays.pop("nodes.reach"), "nodes.reach"),
        (lambda arrays, parts: arrays.update(more=np.ones(3)), "'more' belongs to no part of the map"),
        (lambda arrays, parts: arrays.update({"nodes.scale": np.ones(3)}), r"scale of Nodes of shape \(3,\)"),
        (lambda arrays, parts: arrays.update({"nodes.scale": np.array([1.0, np.nan])}), "numbers in double precision"),
        (lambda arrays, parts: arrays.update({"nodes.scale": np.array([1, 2])}), "one is of int64"),
        (lambda arrays, parts: parts.update({"class": "Popen"}), "Popen"),
        (lambda arrays, parts: parts["nodes"].update({"class": "Rule"}), "a Rule has window, order"),
        (lambda arrays, parts: parts["rule"]["window"].update({"class": "Gaussian"}), "window of Rule"),
        (lambda arrays, parts: parts["rule"].update(order=True), "order of Rule"),
        (lambda arrays, parts: parts["rule"].update(order=10**9), "`neighbours` must be an integer from"),
        (lambda arrays, parts: parts["rule"].update(neighbours=10**9), "`neighbours` must be an integer from"),
        (lambda arrays, parts: parts["rule"].update(across=[{"class": "Gaussian"}]), "return one number"),
        (lambda arrays, parts: arrays.update({"rule.dilation": np.array(-1.0)}), "`dilation` must lie above 0"),
        (lambda arrays, parts: (parts.clear(), parts.update({"class": "Gaussian"}), arrays.clear()), "is no map"),
    ],
)
def test_a_file_that_was_changed_is_refused(change, words, tmp_path):
    path = changed(change, tmp_path)
    with pytest.raises(ValueError, match=rf"(?s)map\.npz must be a map that `force_map.save\(path\)` wrote.*{words}"):
        load_map(path)


def test_nothing_in_a_file_is_run(tmp_path):
    path = changed(
        lambda arrays, parts: arrays.update(evil=np.array(Trap(tmp_path / "sprung"), dtype=object)), tmp_path
    )
    with pytest.raises(ValueError, match=r"map\.npz must be a map"):
        load_map(path)
    assert not (tmp_path / "sprung").exists()


@pytest.mark.parametrize("content", [b"", b"nonsense", b"PK\x03\x04nonsense"])
def test_a_file_that_is_no_map_is_refused(content, tmp_path):
    (tmp_path / "map.npz").write_bytes(content)
    with pytest.raises(
        ValueError, match=r"map\.npz must be a map that `force_map.save\(path\)` wrote; .*Save or copy it"
    ):
        load_map(tmp_path / "map.npz")
    with pytest.raises(FileNotFoundError, match=r"There is no map file .*none\.npz; write one with `force_map.save"):
        load_map(tmp_path / "none.npz")


def test_a_map_that_is_cut_short_is_refused_and_so_is_a_record(tmp_path):
    stream = io.BytesIO()
    RKPM.fit(STATES, quadratic(STATES), order=2).save(stream)
    for length in (100, len(stream.getvalue()) // 2, len(stream.getvalue()) - 30):
        (tmp_path / "map.npz").write_bytes(stream.getvalue()[:length])
        with pytest.raises(ValueError, match="It may be cut short"):
            load_map(tmp_path / "map.npz")
    np.savez(tmp_path / "run.npz", time=np.arange(3.0))
    with pytest.raises(ValueError, match="it says of no map what it is made of"):
        load_map(tmp_path / "run.npz")


def test_a_map_that_cannot_be_written_leaves_the_old_one(tmp_path, monkeypatch):
    path = tmp_path / "map.npz"
    path.write_bytes(b"old")

    def full_disk(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full_disk)
    with pytest.raises(OSError, match="No space left on device"):
        Polynomial.fit(STATES, quadratic(STATES)).save(path)
    assert path.read_bytes() == b"old" and list(tmp_path.iterdir()) == [path]
