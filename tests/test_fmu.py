"""FMUs as simulations: what goes in at what instant, what comes out, and what is refused."""

import re
from pathlib import Path

import fmus
import numpy as np
import pytest
from references import smooth_motion
from typer.testing import CliRunner

import jfsm
from jfsm.cli import app
from jfsm.structures import Runs

pytest.importorskip("fmpy")
pytest.importorskip("pythonfmu")

MASS, STIFFNESS, DAMPING = 2.0, 1800.0, 6.0  # 4.8 Hz
TIME = 0.01 * np.arange(400)
RNG = np.random.default_rng(8)
TONES = 2 * np.pi * RNG.uniform(0.5, 9.0, 15), RNG.uniform(0, 2 * np.pi, 15)
SHOW = "self.x, self.v = state\nself.a = (self.F - self.c * state[1] - self.k * state[0]) / self.m"
BEFORE = """
self.a = getattr(self, "now", 0.0)
self.x, self.v = state
self.now = (self.F - self.c * state[1] - self.k * state[0]) / self.m
"""
RATES = "return [state[1], (self.F - self.c * state[1] - self.k * state[0]) / self.m]"


def force(t) -> np.ndarray:
    t = np.asarray(t)
    return (1 - np.exp(-3 * t)) * 3.0 * np.cos(np.multiply.outer(t, TONES[0]) + TONES[1]).sum(-1)


def oscillator(folder: Path, name: str, **changed) -> Path:
    return fmus.built(
        folder, name, states=2, parameters={"m": MASS, "k": STIFFNESS, "c": DAMPING}, inputs=["F"],
        outputs=["x", "v", "a"], **{"rates": RATES, "show": SHOW, **changed},
    )  # fmt: skip


@pytest.fixture(scope="module")
def plain(tmp_path_factory) -> Path:
    return oscillator(tmp_path_factory.mktemp("plain"), "Plain")


@pytest.fixture(scope="module")
def late(tmp_path_factory) -> Path:
    return oscillator(tmp_path_factory.mktemp("late"), "Late", late=True)


@pytest.fixture(scope="module")
def before(tmp_path_factory) -> Path:
    """One whose acceleration is that of the step before."""
    return oscillator(tmp_path_factory.mktemp("before"), "Before", show=BEFORE)


def record(samples=TIME, **channels) -> jfsm.Record:
    return jfsm.Record(samples, force=force(samples), at_rest=True, **channels)


def truth() -> dict[str, np.ndarray]:
    """Motion of the oscillator, by SciPy."""

    def law(x, v):
        return STIFFNESS * x + DAMPING * v

    x, v = smooth_motion(MASS, law, lambda t: np.array([force(t)]), TIME, 0.0, 0.0, tolerance=1e-10)
    a = (force(TIME) - law(x[:, 0], v[:, 0])) / MASS
    return {"displacement": x[:, 0], "velocity": v[:, 0], "acceleration": a}


def off(run: jfsm.Record, kind: str) -> float:
    """Error of a run, in the spread of the motion."""
    right = truth()[kind]
    return float(np.std(run.channels[kind, 1] - right) / np.std(right))


@pytest.mark.parametrize("given", [{"displacement": "x", "velocity": "v", "acceleration": "a"}, {"acceleration": "a"}])
@pytest.mark.parametrize("which", ["plain", "late", "before"])
def test_it_moves_as_scipy_has_it_at_the_instants_of_the_record(which, given, request):
    box = jfsm.adapters.fmu.simulation(request.getfixturevalue(which), force="F", **given)
    run = box.of(record())
    assert {kind: off(run, kind) for kind in given} == pytest.approx(dict.fromkeys(given, 0.0), abs=0.006)
    shows_late = [note for note in run.notes if "as of the beginning of a step; it was put in time" in note]
    assert len(shows_late) == (which == "late" or which == "before" and "acceleration" in given)


def test_shorter_steps_bring_it_closer(plain):
    box = jfsm.adapters.fmu.simulation(plain, force="F", displacement="x", acceleration="a", step=0.0025)
    run = box.of(record())
    assert off(run, "displacement") < 4e-4 and off(run, "acceleration") < 2e-3


def test_an_fmu_passes_what_a_black_box_has_to(late):
    box = jfsm.adapters.fmu.simulation(late, force="F", displacement="x", acceleration="a", extra={(0, 1): "F"})
    assert isinstance(box, Runs) and box.places == ((0, 1),)
    box.tried_on(record())


def test_parameters_go_in_and_are_read_back(tmp_path):
    path = oscillator(tmp_path, "Stiff")
    soft = jfsm.adapters.fmu.simulation(path, force="F", displacement="x", parameters={"k": 900.0}).of(record())
    own = jfsm.adapters.fmu.simulation(path, force="F", displacement="x").of(record())
    assert np.std(soft.channels["displacement", 1]) > 1.2 * np.std(own.channels["displacement", 1])
    # One that takes a number, and keeps its own.
    deaf = oscillator(tmp_path, "Deaf", body="type(self).k = property(lambda self: 1800.0, lambda self, value: None)")
    with pytest.raises(ValueError, match="`parameters` must go into Deaf.fmu; k was set to 900 and is 1800"):
        jfsm.adapters.fmu.simulation(deaf, force="F", displacement="x", parameters={"k": 900.0}).of(record())


def test_units_that_an_fmu_states_are_converted(tmp_path):
    told = dict(
        body="self.old = self.register_variable\n"
        "def stated(variable):\n"
        "    unit = {'x': 'mm', 'F': 'kN'}.get(variable.name)\n"
        "    to_xml = variable.to_xml\n"
        "    def with_unit():\n"
        "        found = to_xml()\n"
        "        if unit: found.find('Real').set('unit', unit)\n"
        "        return found\n"
        "    variable.to_xml = with_unit\n"
        "    self.old(variable)\n"
        "self.register_variable = stated",
        show="self.x = 1000 * state[0]",
        rates="return [state[1], (1000 * self.F - self.c * state[1] - self.k * state[0]) / self.m]",
    )
    path = oscillator(tmp_path, "Units", **told)
    assert off(jfsm.adapters.fmu.simulation(path, force="F", displacement="x").of(record()), "displacement") < 0.006
    with pytest.raises(ValueError, match="`velocity`: x of Units.fmu is in mm"):
        jfsm.adapters.fmu.simulation(path, force="F", velocity="x")


def test_outputs_add_and_functions_of_the_record_go_in(plain):
    given = {"F": lambda record: force(record.time)}
    free = jfsm.Record(TIME, displacement=np.sin(TIME))
    twice = jfsm.adapters.fmu.simulation(plain, given=given, displacement={2: "x + x"}).of(free)
    once = jfsm.adapters.fmu.simulation(plain, force="F", displacement="x").of(record())
    np.testing.assert_allclose(twice.channels["displacement", 2], 2 * once.channels["displacement", 1])


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"force": "f", "displacement": "x"}, "`force` must name variables of Plain.fmu; 'f' is none: did you mean"),
        ({"force": "F", "displacement": "disp"}, "`displacement` must name variables of Plain.fmu; 'disp' is none: it"),
        ({"force": "F", "displacement": "x", "parameters": {"kk": 1.0}}, "'kk' is none: did you mean k"),
        ({"force": "x", "displacement": "x"}, "`force` must name real inputs of Plain.fmu: F; x is a Real output"),
        ({"force": "F"}, "must name an output of Plain.fmu: x, v, a"),
        ({"displacement": "x"}, "`force` must say which input takes force 1 of the record: F"),
        ({"force": {2: "F"}, "displacement": "x"}, "`force` must say which input takes force 1"),
        ({"force": "F", "displacement": "x", "step": -1.0}, "`step` must be a positive time"),
        ({"given": {"F": lambda record: np.zeros(3)}, "displacement": "x"}, "`given` must give finite samples (400,)"),
        ({"force": "F", "displacement": "x", "acceleration": "v"}, "must be the derivative of its displacement; it is"),
        ({"force": "F", "displacement": "x", "parameters": {"m": 0.0}}, "must go on from t = 0 s; it does not"),
    ],
)
def test_what_an_fmu_cannot_be_given_is_refused(plain, given, says):
    measured = record() if "given" not in given else jfsm.Record(TIME, displacement=np.sin(TIME))
    with pytest.raises(ValueError, match=re.escape(says)):
        jfsm.adapters.fmu.simulation(plain, **given).of(measured)


def test_a_file_that_is_no_fmu_is_refused(tmp_path):
    with pytest.raises(ValueError, match="there is no nowhere.fmu"):
        jfsm.adapters.fmu.simulation("nowhere.fmu", displacement="x")
    (tmp_path / "bad.fmu").write_text("no zip")
    with pytest.raises(ValueError, match="must be the file of an FMU; .*bad.fmu is none"):
        jfsm.adapters.fmu.simulation(tmp_path / "bad.fmu", displacement="x")


def test_steps_of_one_length_alone_are_respected(tmp_path):
    fixed = {"options": {"canHandleVariableCommunicationStepSize": "false"}}
    of_2_ms = "from pythonfmu import DefaultExperiment\nself.default_experiment = DefaultExperiment(step_size=0.002)"
    path = oscillator(tmp_path, "Fixed", body=of_2_ms, **fixed)
    run = jfsm.adapters.fmu.simulation(path, force="F", displacement="x", acceleration="a").of(record())
    assert off(run, "displacement") < 4e-4 and off(run, "acceleration") < 0.04  # half a step of the force is left
    assert any("takes steps of one length" in note for note in run.notes)
    with pytest.raises(ValueError, match="takes steps of 0.002 s alone; the record's sample of 0.003 s is no multiple"):
        jfsm.adapters.fmu.simulation(path, force="F", displacement="x").of(record(0.003 * np.arange(100)))
    with pytest.raises(ValueError, match="must have a `displacement` or `velocity` beside it at degree of freedom 1"):
        jfsm.adapters.fmu.simulation(path, force="F", acceleration="a").of(record())
    stale = oscillator(tmp_path, "Stale", show=BEFORE, **fixed)
    with pytest.raises(ValueError, match="must be the derivative of its displacement; it is a step late"):
        jfsm.adapters.fmu.simulation(stale, force="F", displacement="x", acceleration="a").of(record())


def test_an_fmu_that_brings_its_process_down_leaves_this_one_standing(tmp_path):
    path = oscillator(tmp_path, "Down", rates="import os\nos.abort()")
    with pytest.raises(ValueError, match="Down.fmu must come to the end of a run; it brought its process down"):
        jfsm.adapters.fmu.simulation(path, force="F", displacement="x").of(record())


@pytest.mark.slow
def test_the_command_line_runs_an_fmu(plain, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    x = truth()["displacement"]
    measured = x + 0.01 * np.std(x) * np.random.default_rng(0).standard_normal(x.size)
    record(displacement=measured).write("run.csv")
    command = ["diagnose", "run.csv", "--force", "force_1", "--displacement", "displacement_1", "--at-rest"]
    command += ["--model", str(plain), "--inputs", "force_1=F,0-1=F", "--outputs", "displacement_1=x"]
    said = CliRunner().invoke(app, [*command, "--parameters", "k=2000", "--cause", "coulomb", "--max-causes", "1"])
    assert said.exit_code == 1, said.output  # found
    assert "Of the simulation only its runs are known." in said.output
    assert "stiffness@0-1.k" in said.output and "The gain is that of the simulation itself" in said.output


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (["--inputs", "load=F"], "--inputs must give channels such as force_1 or force_2, base_acceleration, or links"),
        (["--outputs", "force_1=x"], "--outputs must give channels such as displacement_1 or displacement_2; one is"),
        (["--inputs", "F"], "--inputs must be pairs such as force_1=F,1-2=f_strut; one is 'F'"),
        (["--parameters", "k=stiff"], "--parameters must be numbers; k is 'stiff'"),
        (["--joints", "elbow"], "--joints must be left out where --model is no XML of MuJoCo"),
    ],
)
def test_the_command_line_says_what_an_fmu_needs(plain, tmp_path, monkeypatch, given, says):
    monkeypatch.chdir(tmp_path)
    record(displacement=np.sin(TIME)).write("run.csv")
    channels = ["--force", "force_1", "--displacement", "displacement_1"]
    said = CliRunner().invoke(app, ["diagnose", "run.csv", *channels, "--model", str(plain), *given])
    assert said.exit_code == 2 and says in " ".join(said.output.split())


def test_an_fmu_is_no_model_to_fit(plain, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    record(displacement=np.sin(TIME)).write("run.csv")
    channels = ["--force", "force_1", "--displacement", "displacement_1"]
    said = CliRunner().invoke(app, ["fit", "run.csv", *channels, "--model", str(plain), "--out", "x.toml"])
    assert said.exit_code == 2 and "is an FMU, which can only be run: give it to jfsm diagnose" in " ".join(
        said.output.split()
    )
    Path("m.toml").write_text("mass = [1.0]")
    command = ["diagnose", "run.csv", *channels, "--model", "m.toml", "--outputs", "displacement_1=x"]
    said = CliRunner().invoke(app, command)
    assert said.exit_code == 2 and "--outputs must be left out where --model is no FMU" in " ".join(said.output.split())
