"""A batch on the workers of dask.distributed."""

import os
import signal
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from jfsm import Structure, diagnose_many

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("default")]


def test_a_worker_that_dies_costs_no_record(tmp_path):
    distributed = pytest.importorskip("distributed")

    class Quick(distributed.WorkerPlugin):
        """Stands a fast diagnosis in, also on workers that take the place of one that died."""

        def setup(self, worker: Any) -> None:
            from jfsm.fleet import _work

            def quick(record: Any, task: Any) -> Any:
                time.sleep(0.3)
                page = '<html><meta name="generator" content="jfsm"></html>'
                return {"verdict": "consistent", "findings": [], "finished": True, "sentence": ""}, page

            _work.diagnosed = quick

    files = [tmp_path / f"run{i}.csv" for i in range(12)]
    for i, path in enumerate(files):
        np.savetxt(path, [[0.1 * k, i] for k in range(50)], delimiter=",", header="t,y", comments="")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        client.register_plugin(Quick())
        pids = list(client.run(os.getpid).values())
        killed = []

        def told(what: str, done: int, total: int) -> None:
            if done == 3 and not killed:
                killed.append(pids[0])
                os.kill(pids[0], signal.SIGKILL)

        model = Structure.sdof(1.0, 9.0, 0.12)
        found = diagnose_many(files, model, tmp_path / "out", client, displacement="y", progress=told)
    assert killed and not found.failures
    assert [one.name for one in found.results] == [path.stem for path in files]
    assert all(Path(one.path or "").exists() for one in found.results)
