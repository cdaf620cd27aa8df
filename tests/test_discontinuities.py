"""Lines of jumps and kinks: found without being told, with honest intervals, and none where the force is smooth."""

import jax.numpy as jnp
import numpy as np
import pytest

import jfsm
from jfsm import find_discontinuities
from jfsm.surrogates import RKPM, Plane
from jfsm.systems import example_1, example_2, example_3

LINE = np.arange(4.0, 7.005, 0.01)[:, None]
UNITS = np.array([0.01, 0.3])


def trajectory(n: int = 2000, seed: int = 0) -> np.ndarray:
    """States along a motion of three incommensurate frequencies, in metres and metres per second."""
    rng, omega = np.random.default_rng(seed), np.array([1.0, np.sqrt(7.0), 1.7])
    phase = omega * np.linspace(0.0, 60.0, n)[:, None] + rng.uniform(0.0, 2.0 * np.pi, 3)
    amplitude = rng.uniform(0.3, 0.6, 3)
    motion = np.stack([np.sin(phase) @ amplitude, np.cos(phase) @ (amplitude * omega)], axis=1)
    return motion * UNITS


def bilinear_coulomb(states: np.ndarray) -> np.ndarray:
    x, v = states.T
    return 2500.0 * x + 2.66 * v + 3750.0 * np.maximum(x, 0.0) + 1.5 * np.sign(v)


SMOOTH = {
    "duffing": lambda x, v: 9.0 * x + 0.12 * v + 10.0 * x**3,
    "van_der_pol": lambda x, v: 9.0 * x + 10.0 * (x**2 - 1.0) * v,
    "tanh": lambda x, v: np.tanh(2.0 * x) + np.tanh(1.5 * v),
    "pendulum": lambda x, v: np.sin(3.0 * x) + 0.1 * v,
    "friction that is smooth": lambda x, v: x + np.tanh(v / 0.2),
    "quadratic damping": lambda x, v: x + v * np.abs(v),
}


def noisy(values: np.ndarray, share: float, seed: int) -> np.ndarray:
    scale = share * values.std(axis=0)
    return values + scale * np.random.default_rng(seed).normal(size=values.shape)


# --- found ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("law", "expected"),
    [
        (example_1, [("jump", 6.0, 1.0)]),
        (example_2, [("kink", 6.0, 1.6)]),
        (example_3, [("jump", 5.0, 1.0), ("kink", 6.0, 1.6)]),
    ],
)
def test_the_lines_of_the_papers_examples_are_found(law, expected):
    found = sorted(find_discontinuities(LINE, law(LINE[:, 0])), key=lambda line: float(line.offset))
    assert [line.kind for line in found] == [kind for kind, _, _ in expected]
    for line, (kind, offset, size) in zip(found, expected, strict=True):
        # a kink to rounding; a jump to the gap between the readings beside it
        assert abs(line.offset - offset) < (1e-10 if kind == "kink" else 0.01)
        assert line.low - 1e-9 <= offset <= line.high + 1e-9
        assert abs(line.size - size) < 1e-9 and line.confidence > 0.999


def test_a_map_enriched_by_what_was_found_holds_example_3():
    force, queries = example_3(LINE[:, 0]), np.linspace(4.0, 7.0, 271)[:, None]
    queries = queries[np.abs(queries[:, 0] - 5.0) > 0.0101]  # between two readings a jump has no place
    found = find_discontinuities(LINE, force)
    plain = RKPM.fit(LINE, force, order=2)
    enriched = RKPM.fit(LINE, force, order=2, across=found)
    error = np.abs(enriched.evaluate(queries) - example_3(queries[:, 0]))
    assert np.max(error) < 1e-10 < 1e-3 < np.max(np.abs(plain.evaluate(queries) - example_3(queries[:, 0])))
    slopes = np.asarray(enriched.evaluate_derivatives(queries, ((1,),)))[:, 0]
    np.testing.assert_allclose(slopes, 0.8 * np.sign(queries[:, 0] - 6.0 + 1e-12), atol=1e-8)


@pytest.mark.parametrize("share", [0.0, 0.01, 0.03])
def test_a_kink_in_displacement_and_a_jump_in_velocity_are_told_apart(share):
    states = trajectory(3000)
    readings = noisy(bilinear_coulomb(states), share, 2)
    found = {line.kind: line for line in find_discontinuities(noisy(states, share, 1), readings)}
    assert set(found) == {"kink", "jump"}
    assert np.array_equal(found["kink"].normal, [1, 0]) and np.array_equal(found["jump"].normal, [0, 1])
    for kind, truth in (("kink", 3750.0), ("jump", 3.0)):
        line = found[kind]
        along = states @ np.asarray(line.normal)
        assert abs(line.offset) < max(1e-3 * np.ptp(along), share * np.std(along))  # within the noise of one reading
        # noise in the states takes a little off every size
        assert abs(line.size - truth) < max(4.0 * line.size_error, (0.005 + share) * truth)


def test_a_line_across_both_axes_is_found_along_its_direction():
    states = np.random.default_rng(5).uniform(-1.0, 1.0, (1500, 2))
    force = states[:, 0] ** 2 + np.maximum(states[:, 1] - 2.0 * states[:, 0] - 0.3, 0.0)
    (line,) = find_discontinuities(states, force, directions=[[1, 0], [0, 1], [-2, 1]])
    assert line.kind == "kink" and np.array_equal(line.normal, [-2, 1])
    assert abs(line.offset - 0.3) < 1e-8 and abs(line.size - 1.0) < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "expected"),
    [("bilinear", {"kink"}), ("coulomb", {"jump"}), ("bilinear_coulomb", {"kink", "jump"})],
)
def test_the_lines_of_case_4_are_found_and_give_its_constants(name, expected):
    time = np.arange(0.0, 10.0, 2.0 * np.pi / (200.0 * np.sqrt(2500.0 / 1.77)))
    drive = 10.0 * np.cos(2.0 * np.pi * 5.86 * time)
    run = jfsm.simulate(jfsm.systems.ALL[name](), jfsm.Record(time, drive, at_rest=True))
    x, v, a = (np.asarray(q)[:, 0] for q in (run.displacement, run.velocity, run.acceleration))
    moving = v != 0.0  # at rest the friction force is any
    states, force = np.stack([x, v], axis=1)[moving], (drive - 1.77 * a)[moving]
    found = {line.kind: line for line in find_discontinuities(states, force)}
    assert set(found) == expected
    for kind, truth in (("kink", 3750.0), ("jump", 3.0)):
        if kind in found:
            line = found[kind]
            assert abs(line.offset) < 1e-3 * np.ptp(states @ np.asarray(line.normal))
            assert abs(line.size / truth - 1.0) < 0.005


def gap(along: np.ndarray, place: float) -> tuple[float, float]:
    """The readings on either side of a place."""
    return float(along[along < place].max()), float(along[along >= place].min())


@pytest.mark.parametrize("seed", range(3))
def test_the_interval_of_an_exact_jump_is_the_gap_between_the_readings_beside_it(seed):
    states = trajectory(4000, seed)  # some hundred readings within the reach of a candidate
    for line in find_discontinuities(states, bilinear_coulomb(states)):
        along = states @ np.asarray(line.normal)
        if line.kind == "jump":
            np.testing.assert_allclose([line.low, line.high], gap(along, 0.0), rtol=0.0, atol=1e-12 * np.ptp(along))
            assert line.low < line.offset < line.high
            assert line.size == pytest.approx(3.0, rel=1e-9)  # one reading on the wrong side takes 1e-3 of it
        else:
            assert line.low <= 0.0 <= line.high and line.high - line.low < 1e-6 * np.ptp(along)


def test_an_interval_allows_for_readings_that_noise_has_put_on_the_wrong_side():
    # 16 jumps; at a true rate of 95 in 100, fewer than 13 would be covered in one of a hundred such counts
    covered, rng = 0, np.random.default_rng(11)
    for _ in range(16):
        place, x = rng.uniform(-0.4, 0.4), rng.uniform(-1.0, 1.0, (600, 2))
        force = x[:, 1] + 0.5 * x[:, 0] ** 2 + (x[:, 0] >= place) + 0.01 * rng.normal(size=600)
        (line,) = find_discontinuities(x + 0.005 * rng.normal(size=x.shape), force)
        covered += bool(line.low <= place <= line.high)
        assert line.high - line.low < 0.1
    assert covered >= 13


@pytest.mark.slow
@pytest.mark.parametrize("everywhere", [False, True])
@pytest.mark.parametrize("share", [0.0, 0.001, 0.01, 0.05])
def test_the_interval_of_a_line_covers_it_as_often_as_it_says(share, everywhere):
    covered: dict[str, list[bool]] = {"kink": [], "jump": []}
    for seed in range(20):
        states = trajectory(2000, seed=seed)
        readings = noisy(bilinear_coulomb(states), share, 100 + seed)
        for line in find_discontinuities(noisy(states, share if everywhere else 0.0, seed), readings):
            covered[line.kind].append(bool(line.low <= 0.0 <= line.high))
    for kind, found in covered.items():
        assert len(found) >= (10 if everywhere and share == 0.05 else 20), kind
        missed = len(found) - sum(found)
        assert missed <= 4, (kind, found)  # of 20, one is expected; four or fewer in 997 of 1000


# --- not found --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("share", [0.0, 0.02, 0.05])
@pytest.mark.parametrize("name", list(SMOOTH))
def test_a_smooth_map_has_no_lines(name, share):
    states = trajectory(1200) / UNITS
    force = SMOOTH[name](*states.T)
    assert find_discontinuities(noisy(states, share, 3), noisy(force, share, 4)) == ()


@pytest.mark.slow
def test_short_noisy_records_of_smooth_laws_give_no_false_alarm():
    # 60 records: at a true rate of one in a hundred, three or more would come up in two of a hundred such counts
    alarms = 0
    for seed in range(10):
        for name in ("duffing", "van_der_pol", "tanh"):
            for share in (0.01, 0.05):
                states = trajectory(600, seed=seed) / UNITS
                force = noisy(SMOOTH[name](*states.T), share, 50 + seed)
                alarms += bool(find_discontinuities(noisy(states, share, seed), force))
    assert alarms <= 2, alarms


def test_pure_noise_and_a_constant_force_have_no_lines():
    states = trajectory(800)
    for seed in range(5):
        assert find_discontinuities(states, np.random.default_rng(seed).normal(size=800)) == ()
    assert find_discontinuities(states, np.full(800, 3.0)) == ()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (dict(force=np.ones(9)), r"`force` must have one value per state, shape \(301,\); got \(9,\)"),
        (dict(states=LINE[:40], force=np.ones(40)), "at least 50 readings to tell a line from a bend; got 40"),
        (dict(directions=[[0.0]]), "`directions` must be nonzero rows of 1 numbers"),
        (dict(directions=[[1.0, 0.0]]), "`directions` must be nonzero rows of 1 numbers"),
        (dict(states=np.where(LINE > 6.5, np.nan, LINE)), "`states` must be finite"),
    ],
)
def test_a_wrong_search_is_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        find_discontinuities(**{"states": LINE, "force": example_1(LINE[:, 0]), **arguments})


def test_a_found_line_is_an_interface():
    (line,) = find_discontinuities(LINE, example_2(LINE[:, 0]))
    plane = Plane(line.normal, line.offset)
    state = jnp.array([6.5])
    assert float(line(state)) == float(plane(state)) == pytest.approx(0.5, abs=1e-9)
