"""Periodic response: closed forms, time integration, folds, and normal modes against amplitude."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipk

import jfsm
from jfsm._result import Result
from jfsm.dynamics import backbone, forced_response

LINK = (0, 1)
M, K, C, K3, F = 1.3, 9.0, 0.12, 10.0, 1.0
LINEAR = jfsm.Structure.sdof(M, K, C)
DUFFING = LINEAR + jfsm.CubicStiffness(K3, at=LINK)
RANGE = (0.5, 8.0)


def imbalance(omega, size):
    """Of x = A cos(ωt - φ) in a Duffing oscillator with one harmonic, zero on its curve."""
    return ((K - M * omega**2 + 0.75 * K3 * size**2) ** 2 + (C * omega) ** 2) * size**2 - F**2


def closed_form_folds() -> np.ndarray:
    """Frequencies at which the one-harmonic curve turns: imbalance = 0 and its slope in A = 0."""

    def elimination(omega, sign):
        # Slope in A² zero: s² + 2 s q + ... with q = k - mω², s = ¾ k3 A²: 3 s² + 4 q s + q² + (cω)² = 0.
        q = K - M * omega**2
        s = (-2 * q + sign * np.sqrt(q**2 - 3 * (C * omega) ** 2)) / 3
        return imbalance(omega, np.sqrt(s / (0.75 * K3)))

    return np.array([brentq(elimination, 2.8, 7.0, args=(sign,), xtol=1e-14) for sign in (1, -1)])


def test_a_linear_structure_responds_as_its_transfer_function():
    model = jfsm.Structure.chain([1.0, 2.0], [12.0, 24.0], [0.04, 0.03])
    found = forced_response(model, 2.0, at=2, frequencies=(0.5, 9.0), harmonics=2)
    linear = jfsm.linearise(model)
    omega = found.frequency[:, None, None]
    dynamic = linear.stiffness[None] - omega**2 * linear.mass[None] + 1j * omega * linear.damping[None]
    true = np.linalg.solve(dynamic, np.broadcast_to(np.array([[0.0], [2.0]]), (len(omega), 2, 1)))[..., 0]
    np.testing.assert_allclose(found.amplitude * np.exp(-1j * found.phase), true, rtol=1e-8, atol=1e-12)
    assert found.result.ok and np.all(found.stable) and found.folds.size == 0
    assert (found.frequency[0], found.frequency[-1]) == pytest.approx((0.5, 9.0), rel=1e-14)


def test_with_one_harmonic_a_duffing_oscillator_lies_on_its_closed_form_and_turns_at_its_folds():
    found = forced_response(DUFFING, F, frequencies=RANGE, harmonics=1)
    assert found.result.ok
    assert np.max(np.abs(imbalance(found.frequency, found.amplitude[:, 0]))) < 1e-9
    np.testing.assert_allclose(found.frequency[found.folds], closed_form_folds(), rtol=1e-9)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(found.frequency)))) + 1
    np.testing.assert_array_equal(turns, found.folds)


def test_the_phase_passes_a_quarter_of_a_period_at_the_peak():
    found = forced_response(DUFFING, F, frequencies=RANGE, harmonics=1)
    cosine = (K - M * found.frequency**2 + 0.75 * K3 * found.amplitude[:, 0] ** 2) * found.amplitude[:, 0] / F
    np.testing.assert_allclose(np.cos(found.phase[:, 0]), cosine, atol=1e-9)
    assert np.all((found.phase >= 0) & (found.phase < 2 * np.pi))


def test_between_the_folds_the_response_is_unstable_and_elsewhere_stable():
    found = forced_response(DUFFING, F, frequencies=(2.5, 8.0))
    first, last = found.folds
    assert not np.any(found.stable[first + 1 : last])
    assert np.all(found.stable[: first - 1]) and np.all(found.stable[last + 2 :])


def integrated(omega: float, start: np.ndarray, samples: int) -> np.ndarray:
    """Displacement over the 200th period, when what is not periodic has died out to 1e-8."""
    time = 2 * np.pi / omega * (199 + np.arange(samples) / samples)
    run = solve_ivp(
        lambda t, y: (y[1], (F * np.cos(omega * t) - K * y[0] - K3 * y[0] ** 3 - C * y[1]) / M),
        (0.0, time[-1]),
        start,
        "DOP853",
        t_eval=time,
        rtol=1e-11,
        atol=1e-12,
    )
    return run.y[0]


def test_more_harmonics_come_closer_to_time_integration():
    omega, errors = 2.0, []
    for harmonics in (1, 3, 7):
        found = forced_response(DUFFING, F, frequencies=(1.8, omega), harmonics=harmonics)
        motion = found.motion(-1, samples=64)[:, 0]
        if harmonics == 1:
            velocity = omega * found.coefficients[-1, 2, 0]
            true = integrated(omega, np.array([motion[0], velocity]), 64)
        errors.append(np.max(np.abs(motion - true)) / np.ptp(true))
    assert errors[0] > 1e-3
    assert errors[1] < errors[0] / 20 and errors[2] < errors[1] / 100
    assert errors[2] < 1e-9


def test_an_asymmetric_spring_shifts_the_mean():
    model = LINEAR + jfsm.QuadraticStiffness(3.0, at=LINK)
    found = forced_response(model, 0.1, frequencies=(1.0, 1.5))
    mean, size = found.coefficients[:, 0, 0], found.amplitude[:, 0]
    np.testing.assert_allclose(mean, -3.0 * size**2 / (2 * K), rtol=0.02)  # second order of the amplitude


def test_about_a_well_a_double_well_responds_with_the_stiffness_there():
    model = jfsm.Structure.sdof(1.0, -9.0, 0.12) + jfsm.CubicStiffness(10.0, at=LINK)
    well = jfsm.fixed_points(model)[2].state[:1]
    found = forced_response(model, 1e-4, frequencies=(1.0, 8.0), around=well)
    peak = np.argmax(found.amplitude[:, 0])
    assert found.frequency[peak] == pytest.approx(np.sqrt(18.0), rel=2e-3)
    np.testing.assert_allclose(found.coefficients[:, 0, 0], well[0], rtol=1e-4)


def test_a_curve_that_runs_out_of_points_says_so():
    found = forced_response(DUFFING, F, frequencies=RANGE, harmonics=1, max_points=20)
    assert found.result is Result.unfinished and len(found.frequency) == 20
    assert "before the range" in found.result.value


def test_the_range_is_that_of_the_natural_frequencies_when_none_is_given():
    found = forced_response(LINEAR, F, harmonics=1)
    natural = np.sqrt(K / M)
    assert (found.frequency[0], found.frequency[-1]) == pytest.approx((0.2 * natural, 2 * natural))


def test_the_backbone_of_a_duffing_oscillator_is_the_elliptic_integral():
    sizes = np.linspace(0.05, 2.0, 8)
    found = backbone(DUFFING, sizes, harmonics=15)
    square, modulus = (K + K3 * sizes**2) / M, K3 * sizes**2 / 2 / (K + K3 * sizes**2)
    np.testing.assert_allclose(found.frequency, np.pi * np.sqrt(square) / 2 / ellipk(modulus), rtol=1e-10)
    np.testing.assert_allclose(found.coefficients[:, 1::2, 0].sum(1), sizes, rtol=1e-10)
    assert found.result.ok


def test_with_one_harmonic_the_backbone_passes_through_the_peak_of_light_damping():
    response = forced_response(LINEAR + jfsm.CubicStiffness(K3, at=LINK), F, frequencies=RANGE, harmonics=1)
    size = float(np.max(response.amplitude))
    peak = response.frequency[np.argmax(response.amplitude[:, 0])]
    (omega,) = backbone(DUFFING, [size], harmonics=1).frequency
    assert omega == pytest.approx(peak, rel=1e-3)


def test_each_mode_of_a_linear_chain_keeps_its_frequency():
    model = jfsm.Structure.chain([1.0, 2.0], [120.0, 240.0], [0.4, 0.3])
    natural = jfsm.linearise(jfsm.Structure.chain([1.0, 2.0], [120.0, 240.0])).frequencies
    for mode in (1, 2):
        found = backbone(model, [0.1, 1.0], mode=mode, at=2, harmonics=2)
        np.testing.assert_allclose(found.frequency, natural[mode - 1], rtol=1e-10)


FORCED_REFUSED = {
    "amplitude": ({"amplitude": 0.0}, "`amplitude` must be positive; got 0.0"),
    "harmonics": ({"harmonics": 0}, "`harmonics` must be positive; got 0"),
    "at": ({"at": 2}, "`at` must be a degree of freedom from 1 to 1; got 2"),
    "order": ({"frequencies": (3.0, 1.0)}, "`frequencies` must be positive, low below high"),
    "pair": ({"frequencies": 3.0}, r"`frequencies` must be a pair \(low, high\) in rad/s; got 3.0"),
    "around": ({"around": [0.0, 1.0]}, r"`around` must hold one displacement per degree of freedom \(1\); got 2"),
}


@pytest.mark.parametrize("name", FORCED_REFUSED)
def test_a_wrong_argument_of_a_forced_response_is_named(name):
    options, message = FORCED_REFUSED[name]
    with pytest.raises(ValueError, match=message):
        forced_response(DUFFING, **{"amplitude": F, **options})


BACKBONE_REFUSED = {
    "descending": (DUFFING, {"amplitudes": [1.0, 0.5]}, "`amplitudes` must be positive and ascend"),
    "mode": (DUFFING, {"mode": 2}, "`mode` must be a degree of freedom from 1 to 1; got 2"),
    "unstable": (jfsm.Structure.sdof(1.0, -9.0), {}, "mode 1 has ω² = -9.*Say by `around`"),
    "still": (jfsm.Structure.chain([1.0, 1.0], [4.0, 0.0]), {"mode": 2, "at": 2}, "stands still in mode 2"),
}


@pytest.mark.parametrize("name", BACKBONE_REFUSED)
def test_a_wrong_argument_of_a_backbone_is_named(name):
    model, options, message = BACKBONE_REFUSED[name]
    with pytest.raises(ValueError, match=message):
        backbone(model, **{"amplitudes": [1.0], **options})


def test_a_start_that_no_periodic_motion_leads_to_is_refused():
    falling = jfsm.Structure.sdof(1.0, 1.0, 0.01) + jfsm.CubicStiffness(-100.0, at=LINK)
    with pytest.raises(RuntimeError, match="No periodic motion was found at the lowest of `frequencies`, 0.5 rad/s"):
        forced_response(falling, 50.0, frequencies=(0.5, 2.0))


def test_friction_that_sticks_is_refused():
    with pytest.raises(ValueError, match="must hold no friction that sticks: coulomb@0-1"):
        forced_response(DUFFING + jfsm.Coulomb(1.0, at=LINK), F)
