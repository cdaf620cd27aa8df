# %% [markdown]
# # A first diagnosis
#
# A mass on a spring is shaken. Its owner believes in a linear spring; the real one hardens. The record is made here, so
# that the truth is known.

# %%
import jax
import matplotlib.pyplot as plt
import numpy as np

import jfsm

jax.config.update("jax_enable_x64", True)

# %% [markdown]
# ## The record
#
# A force of three tones, sampled at 50 Hz, and the displacement with 1 % noise. `at_rest=True`: the mass rested at the
# first sample.

# %%
t, rng = np.arange(800) / 50, np.random.default_rng(0)
g = 4 * (np.cos(1.1 * t) + np.sin(2.3 * t + 1) + np.cos(3.7 * t + 2))
truth = jfsm.Structure.sdof(mass=1.0, stiffness=9.0, damping=0.3) + jfsm.CubicStiffness(2.0, at=(0, 1))
x = np.asarray(jfsm.simulate(truth, jfsm.Record(t, force=g, at_rest=True)).displacement)[:, 0]
record = jfsm.Record(t, force=g, displacement=x + 0.01 * x.std() * rng.standard_normal(t.size), at_rest=True)
record.inspect().print()

# %% [markdown]
# ## What its owner believes

# %%
model = jfsm.Structure.sdof(mass=1.0, stiffness=9.1, damping=0.28)
believed = jfsm.simulate(model, record)
figure, axes = plt.subplots(figsize=(7, 2.5), layout="constrained")
axes.plot(t, record.displacement, "k", linewidth=0.8, label="measured")
axes.plot(t, believed.displacement, "C3", linewidth=0.8, label="model")
axes.set(xlabel="time [s]", ylabel="displacement [m]")
_ = axes.legend()

# %% [markdown]
# ## The diagnosis
#
# Three causes compete here, to be quick. Without `causes` the whole catalogue does.

# %%
causes = ["cubic_hardening", "coulomb", "quadratic_damping"]
d = jfsm.diagnose(record, model, causes=causes, key=jax.random.key(0), progress=False)
d.print()

# %% [markdown]
# The cause is named, with its place, its size and an interval. The gain is the error of a free run over the last 30 %
# of the record, which took no part in any fit.

# %%
better = jfsm.simulate(d.extended, record)
figure, axes = plt.subplots(figsize=(7, 2.5), layout="constrained")
axes.plot(t, record.displacement, "k", linewidth=0.8, label="measured")
axes.plot(t, better.displacement, "C2--", linewidth=0.8, label="extended model")
axes.set(xlabel="time [s]", ylabel="displacement [m]")
_ = axes.legend()

# %% [markdown]
# Why this verdict, and what became of another cause:

# %%
print(d.why("coulomb"))

# %%
found = d.findings[0]
assert found.cause == "cubic_hardening" and found.at == (0, 1) and found.probability > 0.99
assert found.parameters["k3"].low < 2.0 < found.parameters["k3"].high
assert np.std(np.asarray(better.displacement)[:, 0] - x) < 0.02 * np.std(x)
