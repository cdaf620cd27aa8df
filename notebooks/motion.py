# %% [markdown]
# # Motion first: why a map of raw readings is biased
#
# A map learned from noisy displacements and velocities has slopes that are too small, however many readings there are.
# `jfsm.estimate_motion` smooths the motion by all channels together; `jfsm.estimate_force_map` finds motion and map in
# one, and its error bars know of all noise.

# %%
import jax
import matplotlib.pyplot as plt
import numpy as np

import jfsm

jax.config.update("jax_enable_x64", True)

# %%
t, rng = np.arange(900) / 60, np.random.default_rng(2)
g = 6 * (np.cos(1.3 * t) + np.sin(2.9 * t + 1) + np.cos(4.1 * t + 2))
run = jfsm.simulate(jfsm.systems.duffing(), jfsm.Record(t, force=g, at_rest=True))
kinds = ("displacement", "velocity", "acceleration")
clean = {kind: np.asarray(getattr(run, kind))[:, 0] for kind in kinds}
noisy = {kind: y + 0.05 * y.std() * rng.standard_normal(t.size) for kind, y in clean.items()}
record = jfsm.Record(t, force=g, **noisy)

# %% [markdown]
# ## The motion

# %%
motion = jfsm.estimate_motion(record)
left = {kind: np.std(np.asarray(getattr(motion, kind))[:, 0] - clean[kind]) for kind in kinds}
raw = {kind: np.std(noisy[kind] - clean[kind]) for kind in kinds}
for kind in kinds:
    print(f"{kind:13} noise {raw[kind]:.4f} -> {left[kind]:.4f}, a factor of {raw[kind] / left[kind]:.1f}")

# %% [markdown]
# ## The map, from raw readings and from the motion

# %%
smooth = {kind: np.asarray(getattr(motion, kind))[:, 0] for kind in kinds}
maps = {}
for name, of in (("raw readings", noisy), ("after estimate_motion", smooth)):
    states = np.stack([of["displacement"], of["velocity"]], axis=1)
    maps[name] = jfsm.RKPM.fit(states, g - of["acceleration"], order=3, neighbours=160)
x = np.linspace(-0.8, 0.8, 60)
line = np.stack([x, np.zeros_like(x)], axis=1)
exact = 9 * x + 10 * x**3
errors = {name: np.std(np.asarray(m.evaluate(line)) - exact) / np.std(exact) for name, m in maps.items()}
print(errors)

# %%
figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
for name, m in maps.items():
    axes.plot(x, np.asarray(m.evaluate(line)) - exact, label=name)
axes.axhline(0, color="k", linewidth=0.5)
axes.set(xlabel="displacement [m]", ylabel="error of the force [N]")
_ = axes.legend()

# %%
assert all(left[kind] < raw[kind] / 1.3 for kind in kinds)
assert errors["after estimate_motion"] < errors["raw readings"]
