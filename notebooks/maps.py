# %% [markdown]
# # Maps of a force: RKPM and kriging beside SciPy and scikit-learn
#
# A force state map is the force of a link over its displacement and velocity, learned from scattered readings. Here the
# hardening oscillator of Duffing: states along one run, and its force with 3 % noise.

# %%
import warnings

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.optimize import minimize
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

import jfsm

jax.config.update("jax_enable_x64", True)

# %%
t, rng = np.arange(600) / 40, np.random.default_rng(0)
g = 6 * (np.cos(1.3 * t) + np.sin(2.9 * t + 1) + np.cos(4.1 * t + 2))
run = jfsm.simulate(jfsm.systems.duffing(), jfsm.Record(t, force=g, at_rest=True))
states = np.stack([np.asarray(run.displacement)[:, 0], np.asarray(run.velocity)[:, 0]], axis=1)


def true_force(s):
    return 9.0 * s[:, 0] + 10.0 * s[:, 0] ** 3 + 0.12 * s[:, 1]


exact = true_force(states)
force = exact + 0.03 * exact.std() * rng.standard_normal(exact.size)
seen, unseen = states[::2], states[1::2]

# %% [markdown]
# ## Four maps of the same readings
#
# jfsm chooses its hyper-parameters itself: RKPM order and support by the readings left out, kriging by the likelihood.

# %%
rkpm, scores = jfsm.RKPM.select(seen, force[::2])
kriging = jfsm.Kriging.fit(seen, force[::2], trend="quadratic")
size = states.std(axis=0)
scipy_map = RBFInterpolator(seen / size, force[::2], neighbors=50, smoothing=1e-2)
kernel = ConstantKernel(100.0, (1e-2, 1e8)) * RBF([1.0, 1.0], (1e-2, 1e4)) + WhiteKernel(0.1, (1e-6, 1e3))
learned = GaussianProcessRegressor(kernel, normalize_y=True)
with warnings.catch_warnings():
    warnings.simplefilter("ignore", ConvergenceWarning)  # a length scale at its bound: the force is linear in v
    learned.fit(seen / size, force[::2])
predictions = {
    "jfsm.RKPM": np.asarray(rkpm.evaluate(unseen)),
    "jfsm.Kriging": np.asarray(kriging.evaluate(unseen)),
    "SciPy RBFInterpolator": scipy_map(unseen / size),
    "scikit-learn GP": learned.predict(unseen / size),
}
errors = {name: np.std(y - exact[1::2]) / np.std(exact) for name, y in predictions.items()}
for name, error in errors.items():
    print(f"{name:24} {100 * error:6.2f} % of the force's spread")

# %% [markdown]
# ## Derivatives and standard errors
#
# The slope over displacement is the tangent stiffness, 9 + 30 x². Both maps of jfsm give it without differences, and
# kriging says how sure it is. Errors along a line go together, so the share of one line that lies within the band is no
# count of how often the band is right.

# %%
x = np.linspace(states[:, 0].min(), states[:, 0].max(), 80)
line = np.stack([x, np.zeros_like(x)], axis=1)
slope = np.asarray(kriging.evaluate_derivatives(line, ((1, 0),)))[:, 0]
half = 1.96 * np.asarray(kriging.evaluate_std(line, (1, 0)))
figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.fill_between(x, slope - half, slope + half, alpha=0.3, label="kriging, 95 %")
axes.plot(x, slope, label="kriging")
axes.plot(x, 9 + 30 * x**2, "k--", label="truth")
axes.set(xlabel="displacement [m]", ylabel="stiffness [N/m]")
_ = axes.legend()
print(f"within the band: {np.mean(np.abs(slope - 9 - 30 * x**2) < half):.0%} of this line")

# %% [markdown]
# ## Hyper-parameters by gradient
#
# The likelihood of kriging can be differentiated, so any optimiser can be used. Here SciPy's, from a poor start; the
# gradient comes from JAX.

# %%
objective = jax.jit(
    jax.value_and_grad(lambda p: jfsm.Kriging.negative_log_likelihood(p, jnp.asarray(seen), jnp.asarray(force[::2])))
)
start = np.array([1.0, 1.0, -2.0])
found = minimize(lambda p: [np.asarray(y, float) for y in objective(p)], start, jac=True, method="L-BFGS-B")
print(f"{found.nfev} evaluations; -log likelihood {float(objective(start)[0]):.1f} -> {found.fun:.1f}")
step = 1e-5 * np.eye(3)
differences = [(float(objective(start + e)[0]) - float(objective(start - e)[0])) / 2e-5 for e in step]
print(np.asarray(objective(start)[1]), np.array(differences))

# %%
assert errors["jfsm.RKPM"] < 0.02 and errors["jfsm.Kriging"] < 0.01
assert errors["jfsm.Kriging"] < errors["SciPy RBFInterpolator"]
assert found.fun < float(objective(start)[0])
assert np.all(np.abs(slope - 9 - 30 * x**2) < 2.5 * half)
np.testing.assert_allclose(np.asarray(objective(start)[1]), differences, rtol=1e-4, atol=1e-4)
