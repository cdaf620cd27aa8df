"""Random wrong arguments and command lines end right, or with one message that says what is wrong."""

import pytest

from .arguments import tried


@pytest.mark.parametrize(
    ("python", "commands", "seed"), [(60, 40, 5), pytest.param(2000, 1000, 6, marks=pytest.mark.slow)]
)
def test_random_wrong_arguments_end_in_words(python: int, commands: int, seed: int):
    """`python -m bad_input.arguments 1000 1000`, in the folder of the tests, tries as many as one likes."""
    found = list(tried(python, commands, seed))
    bad = [f"{one.outcome}: {one.call}: {one.says[-500:]}" for one in found if one.outcome not in ("right", "clear")]
    assert len(found) == python + commands and not bad, "\n".join(bad)
