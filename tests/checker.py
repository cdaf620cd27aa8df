"""How calls of jfsm are held to their annotations while the tests run."""

from collections.abc import Callable
from io import IOBase
from typing import Any, BinaryIO, Literal, Self

import numpy as np
from beartype import BeartypeConf, FrozenDict, beartype

CHECKED = (
    "jfsm.surrogates",
    "jfsm.estimation",
    "jfsm.identification",
    *(
        f"jfsm.dynamics.{module}"
        for module in (
            "_backbone",
            "_fixed_points",
            "_forced_response",
            "_limit_cycles",
            "_linearise",
            "_many",
            "_simulate",
        )
    ),
)
"""Rooms, and the modules of `dynamics` with its public functions, whose calls are checked."""

AS_ANNOTATED = BeartypeConf(
    hint_overrides=FrozenDict(
        {
            int: int | np.integer,
            float: float | int | np.floating | np.integer,
            bool: bool | np.bool_,
            Literal["band-limited", "linear", "hold"]: str,  # and with words of its own the library refuses others
            Literal["reference", "grid"]: str,
            Literal["separate", "shared", "coregionalised"]: str,
            BinaryIO: IOBase,  # beartype asks for a name and a mode, which io.BytesIO has not
            Self: Any,  # each method is decorated by itself, where its class is not known
        }
    )
)
"""Strict, but numbers of NumPy pass for those of Python, and an int for a float."""


def checked(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, whose arguments and result must be what their annotations say."""
    return beartype(conf=AS_ANNOTATED)(function)
