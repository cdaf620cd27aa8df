# %% [markdown]
# # A simulation of your own
#
# An arm turns about a horizontal axis. Its equation of motion is a function; friction in the joint is not in it. Then
# the same again for a code that nobody can open, of which only the output is known.

# %%
import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import jfsm

jax.config.update("jax_enable_x64", True)


# %%
def arm(q, v, force, t, p):
    """Angular acceleration [rad/s²] at angle q under the torque `force` [N m]."""
    return (force - p["viscous"] * v - 2.0 * 9.81 * 0.3 * jnp.sin(q)) / p["inertia"]


model = jfsm.Simulation(arm, dof=1, parameters={"inertia": 0.24, "viscous": 0.05})
print(model.values())
print("natural frequency", jfsm.linearise(model).frequencies / (2 * np.pi), "Hz")

# %% [markdown]
# ## The record
#
# Torque in N m and angle in rad, 0.5 % noise.

# %%
t, rng = np.arange(600) / 50, np.random.default_rng(3)
lines, phases = 2 * np.pi * np.linspace(0.15, 1.6, 15), rng.uniform(0, 2 * np.pi, 15)
torque = 0.4 * np.cos(np.outer(t, lines) + phases).sum(axis=1)
rig = model.with_values({"viscous": 0.07}) + jfsm.Coulomb(0.2, at=(0, 1))
angle = np.asarray(jfsm.simulate(rig, jfsm.Record(t, force=torque, at_rest=True)).displacement)[:, 0]
noisy = angle + 0.005 * angle.std() * rng.standard_normal(t.size)
record = jfsm.Record(t, force=torque, displacement=noisy, units={"force": "N m", "displacement": "rad"}, at_rest=True)

# %% [markdown]
# ## The function is known

# %%
d = jfsm.diagnose(
    record, model, causes=["coulomb", "quadratic_damping"], max_causes=1, key=jax.random.key(0), progress=False
)
d.print(units="deg")

# %%
figure, axes = plt.subplots(figsize=(7, 2.5), layout="constrained")
axes.plot(t, np.degrees(noisy), "k", linewidth=0.8, label="measured")
for name, one in (("as believed", model), ("extended", d.extended)):
    axes.plot(t, np.degrees(jfsm.simulate(one, record).displacement), linewidth=0.8, label=name)
axes.set(xlabel="time [s]", ylabel="angle [°]")
_ = axes.legend()

# %% [markdown]
# ## Only the output is known
#
# The output of an oscillator that hardens less than the rig does. jfsm finds a structure that follows the output and
# judges that structure.

# %%
x_drive = jfsm.Record(t, force=torque, at_rest=True)
believed = jfsm.Structure.sdof(mass=0.24, stiffness=6.0, damping=0.06)
measured = np.asarray(jfsm.simulate(believed + jfsm.CubicStiffness(3.0, at=(0, 1)), x_drive).displacement)
measured = measured + 0.005 * measured.std() * rng.standard_normal(measured.shape)
record_2 = jfsm.Record(t, force=torque, displacement=measured, at_rest=True)
output = jfsm.Record(t, displacement=np.asarray(jfsm.simulate(believed, x_drive).displacement))
d_2 = jfsm.diagnose(
    record_2, simulated=output, causes=["cubic_hardening"], max_causes=1, key=jax.random.key(0), progress=False
)
print(d_2)
print(*d_2.notes, sep="\n")

# %%
assert d.findings[0].cause == "coulomb" and abs(d.findings[0].parameters["F"].value - 0.2) < 0.02
assert d_2.findings[0].cause == "cubic_hardening" and abs(d_2.findings[0].parameters["k3"].value - 3.0) < 0.3
