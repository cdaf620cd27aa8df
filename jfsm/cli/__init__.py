"""The command line: it parses, calls and prints.

Exit codes: 0 consistent (or done, where nothing is judged), 1 anything found or undecided, 2 bad input, 3 not
finished, 4 an internal error.
Whatever is slow to import is imported by the command that needs it.
"""

import os
import sys

from .._terminal import spell_streams
from . import _commands, _fleet, _models  # noqa: F401  (their commands are part of the program)
from ._command import NOT_FINISHED, app

__all__ = ["app", "main"]


def main() -> None:
    """The program ``jfsm``."""
    spell_streams()
    try:
        app()
    except SystemExit as end:
        if end.code == NOT_FINISHED:
            # Amid tracing an interrupt leaves jaxlib in a state that crashes when it is torn down, which would turn
            # the exit code into that of a segmentation fault. Everything has been said: leave at once.
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(NOT_FINISHED)
        raise
