"""The simulation's place in the queue for a processor that it shares with the page's browser."""

from __future__ import annotations

import os
import sys


def come_first() -> bool:
    """Ask Linux to let this thread run before what is ordinary; returns whether it does.

    A flight in real time needs a twentieth of a core, but needs it when it is due. `SCHED_RR` takes the right to it
    (root, or `ulimit -r 1`); where that is refused, and on other systems, nothing changes. Threads and processes that
    this one starts stay ordinary.
    """
    if not sys.platform.startswith("linux"):
        return False
    try:
        os.sched_setscheduler(0, os.SCHED_RR | os.SCHED_RESET_ON_FORK, os.sched_param(1))
    except OSError:
        return False
    return True
