"""Models of MuJoCo as simulations: they move as MuJoCo has them; what hides in a joint is named and written back."""

from pathlib import Path

import jax
import numpy as np
import pytest
from typer.testing import CliRunner

import jfsm
from jfsm.cli import app

mujoco = pytest.importorskip("mujoco")

STEP, FINE = 0.01, 1e-4
TORQUES = ((1.2, 5.1, 0.0), (0.9, 8.3, 1.0), (0.5, 13.1, 2.0)), ((0.35, 6.2, 0.5), (0.25, 11.1, 0.0), (0.2, 3.3, 0.0))
"""Amplitude [N m], angular frequency [rad/s] and phase of the tones at each joint."""


def arm(elbow: str = 'damping="0.03"', shoulder: str = 'damping="0.05"') -> str:
    """Two links that hang from each other, on hinges."""
    return f"""<mujoco>
      <option timestep="{FINE}" integrator="implicitfast" gravity="0 0 -9.81"/>
      <worldbody><body>
        <joint name="shoulder" type="hinge" axis="0 1 0" {shoulder}/>
        <geom type="capsule" fromto="0 0 0 0 0 -.3" size=".02" mass="1"/>
        <body pos="0 0 -.3">
          <joint name="elbow" type="hinge" axis="0 1 0" {elbow}/>
          <geom type="capsule" fromto="0 0 0 0 0 -.25" size=".02" mass=".5"/>
        </body>
      </body></worldbody>
    </mujoco>"""


def torques(time) -> np.ndarray:
    time = np.asarray(time, float)
    return np.stack([sum(a * np.sin(w * time + phase) for a, w, phase in tones) for tones in TORQUES], -1)


def recorded(xml: str, samples: int, noise: float = 0.0) -> jfsm.Record:
    """What MuJoCo makes of the torques, in its own steps, a hundred to a sample."""
    model = mujoco.MjModel.from_xml_string(xml)
    data, each = mujoco.MjData(model), round(STEP / FINE)
    angles = np.empty((samples, 2))
    middle = torques((np.arange(samples * each) + 0.5) * FINE)
    for i in range(samples):
        angles[i] = data.qpos
        for row in middle[i * each : (i + 1) * each]:
            data.qfrc_applied[:] = row
            mujoco.mj_step(model, data)
    time, rng = STEP * np.arange(samples), np.random.default_rng(0)
    x, g = (q + noise * q.std(0) * rng.standard_normal(q.shape) for q in (angles, torques(time)))
    return jfsm.Record(time, force=g, displacement=x, units={"displacement": "rad", "force": "N m"}, at_rest=True)


def test_it_moves_as_mujoco_has_it():
    xml = arm('damping="0.03" stiffness="0.4"', 'damping="0.05" armature="0.004"')
    model, record = jfsm.adapters.mujoco.simulation(xml), recorded(xml, 150)
    values = model.values()
    assert 0 < values.pop("armature_elbow") < 1e-5  # not stated
    assert values == {
        "armature_shoulder": 0.004,
        "damping@0-1.c": 0.05,
        "damping@0-2.c": 0.03,
        "stiffness@0-2.k": 0.4,
    }
    run = jfsm.simulate(model, record)
    assert np.max(np.abs(run.displacement)) > 0.5
    np.testing.assert_allclose(run.displacement, np.asarray(record.displacement), atol=2e-3)


def test_a_joint_that_is_not_named_stays_where_the_model_has_it():
    held = jfsm.adapters.mujoco.simulation(arm(), joints=["elbow"])
    record = jfsm.Record(STEP * np.arange(200), force=0.2 * np.sin(5 * STEP * np.arange(200)), at_rest=True)
    link, length = 0.5, 0.25
    inertia = float(np.asarray(held.mass)[0, 0])
    pendulum = jfsm.Structure([inertia], [jfsm.LinearDamping(0.03, at=(0, 1))])
    pendulum += jfsm.SineStiffness(link * 9.81 * length / 2, 1.0, at=(0, 1))
    one, other = (np.asarray(jfsm.simulate(model, record).displacement) for model in (held, pendulum))
    assert link * length**2 / 3 == pytest.approx(inertia, rel=0.1)  # a capsule is a little more than a rod
    np.testing.assert_allclose(one, other, atol=1e-4 * np.max(np.abs(other)))


def test_dry_friction_becomes_a_term_that_sticks():
    model = jfsm.adapters.mujoco.simulation(arm('frictionloss="5"'))
    run = jfsm.simulate(model, recorded(arm(), 100))
    assert np.ptp(run.displacement[:, 0]) > 0.1
    np.testing.assert_allclose(run.displacement[:, 1], 0.0, atol=1e-9)


def test_what_was_found_goes_into_the_attributes_of_the_joints(tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(arm(shoulder='damping="0.05" armature="0.004"'))
    model = jfsm.adapters.mujoco.simulation(path).with_values({"damping@0-1.c": 0.06, "armature_shoulder": 0.005})
    model = model + jfsm.Coulomb(0.1, at=(0, 2)) + jfsm.CubicStiffness(3.0, at=(1, 2))
    found = jfsm.adapters.mujoco.written(path, model)
    assert 'frictionloss="0.1"' in found.xml and 'frictionloss="0.1"' in found.changes
    assert found.left == ("cubic_stiffness at 1-2",)
    again = jfsm.adapters.mujoco.simulation(found.xml).values()
    assert again.pop("armature_elbow") < 1e-5  # next to nothing is not written
    assert again == {
        "armature_shoulder": 0.005,
        "damping@0-1.c": 0.06,
        "coulomb@0-2.F": 0.1,
        "damping@0-2.c": 0.03,
    }
    assert "0.1" not in path.read_text()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: jfsm.adapters.mujoco.simulation("nowhere.xml"), "there is no nowhere.xml"),
        (
            lambda: jfsm.adapters.mujoco.simulation(arm(), ["wrist"]),
            "`joints` must name joints of the model, shoulder",
        ),
        (
            lambda: jfsm.adapters.mujoco.simulation(
                "<mujoco><worldbody><body><freejoint/><geom size='.1'/></body></worldbody></mujoco>"
            ),
            "must be hinges and slides",
        ),
    ],
)
def test_what_is_no_model_of_joints_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.slow
def test_friction_in_one_joint_is_named_there_and_nothing_in_none():
    causes = ["coulomb", "cubic_damping", "quadratic_damping"]
    owner = jfsm.adapters.mujoco.simulation(arm('damping="0.027"', 'damping="0.055"'))
    rubbing = recorded(arm('damping="0.03" frictionloss="0.1" solreffriction="0.002 1"'), 1000, noise=0.01)
    d = jfsm.diagnose(rubbing, owner, causes=causes, key=jax.random.key(0))
    [found] = d.findings
    assert (found.cause, found.at) == ("coulomb", (0, 2)) and found.probability > 0.9
    assert found.parameters["F"].value == pytest.approx(0.1, rel=0.05)
    assert 'frictionloss="0.' in jfsm.adapters.mujoco.written(arm(), d.extended).changes
    silent = jfsm.diagnose(recorded(arm(), 1000, noise=0.01), owner, causes=causes, key=jax.random.key(0))
    assert silent.verdict in ("consistent", "parameters") and all(f.cause != "coulomb" for f in silent.findings)


def test_the_command_line_takes_a_model_and_writes_it_with_what_was_found(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("arm.xml").write_text(arm('damping="0.027"'))
    recorded(arm(), 400, noise=0.002).write("run.csv")
    names = {kind: [f"--{kind}={j}={kind}_{j}" for j in (1, 2)] for kind in ("force", "displacement")}
    channels = [*names["force"], *names["displacement"]]
    out = CliRunner().invoke(app, ["fit", "run.csv", *channels, "--model", "arm.xml", "--out", "fitted.xml"])
    assert out.exit_code == 0, out.output
    found = jfsm.adapters.mujoco.simulation("fitted.xml").values()
    assert found["damping@0-2.c"] == pytest.approx(0.03, rel=0.02)
    Path("m.toml").write_text("mass = [1.0]")
    command = ["fit", "run.csv", *channels, "--model", "m.toml", "--joints", "elbow", "--out", "x.toml"]
    wrong = CliRunner().invoke(app, command)
    assert wrong.exit_code == 2 and "--joints must be left out" in wrong.output.replace("\n", " ")


@pytest.mark.slow
def test_an_armature_that_the_model_does_not_state_is_found_and_written():
    real = arm(shoulder='damping="0.05" armature="0.02"')
    d = jfsm.diagnose(
        recorded(real, 800, noise=0.01),
        jfsm.adapters.mujoco.simulation(arm()),
        causes=["coulomb", "missing_stiffness", "force_delay"],
        max_causes=1,
        key=jax.random.key(0),
    )
    assert d.verdict == "parameters" and "armature_shoulder" in {name for f in d.findings for name in f.parameters}
    assert d.refitted["armature_shoulder"].value == pytest.approx(0.02, rel=0.05)
    changes = jfsm.adapters.mujoco.written(arm(), d.extended).changes
    assert 'name="shoulder" armature="0.0' in changes and 'name="elbow" armature' not in changes


KP, KV, GEAR = 40.0, 2.0, 1.5
HELD = arm('damping="0.03"').replace(
    "</worldbody>",
    f'</worldbody><actuator><position joint="elbow" kp="{KP}" kv="{KV}" gear="{GEAR}"/>'
    f'<position joint="shoulder" kp="{2 * KP}" kv="{KV}"/></actuator>',
)


def test_commands_of_position_actuators_drive():
    model = mujoco.MjModel.from_xml_string(HELD)
    data, each = mujoco.MjData(model), round(STEP / FINE)
    time = STEP * np.arange(120)
    wanted = 0.2 * np.stack([np.sin(5 * time), np.sin(7 * time)], 1)
    between = 0.2 * np.stack([np.sin(w * (np.arange(120 * each) + 0.5) * FINE) for w in (5, 7)], 1)
    angles = np.empty((120, 2))
    for i in range(120):
        angles[i] = data.qpos
        for shoulder, elbow in between[i * each : (i + 1) * each]:
            data.ctrl[:] = elbow, shoulder  # in the order of the actuators
            mujoco.mj_step(model, data)
    force = jfsm.adapters.mujoco.forces_of_commands(HELD, wanted)
    np.testing.assert_allclose(force, wanted * [2 * KP, KP * GEAR])
    held = jfsm.adapters.mujoco.simulation(HELD, commanded=True)
    assert held.commands == (1, 2) and held.values()["stiffness@0-2.k"] == pytest.approx(KP * GEAR**2)
    run = jfsm.simulate(held, jfsm.Record(time, force=force, displacement=angles, at_rest=True))
    np.testing.assert_allclose(run.displacement, angles, atol=2e-3)


def test_a_loop_that_was_found_goes_into_its_actuator():
    held = jfsm.adapters.mujoco.simulation(HELD, commanded=True)
    same = jfsm.adapters.mujoco.written(HELD, held)
    assert same.changes == "" and same.left == ()
    changed = held.with_values({"damping@0-2.c#2": 1.4 * GEAR**2, "damping@0-2.c": 0.04})
    found = jfsm.adapters.mujoco.written(HELD, changed)
    again = jfsm.adapters.mujoco.simulation(found.xml, commanded=True).values()
    assert again["damping@0-2.c#2"] == pytest.approx(1.4 * GEAR**2) and again["damping@0-2.c"] == pytest.approx(0.04)
    assert again["stiffness@0-2.k"] == pytest.approx(KP * GEAR**2)


def test_what_cannot_be_commanded_is_refused():
    with pytest.raises(ValueError, match="must have one position actuator in each joint that is commanded; shoulder"):
        jfsm.adapters.mujoco.simulation(arm(), commanded=True)
    with pytest.raises(ValueError, match=r"`commands` must have a column for each of 2 joints; got shape \(3, 1\)"):
        jfsm.adapters.mujoco.forces_of_commands(HELD, np.zeros((3, 1)))
