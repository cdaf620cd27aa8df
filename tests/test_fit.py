"""Values from records: what is found, how sure it is, and what the records cannot tell."""

import functools
from dataclasses import replace

import numpy as np
import pytest
from references import smooth_motion

import jfsm
from jfsm.identification import _nuisances
from jfsm.structures import Offset

N, DT = 300, 0.05
MASS, STIFFNESS, DAMPING, CUBIC = 1.3, 9.0, 0.3, 4.0
TRUE = {"mass@1": MASS, "stiffness@0-1.k": STIFFNESS, "damping@0-1.c": DAMPING, "cubic_stiffness@0-1.k3": CUBIC}
NOISE = 0.01
GUESS = jfsm.Structure.sdof(mass=1.0, stiffness=10.0, damping=0.2)
CUBIC_GUESS = jfsm.Structure.sdof(mass=MASS, stiffness=10.0, damping=0.2) + jfsm.CubicStiffness(2.0, at=(0, 1))


def tones(t):
    return 5.0 * np.sin(1.3 * t) + 3.0 * np.sin(2.9 * t + 0.4)


@functools.cache
def motion(cubic: float, driven: bool) -> np.ndarray:
    """Displacement (n,) by SciPy, from (1, 0)."""

    def restoring(x, v):
        return STIFFNESS * x + DAMPING * v + cubic * x**3

    def force(t):
        return np.array([tones(t) if driven else 0.0])

    return smooth_motion(MASS, restoring, force, DT * np.arange(N), 1.0, 0.0)[0][:, 0]


def measured(cubic=0.0, driven=True, n: int = N, seed: int = 0, scale: float = 1.0, offset: float = 0.0) -> jfsm.Record:
    """A record of it with 1 % noise; `scale` is that of force and displacement alike."""
    time, x = DT * np.arange(n), motion(cubic, driven)
    noisy = x + NOISE * np.std(x) * np.random.default_rng(seed).standard_normal(N) + offset
    return jfsm.Record(time, scale * tones(time) if driven else None, displacement=scale * noisy[:n])


@functools.cache
def linear_fit() -> jfsm.Fit:
    return jfsm.fit(GUESS, measured())


def assert_honest(fitted: jfsm.Fit, paths, share: float) -> None:
    """The truth lies within twice the half width of each interval (4 standard errors), and that is no wide net."""
    assert set(fitted.values) == set(paths)
    for path in paths:
        low, high = fitted.intervals[path]
        assert low < fitted.values[path] < high
        assert abs(TRUE[path] - fitted.values[path]) < high - low, path
        assert high - low < share * TRUE[path], path
        assert fitted.structure.values()[path] == fitted.values[path]


def test_a_linear_structure_is_found_within_its_intervals():
    fitted = linear_fit()
    assert fitted.result.ok
    assert_honest(fitted, ("mass@1", "stiffness@0-1.k", "damping@0-1.c"), 0.2)
    assert fitted.identifiability == ()


def test_a_cubic_spring_is_found_within_its_intervals():
    fitted = jfsm.fit(CUBIC_GUESS, measured(CUBIC), fixed=("mass",))
    assert fitted.result.ok
    assert_honest(fitted, ("stiffness@0-1.k", "damping@0-1.c", "cubic_stiffness@0-1.k3"), 0.2)


def test_the_noise_that_was_added_is_found():
    found = linear_fit().noise
    assert set(found) == {"displacement 1"}
    assert found["displacement 1"] == pytest.approx(NOISE * np.std(motion(0.0, True)), rel=0.15)


def test_a_first_guess_of_the_noise_that_is_twice_too_large_is_corrected(monkeypatch):
    honest = _nuisances.noise_floor
    monkeypatch.setattr(_nuisances, "noise_floor", lambda *args: replace(honest(*args), std=2 * honest(*args).std))
    found = jfsm.fit(GUESS, measured()).noise["displacement 1"]
    assert found == pytest.approx(NOISE * np.std(motion(0.0, True)), rel=0.15)


def test_the_fit_reproduces_the_record_to_its_noise():
    fitted, record = linear_fit(), measured()
    run = jfsm.simulate(fitted.structure, record)
    error = run.displacement[:, 0] - record.channels["displacement", 1]
    assert np.std(error) < 1.3 * fitted.noise["displacement 1"]


def test_units_of_force_and_displacement_together_leave_the_values_as_they_are():
    scaled = jfsm.fit(GUESS, measured(scale=1000.0))
    for path, value in linear_fit().values.items():
        assert scaled.values[path] == pytest.approx(value, rel=1e-3)
    assert scaled.noise["displacement 1"] == pytest.approx(1000 * linear_fit().noise["displacement 1"], rel=1e-3)


@pytest.mark.parametrize("fixed", ["mass", ("mass",), ["mass@1"]])
def test_what_is_fixed_stays_and_is_not_reported_as_found(fixed):
    fitted = jfsm.fit(jfsm.Structure.sdof(MASS, 10.0, 0.2), measured(), fixed=fixed)
    assert fitted.structure.values()["mass@1"] == MASS
    assert_honest(fitted, ("stiffness@0-1.k", "damping@0-1.c"), 0.2)
    assert set(fitted.correlations) == {("damping@0-1.c", "stiffness@0-1.k")}


def test_what_is_known_of_one_value_makes_the_others_surer():
    known = jfsm.fit(jfsm.Structure.sdof(MASS, 10.0, 0.2), measured(), fixed="mass")
    free, held = (np.ptp(f.intervals["stiffness@0-1.k"]) for f in (linear_fit(), known))
    assert held < 0.8 * free


def test_a_value_stays_within_its_bounds_and_says_when_it_ends_there():
    fitted = jfsm.fit(GUESS, measured(), bounds={"stiffness": (9.5, 12.0)})
    assert fitted.values["stiffness@0-1.k"] == pytest.approx(9.5, rel=1e-9)
    assert "stiffness@0-1.k ends at its bound 9.5." in fitted.identifiability
    assert fitted.intervals["stiffness@0-1.k"][0] == pytest.approx(9.5, rel=1e-9)


def test_bounds_that_hold_the_truth_change_nothing():
    fitted = jfsm.fit(GUESS, measured(), bounds={"stiffness@0-1.k": (5.0, 20.0), "mass": (0.5, 2.0)})
    for path, value in linear_fit().values.items():
        assert fitted.values[path] == pytest.approx(value, rel=1e-4)


def test_two_records_of_unequal_length_say_more_than_either():
    first, second = measured(), measured(n=265, seed=1)
    both = jfsm.fit(GUESS, [first, second])
    assert_honest(both, ("mass@1", "stiffness@0-1.k", "damping@0-1.c"), 0.2)
    alone = jfsm.fit(GUESS, second)
    for path, interval in both.intervals.items():
        assert np.ptp(interval) < min(np.ptp(linear_fit().intervals[path]), np.ptp(alone.intervals[path]))


def test_the_order_of_the_records_does_not_matter():
    records = [measured(), measured(n=265, seed=1)]
    found = [jfsm.fit(GUESS, pair).values for pair in (records, records[::-1])]
    for path, value in found[0].items():
        assert found[1][path] == pytest.approx(value, rel=1e-4)


def test_a_free_decay_holds_the_mass_and_finds_the_rest_relative_to_it():
    fitted = jfsm.fit(jfsm.Structure.sdof(MASS, 10.0, 0.2), measured(driven=False))
    assert fitted.structure.values()["mass@1"] == MASS
    assert_honest(fitted, ("stiffness@0-1.k", "damping@0-1.c"), 0.2)


def test_two_springs_side_by_side_cannot_be_told_apart():
    model = jfsm.Structure.sdof(MASS, 6.0, 0.2) + jfsm.LinearStiffness(4.0, at=(0, 1))
    (words,) = (
        words
        for words in jfsm.fit(model, measured(), fixed="mass").identifiability
        if "cannot be told apart by this record" in words
    )
    assert "stiffness@0-1.k#2 and stiffness@0-1.k" in words


def test_a_law_that_is_not_there_is_called_hardly_determined():
    fitted = jfsm.fit(CUBIC_GUESS, measured(), fixed="mass")
    low, high = fitted.intervals["cubic_stiffness@0-1.k3"]
    assert low < 0.0 < high
    assert any(
        words.startswith("cubic_stiffness@0-1.k3 is hardly determined by this record")
        for words in fitted.identifiability
    )


def test_an_offset_of_a_channel_is_carried_along_and_kept_only_if_it_is_there():
    assert not linear_fit().structure.sensors
    offset = 0.2 * float(np.std(motion(0.0, True)))
    fitted = jfsm.fit(GUESS, measured(offset=offset))
    found = fitted.structure.values()
    assert found["offset@displacement-1.b"] == pytest.approx(offset, rel=0.2)
    assert all(isinstance(sensor, Offset) for sensor in fitted.structure.sensors)
    assert_honest(fitted, ("mass@1", "stiffness@0-1.k", "damping@0-1.c"), 0.2)


def test_the_structure_carries_the_offset_of_the_first_record_whatever_the_others_have():
    offset = 0.2 * float(np.std(motion(0.0, True)))
    with_it, without = measured(offset=offset), measured(seed=1)
    kept = jfsm.fit(GUESS, [with_it, without]).structure.values()
    assert kept["offset@displacement-1.b"] == pytest.approx(offset, rel=0.2)
    assert "offset@displacement-1.b" not in jfsm.fit(GUESS, [without, with_it]).structure.values()


TIME = DT * np.arange(100)


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        ((GUESS, measured()), {"fixed": ("weight",)}, "`fixed` names 'weight', which the structure does not have; it"),
        ((GUESS, measured()), {"bounds": {"k": (1.0, 2.0)}}, "`bounds` names 'k', which the structure does not have"),
        ((GUESS, measured()), {"bounds": {"mass": (2.0, 1.0)}}, r"`bounds` of 'mass' must be \(low, high\) with low <"),
        ((GUESS, measured()), {"bounds": {"mass": (-2.0, -1.0)}}, "`bounds` of 'mass' must leave room for a positive"),
        ((GUESS, []), {}, "`record` must hold at least one record; the sequence is empty"),
        ((GUESS, jfsm.Record(TIME, tones(TIME))), {}, r"`record` must hold a response \(displacement, velocity or acc"),
        ((GUESS, measured(n=31)), {}, "`record` must hold at least 32 samples to tell noise from motion; it has 31"),
        ((GUESS, jfsm.Record(TIME, tones(TIME), np.ones(100))), {}, "nothing was measured there. Leave a dead channel"),
        ((GUESS, jfsm.Record(TIME, {2: tones(TIME)}, tones(TIME))), {}, "`record` names degree of freedom 2; the str"),
        ((jfsm.Structure([0.0]), measured()), {}, "`mass` must be positive for the structure to move"),
        ((GUESS, measured()), {"reconstruction": "cubic"}, '`reconstruction` must be "band-limited", "linear" or "ho'),
    ],
)
def test_what_cannot_be_fitted_is_refused_with_the_reason(arguments, options, message):
    with pytest.raises(ValueError, match=message):
        jfsm.fit(*arguments, **options)


def test_a_spring_between_two_masses_on_a_moving_base_is_found_from_accelerations():
    t = 0.04 * np.arange(1500)
    mass, springs, dashpots, cubic = np.array([1.0, 0.7]), (60.0, 40.0), (0.5, 0.4), 900.0

    def base(s):
        return 6.0 * np.sin(3.1 * s) + 5.0 * np.sin(7.3 * s + 1.0) + 4.0 * np.sin(11.9 * s + 2.0)

    def restoring(x, v):
        d, w = x[1] - x[0], v[1] - v[0]
        between = springs[1] * d + dashpots[1] * w + cubic * d**3
        return np.array([springs[0] * x[0] + dashpots[0] * v[0] - between, between])

    def force(s):
        return -mass * base(s)

    x, v = smooth_motion(np.diag(mass), restoring, force, t, np.zeros(2), np.zeros(2), tolerance=1e-8)
    relative = np.array([-base(s) - restoring(x[i], v[i]) / mass for i, s in enumerate(t)])
    rng = np.random.default_rng(5)
    absolute = relative + base(t)[:, None]
    record = jfsm.Record(
        t,
        acceleration=absolute + 0.01 * absolute.std(0) * rng.standard_normal(absolute.shape),
        base_acceleration=base(t),
        at_rest=True,
    )
    guess = jfsm.Structure.chain(mass, [62.0, 38.0], [0.4, 0.5]) + jfsm.CubicStiffness(100.0, at=(1, 2))
    found = jfsm.fit(guess, record, fixed=("mass",))
    truth = {"stiffness@0-1.k": 60.0, "stiffness@1-2.k": 40.0, "damping@0-1.c": 0.5, "cubic_stiffness@1-2.k3": 900.0}
    for path, value in truth.items():
        low, high = found.intervals[path]
        assert abs(found.values[path] - value) < high - low, path
        assert high - low < 0.2 * value, path


def test_two_stiffnesses_that_only_their_difference_is_known_of_are_said_to_be_so():
    t = np.arange(2000) * 0.05
    force = 4 * np.sin(0.9 * t) + 2 * np.sin(2.3 * t + 1)
    wells = jfsm.Structure.sdof(1.0, 4.0, 0.2) + jfsm.DoubleWell(6.0, 3.0, at=(0, 1))
    run = jfsm.simulate(wells, jfsm.Record(t, force), (0.8, 0.0))
    rng = np.random.default_rng(5)
    x = run.displacement[:, 0]
    record = jfsm.Record(t, force, x + 0.005 * np.std(x) * rng.standard_normal(x.size))
    words = jfsm.fit(wells, record, fixed="mass").identifiability
    tied = [w for w in words if "cannot be told apart" in w]
    assert len(tied) == 1 and "double_well@0-1.k_neg - stiffness@0-1.k can" in tied[0]


def test_steps_follow_a_spring_that_hardens_many_times_over():
    """At the peaks of the decay its frequency is ten times that of small motions."""
    time = np.arange(600) * 0.1
    x, _ = smooth_motion(1.0, lambda x, v: x + 0.02 * v + 8.0 * x**3, lambda t: np.zeros(1), time, 2.0, 0.0)
    x = x[:, 0] + 1e-3 * x.std() * np.random.default_rng(0).standard_normal(time.size)
    model = jfsm.Structure.sdof(1.0, 1.0, 0.02) + jfsm.CubicStiffness(7.0, at=(0, 1))
    found = jfsm.fit(model, jfsm.Record(time, displacement=x), fixed=["mass"])
    assert found.values["stiffness@0-1.k"] == pytest.approx(1.0, abs=0.03)
    assert found.values["cubic_stiffness@0-1.k3"] == pytest.approx(8.0, abs=0.03)
