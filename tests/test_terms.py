"""Laws: their force, the rate of what they remember, their limits, their derivatives, and their natural sizes."""

import inspect

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jfsm
from jfsm.structures import AbstractFriction, Scale
from jfsm.structures.terms import TERMS

STATES = [(d, w) for d in (-1.3, -0.2, 0.0, 0.15, 0.7) for w in (-2.1, -0.1, 0.0, 0.4)]
T = 0.8


def dz(d, gap):
    return np.sign(d) * max(abs(d) - gap, 0.0)


def falling(F, F_static, v_s, w):
    return F + (F_static - F) * np.exp(-((w / v_s) ** 2))


def slips(slip, chi):
    return slip * ((np.arange(16) + 0.5) / 16) ** (1 / (1 + chi))


# kind -> numbers, force(d, w, z, t), rate of z, a z to ask at
LAWS = {
    "stiffness": ((2.5,), lambda d, w, z: 2.5 * d),
    "damping": ((2.5,), lambda d, w, z: 2.5 * w),
    "cubic_stiffness": ((-2.5,), lambda d, w, z: -2.5 * d**3),
    "quadratic_stiffness": ((2.5,), lambda d, w, z: 2.5 * d**2),
    "quintic_stiffness": ((2.5,), lambda d, w, z: 2.5 * d**5),
    "square_stiffness": ((2.5,), lambda d, w, z: 2.5 * d * abs(d)),
    "double_well": ((2.0, 3.0), lambda d, w, z: -2.0 * d + 3.0 * d**3),
    "sine_stiffness": ((2.0, 1.5), lambda d, w, z: 2.0 / 1.5 * np.sin(1.5 * d)),
    "cosine_stiffness": ((2.0, 1.5), lambda d, w, z: 2.0 / 1.5 * np.cos(1.5 * d)),
    "bilinear_stiffness": ((2.0, -0.1, -1.0), lambda d, w, z: -2.0 * max(-0.1 - d, 0.0)),
    "dead_zone": ((2.0, 0.2), lambda d, w, z: -2.0 * (d - dz(d, 0.2))),
    "end_stop": ((2.0, 0.2), lambda d, w, z: 2.0 * dz(d, 0.2)),
    "saturation": ((2.0, 0.2), lambda d, w, z: -2.0 * dz(d, 0.2)),
    "damped_stop": ((2.0, 0.2, 0.8), lambda d, w, z: 2.0 * dz(d, 0.2) * max(1 + 0.8 * w * np.sign(d), 0.0)),
    "coulomb": ((2.5,), lambda d, w, z: 2.5 * np.sign(w)),
    "coulomb_asymmetric": ((2.5, 1.0), lambda d, w, z: 2.5 if w > 0 else -1.0 if w < 0 else 0.0),
    "stribeck": ((1.0, 1.6, 0.3), lambda d, w, z: np.sign(w) * falling(1.0, 1.6, 0.3, w)),
    "smooth_coulomb": ((2.0, 0.3), lambda d, w, z: 2.0 * np.tanh(w / 0.3)),
    "quadratic_damping": ((2.0,), lambda d, w, z: 2.0 * w * abs(w)),
    "cubic_damping": ((2.0,), lambda d, w, z: 2.0 * w**3),
    "power_damping": ((2.0, 0.4), lambda d, w, z: 2.0 * np.sign(w) * abs(w) ** 0.4),
    "bilinear_damping": ((2.0, -1.0), lambda d, w, z: 2.0 * w if w < 0 else 0.0),
    "van_der_pol": ((2.0, 0.5), lambda d, w, z: 2.0 * ((d / 0.5) ** 2 - 1) * w),
    "position_damping": ((2.0,), lambda d, w, z: 2.0 * d**2 * w),
    "bouc_wen": ((2.0, 1.1, -0.4, 1.5), lambda d, w, z: 2.0 * z[0]),
    "jenkins": ((2.0, 0.3), lambda d, w, z: 2.0 * z[0]),
    "iwan": ((2.0, 0.3, -0.5), lambda d, w, z: 2.0 * np.mean(z)),
    "lugre": ((1.0, 1.6, 0.3, 50.0, 0.3), lambda d, w, z: 50.0 * z[0] + 0.3 * RATES["lugre"](d, w, z)[0]),
    "free_play": ((5.0, 0.1, 0.8, 0.5), lambda d, w, z: np.clip(5.0 * dz(d - z[0], 0.1), -0.5, 0.8)),
    "maxwell": ((2.0, 0.4), lambda d, w, z: 2.0 * z[0]),
    "attached_oscillator": ((0.3, 4.0, 0.05), lambda d, w, z: 0.3 * (16 * (d - z[0]) + 2 * 0.05 * 4 * (w - z[1]))),
    "elastic_joint": ((40.0, 0.2, 0.3), lambda d, w, z: 40 * (d - z[0]) + 0.2 * (w - z[1])),
    "delayed_force": ((-2.0, 0.1), lambda d, w, z: -2.0 * d),
    "stiffness_drift": ((2.0, 0.3), lambda d, w, z: 2.0 * (T - 0.3) * d),
    "damping_drift": ((2.0, 0.3), lambda d, w, z: 2.0 * (T - 0.3) * w),
    "stiffness_drop": ((2.0, 0.7), lambda d, w, z: -2.0 * d),
    "parametric_stiffness": ((2.0, 3.0, 0.2), lambda d, w, z: 2.0 * np.cos(3 * T + 0.2) * d),
    "ripple": ((2.0, 12.0, 0.4), lambda d, w, z: 2.0 * np.sin(12.0 * d + 0.4)),
    "preload": ((2.0,), lambda d, w, z: -2.0),
    "periodic_disturbance": ((2.0, 3.0, 0.2), lambda d, w, z: -2.0 * np.cos(3 * T + 0.2)),
}
RATES = {
    "bouc_wen": lambda d, w, z: [w - 1.1 * abs(w) * abs(z[0]) ** 0.5 * z[0] + 0.4 * w * abs(z[0]) ** 1.5],
    "jenkins": lambda d, w, z: [0.0 if abs(z[0]) >= 0.3 and z[0] * w > 0 else w],
    "iwan": lambda d, w, z: [0.0 if abs(s) >= m and s * w > 0 else w for s, m in zip(z, slips(0.3, -0.5), strict=True)],
    "lugre": lambda d, w, z: [w - 50.0 * abs(w) * z[0] / falling(1.0, 1.6, 0.3, w)],
    "free_play": lambda d, w, z: [
        w if (5 * dz(d - z[0], 0.1) >= 0.8 and w > 0) or (5 * dz(d - z[0], 0.1) <= -0.5 and w < 0) else 0.0
    ],
    "maxwell": lambda d, w, z: [w - z[0] / 0.4],
    "attached_oscillator": lambda d, w, z: [z[1], 16 * (d - z[0]) + 2 * 0.05 * 4 * (w - z[1])],
    "elastic_joint": lambda d, w, z: [z[1], (40 * (d - z[0]) + 0.2 * (w - z[1])) / 0.3],
}
HIDDEN = {
    "iwan": [slips(0.3, -0.5) * s for s in (-1.0, 0.0, 0.6)],
    "attached_oscillator": [(0.1, -0.3), (0.0, 0.0)],
    "elastic_joint": [(0.1, -0.3), (0.0, 0.0)],
}
SCALE = Scale(force=3.0, length=0.02, peak=0.0282, omega=40.0, begin=5.0, end=15.0)


def build(law):
    return law(*LAWS[law.kind][0], at=(0, 1))


def hidden_states(law):
    if not law.states:
        return [np.zeros(0)]
    return [np.atleast_1d(z).astype(float) for z in HIDDEN.get(law.kind, (-0.25, 0.0, 0.1, 0.3))]


@pytest.mark.parametrize("law", TERMS, ids=lambda law: law.kind)
def test_every_law_has_the_force_and_the_memory_of_the_catalogue(law):
    term = build(law)
    for z in hidden_states(law):
        for d, w in STATES:
            state = (jnp.asarray(d), jnp.asarray(w), jnp.asarray(z), jnp.asarray(T))
            assert float(term.force(*state)) == pytest.approx(LAWS[law.kind][1](d, w, z), abs=1e-13)
            if law.states:
                np.testing.assert_allclose(term.state_rate(*state), RATES[law.kind](d, w, z), rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("law", [law for law in TERMS if issubclass(law, AbstractFriction)], ids=lambda law: law.kind)
def test_friction_at_rest_is_bounded_by_its_limits_on_both_sides(law):
    zero = jnp.asarray(0.0)
    low, high = build(law).limits(zero, zero, (), zero)
    expected = {"coulomb": (-2.5, 2.5), "coulomb_asymmetric": (-1.0, 2.5), "stribeck": (-1.6, 1.6)}[law.kind]
    assert (float(low), float(high)) == pytest.approx(expected)


@pytest.mark.parametrize("law", TERMS, ids=lambda law: law.kind)
def test_the_derivatives_of_a_law_are_those_of_finite_differences(law):
    term, h = build(law), 1e-6
    z = hidden_states(law)[0] * 0.9
    state = (jnp.asarray(0.35), jnp.asarray(-0.6), jnp.asarray(z), jnp.asarray(T))

    def force(numbers, d, w):
        return law(*numbers, at=(0, 1)).force(d, w, *state[2:])

    numbers = jnp.asarray([float(v) for v in term.values])
    slopes = jax.jacfwd(force, argnums=(0, 1, 2))(numbers, *state[:2])
    free = [p.free and p.name != "t_star" for p in law.parameters]  # a jump has no slope
    for i, wanted in enumerate(free):
        if wanted:
            step = h * max(1.0, abs(float(numbers[i])))
            up, down = (force(numbers.at[i].add(s), *state[:2]) for s in (step, -step))
            assert float(slopes[0][i]) == pytest.approx(float(up - down) / (2 * step), rel=1e-5, abs=1e-6)
    for k, slope in ((0, slopes[1]), (1, slopes[2])):
        up, down = ([*state[:2]], [*state[:2]])
        up[k], down[k] = up[k] + h, down[k] - h
        difference = float(force(numbers, *up) - force(numbers, *down)) / (2 * h)
        assert float(slope) == pytest.approx(difference, rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("law", TERMS, ids=lambda law: law.kind)
def test_every_natural_shape_has_a_force_of_the_size_of_the_elastic_one(law):
    time = jnp.linspace(SCALE.begin, SCALE.end, 40_000)
    phase = SCALE.omega * time
    d, w = SCALE.length * 2**0.5 * jnp.cos(phase), -SCALE.length * 2**0.5 * SCALE.omega * jnp.sin(phase)
    shapes = law.shapes(SCALE)
    assert shapes
    for numbers in shapes[:: max(1, len(shapes) // 20)]:
        assert list(numbers) == [p.name for p in law.parameters]
        term = law(**numbers, at=(0, 1))
        if law.states:
            force = driven_force(term, d, w, time)
        else:
            force = jax.vmap(lambda d, w, t, term=term: term.force(d, w, (), t))(d, w, time)
        assert 0.005 * SCALE.force < float(jnp.sqrt(jnp.mean(force**2))) < 30 * SCALE.force


def test_all_numbers_that_hold_a_force_scale_together():
    z, t = jnp.asarray([0.004, 0.1]), jnp.asarray(7.0)
    for law in TERMS:
        if law.kind in ("free_play", "iwan"):  # their hidden states are no free choice
            continue
        numbers = law.shapes(SCALE)[0]
        doubled = {p.name: numbers[p.name] * (2.0 if p.force else 1.0) for p in law.parameters}
        d, w = jnp.asarray(0.013), jnp.asarray(-0.6)
        once, twice = (law(**n, at=(0, 1)).force(d, w, z[: law.states], t) for n in (numbers, doubled))
        assert float(twice) == pytest.approx(2 * float(once), rel=1e-12)


@pytest.mark.parametrize("law", [law for law in TERMS if law.states], ids=lambda law: law.kind)
def test_what_is_settled_stays_where_it_is(law):
    term = build(law)
    for z in hidden_states(law):
        once = term.settle(jnp.asarray(0.4), jnp.asarray(3 * z))
        np.testing.assert_array_equal(term.settle(jnp.asarray(0.4), once), once)


@pytest.mark.parametrize(("law", "numbers", "message"), [
    (jfsm.Coulomb, (-1.0,), "`F` of coulomb must not be negative; got -1"),
    (jfsm.Stribeck, (1.0, 2.0, 0.0), "`v_s` of stribeck must be positive; got 0"),
    (jfsm.EndStop, (1.0, -0.1), "`gap` of end_stop must not be negative; got -0.1"),
    (jfsm.Maxwell, (1.0, 0.0), "`tau` of maxwell must be positive; got 0"),
    (jfsm.BoucWen, (1.0, 1.0, 1.0, -1.0), "`n` of bouc_wen must be positive; got -1"),
])  # fmt: skip
def test_a_number_that_cannot_be_is_refused(law, numbers, message):
    with pytest.raises(ValueError, match=message):
        law(*numbers, at=(0, 1))


def test_an_elastic_joint_parts_a_mass():
    with pytest.raises(ValueError, match=r"`at` of elastic_joint must be \(0, j\), the mass that is not one; got"):
        jfsm.ElasticJoint(40.0, 0.2, 0.3, at=(1, 2))


def test_an_attached_oscillator_hangs_on_a_mass():
    with pytest.raises(ValueError, match=r"`at` of attached_oscillator must be \(0, j\), the mass it hangs on; got"):
        jfsm.AttachedOscillator(0.1, 4.0, 0.02, at=(1, 2))


def test_every_law_of_the_library_is_public_and_says_what_it_is():
    for law in TERMS:
        assert getattr(jfsm, law.__name__) is law
        assert inspect.getdoc(law)
        assert all(p.meaning for p in law.parameters)


@eqx.filter_jit
def driven_force(term, d, w, time):
    h = time[1] - time[0]

    def step(z, inputs):
        d, w, t = inputs
        rate = term.state_rate(d, w, z, t)
        middle = term.state_rate(d + h / 2 * w, w, z + h / 2 * rate, t)
        return term.settle(d + h * w, z + h * middle), term.force(d, w, z, t)

    return jax.lax.scan(step, term.initial_state(d[0], w[0]), (d, w, time))[1]
