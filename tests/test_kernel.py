"""A loop that is one kernel gives what the loop gives, and where XLA refuses a kernel there is none."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jfsm import _traced
from jfsm.plant import _kernel, as_one_kernel, jit_with_kernels

MATRIX = np.array([[2.0, 0.3, 0.0], [0.1, 3.0, 0.2], [0.0, 0.5, 2.5]])


@pytest.fixture(autouse=True)
def not_refused_yet(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_kernel, "_refused", False)


def test_sums_and_products_are_one_kernel():
    @jit_with_kernels
    def powers(_, matrix, *, one_kernel):
        def loop(matrix, empty, start):
            return jax.lax.scan(lambda x, _: (jnp.sum(matrix * x[None, :], 1), x), start, jnp.arange(5))[1], empty

        return (as_one_kernel(loop) if one_kernel else loop)(matrix, jnp.zeros((0, 2)), jnp.ones(3))

    expected = [np.linalg.matrix_power(MATRIX, k) @ np.ones(3) for k in range(5)]
    found, empty = powers(None, jnp.asarray(MATRIX))
    np.testing.assert_allclose(found, expected, rtol=1e-14)
    assert empty.shape == (0, 2) and not _kernel._refused


def test_where_xla_refuses_a_kernel_the_ordinary_loop_serves():
    """A system of equations is solved by a library, which a kernel cannot call."""
    asked = []

    @jit_with_kernels
    def powers(_, matrix, *, one_kernel):
        asked.append(one_kernel)

        def loop(matrix, start):
            return jax.lax.scan(lambda x, _: (jnp.linalg.solve(matrix, x), x), start, jnp.arange(5))[1]

        return (as_one_kernel(loop) if one_kernel else loop)(matrix, jnp.ones(3))

    expected = [np.linalg.matrix_power(np.linalg.inv(MATRIX), k) @ np.ones(3) for k in range(5)]
    for _ in range(2):
        np.testing.assert_allclose(powers(None, jnp.asarray(MATRIX)), expected, rtol=1e-13)
    assert asked == [True, False] and _kernel._refused


def test_other_errors_are_not_taken_for_a_refusal():
    @jit_with_kernels
    def root(_, x, *, one_kernel):
        return eqx.error_if(x, x < 0, "no such root") ** 0.5

    with pytest.raises(RuntimeError, match="no such root"):
        root(None, jnp.array(-1.0))
    assert not _kernel._refused and root(None, jnp.array(4.0)) == 2.0


def test_programs_are_compiled_once_and_those_not_used_for_long_are_dropped(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(_traced, "_KEPT", 2)
    compiled = []

    @jit_with_kernels
    def total(size, x, *, one_kernel):
        compiled.append(size)
        return jnp.sum(x)

    for size in (1, 2, 1, 3, 1, 2):  # 2 has not been used for long when 3 comes
        assert total(size, jnp.ones(4)) == 4.0
    assert compiled == [1, 2, 3, 2]


def test_a_program_knows_what_it_was_compiled_for():
    @jit_with_kernels
    def powered(exponent, x, *, one_kernel):
        return x**exponent

    assert [float(powered(exponent, jnp.array(3.0))) for exponent in (2, 1, 2)] == [9.0, 3.0, 9.0]
