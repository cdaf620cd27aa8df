"""Work in processes of our own: one that dies takes one item along, and all end with the one that began them."""

import os
import signal
import subprocess
import sys
import time
from contextlib import closing

from jfsm._processes import DiedError, in_processes


def test_every_item_has_its_outcome():
    assert dict(in_processes(abs, [-1, 2, -3], 2)) == {-1: 1, 2: 2, -3: 3}


def test_an_item_with_which_its_process_dies_takes_no_other_along():
    items = ["1 + 1", "__import__('os')._exit(3)", "2 + 2", "3 + 3"]
    found = dict(in_processes(eval, items, 2))
    assert isinstance(found.pop(items[1]), DiedError)
    assert found == {"1 + 1": 2, "2 + 2": 4, "3 + 3": 6}


def test_processes_end_when_nobody_waits_for_them_any_more():
    slow = "__import__('time').sleep(60)"
    with closing(in_processes(eval, ["__import__('os').getpid()", slow], 1)) as outcomes:
        _, pid = next(outcomes)
        assert isinstance(pid, int)
    assert gone(pid)


def test_processes_end_with_the_one_that_began_them_however_that_ends():
    program = (
        "from jfsm._processes import in_processes\n"
        "if __name__ == '__main__':\n"
        "    items = [\"__import__('os').getpid()\", \"__import__('time').sleep(60)\"]\n"
        "    for _, outcome in in_processes(eval, items, 1):\n"
        "        print(outcome, flush=True)\n"
    )
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        pid = int(parent.stdout.readline())
        parent.send_signal(signal.SIGKILL)
    assert gone(pid)


def gone(pid: int) -> bool:
    """Whether a process ends within some seconds; one that nobody reaped counts."""
    for _ in range(200):
        try:
            os.kill(pid, 0)
            with open(f"/proc/{pid}/stat", encoding="ascii") as stat:
                if stat.read().rpartition(")")[2].split()[0] == "Z":
                    return True
        except (ProcessLookupError, FileNotFoundError):
            return True
        time.sleep(0.05)
    return False
