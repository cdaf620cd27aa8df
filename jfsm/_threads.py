"""Work on all cores: a compiled program takes one, and threads give it the others."""

import os
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
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
