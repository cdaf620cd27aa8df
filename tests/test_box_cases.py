"""Simulations that can only be run, from a record to a verdict: a frame in NumPy, and a quarter car as an FMU."""

from pathlib import Path

import fmus
import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

import jfsm

KEY = jax.random.key(0)

# A frame of two storeys, whose lower one hardens; a shaker stands on the upper floor.

MASS, STIFFNESS, DAMPING = np.array([1200.0, 1000.0]), np.array([8e5, 6e5]), np.array([1800.0, 1200.0])
HARDENING = 2.5e8
"""N/m³: a tenth of the force in the lower storey at its largest drift."""
SLIDES, STICKS = 900.0, 4e5
"""Force [N] and stiffness [N/m] of the element in the upper storey."""
TIME = 0.01 * np.arange(2400)
RNG = np.random.default_rng(3)
TONES = 2 * np.pi * np.linspace(0.5, 9.0, 40), RNG.uniform(0, 2 * np.pi, 40)


def shaker(t) -> np.ndarray:
    return 420.0 * np.cos(np.multiply.outer(np.asarray(t), TONES[0]) + TONES[1]).sum(-1)


def storeys(drift, rate, hardening: float):
    """Force (…, 2) in the storeys."""
    lower = hardening * drift[..., 0] ** 3
    return STIFFNESS * drift + DAMPING * rate + np.stack([lower, np.zeros_like(lower)], -1)


def frame(driven: np.ndarray, between: np.ndarray | None = None, hardening: float = HARDENING) -> np.ndarray:
    """Displacement (n, 2) of the floors under forces (n, 2) on them and one between them (n,), straight in between."""
    if not isinstance(driven, np.ndarray):
        raise TypeError("the frame is no function for JAX")
    if between is not None:
        driven = driven + np.stack([-between, between], -1)
    parts, h = 8, (TIME[1] - TIME[0]) / 8
    x = v = np.zeros(2)
    shown = [x]

    def rate(x, v, g):
        f = storeys(np.array([x[0], x[1] - x[0]]), np.array([v[0], v[1] - v[0]]), hardening)
        return v, (g - np.array([f[0] - f[1], f[1]])) / MASS

    for begin, end in zip(driven[:-1], driven[1:], strict=True):
        for i in range(parts):
            g = [begin + (i + share) / parts * (end - begin) for share in (0, 0.5, 1)]
            k1 = rate(x, v, g[0])
            k2 = rate(x + h / 2 * k1[0], v + h / 2 * k1[1], g[1])
            k3 = rate(x + h / 2 * k2[0], v + h / 2 * k2[1], g[1])
            k4 = rate(x + h * k3[0], v + h * k3[1], g[2])
            x = x + h / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0])
            v = v + h / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1])
        shown.append(x)
    return np.array(shown)


def frame_measured(slides: float = SLIDES, hardening: float = HARDENING) -> jfsm.Record:
    """The frame with an element in its upper storey that sticks and slides, by SciPy in steps of an eighth of a sample,
    with 1 % noise."""

    def rate(t, y):
        x, v, z = y[:2], y[2:4], y[4]
        f = storeys(np.array([x[0], x[1] - x[0]]), np.array([v[0], v[1] - v[0]]), hardening)
        f = f + np.array([0.0, slides and STICKS * z])
        speed = v[1] - v[0]
        yields = abs(STICKS * z) >= slides and z * speed > 0
        a = (np.array([0.0, shaker(t)]) - np.array([f[0] - f[1], f[1]])) / MASS
        return np.concatenate([v, a, [0.0 if yields else speed]])

    run = solve_ivp(rate, (0, TIME[-1]), np.zeros(5), t_eval=TIME, rtol=1e-7, atol=1e-10, max_step=1.25e-3)
    x = run.y[:2].T
    noise = 0.01 * x.std(0) * np.random.default_rng(5).standard_normal(x.shape)
    return jfsm.Record(TIME, force={2: shaker(TIME)}, displacement=x + noise, at_rest=True)


def frame_run(record: jfsm.Record, extra=None) -> dict[str, np.ndarray]:
    driven = np.zeros((len(record), 2))
    driven[:, 1] = record.channels["force", 2]
    return {"displacement": frame(driven, None if extra is None else extra[1, 2])}


# A quarter car on a road, as an FMU that takes steps of 2 ms.

WHEEL, BODY, TYRE, SPRING, DAMPER = 40.0, 300.0, 180e3, 20e3, 1500.0
BUMP, REBOUND = 900.0, 2100.0
"""Slopes of the damper in the car [N s/m]; the FMU has the same in both."""
INSTANTS = 0.005 * np.arange(3000)
FORM = jfsm.Structure(
    [WHEEL, BODY],
    [
        jfsm.LinearStiffness(TYRE, at=(0, 1)),
        jfsm.LinearStiffness(SPRING, at=(1, 2)),
        jfsm.LinearDamping(DAMPER, at=(1, 2)),
    ],
)


def roads(seed: int):
    """Height of a road [m] and its acceleration, at the wheel, as functions of the time [s]."""
    rng = np.random.default_rng(seed)
    omega = 2 * np.pi * np.linspace(0.5, 16.0, 60)
    amplitude, phase = 0.025 / (1 + omega / 6), rng.uniform(0, 2 * np.pi, 60)

    def height(t):
        tones = np.sum(amplitude * np.cos(np.multiply.outer(np.asarray(t, float), omega) + phase), -1)
        return (1 - np.exp(-((np.asarray(t) / 0.5) ** 4))) * tones

    fine = make_interp_spline(np.linspace(-0.1, 16, 160001), height(np.abs(np.linspace(-0.1, 16, 160001))), k=5)
    return fine, fine.derivative(2)


def driven(bump: float, rebound: float, seed: int, noise: float = 0.01) -> jfsm.Record:
    """Accelerations of wheel and body on a road, by SciPy."""
    height, shaken = roads(seed)

    def rates(t, y):
        (wheel, body), (w, b) = y[:2], y[2:]
        strut = SPRING * (body - wheel) + (rebound if b > w else bump) * (b - w)
        return [w, b, (strut - TYRE * (wheel - height(t))) / WHEEL, -strut / BODY]

    run = solve_ivp(rates, (0, INSTANTS[-1]), np.zeros(4), t_eval=INSTANTS, rtol=1e-7, atol=1e-9, max_step=2e-3)
    a = np.array([rates(t, y)[2:] for t, y in zip(INSTANTS, run.y.T, strict=True)])
    a = a + noise * a.std(0) * np.random.default_rng(seed + 100).standard_normal(a.shape)
    return jfsm.Record(INSTANTS, acceleration=a, base_acceleration=shaken(INSTANTS), at_rest=True)


def car(folder: Path, *, late: bool = False) -> Path:
    return fmus.built(
        folder,
        "Car",
        states=4,
        parameters={"k_strut": SPRING, "c_strut": DAMPER},
        inputs=["road", "f_strut"],
        outputs=["tyre", "travel", "a_wheel", "a_body"],
        late=late,
        body="from pythonfmu import DefaultExperiment\nself.default_experiment = DefaultExperiment(step_size=0.002)",
        rates=f"""
wheel, body, w, b = state
strut = self.k_strut * (body - wheel) + self.c_strut * (b - w) - self.f_strut
return [w, b, (strut - {TYRE} * (wheel - self.road)) / {WHEEL}, -strut / {BODY}]
""",
        show="""
self.tyre, self.travel = state[0] - self.road, state[1] - state[0]
self.a_wheel, self.a_body = self.rates(state)[2:]
""",
    )


def road_of(record: jfsm.Record) -> np.ndarray:
    """Height of the road, from its acceleration, from rest."""
    return make_interp_spline(record.time, np.asarray(record.base_acceleration), k=5).antiderivative(2)(record.time)


def as_box(path: Path):
    return jfsm.adapters.fmu.simulation(
        path,
        given={"road": road_of},
        displacement={1: "tyre", 2: "tyre + travel"},
        acceleration={1: "a_wheel", 2: "a_body"},
        extra={(1, 2): "f_strut"},
        form=FORM,
    )


# Verdicts


def note(d: jfsm.Diagnosis, begins: str) -> str:
    (found,) = [text for text in d.notes if text.startswith(begins)]
    return found


MEMORY = ("jenkins", "coulomb", "bouc_wen", "cubic_hardening", "bilinear_damping", "quadratic_damping")


@pytest.mark.slow  # most of it is the search for what the frame itself has
def test_a_slider_in_the_upper_storey_is_named_and_run_in_the_frame_itself():
    box = jfsm.Simulation.from_runs(frame_run, places=[(1, 2)])
    d = jfsm.diagnose(frame_measured(), box, causes=MEMORY, key=KEY)
    (finding,) = d.findings
    assert (finding.cause, finding.at) == ("jenkins", (1, 2))
    assert finding.parameters["k"].value == pytest.approx(STICKS, rel=0.05)
    assert finding.parameters["slip"].value == pytest.approx(SLIDES / STICKS, rel=0.05)
    assert note(d, "The gain is that of the simulation itself")
    assert d.gain is not None and d.gain.closed > 0.95


@pytest.mark.slow
def test_of_a_file_the_same_slider_is_named_with_the_gain_of_its_stand_in():
    output = jfsm.Record(TIME, displacement=frame_run(frame_measured())["displacement"], at_rest=True)
    d = jfsm.diagnose(frame_measured(), simulated=output, causes=MEMORY, key=KEY)
    (finding,) = d.findings
    assert (finding.cause, finding.at) == ("jenkins", (1, 2))
    assert note(d, "Gains, too, are those of this structure.")


@pytest.mark.slow
def test_a_hardening_that_is_less_is_a_wrong_value_and_no_cause():
    box = jfsm.Simulation.from_runs(frame_run, places=[(1, 2), (0, 1)])
    d = jfsm.diagnose(frame_measured(slides=0.0, hardening=0.7 * HARDENING), box, causes=MEMORY, key=KEY)
    assert d.verdict == "parameters" and all(finding.family == "parameters" for finding in d.findings)
    assert d.extended.values()["cubic_stiffness@0-1.k3"] == pytest.approx(0.7 * HARDENING, rel=0.05)


@pytest.mark.slow
def test_a_one_way_damper_is_named_and_run_in_the_fmu_itself(tmp_path):
    pytest.importorskip("fmpy")
    pytest.importorskip("pythonfmu")
    d = jfsm.diagnose(driven(BUMP, REBOUND, 1), as_box(car(tmp_path)), holdout=driven(BUMP, REBOUND, 2), key=KEY)
    (finding,) = d.findings
    assert (finding.cause, finding.at) == ("bilinear_damping", (1, 2))
    values = d.extended.values()
    one, way = values["damping@1-2.c"], values["bilinear_damping@1-2.dc"]
    slopes = {values["bilinear_damping@1-2.side"]: one + way, -values["bilinear_damping@1-2.side"]: one}
    assert slopes == pytest.approx({1.0: REBOUND, -1.0: BUMP}, rel=0.05)
    assert note(d, "The gain is that of the simulation itself")
    assert d.gain is not None and d.gain.closed > 0.9


@pytest.mark.slow
def test_outputs_that_are_a_step_late_are_no_cause(tmp_path):
    pytest.importorskip("fmpy")
    pytest.importorskip("pythonfmu")
    same, other = driven(DAMPER, DAMPER, 1), driven(DAMPER, DAMPER, 2)
    d = jfsm.diagnose(same, as_box(car(tmp_path, late=True)), holdout=other, key=KEY)
    assert d.verdict == "consistent" and not d.findings
    assert "as of the beginning of a step; it was put in time" in note(d, "Car.fmu shows")
