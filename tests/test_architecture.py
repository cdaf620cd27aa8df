"""The rooms of the house: who may import whom, and what importing it must not do."""

import ast
import graphlib
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "jfsm"

# In the order of the house: a room imports only rooms to its left.
ROOMS = (
    "_types",
    "_result",
    "_format",
    "_limit",
    "_threads",
    "_processes",
    "_files",
    "_terminal",
    "_programs",
    "_traced",
    "_map_reader",
    "reporting",
    "records",
    "structures",
    "surrogates",
    "plant",
    "dynamics",
    "estimation",
    "identification",
    "mapping",
    "diagnosis",
    "fleet",
    "adapters",
    "systems",
    "demo",
    "paper",
    "cli",
)

# Rooms whose public face is all that other rooms may use.
CLOSED = ("plant", "dynamics")

# Rooms whose files and functions stay small.
SMALL_ROOMS = ("diagnosis", "fleet", "mapping")
MOST_LINES, MOST_COMPLEXITY = 350, 10
BRANCHES = (ast.If, ast.IfExp, ast.For, ast.While, ast.ExceptHandler, ast.Assert, ast.comprehension, ast.match_case)

# Where a class still opens, from inside a method, the file format that is made for it.
CIRCLES = ("structures", "surrogates")


def module_files(package: Path) -> dict[str, Path]:
    """Every module of a package by its dotted name; a folder is named for its ``__init__``."""
    files = {}
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package.parent).with_suffix("").parts
        files[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return files


def runs_later(node: ast.AST) -> bool:
    """Whether loading a module passes this part over: function bodies, and imports for type checkers alone."""
    for_types_only = isinstance(node, ast.If) and ast.unparse(node.test) in ("TYPE_CHECKING", "typing.TYPE_CHECKING")
    return for_types_only or isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)


def imported_modules(name: str, path: Path, known: set[str], *, at_load: bool) -> Iterator[tuple[str, int]]:
    """Modules among `known` that a module imports (`at_load`: as it is loaded), each with its line."""
    package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    pending: list[ast.AST] = [ast.parse(path.read_text(encoding="utf-8"), filename=str(path))]
    while pending:
        node = pending.pop()
        if at_load and runs_later(node):
            continue
        pending.extend(ast.iter_child_nodes(node))
        if isinstance(node, ast.Call) and ast.unparse(node.func).split(".")[-1] in ("import_module", "__import__"):
            names = [part.value for part in node.args if isinstance(part, ast.Constant)]
            yield from ((name, node.lineno) for name in names if name in known)
        elif isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) + 1 - node.level] if node.level else []
            source = ".".join([*base, *(node.module.split(".") if node.module else [])])
            for alias in node.names:
                member = f"{source}.{alias.name}"
                if member in known:
                    yield member, node.lineno
                elif source in known:
                    yield source, node.lineno


def room_violations(package: Path) -> list[str]:
    """Every import that goes against the order of the rooms, as one line each."""
    files = module_files(package)
    found = []
    for name, path in files.items():
        parts = name.split(".")
        if len(parts) == 1 or parts[1] == "__main__":  # the front door and `python -m` may import everything
            continue
        where = path.relative_to(package.parent)
        if parts[1] not in ROOMS:
            found.append(f"{where} belongs to no room; add `{parts[1]}` to the order of the house")
            continue
        for target, line in imported_modules(name, path, set(files), at_load=False):
            room = target.split(".")[1] if "." in target else None
            if room is None:
                found.append(f"{where}:{line} imports the front door; import from the room that owns the name")
            elif room != parts[1] and (room not in ROOMS or ROOMS.index(room) >= ROOMS.index(parts[1])):
                found.append(f"{where}:{line} imports {target}, which is not above `{parts[1]}`")
    return found


def private_imports(package: Path) -> list[str]:
    """Every import of a private module of a closed room by another room, as one line each."""
    files = module_files(package)
    found = []
    for name, path in files.items():
        own = name.split(".")[1:2]
        for target, line in imported_modules(name, path, set(files), at_load=False):
            room, inside = target.split(".")[1:2], target.split(".")[2:]
            if set(room) & set(CLOSED) and room != own and any(part.startswith("_") for part in inside):
                where = path.relative_to(package.parent)
                found.append(f"{where}:{line} imports {target}; let `{room[0]}` export the name, and import that")
    return found


def import_cycle(package: Path, room: str = "", *, at_load: bool = True) -> list[str] | None:
    """Modules, of one room if named, that import each other (`at_load`: as they are loaded), or None."""
    files = module_files(package)
    inside = [name for name in files if not room or name.split(".")[1:2] == [room]]
    graph = {
        name: {target for target, _ in imported_modules(name, files[name], set(files), at_load=at_load)} - {name}
        for name in inside
    }
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        return error.args[1]
    return None


def complexity(function: ast.AST) -> int:
    """Cyclomatic complexity of a function with those inside it.

    References
    ----------
    T. J. McCabe, IEEE Trans. Software Eng. SE-2 (1976) 308.
    """
    nodes = list(ast.walk(function))
    operators = sum(len(node.values) - 1 for node in nodes if isinstance(node, ast.BoolOp))
    filters = sum(len(node.ifs) for node in nodes if isinstance(node, ast.comprehension))
    return 1 + sum(isinstance(node, BRANCHES) for node in nodes) + operators + filters


def too_large(path: Path) -> Iterator[str]:
    """A file with more lines, and its functions with more branches, than one reads at once."""
    text = path.read_text(encoding="utf-8")
    if (lines := len(text.splitlines())) > MOST_LINES:
        yield f"{path}: {lines} lines"
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and (found := complexity(node)) > MOST_COMPLEXITY:
            yield f"{path}:{node.lineno} {node.name} has a complexity of {found}"


def build_package(root: Path, files: dict[str, str]) -> Path:
    package = root / "jfsm"
    for name, text in files.items():
        path = package / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return package


def run_program(program: str) -> tuple[str, str]:
    """Output and errors of a program that a fresh interpreter runs to its end."""
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=PACKAGE.parent)
    assert run.returncode == 0, run.stderr
    return run.stdout, run.stderr


def test_a_room_imports_only_rooms_listed_above_it():
    assert not room_violations(PACKAGE), "\n".join(room_violations(PACKAGE))


def test_no_room_imports_a_private_module_of_a_closed_room():
    assert not private_imports(PACKAGE), "\n".join(private_imports(PACKAGE))


def test_no_modules_import_each_other_in_a_circle():
    assert import_cycle(PACKAGE) is None


@pytest.mark.parametrize("room", [room for room in ROOMS if room not in CIRCLES])
def test_no_modules_of_a_room_import_each_other_in_a_circle_at_any_time(room):
    assert import_cycle(PACKAGE, room, at_load=False) is None


@pytest.mark.parametrize(
    "statement",
    [
        "from ..diagnosis import diagnose",
        "from .. import diagnosis",
        "import jfsm.diagnosis",
        "from jfsm.diagnosis import diagnose",
        "from jfsm import diagnosis",
        "def late():\n    from ..diagnosis import diagnose",
        "from jfsm import diagnose",
        "import importlib\nimportlib.import_module('jfsm.diagnosis')",
        "def late():\n    return import_module('jfsm.diagnosis').diagnose",
    ],
)
def test_an_import_from_a_lower_room_is_seen_however_it_is_written(tmp_path, statement):
    package = build_package(
        tmp_path,
        {
            "__init__.py": "from .diagnosis import diagnose as diagnose",
            "records/__init__.py": "",
            "records/_record.py": statement,
            "diagnosis/__init__.py": "def diagnose(): ...",
        },
    )
    (violation,) = room_violations(package)
    assert violation.startswith("jfsm/records/_record.py:")


@pytest.mark.parametrize(
    "statement",
    [
        "from ..plant._stepper import advance",
        "from ..plant import _stepper",
        "import jfsm.plant._stepper",
        "from jfsm.plant._stepper import advance",
        "def late():\n    from ..plant._stepper import advance",
    ],
)
def test_an_import_of_a_private_module_is_seen_however_it_is_written(tmp_path, statement):
    package = build_package(
        tmp_path,
        {
            "__init__.py": "",
            "plant/__init__.py": "from ._stepper import advance as advance",
            "plant/_stepper.py": "def advance(): ...",
            "plant/_grid.py": "from ._stepper import advance",
            "estimation/__init__.py": "",
            "estimation/_filter.py": statement,
            "estimation/_motion.py": "from ..plant import advance",
        },
    )
    (violation,) = private_imports(package)
    assert violation.startswith("jfsm/estimation/_filter.py:")


def test_a_module_outside_every_room_is_seen(tmp_path):
    package = build_package(tmp_path, {"__init__.py": "", "_misc.py": ""})
    assert room_violations(package) == ["jfsm/_misc.py belongs to no room; add `_misc` to the order of the house"]


def test_a_circle_of_imports_is_seen(tmp_path):
    circle = {"records/__init__.py": "", "records/_a.py": "from ._b import b", "records/_b.py": "from . import _a"}
    assert set(import_cycle(build_package(tmp_path, {"__init__.py": "", **circle})) or ()) == {
        "jfsm.records._a",
        "jfsm.records._b",
    }


@pytest.mark.parametrize("later", ["if TYPE_CHECKING:\n    from ._b import b", "def late():\n    from ._b import b"])
def test_an_import_that_loading_passes_over_closes_no_circle(tmp_path, later):
    files = {"records/__init__.py": "", "records/_a.py": later, "records/_b.py": "from ._a import a"}
    assert import_cycle(build_package(tmp_path, {"__init__.py": "", **files})) is None


@pytest.mark.parametrize(
    "later",
    [
        "if TYPE_CHECKING:\n    from ._b import b",
        "def late():\n    from ._b import b",
        "class A:\n    def late(self):\n        from . import _b",
    ],
)
def test_an_import_that_loading_passes_over_closes_a_circle_at_any_time(tmp_path, later):
    files = {"records/__init__.py": "", "records/_a.py": later, "records/_b.py": "from ._a import a"}
    package = build_package(tmp_path, {"__init__.py": "", **files})
    assert set(import_cycle(package, "records", at_load=False) or ()) == {"jfsm.records._a", "jfsm.records._b"}
    assert import_cycle(package, "reporting", at_load=False) is None


@pytest.mark.parametrize("room", SMALL_ROOMS)
def test_files_are_short_and_functions_simple(room: str):
    paths = list((PACKAGE / room).rglob("*.py"))
    assert paths
    found = [line for path in paths for line in too_large(path)]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("return x", 1),
        ("if x and y or z: pass\n elif w: pass", 5),
        ("for i in x:\n  while i: pass\n else: pass", 3),
        ("return [i if i else 0 for i in x if i if y]", 5),
        ("try: pass\n except E: pass\n except F: pass\n assert x", 4),
        ("match x:\n  case 1: pass\n  case _: pass", 3),
        ("def g():\n  if x: pass\n return g", 2),
    ],
)
def test_complexity_counts_branches(body: str, expected: int):
    assert complexity(ast.parse(f"def f():\n {body}").body[0]) == expected


def test_a_file_that_is_too_long_and_a_function_that_is_too_complex_are_seen(tmp_path):
    path = tmp_path / "_large.py"
    path.write_text("def f(x):\n    return " + " or ".join("x" * 12) + "\n" * MOST_LINES, encoding="utf-8")
    assert [line.partition(str(path))[2] for line in too_large(path)] == [
        f": {MOST_LINES + 1} lines",
        ":1 f has a complexity of 12",
    ]


def test_importing_jfsm_changes_no_configuration_and_prints_nothing():
    program = (
        "import numpy as np, jax\n"
        "before, before_errors = dict(jax.config.values), np.geterr()\n"
        "import jfsm\n"
        "changed = [name for name, value in before.items() if jax.config.values[name] != value]\n"
        "assert not changed, f'jax configuration changed: {changed}'\n"
        "assert np.geterr() == before_errors, 'numpy error handling changed'\n"
        "assert not jax._src.xla_bridge._backends, 'a device was started'\n"
    )
    assert run_program(program) == ("", "")


def test_every_public_name_is_there_and_a_wrong_one_is_missed():
    program = (
        "import jfsm, sys\n"
        "assert 'jax' not in sys.modules, 'a name was imported before it was asked for'\n"
        "assert {'Record', 'diagnose', 'systems'} <= set(jfsm.__all__) <= set(dir(jfsm))\n"
        "assert all(getattr(jfsm, name) is getattr(jfsm, name) for name in jfsm.__all__)\n"
        "assert jfsm.dynamics.simulate is jfsm.simulate\n"
        "assert not hasattr(jfsm, 'Recrod')\n"
        "from jfsm import *\n"
        "assert diagnose is jfsm.diagnosis.diagnose\n"
    )
    run_program(program)
