"""What a record is given, checked and brought into one shape: columns of finite doubles, one for each measured dof."""

from collections.abc import Mapping
from numbers import Real
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Samples = TypeVar("Samples", NDArray[np.float64], NDArray[np.bool_])
MOST_DOFS = 10_000
"""More than anyone measures; a number in the place of a name counts as one otherwise."""
Columns = tuple[tuple[int, ...], NDArray[np.float64]]


def as_time(time: Any, factor: float) -> NDArray[np.float64]:
    """The clock in seconds: (n,), strictly increasing.

    Raises
    ------
    TypeError
        If `time` does not hold real numbers.
    ValueError
        If it is not one column of at least two finite numbers, or does not increase.
    """
    clock = _real("time", time)
    clock *= factor
    if clock.ndim != 1 or clock.size < 2:
        raise ValueError(
            f"`time` must be one column of at least 2 samples; it has shape {clock.shape}. "
            f"Pass the instants in seconds, one for each sample."
        )
    _require_finite("time", clock, clock)
    backwards = np.flatnonzero(np.diff(clock) <= 0)
    if backwards.size:
        i = int(backwards[0])
        word = "repeats" if clock[i + 1] == clock[i] else "goes back"
        raise ValueError(
            f"`time` must increase from sample to sample; it {word} at sample {i + 1} ({clock[i]:.9g} s, then "
            f"{clock[i + 1]:.9g} s; {backwards.size} such places). Remove repeated samples, and make a record of each "
            f"run."
        )
    return frozen(clock)


def as_instant(name: str, given: Any) -> float:
    """One number, of seconds or per second, as a float.

    Raises
    ------
    TypeError
        If it is none.
    """
    if isinstance(given, Real | np.number) and not isinstance(given, bool):
        return float(given)
    if isinstance(given, np.ndarray) and given.ndim == 0 and given.dtype.kind in "iuf":
        return float(given)
    raise TypeError(f"`{name}` must be one number; it was {given!r}.")


def require_mapping(name: str, given: Any, example: str) -> None:
    """Refuse what says nothing by name; None says nothing.

    Raises
    ------
    TypeError
        With an example.
    """
    if given is not None and not isinstance(given, Mapping):
        raise TypeError(f"`{name}` must be given by name, as {example}; it was {given!r}.")


def as_columns(kind: str, given: Any, time: NDArray[np.float64], factor: float) -> Columns:
    """The dofs that a channel argument mentions, ascending, and their samples, (n, dofs) in the coherent unit.

    Raises
    ------
    TypeError
        If the samples are not real numbers, or a dof is not an integer.
    ValueError
        If lengths differ from that of `time`, a sample is not finite or a dof is below 1.
    """
    if isinstance(given, Mapping):
        for dof in given:
            if isinstance(dof, bool) or not isinstance(dof, int | np.integer):
                raise TypeError(
                    f"`{kind}` given by dof must have integers as keys; one is {dof!r}. Write {{1: samples, 2: more}}."
                )
            if dof < 1:
                raise ValueError(f"`{kind}` given by dof counts from 1 (0 is ground); one key is {dof}. Number from 1.")
            if dof > MOST_DOFS:
                raise ValueError(
                    f"`{kind}` given by dof counts degrees of freedom, {MOST_DOFS} at most; one key is {dof}. Number "
                    "them from 1 on, without gaps."
                )
        dofs = tuple(sorted(int(dof) for dof in given))
        samples = np.empty((time.size, len(dofs)), order="F")
        for place, dof in enumerate(dofs):
            samples[:, place] = _column(kind, given[dof], time)
    else:
        samples = _real(kind, given)
        if samples.ndim == 1:
            samples = samples[:, None]
        if samples.ndim != 2 or samples.shape[0] != time.size:
            raise ValueError(_wrong_shape(kind, np.shape(given), time.size))
        dofs = tuple(range(1, samples.shape[1] + 1))
    if not dofs:
        raise ValueError(f"`{kind}` must hold at least one channel; it is empty. Leave an unmeasured kind out.")
    for dof, column in zip(dofs, samples.T, strict=True):
        _require_finite(f"{kind} dof {dof}", column, time)
    samples *= factor
    return dofs, frozen(np.asfortranarray(samples))


def as_single(kind: str, given: Any, time: NDArray[np.float64], factor: float) -> NDArray[np.float64]:
    """The samples of a quantity that exists once, (n,) in the coherent unit; errors as `as_columns`."""
    samples = _column(kind, given, time)
    _require_finite(kind, samples, time)
    samples *= factor
    return frozen(samples)


def frozen(array: Samples) -> Samples:
    """The array itself, made read-only."""
    array.flags.writeable = False
    return array


def _column(kind: str, given: Any, time: NDArray[np.float64]) -> NDArray[np.float64]:
    samples = _real(kind, given)
    if samples.shape != time.shape:
        raise ValueError(_wrong_shape(kind, samples.shape, time.size, one=True))
    return samples


def _real(name: str, given: Any) -> NDArray[np.float64]:
    """A copy in double precision; masked samples become NaN, so that they are refused with the others."""
    try:
        array = np.ma.asanyarray(given) if isinstance(given, np.ma.MaskedArray) else np.asarray(given)
    except TypeError:  # of things that only look like a sequence
        raise TypeError(f"`{name}` must hold real numbers; it was {given!r}. Pass an array.") from None
    except ValueError as error:
        raise ValueError(f"`{name}` must be a rectangular array: {error}. Pass columns of equal length.") from None
    if array.dtype.kind not in "iuf":
        raise TypeError(
            f"`{name}` must hold real numbers; it holds {array.dtype}. Convert text, split complex numbers, or pass "
            f"instants as seconds."
        )
    numbers = np.array(array, dtype=np.float64)
    if isinstance(array, np.ma.MaskedArray):
        numbers[np.ma.getmaskarray(array)] = np.nan
    return numbers


def _require_finite(name: str, samples: NDArray[np.float64], time: NDArray[np.float64]) -> None:
    bad = np.flatnonzero(~np.isfinite(samples))
    if bad.size:
        where = "" if samples is time else f", t = {time[bad[0]]:.6g} s"
        raise ValueError(
            f"`{name}` must be finite; {bad.size} of {samples.size} samples are not (the first is sample "
            f"{bad[0]}{where}). Cut the record there, or fill the gap yourself and say how."
        )


def _wrong_shape(kind: str, shape: tuple[int, ...], n: int, one: bool = False) -> str:
    wanted = f"({n},)" if one else f"({n},), ({n}, dof) or {{dof: ({n},)}}"
    transposed = len(shape) == 2 and shape[1] == n
    remedy = "Pass the transpose." if transposed else "Cut or resample the channels to one clock first."
    return f"`{kind}` must have as many samples as `time`, {wanted}; it has shape {shape}. {remedy}"
