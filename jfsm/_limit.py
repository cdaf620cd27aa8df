"""How long work may go on: whoever works asks between its steps, and says what it has when the time is over."""

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class Limit:
    """Until it is asked to end, or for so many seconds; without them for as long as it takes."""

    def __init__(self, seconds: float | None = None):
        self.asked, self.worth = False, False
        self._end = None if seconds is None else time.monotonic() + seconds

    @property
    def over(self) -> bool:
        """Whether to end, from now on for good."""
        return self.asked or (self._end is not None and time.monotonic() >= self._end)

    def ask(self) -> None:
        """End as soon as a step is done."""
        self.asked = True

    def found(self) -> None:
        """From now on there is something to say."""
        self.worth = True


UNLIMITED = Limit()
"""Of work that nobody ends."""


@contextmanager
def ended_by_interrupt(limit: Limit) -> Iterator[None]:
    """Let the first interrupt of the process end the work, where there is something to say; the next one stops it.

    Before that, one stops it at once, by KeyboardInterrupt. In other threads than the main one, and where interrupts
    are handled otherwise, everything stays as it is; the handler from before is put back.
    """
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or before is not signal.default_int_handler:
        yield
        return

    def interrupted(number: int, frame: FrameType | None) -> None:
        more = limit.worth and not limit.asked
        limit.ask()
        if not more:
            raise KeyboardInterrupt

    signal.signal(signal.SIGINT, interrupted)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
