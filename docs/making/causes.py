"""The pages on the causes: a gallery, and for each family every cause with its law, numbers, pictures and rivals."""

import inspect
import re
from collections.abc import Iterable

import numpy as np
from pictures import large, small
from shown import OMEGA, PEAK, Shown, show

import jfsm
from jfsm.diagnosis.hypotheses.law_classes import classes_of
from jfsm.structures import AbstractTerm, Cause

FAMILIES = {
    "parameters": ("Wrong values", "A number of the model's own is off. A refit mends it; no term is added."),
    "stiffness": ("Springs", "The force goes with the displacement, but not in proportion."),
    "damping": ("Friction and damping", "The force goes with the velocity, but not in proportion."),
    "memory": ("Memory", "The force depends on what was before: it has hidden states, or answers late."),
    "time": ("Changes with time", "The law itself changes while the record runs."),
    "input": ("Loads", "A force acts that nobody measured."),
    "drive": ("Drives", "What drives the structure does not do what it is told."),
    "sensor": ("Sensors", "The structure is as believed; a channel is not."),
}
"""Title and one sentence of each family."""

_MOST_CLASSES = 2
"""Classes that are shown of a cause, the narrowest first: the widest is its family."""

GALLERY = """# Causes

`jfsm.diagnose` looks for these. Each picture shows the force of the law, over displacement or (of damping) over
velocity, while its ends are moved to and fro farther and farther. Of a sensor's fault it shows the channel over time,
true (grey) and as it is read (red).
A picture leads to the formula, the numbers with their units, and what the cause is mistaken for. `jfsm causes` lists
them in the terminal.

To see one diagnosed, hide it in a record of your own making and diagnose that. Here Coulomb friction; a minute or two:

```python
import jax

jax.config.update("jax_enable_x64", True)
import numpy as np, jfsm

model = jfsm.Structure.sdof(mass=1.0, stiffness=160.0, damping=0.8)
hidden = jfsm.causes()["coulomb"].apply(model, at=(0, 1), F=0.1)
t, rng = np.arange(800) / 100, np.random.default_rng(0)
lines, phases = 2 * np.pi * np.linspace(0.5, 5, 20), rng.uniform(0, 6.28, 20)
drive = jfsm.Record(t, force=0.3 * np.cos(np.outer(t, lines) + phases).sum(axis=1), at_rest=True)
record = jfsm.simulate(hidden, drive).to_record()
x = np.asarray(record.displacement)
record = jfsm.Record(t, force=drive.force, displacement=x + 0.01 * x.std() * rng.standard_normal(x.shape), at_rest=True)
jfsm.diagnose(record, model, key=jax.random.key(0)).print()
```
"""


def pages() -> dict[str, str | bytes]:
    """Every page and picture by its address."""
    all_shown = {cause.id: show(cause) for cause in jfsm.causes().values() if not cause.is_value}
    classes = {name: classes_of(s.cause, s.part, PEAK, OMEGA * PEAK) for name, s in all_shown.items()}
    made: dict[str, str | bytes] = {"causes/index.md": _gallery()}
    for family in _families():
        parts = [_cause(cause, all_shown.get(cause.id), classes) for cause in _of(family)]
        title, sentence = FAMILIES.get(family, (family.capitalize(), ""))
        made[f"causes/{family}.md"] = "\n\n".join([f"# {title}", sentence, *parts]) + "\n"
    for name, s in all_shown.items():
        made |= {f"causes/{name}.png": large(s), f"causes/{name}-small.png": small(s)}
    return made


def _families() -> list[str]:
    return list(dict.fromkeys(cause.family for cause in jfsm.causes().values()))


def _of(family: str) -> list[Cause]:
    return [cause for cause in jfsm.causes().values() if cause.family == family]


def _gallery() -> str:
    parts = [GALLERY]
    for family in _families():
        title, _ = FAMILIES.get(family, (family.capitalize(), ""))
        drawn = [cause for cause in _of(family) if not cause.is_value]
        pictures = " ".join(
            f"[![{cause.label}]({cause.id}-small.png){{ width=190 title='{cause.id}' }}]({family}.md#{cause.id})"
            for cause in drawn
        )
        names = ", ".join(f"[{cause.id}]({family}.md#{cause.id})" for cause in _of(family))
        parts.append(f"## [{title}]({family}.md)\n\n{pictures}\n\n{names}\n")
    return "\n".join(parts)


def _cause(cause: Cause, s: Shown | None, classes: dict[str, tuple[str, ...]]) -> str:
    lines = [f"## {cause.id} {{ #{cause.id} }}", f"**{_capital(cause.label)}**: {cause.sentence}."]
    if (law := _law(cause)) and not cause.is_value:
        lines.append(law)
    lines.append(_numbers(cause))
    if s is not None:
        lines += [_caption(s), f"![{_capital(cause.label)}]({cause.id}.png)", *_rivals(cause, classes)]
    return "\n\n".join(line for line in lines if line)


def _law(cause: Cause) -> str:
    """The law in the words of its class, its references as a list."""
    text = inspect.getdoc(cause.effect) or ""
    law, _, sources = text.partition("References\n----------\n")
    law = re.sub(r"\[(\d+)\]_", r"[\1]", law.strip())
    if cause.sign and cause.effect.parameters[0].positive is False:
        law += f"\n\n`{cause.effect.parameters[0].name}` is {'positive' if cause.sign > 0 else 'negative'} here."
    found = re.findall(r"\.\. \[(\d+)\] (.*?)(?=\n\.\. |\Z)", sources, flags=re.DOTALL)
    return "\n\n".join([law, *(f"[{number}] {' '.join(source.split())}" for number, source in found)])


def _numbers(cause: Cause) -> str:
    rows = [f"| `{p.name}` | {_typeset(p.unit())} | {p.meaning} |" for p in cause.effect.parameters]
    return "\n".join(["| number | unit | meaning |", "|---|---|---|", *rows])


def _typeset(unit: str) -> str:
    unit = re.sub(r"\^(\d)", lambda power: "⁰¹²³⁴⁵⁶⁷⁸⁹"[int(power[1])], unit)
    return "–" if unit == "1" else unit


def _caption(s: Shown) -> str:
    values = s.part.values if isinstance(s.part, AbstractTerm) else (s.part.value,)
    numbers = ", ".join(
        f"{p.name} = {float(np.asarray(v)):.3g} {_typeset(p.unit()).replace('–', '')}".strip()
        for p, v in zip(s.part.parameters, values, strict=True)
    )
    if s.along is None:
        return f"Drawn with {numbers}: the channel over time, and its reading over the truth."
    what = "the force over displacement and velocity along one motion"
    surface = ", the force at every state" if s.memoryless else ""
    return f"Drawn with {numbers}: {what}{surface}, and a run of one mass on a spring without and with it."


def _rivals(cause: Cause, classes: dict[str, tuple[str, ...]]) -> Iterable[str]:
    """What one record may not tell from this cause, as far as the code declares it."""
    special = [_link(other) for law in cause.effect.__dict__.get("contains", ()) for other in _causes_of(law)]
    if special:
        yield f"For certain of its numbers it is {', '.join(special)}: where those do as well, the simpler is named."
    rows = []
    for name in classes.get(cause.id, ())[:_MOST_CLASSES]:
        others = [_link(jfsm.causes()[other]) for other, its in classes.items() if name in its and other != cause.id]
        if others:
            rows.append(f"| {name} | {', '.join(others)} |")
    if rows:
        yield (
            "Confused with: laws of one class look alike where the record is short, slow or small. The class is named "
            "then, and the law left open; [a further test](../how-to/tell-apart.md) tells them apart."
        )
        yield "\n".join(["| class, the narrowest first | others in it |", "|---|---|", *rows])


def _causes_of(law: type) -> list[Cause]:
    return [cause for cause in jfsm.causes().values() if cause.effect is law and not cause.is_value]


def _link(cause: Cause) -> str:
    return f"[{cause.id}]({cause.family}.md#{cause.id})"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
