"""A stopped search keeps the best row so far; before its first iteration, or unasked, an interrupt ends everything."""

from __future__ import annotations

import signal
from collections.abc import Callable

import numpy as np
import pytest
from test_scoring import Valley

from swashplate.identification.core import stopping
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.scoring import Optimum, Solver, minimise

BY = {signal.SIGINT: KeyboardInterrupt(), signal.SIGTERM: SystemExit(128 + signal.SIGTERM)}


def _valley() -> Valley:
    return Valley(Row((Entry("x", "parameter", -1.2, 1.0), Entry("y", "parameter", 1.0, 1.0))))


def _stopped(at: int, by: BaseException) -> Callable[[int, float], None]:
    def progress(iteration: int, cost: float) -> None:
        if iteration == at:
            raise by

    return progress


def _search(**how: object) -> Optimum:
    return minimise(_valley(), Solver(tolerance=1e-9, **how))  # type: ignore[arg-type]


@pytest.mark.parametrize("number", list(BY))
def test_a_search_stopped_after_its_second_iteration_keeps_the_second_row(number: signal.Signals) -> None:
    two = _search(iterations=2)
    with stopping.stoppable() as stop:
        with stopping.kept():
            found = _search(progress=_stopped(2, BY[number]))
            again = _search()  # another search of the same fit takes what there is
        later = _search()  # what comes after the fit is no part of it
    np.testing.assert_array_equal(found.row, two.row)
    assert found.history == two.history
    assert not found.converged
    assert stop.code == 128 + number
    assert stop.sentence.startswith(f"stopped after 2 iterations by {number.name}")
    assert len(again.history) == 1
    assert not again.converged
    assert later.converged


class _Interrupted(Valley):
    """A valley whose scores are interrupted once, at a chosen call."""

    at = 0

    def scores(self, row: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        self.at -= 1
        if self.at == 0:
            raise KeyboardInterrupt
        return super().scores(row)


@pytest.mark.parametrize("at", [1, 2])
def test_a_stop_before_the_first_iteration_is_done_ends_everything(at: int) -> None:
    valley = _Interrupted(_valley().row)
    valley.at = at
    with stopping.stoppable() as stop, pytest.raises(KeyboardInterrupt), stopping.kept():
        minimise(valley)
    assert not stop.code


def test_a_stop_within_an_iteration_keeps_the_one_before() -> None:
    valley = _Interrupted(_valley().row)
    valley.at = 4  # the start and two iterations are scored before
    with stopping.stoppable() as stop, stopping.kept():
        found = minimise(valley, Solver(tolerance=1e-9))
    np.testing.assert_array_equal(found.row, _search(iterations=2).row)
    assert stop.iterations == 2


def test_a_second_stop_ends_everything() -> None:
    with stopping.stoppable(), stopping.kept():
        _search(progress=_stopped(1, KeyboardInterrupt()))
        with pytest.raises(KeyboardInterrupt):
            stopping.keep(KeyboardInterrupt())


def test_without_a_command_that_asked_an_interrupt_is_an_interrupt() -> None:
    with stopping.kept(), pytest.raises(KeyboardInterrupt):
        _search(progress=_stopped(2, KeyboardInterrupt()))
    with stopping.stoppable(), pytest.raises(KeyboardInterrupt):  # no stage whose numbers are kept
        _search(progress=_stopped(2, KeyboardInterrupt()))
    with stopping.stoppable(), stopping.kept(), pytest.raises(SystemExit):  # no signal
        _search(progress=_stopped(2, SystemExit(3)))
