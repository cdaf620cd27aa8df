"""Work on all cores: a compiled program takes one, and threads give it the others."""

import os
import threading
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Protocol, TypeVar

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")


class Compiled(Protocol):
    """What runs a program; those for which `program` is equal share it."""

    @property
    def program(self) -> Hashable: ...


Runs = TypeVar("Runs", bound=Compiled)


def side_by_side(do: Callable[[Item], Outcome], items: Iterable[Item]) -> Iterator[Outcome]:
    """What `do` makes of each item, in their order; what has not begun when it is interrupted does not begin."""
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        yield from threads.map(do, items)


def compiled_once(items: Sequence[Runs]) -> tuple[list[Runs], list[Runs]]:
    """The first item of every program, and the others: what the first compile, the others find there."""
    first = {item.program: item for item in reversed(items)}
    return list(first.values()), [item for item in items if item is not first[item.program]]


_one_each = False


@contextmanager
def small_matrices() -> Iterator[None]:
    """While this lasts, every call of BLAS takes one thread; for work on many matrices of a few rows.

    Several threads that share one of those wait for each other longer than they work, up to a thousand times where the
    other cores are busy. The number belongs to the process, and OpenBLAS raises it in the main thread only: calls in
    other threads leave it.
    """
    global _one_each
    if _one_each or threading.current_thread() is not threading.main_thread():
        yield
        return
    from threadpoolctl import threadpool_limits  # looks through all libraries that are loaded, some milliseconds

    _one_each = True
    try:
        with threadpool_limits(1, user_api="blas"):
            yield
    finally:
        _one_each = False
