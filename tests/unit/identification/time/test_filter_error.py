"""Commands of another time are told from those of the motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

import swashplate as sp
from simulated_flights import FREE, ten_seconds
from swashplate.arrays import Array
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.records import Record, records
from swashplate.identification.time.filter_error import SHIFTS, FilterError, unrelated


@lru_cache(maxsize=1)
def piece() -> Record:
    (found,) = records((ten_seconds().condition(rate=100.0, cutoff=0.0),), sp.vehicle("coax"))
    return found


def cost(commands: Sequence[Array]) -> float:
    likelihood = FilterError(parameterize(sp.vehicle("coax"), list(FREE)), [piece()])
    under = likelihood.cost_under(commands, likelihood.row.starts())
    assert under == likelihood.of(likelihood.table, [replace(piece(), inputs=commands[0])]).cost(
        likelihood.row.starts()
    )
    return under


def test_the_commands_of_the_flight_explain_it() -> None:
    assert unrelated(cost, [piece()]) == ""


def test_commands_of_another_time_are_refused_in_words() -> None:
    late = replace(piece(), inputs=np.roll(piece().inputs, 437, axis=0))
    told = unrelated(cost, [late])
    assert "the motion does not follow the commands" in told
    assert "s later explain it as well" in told


def test_unrelated_commands_pass_one_time_in_twenty() -> None:
    random, n = np.random.default_rng(1), 40 * (SHIFTS + 1)
    rows = [replace(piece(), inputs=random.standard_normal((n, 4)), outputs=np.zeros((n, 6))) for _ in range(400)]
    motion = random.standard_normal((400, n))
    passed = 0
    for row, moved in zip(rows, motion, strict=True):
        passed += not unrelated(lambda commands, y=moved: -float(y @ commands[0][:, 0]), [row])  # type: ignore[misc]
    assert 0.02 < passed / 400 < 0.09
