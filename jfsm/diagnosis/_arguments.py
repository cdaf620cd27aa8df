"""Arguments of a diagnosis, checked before anything is computed."""

from collections.abc import Callable, Iterable, Sequence
from numbers import Integral, Real
from typing import Any

import jax

from ..plant import check_reconstruction
from ..records import Record, records_of, require_one_unit, shared_readings
from ..structures import AbstractSensor, AbstractTerm, Cause
from .hypotheses.candidates import chosen_causes


def check_settings(
    causes: Any, max_causes: Any, key: Any, reconstruction: Any, time_limit: Any, progress: Any = None
) -> None:
    """Refuse what cannot be a setting, whatever the records are.

    Raises
    ------
    TypeError, ValueError
        It names the argument.
    """
    if not _is_whole(max_causes) or max_causes < 1:
        raise ValueError(f"`max_causes` must be at least 1, a whole number; got {max_causes!r}. Leave it out for 2.")
    if time_limit is not None and not _is_positive(time_limit):
        raise ValueError(f"`time_limit` must be positive, in seconds; got {time_limit!r}. Without it there is none.")
    if reconstruction is not None:
        check_reconstruction(reconstruction)
    _check_progress(progress)
    check_causes(causes)
    check_key(key)


def _is_whole(value: Any) -> bool:
    return isinstance(value, Integral) and not isinstance(value, bool)


def check_causes(causes: Any) -> None:
    """Refuse what names no causes; errors as of `check_settings`."""
    law = AbstractTerm | AbstractSensor | Cause | type
    if causes is not None and (hasattr(causes, "dtype") or not isinstance(causes, Iterable | law)):
        raise TypeError(f'`causes` must be a list, as ["coulomb", jfsm.Stribeck]; got {causes!r}.')
    chosen_causes(causes)


def _check_progress(progress: Any) -> None:
    if progress is not None and (isinstance(progress, type) or not isinstance(progress, bool | Callable)):
        raise TypeError(
            f"`progress` must be a function of (what, done, total), True, False or None; got {progress!r}. Leave it "
            "out for a bar on a terminal."
        )


def check_key(key: Any) -> None:
    """Refuse what is no key of `jax.random`.

    Raises
    ------
    TypeError
        With the key that a number would make.
    """
    if key is None:
        return
    if isinstance(key, jax.Array):
        typed = jax.numpy.issubdtype(key.dtype, jax.dtypes.prng_key)
        if typed and key.shape == () or not typed and key.dtype == jax.numpy.uint32 and key.ndim == 1:
            return
    example = key if isinstance(key, int) and not isinstance(key, bool) else 0
    raise TypeError(f"`key` must be a key of jax.random; got {key!r}. Write key=jax.random.key({example}).")


def check_holdout(records: Sequence[Record], holdout: Any) -> None:
    """Refuse a hold-out that is neither a share nor nothing nor other records that can be compared with these.

    Raises
    ------
    TypeError, ValueError
        If it is none of these; if a record in it holds readings that are fitted, has no channel in common with what is
        fitted, lacks what drives it, is in other units, or is not sampled evenly.
    """
    held = held_records(holdout)
    if not held:
        return
    require_one_unit(records, held, "holdout")
    if (pair := shared_readings(records, held)) is not None:
        raise ValueError(
            f"`holdout` must hold readings that are not fitted; its record {pair[1] - len(records) + 1} holds readings "
            f"of record {pair[0] + 1}, and the gain would be measured on what was fitted. Give another run, or a share "
            "such as 0.3."
        )
    for place, other in enumerate(held, start=1):
        _check_alike(records[0], other, place)


def held_records(holdout: Any) -> list[Record]:
    """The records that are held out; none for a share, or for nothing.

    Raises
    ------
    TypeError, ValueError
        If it is none of these.
    """
    if holdout is None:
        return []
    if isinstance(holdout, bool | str) or not isinstance(holdout, Real | Record | Iterable):
        raise TypeError(f"`holdout` must be a share such as 0.3, other records, or None; got {holdout!r}.")
    if not isinstance(holdout, Real):
        return records_of(holdout, "holdout")
    if not 0 < float(holdout) < 1:
        raise ValueError(
            f"`holdout` as a share must lie between 0 and 1, e.g. 0.3; got {holdout}. None keeps nothing back."
        )
    return []


def _check_alike(first: Record, other: Record, place: int) -> None:
    """Refuse a held-out record that is not of the same test."""
    driven, others = _drives(first), _drives(other)
    if not driven <= others or first.drive != other.drive:
        missing = ", ".join(kind.replace("_", " ") for kind in sorted(driven - others))
        lacks = f"has no {missing}" if missing else f'has drive="{other.drive}"'
        raise ValueError(
            f"`holdout` must hold records of the same test; record {place} of it {lacks}, and what is fitted is driven "
            "otherwise. Name its channels as those of the record."
        )
    if not set(first.responses) & set(other.responses):
        shown = ", ".join(f"{kind} {j}" for kind, j in first.responses)
        raise ValueError(
            f"`holdout` must hold records of the same channels; record {place} of it has none of {shown}. Name its "
            "channels as those of the record."
        )
    try:
        _ = other.dt
    except ValueError as error:
        raise ValueError(f"`holdout`, record {place}: {error}") from error


def _drives(record: Record) -> set[str]:
    """Kinds of channels that drive a record."""
    base = set() if record.base_acceleration is None else {"base_acceleration"}
    return base | {kind for kind, _ in record.channels if kind == "force"}


def _is_positive(given: Any) -> bool:
    return isinstance(given, Real) and not isinstance(given, bool) and float(given) > 0
