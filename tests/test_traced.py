"""Traced programs on disk: when one is found again, when it must not be, and that answers are those of the function."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.experimental.compilation_cache.compilation_cache import reset_cache

import jfsm
from jfsm import _traced
from jfsm._traced import jit_kept, kept_result
from jfsm.plant import force_along, lower

SETTINGS = "jax_compilation_cache_dir", "jax_enable_compilation_cache"


class Pair(NamedTuple):
    sums: jax.Array
    rest: tuple[jax.Array, ...]


kept_result(Pair)


@pytest.fixture
def folder(tmp_path):
    before = {name: jax.config.values[name] for name in SETTINGS}
    jax.config.update(SETTINGS[0], str(tmp_path))
    reset_cache()
    yield tmp_path
    for name, value in before.items():
        jax.config.update(name, value)
    reset_cache()


def files(folder):
    return sorted(folder.glob("*-traced"))


class Traced:
    """A function as a process has it, and how often it was traced there."""

    def __init__(self, scale=2.0, ours=True):
        self.times = 0

        def pair(x, *, power: int, nothing=None) -> Pair:
            self.times += 1
            return Pair(scale * jnp.cumsum(x**power), (x[:1], jnp.zeros(0)))

        pair.__qualname__ = "pair"
        pair.__module__ = "jfsm.pair" if ours else "somebody.pair"
        self.call = jit_kept(pair)


def is_right(found, x, power=2):
    np.testing.assert_allclose(found.sums, 2.0 * np.cumsum(x**power), rtol=1e-12)
    assert isinstance(found, Pair) and isinstance(found.rest, tuple) and found.rest[1].shape == (0,)


def test_a_process_does_not_trace_again_what_an_earlier_one_has(folder):
    first, later = Traced(), Traced()
    x, other = np.linspace(0.0, 1.0, 7), np.linspace(2.0, 3.0, 7)
    is_right(first.call(x, power=2), x)
    is_right(first.call(other, power=2), other)
    is_right(later.call(other, power=2), other)
    assert (first.times, later.times) == (1, 0)
    assert len(files(folder)) == 1


@pytest.mark.parametrize(
    "call", [lambda f, x: f(x, power=3), lambda f, x: f(x[1:], power=2), lambda f, x: f(x.astype(np.float32), power=2)]
)
def test_another_number_shape_or_type_is_another_program(folder, call):
    x = np.linspace(0.0, 1.0, 7)
    Traced().call(x, power=2)
    later = Traced()
    call(later.call, x)
    assert later.times == 1 and len(files(folder)) == 2


def test_another_source_is_another_program(folder, monkeypatch):
    x = np.linspace(0.0, 1.0, 7)
    Traced(scale=3.0).call(x, power=2)
    monkeypatch.setattr(_traced, "_versions", lambda: "of another source")
    is_right(Traced().call(x, power=2), x)


@pytest.mark.parametrize(
    "damage", [lambda held: b"", lambda held: held[:-1], lambda held: held[:40] + b"?" + held[41:]]
)
def test_a_damaged_file_is_traced_again_and_mended(folder, damage):
    x = np.linspace(0.0, 1.0, 7)
    Traced().call(x, power=2)
    (path,) = files(folder)
    path.write_bytes(damage(path.read_bytes()))
    again, later = Traced(), Traced()
    is_right(again.call(x, power=2), x)
    is_right(later.call(x, power=2), x)
    assert (again.times, later.times) == (1, 0)
    assert [each.name for each in folder.iterdir() if each.name.startswith("tmp") or each.suffix == ".part"] == []


def test_what_is_not_of_this_package_is_not_kept(folder):
    x = np.linspace(0.0, 1.0, 7)
    is_right(Traced(ours=False).call(x, power=2), x)
    for nothing in (np.sum.__get__, Traced):  # neither says all of itself by a name
        Traced().call(x, power=2, nothing=nothing)
    assert not files(folder)


def test_what_is_made_inside_a_function_is_not_kept(folder):
    def made(scale):
        def local(x):
            return scale * x

        local.__module__ = "jfsm.made"
        return local

    def applied(function, x):
        return function(x)

    applied.__module__, applied.__qualname__ = "jfsm.made", "applied"
    for scale in (2.0, 3.0):
        assert jit_kept(applied)(made(scale), np.ones(3)) == pytest.approx(scale * np.ones(3))
    assert not files(folder)


def test_nothing_is_kept_where_the_source_cannot_be_read(folder, monkeypatch):
    monkeypatch.setattr(_traced, "_SOURCE", folder / "nowhere")
    _traced._versions.cache_clear()
    is_right(Traced().call(np.ones(3), power=2), np.ones(3))
    assert not files(folder)
    _traced._versions.cache_clear()


def test_laws_of_the_user_are_not_kept_and_those_of_the_library_are(folder):
    class Mine(jfsm.CubicStiffness):
        kind = "mine"

        def force(self, d, w, z, t):
            return 7.0 * super().force(d, w, z, t)

    time = 0.1 * np.arange(41)
    x = np.sin(time)[:, None]
    found = {}
    for law in (Mine, jfsm.CubicStiffness):
        plant = lower(jfsm.Structure.sdof(1.0, 9.0, 0.1) + law(2.0, at=(0, 1)))
        found[law] = np.asarray(jit_kept(force_along.__wrapped__)(plant, x, 0 * x, time, substeps=4))
        assert len(files(folder)) == (law is jfsm.CubicStiffness)
    np.testing.assert_allclose(found[Mine], 7.0 * found[jfsm.CubicStiffness], rtol=1e-12)
    np.testing.assert_allclose(found[jfsm.CubicStiffness], 2.0 * x**3, rtol=1e-12)


def test_nothing_is_kept_where_jax_keeps_nothing(folder):
    jax.config.update(SETTINGS[1], False)
    is_right(Traced().call(np.ones(3), power=2), np.ones(3))
    jax.config.update(SETTINGS[1], True)
    jax.config.update(SETTINGS[0], None)
    is_right(Traced().call(np.ones(3), power=2), np.ones(3))
    assert not files(folder)


def test_it_has_derivatives_and_lanes(folder):
    function = Traced().call
    x = np.array([1.0, 2.0, 3.0])
    slope = jax.grad(lambda x: function(x, power=2).sums[-1])(jnp.asarray(x))
    np.testing.assert_allclose(slope, 4.0 * x, rtol=1e-12)
    is_right(function(x, power=2), x)
    lanes = jax.vmap(lambda x: function(x, power=2).sums)(jnp.stack([x, 2 * x]))
    np.testing.assert_allclose(lanes[1], 4 * lanes[0], rtol=1e-12)
    slope = jax.jit(jax.grad(lambda x: function(x, power=3).sums[-1]))(jnp.asarray(x))
    np.testing.assert_allclose(slope, 6.0 * x**2, rtol=1e-12)


def test_an_error_of_the_function_is_its_own(folder):
    def failing(x):
        raise ZeroDivisionError("of this function")

    failing.__module__, failing.__qualname__ = "jfsm.failing", "failing"
    with pytest.raises(ZeroDivisionError, match="of this function"):
        jit_kept(failing)(np.ones(3))


def test_threads_that_ask_for_the_same_trace_it_once(folder):
    function, x = Traced(), np.linspace(0.0, 1.0, 7)
    with ThreadPoolExecutor(4) as pool:
        for found in pool.map(lambda x: function.call(x, power=2), [x] * 8):
            is_right(found, x)
    assert function.times == 1


ON_TWO_DEVICES = """
import jax, numpy as np
jax.config.update("jax_enable_x64", True)
from jfsm._traced import jit_kept

def twice(x):
    return 2 * x

twice.__module__ = "jfsm.twice"
call = jit_kept(twice)
first, second = jax.devices()
for device in (first, second, first):
    assert call(jax.device_put(np.ones(3), device)).devices() == {device}
with jax.default_device(second):
    assert call(np.ones(3)).devices() == {second}
print("right")
"""


def test_each_device_has_its_own(tmp_path):
    settings = {"XLA_FLAGS": "--xla_force_host_platform_device_count=2", "JAX_COMPILATION_CACHE_DIR": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", ON_TWO_DEVICES], capture_output=True, text=True, check=False, env=os.environ | settings
    )
    assert done.stdout.strip() == "right", done.stderr
    assert len(files(tmp_path)) == 1
