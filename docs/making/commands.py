"""The page on the command line, from the program itself."""

import re

import typer
import typer.main
from typer.cli import get_docs_for_click

from jfsm.cli import app

HEAD = """# Command line

`jfsm COMMAND --help` says the same. Exit status: 0 consistent, or done where nothing is judged; 1 anything found, or
undecided; 2 bad input; 3 not finished; 4 an internal error.

"""


def page() -> str:
    """Every command with its arguments and options."""
    command = typer.main.get_command(app)
    context = typer.Context(command, info_name="jfsm")
    text = get_docs_for_click(obj=command, ctx=context, name="jfsm")
    text = re.sub(r"^\* `--(install|show)-completion`.*\n", "", text, flags=re.MULTILINE)
    _, _, rest = text.partition("\n")  # its title
    return HEAD + re.sub(r"^(#+) ", r"\1 ", rest, flags=re.MULTILINE)
