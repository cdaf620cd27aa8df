# %% [markdown]
# # A law of your own
#
# A plate hangs on a spring before an electromagnet. The magnet pulls the harder the closer the plate comes, and no law
# of the catalogue says so. Twelve lines do; then the law competes with those of the catalogue.

# %%
from pathlib import Path
from tempfile import mkdtemp

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import jfsm

jax.config.update("jax_enable_x64", True)

# %% [markdown]
# ## The law
#
# `d` is the displacement towards the magnet [m]. The force of a term is positive where it resists a positive `d`; a
# magnet helps, so its sign is negative. What it pulls at rest is held by the spring.


# %%
class Magnet(jfsm.AbstractTerm):
    """An electromagnet before a plate: the pull grows with the inverse square of the gap."""

    family, label, sign = "stiffness", "the pull of a magnet", 1
    parameters = (
        jfsm.Parameter("F", unit="N", meaning="pull where the plate rests", low=0.0),
        jfsm.Parameter("gap", unit="m", meaning="gap where the plate rests", low=0.004),
    )

    def force(self, d, w, z, t):
        closed = jnp.minimum(d / self.gap, 0.8)  # the plate strikes before the gap is closed
        return -self.F * (1.0 / (1.0 - closed) ** 2 - 1.0)

    @classmethod
    def shapes(cls, scale):
        return [{"F": 0.3 * scale.force, "gap": gap * scale.peak} for gap in (2.0, 4.0)]


# %% [markdown]
# ## The record
#
# Half a kilogram on 800 N/m, driven by a shaker. Force and displacement are measured; 0.5 % noise.

# %%
t, rng = np.arange(1500) * 0.005, np.random.default_rng(5)
lines, phases = 2 * np.pi * np.linspace(1.0, 12.0, 25), rng.uniform(0, 2 * np.pi, 25)
force = 0.05 * np.cos(np.outer(t, lines) + phases).sum(axis=1)
model = jfsm.Structure.sdof(mass=0.5, stiffness=800.0, damping=1.5)
rig = model + Magnet(0.6, 0.006, at=(0, 1))
x = np.asarray(jfsm.simulate(rig, jfsm.Record(t, force=force, at_rest=True)).displacement)[:, 0]
record = jfsm.Record(t, force=force, displacement=x + 0.005 * x.std() * rng.standard_normal(t.size), at_rest=True)
print(f"the plate moves {x.min() * 1e3:.2f} to {x.max() * 1e3:.2f} mm")

# %% [markdown]
# ## Among laws of the catalogue
#
# The class is a cause like any other. Three laws of the catalogue bend a spring as a magnet does, more or less.

# %%
catalogue = ["quadratic_stiffness", "cubic_softening", "bilinear_stiffness"]
d = jfsm.diagnose(record, model, causes=[*catalogue, Magnet], max_causes=1, key=jax.random.key(0), progress=False)
d.print()

# %% [markdown]
# Without the law, the catalogue alone is asked. It says how far its own laws come.

# %%
without = jfsm.diagnose(record, model, causes=catalogue, max_causes=1, key=jax.random.key(0), progress=False)
print(without)

# %% [markdown]
# ## The curve of the force
#
# What was found, beside what the rig has.

# %%
found = d.extended.terms[-1]
reach = np.linspace(x.min(), x.max(), 200)
figure, axes = plt.subplots(figsize=(6, 2.5), layout="constrained")
for name, law, style in (("rig", rig.terms[-1], "k"), ("found", found, "--")):
    axes.plot(1e3 * reach, [law.force(jnp.asarray(at), 0.0, jnp.zeros(0), 0.0) for at in reach], style, label=name)
axes.set(xlabel="displacement [mm]", ylabel="force [N]")
_ = axes.legend()

# %% [markdown]
# ## Keep it
#
# A model file holds the numbers of the law, and its name.

# %%
path = Path(mkdtemp()) / "extended.toml"
d.extended.save(path)
print(jfsm.Structure.load(path))

# %%
size = d.findings[0].parameters
assert d.findings[0].cause == "magnet" and abs(size["F"].value - 0.6) < 0.1 and abs(size["gap"].value - 0.006) < 4e-4
