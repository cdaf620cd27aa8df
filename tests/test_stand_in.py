"""Simulations of which there is nothing but what they make of a test: a file, or a black box."""

import re

import jax
import numpy as np
import pytest
from references import smooth_motion

import jfsm
from jfsm.diagnosis._diagnose import _runs
from jfsm.identification import rough_model
from jfsm.structures import Runs

MASS, STIFFNESS, DAMPING, HARDENING = 1.0, 900.0, 12.0, 6e4
TIME = 0.01 * np.arange(1500)
KEY = jax.random.key(0)
FEW = ("cubic_hardening", "coulomb")
RNG = np.random.default_rng(8)
TONES = 2 * np.pi * RNG.uniform(0.5, 12.0, 24), RNG.uniform(0, 2 * np.pi, 24)


def force(t):
    return 6.0 * np.cos(np.multiply.outer(t, TONES[0]) + TONES[1]).sum(-1)


def motion_of(stiffness: float = STIFFNESS, hardening: float = 0.0) -> np.ndarray:
    """Displacement (n,) of one mass under the force, by SciPy."""

    def law(x, v):
        return stiffness * x + DAMPING * v + hardening * x**3

    return smooth_motion(MASS, law, lambda t: np.array([force(t)]), TIME, 0.0, 0.0, tolerance=1e-8)[0][:, 0]


def measured(hardening: float = HARDENING, stiffness: float = STIFFNESS) -> jfsm.Record:
    x = motion_of(stiffness, hardening)
    noise = 0.01 * np.std(x) * np.random.default_rng(5).standard_normal(x.size)
    return jfsm.Record(TIME, force=force(TIME), displacement=x + noise, at_rest=True)


def simulated(hardening: float = 0.0, stiffness: float = STIFFNESS) -> jfsm.Record:
    """As a file of output holds it: instants and a displacement."""
    return jfsm.Record(TIME, displacement=motion_of(stiffness, hardening), at_rest=True)


def note(d: jfsm.Diagnosis, begins: str) -> str:
    (found,) = [text for text in d.notes if text.startswith(begins)]
    return found


# A model of which nothing is known


def test_masses_and_links_of_a_chain_are_seen_in_its_accelerations():
    mass, springs, dashpots = np.array([2.0, 1.5, 1.0]), (3000.0, 2000.0, 1500.0), (3.0, 2.0, 1.0)
    chain = jfsm.Structure.chain(mass, springs, dashpots)
    time = 0.005 * np.arange(4000)
    run = jfsm.simulate(chain, jfsm.Record(time, force=force(time), at_rest=True))
    acceleration = jfsm.Record(time, force=force(time), acceleration=run.acceleration)
    rough = rough_model([acceleration])
    found = {at: float(term.values[0]) for term in rough.terms if term.kind == "stiffness" for at in [term.at]}
    assert sorted(found) == [(0, 1), (1, 2), (2, 3)]
    np.testing.assert_allclose(np.asarray(rough.mass), mass, rtol=0.02)
    np.testing.assert_allclose([found[at] for at in sorted(found)], springs, rtol=0.02)


def test_a_release_gives_the_frequency_of_a_unit_mass():
    def law(x, v):
        return 400.0 * x + 0.4 * v

    x, _ = smooth_motion(1.0, law, lambda t: np.zeros(1), TIME, 0.1, 0.0, tolerance=1e-8)
    rough = rough_model([jfsm.Record(TIME, displacement=x[:, 0])])
    assert float(rough.mass[0]) == 1.0
    assert rough.values()["stiffness@0-1.k"] == pytest.approx(400.0, rel=0.05)


def test_an_imposed_motion_gives_a_spring_and_a_dashpot_without_a_mass():
    x = 0.02 * np.sin(3 * TIME) + 0.01 * np.sin(11 * TIME)
    v = 0.06 * np.cos(3 * TIME) + 0.11 * np.cos(11 * TIME)
    rough = rough_model([jfsm.Record(TIME, force=700 * x + 40 * v, displacement=x, drive="motion")])
    assert rough.values() == pytest.approx({"mass@1": 0.0, "stiffness@0-1.k": 700.0, "damping@0-1.c": 40.0}, rel=0.02)


def test_what_moves_unseen_needs_a_model():
    with pytest.raises(ValueError, match="`simulated` shows nothing of degree of freedom 1. Give `model` too"):
        rough_model([jfsm.Record(TIME, force=force(TIME), displacement={2: np.sin(TIME)})])


# From a run to a verdict


def test_a_spring_that_a_simulation_lacks_is_found_from_its_output_alone():
    d = jfsm.diagnose(measured(), simulated=simulated(), causes=FEW, key=KEY, until=14.0)
    (finding,) = d.findings
    assert finding.cause == "cubic_hardening"
    assert finding.parameters["k3"].value == pytest.approx(HARDENING, rel=0.02)
    said = note(d, "Of the simulation only its runs are known.")
    stated = {path: float(value) for path, value in re.findall(r"(\S+) = ([-+.e\d]+)", said)}
    known = {"mass@1": MASS, "stiffness@0-1.k": STIFFNESS, "damping@0-1.c": DAMPING}
    assert stated == pytest.approx(known, rel=0.002)
    (apart,) = re.findall(r"displacement 1 by ([\d.]+)%", note(d, "The simulation's own run departs"))
    x, own = measured().channels["displacement", 1], motion_of()
    assert float(apart) == pytest.approx(100 * np.std(x - own) / np.std(x), abs=0.06)


def test_a_run_under_another_force_will_do():
    shift = 300
    run = simulated()
    later = jfsm.Record(TIME[shift:], force=force(TIME[shift:]), displacement=run.channels["displacement", 1][shift:])
    d = jfsm.diagnose(measured(0.0), simulated=later, causes=FEW, key=KEY)
    assert d.verdict == "consistent"
    assert not [text for text in d.notes if text.startswith("The simulation's own run departs")]


def test_a_black_box_is_run_under_what_drives_the_record():
    record = measured(0.0, stiffness=1.08 * STIFFNESS)

    def box(given: jfsm.Record) -> dict[str, np.ndarray]:  # exact for a force that is straight between samples
        drive = np.array(given.force, float)[:, 0]
        step, x, v, moved = given.dt / 20, 0.0, 0.0, np.zeros(len(given))
        for k in range(1, len(given)):
            for i in range(20):
                pushed = drive[k - 1] + (drive[k] - drive[k - 1]) * (i + 0.5) / 20
                half = v + 0.5 * step * (pushed - DAMPING * v - STIFFNESS * x) / MASS
                middle = x + 0.5 * step * half
                v += step * (pushed - DAMPING * half - STIFFNESS * middle) / MASS
                x += step * half
            moved[k] = x
        return {"displacement": moved}

    d = jfsm.diagnose(record, jfsm.Simulation.from_runs(box), causes=FEW, key=KEY)
    assert d.verdict == "parameters"
    (finding,) = d.findings
    assert finding.cause == "stiffness_value"
    assert finding.parameters["k"].value == pytest.approx(1.08 * STIFFNESS, rel=0.005)
    assert note(d, "The gain is that of the simulation itself, run with the force that it lacks")
    assert d.gain is not None and d.gain.closed > 0.97


@pytest.mark.parametrize("made", [dict, lambda motion: jfsm.Record(TIME, **motion)])
def test_what_drives_the_record_drives_the_run_of_a_black_box(made):
    box = jfsm.Simulation.from_runs(lambda record: made({"displacement": np.sin(record.time)}))
    record = measured(0.0)
    (run,) = _runs([record], box, None)
    np.testing.assert_array_equal(run.channels["force", 1], record.channels["force", 1])
    np.testing.assert_array_equal(run.channels["displacement", 1], np.sin(TIME))


def test_what_a_box_says_of_its_run_stays_with_it():
    def run(record):
        return jfsm.Record(TIME, displacement=np.sin(TIME)).noted("A step late, and put in time.")

    (made,) = _runs([measured(0.0)], jfsm.Simulation.from_runs(run), None)
    assert "A step late, and put in time." in made.notes


@pytest.mark.slow  # two searches, of which one is that for the simulation's own spring
def test_a_spring_that_a_simulation_has_is_no_cause_but_what_it_lacks_is():
    x = motion_of(hardening=HARDENING)
    noise = 0.01 * np.std(x) * np.random.default_rng(5).standard_normal(x.size)
    twin = jfsm.Record(TIME, force=force(TIME), displacement=x + noise, at_rest=True)
    assert jfsm.diagnose(twin, simulated=simulated(HARDENING), causes=FEW, key=KEY).verdict == "consistent"
    d = jfsm.diagnose(measured(2 * HARDENING), simulated=simulated(HARDENING), causes=FEW, key=KEY)
    assert d.verdict in ("parameters", "cause")
    assert d.extended.values()["cubic_stiffness@0-1.k3"] == pytest.approx(2 * HARDENING, rel=0.03)


@pytest.mark.slow  # one mass tells as much of the way there
def test_friction_between_two_masses_is_found_at_its_place_without_any_model():
    mass, friction = np.diag([1.0, 0.7]), 1.5
    stiffness, damping = np.array([[1400.0, -500.0], [-500.0, 500.0]]), np.array([[9.0, -3.0], [-3.0, 3.0]])

    def moved(limit: float) -> np.ndarray:
        def law(x, v):
            return stiffness @ x + damping @ v + limit * np.tanh((v[1] - v[0]) / 2e-3) * np.array([-1.0, 1.0])

        return smooth_motion(mass, law, lambda t: np.array([force(t), 0.0]), TIME, [0, 0], [0, 0], tolerance=1e-8)[0]

    x = moved(friction)
    record = jfsm.Record(
        TIME, force=force(TIME), displacement=x + 0.01 * x.std(0) * np.random.default_rng(5).standard_normal(x.shape)
    )
    d = jfsm.diagnose(record, simulated=jfsm.Record(TIME, displacement=moved(0.0)), causes=FEW, key=KEY)
    (finding,) = d.findings
    assert finding.kind == "dry friction" and finding.at == (1, 2)
    assert finding.parameters["F"].value == pytest.approx(friction, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("released", [True, False])
def test_what_moves_without_a_force_is_compared_by_a_unit_mass(released: bool):
    x0 = 0.1 if released else 0.0

    def drive(t):
        return np.array([0.0 if released else -force(t)])

    def moved(hardening: float) -> np.ndarray:
        def law(x, v):
            return STIFFNESS * x + 2.0 * v + hardening * x**3

        return smooth_motion(1.0, law, drive, TIME, x0, 0.0, tolerance=1e-8)[0][:, 0]

    x = moved(HARDENING)
    base = None if released else force(TIME)
    noise = 0.003 * np.std(x) * np.random.default_rng(5).standard_normal(x.size)
    record = jfsm.Record(TIME, displacement=x + noise, base_acceleration=base)
    d = jfsm.diagnose(record, simulated=jfsm.Record(TIME, displacement=moved(0.0)), causes=FEW, key=KEY)
    (finding,) = d.findings
    assert finding.cause == "cubic_hardening"
    assert finding.parameters["k3"].value == pytest.approx(HARDENING, rel=0.03)


# What is refused


@pytest.mark.slow  # it is refused only after the whole catalogue
def test_a_simulation_that_nothing_follows_is_refused():
    x = np.cumsum(np.random.default_rng(0).standard_normal(TIME.size)) * 0.001
    with pytest.raises(ValueError, match="`simulated` is followed by no structure of the catalogue better than to"):
        jfsm.diagnose(measured(), simulated=jfsm.Record(TIME, force=force(TIME), displacement=x), key=KEY)


@pytest.mark.parametrize(
    ("given", "error", "says"),
    [
        ({}, ValueError, "`model` must be the simulation that you believe in"),
        ({"model": "model.toml"}, TypeError, "`model` must be a structure, such as"),
        (
            {"simulated": jfsm.Record(TIME + 0.003, displacement=np.sin(TIME))},
            ValueError,
            "its clock is not that of the record",
        ),
        (
            {"simulated": jfsm.Record(TIME, displacement=np.sin(TIME), units={"displacement": "V"})},
            ValueError,
            "its displacement is in V, that of the record in m",
        ),
        (
            {"model": Runs(lambda record: record), "simulated": jfsm.Record(TIME, displacement=np.sin(TIME))},
            ValueError,
            "`simulated` must be left out",
        ),
    ],
)
def test_what_is_no_simulation_is_refused(given, error, says):
    with pytest.raises(error, match=re.escape(says)):
        jfsm.diagnose(measured(0.0), **given)


class Moody:
    """Gives something else at every call."""

    def __init__(self):
        self.calls = 0

    def __call__(self, record: jfsm.Record) -> dict[str, np.ndarray]:
        self.calls += 1
        return {"displacement": self.calls * np.sin(record.time)}


@pytest.mark.parametrize(
    ("run", "error", "says"),
    [
        (Moody(), ValueError, "must give the same whenever it is given the same record"),
        (lambda r: {"displacement": np.cumsum(r.force[::-1, 0])[::-1]}, ValueError, "must not know the force before"),
        (lambda r: {"displacement": r.force[:-1, 0]}, ValueError, "must give samples on the record's own clock"),
        (lambda r: {"angle": r.force}, TypeError, "or a mapping such as {'displacement': x}; it gives dict"),
        (lambda r: 3.0, TypeError, "it gives float"),
    ],
)
def test_a_black_box_that_is_none_is_refused(run, error, says):
    with pytest.raises(error, match=re.escape(says)):
        jfsm.diagnose(measured(0.0), jfsm.Simulation.from_runs(run))


def test_a_run_that_is_no_function_is_told_from_its_output():
    with pytest.raises(TypeError, match=r"goes into diagnose\(record, simulated=...\)"):
        jfsm.Simulation.from_runs(measured(0.0))  # pyright: ignore[reportArgumentType]
