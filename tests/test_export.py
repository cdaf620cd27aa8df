"""A structure as text: what other programs compute from it is what jfsm computes."""

# A law's fields are made as its class is defined, which a type checker does not see.
# pyright: reportCallIssue=false, reportAttributeAccessIssue=false

import re
import shutil
import subprocess
import sys
import warnings
from functools import cache
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from test_terms import LAWS
from typer.testing import CliRunner

import jfsm
from jfsm.cli import app
from jfsm.diagnosis._finding import Finding
from jfsm.diagnosis.report.found_table import found_table
from jfsm.structures import AbstractFriction
from jfsm.structures.terms import TERMS

WRITTEN: list[Any] = [law for law in TERMS if law.kind != "delayed_force"]
SLOW = 1e-9  # m/s, where friction that sticks is smooth; the states below move much faster
MASS = np.array([[1.2, 0.3], [0.3, 0.9]])
OCTAVE = shutil.which("octave")


def structure_with(law):
    """Two coupled masses with springs, and the law where it may act."""
    at = (0, 2) if law.hangs else (1, 2)
    springs = [jfsm.LinearStiffness(30.0, at=(0, 1)), jfsm.LinearDamping(0.4, at=(1, 2))]
    return jfsm.Structure(MASS, [*springs, law(*LAWS[law.kind][0], at=at)])


def written(structure, what="to_python", **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return getattr(structure, what)(**options)


def run(text):
    names = {}
    exec(compile(text, "exported.py", "exec"), names)  # as a user's import would
    return names


@cache
def python_of(law: Any):
    return run(written(structure_with(law), stick_speed=SLOW))


def random_states(law, count=20):
    rng = np.random.default_rng(3)
    for _ in range(count):
        yield rng.uniform(0, 2), *rng.uniform(-1.5, 1.5, (3, 2)), rng.uniform(-0.4, 0.4, law.states)


def own_answer(structure, t, q, v, force, z):
    """Acceleration, and rates of the hidden states, from the laws themselves."""
    total, rates = np.zeros(2), np.zeros(0)
    for term in structure.terms:
        i, j = term.at
        d, w = (y[j - 1] - (y[i - 1] if i else 0.0) for y in (q, v))
        asked = (jnp.asarray(d), jnp.asarray(w), jnp.asarray(z), jnp.asarray(t))
        f = float(term.force(*asked))
        total[j - 1] += f
        if i:
            total[i - 1] -= f
        if term.states:
            rates = np.asarray(term.state_rate(*asked))
    return np.linalg.solve(MASS, force - total), rates


@pytest.mark.parametrize("law", WRITTEN, ids=lambda law: law.kind)
def test_the_python_of_every_law_accelerates_as_the_law_does(law):
    structure = structure_with(law)
    python = python_of(law)
    for t, q, v, force, z in random_states(law):
        found = python["acceleration"](t, q, v, force, z)
        rates = python["forces"](t, q, v, z)[1]
        acceleration, own_rates = own_answer(structure, t, q, v, force, z)
        np.testing.assert_allclose(found, acceleration, rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(rates, own_rates, rtol=1e-10, atol=1e-10)
        i, j = structure.terms[-1].at
        d, w = (y[j - 1] - (y[i - 1] if i else 0.0) for y in (q, v))
        relaxed = structure.terms[-1].initial_state(jnp.asarray(d), jnp.asarray(w))
        np.testing.assert_allclose(python["relaxed"](q, v), relaxed, atol=1e-15)


def of_matlab(text):
    """A function of Python for the rate of y, from the assignments of a MATLAB file: what is read is not what wrote."""
    body, numbers = text.partition("rate = zeros")[2].partition("\n")[2].split("function p = numbers()")
    python = ["def rate_of(t, y, force, np, rows, hidden):", " class p: pass"]
    for line in numbers.split("\nend")[0].splitlines()[2:]:
        python.append(f" {line.split(';')[0].strip()}")
    python += [" q, v, z = y[:2], y[2:4], y[4:]", " total, rate = np.zeros(2), np.zeros(hidden)"]
    for line in body.split("drive = force(t)")[0].splitlines():
        if line and not line.startswith("%"):
            line = re.sub(r"\b(q|v|z|total|rate)\((\d+)\)", lambda m: f"{m[1]}[{int(m[2]) - 1}]", line.rstrip(";"))
            line = line.replace("^", "**").replace("~=", "!=").replace("where(", "np.where(")
            line = re.sub(r"(?<![.\w])(abs|sign|exp|sin|cos|tanh)\(", r"np.\1(", line)
            python.append(" " + re.sub(r"(?<![.\w])(max|min)\(", r"np.\1imum(", line))
    return run("\n".join([*python, " return total, rate"]))["rate_of"]


@pytest.mark.parametrize("law", WRITTEN, ids=lambda law: law.kind)
def test_the_matlab_of_every_law_says_the_same_as_its_python(law):
    structure = structure_with(law)
    python = python_of(law)
    matlab = of_matlab(written(structure, "to_matlab", stick_speed=SLOW))
    for t, q, v, force, z in random_states(law, 5):
        found = matlab(t, np.concatenate([q, v, z]), force, np, 4 + law.states, law.states)
        for mine, its in zip(python["forces"](t, q, v, z), found, strict=True):
            np.testing.assert_allclose(its, mine, rtol=1e-12, atol=1e-13)


@pytest.mark.slow
@pytest.mark.skipif(OCTAVE is None, reason="Octave is not installed")
def test_octave_runs_the_matlab_of_every_law_as_python_runs_its_own(tmp_path):
    script, expected = [], []
    for law in WRITTEN:
        structure = structure_with(law)
        written(structure, "to_matlab", path=tmp_path / f"of_{law.kind}.m", stick_speed=SLOW)
        python = python_of(law)
        for t, q, v, force, z in random_states(law, 4):
            y = np.concatenate([q, v, z])
            text, push = ("; ".join(f"{each:.17g}" for each in part) for part in (y, force))
            script.append(f"printf('%.17g ', of_{law.kind}({t:.17g}, [{text}], @(t) [{push}])); printf('\\n');")
            expected.append(python["rates"](t, y, force))
            here = "; ".join(f"{each:.17g}" for each in q)
            script.append(f"printf('%.17g ', of_{law.kind}([{here}], [1; 2])); printf('\\n');")
            expected.append(np.concatenate([q, [1, 2], python["relaxed"](q, np.array([1.0, 2.0]))]))
    (tmp_path / "all.m").write_text("\n".join(script))
    assert OCTAVE is not None
    ended = subprocess.run(
        [OCTAVE, "--no-gui", "--quiet", "--no-init-file", "all.m"], cwd=tmp_path, capture_output=True
    )
    assert ended.returncode == 0, ended.stderr.decode()
    lines = ended.stdout.decode().splitlines()
    assert len(lines) == len(expected)
    for line, wanted in zip(lines, expected, strict=True):
        np.testing.assert_allclose(np.array(line.split(), float), wanted, rtol=1e-12, atol=1e-12)


def drive(n=600, dt=0.01):
    t = dt * np.arange(n)
    return t, sum(a * np.sin(o * t + p) for a, o, p in ((5.0, 5.0, 0.0), (3.5, 8.3, 1.0), (2.5, 2.1, 2.0)))


def difference(law, stick_speed=None):
    """Largest difference of the exported run from jfsm's, as a share of the motion's rms, of a mass on a spring."""
    t, force = drive()
    structure = jfsm.Structure.sdof(1.0, 40.0, 0.5) + law(*LAWS[law.kind][0], at=(0, 1))
    found = run(written(structure, stick_speed=stick_speed))["simulate"](t, force, [0.05], [0.1])
    own = jfsm.simulate(structure, jfsm.Record(t, force=force), initial_state=(0.05, 0.1))
    each = ((a, np.asarray(b)) for a, b in zip(found, (own.displacement, own.velocity), strict=False))
    return max(np.max(np.abs(a - b)) / np.sqrt(np.mean(b**2)) for a, b in each)


@pytest.mark.slow
@pytest.mark.parametrize("law", WRITTEN, ids=lambda law: law.kind)
def test_the_python_of_every_law_runs_as_simulate_does(law):
    assert difference(law) < (2e-3 if issubclass(law, AbstractFriction) else 5e-5)


def test_the_python_of_a_decay_runs_as_the_formula_says():
    t = np.linspace(0.0, 3.0, 61)
    text = jfsm.Structure.sdof(2.0, 80.0, 1.0).to_python()
    x, v, a = run(text)["simulate"](t, np.zeros(61), displacement=0.1, velocity=-0.3)
    pole = -0.25 + 1j * np.sqrt(40 - 0.25**2)
    expected = 0.1 * np.exp(-0.25 * t) * np.cos(pole.imag * t)
    expected += (-0.3 + 0.25 * 0.1) / pole.imag * np.exp(-0.25 * t) * np.sin(pole.imag * t)
    np.testing.assert_allclose(x[:, 0], expected, atol=1e-6)
    np.testing.assert_allclose(a, -(80 * x + v) / 2, atol=1e-12)
    np.testing.assert_allclose(np.gradient(x[:, 0], t, edge_order=2)[1:-1], v[1:-1, 0], atol=0.015)


def sdof(*more, mass=1.0):
    return jfsm.Structure([mass], [jfsm.LinearStiffness(40.0, at=(0, 1)), *more])


class Tanh(jfsm.AbstractTerm):
    """A spring that saturates smoothly, force F·tanh(d/s)."""

    parameters = (jfsm.Parameter("F", unit="N", meaning="largest force"), jfsm.Parameter("s", unit="m"))

    def force(self, d, w, z, t):
        return self.F * jnp.tanh(d / self.s)


class Interpolated(jfsm.AbstractTerm):
    """A spring read from a table."""

    parameters = (jfsm.Parameter("F", unit="N"),)

    def force(self, d, w, z, t):
        return self.F * jnp.interp(d, jnp.asarray([-1.0, 0.0, 1.0]), jnp.asarray([-1.0, 0.0, 2.0]))


def test_the_file_holds_every_number_by_name_with_its_unit_and_meaning_and_the_formula():
    model = sdof(jfsm.Coulomb(2.5, at=(0, 1)), jfsm.Coulomb(0.5, at=(0, 1)), Tanh(3.0, 0.1, at=(0, 1)))
    python, matlab = written(model), written(model, "to_matlab")
    assert "coulomb_0_1_F = 2.5  # N, friction force" in python
    assert "coulomb_0_1_F_2 = 0.5  # N, friction force" in python
    assert "tanh_0_1_s = 0.1  # m\n" in python
    assert "# tanh@0-1: A spring that saturates smoothly, force F·tanh(d/s)." in python
    assert "p.coulomb_0_1_F = 2.5;  % N, friction force" in matlab
    assert max(len(line) for line in (*python.splitlines(), *matlab.splitlines())) <= 140
    assert run(python)["forces"](0.0, np.array([0.05]), np.array([1.0]), ())[0] == pytest.approx(
        40 * 0.05 + 3.0 + 3.0 * np.tanh(0.5), rel=1e-12
    )


def test_it_is_written_where_it_is_to_be(tmp_path):
    model = sdof(jfsm.CubicStiffness(3.0, at=(0, 1)))
    text = model.to_python(tmp_path / "model.py")
    assert (tmp_path / "model.py").read_text(encoding="utf-8") == text
    model.to_matlab(tmp_path / "model.m")
    assert (tmp_path / "model.m").read_text(encoding="utf-8").startswith("function dy = model(t, y, force, p)\n")
    assert model.to_matlab().startswith("function dy = equation_of_motion(")


def test_a_warning_points_at_the_line_that_asked():
    program = (
        "import jax, warnings; jax.config.update('jax_enable_x64', True)\n"
        "import jfsm\n"
        "model = jfsm.Structure.sdof(1.0, 40.0) + jfsm.Coulomb(1.0, at=(0, 1))\n"
        "with warnings.catch_warnings(record=True) as caught:\n"
        "    model.to_matlab()\n"
        "print(caught[0].filename, caught[0].lineno)"
    )
    shown = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    assert shown.split() == ["<string>", "5"]


def test_friction_that_sticks_and_sensors_are_warned_of_and_said_in_the_file():
    model = sdof(jfsm.Coulomb(2.0, at=(0, 1))) + jfsm.ForceGain(0.1, at=("force", 1))
    with pytest.warns(UserWarning) as caught:
        text = model.to_python()
    words = " ".join(str(each.message) for each in caught)
    assert "friction that sticks (coulomb@0-1) is smooth here" in words and "stick_speed = 0.000316 m/s" in words
    assert "what the sensors make of them is left out (force_gain@force-1)" in words
    assert "Note: friction that sticks (coulomb@0-1)" in text and "(force_gain@force-1)" in text


MAP = jfsm.Polynomial.fit(np.random.default_rng(0).normal(size=(50, 2)), np.arange(50.0), order=1)
REFUSED = [
    (sdof(MAP.on(at=(0, 1))), {}, r"map@0-1 is learned from readings and has no formula .* Structure.to_table gives"),
    (sdof(jfsm.DelayedForce(1.0, 0.1, at=(0, 1))), {}, r"delayed_force@0-1 answers the motion of the past, which"),
    (sdof(Interpolated(1.0, at=(0, 1))), {}, r"interpolated@0-1 computes \w+, which cannot be written as text\. Write"),
    (sdof(mass=0.0), {}, r"`mass` must be positive for an equation of motion; it is \[0\.0\]"),
    (jfsm.Simulation(lambda q, v, force, t, p: force - q, dof=1), {}, r"The plant moves by a function of yours, which"),
    (jfsm.Structure([1.0], [jfsm.Coulomb(1.0, at=(0, 1))]), {}, r"`stick_speed` must be given: coulomb@0-1 sticks"),
    (sdof(jfsm.Coulomb(1.0, at=(0, 1))), {"stick_speed": 0.0}, r"`stick_speed` must be a positive speed in m/s; got 0"),
]  # fmt: skip


@pytest.mark.parametrize(("model", "options", "message"), REFUSED)
@pytest.mark.parametrize("what", ["to_python", "to_matlab"])
def test_what_cannot_be_written_is_refused_by_name_with_what_to_do(model, options, message, what):
    with pytest.raises(ValueError, match=message):
        getattr(model, what)(**options)


@pytest.mark.parametrize("name", ["2nd.m", "my-model.m", "model.txt"])
def test_a_name_that_matlab_cannot_call_is_refused(name, tmp_path):
    with pytest.raises(ValueError, match=r"`path` must be a name that MATLAB can call, such as model\.m: .* got '"):
        sdof().to_matlab(tmp_path / name)
    assert not any(tmp_path.iterdir())


def test_a_table_holds_the_force_of_a_link_over_displacement_and_velocity(tmp_path):
    model = jfsm.Structure.chain([1.0, 1.0], [40.0, 7.0]) + jfsm.CubicStiffness(3.0, at=(1, 2))
    model = model + jfsm.QuadraticDamping(2.0, at=(2, 1)) + jfsm.Preload(0.5, at=(2, 1))
    d, w = np.array([-0.2, 0.0, 0.3]), np.array([-1.0, 2.0])
    table = model.to_table(d, w, at=(1, 2), path=tmp_path / "force.csv")
    assert table.terms == (
        "stiffness@1-2",
        "damping@1-2",
        "cubic_stiffness@1-2",
        "quadratic_damping@2-1",
        "preload@2-1",
    )
    expected = 7 * d[:, None] + 3 * d[:, None] ** 3 + 2 * w * np.abs(w) + 0.5  # a load at (2, 1) pulls at 2
    np.testing.assert_allclose(table.force, expected, rtol=1e-12)
    frame = table.to_dataframe()
    assert frame.loc[0.3, 2.0] == pytest.approx(expected[2, 1]) and frame.columns.name == "velocity"
    assert (tmp_path / "force.csv").read_text().startswith("displacement,velocity,force\n")
    rows = np.loadtxt(tmp_path / "force.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(
        rows, [[x, v, f] for i, x in enumerate(d) for v, f in zip(w, table.force[i], strict=True)]
    )
    assert repr(table).startswith("<ForceTable of stiffness@1-2, ") and "3 displacements, 2 velocities" in repr(table)


def test_the_table_of_a_map_is_what_the_map_says():
    states = np.random.default_rng(0).normal(size=(50, 2))
    force_map = jfsm.Polynomial.fit(states, states @ [3.0, 0.5], order=1)
    table = jfsm.Structure([1.0], [force_map.on(at=(0, 1))]).to_table([0.1, 0.2], [1.0])
    np.testing.assert_allclose(table.force[:, 0], [0.8, 1.1], rtol=1e-9)


@pytest.mark.parametrize(
    ("model", "at", "message"),
    [
        (sdof(jfsm.Maxwell(1.0, 0.1, at=(0, 1))), None, "maxwell@0-1 has a memory: its force is no table over"),
        (sdof(jfsm.DelayedForce(1.0, 0.1, at=(0, 1))), None, "delayed_force@0-1 answers the motion of the past"),
        (sdof(jfsm.StiffnessDrift(1.0, 0.1, at=(0, 1))), None, "stiffness_drift@0-1 changes with time"),
        (
            jfsm.Structure.chain([1, 1], [1, 1]),
            None,
            r"`at` must say which link .*; there are terms at \(0, 1\), \(1, 2",
        ),
        (sdof(), (0, 2), r"`at` must be a link that has a term; got \(0, 2\), there are terms at \[\(0, 1\)\]"),
    ],
)
def test_what_is_no_table_is_refused_by_name(model, at, message):
    with pytest.raises(ValueError, match=message):
        model.to_table([0.0, 1.0], at=at)


def test_the_table_of_a_diagnosis_is_of_what_was_found_over_the_motion_that_was_measured():
    extended = jfsm.Structure.sdof(1.0, 40.0, 0.5) + jfsm.CubicStiffness(3.0, at=(0, 1))
    finding = Finding("cubic_hardening", "stiffness", (0, 1), 0.99, {})
    curves = {"residual": {"displacement": [0.1, -0.2], "velocity": [1.0, 3.0]}}
    table = found_table(extended, [finding], lambda: curves, None, [0.0], None)
    assert table.terms == ("cubic_stiffness@0-1",)
    np.testing.assert_allclose(table.displacement[[0, -1]], [-0.2, 0.1])
    np.testing.assert_allclose(table.force[:, 0], 3 * table.displacement**3, rtol=1e-12)
    assert found_table(extended, [finding], lambda: curves, [0.0], None, None).velocity[-1] == 3.0
    with pytest.raises(ValueError, match="There is no table: the diagnosis names no law that the model lacks"):
        found_table(extended, [], lambda: curves, None, None, None)
    with pytest.raises(ValueError, match="which JSON has no place for. Take the table of the diagnosis itself"):
        found_table(None, [finding], lambda: curves, None, None, None)


def invoke(*arguments):
    return CliRunner().invoke(app, ["export", *map(str, arguments)])


def test_the_command_writes_what_the_ending_says(tmp_path):
    model = tmp_path / "model.toml"
    sdof(jfsm.Coulomb(2.0, at=(0, 1))).save(model)
    done = invoke(model, "--out", tmp_path / "a.py", "--stick-speed", "1e-4")
    assert done.exit_code == 0 and f"The model is in {tmp_path / 'a.py'}." in done.stdout
    assert "friction that sticks (coulomb@0-1) is smooth here" in done.stderr
    assert "stick_speed = 0.0001" in (tmp_path / "a.py").read_text(encoding="utf-8")
    assert invoke(model, "--out", tmp_path / "a.m").exit_code == 0
    assert (tmp_path / "a.m").read_text(encoding="utf-8").startswith("function dy = a(t, y, force, p)")
    done = invoke(model, "--out", tmp_path / "a.csv", "--displacement=-0.1:0.1:3", "--velocity=-1:1:2")
    assert done.exit_code == 0
    force = np.loadtxt(tmp_path / "a.csv", delimiter=",", skiprows=1)[:, 2]
    np.testing.assert_allclose(force, [-6, -2, -2, 2, 2, 6], atol=1e-12)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--out", "a.txt"], "--out must end in .py, .m or .csv; it was a.txt."),
        (["--out", "a.csv"], "--displacement must be given for a table, as --displacement=-0.01:0.01:41."),
        (["--out", "a.csv", "--displacement=1:2"], "--displacement must be LOW:HIGH:COUNT, as -0.01:0.01:41; it was"),
        (["--out", "a.csv", "--displacement=0:1:999999999999"], "--displacement must have 1 to 10000 points; it was"),
        (["--out", "a.csv", "--displacement=0:1:3", "--at", "0-2"], "--at must be a link that has a term; got (0, 2)"),
        (["--out", "a.csv", "--displacement=0:nan:3"], "--displacement must be finite; 3 of 3 values are NaN"),
        (["--out", "a-b.m"], "--out must be a name that MATLAB can call, such as model.m"),
    ],
)
def test_the_command_refuses_in_its_own_words(tmp_path, monkeypatch, options, message):
    monkeypatch.chdir(tmp_path)
    sdof().save("model.toml")
    done = invoke("model.toml", *options)
    assert done.exit_code == 2 and message in " ".join(done.stderr.split())
    assert [path.name for path in tmp_path.iterdir()] == ["model.toml"]
