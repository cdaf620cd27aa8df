"""What every command does: doubles, refusals in words, and an exit code for every way to end."""

import functools
import os
import sys
import traceback
from collections.abc import Callable
from typing import Annotated, Any

import typer

from .._programs import settings
from ._input import in_options
from ._output import say

FOUND, BAD_INPUT, NOT_FINISHED, INTERNAL = 1, 2, 3, 4
_TRACEBACK = "JFSM_TRACEBACK"
"""Variable of the environment that asks for the traceback of an internal error."""

app = typer.Typer(
    help="What a simulation gets wrong against a measured record, the name of the cause, and the gain of mending it.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def _show_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        typer.echo(f"jfsm {version('jfsm')}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", help="Show the version.", callback=_show_version, is_eager=True)
    ] = False,
) -> None:
    """What a simulation gets wrong against a measured record, the name of the cause, and the gain of mending it."""


def command(function: Callable[..., None]) -> Callable[..., None]:
    """A command that owns its process: doubles from here on, and an exit code for every way to end."""

    @functools.wraps(function)
    def run(**options: Any) -> None:
        try:
            _settle_jax()
            function(**options)
        # Whoever read the output of a broken pipe has seen enough; typer ends such a process in silence.
        except (typer.Exit, typer.Abort, typer.BadParameter, BrokenPipeError):
            raise
        except Exception as error:
            refused = isinstance(error, ValueError | OSError | ImportError) and _is_refusal(error)
            say(_words(error) if refused else _internal(error))
            raise typer.Exit(BAD_INPUT if refused else INTERNAL) from None
        except KeyboardInterrupt:
            say("Stopped before the end; no file was left half written.")
            raise typer.Exit(NOT_FINISHED) from None

    return app.command()(run)


def _settle_jax() -> None:
    """Double precision from here on, and compiled programs kept for the next call; JAX itself is loaded where needed.

    `JAX_COMPILATION_CACHE_DIR` says where they are kept, `JAX_ENABLE_COMPILATION_CACHE=0` that they are not.
    """
    if "jax" in sys.modules:
        sys.modules["jax"].config.update("jax_enable_x64", True)
        return
    # Read when it is loaded.
    os.environ["JAX_ENABLE_X64"] = "1"
    for name, value in settings().items():
        os.environ.setdefault(name.upper(), str(value))


def _is_refusal(error: Exception) -> bool:
    """Whether an error is about the input: of the operating system, or raised by jfsm in words.

    A ValueError from a library underneath is a mistake of jfsm.
    """
    *_, (frame, _) = traceback.walk_tb(error.__traceback__)
    package = frame.f_globals.get("__package__") or ""
    return isinstance(error, OSError) or package.split(".")[0] == "jfsm"


def _internal(error: Exception) -> str:
    """A mistake of jfsm in one line, after its traceback if that is wanted."""
    if os.environ.get(_TRACEBACK):
        traceback.print_exception(error)
    *_, last = traceback.extract_tb(error.__traceback__)
    what = " ".join(str(error).split())
    return (
        f"Internal error, a mistake of jfsm and not of the input: {type(error).__name__}: {what} ({last.filename}, "
        f"line {last.lineno}). Run it again with {_TRACEBACK}=1 for the traceback, and report it."
    )


def _words(error: Exception) -> str:
    """What went wrong, in the words of the command line; of an error of the operating system without its number."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.strerror}: {error.filename}"
    return in_options(str(error))
