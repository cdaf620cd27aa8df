"""One run of a co-simulation FMU, by itself in a process: whatever the FMU does to it, it does to nothing else.

A script, not a module: it reads its job, a pickled dictionary, from its standard input, and writes what came of it to
its standard output, as arrays of an npz file, since an FMU may write anything. It knows NumPy and fmpy alone, so that
it starts in a third of a second.
"""

import io
import os
import pickle
import sys
from typing import Any

import numpy as np

_PUT = {"Real": "setReal", "Integer": "setInteger", "Enumeration": "setInteger", "Boolean": "setBoolean"}
_GET = {"Real": "getReal", "Integer": "getInteger", "Enumeration": "getInteger", "Boolean": "getBoolean"}


class Refused(Exception):
    """The FMU did not do what it was asked."""


def run(job: dict[str, Any]) -> dict[str, np.ndarray]:
    """Outputs (steps + 1, outputs) at the communication points, what is seen in steps of next to nothing after some of
    them (probes, inputs + 1, 2, outputs), and what the parameters are, in their order.

    Where a step may have any length, one of next to nothing is before the first, since outputs may not be computed
    before any.
    """
    from fmpy.fmi2 import FMU2Slave

    fmu = FMU2Slave(guid=job["guid"], modelIdentifier=job["identifier"], unzipDirectory=job["folder"])
    begin, h, tiny, inputs, outputs = job["begin"], job["step"], job["tiny"], job["inputs"], job["outputs"]

    def put(row: Any) -> None:
        if inputs:
            _ask("take its inputs", fmu.setReal, inputs, [float(value) for value in row])

    def read() -> list[float]:
        return _ask("give its outputs", fmu.getReal, outputs)

    def step(time: float, length: float) -> None:
        _ask(f"go on from t = {time:.6g} s", fmu.doStep, currentCommunicationPoint=time, communicationStepSize=length)

    _ask("begin", fmu.instantiate)
    _ask("begin", fmu.setupExperiment, startTime=begin)
    for name, kind, reference, value in job["parameters"]:
        _ask(f"take {name} = {value:g} of `parameters`", getattr(fmu, _PUT[kind]), [reference], [value])
    _ask("begin", fmu.enterInitializationMode)
    put(job["first"])
    _ask("begin", fmu.exitInitializationMode)
    stated = [
        float(_ask(f"give {name}", getattr(fmu, _GET[kind]), [reference])[0])
        for name, kind, reference, _ in job["parameters"]
    ]
    time, seen = begin, []
    if tiny:
        step(time, tiny)
        time = begin + tiny
    rows = [read()]
    for k, row in enumerate(job["held"], start=1):
        put(row)
        step(time, begin + k * h - time)
        time = begin + k * h
        rows.append(read())
        if k in job["probes"]:
            looks = []
            for j in range(-1, len(inputs)):  # as it is, and with one input after the other changed
                put(np.array(row) + job["changes"] * (np.arange(len(inputs)) == j))
                twice = []
                for _ in range(2):
                    step(time, tiny)
                    time += tiny
                    twice.append(read())
                looks.append(twice)
            seen.append(looks)
    _ask("end", fmu.terminate)
    return {"rows": np.array(rows), "seen": np.array(seen), "stated": np.array(stated)}


def _ask(what: str, call: Any, *given: Any, **named: Any) -> Any:
    try:
        return call(*given, **named)
    except Exception as error:
        raise Refused(f"{what}; it does not: {error}") from error


def main() -> None:
    job, answer = pickle.load(sys.stdin.buffer), os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what the FMU prints is no part of the answer
    try:
        found = run(job)
    except Refused as error:
        found = {"refused": np.array(str(error))}
    whole = io.BytesIO()
    np.savez(whole, allow_pickle=False, **found)
    with answer:
        answer.write(whole.getvalue())
    sys.stdout.flush()
    os._exit(0)  # and how it ends is of no account


if __name__ == "__main__":
    main()
