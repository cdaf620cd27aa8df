"""Where a search begins: shapes that explain the missing force, for one law and for two."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from references import driven_readings, three_tones
from scipy.integrate import solve_ivp

import jfsm
from jfsm.estimation import Latent
from jfsm.identification import about_a_rest, missing_force, place, prepare, scale_of, starts
from jfsm.plant import force_along, forces_of_law, lower, starting_state

T = np.arange(1200) * 0.06
MODEL = jfsm.Structure.sdof(1.0, 9.0, 0.3)


def record(law) -> jfsm.Record:
    return jfsm.Record(T, *driven_readings(law, T), at_rest=True)


def test_the_first_start_is_near_the_truth_wherever_the_search_stood():
    def stop(x, v):
        return 12.0 * np.sign(x) * np.maximum(np.abs(x) - 0.8, 0.0)

    r = record(stop)
    wrong = MODEL + jfsm.EndStop(1.0, 0.05, at=(0, 1))
    best = starts(wrong, prepare(r, wrong))[0].values()
    assert best["end_stop@0-1.gap"] == pytest.approx(0.8, rel=0.3)
    assert best["end_stop@0-1.k"] == pytest.approx(12.0, rel=0.5)
    assert {p: v for p, v in best.items() if "end_stop" not in p} == MODEL.values()


def timed(force) -> jfsm.Record:
    """A record with a force that depends on time and displacement, known by all channels."""

    def motion(t, y):
        return [y[1], three_tones(t) - 9.0 * y[0] - 0.3 * y[1] - force(t, y[0])]

    x, v = solve_ivp(motion, (0, T[-1]), [0.0, 0.0], t_eval=T, rtol=1e-9, atol=1e-12).y
    rng = np.random.default_rng(9)
    noisy = [y + 0.01 * np.std(y) * rng.standard_normal(T.size) for y in (three_tones(T), x, v)]
    return jfsm.Record(T, noisy[0], noisy[1], noisy[2], at_rest=True)


@pytest.mark.parametrize("phase", [0.7, 2.4, 3.9, 5.6])
@pytest.mark.parametrize("term", [
    jfsm.PeriodicDisturbance(1.0, 1.0, 0.0, at=(0, 1)), jfsm.ParametricStiffness(1.0, 1.0, 0.0, at=(0, 1)),
], ids=["load", "pulsating spring"])  # fmt: skip
def test_what_comes_and_goes_is_placed_in_whatever_phase(term, phase: float):
    load, omega = isinstance(term, jfsm.PeriodicDisturbance), 1.733
    r = timed(lambda t, x: (-1.2 if load else 1.2 * x) * np.cos(omega * t + phase))
    best = starts(MODEL + term, prepare(r, MODEL + term))[0].terms[-1]
    size, *found = (float(number) for number in best.values)
    assert size == pytest.approx(1.2, rel=0.2)
    assert np.corrcoef(np.cos(omega * T + phase), np.cos(found[0] * T + found[1]))[0, 1] > 0.9


def test_a_shape_between_those_of_the_grid_is_found():
    law = jfsm.EndStop(1.0, 1.0, at=(0, 1))
    r = record(lambda x, v: 12.0 * np.sign(x) * np.maximum(np.abs(x) - 0.83, 0.0))
    prepared = prepare(r, MODEL)
    scale = scale_of(prepared, MODEL)
    grid = np.array([shape["gap"] for shape in jfsm.EndStop.shapes(scale)])
    best, *others = place(law, missing_force(MODEL, prepared), MODEL, scale, prepared)
    assert best.term.values[1] not in grid and all(other.term.values[1] in grid for other in others)
    assert abs(float(best.term.values[1]) - 0.83) < np.min(np.abs(grid - 0.83))


def test_two_laws_are_placed_beside_each_other():
    r = record(lambda x, v: 3.0 * x**3 + 0.5 * v * np.abs(v))
    wrong = MODEL + jfsm.CubicStiffness(0.1, at=(0, 1)) + jfsm.QuadraticDamping(0.01, at=(0, 1))
    (best,) = starts(wrong, prepare(r, wrong))
    assert best.values()["cubic_stiffness@0-1.k3"] == pytest.approx(3.0, rel=0.3)
    assert best.values()["quadratic_damping@0-1.c2"] == pytest.approx(0.5, rel=0.5)


def test_a_buckled_spring_is_placed_although_the_motion_stays_small_within_one_well():
    def decay(t, y):
        return [y[1], -9.0 * y[0] - 0.3 * y[1] + 15.0 * y[0] - 6.0 * y[0] ** 3]

    x = solve_ivp(decay, (0, T[-1]), [1.25, 0.0], t_eval=T, rtol=1e-9, atol=1e-12).y[0]
    assert np.std(x) < 0.05 * np.mean(x)
    r = jfsm.Record(T, displacement=x + 0.01 * np.std(x) * np.random.default_rng(5).standard_normal(T.size))
    wrong = MODEL + jfsm.DoubleWell(1.0, 1.0, at=(0, 1))
    found = starts(wrong, prepare(r, wrong))[0].values()
    assert found["double_well@0-1.k_neg"] > 9.0
    middle = np.sqrt((found["double_well@0-1.k_neg"] - 9.0) / found["double_well@0-1.k3"])
    assert middle == pytest.approx(1.0, rel=0.3)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_buckled_spring_is_placed_in_its_well_although_no_channel_tells_where_that_is(side: float):
    def decay(t, y):
        return [y[1], -9.0 * y[0] - 0.3 * y[1] + 15.0 * y[0] - 6.0 * y[0] ** 3]

    x, v = solve_ivp(decay, (0, T[300]), [side * 1.3, 0.0], t_eval=T[:300], rtol=1e-9, atol=1e-12).y
    a = -9.0 * x - 0.3 * v + 15.0 * x - 6.0 * x**3
    assert np.all(side * x > 0.5)
    r = jfsm.Record(T[:300], acceleration=a + 0.005 * np.std(a) * np.random.default_rng(5).standard_normal(300))
    found = about_a_rest(jfsm.DoubleWell, (0, 1), missing_force(MODEL, prepare(r, MODEL)), MODEL)
    assert found is not None
    placed, rest = found
    assert 0.5 < side * rest < 2.0 and placed.share is not None and placed.share > 0.2
    assert placed.term.values[0] == pytest.approx(15.0, rel=0.3)
    right = MODEL + jfsm.DoubleWell(15.0, 6.0, at=(0, 1))
    x0, v0 = starting_state(right, r)
    assert x0[0] == pytest.approx(side * 1.3, rel=0.02) and abs(v0[0]) < 0.05


def test_a_law_without_a_rest_of_its_own_is_not_placed_about_one():
    r = record(lambda x, v: 3.0 * x**3)
    assert about_a_rest(jfsm.CubicStiffness, (0, 1), missing_force(MODEL, prepare(r, MODEL)), MODEL) is None


def test_a_law_that_shows_at_the_first_peaks_only_is_placed():
    def decay(t, y):
        return [y[1], -9.0 * y[0] - 0.9 * y[1] - 0.02 * y[0] ** 5]

    x = solve_ivp(decay, (0, T[-1]), [3.0, 0.0], t_eval=T, rtol=1e-9, atol=1e-12).y[0]
    assert np.max(np.abs(x)) > 8 * np.std(x)
    r = jfsm.Record(T, displacement=x + 0.005 * np.std(x) * np.random.default_rng(7).standard_normal(T.size))
    model, law = jfsm.Structure.sdof(1.0, 9.0, 0.9), jfsm.QuinticStiffness(1.0, at=(0, 1))
    prepared = prepare(r, model)
    (found,) = place(law, missing_force(model, prepared), model, scale_of(prepared, model), prepared)
    assert found.share is not None and found.share > 0.5
    assert 0.01 < float(found.term.values[0]) < 0.05


@pytest.mark.parametrize("decays", [True, False])
def test_the_corners_of_a_clipped_channel_are_no_noise(decays: bool):
    envelope = np.exp(-0.1 * T) if decays else 1.0
    y = envelope * (2 * np.sin(2.9 * T) + np.sin(1.7 * T) + np.cos(T))
    y += 0.03 * np.random.default_rng(8).standard_normal(T.size)
    prepared = prepare(jfsm.Record(T, displacement=np.clip(y, -1.8, 1.8)), MODEL)
    assert prepared.trusted.all() and prepared.floor[0] == pytest.approx(0.03, rel=0.2)


def test_no_law_is_placed_on_a_force_that_ran_away():
    law = jfsm.CubicStiffness(0.1, at=(0, 1))
    nuisances = prepare(record(lambda x, v: 3.0 * x**3), MODEL)
    latent = missing_force(MODEL, nuisances)
    assert place(law, latent, MODEL, scale_of(nuisances, MODEL), nuisances)
    with np.errstate(over="ignore"):
        far = replace(latent, force=latent.force * 1e300)
    assert place(law, far, MODEL, scale_of(nuisances, MODEL), nuisances) == []


def test_a_side_and_an_origin_of_time_are_no_matter_of_search():
    r = record(lambda x, v: 2.0 * np.maximum(-0.2 - x, 0.0) * -1.0)
    wrong = MODEL + jfsm.BilinearStiffness(1.0, 0.0, -1.0, at=(0, 1))
    for found in starts(wrong, prepare(r, wrong)):
        assert found.values()["bilinear_stiffness@0-1.side"] == -1.0


def test_what_comes_to_rest_is_judged_while_it_moves():
    def friction(t, y):
        return [y[1], -9.0 * y[0] - 0.3 * y[1] - 0.4 * np.tanh(y[1] / 1e-3)]

    x, v = solve_ivp(friction, (0, T[-1]), [2.0, 0.0], t_eval=T, rtol=1e-8, atol=1e-10, method="LSODA").y
    noise = 0.01 * np.random.default_rng(6).standard_normal((2, T.size))
    r = jfsm.Record(T, displacement=x + noise[0], velocity=v + 3 * noise[1])
    prepared, law = prepare(r, MODEL), jfsm.Coulomb(1.0, at=(0, 1))
    assert np.mean(np.abs(v) < 1e-3) > 0.5
    (found,) = place(law, missing_force(MODEL, prepared), MODEL, scale_of(prepared, MODEL), prepared)
    assert found.share is not None and found.share > 0.7
    assert float(found.term.values[0]) == pytest.approx(0.4, rel=0.3)  # smoothing rounds its jumps


@pytest.mark.parametrize("seed", range(3))
def test_the_missing_force_of_a_decay_fades_with_it(seed: int):
    time = np.arange(2000) * 0.03

    def rate(_, y):
        return [y[1], -9.0 * y[0] - 0.4 * y[1] - y[0] ** 3]

    x, v = solve_ivp(rate, (0, time[-1]), [1.5, 0.0], t_eval=time, rtol=1e-9, atol=1e-10).y
    noisy = x + 0.02 * np.std(x) * np.random.default_rng(seed).standard_normal(time.size)
    model = jfsm.Structure.sdof(1.0, 9.0, 0.4)
    latent = missing_force(model, prepare(jfsm.Record(time, displacement=noisy), model))
    power = np.mean(x**6)
    assert np.mean((latent.force[:, 0] - x**3) ** 2) < 0.15 * power
    assert np.mean(latent.force[time > 45.0, 0] ** 2) < 1e-4 * power


def test_the_missing_force_is_known_between_coarse_samples_too():
    time = np.arange(1500) * 0.15
    phases = np.random.default_rng(1).uniform(0.0, 6.28, 12)
    tones = np.linspace(0.5, 7.0, 12)

    def drive(t):
        return 2.0 * np.cos(np.multiply.outer(t, tones) + phases).sum(-1)

    def rate(t, y):
        return [y[1], drive(t) - 9.0 * y[0] - 0.3 * y[1] - 2.0 * y[0] ** 3]

    x, v = solve_ivp(rate, (0, time[-1]), [0.0, 0.0], t_eval=time, rtol=1e-8, atol=1e-10).y
    a = drive(time) - 9.0 * x - 0.3 * v - 2.0 * x**3
    noise = 0.01 * np.random.default_rng(2).standard_normal((2, time.size))
    r = jfsm.Record(time, force=drive(time), displacement=x + noise[0], acceleration=a + 9 * noise[1])
    model = jfsm.Structure.sdof(1.0, 9.0, 0.3)
    latent = missing_force(model, prepare(r, model))
    assert np.std(latent.force[:, 0] - 2.0 * x**3) < 0.08 * np.std(2.0 * x**3)


def test_of_several_masses_the_missing_force_is_where_a_law_acts():
    time, n = np.arange(1500) * 0.02, 3
    tones, phases = np.linspace(1.0, 20.0, 15), np.random.default_rng(3).uniform(0.0, 6.28, 15)
    k, c = np.array([900.0, 700.0, 500.0]), np.array([0.8, 0.6, 0.5])

    def motion(t, y):
        stretch, speed = np.diff(np.r_[0.0, y[:n]]), np.diff(np.r_[0.0, y[n:]])
        inner = k * stretch + c * speed + np.array([0.0, 0.0, 1e5]) * stretch**3
        push = np.array([0.0, 5.0 * np.cos(tones * t + phases).sum(), 0.0])
        return np.r_[y[n:], np.append(inner[1:], 0.0) - inner + push]

    y = solve_ivp(motion, (0, time[-1]), np.zeros(2 * n), t_eval=time, rtol=1e-8, atol=1e-10).y
    a = np.stack([motion(t, one)[n:] for t, one in zip(time, y.T, strict=True)], 1)
    a += 0.01 * np.std(a) * np.random.default_rng(4).standard_normal(a.shape)
    push = 5.0 * np.cos(np.multiply.outer(time, tones) + phases).sum(1)
    r = jfsm.Record(time, force={2: push}, acceleration={j + 1: a[j] for j in range(n)}, at_rest=True)
    model = jfsm.Structure.chain(mass=np.ones(n), stiffness=k, damping=c)
    latent, true = missing_force(model, prepare(r, model)), 1e5 * (y[2] - y[1]) ** 3
    assert np.std(latent.force[:, 2] - true) < 0.2 * np.std(true)
    assert np.std(latent.force[:, 1] + true) < 0.2 * np.std(true)
    assert np.std(latent.force[:, 0]) < 0.1 * np.std(true)


def test_regression_cannot_tell_a_constant_force_from_an_offset():
    r = record(lambda x, v: 1.0 + 0.0 * x)
    prepared, law = prepare(r, MODEL), jfsm.Preload(1.0, at=(0, 1))
    (found,) = place(law, missing_force(MODEL, prepared), MODEL, scale_of(prepared, MODEL), prepared)
    assert found.share is None


def test_a_linear_structure_has_no_other_start():
    r = record(lambda x, v: 0.0 * x)
    assert starts(MODEL, prepare(r, MODEL)) == []


@pytest.mark.parametrize(("term", "expected"), [
    (jfsm.Maxwell(2.0, 0.5, at=(0, 1)), None),
    (jfsm.DelayedForce(2.0, 0.31, at=(0, 1)), lambda t: 2.0 * np.where(t < 0.31, 1.0, np.cos(1.3 * (t - 0.31)))),
    (jfsm.Coulomb(2.0, at=(0, 1)), lambda t: -2.0 * np.sign(np.sin(1.3 * t))),
], ids=["maxwell", "delayed", "coulomb"])  # fmt: skip
def test_the_force_along_a_given_motion_is_that_of_the_law(term, expected):
    x, v = np.cos(1.3 * T), -1.3 * np.sin(1.3 * T)
    plant = lower(jfsm.Structure([1.0], [term]))
    found = np.asarray(force_along(plant, jnp.asarray(x[:, None]), jnp.asarray(v[:, None]), jnp.asarray(T)))[:, 0]
    alone = forces_of_law(type(term), np.array([term.values], dtype=float), x, v, T)
    np.testing.assert_allclose(alone, found[None], rtol=1e-12, atol=1e-12)
    if expected is None:  # settled: amplitude and phase of z' = w - z/tau
        response = 2.0 * np.real(1j * 1.3 / (1j * 1.3 + 2.0) * np.exp(1j * 1.3 * T))
        np.testing.assert_allclose(found[200:], response[200:], atol=5e-3)
    else:
        np.testing.assert_allclose(found[1:], expected(T)[1:], atol=2e-3)


@pytest.mark.parametrize("bend", [0.3, 0.003])
def test_bristles_are_followed_in_few_steps_however_stiff(bend):
    """They slide after so small a displacement that eight of the usual steps between samples run away."""
    x, v = np.cos(1.3 * T), -1.3 * np.sin(1.3 * T)
    law = jfsm.LuGre(1.0, 1.4, 0.3, 1.0 / bend, 0.02, at=(0, 1))
    motion = (jnp.asarray(q) for q in (x[:, None], v[:, None], T))
    fine = np.asarray(force_along(lower(jfsm.Structure([1.0], [law])), *motion, substeps=512))[:, 0]
    found = forces_of_law(jfsm.LuGre, np.array([law.values], dtype=float), x, v, T)[0]
    np.testing.assert_allclose(found[1:], fine[1:], atol=0.05)


def test_shapes_too_stiff_for_the_samples_leave_the_others_to_begin_from():
    fine = record(lambda x, v: np.tanh(v / 0.3))
    assert fine.force is not None and fine.displacement is not None and fine.velocity is not None
    coarse = jfsm.Record(fine.time[::3], fine.force[::3], fine.displacement[::3], fine.velocity[::3], at_rest=True)
    bristles = MODEL + jfsm.LuGre(1.0, 1.0, 0.3, 50.0, 1.0, at=(0, 1))
    first = starts(bristles, prepare(coarse, bristles))[0].values()
    assert first["lugre@0-1.F"] == pytest.approx(1.0, rel=0.5)


def along_a_decay(dt: float, law: jfsm.LuGre) -> float:
    """Share of the force of bristles along a decay that the best start explains."""
    time = np.arange(0.0, 30.0, dt)
    x, v = np.exp(-0.3 * time) * np.cos(5.0 * time), -5.0 * np.exp(-0.3 * time) * np.sin(5.0 * time)
    rest = jfsm.Structure.sdof(mass=1.0, stiffness=25.0, damping=0.6)
    motion = jnp.asarray(x[:, None]), jnp.asarray(v[:, None]), jnp.asarray(time)
    force = np.asarray(force_along(lower(jfsm.Structure([1.0], [law])), *motion, substeps=64))
    latent = Latent(x[:, None], v[:, None], 0 * force, force, np.ones_like(force), np.ones(time.size, bool))
    prepared = prepare(jfsm.Record(time, None, x, v), rest)
    share = place(law, latent, rest, scale_of(prepared, rest), prepared)[0].share
    assert share is not None
    return share


def test_bristles_between_those_of_the_grid_are_found():
    law = jfsm.LuGre(0.4, 0.5, 0.5, 25.0, 4.0, at=(0, 1))
    assert along_a_decay(0.01, law) > 0.98


def test_bristles_too_stiff_for_the_usual_steps_are_followed_by_finer_ones():
    law = jfsm.LuGre(0.4, 0.6, 0.15, 100.0, 10.0, at=(0, 1))
    assert along_a_decay(0.1, law) > 0.95


class Unbounded(jfsm.CubicStiffness):
    """A law whose force is no number."""

    kind = "unbounded"

    def force(self, d, w, z, t):
        return self.k3 * jnp.inf * d


def test_a_law_of_which_every_shape_runs_away_is_not_placed():
    r = record(lambda x, v: 3.0 * x**3)
    prepared, law = prepare(r, MODEL), Unbounded(1.0, at=(0, 1))
    latent, scale = missing_force(MODEL, prepared), scale_of(prepared, MODEL)
    assert place(law, latent, MODEL, scale, prepared) == []


def test_records_of_similar_length_share_the_programs_that_place_a_law(caplog):
    def placed(samples):
        prepared = prepare(record(lambda x, v: 3.0 * x**3)[:samples], MODEL)
        latent = missing_force(MODEL, prepared)
        law = jfsm.BoucWen(1.0, 1.0, 1.0, 1.0, at=(0, 1))
        return place(law, latent, MODEL, scale_of(prepared, MODEL), prepared)

    first = placed(1200)
    with caplog.at_level("WARNING", "jax"), jax.log_compiles():
        second = placed(1150)
    large = ("_lot_at_once", "_remembered", "_likelihoods", "_smooth", "force_along")
    assert not [m for m in caplog.messages if m.startswith("Compiling") and any(name in m for name in large)]
    assert second[0].share == pytest.approx(first[0].share, abs=0.05)


@pytest.mark.parametrize("late", ["force", "displacement"])
def test_no_force_is_missing_where_a_channel_is_late_as_the_model_says(late):
    delay = 0.2

    def motion(t, y):
        return [y[1], three_tones(t) - 9.0 * y[0] - 0.3 * y[1]]

    x = solve_ivp(motion, (0, T[-1]), [0.0, 0.0], dense_output=True, rtol=1e-10, atol=1e-12).sol
    seen = {kind: np.maximum(T - delay * (kind == late), 0.0) for kind in ("force", "displacement")}
    shown = {"force": three_tones(seen["force"]), "displacement": x(seen["displacement"])[0]}
    rng = np.random.default_rng(2)
    r = jfsm.Record(T, **{kind: y + 0.01 * np.std(y) * rng.standard_normal(T.size) for kind, y in shown.items()})
    law = jfsm.ForceDelay if late == "force" else jfsm.ChannelDelay
    believed, mended = (missing_force(m, prepare(r, m)) for m in (MODEL, MODEL + law(delay, at=(late, 1))))
    inner, whole = slice(50, -50), np.std(three_tones(T))
    assert np.std(believed.force[inner]) > 0.3 * whole
    assert np.std(mended.force[inner]) < 0.05 * whole
