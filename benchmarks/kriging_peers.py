"""Gaussian processes of other libraries, those that are installed, for `kriging.py`.

All are given a Gaussian correlation with two length scales, process variance and noise, and a force that has lost its
trend. An objective takes the logarithms of these four, the noise as a variance, and gives the negative log-likelihood
and its gradient; a whole fit is SciPy's L-BFGS-B on it, from one start.
"""

import importlib.util
from collections.abc import Callable, Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import minimize

Objective = Callable[[np.ndarray], tuple[Any, Any]]
# pyright: reportMissingImports=false


def objectives(states: np.ndarray, force: np.ndarray) -> Iterator[tuple[str, Objective]]:
    """Of every library that is here."""
    known = {"sklearn": _scikit_learn, "tinygp": _tinygp, "gpjax": _gpjax, "gpytorch": _gpytorch}
    for module, make in known.items():
        if importlib.util.find_spec(module):
            yield module, make(states, force)


def climbed(objective: Objective, states: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Logarithms of length scales and nugget where a fit ends that began at unit length scales and a nugget of 0.1."""
    variance = float(np.var(force))
    start = np.log([*states.std(axis=0), variance, 0.1 * variance])

    def plain(point: np.ndarray) -> tuple[float, np.ndarray]:
        value, gradient = objective(point)
        return float(value), np.asarray(gradient, dtype=float)

    end = minimize(plain, start, jac=True, method="L-BFGS-B").x
    return np.array([end[0], end[1], end[3] - end[2]])


def smt(states: np.ndarray, force: np.ndarray) -> np.ndarray | None:
    """Where a fit of the Surrogate Modeling Toolbox ends; it has no objective to be called by itself."""
    if not importlib.util.find_spec("smt"):
        return None
    from smt.surrogate_models import KRG

    model = KRG(poly="constant", corr="squar_exp", eval_noise=True, theta0=[0.5, 0.5], print_global=False)
    model.set_training_values(states, force)
    model.train()
    theta, spread = np.asarray(model.optimal_theta), states.std(axis=0, ddof=1)
    return np.log([*(spread / np.sqrt(2.0 * theta)), float(np.squeeze(model.optimal_noise))])


def _scikit_learn(states: np.ndarray, force: np.ndarray) -> Objective:
    from sklearn.gaussian_process import GaussianProcessRegressor, kernels

    scales: Any = [1.0, 1.0]
    kernel: Any = kernels.ConstantKernel(1.0) * kernels.RBF(scales) + kernels.WhiteKernel(1.0)
    options: Any = {"optimizer": None}
    model: Any = GaussianProcessRegressor(kernel, **options).fit(states, force)

    def objective(point: np.ndarray) -> tuple[Any, Any]:
        value, gradient = model.log_marginal_likelihood(point[[2, 0, 1, 3]], eval_gradient=True)
        return -value, -gradient[[1, 2, 0, 3]]

    return objective


def _tinygp(states: np.ndarray, force: np.ndarray) -> Objective:
    import tinygp

    def value(point, x, y):
        length, variance, noise = jnp.exp(point[:2]), jnp.exp(point[2]), jnp.exp(point[3])
        kernel = variance * tinygp.transforms.Linear(1.0 / length, tinygp.kernels.ExpSquared())
        return -tinygp.GaussianProcess(kernel, x, diag=noise).log_probability(y)

    return _compiled(value, states, force)


def _gpjax(states: np.ndarray, force: np.ndarray) -> Objective:
    import gpjax

    def value(point, x, y):
        kernel = gpjax.kernels.RBF(lengthscale=jnp.exp(point[:2]), variance=jnp.exp(point[2]))
        prior = gpjax.gps.Prior(kernel=kernel, mean_function=gpjax.mean_functions.Zero())
        noise = gpjax.likelihoods.Gaussian(obs_stddev=jnp.exp(point[3] / 2.0))
        return -gpjax.objectives.conjugate_mll(prior * noise, gpjax.Dataset(X=x, y=y[:, None]))

    return _compiled(value, states, force)


def _gpytorch(states: np.ndarray, force: np.ndarray) -> Objective:
    import gpytorch
    import torch

    x, y = torch.tensor(states), torch.tensor(force)

    def objective(point: np.ndarray) -> tuple[Any, Any]:
        parameters = torch.tensor(point, requires_grad=True)
        scaled = x / torch.exp(parameters[:2])
        kernel = gpytorch.kernels.RBFKernel().double()
        kernel.lengthscale = 1.0
        covariance = torch.exp(parameters[2]) * kernel(scaled).to_dense()
        covariance = covariance + torch.exp(parameters[3]) * torch.eye(len(y), dtype=y.dtype)
        with gpytorch.settings.max_cholesky_size(len(y) + 1):
            value = -gpytorch.distributions.MultivariateNormal(torch.zeros_like(y), covariance).log_prob(y)
        value.backward()
        return value.detach().numpy(), parameters.grad.numpy()  # pyright: ignore[reportOptionalMemberAccess]

    return objective


def _compiled(value: Any, states: np.ndarray, force: np.ndarray) -> Objective:
    both, x, y = jax.jit(jax.value_and_grad(value)), jnp.asarray(states), jnp.asarray(force)
    return lambda point: jax.block_until_ready(both(jnp.asarray(point), x, y))
