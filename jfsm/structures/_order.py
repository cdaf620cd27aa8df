"""What is given in the places of a record and a model."""

import math
from collections.abc import Sequence
from os import PathLike
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


def as_model(given: Any, name: str = "model") -> Structure:
    """What is given, if it is a structure or a simulation.

    Raises
    ------
    TypeError
        If it is none, with the way to one.
    """
    if isinstance(given, Structure):
        return given
    raise TypeError(f"`{name}` must be {MODEL}; got {given!r}.{remedy(given)}")


MODEL = "a structure, such as jfsm.Structure.sdof(1.0, 9.0, 0.1), or a simulation"


def remedy(given: Any) -> str:
    """What to do where a path stands in the place of a model."""
    return f" Load the file first: jfsm.Structure.load({str(given)!r})." if isinstance(given, str | PathLike) else ""


def check_terms(model: Structure) -> None:
    """Refuse a structure that nothing holds: masses alone.

    Raises
    ------
    ValueError
        With what to add.
    """
    if not model.terms and model.own is None:
        raise ValueError(
            "`model` must have a term, such as a spring or a dashpot; it has masses alone. Add what holds them: model "
            "+ jfsm.LinearStiffness(1.0, at=(0, 1)); its value need not be right."
        )


def check_places(places: Any, dof: float = math.inf) -> None:
    """Refuse places that are no links of a structure with so many degrees of freedom; None leaves them open.

    Raises
    ------
    TypeError, ValueError
        If they are no sequence, or one is no link.
    """
    if places is None:
        return
    if isinstance(places, str) or not isinstance(places, Sequence):
        raise TypeError(f"`places` must be a list of links, as [(0, 1)]; got {places!r}.")
    numbers = f"1 to {dof}" if dof < math.inf else "from 1 on"
    for place in places:
        pair = tuple(place) if isinstance(place, Sequence) and not isinstance(place, str) else ()
        if len(pair) != 2 or len(set(pair)) != 2 or not all(isinstance(j, int) and 0 <= j <= dof for j in pair):
            raise ValueError(
                f"`places` must be links (i, j) between two of ground (0) and the degrees of freedom {numbers}; one "
                f"is {place!r}. A load on degree of freedom j is at (0, j)."
            )


def _is_record(given: Any) -> bool:
    return isinstance(given, Record) or isinstance(given, list | tuple) and bool(given) and isinstance(given[0], Record)


def _name(given: Any) -> str:
    return "nothing" if given is None else f"a {type(given).__name__}"
