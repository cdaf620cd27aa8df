"""A record of periodic excitation as its mean period."""

import numpy as np

from jfsm.records._abstract_record import AbstractRecord, AnyRecord
from jfsm.records._channels import frozen
from jfsm.records._periods import change, common_period, unsettled, whole_periods
from jfsm.records._silence import silent_forces
from jfsm.records._tapers import Samples


def fold(record: AnyRecord, period: int | None, transient: int) -> AnyRecord:
    """The mean of the last whole periods of a record, all but the first `transient`; errors as `Record.folded`."""
    n, dt = len(record), record.dt
    length = _length(record) if period is None else period
    if isinstance(length, bool) or not isinstance(length, int | np.integer):
        raise TypeError(
            f"`period` must be a whole number of samples; it was {period!r}. If no whole number fits, bring the record "
            f"to a rate at which one does: record.resample(rate)."
        )
    if not 2 <= length <= n // 2:
        raise ValueError(
            f"`period` must be between 2 and {n // 2} samples, for the record of {n} to hold two of them; "
            f"it was {length}. Pass the samples of one period."
        )
    most = n // length - 2
    if not 0 <= transient <= most:
        raise ValueError(
            f"`transient` must be between 0 and {most}, so that two of the {n // length} whole periods are left; "
            f"it was {transient}. Leave out fewer."
        )
    first = n % length + transient * length
    changes: list[str] = []
    late = [0]

    def mean(channel: str, unit: str, samples: Samples) -> Samples:
        periods = whole_periods(samples, length)[transient:]
        changes.append(f"{channel} by {change(periods):.3g} {unit}")
        late.append(unsettled(periods))
        return periods.mean(axis=0)

    columns = {}
    for kind, (dofs, samples) in record._columns.items():
        means = [mean(f"{kind} {dof}", record.units[kind], y) for dof, y in zip(dofs, samples.T, strict=True)]
        columns[kind] = dofs, frozen(np.stack(means).T)
    base = record.base_acceleration
    if base is not None:
        base = frozen(mean("base_acceleration", record.units["base_acceleration"], base))
    time = record.time[first : first + length]
    count = n // length - transient
    words = [
        f"Mean of {count} periods of {length} samples ({length * dt:.4g} s), the first from t = {time[0]:.6g} s; "
        f"{first} samples before them are left out."
    ]
    if changes:
        words.append(
            f"From period to period changed (standard deviation) {', '.join(changes)}; noise of their mean is "
            f"{np.sqrt(count):.3g} times less."
        )
    if more := max(late):
        words.append(f"The first {more} of these periods had not settled: folded(transient={transient + more}).")
    return record._with(time, columns, base, at_rest=False).noted(*words)


def _length(record: AbstractRecord) -> int:
    """Samples of the period that all driving channels share."""
    silent = silent_forces(record)
    acting = {dof: force for (kind, dof), force in record.channels.items() if kind == "force" and dof not in silent}
    drives = list(acting.values() if record.drive == "force" else record.responses.values())
    if record.base_acceleration is not None:
        drives.append(record.base_acceleration)
    length = common_period(drives)
    if length is None:
        raise ValueError(
            "`period` must be given where the driving channels do not repeat themselves within half of the record: "
            "record.folded(period=...), in samples."
        )
    return length
