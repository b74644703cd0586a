"""Recordings of the live page are on disk while they are flown: a full disk and a kill cost what was not written."""

from __future__ import annotations

import asyncio
import errno
import os
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import FlightError, WriteError
from swashplate.flights.flight import Flight
from swashplate.links.live import recording as module
from swashplate.links.live.recording import LiveRecording, recover
from swashplate.links.live.session import LiveSession
from told_rows import rows, told

PERIOD = 0.01


def begun(folder: Path, count: int = 300) -> tuple[LiveRecording, np.ndarray]:
    going, table = LiveRecording(sp.vehicle("coax"), period=PERIOD, folder=folder), rows(count)
    for row in table:
        going.add(row)
    return going, table


@pytest.fixture(autouse=True)
def uncompiled(monkeypatch: pytest.MonkeyPatch) -> None:
    """No page flies here: rows are told to the session as a page tells them."""
    monkeypatch.setattr("swashplate.links.live.session.web_assembly", lambda source: b"")


def fly(session: LiveSession, count: int) -> None:
    """So many periods more, as a page tells them."""
    session.fly(told(session.version, session._tick + 1, count))


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_every_row_is_on_disk_before_the_recording_ends(tmp_path: Path) -> None:
    going, table = begun(tmp_path)
    assert names(tmp_path) == ["card-1.toml", "recording-1.growing"]
    flown = sp.read(going.path)
    assert np.array_equal(flown.values("psi"), table[:, sp.vehicle("coax").state_names.index("psi")])
    assert recover(tmp_path, print) == (), "it is alive"
    saved = going.finish()
    assert names(tmp_path) == ["card-1.toml", "recording-1-truth.nc", "recording-1.nc"]
    assert Flight.load(tmp_path / "recording-1-truth.nc").values("psi").size == 300
    assert (saved.seconds, saved.period) == (pytest.approx(2.99), pytest.approx(PERIOD))


def test_a_full_disk_ends_the_recording_with_what_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session = LiveSession(sp.vehicle("coax"), controller=None, folder=tmp_path)
    asyncio.run(session.obey({"type": "record", "value": True}))
    fly(session, 250)

    def full(*_: object) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as during:
        during.setattr(os, "write", full)
        fly(session, 50)
    notice = session.report()["notice"]
    assert notice.startswith("The recording has stopped after 2.5 s: ")
    assert "No space left on device" in notice
    asyncio.run(session.obey({"type": "record", "value": False}))
    assert session.notice.startswith(notice)
    assert session.notice.endswith(f"What it has is saved: {tmp_path / 'recording-1.nc'}.")
    truth = Flight.load(tmp_path / "recording-1-truth.nc")
    assert truth.values("x").size == 250
    assert [recording.number for recording in session.recordings] == [1]
    session.close()


def test_flights_that_cannot_be_written_leave_the_growing_file_for_the_next_session(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[str] = []
    session = LiveSession(sp.vehicle("coax"), controller=None, folder=tmp_path, tell=told.append)
    asyncio.run(session.obey({"type": "record", "value": True}))
    fly(session, 250)

    def full(path: Path) -> None:
        raise WriteError("cannot be written: No space left on device.", where=path)

    with monkeypatch.context() as during:
        during.setattr(module, "added_when_complete", full)
        with pytest.raises(FlightError, match=r"No space left on device\. What was flown stays in .*-1\.growing"):
            asyncio.run(session.obey({"type": "record", "value": False}))
        assert names(tmp_path) == ["card-1.toml", "recording-1.growing"]
        asyncio.run(session.obey({"type": "record", "value": True}))
        fly(session, 250)
        session.close()
    assert names(tmp_path) == ["card-1.toml", "card-2.toml", "recording-1.growing", "recording-2.growing"]
    assert told[:2] == [f"Recording {n} grows in {tmp_path / f'recording-{n}.growing'}." for n in (1, 2)]
    assert told[2].startswith("Recording 2: ")
    assert "What was flown stays in" in told[2]
    said: list[str] = []
    assert recover(tmp_path, said.append) == (tmp_path / "recording-1.nc", tmp_path / "recording-2.nc")
    assert [Flight.load(tmp_path / f"recording-{n}-truth.nc").values("x").size for n in (1, 2)] == [250, 250]
    assert not list(tmp_path.glob("*.growing"))
    assert said[0] == f"an earlier recording was cut off; its 2.5 s are saved: {tmp_path / 'recording-1.nc'}."


def test_what_was_left_too_short_or_without_its_vehicle(tmp_path: Path) -> None:
    short, _ = begun(tmp_path, 100)
    lost, _ = begun(tmp_path)
    for going in (short, lost):
        going._growing.close()
    (tmp_path / "card-2.toml").unlink()
    (tmp_path / "recording-x.growing").write_text("somebody else's")
    said: list[str] = []
    assert recover(tmp_path, said.append) == ()
    assert names(tmp_path) == ["card-1.toml", "recording-2.growing", "recording-x.growing"]
    assert len(said) == 1
    assert said[0].startswith("an earlier recording was cut off and stays as it is: ")
    assert "card-2.toml" in said[0]


def test_a_second_press_on_record_loses_nothing_and_half_an_hour_is_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = LiveSession(sp.vehicle("coax"), controller=None, folder=tmp_path)
    for _ in range(2):
        asyncio.run(session.obey({"type": "record", "value": True}))
        fly(session, 150)
    assert session.report()["recording"] == 3.0
    monkeypatch.setattr(module, "LONGEST", 3.5)
    fly(session, 100)
    assert session.report()["notice"] == "The recording ends here: it has 3.5 s. Save it, and begin another one."
    session.close()
    assert Flight.load(tmp_path / "recording-1-truth.nc").values("x").size == 350
