"""A loop that is one kernel gives what the loop gives, and where XLA refuses a kernel there is none."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from jfsm.dynamics import _kernel
from jfsm.dynamics._kernel import jit_with_kernels

MATRIX = np.array([[2.0, 0.3, 0.0], [0.1, 3.0, 0.2], [0.0, 0.5, 2.5]])


@pytest.fixture(autouse=True)
def not_refused_yet(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_kernel, "_refused", False)


def test_sums_and_products_are_one_kernel():
    @jit_with_kernels
    def powers(matrix, *, one_kernel):
        loop = XX
        return loop(lambda x, _: (jnp.sum(matrix * x[None, :], 1), x), jnp.ones(3), jnp.arange(5))[1]

    expected = [np.linalg.matrix_power(MATRIX, k) @ np.ones(3) for k in range(5)]
    np.testing.assert_allclose(powers(jnp.asarray(MATRIX)), expected, rtol=1e-14)
    assert not _kernel._refused


def test_where_xla_refuses_a_kernel_the_ordinary_loop_serves():
    """A system of equations is solved by a library, which a kernel cannot call."""
    asked = []

    @jit_with_kernels
    def powers(matrix, *, one_kernel):
        asked.append(one_kernel)
        loop = XX
        return loop(lambda x, _: (jnp.linalg.solve(matrix, x), x), jnp.ones(3), jnp.arange(5))[1]

    expected = [np.linalg.matrix_power(np.linalg.inv(MATRIX), k) @ np.ones(3) for k in range(5)]
    for _ in range(2):
        np.testing.assert_allclose(powers(jnp.asarray(MATRIX)), expected, rtol=1e-13)
    assert asked == [True, False] and _kernel._refused


def test_other_errors_are_not_taken_for_a_refusal():
    @jit_with_kernels
    def root(x, *, one_kernel):
        return eqx.error_if(x, x < 0, "no such root") ** 0.5

    with pytest.raises(RuntimeError, match="no such root"):
        root(jnp.array(-1.0))
    assert not _kernel._refused and root(jnp.array(4.0)) == 2.0


def test_programs_are_compiled_once_and_those_not_used_for_long_are_dropped(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(_kernel, "_KEPT", 2)
    compiled = []

    @jit_with_kernels
    def total(x, *, one_kernel):
        compiled.append(x.size)
        return jnp.sum(x)

    for size in (1, 2, 1, 3, 1, 2):  # 2 has not been used for long when 3 comes
        assert total(jnp.ones(size)) == size
    assert compiled == [1, 2, 3, 2]


def test_a_program_knows_what_it_was_compiled_for():
    @jit_with_kernels
    def powered(x, exponent, *, one_kernel):
        return x**exponent

    assert [float(powered(jnp.array(3.0), exponent)) for exponent in (2, 1, 2)] == [9.0, 3.0, 9.0]
