"""Structures: what they are made of, how their numbers are named, and what a model file may hold."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any, cast

import jax.numpy as jnp
import numpy as np
import pytest

import jfsm
from jfsm.plant import direction, lower, smooth_force
from jfsm.structures import AbstractTerm, AccelerationGain, ForceGain, MapTerm, Offset
from jfsm.structures.terms import TERMS
from jfsm.surrogates import tabulate

LAWS = {
    "stiffness": lambda p, d, w: p * d,
    "damping": lambda p, d, w: p * w,
    "cubic_stiffness": lambda p, d, w: p * d**3,
    "quadratic_stiffness": lambda p, d, w: p * d**2,
    "quadratic_damping": lambda p, d, w: p * w * abs(w),
}


def full() -> jfsm.Structure:
    """Two masses with a term of every law, two of them alike, and every sensor effect."""
    model = jfsm.Structure.chain(mass=[1.5, 0.25], stiffness=[120.0, 240.0], damping=[0.4, 0.3])
    model = model + jfsm.CubicStiffness(-10.0, at=(0, 1)) + jfsm.CubicStiffness(3.0, at=(0, 1))
    model = model + jfsm.QuadraticStiffness(2.0, at=(2, 1)) + jfsm.QuadraticDamping(0.6, at=(0, 2))
    model = model + jfsm.Coulomb(7.0, at=(1, 2)) + ForceGain(0.1, at=("force", 2))
    return model + AccelerationGain(-0.05, at=("acceleration", 1)) + Offset(0.02, at=("displacement", 2))


@pytest.mark.parametrize("law", [law for law in TERMS if law.kind in LAWS], ids=lambda law: law.kind)
@pytest.mark.parametrize("at", [(0, 1), (0, 2), (1, 2), (2, 1), (2, 0)])
def test_a_term_pulls_both_ends_of_its_link_with_equal_and_opposite_force(law, at):
    x, v = np.array([0.3, -0.8]), np.array([1.1, 0.2])
    motion, speed = np.array([0.0, *x]), np.array([0.0, *v])
    expected = LAWS[law.kind](1.7, motion[at[1]] - motion[at[0]], speed[at[1]] - speed[at[0]])
    forces = np.zeros(3)
    forces[at[1]] += expected
    forces[at[0]] -= expected
    plant = lower(jfsm.Structure([1.0, 1.0], [law(1.7, at=at)]))
    found = smooth_force(plant, jnp.asarray(x), jnp.asarray(v), jnp.zeros(0), jnp.asarray(0.0))
    np.testing.assert_allclose(found, forces[1:], rtol=1e-14, atol=1e-15)


def test_the_direction_of_a_link_is_the_difference_of_its_ends_with_ground_at_rest():
    assert direction((0, 2), 3).tolist() == [0, 1, 0]
    assert direction((1, 3), 3).tolist() == [-1, 0, 1]


def test_a_chain_has_the_matrices_of_springs_in_a_row():
    plant = lower(jfsm.Structure.chain(mass=[1, 2], stiffness=[120, 240], damping=[0.4, 0.3]))
    assert np.array_equal(plant.mass, np.diag([1.0, 2.0]))
    assert np.array_equal(plant.stiffness, [[360.0, -240.0], [-240.0, 240.0]])
    np.testing.assert_allclose(plant.damping, [[0.7, -0.3], [-0.3, 0.3]], rtol=1e-15)


def test_one_mass_is_a_chain_of_one():
    assert jfsm.Structure.sdof(2.0, 9.0, 0.1).values() == jfsm.Structure.chain([2.0], [9.0], [0.1]).values()
    assert jfsm.Structure.sdof(mass=2.0, stiffness=9.0).values()["damping@0-1.c"] == 0.0


def test_numbers_are_named_by_path_and_equal_laws_at_one_link_are_counted():
    values = full().values()
    assert values["mass@2"] == 0.25
    assert values["stiffness@1-2.k"] == 240.0
    assert (values["cubic_stiffness@0-1.k3"], values["cubic_stiffness@0-1.k3#2"]) == (-10.0, 3.0)
    assert values["force_gain@force-2.eps"] == 0.1
    assert values["offset@displacement-2.b"] == 0.02


def test_a_bare_kind_selects_all_of_it_and_a_path_only_itself():
    model = full()
    assert model.select("mass") == ("mass@1", "mass@2")
    assert model.select("stiffness") == ("stiffness@0-1.k", "stiffness@1-2.k")
    assert model.select("stiffness@0-1") == ("stiffness@0-1.k",)
    assert model.select("mass@2") == ("mass@2",)
    assert model.select("cubic") == model.select("") == model.select("stiff.*") == ()


def test_the_path_of_a_place_does_not_select_places_that_begin_alike():
    chain = jfsm.Structure.chain(mass=np.ones(12), stiffness=np.ones(12))
    assert chain.select("mass@1") == ("mass@1",)
    assert chain.select("stiffness@1-2") == ("stiffness@1-2.k",)


@pytest.mark.parametrize("path", list(full().values()))
def test_changing_one_number_changes_no_other(path):
    model = full()
    changed = model.with_values({path: 0.321})
    assert changed.values() == {**model.values(), path: 0.321}
    assert model.values()[path] != 0.321, "the structure itself must stay as it is"


def test_the_diagonal_of_a_mass_matrix_can_be_changed():
    model = jfsm.Structure([[2.0, 0.5], [0.5, 1.0]]).with_values({"mass@2": 3.0})
    assert np.array_equal(model.mass, [[2.0, 0.5], [0.5, 3.0]])


def test_adding_leaves_the_structure_as_it_was():
    model = jfsm.Structure.sdof(1.0, 9.0, 0.1).uncertain(stiffness=0.05)
    longer = model + jfsm.Coulomb(1.0, at=(0, 1)) + Offset(0.1, at=("velocity", 1))
    assert (len(model.terms), len(model.sensors)) == (2, 0)
    assert (len(longer.terms), len(longer.sensors)) == (3, 1)
    assert longer.trust == model.trust == (("stiffness", 0.05),)


def test_trust_stated_later_adds_to_what_was_stated_before():
    model = jfsm.Structure.sdof(1.0, 9.0, 0.1).uncertain(stiffness=0.05, mass=0.3).uncertain(mass=0.1)
    assert dict(model.trust) == {"stiffness": 0.05, "mass": 0.1}


def test_links_are_the_places_that_carry_a_term_each_once():
    assert full().links == ((0, 1), (1, 2), (2, 1), (0, 2))


def test_descriptions_state_every_number_with_the_unit_of_the_record():
    lines = full().describe({"force": "V", "displacement": "mm"})
    assert len(lines) == len(full().values())
    assert "cubic_stiffness@0-1.k3 = -10 V/mm^3" in lines
    assert "quadratic_damping@0-2.c2 = 0.6 V s^2/mm^2" in lines
    assert "mass@1 = 1.5 V s^2/mm" in lines
    assert "force_gain@force-2.eps = 0.1 1" in lines
    assert "mass@1 = 1.5 kg" in full().describe()
    assert "damping@0-1.c = 0.4 N s/m" in full().describe()


SPRING = jfsm.LinearStiffness(1.0, at=(0, 1))


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: jfsm.Structure([-1.0]), ValueError, r"`mass` must hold at least one mass, none negative; got \[-1\.0"),
        (lambda: jfsm.Structure.sdof(-2.0, 9.0), ValueError, r"`mass` must hold .* none negative; got \[-2\.0\]"),
        (lambda: jfsm.Structure([]), ValueError, "`mass` must hold at least one mass"),
        (lambda: jfsm.Structure([[1.0, 0.5], [0.0, 1.0]]), ValueError, "`mass` as a matrix must be square and symm"),
        (lambda: jfsm.Structure(np.zeros((0, 0))), ValueError, "`mass` as a matrix must be square and symmetric"),
        (lambda: jfsm.Structure([[1.0, 2.0], [2.0, 1.0]]), ValueError, "must be positive definite; .* is -1"),
        (lambda: jfsm.Structure([np.nan]), ValueError, "`mass` must be finite; 1 of 1 values"),
        (lambda: jfsm.Structure(["one"]), TypeError, "`mass` must hold real numbers"),
        (
            lambda: jfsm.Structure([1.0], cast(Any, [3.0])),
            TypeError,
            r"`terms` must hold terms such as jfsm\.LinearStiffness",
        ),
        (
            lambda: jfsm.Structure([1.0], sensors=cast(Any, [SPRING])),
            TypeError,
            "`sensors` must hold sensor effects such as",
        ),
        (lambda: jfsm.Structure([1.0], [jfsm.Coulomb(1.0, at=(1, 2))]), ValueError, r"\(1, 2\) of coulomb names a deg"),
        (lambda: jfsm.Structure([1.0]) + Offset(1.0, at=("force", 2)), ValueError, "of offset names a degree of free"),
        (lambda: jfsm.Structure([1.0]) + 3.0, TypeError, "unsupported operand"),  # pyright: ignore[reportOperatorIssue]
        (
            lambda: jfsm.Structure.chain([1, 1], [1.0]),
            ValueError,
            r"`stiffness` must have one value per mass \(2\); go",
        ),
        (lambda: jfsm.Structure.chain([1], [1], [1, 2]), ValueError, r"`damping` must have one value per mass \(1\)"),
        (lambda: SPRING.__class__(1.0, at=(1, 1)), ValueError, r"`at` must name two different degrees of freedom"),
        (lambda: SPRING.__class__(1.0, at=(-1, 1)), ValueError, r"`at` must name two different degrees of freedom"),
        (lambda: SPRING.__class__(1.0, at=(0.0, 1.5)), ValueError, r"`at` must be a pair .* got \(0\.0, 1\.5\)"),
        (lambda: SPRING.__class__(1.0, at="01"), ValueError, r"`at` must be a pair \(i, j\)"),
        (lambda: SPRING.__class__(1.0, at=1), ValueError, r"`at` must be a pair \(i, j\)"),
        (lambda: SPRING.__class__("9", at=(0, 1)), TypeError, "A parameter must be a real number; got '9'"),
        (lambda: SPRING.__class__(np.ones(2), at=(0, 1)), TypeError, "A parameter must be one real number"),
        (lambda: SPRING.__class__(np.inf, at=(0, 1)), ValueError, "A parameter must be finite; got inf"),
        (lambda: jfsm.Coulomb(-1.0, at=(0, 1)), ValueError, "`F` of coulomb must not be negative; got -1"),
        (lambda: ForceGain(0.1, at=("displacement", 1)), ValueError, r"`at` of force_gain must be \(force, degree"),
        (lambda: AccelerationGain(0.1, at=("acceleration", 0)), ValueError, "degree of freedom from 1"),
        (
            lambda: Offset(0.1, at=("strain", 1)),
            ValueError,
            "`at` of offset must be .force or displacement or velocity",
        ),
        (lambda: Offset(0.1, at=("force", 1.5)), ValueError, r"`at` of a sensor effect must be \(kind, degree"),
        (
            lambda: full().with_values({"mass@9": 1.0}),
            ValueError,
            "'mass@9' names no parameter of this structure; it h",
        ),
        (lambda: full().with_values({"mass@1": -1.0}), ValueError, "`mass` must hold at least one mass, none negative"),
        (lambda: full().with_values({"coulomb@1-2.F": -1.0}), ValueError, "`F` of coulomb must not be negat"),
        (lambda: full().with_values({"damping@0-1.c": np.nan}), ValueError, "A parameter must be finite; got nan"),
        (lambda: full().uncertain(stiffness=0), ValueError, "uncertainty of `stiffness` must be a positive share"),
        (lambda: full().uncertain(stifness=0.1), ValueError, "`stifness` names no parameter of this structure"),
    ],
)
def test_what_cannot_be_a_structure_is_refused_with_the_reason(make, error, message):
    with pytest.raises(error, match=message):
        make()


def test_a_file_gives_the_structure_back_exactly(tmp_path):
    model = full().with_values({"stiffness@0-1.k": 100 / 3}).uncertain(stiffness=0.05, **{"damping@0-1.c": 0.5})
    model.save(tmp_path / "model.toml")
    loaded = jfsm.Structure.load(tmp_path / "model.toml")
    assert loaded.values() == model.values()
    assert loaded.trust == model.trust
    assert [(type(p), p.at) for p in loaded.terms + loaded.sensors] == [
        (type(p), p.at) for p in model.terms + model.sensors
    ]


def test_a_structure_is_a_text_as_it_is_a_file_unless_it_has_a_map(tmp_path):
    full().save(tmp_path / "model.toml")
    assert full().to_toml() == (tmp_path / "model.toml").read_text()
    assert jfsm.Structure.from_toml(full().to_toml()).values() == full().values()
    with pytest.raises(ValueError, match="A structure with a map, at 0-1, needs files"):
        (full() + learned().on((0, 1))).to_toml()


def test_a_file_keeps_a_mass_matrix(tmp_path):
    jfsm.Structure([[2.0, 0.5], [0.5, 1.0]]).save(tmp_path / "model.toml")
    assert np.array_equal(jfsm.Structure.load(tmp_path / "model.toml").mass, [[2.0, 0.5], [0.5, 1.0]])


def test_saving_leaves_nothing_but_the_file_and_lets_others_read_it_as_any_new_file(tmp_path):
    full().save(tmp_path / "model.toml")
    (tmp_path / "plain").touch()
    assert {path.name for path in tmp_path.iterdir()} == {"model.toml", "plain"}
    assert (tmp_path / "model.toml").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_a_function_in_place_of_a_map_is_not_written_and_the_file_that_was_there_stays(tmp_path):
    path: Path = tmp_path / "model.toml"
    path.write_text("mass = [1.0]\n")
    with pytest.raises(
        ValueError, match=r"A structure can be written if its maps are those of jfsm.*the map at 0-1 is"
    ):
        (full() + learned().on((0, 1)) + MapTerm(jnp.sum, at=(0, 1))).save(path)
    assert path.read_text() == "mass = [1.0]\n" and list(tmp_path.iterdir()) == [path]


def learned(slope: float = 3.0) -> jfsm.Polynomial:
    states = np.random.default_rng(1).uniform(-1, 1, (40, 2))
    return jfsm.Polynomial.fit(states, slope * states[:, 0] + states[:, 1] ** 3)


def test_maps_are_kept_in_files_beside_the_structure(tmp_path):
    model = full() + learned().on((0, 1)) + tabulate(learned(5.0), nodes=8).on((1, 2))
    model.save(tmp_path / "model.toml")
    assert {path.name for path in tmp_path.iterdir()} == {"model.toml", "model.map.npz", "model.map2.npz"}
    (tmp_path / "elsewhere").mkdir()
    for path in list(tmp_path.glob("model.*")):
        path.rename(tmp_path / "elsewhere" / path.name)
    loaded = jfsm.Structure.load(tmp_path / "elsewhere" / "model.toml")
    assert [(type(p), p.at) for p in loaded.terms] == [(type(p), p.at) for p in model.terms]
    d, w = jnp.asarray(0.3), jnp.asarray(-0.2)
    for mine, theirs in zip(loaded.terms[-2:], model.terms[-2:], strict=True):
        assert mine.force(d, w, (), d) == theirs.force(d, w, (), d)


@pytest.mark.parametrize("front", ["from jfsm import Structure", "from jfsm.structures import Structure"])
def test_a_structure_with_a_map_loads_before_anything_else_is_imported(tmp_path, front):
    path = tmp_path / "model.toml"
    (jfsm.Structure([1.0]) + learned().on((0, 1))).save(path)
    program = f"""import sys, jax
jax.config.update("jax_enable_x64", True)
{front}
assert "jfsm.surrogates" not in sys.modules
print(Structure.load({str(path)!r}).terms[0].force_map.dim)"""
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert run.stdout.strip() == "2", run.stderr


def test_a_structure_and_its_maps_are_written_together_or_not_at_all(tmp_path, monkeypatch):
    def full_disk(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full_disk)
    with pytest.raises(OSError, match="No space left on device"):
        (full() + learned().on((0, 1))).save(tmp_path / "model.toml")
    assert list(tmp_path.iterdir()) == []


MAP = 'mass = [1.0]\n[[term]]\nkind = "map"\nat = [0, 1]\n'


@pytest.mark.parametrize(
    ("toml", "error", "words"),
    [
        (MAP, ValueError, r"model\.toml, term 1: map takes file; got nothing\."),
        (MAP + 'file = "map.npz"\nk = 3.0', ValueError, r"model\.toml, term 1: map takes file; got file, k\."),
        (
            MAP + "file = 3",
            ValueError,
            r"model\.toml, term 1: `file` must name the file of a map, as file = .*; got 3\.",
        ),
        (MAP + 'file = "none.npz"', FileNotFoundError, r"There is no map file .*none\.npz; write one with"),
        (MAP + 'file = "model.toml"', ValueError, r"model\.toml, term 1: .*model\.toml must be a map that"),
        (MAP.replace("[0, 1]", "[0, 2]") + 'file = "map.npz"', ValueError, r"names a degree of freedom beyond"),
        (MAP + 'file = "four.npz"', ValueError, r"model\.toml, term 1: `on` needs a map of one displacement and one"),
    ],
)
def test_a_term_that_names_no_map_is_refused(toml, error, words, tmp_path):
    learned().save(tmp_path / "map.npz")
    states = np.random.default_rng(1).uniform(-1, 1, (40, 4))
    jfsm.Polynomial.fit(states, states[:, 0], order=1).save(tmp_path / "four.npz")
    (tmp_path / "model.toml").write_text(toml)
    with pytest.raises(error, match=words):
        jfsm.Structure.load(tmp_path / "model.toml")


def test_whole_numbers_in_a_file_are_read_as_numbers(tmp_path):
    (tmp_path / "model.toml").write_text('mass = 2\n[[term]]\nkind = "stiffness"\nat = [0, 1]\nk = 9\n')
    assert jfsm.Structure.load(tmp_path / "model.toml").values() == {"mass@1": 2.0, "stiffness@0-1.k": 9.0}


TERM = 'mass = [1.0]\n[[term]]\nkind = "stiffness"\nat = [0, 1]\n'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mass = [", r"model\.toml is not a TOML file"),
        ("\xff", r"model\.toml is not a TOML file"),
        ("k = 1.0", r"model\.toml: unknown entry 'k'; a model has mass, commands, term, sensor, uncertain\."),
        ("", r"model\.toml: `mass` is missing; write e\.g\. mass = \[1\.0\]"),
        ("mass = [-1.0]", r"model\.toml: `mass` must hold at least one mass, none negative"),
        ('mass = "heavy"', r"model\.toml: `mass` must hold real numbers"),
        ("mass = [[1.0], [1.0, 2.0]]", r"model\.toml: .*inhomogeneous"),
        ("mass = [1.0]\nterm = 3", r"model\.toml: terms stand under \[\[term\]\], in double brackets"),
        ('mass = [1.0]\n[term]\nkind = "stiffness"', r"model\.toml: terms stand under \[\[term\]\]"),
        ('mass = [1.0]\n[sensor]\nkind = "offset"', r"model\.toml: sensors stand under \[\[sensor\]\]"),
        ('mass = [1.0]\n[[term]]\nkind = "spring"', r"model\.toml, term 1: `kind` must be one of stiffness, damping, "),
        ("mass = [1.0]\n[[sensor]]\nb = 1.0", r"sensor 1: `kind` must be one of force_gain, .*; got None"),
        (TERM, "term 1: stiffness takes k; got nothing"),
        (TERM + "k = 1.0\nc = 2.0", "term 1: stiffness takes k; got k, c"),
        (TERM + 'k = "soft"', "term 1: A parameter must be a real number; got 'soft'"),
        (TERM + "k = true", "term 1: A parameter must be a real number; got True"),
        (TERM + "k = nan", "term 1: A parameter must be finite"),
        (TERM.replace("[0, 1]", "[0, 0]") + "k = 1.0", "term 1: `at` must name two different degrees of freedom"),
        (TERM.replace("at = [0, 1]\n", "") + "k = 1.0", r"term 1: `at` must be a pair .* got None"),
        (TERM.replace("[0, 1]", "[0, 2]") + "k = 1.0", r"model\.toml: `at`=\(0, 2\) of stiffness names a degree of"),
        ("mass = [1.0]\nuncertain = 0.1", r"\[uncertain\] must hold shares such as stiffness = 0\.05; got 0\.1"),
        ('mass = [1.0]\n[uncertain]\nmass = "a"', r"\[uncertain\] must hold shares"),
        ("mass = [1.0]\n[uncertain]\nmas = 0.1", r"model\.toml: `mas` names no parameter of this structure"),
        ("mass = [1.0]\n[uncertain]\nmass = -0.1", r"model\.toml: The uncertainty of `mass` must be a positive share"),
    ],
)
def test_a_wrong_model_file_is_refused_with_its_name_and_the_entry(tmp_path, text, message):
    (tmp_path / "model.toml").write_bytes(text.encode("latin-1"))
    with pytest.raises(ValueError, match=message):
        jfsm.Structure.load(tmp_path / "model.toml")


def test_a_missing_model_file_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"There is no model file .*none\.toml; write one with"):
        jfsm.Structure.load(tmp_path / "none.toml")


EFFECTS = [name for name, cause in jfsm.causes().items() if not cause.is_value]


@pytest.mark.parametrize("cause", EFFECTS)
def test_every_cause_builds_its_effect_and_extends_a_model_by_it(cause):
    entry = jfsm.causes()[cause]
    assert entry.id == cause
    names = [p.name for p in entry.effect.parameters]
    numbers = dict.fromkeys(names, 0.5) | ({names[0]: -0.5} if entry.sign < 0 else {})
    place = (entry.effect.channels[0], 1) if entry.is_sensor else (0, 1)
    model = jfsm.Structure([1.0]) if cause.startswith("missing") else jfsm.Structure.sdof(1.0, 9.0)
    extended = entry.apply(model, place, **numbers)
    assert set(extended.values().items()) - set(model.values().items()) == {
        (f"{entry.effect.kind}@{place[0]}-{place[1]}.{name}", value) for name, value in numbers.items()
    }
    assert isinstance(extended.terms[-1], AbstractTerm) or entry.is_sensor
    with pytest.raises(TypeError, match=f"{cause} takes {', '.join(names)}; got nothing"):
        entry.apply(model, place)
    with pytest.raises(TypeError, match=f"{cause} takes {', '.join(names)}; got force"):
        entry.apply(model, place, force=1.0)
    if entry.sign:
        with pytest.raises(ValueError, match=f"`{names[0]}` of {cause} must be (positive|negative); got"):
            entry.apply(model, place, **numbers | {names[0]: -numbers[names[0]]})


@pytest.mark.parametrize(("cause", "at", "path"), [
    ("stiffness_value", (0, 1), "stiffness@0-1.k"),
    ("damping_value", (0, 1), "damping@0-1.c"),
    ("mass_value", (1,), "mass@1"),
])  # fmt: skip
def test_a_wrong_value_is_a_cause_that_replaces_it(cause, at, path):
    model = jfsm.Structure.sdof(1.0, 9.0, 0.1)
    name = jfsm.causes()[cause].effect.parameters[0].name
    changed = jfsm.causes()[cause].apply(model, at, **{name: 7.0})
    assert changed.values() == model.values() | {path: 7.0}
    with pytest.raises(ValueError, match=f"`at` of {cause} must be where the model has one; got"):
        jfsm.causes()[cause].apply(model, (5,), **{name: 7.0})
    with pytest.raises(TypeError, match=f"{cause} takes {name}; got q"):
        jfsm.causes()[cause].apply(model, at, q=1.0)


def test_the_term_of_a_cause_is_what_is_added():
    term = jfsm.causes()["coulomb"].term(at=(0, 1), F=20.3)
    assert isinstance(term, jfsm.Coulomb)
    assert (float(term.F), term.at) == (20.3, (0, 1))
