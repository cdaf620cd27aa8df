"""Steps of a diagnosis as a display counts them: never more than there are, as far as that is known."""

from collections.abc import Callable

Progress = Callable[[str, int, int], None]
"""Told of every step: what, steps done, steps in all."""


class Steps:
    """Counts steps; so many `fixed` ones come whatever is found.

    How many a search takes turns out on the way. What one was expected to take and did not is left to those that may
    follow, so the number of all of them does not fall before the last one has ended.
    """

    def __init__(self, progress: Progress | None, fixed: int):
        self._progress, self._fixed = progress, fixed
        self._done, self._total, self._begun = 0, fixed, 0

    def next(self, what: str) -> None:
        """One of the fixed steps begins, and no search is under way."""
        self._done += self._begun
        self._fixed, self._begun = self._fixed - 1, 1
        self._total = self._done + self._begun + self._fixed
        self._show(what)

    def of(self, search: str) -> Callable[[str, int], None]:
        """What counts the steps of a search that begins: it is told of each that is done, and how many there may be
        after it."""
        self._show(search)

        def tell(what: str, left: int) -> None:
            self._done += self._begun + 1
            self._begun = 0
            self._total = max(self._total, self._done + left + self._fixed)
            self._show(f"{search}: {what}")

        return tell

    def end(self) -> None:
        """Everything is done."""
        self._done = self._total
        self._show("done")

    def _show(self, what: str) -> None:
        if self._progress is not None:
            self._progress(what, self._done, self._total)
