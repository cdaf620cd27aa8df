"""Component tests: the motion is imposed, the force is measured. Data by NumPy and SciPy alone."""

import json
from typing import Any

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from typer.testing import CliRunner

import jfsm
from jfsm.cli import app
from jfsm.diagnosis.channels.clipping import limited
from jfsm.identification import Hypothesis, Posterior, nuisance_unknowns, prepare, with_offsets
from jfsm.identification._unknowns import free_unknown
from jfsm.plant import imposed_motion

T = 3.0 + 0.02 * np.arange(600)
TONES = ((2.0, 0.1, 1.0), (5.0, 1.3, 0.5), (9.0, 2.2, 0.3))
K, C = 4.0, 1.0


def x_at(t) -> Any:
    return sum(a * np.cos(w * t + p) for w, p, a in TONES)


def v_at(t) -> Any:
    return sum(-a * w * np.sin(w * t + p) for w, p, a in TONES)


def a_at(t) -> Any:
    return sum(-a * w * w * np.cos(w * t + p) for w, p, a in TONES)


X, V, A = x_at(T), v_at(T), a_at(T)
LINEAR = K * X + C * V
MODEL = jfsm.Structure(mass=[0.0], terms=[jfsm.LinearStiffness(K, at=(0, 1)), jfsm.LinearDamping(C, at=(0, 1))])


def noisy(samples, share, seed=0):
    return samples + share * samples.std() * np.random.default_rng(seed).standard_normal(samples.shape)


def on_rig(force, share=0.01, velocity=False, **options):
    """A record of the imposed motion, every channel with its noise."""
    if velocity:
        options["velocity"] = noisy(V, share, 2)
    return jfsm.Record(T, force=noisy(force, share), displacement=noisy(X, share, 1), drive="motion", **options)


def along(rate, start, rtol=1e-9) -> Any:
    """Hidden states along the motion, by SciPy."""
    run = solve_ivp(
        lambda t, z: rate(x_at(t), v_at(t), z), T[[0, -1]], start, t_eval=T, rtol=rtol, atol=1e-11, max_step=0.01
    )
    return run.y


def dragged(limit, refinement=200):
    """Spring of a spring and slider in series, stretched by at most `limit`, in steps of its own."""
    z, found = 0.0, [0.0]
    for step in np.diff(x_at(np.linspace(T[0], T[-1], (T.size - 1) * refinement + 1))):
        z = min(max(z + step, -limit), limit)
        found.append(z)
    return np.array(found)[::refinement]


def bouc_wen():
    return along(lambda x, v, z: v - 2.0 * abs(v) * np.sqrt(abs(z)) * z - v * abs(z) ** 1.5, [0.0])[0]


def hung():
    x, v = along(lambda x, v, z: [z[1], 16.0 * (x - z[0]) + 0.16 * (v - z[1])], [X[0], V[0]])
    return 0.1 * (16.0 * (X - x) + 0.16 * (V - v))


ZOO = {
    "quadratic_damping": ({"c2": 0.1}, lambda: 0.1 * V * np.abs(V), 1e-5),
    "coulomb": ({"F": 0.5}, lambda: 0.5 * np.sign(V), 1e-5),
    "bouc_wen": ({"k": 2.0, "beta": 2.0, "gamma": 1.0, "n": 1.5}, lambda: 2.0 * bouc_wen(), 1e-4),
    "jenkins": ({"k": 3.0, "slip": 0.2}, lambda: 3.0 * dragged(0.2), 4e-3),  # an instant within a step
    "maxwell": ({"k": 2.0, "tau": 0.3}, lambda: 2.0 * along(lambda x, v, z: v - z / 0.3, [0.0])[0], 1e-5),
    "delayed_force": ({"k": -1.0, "tau": 0.13}, lambda: -np.where(T - 0.13 < T[0], X[0], x_at(T - 0.13)), 1e-4),
    "attached_oscillator": ({"m": 0.1, "omega": 4.0, "zeta": 0.02}, hung, 1e-4),
}


@pytest.mark.parametrize("cause", ZOO)
def test_the_force_of_a_law_along_a_motion_is_that_of_an_independent_calculation(cause):
    numbers, force, tolerance = ZOO[cause]
    model = MODEL + jfsm.causes()[cause].term(at=(0, 1), **numbers)
    found = jfsm.simulate(model, jfsm.Record(T, displacement=X, drive="motion")).force
    exact = force()
    assert found is not None and found.shape == (T.size, 1)
    assert np.max(np.abs(found[:, 0] - LINEAR - exact)) < tolerance * LINEAR.std()


def test_inertia_is_part_of_the_force_and_the_motion_is_the_records_own():
    record = jfsm.Record(T, displacement=X, velocity=V, acceleration=A, drive="motion")
    model = jfsm.Structure(mass=[2.0], terms=MODEL.terms)
    found = jfsm.simulate(model, record)
    assert found.force is not None
    assert np.max(np.abs(found.force[:, 0] - LINEAR - 2.0 * A)) < 1e-4 * np.std(2.0 * A)
    for shown, exact in ((found.displacement, X), (found.velocity, V), (found.acceleration, A)):
        assert np.max(np.abs(shown[:, 0] - exact)) < 1e-4 * exact.std()
    assert jfsm.simulate(model, jfsm.Record(T, force=LINEAR)).force is None


def test_a_component_between_two_moving_ends_feels_their_difference():
    ends = np.stack([X, 0.3 * np.sin(3.0 * T)], 1)
    model = jfsm.Structure(mass=[0.0, 0.0], terms=[jfsm.LinearStiffness(K, at=(1, 2))])
    found = jfsm.simulate(model, jfsm.Record(T, displacement=ends, drive="motion")).force
    assert found is not None
    pull = K * (ends[:, 1] - ends[:, 0])
    assert np.allclose(found, np.stack([-pull, pull], 1), atol=1e-9)


def test_readings_show_what_the_sensor_of_the_force_does():
    model = jfsm.causes()["force_gain"].apply(MODEL, at=("force", 1), eps=0.1)
    model = jfsm.causes()["force_delay"].apply(model, at=("force", 1), tau=0.03)
    record = jfsm.Record(T, force=LINEAR, displacement=X, drive="motion")
    found = jfsm.simulate(model, record)
    assert found.force is not None and np.allclose(found.force[:, 0], LINEAR, atol=1e-4)
    late = 1.1 * (K * x_at(T - 0.03) + C * v_at(T - 0.03))
    assert np.allclose(found.readings(record)["force", 1][5:], late[5:], atol=1e-3)


@pytest.mark.parametrize("velocity", [False, True])
def test_the_motion_between_samples_is_as_good_as_its_error_says(velocity):
    record = on_rig(LINEAR, velocity=velocity)
    path = imposed_motion(record, MODEL)
    instants = (T[:-1] + T[1:])[30:-30] / 2
    x, v, _ = path.motion(instants)
    assert np.std(x[:, 0] - x_at(instants)) < 0.5 * 0.01 * X.std()
    assert np.std(v[:, 0] - v_at(instants)) < (0.01 if velocity else 0.02) * V.std()
    apart = path.motion(T)[1][:, 0] - V
    assert 0.7 < np.sqrt(np.mean((apart / path.errors[0].speed_std) ** 2)) < 1.5


def test_the_constant_of_a_velocity_sensor_is_no_motion():
    record = jfsm.Record(T, displacement=X, velocity=V + 0.4, drive="motion")
    found = jfsm.simulate(MODEL, record)
    assert np.max(np.abs(found.velocity[:, 0] - V)) < 1e-4 * V.std()
    assert any("a constant of 0.4" in note for note in imposed_motion(record, MODEL).notes)


def posterior(record, model=MODEL):
    prepared = [prepare(record, model)]
    structure = with_offsets(model, prepared)
    unknowns = [free_unknown(structure, path, prepared[0]) for path in model.values() if not path.startswith("mass")]
    unknowns += nuisance_unknowns(structure, prepared[0], 0)
    return Posterior(Hypothesis((structure,), (tuple(unknowns),)), prepared)


def test_the_gradient_is_that_of_the_likelihood():
    model = MODEL + jfsm.causes()["maxwell"].term(at=(0, 1), k=2.0, tau=0.3)
    one = posterior(on_rig(LINEAR), model)
    theta = one.initial() + 0.05
    gradient = one.evaluate(theta)[1][0]
    for k in range(theta.size):
        step = np.zeros_like(theta)
        step[0, k] = 1e-5
        difference = (one.evaluate(theta + step)[0] - one.evaluate(theta - step)[0])[0] / 2e-5
        assert abs(difference - gradient[k]) < 1e-4 * max(abs(difference), 1.0)


@pytest.mark.parametrize("velocity", [False, True])
def test_innovations_of_the_right_structure_are_white_and_as_large_as_said(velocity):
    one = posterior(on_rig(LINEAR, velocity=velocity))
    found = one.innovations(one.initial()[0])
    r = (found.error / np.sqrt(found.variance))[20:, 0]
    assert 0.9 < np.std(r) < 1.1
    assert abs(np.corrcoef(r[1:], r[:-1])[0, 1]) < 0.1  # three standard errors; unfiltered errors of the motion: 0.37


def test_a_fit_finds_the_values_and_says_how_sure_it_is():
    wrong = jfsm.Structure(
        mass=[0.0], terms=[jfsm.LinearStiffness(3.0, at=(0, 1)), jfsm.LinearDamping(1.4, at=(0, 1))]
    ) + jfsm.QuadraticDamping(0.05, at=(0, 1))
    found = jfsm.fit(wrong, on_rig(LINEAR + 0.1 * V * np.abs(V) + 0.3))
    assert "mass@1" not in found.values
    for path, exact in {"stiffness@0-1.k": K, "damping@0-1.c": C, "quadratic_damping@0-1.c2": 0.1}.items():
        low, high = found.intervals[path]
        middle, half = (low + high) / 2, (high - low) / 2
        assert abs(middle - exact) < 1.5 * half and half < 0.05 * exact, path
    offset = {s.at: s.value for s in found.structure.sensors}["force", 1]
    assert abs(offset - 0.3) < 0.05


def test_a_mass_is_fitted_where_its_inertia_shows():
    model = jfsm.Structure(mass=[1.0], terms=MODEL.terms)
    heavy = jfsm.fit(model, on_rig(LINEAR + 1.3 * A, velocity=True))
    assert abs(heavy.values["mass@1"] - 1.3) < 0.02
    light = jfsm.Structure(mass=[1e-4], terms=MODEL.terms)
    assert "mass@1" not in jfsm.fit(light, on_rig(LINEAR)).values


CAUSES = ["quadratic_damping", "cubic_damping", "coulomb", "maxwell", "cubic_hardening"]


@pytest.mark.parametrize(
    ("cause", "force", "size"),
    [
        ("quadratic_damping", 0.2 * V * np.abs(V), 0.2),
        ("cubic_hardening", 1.5 * X**3, 1.5),
        ("maxwell", None, 2.0),
    ],
)
def test_a_missing_law_is_named_with_its_size(cause, force, size):
    force = 2.0 * along(lambda x, v, z: v - z / 0.3, [0.0])[0] if force is None else force
    d = jfsm.diagnose(on_rig(LINEAR + force + 0.2), MODEL, causes=CAUSES, key=jax.random.key(0))
    assert (d.verdict, [f.cause for f in d.findings]) == ("cause", [cause])
    found = next(iter(d.findings[0].parameters.values()))
    assert abs(found.value - size) < 0.05 * size
    assert d.gain is not None and d.gain.closed > 0.95 and list(d.gain.channels) == ["force 1"]


def test_dry_friction_under_an_imposed_motion_is_friction():
    force = LINEAR + 2.0 * np.sign(V)
    d = jfsm.diagnose(on_rig(force, 0.003), MODEL, causes=CAUSES, key=jax.random.key(0))
    assert (d.verdict, d.findings[0].cause) == ("cause", "coulomb")
    assert abs(d.findings[0].parameters["F"].value - 2.0) < 0.02


@pytest.mark.slow
def test_of_friction_that_turns_over_early_the_class_is_named_and_the_law_is_open():
    """In another motion every law of the class has other numbers, and runs as wrong as none; the class is as large."""
    size, lead, width = 300.0, 2.0, 0.01

    def measured(amplitude, hertz, samples, seed):
        rng, time = np.random.default_rng(seed), np.arange(samples) / 250.0
        x = amplitude * np.minimum(1.0, time) * np.sin(2 * np.pi * hertz * time)
        v = np.gradient(x, time)
        force = size * np.tanh((v + lead * x) / width) + 40.0 * v + 8000.0 * x
        force, x = force + 1.2 * rng.standard_normal(samples), x + 1e-6 * rng.standard_normal(samples)
        return jfsm.Record(time, force=force, displacement=x, drive="motion")

    link = (0, 1)
    model = jfsm.Structure([0.0], [jfsm.LinearStiffness(6000.0, at=link), jfsm.LinearDamping(100.0, at=link)])
    held = [measured(0.003, 4.0, 500, 6)]
    d = jfsm.diagnose(measured(0.02, 0.8, 2500, 5), model, holdout=held, key=jax.random.key(0))
    (found,) = d.findings
    assert d.verdict == "cause" and found.kind == "dry friction" and found.law_open
    assert found.size is not None and found.size.value == pytest.approx(size, rel=0.15)
    assert (
        d.gain is not None and d.gain.after <= 1.001 * d.gain.refitted and "refitted" in d.advice
    )  # the law itself would run worse


def test_nothing_wrong_is_consistent_and_a_wrong_value_is_named():
    d = jfsm.diagnose(on_rig(LINEAR + 0.2), MODEL, causes=CAUSES, key=jax.random.key(0))
    assert d.verdict == "consistent" and not d.findings
    d = jfsm.diagnose(on_rig(LINEAR + 0.35 * V), MODEL, causes=CAUSES, key=jax.random.key(0))
    assert (d.verdict, [f.cause for f in d.findings]) == ("parameters", ["damping_value"])


def test_a_late_force_is_told_and_its_gain_is_left_to_the_values():
    late = K * x_at(T - 0.03) + C * v_at(T - 0.03)
    looked_for = ["force_delay", "force_gain", "preload", "coulomb_asymmetric", "cubic_damping"]
    d = jfsm.diagnose(on_rig(late), MODEL, causes=looked_for, key=jax.random.key(0))
    assert (d.verdict, d.findings[0].cause) == ("cause", "force_delay")
    assert abs(d.findings[0].parameters["tau"].value - 0.03) < 0.001
    assert {c.cause for c in d.candidates} == {"force_delay", "cubic_damping"}


def test_two_runs_have_one_verdict_and_a_page(tmp_path):
    force = LINEAR + 0.2 * V * np.abs(V)
    runs = [on_rig(force), on_rig(force + 0.3)]
    d = jfsm.diagnose(runs, MODEL, holdout=None, causes=["quadratic_damping", "cubic_damping"])
    assert d.findings[0].cause == "quadratic_damping" and d.gain is None
    d.report(tmp_path / "page.html")
    d.to_json(tmp_path / "page.json")
    d.print()
    assert "Quadratic damping" in (tmp_path / "page.html").read_text()
    assert json.loads((tmp_path / "page.json").read_text())["curves"]["residual"]["force"]


def test_the_command_line_is_told_that_the_motion_drives(tmp_path):
    np.savetxt(tmp_path / "run.csv", np.stack([T, LINEAR, X], 1), delimiter=",", header="time,F,x", comments="")
    MODEL.save(tmp_path / "damper.toml")
    words = ["simulate", tmp_path / "run.csv", "--force", "F", "--displacement", "x", "--model"]
    words += [tmp_path / "damper.toml", "--out", tmp_path / "out.csv"]
    result = CliRunner().invoke(app, [str(w) for w in [*words, "--drive", "motion"]])
    assert result.exit_code == 0 and "force of the motion" in result.output
    written = jfsm.read(tmp_path / "out.csv")
    assert written.drive == "motion" and written.force is not None
    assert np.allclose(written.force[:, 0], LINEAR, atol=1e-4)
    result = CliRunner().invoke(app, [str(w) for w in [*words, "--drive", "both"]])
    assert result.exit_code == 2 and "--drive must be" in result.output


@pytest.mark.parametrize(
    ("options", "model", "message"),
    [
        ({}, MODEL, "must hold the displacement of every degree of freedom .* neither of 1"),
        ({"acceleration": A}, MODEL, "must hold the displacement of every degree of freedom .* neither of 1"),
        ({"displacement": X, "base_acceleration": A}, MODEL, "imposed motion is relative to ground"),
        ({"displacement": X}, jfsm.Structure([0.0, 0.0]), "neither of 2. Measure it"),
        ({"displacement": 0 * X}, MODEL, "`displacement` 1 is constant"),
    ],
)
def test_a_motion_that_cannot_be_imposed_is_refused_with_the_reason(options, model, message):
    with pytest.raises(ValueError, match=message):
        jfsm.simulate(model, jfsm.Record(T, force=LINEAR, drive="motion", **options))


def test_what_makes_no_component_test_is_refused_with_the_reason():
    record = jfsm.Record(T, displacement=X, drive="motion")
    with pytest.raises(ValueError, match="must hold at least 16 samples; it has 10"):
        jfsm.simulate(MODEL, record[:10])
    with pytest.raises(ValueError, match="`initial_state` must be left out"):
        jfsm.simulate(MODEL, record, initial_state=(0.0, 0.0))
    with pytest.raises(ValueError, match="must hold the force that was measured"):
        jfsm.fit(MODEL, record)
    driven = jfsm.Record(T, force=LINEAR, displacement=X)
    with pytest.raises(ValueError, match="agree in drive; number 2 has force, not motion"):
        jfsm.fit(MODEL, [on_rig(LINEAR), driven])
    with pytest.raises(ValueError, match="a force or a moving base must drive"):
        jfsm.simulate_many(MODEL, record)


def test_a_force_that_friction_holds_at_one_level_is_not_clipped():
    record = jfsm.Record(T, 3.0 * np.clip(V / 2.0, -1.0, 1.0), X, drive="motion")
    assert limited([record], MODEL) == []
    driven = jfsm.Record(T, np.clip(3.0 * np.cos(T), -2.9, 2.9), X)
    assert [(sensor.at, sensor.value) for sensor in limited([driven], MODEL)] == [(("force", 1), 2.9)]
