"""What must not depend on units, scale, the beginning of the clock, the order of channels, their numbers and signs."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import jfsm
from jfsm.records import look, silent_forces

from .rows import FORCE, MOTION, STATES, T, csv_text, record

settings.register_profile("cheap", max_examples=25, deadline=None, derandomize=True, database=None)
settings.load_profile("cheap")

SIZES = st.floats(1e-12, 1e12)
UNITS = {"N": 1.0, "kN": 1e3, "lbf": 4.4482216152605}, {"m": 1.0, "mm": 1e-3, "in": 0.0254, "µm": 1e-6}
RNG = np.random.default_rng(7)
NOISY = MOTION + 1e-3 * RNG.standard_normal(MOTION.size)


def _run(two: jfsm.Structure, given: jfsm.Record) -> np.ndarray:
    """A run on the grid, which takes the same steps whatever the units."""
    return np.asarray(jfsm.simulate(two, given, solver="grid").displacement)


def _chain(order: tuple[int, int] = (1, 2), scale: float = 1.0) -> jfsm.Structure:
    """Two masses and the springs between them, numbered in this order."""
    number = {0: 0, 1: order[0], 2: order[1]}
    mass = np.array([1.0, 2.0])[[order.index(1), order.index(2)]] * scale

    def at(i: int, j: int) -> tuple[int, int]:
        first, second = sorted((number[i], number[j]))
        return first, second

    links = {(0, 1): 40.0, (1, 2): 90.0}
    terms = [jfsm.LinearStiffness(scale * k, at=at(*ends)) for ends, k in links.items()]
    return jfsm.Structure(mass, [*terms, *(jfsm.LinearDamping(scale * 0.02 * k, at=at(*e)) for e, k in links.items())])


@given(st.sampled_from(list(UNITS[0])), st.sampled_from(list(UNITS[1])))
def test_a_record_is_the_same_in_any_units(force: str, length: str):
    factors = UNITS[0][force], UNITS[1][length]
    told = record(
        force=FORCE / factors[0], displacement=NOISY / factors[1], units={"force": force, "displacement": length}
    )
    assert told.channels["force", 1] == pytest.approx(FORCE, rel=1e-12)
    assert told.channels["displacement", 1] == pytest.approx(NOISY, rel=1e-12)


@settings(max_examples=6)
@given(SIZES, SIZES)
def test_what_is_odd_about_a_record_does_not_depend_on_its_scale(force: float, motion: float):
    """Not where units are told from the size itself: such looks ask whether one channel fits another."""
    as_it_is, scaled = (
        look(record(force=f * FORCE, velocity=m * NOISY, displacement=None)) for f, m in ((1, 1), (force, motion))
    )
    assert [(c.name, c.passed) for c in scaled.checks] == [(c.name, c.passed) for c in as_it_is.checks]
    assert silent_forces(record(force=force * FORCE, displacement=motion * NOISY)) == ()


@settings(max_examples=4)
@given(st.floats(-1e6, 1e6))
def test_an_inspection_does_not_depend_on_the_beginning_of_the_clock(shift: float):
    one, other = record(displacement=NOISY).inspect(), record(displacement=NOISY, time=T + shift).inspect()
    assert [c.noise for c in other.channels] == pytest.approx([c.noise for c in one.channels], rel=1e-4)
    assert [(f.severity, f.channel) for f in other.findings if "uniform" not in f.message] == [
        (f.severity, f.channel) for f in one.findings
    ]


@given(st.permutations(["time", "F", "x", "v"]))
def test_columns_may_stand_in_any_order(tmp_path_factory: Any, order: list[str]):
    columns = {"time": T, "F": FORCE, "x": MOTION, "v": NOISY}
    path = tmp_path_factory.mktemp("a") / "a.csv"
    path.write_text(csv_text(",".join(order), [columns[name] for name in order]))
    read = jfsm.read(path, force="F", displacement="x", velocity="v")
    for channel, name in ((("force", 1), "F"), (("displacement", 1), "x"), (("velocity", 1), "v")):
        assert np.allclose(read.channels[channel], columns[name], atol=1e-6)


@given(st.lists(st.sampled_from([1, 2, 3, 7, 12]), min_size=1, max_size=4, unique=True))
def test_degrees_of_freedom_come_in_any_order(numbers: list[int]):
    samples = {j: j * MOTION for j in numbers}
    told = record(displacement=samples)
    assert [j for kind, j in told.channels if kind == "displacement"] == sorted(numbers)
    assert all(np.array_equal(told.channels["displacement", j], samples[j]) for j in numbers)


@settings(max_examples=5)
@given(st.sampled_from([1e-6, 0.01, 3.0, 1e5]))
def test_a_run_scales_with_the_force(scale: float):
    one = _run(_chain(), record(displacement=None, force={2: FORCE}, at_rest=True))
    other = _run(_chain(), record(displacement=None, force={2: scale * FORCE}, at_rest=True))
    assert np.allclose(other, scale * one, rtol=1e-6, atol=1e-9 * scale)


@settings(max_examples=5)
@given(st.sampled_from([1e-6, 0.01, 3.0, 1e5]))
def test_a_structure_and_its_force_may_be_in_any_unit_of_force(scale: float):
    one = _run(_chain(), record(displacement=None, force={2: FORCE}, at_rest=True))
    other = _run(_chain(scale=scale), record(displacement=None, force={2: scale * FORCE}, at_rest=True))
    assert np.allclose(other, one, rtol=1e-6, atol=1e-9)


def test_degrees_of_freedom_may_be_numbered_the_other_way():
    one = _run(_chain(), record(displacement=None, force={2: FORCE}, at_rest=True))
    other = _run(_chain((2, 1)), record(displacement=None, force={1: FORCE}, at_rest=True))
    assert np.allclose(other[:, ::-1], one, rtol=1e-6, atol=1e-9)


def test_a_force_of_the_other_sign_moves_the_other_way():
    one = _run(_chain(), record(displacement=None, force={2: FORCE}, at_rest=True))
    other = _run(_chain(), record(displacement=None, force={2: -FORCE}, at_rest=True))
    assert np.allclose(other, -one, atol=1e-12)


@settings(max_examples=4)
@given(st.floats(-1e5, 1e5))
def test_a_run_does_not_depend_on_the_beginning_of_the_clock(shift: float):
    one = _run(_chain(), record(displacement=None, force={2: FORCE}, at_rest=True))
    other = _run(_chain(), record(displacement=None, force={2: FORCE}, at_rest=True, time=T + shift))
    assert np.allclose(other, one, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("change", ["units", "sign", "clock"])
def test_a_fit_moves_with_units_and_not_with_signs_and_clocks(change: str):
    """Its values in N and m are those in mm and N times the ratio, whatever the sign of both channels."""
    believed = jfsm.Structure.sdof(mass=1.0, stiffness=60.0, damping=0.4)
    motion = _run(believed, record(displacement=None, at_rest=True))[:, 0] + 1e-4 * RNG.standard_normal(T.size)
    made = {
        "units": {"force": FORCE / 1e3, "displacement": 1e3 * motion, "units": {"force": "kN", "displacement": "mm"}},
        "sign": {"force": -FORCE, "displacement": -motion},
        "clock": {"displacement": motion, "time": T + 1e4},
    }
    one, other = (
        jfsm.fit(believed, record(at_rest=True, **each)).values for each in ({"displacement": motion}, made[change])
    )
    assert other == pytest.approx(one, rel=1e-4)


NAMES = st.text(st.characters(codec="utf-8", exclude_categories=("Cs", "Cc")), min_size=1, max_size=20)


@given(
    suffix=st.sampled_from([".csv", ".txt", ".npz", ".mat", ".h5", ".uff"]),
    force=SIZES,
    units=st.sampled_from([{}, {"force": "kN", "displacement": "mm"}, {"force": "V", "displacement": "V"}]),
    begin=st.floats(-1e4, 1e4),
    at_rest=st.booleans(),
    name=NAMES,
    dofs=st.lists(st.integers(1, 9), min_size=1, max_size=3, unique=True),
)
def test_a_written_record_is_read_back_the_same(
    tmp_path_factory: Any,
    suffix: str,
    force: float,
    units: dict[str, str],
    begin: float,
    at_rest: bool,
    name: str,
    dofs: list[int],
):
    path: Path = tmp_path_factory.mktemp("a") / f"a{suffix}"
    samples = {j: MOTION[:50] / j for j in dofs}
    made = jfsm.Record(T[:50] + begin, force * FORCE[:50], samples, units=units, at_rest=at_rest, name=name)
    made.write(path)
    read = jfsm.read(path)
    assert np.array_equal(read.time, made.time)
    assert list(read.channels) == list(made.channels)
    assert all(np.array_equal(read.channels[channel], made.channels[channel]) for channel in made.channels)
    assert (read.at_rest, read.name, dict(read.units)) == (at_rest, name, dict(made.units))


@given(
    mass=st.lists(st.floats(1e-9, 1e9), min_size=1, max_size=3),
    k=SIZES,
    k3=st.floats(-1e9, 1e9),
    trust=st.floats(1e-6, 10.0),
)
def test_a_written_structure_is_read_back_the_same(mass: list[float], k: float, k3: float, trust: float):
    end = len(mass)
    made = jfsm.Structure(mass, [jfsm.LinearStiffness(k, at=(0, end)), jfsm.CubicStiffness(k3, at=(0, 1))])
    made = made.uncertain(stiffness=trust)
    assert jfsm.Structure.from_toml(made.to_toml()).values() == made.values()
    assert jfsm.Structure.from_toml(made.to_toml()).trust == made.trust


@settings(max_examples=5)
@given(SIZES, SIZES, st.permutations(range(STATES.shape[0])))
def test_a_map_does_not_depend_on_units_nor_on_the_order_of_readings(size: float, force: float, order: list[int]):
    readings = STATES[:, 0] + 0.1 * STATES[:, 1] + 0.3 * STATES[:, 0] ** 3
    one = jfsm.RKPM.fit(STATES, readings)
    other = jfsm.RKPM.fit(size * STATES[order], force * readings[order])
    points = 0.5 * STATES[:7]
    assert np.allclose(
        other.evaluate(size * points), force * np.asarray(one.evaluate(points)), rtol=1e-5, atol=1e-7 * force
    )
