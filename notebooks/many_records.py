# %% [markdown]
# # Many records, and what differs between them
#
# Four specimens of one mount were tested alike. Each record is diagnosed by itself, in a plain loop; a table shows what
# they share and in what they differ.

# %%
import jax
import matplotlib.pyplot as plt
import numpy as np

import jfsm

jax.config.update("jax_enable_x64", True)

# %% [markdown]
# ## The records
#
# All four rub. The third is softer, the fourth rubs twice as much.

# %%
t = np.arange(600) / 100
lines = 2 * np.pi * np.linspace(0.8, 6, 18)
specimens = {"A": (600.0, 0.6), "B": (603.0, 0.6), "C": (540.0, 0.6), "D": (600.0, 1.2)}  # N/m, N


def test(number, stiffness, friction):
    rng = np.random.default_rng(number)
    g = 1.4 * np.cos(np.outer(t, lines) + rng.uniform(0, 2 * np.pi, lines.size)).sum(axis=1)
    rig = jfsm.Structure.sdof(mass=1.5, stiffness=stiffness, damping=1.5) + jfsm.Coulomb(friction, at=(0, 1))
    x = np.asarray(jfsm.simulate(rig, jfsm.Record(t, force=g, at_rest=True)).displacement)[:, 0]
    return jfsm.Record(t, force=g, displacement=x + 0.005 * x.std() * rng.standard_normal(t.size), at_rest=True)


records = {name: test(i, *values) for i, (name, values) in enumerate(specimens.items())}

# %% [markdown]
# ## A loop
#
# The first diagnosis compiles, the others reuse its programs.

# %%
model = jfsm.Structure.sdof(mass=1.5, stiffness=620.0, damping=2.0)
options = {"causes": ["coulomb"], "max_causes": 1, "key": jax.random.key(0), "progress": False}
found = {name: jfsm.diagnose(record, model, **options) for name, record in records.items()}

# %%
print(f"{'':3} {'verdict':8} {'cause':9} {'p':>5} {'friction [N]':>22} {'stiffness [N/m]':>26}")
for name, d in found.items():
    cause, k = d.findings[0], d.refitted["stiffness@0-1.k"]
    F = cause.parameters["F"]
    print(
        f"{name:3} {d.verdict:8} {cause.cause:9} {cause.probability:5.2f} "
        f"{F.value:7.3f} [{F.low:.3f}, {F.high:.3f}] {k.value:9.1f} [{k.low:.1f}, {k.high:.1f}]"
    )

# %% [markdown]
# ## What differs
#
# An interval that lies apart from those of the others is a difference.

# %%
quantities = {
    "friction [N]": {name: d.findings[0].parameters["F"] for name, d in found.items()},
    "stiffness [N/m]": {name: d.refitted["stiffness@0-1.k"] for name, d in found.items()},
}
figure, axes = plt.subplots(1, 2, figsize=(7, 2.5), layout="constrained")
for ax, (label, values) in zip(axes, quantities.items(), strict=True):
    middle = [v.value for v in values.values()]
    spread = [[v.value - v.low for v in values.values()], [v.high - v.value for v in values.values()]]
    ax.errorbar(list(values), middle, spread, fmt="o", capsize=4)
    ax.set(ylabel=label, xlabel="specimen")

# %%
apart = {
    label: [name for name, v in values.items()
            if sum(v.low > w.high or v.high < w.low for w in values.values()) >= 3]
    for label, values in quantities.items()
}  # fmt: skip
print(apart)
assert all(d.findings[0].cause == "coulomb" for d in found.values())
assert "D" in apart["friction [N]"] and "C" in apart["stiffness [N/m]"]
assert "A" not in apart["friction [N]"]
