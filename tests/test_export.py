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

import jfsm
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
