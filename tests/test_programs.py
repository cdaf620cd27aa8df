"""Compiled programs on disk: whose folder, how large, and that JAX's settings are the caller's again afterwards."""

import os
from collections.abc import Iterator
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.experimental.compilation_cache.compilation_cache import reset_cache

import jfsm
from jfsm import _programs
from jfsm._programs import make_room, programs_kept

FOLDER, ENABLED, FROM = (
    "jax_compilation_cache_dir",
    "jax_enable_compilation_cache",
    "jax_persistent_cache_min_compile_time_secs",
)


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Iterator[Path]:
    """The user's cache folder, where JAX was told nothing but to keep what compiles fast, too."""
    before = {name: jax.config.values[name] for name in (FOLDER, ENABLED, FROM)}
    monkeypatch.setattr(_programs, "user_cache_path", tmp_path.joinpath)
    _programs.settings.cache_clear()
    for name, value in {FOLDER: None, ENABLED: True, FROM: 0.0}.items():
        jax.config.update(name, value)
    reset_cache()
    yield tmp_path / "jfsm"
    for name, value in before.items():
        jax.config.update(name, value)
    reset_cache()
    _programs.settings.cache_clear()


def compiled_in(folder: Path, length: int) -> bool:
    """Whether a program that is compiled now, for so many numbers, is kept in the folder."""
    before = len(list(folder.glob("*-cache")))
    jax.block_until_ready(jax.jit(lambda x: jnp.cumsum(jnp.sin(x)))(np.ones(length)))
    return len(list(folder.glob("*-cache"))) > before


def test_a_program_is_kept_while_it_lasts_and_not_afterwards(folder):
    with programs_kept():
        assert compiled_in(folder, 101)
    assert jax.config.values[FOLDER] is None
    assert not compiled_in(folder, 102)


def test_what_compiles_fast_is_not_kept_unless_the_user_says_so(folder):
    jax.config.update(FROM, 1.0)  # as JAX has it
    with programs_kept():
        assert jax.config.values[FROM] == 0.2
    assert jax.config.values[FROM] == 1.0


def test_the_settings_are_put_back_after_an_error(folder):
    with pytest.raises(ZeroDivisionError), programs_kept():
        raise ZeroDivisionError
    assert jax.config.values[FOLDER] is None


def test_of_calls_that_overlap_the_last_one_puts_the_settings_back(folder):
    first, second = programs_kept(), programs_kept()
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)
    assert compiled_in(folder, 103)
    second.__exit__(None, None, None)
    assert jax.config.values[FOLDER] is None


def test_a_folder_that_the_user_chose_stays_the_one(folder, tmp_path):
    own = tmp_path / "own"
    jax.config.update(FOLDER, str(own))
    with programs_kept():
        assert compiled_in(own, 104)
    assert jax.config.values[FOLDER] == str(own)
    assert not folder.exists()


def test_nothing_is_kept_where_jax_is_told_so(folder):
    jax.config.update(ENABLED, False)
    with programs_kept():
        assert not compiled_in(folder, 105)
    assert not folder.exists()


def test_a_folder_that_cannot_be_made_keeps_nothing_and_nobody_from_working(folder):
    folder.write_text("in the way")
    with programs_kept():
        assert jax.config.values[FOLDER] is None


@pytest.mark.parametrize("call", [jfsm.diagnose, jfsm.map_force])
def test_a_call_that_compiles_much_keeps_its_programs(folder, monkeypatch, call):
    seen = []
    monkeypatch.setattr(jfsm.Record, "channels", property(lambda self: seen.append(jax.config.values[FOLDER]) or 1 / 0))
    time = 0.05 * np.arange(200)
    record = jfsm.Record(time, force=np.sin(time), displacement=np.cos(time))
    with pytest.raises(ZeroDivisionError):
        call(record, jfsm.Structure.sdof(1.0, 9.0, 0.1))
    assert set(seen) == {str(folder)}


def test_what_was_not_used_for_longest_goes_first(tmp_path):
    for age, name in enumerate(["new", "old", "older"]):
        path = tmp_path / f"{name}-cache"
        path.write_bytes(bytes(100))
        os.utime(path, (1e9 - age, 1e9 - age))
    (tmp_path / "notes.txt").write_bytes(bytes(1000))
    os.utime(tmp_path / "older-cache", (2e9, 1e9))  # read since
    make_room(tmp_path, most=200)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["new-cache", "notes.txt", "older-cache"]
    make_room(tmp_path, most=200)
    assert len(list(tmp_path.iterdir())) == 3
