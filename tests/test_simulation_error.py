"""How good a run is and whether it says so: against SciPy's motion under the same force between the samples."""

import functools

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

import jfsm
from jfsm.dynamics._agreement import PARTED, agreement
from jfsm.dynamics._reference import coarser
from jfsm.plant import excitation
from jfsm.plant._drive import reconstruct

PERIOD, DAMPING = 2 * np.pi, 0.1
TIME = PERIOD / 40 * np.arange(30 * 40)
LINK = (0, 1)
SINE = np.sin(0.97 * TIME)


def noise(top: float) -> np.ndarray:
    """Noise of unit spread up to `top` of the sample rate, periodic over the record."""
    spectrum = np.fft.rfft(np.random.default_rng(5).standard_normal(TIME.size))
    spectrum[np.fft.rfftfreq(TIME.size) > top] = 0.0
    samples = np.fft.irfft(spectrum, TIME.size)
    return samples / np.std(samples)


LAWS = {
    "cubic": (1.0, jfsm.CubicStiffness(10.0, at=LINK), lambda x: 10.0 * x**3),
    "end stop": (1.0, jfsm.EndStop(20.0, 0.8, at=LINK), lambda x: 20.0 * np.sign(x) * max(abs(x) - 0.8, 0.0)),
    "double well": (-1.0, jfsm.CubicStiffness(1.0, at=LINK), lambda x: x**3),
}


def model(name: str) -> jfsm.Structure:
    stiffness, term, _ = LAWS[name]
    return jfsm.Structure.sdof(1.0, stiffness, DAMPING) + term


@functools.cache
def converged(name: str, top: float) -> np.ndarray:
    """Displacement (n,) by SciPy, from rest, under the band-limited force between its samples."""
    stiffness, _, law = LAWS[name]
    fine = reconstruct(drive(top)[:, None], 32)[:, 0]
    between = make_interp_spline(np.linspace(TIME[0], TIME[-1], fine.size), fine, k=5)

    def rate(t, state):
        x, v = state
        return v, float(between(t)) - stiffness * x - DAMPING * v - law(x)

    step = TIME[1]
    found = solve_ivp(
        rate, (TIME[0], TIME[-1]), (0.0, 0.0), "DOP853", TIME, rtol=1e-11, atol=1e-12, max_step=step
    )  # fmt: skip
    return found.y[0]


def drive(top: float) -> np.ndarray:
    return noise(top) if top else SINE


@functools.cache
def run(name: str, top: float, solver: str = "reference") -> jfsm.dynamics.Response:
    return jfsm.simulate(model(name), jfsm.Record(TIME, drive(top), at_rest=True), solver=solver)  # pyright: ignore


SCIPY = 1e-7
"""What SciPy's own motion, and the spline between 32 values a sample, leave."""


@pytest.mark.parametrize("solver", ["reference", "grid"])
@pytest.mark.parametrize(("name", "top"), [("cubic", 0.5), ("cubic", 0.0), ("end stop", 0.0), ("double well", 0.0)])
def test_a_run_follows_the_force_between_its_samples_and_says_how_closely(name, top, solver):
    found, truth = run(name, top, solver), converged(name, top)
    parted = found.agreed_until is not None
    early = TIME <= (found.agreed_until or np.inf)
    error = np.max(np.abs(found.displacement[:, 0] - truth)[early]) / np.std(truth)
    assert found.solver == solver
    assert error < (PARTED if parted else 1e-5 if solver == "reference" else 1e-3)
    assert found.error is not None
    assert error < found.error[0] / np.std(truth) + SCIPY, "an estimate must not fall short of the error"
    assert not (parted and solver == "reference"), "none of these motions is chaotic"


def test_step_control_follows_a_kinked_motion_under_broad_noise():
    found, truth = run("end stop", 0.45), converged("end stop", 0.45)
    early = TIME <= (found.agreed_until or np.inf)
    assert np.max(np.abs(found.displacement[:, 0] - truth)[early]) < PARTED * np.std(truth)
    assert np.mean(early) > 0.4


@pytest.mark.parametrize("solver", ["reference", "grid"])
def test_a_chaotic_motion_is_called_sensitive_and_followed_up_to_the_time_that_is_said(solver):
    found, truth = run("double well", 0.2, solver), converged("double well", 0.2)
    assert found.agreed_until is not None and TIME[100] < found.agreed_until < TIME[-100]
    gap = np.abs(found.displacement[:, 0] - truth)
    before = TIME < found.agreed_until - PERIOD  # SciPy's own motion parts from the true one too
    assert np.max(gap[before]) < PARTED * np.std(truth)
    assert found.error is not None and found.error[0] > 0.5 * np.std(truth)
    assert "sensitive" in found.accuracy and f"{found.agreed_until:.6g} s" in found.accuracy


def test_a_regular_motion_is_said_to_be_good_to_its_error():
    found = run("cubic", 0.0)
    assert found.agreed_until is None and found.error is not None
    assert found.accuracy.startswith(f"The displacement is good to {found.error[0]:.2g} (")


def test_a_mass_that_friction_holds_does_not_part_from_itself():
    held = jfsm.Structure.sdof(1.0, 1.0, DAMPING) + jfsm.Coulomb(4.0, at=LINK)
    found = jfsm.simulate(held, jfsm.Record(TIME, 3.9 * SINE, at_rest=True))
    assert found.agreed_until is None
    assert found.error is not None and found.error[0] < 1e-12


def test_an_imposed_motion_has_no_error_of_a_run():
    record = jfsm.Record(TIME, displacement=SINE, force=SINE, drive="motion")
    found = jfsm.simulate(model("cubic"), record)
    assert found.error is None and found.agreed_until is None and "imposed" in found.accuracy


def test_runs_agree_until_their_difference_is_as_large_as_a_tenth_of_the_motion():
    x = np.sin(TIME)[:, None]
    near = agreement(x, x + 1e-3, 0.1, 1.0)
    assert near.parted is None
    np.testing.assert_allclose(near.error, 1e-4)
    late = agreement(x, np.where(TIME[:, None] < TIME[500], x + 1e-3, x + 0.5), 0.1, 1.0)
    assert late.parted == 500
    np.testing.assert_allclose(late.error, 0.5)
    lost = agreement(x, np.where(TIME[:, None] < TIME[500], x, np.nan), 0.1, 1.0)
    assert lost.parted == 500 and np.all(np.isfinite(lost.error)) and lost.error[0] >= np.ptp(x)


@pytest.mark.parametrize("method", ["band-limited", "linear", "hold"])
def test_a_drive_known_on_every_second_half_step_is_nearly_the_same(method):
    record = jfsm.Record(TIME, noise(0.4), base_acceleration=SINE)
    inputs = excitation(record, 1, 16, method)
    thin = coarser(inputs)
    for whole, part in ((inputs.force, thin.force), (inputs.base, thin.base)):
        np.testing.assert_allclose(part, whole, atol=1e-4)
        assert (method == "band-limited") == (np.max(np.abs(np.asarray(part - whole))) > 1e-13)


RECORD = jfsm.Record(TIME, SINE, at_rest=True)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"solver": "rk45"}, '`solver` must be "reference" or "grid"; got \'rk45\'. Leave it out'),
        ({"solver": None}, '`solver` must be "reference" or "grid"; got None'),
        *(
            (
                {"tolerance": bad},
                r"`tolerance` must be a number from 1e-14 to 0\.01: .*; got .*\. Leave it out for 1e-10",
            )
            for bad in (0.0, -1e-8, 1e-16, 1.0, np.nan, np.inf, True, "1e-8", None)
        ),
        ({"force": SINE[:-1]}, r"`force` must have one row per sample .*\(1200, 1\); got \(1199, 1\)"),
        ({"force": np.column_stack([SINE, SINE])}, r"`force` must have one row per sample .*; got \(1200, 2\)"),
        ({"force": np.nan * SINE}, "`force` must be finite"),
    ],
)
def test_a_bad_argument_is_refused_with_what_it_was_and_what_to_do(options, message):
    with pytest.raises(ValueError, match=message):
        jfsm.simulate(model("cubic"), RECORD, **options)


def test_an_imposed_motion_takes_no_force():
    record = jfsm.Record(TIME, displacement=SINE, drive="motion")
    with pytest.raises(ValueError, match='`force` must be left out where the record has drive="motion"'):
        jfsm.simulate(model("cubic"), record, force=SINE)


def test_a_given_force_drives_in_place_of_the_record_s():
    other = jfsm.Record(TIME, 0.3 * noise(0.1), at_rest=True)
    found = jfsm.simulate(model("cubic"), other, force=SINE, solver="grid")
    np.testing.assert_array_equal(found.displacement, run("cubic", 0.0, "grid").displacement)
