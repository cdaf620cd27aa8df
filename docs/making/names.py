"""The reference of the public names: a page for each room, from the list in `jfsm/__init__.pyi`."""

import ast
import inspect
from pathlib import Path

import jfsm
from jfsm.structures import AbstractSensor, AbstractTerm

LIST = Path(jfsm.__file__).with_suffix(".pyi")

TITLES = {
    "diagnosis": ("Diagnosis", "From a record and a model to a verdict."),
    "records": ("Records", "What was measured: read, looked at, put together, written."),
    "structures": ("Models", "The simulation that you believe in."),
    "laws": ("Laws and sensor effects", "Every term of a structure and every effect of a sensor."),
    "dynamics": ("Dynamics", "What a model does: runs, rests, cycles, forced response and backbone."),
    "identification": ("Fit", "Values of a model from a record, with intervals."),
    "estimation": ("Motion and force", "Motion with error bars, the force of a link, a map together with the motion."),
    "mapping": ("Map of a force", "The map of a force over displacement and velocity, without a diagnosis."),
    "surrogates": ("Maps", "RKPM, kriging and their peers: a force from scattered readings, with derivatives."),
    "paper": ("The paper's study", "The study of the paper that jfsm grew from, repeated."),
    "systems": ("Reference systems", "The systems of the paper and of the field."),
}
"""Title and one sentence of each page; a room without an entry gets its own name."""


def public() -> dict[str, str]:
    """The room of every public name; a public room stands for itself."""
    lines = [line for line in ast.parse(LIST.read_text(encoding="utf-8")).body if isinstance(line, ast.ImportFrom)]
    return {name.asname or name.name: (line.module or name.name).split(".")[0] for line in lines for name in line.names}


def by_page() -> dict[str, list[str]]:
    """The public names of every page, in the order of `TITLES` and then of the list."""
    found: dict[str, list[str]] = {page: [] for page in TITLES}
    for name, room in public().items():
        found.setdefault(_page(name, room), []).append(name)
    return {page: names for page, names in found.items() if names}


def pages() -> dict[str, str]:
    """Every page of the reference by its address."""
    made = {"reference/index.md": _index()}
    return made | {f"reference/{page}.md": _page_of(page, names) for page, names in by_page().items()}


def _page(name: str, room: str) -> str:
    value = getattr(jfsm, name)
    if not inspect.isclass(value) or inspect.isabstract(value):
        return room
    return "laws" if issubclass(value, AbstractTerm | AbstractSensor) else room


def _title(page: str) -> tuple[str, str]:
    return TITLES.get(page, (page.replace("_", " ").capitalize(), ""))


def _index() -> str:
    rows = []
    for page, names in by_page().items():
        title, sentence = _title(page)
        links = ", ".join(f"[`{name}`]({page}.md#jfsm.{name})" for name in names)
        rows.append(f"## [{title}]({page}.md)\n\n{sentence}\n\n{links}\n")
    head = "# Python\n\nEvery public name. `import jfsm` loads none of them: each is loaded when it is first used.\n"
    return "\n".join([head, *rows])


def _page_of(page: str, names: list[str]) -> str:
    title, sentence = _title(page)
    return "\n".join([f"# {title}\n\n{sentence}\n", *(f"::: jfsm.{name}\n" for name in names)])
