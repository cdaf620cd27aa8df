"""`python -m jfsm`: the command line."""

from jfsm.cli import main

if __name__ == "__main__":
    main()
