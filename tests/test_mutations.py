"""Files that were edited at random are read right, refused in words, or noted."""

import pytest
from mutations import WRITERS, tried


@pytest.mark.parametrize("name", WRITERS)
def test_an_edited_file_is_read_as_it_states_or_noted_or_refused(name):
    """`python tests/mutations.py 3000` tries many more. A value that an edit changes is what the file then states."""
    found = list(tried(20, (name,), seed=3))
    bad = [f"{kind} {what}: {words[-600:]}" for _, kind, what, words in found if what in ("trace", "silent")]
    assert not bad, "\n".join(bad)
    assert sum(what == "refused" for _, _, what, _ in found) >= 5
