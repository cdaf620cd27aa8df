"""Long examinations: rows of JSON that are kept as they are done, from processes of their own."""

import concurrent.futures
import json
import multiprocessing
import os
import tempfile
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

Row = dict[str, Any]

DOUBLE_ON_CPU = {"JAX_PLATFORMS": "cpu", "JAX_ENABLE_X64": "1"}
ONE_CORE = DOUBLE_ON_CPU | {
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
}


def kept(path: Path | None) -> list[Row]:
    """Rows that an earlier call left in the file; none if there is no file."""
    if path is None or not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]


def keep(row: Row, path: Path | None) -> None:
    """Append a row to the file, if there is one."""
    if path is not None:
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")


def in_processes(
    examine: Callable[..., Row], calls: Iterable[tuple], jobs: int, lasting: int, environment: Mapping[str, str]
) -> Iterator[Row]:
    """Rows of all calls as they are done, from `jobs` processes, that end when each has done about `lasting`."""
    os.environ.update(environment)  # spawned processes inherit it
    # What one of them has compiled, the others and later calls need not compile again.
    os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(Path(tempfile.gettempdir()) / "jfsm-blind-programs"))
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.2")
    calls, lot = list(calls), lasting * jobs
    for first in range(0, len(calls), lot):
        # A new pool for every lot: one that replaces its processes one by one may wait for ever (CPython 115634).
        context = multiprocessing.get_context("spawn")
        pool = concurrent.futures.ProcessPoolExecutor(jobs, mp_context=context, initializer=_end_with_parent)
        try:
            waiting = [pool.submit(examine, *call) for call in calls[first : first + lot]]
            for future in concurrent.futures.as_completed(waiting):
                yield future.result()
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _end_with_parent() -> None:
    """Lets a process of the pool end when the one that began it does, however that ends."""
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
