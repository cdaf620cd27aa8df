"""Arrays that make no record, and calls of records that mean nothing."""

# pyright: reportArgumentType=false, reportCallIssue=false
# Wrong types are what is tried.

import copy
import pickle
from pathlib import Path
from typing import Any

import numpy as np

import jfsm

from .rows import FORCE, INF, MOTION, NAN, T, record, refused, right, spoilt

R: Any = record
LATE = T + 1e6


def _same(pair: tuple[jfsm.Record, jfsm.Record]) -> bool:
    one, other = pair
    return np.array_equal(one.time, other.time) and all(
        np.array_equal(one.channels[c], other.channels[c]) for c in one.channels
    )


def _kept(scale: float) -> Any:
    """What a record makes of forces of this size."""
    return lambda stage: (R(force=scale * FORCE).force[:, 0], scale * FORCE)


def _moved_time(stage: Any) -> tuple[jfsm.Record, jfsm.Record]:
    return R(time=LATE), R()


ROWS = [
    refused("no time", lambda s: R(time=None), r"`time` must hold real numbers; it holds object\. Convert", TypeError),
    refused("text for time", lambda s: R(time="abc"), r"`time` must hold real numbers; it holds <U3", TypeError),
    refused("a number for time", lambda s: R(time=3.0), r"`time` must be one column of at least 2 samples; it has shape \(\)\. Pass"),
    refused("a matrix for time", lambda s: R(time=np.stack([T, T])), r"`time` must be one column .* \(2, 400\)"),
    refused("a lost instant", lambda s: R(time=spoilt(T, 0, NAN)), r"`time` must be finite; 1 of 400 .*Cut the record"),
    refused("time backwards", lambda s: R(time=T[::-1]), r"`time` must increase .* goes back at sample 1 .*Remove repeated"),
    refused("time repeated", lambda s: R(time=np.repeat(T[::2], 2)), r"`time` must increase .* repeats at sample 1"),
    refused("truths for time", lambda s: R(time=T > 1), r"`time` must hold real numbers; it holds bool", TypeError),
    refused("dates for time", lambda s: R(time=np.datetime64("2024-01-01") + np.arange(400)), r"it holds datetime64.*instants as seconds", TypeError),
    refused("a single sample", lambda s: jfsm.Record([0.0], force=[1.0]), r"at least 2 samples; it has shape \(1,\)"),
    refused("no samples", lambda s: jfsm.Record([], force=[]), r"at least 2 samples; it has shape \(0,\)"),
    refused("a short channel", lambda s: R(force=FORCE[:-1]), r"`force` must have as many samples as `time`.*\(399,\)\. Cut"),
    refused("a channel of three axes", lambda s: R(force=FORCE[:, None, None]), r"`force` must have as many .*\(400, 1, 1\)"),
    refused("a transposed channel", lambda s: R(force=np.stack([FORCE, FORCE])), r"`force` .*\(2, 400\)\. Pass the transpose"),
    refused("ragged channels", lambda s: R(force=[[1], [2, 3]]), r"`force` must be a rectangular array.*Pass columns of equal"),
    refused("objects for numbers", lambda s: R(force=FORCE.astype(object)), r"`force` must hold real numbers; it holds object", TypeError),
    refused("texts for numbers", lambda s: R(force=["1"] * 400), r"`force` must hold real numbers; it holds <U1", TypeError),
    refused("complex numbers", lambda s: R(force=FORCE + 1j), r"it holds complex128.*split complex", TypeError),
    refused("a NaN", lambda s: R(force=spoilt(FORCE, 7, NAN)), r"`force dof 1` must be finite; 1 of 400 .*sample 7, t = 0.07 s\)\. Cut"),
    refused("an infinity", lambda s: R(displacement=spoilt(MOTION, 7, INF)), r"`displacement dof 1` must be finite"),
    refused("a mask", lambda s: R(force=np.ma.masked_array(FORCE, FORCE > 1)), r"`force dof 1` must be finite"),
    refused("dof 0", lambda s: R(force={0: FORCE}), r"counts from 1 \(0 is ground\); one key is 0\. Number from 1"),
    refused("a dof by name", lambda s: R(force={"a": FORCE}), r"must have integers as keys; one is 'a'\. Write", TypeError),
    refused("a truth as dof", lambda s: R(force={True: FORCE}), r"must have integers as keys; one is True", TypeError),
    refused("a huge dof", lambda s: R(displacement={10**12: MOTION}), r"10000 at most; one key is 1000000000000\. Number them from 1"),
    refused("no channel of a kind", lambda s: R(force={}), r"`force` must hold at least one channel; it is empty\. Leave"),
    refused("a unit alone", lambda s: R(units="N"), r"`units` must be given by name, as .*it was 'N'", TypeError),
    refused("units by channel", lambda s: R(units={"F": "N"}), r"`units` must be given by kind, .*names 'F'"),
    refused("an unknown unit", lambda s: R(units={"force": "furlong"}), r"`units` of force must be a unit .*'furlong'\. Convert"),
    refused("a unit of another kind", lambda s: R(units={"force": "mm"}), r"`units` of force must be .*it was 'mm'"),
    refused("no unit", lambda s: R(units={"force": None}), r"`units` of force must be .*it was None"),
    refused("rest as text", lambda s: R(at_rest="no"), r"`at_rest` must be True or False; it was 'no'", TypeError),
    refused("another drive", lambda s: R(drive="Motion"), r'`drive` must be "force" or "motion"; it was \'Motion\'\. Say'),
    refused("a number as name", lambda s: R(name=3), r"`name` must be a text; it was 3", TypeError),
    refused("two base accelerations", lambda s: R(base_acceleration=np.stack([FORCE, FORCE], 1)), r"`base_acceleration` must have .*\(400, 2\)"),
    refused("an index", lambda s: R()[3], r"A record is sliced, record\[a:b\]; the index was 3\. For values", TypeError),
    refused("a stride", lambda s: R()[::2], r"sliced with step 1; it was 2\. To lower the rate: record\.resample"),
    refused("an empty slice", lambda s: R()[10:10], r"A slice must keep at least 2 of the 400"),
    refused("until a text", lambda s: R().until("a"), r"`time` must be one number; it was 'a'", TypeError),
    refused("since nothing", lambda s: R().since(None), r"`time` must be one number; it was None", TypeError),
    refused("between the wrong way", lambda s: R().between(2, 1), r"`since` and `until` must keep at least 2 .*2 and 1\. Give"),
    refused("shifted by a text", lambda s: R().shifted("a"), r"`seconds` must be one number; it was 'a'", TypeError),
    refused("shifted by infinity", lambda s: R().shifted(INF), r"`seconds` must be a finite time; it was inf\. Pass"),
    refused("resampled to a text", lambda s: R().resample("a"), r"`rate` must be one number; it was 'a'", TypeError),
    refused("resampled to NaN", lambda s: R().resample(NAN), r"`rate` must be a positive number .*it was nan\. Pass at least"),
    refused("resampled beyond memory", lambda s: R().resample(1e15), r"`rate` must leave at most 1e\+08 samples; 1e\+15 Hz .*Pass a lower"),
    refused("turned by kind", lambda s: R().turned("force"), r"`channel` names force; the record has \('force', 1\)"),
    refused("folded by a text", lambda s: R().folded("a"), r"`period` must be a whole number of samples; it was 'a'", TypeError),
    refused("joined nothing", lambda s: jfsm.join(None), r"`records` must be a list of records; got None", TypeError),
    refused("joined none", lambda s: jfsm.join([]), r"`records` must hold at least one record; it is empty\. Pass"),
    refused("aligned numbers", lambda s: jfsm.align([3]), r"`records` must hold records; one is int\. Read or make", TypeError),
    refused("written to a number", lambda s: R().write(3), r"`path` must be a path, .*it was 3", TypeError),
    refused("written without an ending", lambda s: R().write(s.folder / "x"), r"`path` must end in one of .*it was 'x'\. Choose"),
    refused("written into no folder", lambda s: R().write(s.folder / "no" / "x.csv"), r"`path` must be a file in a folder that can be written to: No such file.*x\.csv", OSError),
    refused("written over a folder", lambda s: R().write(_folder(s.folder / "x.csv")), r"`path` must be a file in a folder that can be written to: Is a directory", OSError),
    right("forces of 1e-12", _kept(1e-12), lambda pair: np.array_equal(*pair)),
    right("forces of 1e12", _kept(1e12), lambda pair: np.array_equal(*pair)),
    right("forces of 1e300", _kept(1e300), lambda pair: np.array_equal(*pair)),
    right("single precision", lambda s: R(force=FORCE.astype(np.float32)).force.dtype, lambda dtype: dtype == np.float64),
    right("a clock far from zero", _moved_time, lambda pair: abs(pair[0].dt - pair[1].dt) < 1e-9),
    right("a copy", lambda s: (R(), copy.copy(R())), _same),
    right("a deep copy", lambda s: (R(), copy.deepcopy(R())), _same),
    right("a pickle", lambda s: (R(), pickle.loads(pickle.dumps(R()))), _same),
    right("one torn sample", lambda s: R(displacement=spoilt(MOTION, 77, 9.9e37)).inspect().findings,
          lambda found: any("sample" in f.message and f.channel == "displacement 1" for f in found)),
    right("one spike in the force", lambda s: R(force=spoilt(FORCE, 77, 500.0)).inspect().findings,
          lambda found: any("spike" in f.message and f.channel == "force 1" for f in found) and not any("Noise only" in f.message for f in found)),
]  # fmt: skip


def _folder(path: Path) -> Path:
    path.mkdir()
    return path
