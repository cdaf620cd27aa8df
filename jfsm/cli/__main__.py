"""`python -m jfsm.cli`."""

from . import main

main()
