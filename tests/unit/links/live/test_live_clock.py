"""The clock of a live session: once it has been stopped, nothing moves."""

from __future__ import annotations

import threading

from swashplate.links.live.clock import Clock

PERIOD = 0.1


def test_no_step_follows_a_stop_that_comes_during_the_wait() -> None:
    stepped, steps = threading.Event(), []

    def step() -> None:
        steps.append(1)
        stepped.set()

    clock = Clock(step, period=PERIOD, lock=threading.Lock())
    clock.start()
    try:
        clock.go(True)
        assert stepped.wait(5.0)
        clock.go(False)
        seen = len(steps)
        stepped.clear()
        assert not stepped.wait(3.0 * PERIOD)
        assert len(steps) == seen
        clock.go(True)
        assert stepped.wait(5.0)
    finally:
        clock.close()
