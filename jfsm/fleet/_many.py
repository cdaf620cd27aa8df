"""From many records to a folder of diagnoses, and a summary of all."""

import pickle
import signal
import threading
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, as_completed
from contextlib import closing, contextmanager
from os import PathLike, fspath
from typing import Any, Unpack, cast

from .._files import as_path
from .._processes import DiedError, in_processes
from .._programs import programs_kept
from .._types import require_x64
from ..diagnosis import jfsm_version, model_fingerprint
from ..records import Record
from ..reporting import shown_by_default
from ..structures import MODEL, Runs, Structure, check_order, remedy
from ._batch import Batch
from ._folder import Folder, Stamp, Standing
from ._options import Options, Settings, sorted_options
from ._outcome import Failure, Row, failed_row, row_of, verdict_of
from ._source import Source, sources_of
from ._summary import write_summary
from ._work import Believed, Task, work

Told = Callable[[str, int, int], None]
Path_ = str | PathLike[str]


def diagnose_many(
    records: Sequence[Path_ | Record] | Mapping[str, Path_ | Record],
    model: Structure | Runs,
    out: Path_,
    executor: Executor | int | Any = None,
    *,
    progress: Told | bool | None = None,
    **options: Unpack[Options],
) -> Batch:
    """Diagnose each of many records with one model, and write what comes out into a folder.

    Every record has a diagnosis of its own, ``out/records/NAME.json`` as `Diagnosis.to_json` writes it, with its page;
    one that cannot be read or is refused has ``NAME.failed.json`` with the reason, and the others go on. A result that
    is there counts if it was made from the same input, model, settings and version of jfsm; only what is missing is
    made. Files appear whole or not at all: whatever ends the batch, at most the records under way are lost. At the end
    ``summary.json``, ``.csv`` and ``.html`` say which causes act where, how large and how alike.

    Parameters
    ----------
    records : sequence of paths or Records, or mapping of names to these
        A file is called by its stem, and by more of its path where stems are the same.
    model : Structure, Simulation or Simulation.from_runs(...)
        As for `diagnose`.
    out : path
        The folder; it is made, and may hold other files, which stay as they are. One batch at a time writes into it.
    executor : concurrent.futures.Executor, dask.distributed.Client, int or None, optional
        Where the work is done. The workers write the results, so they must see `out` and the files; Records in memory
        travel by value. A number is that many processes, which a script begins under ``if __name__ == "__main__":``
        alone. None works in this process, and compiles every program once.
    progress : callable or bool, optional
        Told of every record: its name, records done, records in all. As for `diagnose`.
    **options
        Those of `diagnose`, for every record: `holdout`, `causes`, `max_causes`, `key`, `since`, `until`, `places`,
        `reconstruction`, `time_limit`. Those of `read`, for files: `force`, `displacement`, `units` and so on, and
        `resample`, a rate [Hz] or "auto", or `every`. With a `key` every record is given the same.

    Returns
    -------
    Batch
        The results in their order, causes with their sizes over the records, clusters of equal verdicts, failures, and
        what changed since the last batch in the folder.

    Raises
    ------
    TypeError
        If a record, the model or an option is of the wrong kind.
    ValueError
        If there are no records, the folder is in use, files of others have the names of the summary, or the model
        cannot be sent to another process.
    KeyboardInterrupt
        If it is interrupted; what is done stays, and the same call goes on from there.

    Examples
    --------
    >>> batch = jfsm.diagnose_many(
    ...     ["part1.csv", "part2.csv"], model, out="parts", force="u", displacement="y"
    ... )  # doctest: +SKIP
    >>> batch.print()  # doctest: +SKIP
    """
    check_order("jfsm.diagnose_many(records, model, out)", model, records)
    reading, settings = sorted_options(options)
    return many(sources_of(records, reading), model, out, executor, settings, progress)


def many(
    sources: Sequence[Source],
    model: Structure | Runs,
    out: Path_,
    executor: Executor | int | Any,
    settings: Settings,
    progress: Told | bool | None,
) -> Batch:
    """What `diagnose_many` does, of sources whose ways to be read may differ."""
    require_x64()
    if not isinstance(model, Structure | Runs):
        raise TypeError(f"`model` must be {MODEL}; got {model!r}.{remedy(model)}")
    runner = _runner(executor, model)
    folder = Folder(fspath(as_path(out, "out").absolute()))
    common = (model_fingerprint(model), settings.fingerprint, jfsm_version())
    with folder.held(), shown_by_default(progress) as told, _interrupted_at_once():
        rows, tasks = dict[str, Row](), list[Task]()
        for source in sources:
            before = _standing(source, folder, common)
            if isinstance(before, Stamp):
                tasks.append(Task(source, before, Believed(model), settings, folder))
            else:
                rows[source.slug] = before
        _tell(told, f"{len(rows)} of {len(sources)} records stand from before", len(rows), len(sources))
        with closing(runner(tasks)) as outcomes:
            for task, row in outcomes:
                rows[task.source.slug] = row
                _tell(told, f"{row['name']}: {verdict_of(row)}", len(rows), len(sources))
        return Batch(folder.path, write_summary(folder, [rows[source.slug] for source in sources], model))


def _tell(told: Told | None, what: str, done: int, total: int) -> None:
    if told is not None:
        told(what, done, total)


def _standing(source: Source, folder: Folder, common: tuple[str | None, str, str]) -> Row | Stamp:
    """The row of a record of which everything is known already, or the stamp that its result will have."""
    try:
        stamp = Stamp(source.fingerprint(), *common)
    except OSError as error:
        failure = Failure("unreadable", f"{error.strerror}: {error.filename}")
        stamp = Stamp("unreadable", *common)
        return _noted(source, folder, stamp, failure)
    standing: Standing = folder.standing(source.slug, stamp)
    if standing.numbers is not None:
        return row_of(source.name, source.slug, source.where, standing.numbers)
    if standing.failure is not None:
        return failed_row(source.name, source.slug, source.where, standing.failure)
    return stamp


def _noted(source: Source, folder: Folder, stamp: Stamp, failure: Failure) -> Row:
    """The row of a record whose file cannot be opened, which is written down where there is room for that."""
    try:
        folder.write_failure(source.slug, source.name, stamp, failure)
    except OSError as error:
        failure = Failure("not done", str(error))
    return failed_row(source.name, source.slug, source.where, failure)


Outcomes = Generator[tuple[Task, Row], None, None]


def _runner(executor: Any, model: Any) -> Callable[[Sequence[Task]], Outcomes]:
    """How the work is spread: here, over processes of our own, or by an executor.

    Raises
    ------
    TypeError
        If `executor` is none of what does work.
    ValueError
        If it is a number below 1, or the model cannot be sent to other processes.
    """
    if executor is None:
        return _here
    if isinstance(executor, int):
        if executor < 1 or isinstance(executor, bool):
            raise ValueError(f"`executor` as a number of processes must be at least 1; got {executor}.")
        _check_travels(model)
        return lambda tasks: _in_processes(tasks, executor)
    if hasattr(executor, "get_executor"):  # a Client of dask.distributed: other workers take over from one that dies
        _check_travels(model)
        executor = executor.get_executor(pure=False)
    if not callable(getattr(executor, "submit", None)):
        raise TypeError(
            "`executor` must be an executor of concurrent.futures, a Client of dask.distributed, a number of processes "
            f"or None; got {executor!r}."
        )
    return lambda tasks: _submitted(tasks, cast(Executor, executor))


def _check_travels(model: Any) -> None:
    try:
        pickle.dumps(model)
    except Exception as error:  # whatever a function of the user's holds
        raise ValueError(
            f"`model` must be something that can be sent to another process ({error}). Define its function at the top "
            "of a module instead of inside another function, or leave `executor` out."
        ) from error


def _here(tasks: Sequence[Task]) -> Outcomes:
    with programs_kept():
        for task in tasks:
            yield task, work(task)


def _in_processes(tasks: Sequence[Task], jobs: int) -> Outcomes:
    with closing(in_processes(work, tasks, jobs)) as outcomes:
        for task, outcome in outcomes:
            yield task, _died(task, outcome) if isinstance(outcome, DiedError) else outcome


def _died(task: Task, error: DiedError) -> Row:
    return _noted(task.source, task.folder, task.stamp, Failure("internal", str(error)))


def _submitted(tasks: Sequence[Task], executor: Executor) -> Outcomes:
    """Outcomes of an executor's workers as they come; what has not begun is taken back when the batch ends early."""
    futures = {executor.submit(work, task): task for task in tasks}
    try:
        for future in as_completed(futures):
            yield futures[future], _outcome(future, futures[future])
    finally:
        for future in futures:
            future.cancel()


def _outcome(future: Any, task: Task) -> Row:
    """What a worker made of a record; a worker that fails as such loses that record, which is tried again next time."""
    try:
        return future.result()
    except (BrokenExecutor, CancelledError) as error:
        return task.failed(Failure("not done", f"Its worker ended ({type(error).__name__})."))
    except Exception as error:  # of the executor's own kind, as a worker that was lost thrice
        return task.failed(Failure("not done", f"Its worker failed ({type(error).__name__}: {error})."))


@contextmanager
def _interrupted_at_once() -> Iterator[None]:
    """While this lasts, an interrupt ends the record under way instead of giving the best verdict so far on it."""
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or before is not signal.default_int_handler:
        yield
        return

    def interrupted(number: int, frame: Any) -> None:
        raise KeyboardInterrupt

    signal.signal(signal.SIGINT, interrupted)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
