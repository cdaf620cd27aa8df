"""Drives that are told where to go: what they do late is said of the command, not of a force."""

import re

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jfsm
from jfsm._result import Estimate
from jfsm.diagnosis._finding import Finding
from jfsm.diagnosis.hypotheses.candidates import asked_for, candidates, chosen_causes
from jfsm.diagnosis.report.sentences import finding_sentence
from jfsm.identification import prepare

INERTIA, GAIN, BRAKE, WEIGHT, LATE = 0.04, 60.0, 3.0, 0.5, 0.012
TIME = np.arange(1500) / 300.0


def wanted(t: np.ndarray, seed: int = 0) -> np.ndarray:
    """Position [rad] that is commanded."""
    lines = 2 * np.pi * np.linspace(0.3, 6.0, 20)
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, lines.size)
    begins = -np.expm1(-((np.maximum(t, 0.0) / 0.3) ** 2))
    return 0.05 * begins * np.sin(np.multiply.outer(t, lines) + phases).sum(-1)


def followed(late: float, brake: float = BRAKE) -> np.ndarray:
    """Angle of a joint whose loop hears of its command so late, by SciPy."""

    def rates(t, y):
        told = wanted(np.asarray(t - late))
        return [y[1], (GAIN * (told - y[0]) - brake * y[1] - WEIGHT * y[0]) / INERTIA]

    return solve_ivp(rates, (0, TIME[-1]), [0, 0], t_eval=TIME, rtol=1e-7, atol=1e-9, max_step=2e-3).y[0]


def joint() -> jfsm.Structure:
    return jfsm.Structure([INERTIA], [jfsm.LinearStiffness(WEIGHT, at=(0, 1))]).commanded(1, GAIN, BRAKE)


def recorded(x: np.ndarray, noise: float = 0.0) -> jfsm.Record:
    x = x + noise * x.std() * np.random.default_rng(1).standard_normal(x.size)
    units = {"displacement": "rad", "force": "N m"}
    return jfsm.Record(TIME, force=GAIN * wanted(TIME), displacement=x, units=units, at_rest=True)


def test_a_late_command_acts_later_by_so_much():
    model = jfsm.causes()["command_delay"].apply(joint(), at=("force", 1), tau=LATE)
    exact = followed(LATE)
    run = np.asarray(jfsm.simulate(model, recorded(exact)).displacement)[:, 0]
    np.testing.assert_allclose(run, exact, atol=5e-3 * np.max(np.abs(exact)))
    in_time = np.asarray(jfsm.simulate(joint(), recorded(exact)).displacement)[:, 0]
    assert np.max(np.abs(in_time - exact)) > 0.1 * np.max(np.abs(exact))


def test_a_loop_is_a_spring_and_a_dashpot_that_a_file_keeps(tmp_path):
    model = joint().uncertain(stiffness=0.1)
    assert model.values() == {
        "mass@1": INERTIA, "stiffness@0-1.k": WEIGHT, "stiffness@0-1.k#2": GAIN, "damping@0-1.c": BRAKE,
    }  # fmt: skip
    assert (model + jfsm.Coulomb(0.1, at=(0, 1))).with_values({"mass@1": 0.05}).commands == (1,)
    model.save(tmp_path / "joint.toml")
    again = jfsm.Structure.load(tmp_path / "joint.toml")
    assert (again.commands, again.values()) == ((1,), model.values())
    plain = jfsm.Simulation(lambda q, v, force, t, p: force / p["J"], 1, {"J": INERTIA})
    assert (plain.commanded(1, GAIN) + jfsm.Coulomb(0.1, at=(0, 1))).commands == (1,)


@pytest.mark.parametrize("at", [0, 2, 1.5, True])
def test_what_is_commanded_must_be_there(at):
    with pytest.raises(ValueError, match=r"degrees? of freedom"):
        jfsm.Structure([1.0]).commanded(at, 9.0)
    with pytest.raises(
        ValueError, match=f"`commands` must be degrees of freedom from 1 to 1; got {re.escape(repr(at))}"
    ):
        jfsm.Structure([1.0], commands=[at])


def test_a_file_lists_what_is_commanded():
    with pytest.raises(
        ValueError, match="`commands` must be a list of degrees of freedom, as commands = \\[1\\]; got 1"
    ):
        jfsm.Structure.from_toml("mass = [1.0]\ncommands = 1")


def test_commands_may_be_late_where_there_are_any_and_forces_elsewhere():
    record = recorded(wanted(TIME))
    free = jfsm.Structure.sdof(INERTIA, GAIN, BRAKE)
    told, measured = (set(chosen_causes(asked_for(None, model, [record]))) for model in (joint(), free))
    assert told - measured == {"command_delay"} and measured - told == {"force_delay", "channel_delay"}
    both = jfsm.Record(TIME, force=TIME, displacement=TIME, velocity=TIME)
    assert "channel_delay" in chosen_causes(asked_for(None, joint(), [both]))
    tried = candidates(joint(), [prepare(record, joint())], chosen_causes(["command_delay"]))
    assert [c.effects[0].at for c in tried] == [("force", 1)]


def test_the_sentence_speaks_of_the_command():
    cause = jfsm.causes()["command_delay"]
    finding = Finding.of_sensor(
        cause, ("force", 1), "tau", Estimate(LATE, 0.011, 0.013, "s"), "tau = 12 ms", "late", ()
    )
    said = finding_sentence(finding, jfsm.causes())
    assert said.startswith("The record shows a late command at command channel 1") and "force" not in said


@pytest.mark.slow
@pytest.mark.parametrize("late", [LATE, 0.0])
def test_a_late_command_is_told_from_a_loop_that_brakes_less(late):
    x = followed(late, brake=BRAKE if late else 0.7 * BRAKE)
    few = ["command_delay", "coulomb", "cubic_hardening", "maxwell", "ripple", "elastic_joint"]
    d = jfsm.diagnose(recorded(x, noise=0.003), joint(), causes=few, key=jax.random.key(0))
    if late:
        [found] = d.findings
        assert (d.verdict, found.cause, found.at) == ("cause", "command_delay", ("force", 1))
        assert found.parameters["tau"].value == pytest.approx(LATE, abs=1e-3)
        assert "force" not in d.sentence.split(". ")[0]
    else:
        assert d.verdict == "parameters" and {f.cause for f in d.findings} == {"damping_value"}
        assert d.refitted["damping@0-1.c"].value == pytest.approx(0.7 * BRAKE, rel=0.03)
