"""What one motion cannot tell: time in a decay, the drive's own line under a single line."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import jfsm
from jfsm.diagnosis.evidence.identifiable import in_step, untold
from jfsm.diagnosis.hypotheses.effect import Effect
from jfsm.identification import prepare
from jfsm.structures import ParametricStiffness, PeriodicDisturbance

MODEL = jfsm.Structure.sdof(mass=2.0, stiffness=800.0, damping=1.5)
TIME = np.arange(2000) / 100
LINE = 15.0


def nuisances(force: np.ndarray | None) -> Any:
    rng = np.random.default_rng(3)
    x = np.exp(-0.2 * TIME) * np.cos(20.0 * TIME) + 0.4 * np.cos(LINE * TIME) + 1e-3 * rng.standard_normal(TIME.size)
    measured = None if force is None else force + 1e-3 * rng.standard_normal(TIME.size)
    return prepare(jfsm.Record(TIME, measured, x), MODEL)


def hypothesis(cause: str, *laws: Any) -> Any:
    return SimpleNamespace(effects=(Effect(jfsm.structures.causes()[cause], (0, 1)),), laws=laws)


def load(omega: float) -> Any:
    return hypothesis("periodic_disturbance", PeriodicDisturbance(F=1.0, omega=omega, phase=0.3, at=(0, 1)))


@pytest.mark.parametrize(
    ("omega", "told"), [(LINE, False), (3 * LINE, False), (2 * LINE + 0.1, False), (2.5 * LINE, True), (LINE / 2, True)]
)
def test_under_a_single_line_a_load_that_keeps_time_with_it_may_be_any_law(omega: float, told: bool):
    why_not = untold([nuisances(50.0 * np.cos(LINE * TIME))])(load(omega))
    assert ("line" in why_not) == (not told)


def test_under_a_single_line_a_spring_that_keeps_time_with_it_may_be_any_law_too():
    spring = ParametricStiffness(dk=1.0, omega=2 * LINE, phase=0.0, at=(0, 1))
    assert untold([nuisances(50.0 * np.cos(LINE * TIME))])(hypothesis("parametric_stiffness", spring))


@pytest.mark.parametrize(("omega", "steps"), [(LINE, True), (LINE + 0.05, True), (2 * LINE, False), (17.0, False)])
def test_a_load_is_in_step_with_a_single_line_of_its_frequency(omega: float, steps: bool):
    assert in_step([nuisances(50.0 * np.cos(LINE * TIME))])(load(omega)) == steps
    assert not in_step([nuisances(50.0 * np.cos(LINE * TIME) + 20.0 * np.cos(22.0 * TIME))])(load(omega))
    assert not in_step([nuisances(None)])(load(omega))


@pytest.mark.parametrize("other", [1.3 * LINE, 3 * LINE])
def test_under_two_lines_a_load_shows(other: float):
    assert not untold([nuisances(50.0 * np.cos(LINE * TIME) + 20.0 * np.cos(other * TIME))])(load(LINE))


def test_two_records_show_both():
    both = [nuisances(50.0 * np.cos(LINE * TIME)), nuisances(20.0 * np.cos(LINE * TIME))]
    assert not untold(both)(load(LINE))
    assert not untold([nuisances(None)] * 2)(hypothesis("stiffness_drop"))


@pytest.mark.parametrize(
    ("cause", "told"), [("stiffness_drop", False), ("damping_drift", False), ("cubic_hardening", True)]
)
def test_in_one_decay_what_changes_with_time_may_change_with_the_amplitude(cause: str, told: bool):
    assert ("single decay" in untold([nuisances(None)])(hypothesis(cause))) == (not told)
    assert not untold([nuisances(50.0 * np.cos(LINE * TIME))])(hypothesis(cause))
