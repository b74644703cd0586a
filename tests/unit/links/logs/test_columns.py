"""The columns of a table on the page: guesses, a mapping with all its faults at once, and the next log of this kind."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("starlette", reason="the extra `live` is not installed")

import swashplate as sp
from logs_page import Asking
from swashplate.links.logs import kept_mappings

HEAD = "Zeit;Rollrate (deg/s);Querruder %;Temperatur"


def content(seed: int = 0, head: str = HEAD) -> bytes:
    time = np.arange(400) * 0.01
    wave = np.sin(4.0 * time + seed)
    rows = zip(
        time.tolist(), (20.0 * wave).tolist(), (-50.0 * wave).tolist(), (25.0 + 0.0 * wave).tolist(), strict=True
    )
    return "\n".join([head, *(";".join(f"{x:.4f}".replace(".", ",") for x in row) for row in rows)]).encode()


@pytest.fixture
def asking(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Asking]:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "settings"))
    made = Asking()
    yield made
    made.close()


def rows(told: dict[str, object], **changes: list[object]) -> list[list[object]]:
    """The guesses as the page sends them back, with some columns' [channel, unit, factor, offset] changed."""
    made = []
    for column in told["columns"]:  # type: ignore[attr-defined]
        own = [column["channel"], column["unit"], column["factor"], column["offset"]]
        made.append([column["index"], *changes.get(column["name"], own)])
    return [row for row in made if row[1]]


def listed(asking: Asking, log: int) -> dict[str, object]:
    return next(one for one in asking.client.get("/logs").json()["logs"] if one["id"] == log)


def test_a_foreign_table_is_mapped_and_the_next_one_opens_by_itself(asking: Asking) -> None:
    log = asking.drop("flug.csv", content())
    assert listed(asking, log)["foreign"] is True
    told = asking.post("/columns", log=log)
    assert [column["channel"] for column in told["columns"]] == ["time", "p", "mixer_roll", ""]
    assert all(len(column["values"]) > 100 for column in told["columns"][:3])
    wanted = rows(told, Querruder=["mixer_roll", "%", -1.0, 0.0])
    made = asking.post("/map-columns", log=log, rows=wanted, rate=0)
    assert made["faults"] == []
    flight = asking.desk.log(log).ready
    assert flight.channels == ("p", "mixer_roll")
    assert flight.values("mixer_roll") == pytest.approx(flight.values("p") * 0.5 / np.radians(20.0), abs=1e-4)
    again = asking.drop("flug2.csv", content(seed=1))
    assert (listed(asking, again)["foreign"], asking.desk.log(again).ready.channels) == (False, ("p", "mixer_roll"))
    shell = asking.desk.log(again).to_document()["code"]["shell"]
    assert f"--mapping {made['path']}" in shell, "a command reads it alike"
    assert sp.read(asking.desk.log(again).path, mapping=made["path"]).channels == ("p", "mixer_roll")
    other = asking.drop("other.csv", content(head=HEAD.replace("Zeit", "Uhrzeit")))
    assert listed(asking, other)["foreign"] is True, "other columns are another kind"


def test_every_fault_is_told_at_once_and_nothing_is_kept(asking: Asking) -> None:
    log = asking.drop("flug.csv", content())
    told = asking.post("/columns", log=log)
    wrong = rows(told, Querruder=["mixer_roll", "V", 1.0, 0.0], Temperatur=["q", "", 1.0, 0.0])
    made = asking.post("/map-columns", log=log, rows=wrong, rate=0)
    assert len(made["faults"]) >= 2
    assert any("mixer_roll" in text for text in made["faults"])
    assert any(text.startswith("q:") for text in made["faults"])
    twice = rows(told, Temperatur=["p", "deg/s", 1.0, 0.0])
    assert "two columns" in asking.post("/map-columns", log=log, rows=twice, rate=0)["faults"][0]
    assert not kept_mappings.folder().exists()


def test_a_table_without_time_and_names_takes_a_rate(asking: Asking) -> None:
    wave = np.sin(np.arange(300) * 0.1)
    text = "".join(f"{x:.3f},{2 * x:.3f}\n" for x in wave.tolist()).encode()
    log = asking.drop("bare.csv", text)
    assert listed(asking, log)["foreign"] is True
    told = asking.post("/columns", log=log)
    assert told["timed"] is False
    made = asking.post("/map-columns", log=log, rows=[[0, "p", "rad/s", 1.0, 0.0]], rate=50.0)
    assert made["faults"] == []
    flight = asking.desk.log(log).ready
    assert flight.time("p")[-1] == pytest.approx(299 / 50.0)


def test_a_kept_mapping_that_no_longer_fits_does_not_shut_a_log_out(asking: Asking) -> None:
    log = asking.drop("flug.csv", content())
    told = asking.post("/columns", log=log)
    asking.post("/map-columns", log=log, rows=rows(told), rate=0)
    (kept,) = kept_mappings.folder().glob("*.toml")
    kept.write_text("[channels]\np = {column = 'gone', unit = 'rad/s'}\n")
    again = asking.drop("flug.csv", content())
    assert listed(asking, again)["state"] == "ready"


def test_a_log_that_says_its_channels_has_no_columns(asking: Asking) -> None:
    log = asking.post("/example", file="coax_flight.bin")["log"]
    status, problem = asking.refused("/columns", log=log)
    assert status == 422
    assert "no table" in problem
