"""A long log is drawn while it is still being checked, and says that it is."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from logs_page import table
from swashplate.errors import FlightError, SwashError
from swashplate.flights.flight import Flight
from swashplate.flights.inspect import inspect
from swashplate.links.logs import opened
from swashplate.links.logs.code_lines import Read
from swashplate.links.logs.desk import Desk
from swashplate.links.logs.remedies import Remedy


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[Desk]:
    table(tmp_path / "flipped.csv", flip=True)
    made = Desk([(tmp_path / "flipped.csv", Read("flipped.csv"))])
    yield made
    made.close()


def slow(monkeypatch: pytest.MonkeyPatch, after: Callable[[Flight], Any]) -> threading.Event:
    """Checks that wait until they are let go."""
    let_go = threading.Event()

    def checked(flight: Flight) -> Any:
        let_go.wait(10.0)
        return after(flight)

    monkeypatch.setattr(opened, "inspect", checked)
    monkeypatch.setattr(opened, "_PATIENCE", 0.01)
    return let_go


def settled() -> None:
    for thread in threading.enumerate():
        if thread.name == opened.CHECKING:
            thread.join(10.0)


def test_it_is_drawn_first_and_its_findings_follow(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    let_go = slow(monkeypatch, inspect)
    desk.read_given()
    (log,) = desk.to_document()["logs"]
    assert (log["state"], log["checked"], log["problems"]) == ("ready", False, [])
    (drawn,) = desk.traces([(1, "p", 0.0, 30.0)], bins=100)
    assert len(drawn["time"]) > 100
    with pytest.raises(SwashError, match="still being checked"):
        desk.identify(1, 0, "", "")
    let_go.set()
    settled()
    (log,) = desk.to_document()["logs"]
    assert (log["state"], log["checked"]) == ("ready", True)
    assert "other sign" in log["problems"][0]["text"]


def test_a_check_that_fails_is_said(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(flight: Flight) -> None:
        raise FlightError("has events that are no numbers.", channel="events")

    slow(monkeypatch, fails).set()
    desk.read_given()
    settled()
    (log,) = desk.to_document()["logs"]
    assert (log["state"], log["problem"]) == ("failed", "events: has events that are no numbers.")


def test_findings_of_an_earlier_reading_do_not_come_back(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    let_go = slow(monkeypatch, inspect)
    desk.read_given()
    monkeypatch.setattr(opened, "inspect", inspect)
    desk.apply(1, Remedy({"p": "-rad/s"}))
    settled_before = desk.log(1).inspection
    let_go.set()
    settled()
    assert desk.log(1).inspection is not None
    assert desk.to_document()["logs"][0]["problems"] == []
    assert settled_before is None or settled_before is desk.log(1).inspection
