"""Which way round a record and a model are given."""

from typing import Any

from ..records import Record
from ._runs import Runs
from ._structure import Structure


def check_order(call: str, model: Any, record: Any) -> None:
    """Refuse a model in the place of the record, or a record in that of the model.

    Parameters
    ----------
    call : str
        How the function is called, ``"jfsm.fit(model, record)"``.
    model, record
        What was given in the place of each.

    Raises
    ------
    TypeError
        If they are the other way round; it says how to call.
    """
    if isinstance(record, Structure | Runs) or _is_record(model):
        got = [_name(each) for each in (model, record)]
        given = got if call.index("model") < call.index("record") else got[::-1]
        raise TypeError(f"The arguments are the wrong way round: write {call}; got ({', '.join(given)}).")


def _is_record(given: Any) -> bool:
    return isinstance(given, Record) or isinstance(given, list | tuple) and bool(given) and isinstance(given[0], Record)


def _name(given: Any) -> str:
    return "nothing" if given is None else f"a {type(given).__name__}"
