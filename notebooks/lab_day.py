# %% [markdown]
# # A day in the lab: from a raw faulty file to a report
#
# A mass on a spring and a damper that also rubs was shaken. The recorder wrote a csv in its own way: decimal commas,
# two lines above the table, millimetres. The laser lost its target for some samples.

# %%
from pathlib import Path
from tempfile import mkdtemp

import jax
import numpy as np

import jfsm

jax.config.update("jax_enable_x64", True)
folder = Path(mkdtemp())

# %% [markdown]
# ## The raw file

# %%
t, rng = np.arange(800) / 100, np.random.default_rng(5)
lines, phases = 2 * np.pi * np.linspace(0.8, 5, 18), rng.uniform(0, 2 * np.pi, 18)
g = 1.2 * np.cos(np.outer(t, lines) + phases).sum(axis=1)
rig = jfsm.Structure.sdof(mass=1.5, stiffness=600.0, damping=1.5) + jfsm.Coulomb(1.0, at=(0, 1))
run = jfsm.simulate(rig, jfsm.Record(t, force=g, at_rest=True))
x = np.asarray(run.displacement)[:, 0]
x = 1e3 * (x + 0.005 * x.std() * rng.standard_normal(t.size))  # mm
torn = rng.choice(np.arange(50, 700), 6, replace=False)
x[torn] = 99.9  # the laser lost its target
rows = "".join(f"{a:.2f};{b:.4f};{c:.4f}\n" for a, b, c in zip(t, g, x, strict=True)).replace(".", ",")
(folder / "run7.csv").write_text("Recorder XY-3; operator: me\n\nTime [s];Force [N];Laser [mm]\n" + rows)
print((folder / "run7.csv").read_text()[:120])

# %% [markdown]
# ## Read
#
# Decimal commas, semicolons and the two lines above the table need no help.

# %%
record = jfsm.read(folder / "run7.csv", force="Force", displacement="Laser", at_rest=True)
print(record)
print(*record.notes, sep="\n")

# %% [markdown]
# ## Inspect

# %%
looked = record.inspect()
looked.print()
print([f"{f.severity}: {f.channel}: {f.message}" for f in looked.findings if f.severity == "warning"])

# %% [markdown]
# ## Diagnose
#
# Torn samples take no part, and a note says so.

# %%
model = jfsm.Structure.sdof(mass=1.5, stiffness=620.0, damping=2.0)
causes = ["coulomb", "quadratic_damping", "cubic_hardening"]
d = jfsm.diagnose(record, model, causes=causes, max_causes=1, key=jax.random.key(0), progress=False)
d.print()
print(*d.notes, sep="\n")

# %% [markdown]
# ## Report
#
# A page for the colleagues, every number for the archive, and the better model.

# %%
d.report(folder / "run7.html")
d.to_json(folder / "run7.json")
d.extended.save(folder / "better.toml")
print((folder / "better.toml").read_text())
again = jfsm.Diagnosis.load(folder / "run7.json")

# %%
friction = d.findings[0].parameters["F"]
assert d.findings[0].cause == "coulomb" and again.verdict == d.verdict == "cause"
assert abs(friction.value - 1.0) < 0.1
assert any("torn" in note or "left out" in note for note in d.notes)
