"""Work on all cores: a compiled program takes one, and threads give it the others."""

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")


def side_by_side(do: Callable[[Item], Outcome], items: Iterable[Item]) -> Iterator[Outcome]:
    """What `do` makes of each item, in their order; what has not begun when it is interrupted does not begin."""
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        yield from threads.map(do, items)
