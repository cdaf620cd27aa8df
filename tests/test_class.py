"""The class of a law: what narrow-band motion tells of it."""

import pytest

import jfsm
from jfsm.diagnosis._finding import Finding, Rival
from jfsm.diagnosis.hypotheses.law_classes import classes_of
from jfsm.diagnosis.report.sentences import finding_sentence

PEAK, SPEED = 2.0, 3.0
LAWS = {
    ("a hardening spring", "a nonlinear spring"): [
        ("cubic_hardening", {"k3": 2.0}),
        ("quintic_stiffness", {"k5": 0.1}),
        ("square_stiffness", {"k2": 1.0}),
        ("double_well", {"k_neg": 3.0, "k3": 2.0}),
        ("sine_stiffness", {"k": -1.0, "s": 0.5}),
    ],
    ("a spring with play or a stop", "a hardening spring", "a nonlinear spring"): [
        ("end_stop", {"k": 5.0, "gap": 1.2}),
        ("dead_zone", {"k": 5.0, "gap": 0.4}),
    ],
    ("a softening spring", "a nonlinear spring"): [
        ("cubic_softening", {"k3": -0.1}),
        ("square_stiffness", {"k2": -1.0}),
        ("saturation", {"k": 5.0, "gap": 1.2}),
        ("sine_stiffness", {"k": 1.0, "s": 0.5}),
    ],
    ("a spring that differs between its two sides", "a nonlinear spring"): [
        ("quadratic_stiffness", {"k2": -1.0}),
        ("bilinear_stiffness", {"k": 3.0, "knot": 0.2, "side": 1.0}),
    ],
    ("dry friction", "nonlinear damping"): [
        ("coulomb", {"F": 1.0}),
        ("stribeck", {"F": 1.0, "F_static": 1.5, "v_s": 0.4}),
        ("smooth_coulomb", {"F": 1.0, "v_s": 0.4}),
        ("power_damping", {"c": 1.0, "n": 0.5}),
    ],
    ("dry friction", "damping that differs between the two directions", "nonlinear damping"): [
        ("coulomb_asymmetric", {"F_plus": 1.0, "F_minus": 0.4}),
    ],
    ("damping that grows faster than speed", "damping that grows with amplitude", "nonlinear damping"): [
        ("quadratic_damping", {"c2": 1.0}),
        ("cubic_damping", {"c3": 1.0}),
        ("power_damping", {"c": 1.0, "n": 2.5}),
    ],
    ("damping that grows with amplitude", "nonlinear damping"): [
        ("position_damping", {"c": 1.0}),
        ("van_der_pol", {"eps": 1.0, "x0": 1.0}),
    ],
    ("damping that differs between the two directions", "nonlinear damping"): [
        ("bilinear_damping", {"dc": 1.0, "side": -1.0}),
    ],
    ("dry friction", "a spring that yields", "nonlinear damping", "a force with memory"): [
        ("jenkins", {"k": 1.0, "slip": 0.5}),
        ("free_play", {"k": 1e4, "gap": 1e-3, "F_plus": 1.0, "F_minus": 1.1}),
        ("bouc_wen", {"k": 1.0, "beta": 1.0, "gamma": 0.5, "n": 1.0}),
    ],
    (
        "a spring with play or a stop",
        "dry friction",
        "a spring that yields",
        "nonlinear damping",
        "a force with memory",
    ): [
        ("free_play", {"k": 10.0, "gap": 0.5, "F_plus": 2.0, "F_minus": 2.5}),
    ],
    ("a spring with play or a stop", "a force with memory"): [
        ("free_play", {"k": 1.0, "gap": 0.5, "F_plus": 2.0, "F_minus": 2.5}),
    ],
    ("a spring that yields", "a force with memory"): [("bouc_wen", {"k": 1.0, "beta": 1.0, "gamma": -1.5, "n": 1.0})],
    ("a force with memory",): [("maxwell", {"k": 1.0, "tau": 0.2})],
    ("a stiffness that changes with time", "a change with time"): [("stiffness_drop", {"dk": 1.0, "t_star": 0.2})],
    ("a force that repeats with position", "a nonlinear spring"): [("ripple", {"A": 1.0, "n": 40.0, "phase": 0.3})],
    ("an unmeasured load",): [("preload", {"F": 1.0})],
}


@pytest.mark.parametrize(
    ("classes", "cause", "numbers"), [(kind, *law) for kind, laws in LAWS.items() for law in laws], ids=lambda x: str(x)
)
def test_a_law_belongs_to_its_classes_in_any_unit(classes: tuple[str, ...], cause: str, numbers: dict[str, float]):
    entry = jfsm.causes()[cause]
    assert classes_of(entry, entry.term(at=(0, 1), **numbers), PEAK, SPEED) == classes
    if entry.family in ("stiffness", "damping"):
        tiny = {p.name: numbers[p.name] * 1e-6 if p.force else numbers[p.name] for p in entry.effect.parameters}
        assert classes_of(entry, entry.term(at=(0, 1), **tiny), PEAK, SPEED) == classes


def test_a_sensor_has_classes_as_well():
    causes = jfsm.causes()
    bias, late = causes["accel_bias"], causes["channel_delay"]
    assert classes_of(bias, bias.term(at=("acceleration", 1), b=0.1), PEAK, SPEED) == ("a fault of a sensor",)
    kinds = classes_of(late, late.term(at=("acceleration", 1), tau=0.1), PEAK, SPEED)
    assert kinds == ("a delay between sensors", "a fault of a sensor")


@pytest.mark.parametrize(
    ("probability", "kind_probability", "words"),
    [
        (
            0.55,
            0.98,
            "a hardening spring at link ground–1 (98%); its law is open: a cubic hardening spring (55%), a pendulum's",
        ),
        (0.95, 0.98, "a cubic hardening spring at link ground–1: grows."),
        (
            0.45,
            0.45,
            "a cubic hardening spring at link ground–1: grows. By this record it may as well be a pendulum's spring.",
        ),
    ],
)
def test_where_the_law_is_open_its_class_comes_first(probability: float, kind_probability: float, words: str):
    rivals = (Rival("sine_stiffness", (0, 1), 0.04 if probability > 0.9 else 0.43),)
    shown = Finding(
        "cubic_hardening",
        "stiffness",
        (0, 1),
        probability,
        {},
        rivals,
        "grows",
        "a hardening spring",
        kind_probability,
        law_open=probability < 0.8,
        members={"cubic_hardening": probability, rivals[0].cause: rivals[0].probability},
    )
    assert finding_sentence(shown, jfsm.causes()).startswith(f"The model lacks {words}")


def test_where_no_law_of_a_class_has_the_shape_that_is_said():
    found = Finding(
        "cubic_hardening", "stiffness", (0, 1), 0.58, {}, (), "grows", "a hardening spring", 0.99, law_open=True,
        members={"cubic_hardening": 0.58},
    )  # fmt: skip
    words = finding_sentence(found, jfsm.causes())
    assert words.endswith("its law is open: a cubic hardening spring (58%), or one of another shape (41%).")
