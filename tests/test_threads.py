"""How many threads BLAS takes."""

import threading

import numpy as np
import pytest
import scipy.linalg
from threadpoolctl import threadpool_info, threadpool_limits

import jfsm
from jfsm._threads import small_matrices


def threads() -> set[int]:
    scipy.linalg.inv(np.eye(2))
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


@pytest.fixture(autouse=True)
def two_threads():
    with threadpool_limits(2, user_api="blas"):
        yield


def test_small_matrices_take_one_thread_and_leave_the_number_as_it_was():
    with small_matrices():
        assert threads() == {1}
        with small_matrices():
            assert threads() == {1}
        assert threads() == {1}
    assert threads() == {2}


def test_another_thread_leaves_the_number_as_it_is():
    seen = []

    def other():
        with small_matrices():
            seen.append(threads())

    thread = threading.Thread(target=other)
    thread.start()
    thread.join()
    assert seen == [{2}] and threads() == {2}


def test_a_fit_that_fails_leaves_the_number_as_it_was():
    with pytest.raises(ValueError, match="must hold a response"):
        jfsm.fit(jfsm.Structure.sdof(1.0, 1.0, 0.1), jfsm.Record(np.arange(100) * 0.01, force=np.ones(100)))
    assert threads() == {2}
