"""Laws of the user's own: defined by public names, refused in words, used as those of the catalogue are."""

# A law's fields are made as its class is defined, which a type checker does not see.
# pyright: reportCallIssue=false, reportAttributeAccessIssue=false, reportArgumentType=false

import re
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from pages import blocks
from typer.testing import CliRunner

import jfsm
from jfsm.cli import app
from jfsm.cli._laws import causes_named, laws_of
from jfsm.diagnosis.hypotheses.candidates import candidates, chosen_causes
from jfsm.diagnosis.hypotheses.law_classes import FRICTION, SOFTENING, classes_of
from jfsm.identification import prepare
from jfsm.structures import AbstractTerm, causes_of, own_laws

F = jfsm.Parameter("F", unit="N", meaning="largest force")
MODEL = jfsm.Structure.sdof(1.0, 100.0, 0.5)
CODE = blocks("own-laws.md")


class TanhSpring(jfsm.AbstractTerm):
    """A spring that saturates smoothly, force F·tanh(d/s)."""

    family, label, sign = "stiffness", "a smoothly saturating spring", 1
    parameters = (F, jfsm.Parameter("s", unit="m"))

    def force(self, d, w, z, t):
        return self.F * jnp.tanh(d / self.s)


def law(base: Any = AbstractTerm, **traits: Any) -> Any:
    """A class of laws with some traits."""
    given = {"parameters": (F,), "force": lambda self, d, w, z, t: self.F * d, "__module__": __name__, **traits}
    return type(base)("SomeLaw", (base,), given)


def slow_from(block: str) -> bool:
    return "jfsm.fit(" in block or "jfsm.diagnose(" in block


def test_the_page_s_laws_simulate_and_are_kept(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {"__name__": "mylaws"}
    for block in CODE:
        if not slow_from(block):
            exec(block, names)
    assert len(CODE) == 8 and names["again"].terms[-1].kind == "tanh_spring"
    assert names["measured"].std() > 0.05


@pytest.mark.slow
def test_the_page_s_law_is_fitted_and_found(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {"__name__": "mylaws"}
    for block in CODE:
        exec(block, names)
    low, high = names["fitted"].intervals["tanh_spring@0-1.F"]
    assert low < 5.0 < high
    (finding,) = names["d"].findings
    assert finding.cause == "tanh_spring" and finding.family == "stiffness" and finding.probability > 0.9
    assert abs(finding.parameters["F"].value - 5.0) < 0.25 and finding.parameters["s"].unit == "m"
    assert jfsm.Structure.from_toml(names["d"].extended.to_toml()).values() == names["d"].extended.values()


def test_a_law_s_numbers_are_fields_in_the_order_of_its_parameters():
    own = TanhSpring(5.0, s=0.02, at=(0, 1))
    assert (MODEL + own).values()["tanh_spring@0-1.s"] == 0.02
    assert own.kind == "tanh_spring" and float(own.force(0.02, 0.0, None, 0.0)) == pytest.approx(5 * np.tanh(1.0))
    with pytest.raises(ValueError, match="`at` must be a pair"):
        TanhSpring(5.0, 0.02, at=(1,))


@pytest.mark.parametrize(
    ("traits", "words"),
    [
        (
            {"parameters": (jfsm.Parameter("F"),)},
            r'`F` of SomeLaw has no unit; write jfsm.Parameter\("F", unit="N/m"\), or unit="1"',
        ),
        ({"parameters": F._replace(name="at")}, "`parameters` of SomeLaw must be a tuple of jfsm.Parameter; got"),
        ({"parameters": (F._replace(name="at"),)}, "`parameters` of SomeLaw must have names of their own.* got 'at'"),
        ({"parameters": (F, F)}, "must have names of their own .* got 'F'"),
        ({"parameters": (F._replace(name="force"),)}, "must have names of their own .* got 'force'"),
        ({"force": lambda self, d: d}, r"`force` of SomeLaw must take \(self, d, w, z, t\); it takes \(self, d\)"),
        (
            {"force": lambda self, d, w, z, t: d * jnp.ones(3)},
            r"`force` .* one number, .*; it gives shape \(3,\)",
        ),
        (
            {"force": lambda self, d, w, z, t: d if d > 0 else w},
            "must be written with jax.numpy, with jnp.where",
        ),
        (
            {"states": 2, "state_rate": lambda self, d, w, z, t: w},
            r"`state_rate` .* 2 hidden states.* gives shape \(\)",
        ),
        ({"kind": "coulomb"}, "`kind` of SomeLaw must be its own; 'coulomb' is that of Coulomb"),
        ({"kind": "tanh_spring"}, "`kind` of SomeLaw must be its own; 'tanh_spring' is that of TanhSpring"),
        ({"kind": "Some law"}, "`kind` of SomeLaw must be small letters, digits and _"),
        ({"family": "springs"}, "`family` of SomeLaw must be one of stiffness, damping, memory, time, input; got"),
        ({"sign": 2}, "`sign` of SomeLaw must be"),
        (
            {"classes": ("friction",)},
            "`classes` of SomeLaw must be names of classes .* got 'friction'. They are: .*dry f",
        ),
        ({"__annotations__": {"G": Any, "at": tuple}, "at": (0, 1), "G": 1.0}, "`F` of SomeLaw must be a field"),
    ],
)
def test_a_law_that_cannot_be_used_is_refused_where_it_is_defined(traits, words):
    with pytest.raises((TypeError, ValueError), match=words):
        law(**traits)


def test_a_law_without_parameters_and_friction_with_one_limit_are_refused():
    base: Any = AbstractTerm
    with pytest.raises(TypeError, match="`parameters` of Bare must list its numbers"):
        type(base)("Bare", (base,), {"force": lambda self, d, w, z, t: d, "__module__": __name__})
    with pytest.raises(ValueError, match="`limits` of SomeLaw must give two numbers"):
        law(jfsm.AbstractFriction, limits=lambda self, d, w, z, t: (self.F, self.F, self.F))


@pytest.mark.parametrize(
    ("unit", "exponents"),
    [
        ("N/m^3", (1, -3, 0)), ("N s/m", (1, -1, 1)), ("N·s²/m", (1, -1, 2)), ("kg", (1, -1, 2)), ("1/s", (0, 0, -1)),
        ("N/(m s)", (1, -1, -1)), ("1", (0, 0, 0)), ("rad/s", (0, 0, -1)),
    ],
)  # fmt: skip
def test_a_unit_in_words_is_its_exponents(unit, exponents):
    parameter = jfsm.Parameter("F", unit=unit)
    assert (parameter.force, parameter.length, parameter.time) == exponents
    assert jfsm.Parameter("F", unit=parameter.unit()) == parameter


@pytest.mark.parametrize(
    ("given", "error", "words"),
    [
        ({"unit": "mm"}, ValueError, "`unit` of F must be made of N, m, s and kg, as N/m.*got 'mm'"),
        ({"unit": ""}, ValueError, "`unit` of F must be a unit such as N/m"),
        ({"unit": "N", "force": 1}, TypeError, "`unit` of F must be given in words or by force="),
    ],
)
def test_a_unit_that_is_none_is_refused(given, error, words):
    with pytest.raises(error, match=words):
        jfsm.Parameter("F", **given)


def test_a_law_defined_again_takes_the_place_of_the_older_one():
    first, second = law(), law()
    assert own_laws()["some_law"] is second is not first


def test_a_file_with_an_own_law_is_read_once_its_class_is_defined(tmp_path):
    own = law(kind="tanh_spring_of_mine")
    extended = MODEL + own(5.0, at=(0, 1))
    extended.save(tmp_path / "model.toml")
    again = jfsm.Structure.load(tmp_path / "model.toml")
    assert type(again.terms[-1]) is own and again.values() == extended.values()
    text = extended.to_toml()
    with pytest.raises(ValueError, match=r"got 'tanh_spring_of_min'\. Did you mean tanh_spring_of_mine\? A law of"):
        jfsm.Structure.from_toml(text.replace("tanh_spring_of_mine", "tanh_spring_of_min"))


def test_classes_and_objects_are_causes():
    chosen = chosen_causes(["coulomb", TanhSpring, jfsm.CubicStiffness, jfsm.ForceGain])
    assert list(chosen) == ["coulomb", "tanh_spring", "cubic_hardening", "cubic_softening", "force_gain"]
    own = chosen["tanh_spring"]
    assert (own.family, own.label, own.sign) == ("stiffness", "a smoothly saturating spring", 1)
    assert own.sentence == "A spring that saturates smoothly, force F·tanh(d/s)"
    assert list(chosen_causes(jfsm.CubicStiffness(-3.0, at=(0, 1)))) == ["cubic_softening"]
    assert list(chosen_causes("coulomb")) == ["coulomb"]


def test_an_object_is_looked_for_at_its_place_from_its_numbers():
    chain = jfsm.Structure.chain([1.0, 1.0], [20.0, 20.0], [0.2, 0.2])
    time = np.arange(300) * 0.05
    force = np.column_stack([10 * np.cos(1.7 * time) + 8 * np.cos(4.1 * time + 1), np.zeros(300)])
    run = jfsm.simulate(chain + jfsm.CubicStiffness(30.0, at=(1, 2)), jfsm.Record(time, force, at_rest=True))
    nuisances = prepare(jfsm.Record(time, force, run.displacement, at_rest=True), chain)
    one, other = TanhSpring(3.0, 0.02, at=(1, 2)), TanhSpring(2.0, 0.04, at=(1, 2))
    (candidate,) = candidates(chain, [nuisances], chosen_causes([one, other]))
    assert candidate.effects[0].at == (1, 2)
    assert [float(start.terms[-1].F) for start in candidate.starts[:2]] == [3.0, 2.0]
    (anywhere,) = {len(candidates(chain, [nuisances], chosen_causes([TanhSpring])))}
    assert anywhere == 2


def test_the_classes_of_an_own_law_are_those_of_its_curve_and_those_it_states():
    (cause,) = causes_of(TanhSpring)
    assert SOFTENING in classes_of(cause, TanhSpring(1.0, 0.02, at=(0, 1)), 0.1, 1.0)
    slider = law(classes=(FRICTION,), states=1, state_rate=lambda self, d, w, z, t: jnp.array([w]))
    (cause,) = causes_of(slider)
    assert cause.family == "memory" and FRICTION in classes_of(cause, slider(1.0, at=(0, 1)), 0.1, 1.0)


def test_what_is_no_cause_is_refused():
    with pytest.raises(ValueError, match=r"got 'coulom'\. Did you mean coulomb\? The catalogue holds stiffness_value"):
        chosen_causes(["coulom"])
    with pytest.raises(ValueError, match="`family` of SomeLaw must be one of stiffness, .* for it to be a cause"):
        chosen_causes([law()])
    with pytest.raises(ValueError, match="`kind` of SomeLaw must not be the id of a cause in the catalogue"):
        chosen_causes([law(kind="cubic_hardening", family="stiffness")])
    with pytest.raises(ValueError, match="`causes` must name causes of the catalogue, or be laws"):
        chosen_causes([3])  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match="`causes` must hold laws with numbers of their own; got AbstractTerm"):
        chosen_causes([AbstractTerm])


FILE = """
import jax.numpy as jnp
import jfsm


class {name}(jfsm.AbstractTerm):
    parameters = (jfsm.Parameter("F", unit="N"),)
    family = "stiffness"

    def force(self, d, w, z, t):
        return self.F * jnp.tanh(d)
"""


def test_the_command_line_finds_laws_in_a_file(tmp_path):
    path = tmp_path / "springs_of_mine.py"
    path.write_text(FILE.format(name="OnceBent"))
    named = causes_named(["coulomb", f"{path}:OnceBent", str(path)])
    assert named is not None and named[0] == "coulomb" and named[1] is named[2] is laws_of(path)["OnceBent"]
    with pytest.raises(ValueError, match=r"--cause must name a law in .*, which holds OnceBent; it was 'Bent'"):
        causes_named([f"{path}:Bent"])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = 1", "defines no law of its own: a class that derives from jfsm.AbstractTerm"),
        ("x = ", "cannot be used: SyntaxError"),
        ("1 / 0", "cannot be used: ZeroDivisionError: division by zero"),
    ],
)
def test_a_file_without_laws_is_refused(tmp_path, text, words):
    (tmp_path / "none_here.py").write_text(text)
    with pytest.raises(ValueError, match=words):
        laws_of(tmp_path / "none_here.py")
    with pytest.raises(FileNotFoundError, match="There is no file of laws"):
        laws_of(tmp_path / "gone.py")


def test_a_model_with_an_own_law_runs_from_the_command_line(tmp_path):
    path = Path(tmp_path) / "laws_for_a_run.py"
    path.write_text(FILE.format(name="TwiceBent"))
    (MODEL + laws_of(path)["TwiceBent"](5.0, at=(0, 1))).save(tmp_path / "model.toml")
    time = np.arange(300) * 0.01
    np.savetxt(
        tmp_path / "run.csv", np.column_stack([time, np.sin(9 * time)]), delimiter=",", header="t,u", comments=""
    )
    words = ["simulate", "run.csv", "--force", "u", "--unit", "u=N", "--at-rest", "--model", "model.toml"]
    words = [str(tmp_path / word) if re.fullmatch(r"\w+\.(csv|toml)", word) else word for word in words]
    done = CliRunner().invoke(app, [*words, "--out", str(tmp_path / "out.csv"), "--laws", str(path)])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "out.csv").is_file()


def test_an_own_law_is_differentiable():
    def pushed(size):
        return TanhSpring(size, 0.02, at=(0, 1)).force(0.01, 0.0, None, 0.0)

    assert jax.grad(pushed)(5.0) == pytest.approx(np.tanh(0.5))
