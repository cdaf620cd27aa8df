"""Work in processes of our own: they end with the one that began them, and one that dies takes one item along."""

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from typing import TypeVar

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")


class DiedError(RuntimeError):
    """The process of a record ended, twice or by itself, without an outcome."""


def in_processes(
    do: Callable[[Item], Outcome], items: Sequence[Item], jobs: int
) -> Generator[tuple[Item, Outcome | DiedError], None, None]:
    """What `do` makes of each item in `jobs` processes, as it comes; `do` and the items must be picklable.

    Every process has one item at a time. If one dies, the items that were under way are tried again one by one, each in
    a process of its own: one with which that dies, too, has a `DiedError` for an outcome.
    """
    alone = list[Item]()
    waiting = deque(items)
    while waiting:
        alone += yield from _until_one_dies(do, waiting, jobs)
    for item in alone:
        died = yield from _until_one_dies(do, deque([item]), 1)
        for one in died:
            yield (
                one,
                DiedError(
                    "Its process ended without a word, as it does when memory is short. Fewer --jobs leave more of it."
                ),
            )


def _until_one_dies(
    do: Callable[[Item], Outcome], waiting: deque[Item], jobs: int
) -> Generator[tuple[Item, Outcome], None, list[Item]]:
    """Outcomes of what is waiting until nothing is, or until a process dies; returns what was under way then."""
    died, under_way = list[Item](), dict[Future[Outcome], Item]()
    with _workers(min(jobs, len(waiting))) as pool:
        while (waiting or under_way) and not died:
            while waiting and len(under_way) < jobs:
                item = waiting.popleft()
                try:
                    under_way[pool.submit(do, item)] = item
                except BrokenProcessPool:  # none so much as began
                    died.append(item)
                    break
            done, _ = wait(under_way, return_when=FIRST_COMPLETED)
            for future in done:
                item = under_way.pop(future)
                try:
                    outcome = future.result()
                except BrokenProcessPool:
                    died.append(item)
                else:
                    yield item, outcome
    return [*died, *under_way.values()]


@contextmanager
def _workers(count: int) -> Iterator[ProcessPoolExecutor]:
    """Processes that are there while this lasts; where it ends by an exception, they end amid their work."""
    context = multiprocessing.get_context("spawn")
    reader, writer = context.Pipe(duplex=False)
    pool = ProcessPoolExecutor(count, context, initializer=_begin, initargs=(reader,))
    try:
        yield pool
        pool.shutdown()
    finally:
        writer.close()  # ends those that are left
        pool.shutdown(cancel_futures=True)
        reader.close()


def _begin(reader: Connection) -> None:
    """A process that ends when that which began it does, or when it is told to; interrupts are that one's business."""
    with suppress(ValueError):
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(reader,), daemon=True).start()


def _end_with(reader: Connection) -> None:
    with suppress(EOFError, OSError):
        reader.recv()  # nothing is ever sent: it returns when the other end is closed
    os._exit(1)
