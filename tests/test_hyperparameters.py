"""Likelihood and leave-one-out errors as functions of the hyper-parameters: derivatives, and many data sets at once."""

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
import pytest

from jfsm.surrogates import RKPM, Exponential, Gaussian, GaussianWindow, Kriging, Matern52

UNIT = np.array([0.02, 3.0])
"""Metres and metres per second, say."""
STATES = np.random.default_rng(0).uniform(-1.0, 1.0, (48, 2)) * UNIT
FORCE = np.tanh(60.0 * STATES[:, 0]) + np.sin(STATES[:, 1]) + 0.05 * np.random.default_rng(1).normal(size=48)
POINT = np.log([0.011, 1.7, 0.02])
WEIGHING = np.log([*STATES.std(axis=0), 0.9, 0.5])
"""Scales, dilation, and the width of a Gaussian window."""


def of_kriging(log_parameters, correlation=None):
    return jnp.mean(Kriging.leave_one_out_errors(log_parameters, STATES, FORCE, correlation, "linear") ** 2)


def of_rkpm(log_parameters):
    errors = RKPM.leave_one_out_errors(log_parameters, STATES, FORCE, 1, 20, GaussianWindow())
    return jnp.mean(errors**2)


def central(function, at, h):
    """Derivative of a function by every parameter, in the first axis; the error falls like the fourth power of h."""

    def difference(step):
        pairs = [(function(at + step * way), function(at - step * way)) for way in np.eye(len(at))]
        return np.stack([np.asarray(up) - np.asarray(down) for up, down in pairs]) / (2.0 * step)

    return (4.0 * difference(h) - difference(2.0 * h)) / 3.0


@pytest.mark.parametrize("restricted", [False, True])
@pytest.mark.parametrize("correlation", [Gaussian(), Matern52(), Exponential()], ids=lambda c: type(c).__name__)
def test_the_hessian_of_the_likelihood_agrees_with_differences_of_its_gradient(correlation, restricted):
    def value(log_parameters):
        return Kriging.negative_log_likelihood(log_parameters, STATES, FORCE, correlation, "linear", restricted)

    gradient = jax.jit(jax.grad(value))
    hessian = jax.hessian(value)(jnp.asarray(POINT))
    np.testing.assert_allclose(hessian, central(gradient, POINT, 1e-3), rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(hessian, hessian.T, rtol=0, atol=1e-10)


@pytest.mark.parametrize("trend", ["constant", "quadratic"])
def test_errors_of_kriging_left_out_are_those_of_fits_without_the_reading(trend):
    force = np.stack([FORCE, FORCE**2], axis=1)
    errors = Kriging.leave_one_out_errors(POINT, STATES, force, trend=trend)
    assert errors.shape == (48, 2)
    for i in (0, 17, 47):
        rest = np.arange(48) != i
        without = Kriging.fit(
            STATES[rest], force[rest], trend=trend, outputs="shared", length_scale=np.exp(POINT[:2]), nugget=0.02
        )
        np.testing.assert_allclose(errors[i], force[i] - without(STATES[i]), rtol=1e-8)


@pytest.mark.parametrize("measure", [of_kriging, pytest.param(of_rkpm, marks=pytest.mark.slow)])
def test_leave_one_out_errors_are_twice_differentiable(measure):
    at = POINT if measure is of_kriging else WEIGHING
    value, gradient = jax.jit(measure), jax.jit(jax.grad(measure))
    np.testing.assert_allclose(gradient(at), central(value, at, 1e-6), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(jax.hessian(measure)(jnp.asarray(at)), central(gradient, at, 1e-6), rtol=1e-5, atol=1e-7)


def test_errors_of_a_reproducing_kernel_map_left_out_are_those_of_the_map_that_was_fitted():
    given = np.exp(WEIGHING)
    fitted = RKPM.fit(STATES, FORCE, 2, 20, GaussianWindow(given[3]), dilation=given[2])
    errors = RKPM.leave_one_out_errors(WEIGHING, STATES, FORCE, 2, 20, GaussianWindow())
    order = np.lexsort(STATES.T[::-1])
    np.testing.assert_allclose(errors[order], fitted.leave_one_out(), rtol=0, atol=1e-11)


def test_errors_of_a_reproducing_kernel_map_left_out_are_those_of_maps_without_the_reading():
    points, values = STATES[:30], FORCE[:30]
    log_parameters = np.log([*points.std(axis=0), 1.0])
    errors = RKPM.leave_one_out_errors(log_parameters, points, values, 1, 29)
    for i in (3, 21):
        distance = np.linalg.norm((points - points[i]) / points.std(axis=0), axis=1)
        r = 2.0 * distance / distance.max()  # the farthest of all nodes stands at the edge of the window
        weight = np.where(r < 1.0, 2 / 3 - r**2 + r**3 / 2, np.maximum(2.0 - r, 0.0) ** 3 / 6.0)
        weight[i] = 0.0
        basis = np.column_stack([np.ones(30), points - points[i]]) * np.sqrt(weight)[:, None]
        plane, *_ = np.linalg.lstsq(basis, values * np.sqrt(weight))
        assert errors[i] == pytest.approx(values[i] - plane[0], rel=1e-8)


def test_many_data_sets_are_studied_in_one_call():
    noise = np.random.default_rng(3).normal(size=(4, 48))
    forces = jnp.asarray(np.sin(150.0 * STATES[:, 0]) + np.sin(STATES[:, 1]) + 0.1 * noise)

    def ended(force):
        def value(log_parameters, _):
            return Kriging.negative_log_likelihood(log_parameters, STATES, force, trend="linear") / len(force)

        solver = optx.BFGS(rtol=1e-6, atol=1e-6)
        return optx.minimise(value, solver, jnp.asarray(POINT), throw=False).value

    ends = jax.jit(jax.vmap(ended))(forces)
    for end, force in zip(ends, np.asarray(forces), strict=True):
        found = Kriging.fit(STATES, force, trend="linear")
        least = Kriging.negative_log_likelihood(end, STATES, force, trend="linear")
        assert least == pytest.approx(-float(found.log_likelihood), abs=1e-3)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Kriging.leave_one_out_errors(POINT[:2], STATES, FORCE), "the logarithms of 2 length scales"),
        (lambda: Kriging.leave_one_out_errors(POINT, STATES[:5], FORCE[:5]), "more points than the trend"),
        (lambda: RKPM.leave_one_out_errors(WEIGHING, STATES, FORCE), "logarithms of 2 scales.* got shape"),
        (lambda: RKPM.leave_one_out_errors(WEIGHING[:3], STATES[:5], FORCE[:5]), "at least 10 distinct points"),
    ],
)
def test_wrong_hyper_parameters_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
