"""The part of a very long record from which figures are told that more samples would not make better."""

import numpy as np

from jfsm.records._abstract_record import AbstractRecord

ENOUGH = 500_000  # samples; noise is known to a part in a thousand by then


def loudest_part(record: AbstractRecord) -> AbstractRecord:
    """The `ENOUGH` samples in which the channels have most of their power, each counted by its own; all of fewer."""
    if len(record) <= ENOUGH:
        return record
    half = ENOUGH // 2
    count = len(record) // half
    channels = [*record.channels.values()]
    if record.base_acceleration is not None:
        channels.append(record.base_acceleration)
    shares = np.zeros(count)
    for y in channels:
        blocks = y[: count * half].reshape(count, half)
        level = float(y.mean())
        power = np.array([np.mean((block - level) ** 2) for block in blocks])
        shares += power / max(float(power.sum()), 1e-300)
    begin = half * int(np.argmax(shares[:-1] + shares[1:]))
    return record[begin : begin + 2 * half]
