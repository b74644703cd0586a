"""what an ordinary flight tells, as the page has it: incidents at their times, answers with their bands."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

pytest.importorskip("starlette", reason="the extra `live` is not installed")

from logs_page import Asking
from swashplate.links.logs.flight_review import _LINES


@pytest.fixture(scope="module")
def asking() -> Iterator[Asking]:
    made = Asking()
    yield made
    made.close()


def test_the_example_oscillates_and_shakes_when_it_was_made_to(asking: Asking) -> None:
    log = asking.post("/example", file="ordinary_flight.bin")["log"]
    told = asking.post("/review", log=log)
    assert told["tells"] is True
    kinds = {one["kind"]: one for one in told["incidents"]}
    assert kinds["oscillation"]["start"] == pytest.approx(101.5, abs=1.5)
    assert kinds["oscillation"]["stop"] == pytest.approx(107.0, abs=1.0)
    assert "pitch" in kinds["oscillation"]["text"]
    assert kinds["vibration"]["start"] == pytest.approx(118.0, abs=0.3)
    loops = {one["axis"]: one for one in told["loops"]}
    step = {name: np.array(values) for name, values in loops["roll"]["step"].items()}
    assert (step["low"] <= step["response"]).all()
    assert (step["response"] <= step["high"]).all()
    assert step["response"][-1] == pytest.approx(1.0, abs=0.1)
    assert all(3 < len(one["frequency"]) <= _LINES for one in told["noise"])
    assert all(len(one["frequency"]) == len(one["after"]) == len(one["before"]) for one in told["noise"])
    assert any("SID_AXIS" in one["parameters"] for one in told["next"])
    compile(told["code"]["python"], "lines", "exec")


def test_a_table_without_loops_tells_nothing_and_says_so(asking: Asking) -> None:
    time = np.arange(500) * 0.01
    rows = "".join(f"{t:.2f},{np.sin(t):.4f}\n" for t in time)
    told = asking.post("/review", log=asking.drop("a.csv", f"time [s],p [rad/s]\n{rows}".encode()))
    assert told["incidents"] == []
    assert [one["step"] for one in told["loops"]] == [None]
