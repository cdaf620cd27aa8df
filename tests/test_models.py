"""Models as people meet them: the command that makes one, the lists of what may be in one, and how one is printed."""

import equinox as eqx
import jax
import numpy as np
import pytest
from pages import blocks
from typer.testing import CliRunner, Result

import jfsm
from jfsm.cli import app
from jfsm.diagnosis import confused_with


def run(*arguments: str) -> Result:
    return CliRunner().invoke(app, list(arguments))


def refusal(*arguments: str) -> str:
    result = run(*arguments)
    assert result.exit_code == 2 and result.stdout == "", result.output
    return result.stderr


def test_the_pages_commands_files_and_code_do_what_it_says(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    commands = blocks("model-files.md", "sh")
    for command in commands:
        assert command.startswith("jfsm ")
        assert run(*command.split()[1:]).exit_code == 0
    by_hand, two_masses, trusted = blocks("model-files.md", "toml")
    made = jfsm.Structure.load("model.toml")
    assert jfsm.Structure.from_toml(by_hand).values() == made.values()
    assert jfsm.Structure.load("chain.toml").values()["stiffness@1-2.k"] == 240.0
    assert jfsm.Structure.from_toml(two_masses).values()["accel_gain@acceleration-2.eps"] == 0.05
    assert dict(jfsm.Structure.from_toml(trusted).trust) == {"mass": 0.01, "stiffness@0-1.k": 0.05}
    for code in blocks("model-files.md"):
        exec(code, {})
    (shown,) = blocks("model-files.md", "text")
    assert capsys.readouterr().out == shown


def test_a_frequency_and_a_damping_ratio_make_a_model():
    made = jfsm.Structure.from_toml(run("model", "--frequency", "12", "--damping-ratio", "0.02").stdout).values()
    assert made["mass@1"] == 1.0
    assert np.sqrt(made["stiffness@0-1.k"]) == pytest.approx(24 * np.pi)
    assert made["damping@0-1.c"] == pytest.approx(2 * 0.02 * 24 * np.pi)
    heavy = jfsm.Structure.from_toml(run("model", "--mass", "3", "--stiffness", "12", "--damping-ratio", "0.5").stdout)
    assert heavy.values()["damping@0-1.c"] == pytest.approx(6.0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "--stiffness or --frequency must be given, and not both"),
        (["--stiffness", "3", "--frequency", "2"], "--stiffness or --frequency must be given, and not both"),
        (["--stiffness", "3", "--damping", "2", "--damping-ratio", "0.1"], "--damping-ratio must not both be given"),
        (["--stiffness", "3,4", "--damping-ratio", "0.1"], "give --stiffness and --damping for each of the 2"),
        (["--frequency", "0"], "--frequency must be a positive number; it was 0"),
        (
            ["--stiffness", "3,x"],
            "--stiffness must be a number, or numbers with commas between, as 1,2.5; it was '3,x'",
        ),
        (["--mass", "1,2", "--stiffness", "3"], "`stiffness` must have one value per mass (2); got 1"),
    ],
)
def test_what_makes_no_model_is_refused(options, words):
    assert words in refusal("model", *options)


def test_terms_are_listed_with_their_units_and_formulas():
    text = " ".join(run("terms").stdout.split())
    assert "cubic_stiffness k3 [N/m^3]: Cubic spring, force k3·d³" in text
    assert "force_gain eps: The force sensor reads (1 + eps) times the force." in text
    one = run("terms", "coulomb").stdout
    entry = one.partition("[[term]]")[2]
    (term,) = jfsm.Structure.from_toml("mass = [1.0]\n[[term]]" + entry).terms
    assert "friction force" in one and isinstance(term, jfsm.Coulomb)
    assert "There is no kind 'coulom'. Did you mean coulomb or smooth_coulomb?" in refusal("terms", "coulom")


def test_a_cause_is_shown_with_its_formula_units_and_what_it_is_confused_with():
    text = " ".join(run("causes", "stribeck").stdout.split())
    assert "sgn w·(F + (F_static - F)·exp(-(w/v_s)²))" in text and "v_s m/s Stribeck speed" in text
    assert "For some of its numbers it is coulomb" in text
    assert "As dry friction it is confused with coulomb," in text
    assert "There is no cause 'bouc'. Did you mean bouc_wen?" in refusal("causes", "bouc")


@pytest.mark.parametrize("cause", list(jfsm.causes()))
def test_every_cause_can_be_shown(cause):
    result = run("causes", cause)
    assert result.exit_code == 0 and cause in result.stdout and "[1]_" not in result.stdout
    assert all(cause not in words.partition("confused with ")[2].rstrip(".").split(", ")
               for words in confused_with(jfsm.causes()[cause]))  # fmt: skip


def test_a_misspelled_command_is_answered_with_the_one_that_was_meant():
    result = run("diagnos")
    assert result.exit_code == 2 and "'diagnose'" in result.output


def test_a_structure_prints_its_numbers_with_units_and_its_modes():
    chain = jfsm.Structure.chain([1, 1], [120, 240], [0.4, 0.3]).uncertain(stiffness=0.05)
    text = repr(chain + jfsm.Coulomb(0.1, at=(0, 1)))
    found = jfsm.linearise(chain)
    frequency, ratio = found.frequencies[0] / (2 * np.pi), 100 * found.damping_ratios[0]
    assert "  stiffness@1-2.k  240 N/m ± 5 %\n" in text and "  coulomb@0-1.F    0.1 N\n" in text
    assert f"  mode 1           {frequency:.4g} Hz, damping ratio {ratio:.3g} %\n" in text
    assert "Structure of 2 degrees of freedom" in text and str(chain) == repr(chain)


def test_a_large_structure_prints_no_wall_of_numbers():
    text = repr(jfsm.Structure.chain([1.0] * 50, [100.0] * 50))
    assert len(text.splitlines()) == 26 and text.endswith("more; `values()` gives all numbers")


def test_terms_print_as_they_are_written_also_while_they_are_traced():
    assert repr(jfsm.Stribeck(1.0, 2.0, 0.25, at=(0, 1))) == "Stribeck(F=1, F_static=2, v_s=0.25, at=(0, 1))"
    assert repr(jfsm.ForceGain(0.1, at=("force", 1))) == "ForceGain(eps=0.1, at=('force', 1))"
    seen = []
    eqx.filter_jit(lambda model: seen.append(repr(model)))(jfsm.Structure.sdof(1.0, 1.0))
    assert "LinearStiffness(k=" in seen[0]


def test_a_simulation_of_the_users_prints_its_numbers():
    model = jfsm.Simulation(lambda q, v, force, t, p: (force - p["k"] * q) / 2.0, dof=1, parameters={"k": 3.0})
    assert repr(model) == "Simulation of 1 coordinate\n  k  3"
    assert jax.tree.leaves(model)
