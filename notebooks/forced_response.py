# %% [markdown]
# # Forced response, backbone and limit cycles of a diagnosed model
#
# A model that was diagnosed can be asked what no record shows: where its response jumps, how its frequency changes with
# amplitude, and whether it oscillates by itself.

# %%
import jax
import matplotlib.pyplot as plt
import numpy as np

import jfsm

jax.config.update("jax_enable_x64", True)

# %% [markdown]
# ## A spring that hardens, found in a random test

# %%
t, rng = np.arange(800) / 50, np.random.default_rng(0)
g = 4 * (np.cos(1.1 * t) + np.sin(2.3 * t + 1) + np.cos(3.7 * t + 2))
truth = jfsm.Structure.sdof(mass=1.0, stiffness=9.0, damping=0.3) + jfsm.CubicStiffness(2.0, at=(0, 1))
run = jfsm.simulate(truth, jfsm.Record(t, force=g, at_rest=True))
x = np.asarray(run.displacement)[:, 0]
record = jfsm.Record(t, force=g, displacement=x + 0.01 * x.std() * rng.standard_normal(t.size), at_rest=True)
model = jfsm.Structure.sdof(mass=1.0, stiffness=9.1, damping=0.28)
options = {"max_causes": 1, "key": jax.random.key(0), "progress": False}
d = jfsm.diagnose(record, model, causes=["cubic_hardening"], **options)
print(d)

# %% [markdown]
# ## Forced response and backbone

# %%
curves = {name: jfsm.forced_response(one, 2.0, frequencies=(1.5, 6.0)) for name, one in
          (("truth", truth), ("as believed", model), ("extended", d.extended))}  # fmt: skip
spine = jfsm.backbone(d.extended, np.linspace(0.02, 1.8, 15))
figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
for name, curve in curves.items():
    axes.plot(curve.frequency, curve.amplitude[:, 0], label=name, linewidth=3 if name == "truth" else 1)
axes.plot(spine.frequency, spine.amplitude, "k:", label="backbone")
axes.set(xlabel="frequency [rad/s]", ylabel="amplitude [m]")
_ = axes.legend()

# %% [markdown]
# The extended model jumps where the rig does; the model as believed does not jump at all.

# %%
jumps = {name: curve.frequency[curve.folds] for name, curve in curves.items()}
print(jumps)

# %% [markdown]
# ## A limit cycle
#
# A model with a plain dashpot against a rig that drives its small motions (van der Pol).

# %%
rig = jfsm.Structure.sdof(mass=1.0, stiffness=9.0) + jfsm.VanDerPol(0.6, 1.0, at=(0, 1))
free = np.asarray(jfsm.simulate(rig, jfsm.Record(t, force=g, at_rest=True)).displacement)[:, 0]
shaken = jfsm.Record(t, force=g, displacement=free + 0.005 * free.std() * rng.standard_normal(t.size), at_rest=True)
e = jfsm.diagnose(shaken, jfsm.Structure.sdof(1.0, 9.1, 0.2), causes=["van_der_pol"], **options)
print(e)

# %%
cycles = {name: jfsm.limit_cycles(one)[0] for name, one in (("truth", rig), ("extended", e.extended))}
figure, axes = plt.subplots(figsize=(3.6, 3.2), layout="constrained")
for name, cycle in cycles.items():
    axes.plot(cycle.orbit[:, 1], cycle.orbit[:, 2], "--" if name == "extended" else "-", label=name)
    print(f"{name}: period {cycle.period:.4f} s, amplitude {cycle.amplitude[0]:.3f} m, stable: {cycle.stable}")
axes.set(xlabel="displacement [m]", ylabel="velocity [m/s]")
_ = axes.legend()

# %%
assert d.findings[0].cause == "cubic_hardening" and e.findings[0].cause == "van_der_pol"
assert len(jumps["truth"]) == len(jumps["extended"]) == 2 and len(jumps["as believed"]) == 0
np.testing.assert_allclose(jumps["extended"], jumps["truth"], rtol=0.02)
assert abs(cycles["extended"].period / cycles["truth"].period - 1) < 0.01 and cycles["extended"].stable
