"""`swash inspect` on autopilot logs: whole, cut off, and such as nobody can read."""

from __future__ import annotations

import json
from pathlib import Path

from commands import one_message, swash

from made_autopilot_logs import ardupilot_rows, dataflash, ulog
from swashplate.models.linear.state_space_file import structure, to_toml


def test_a_log_is_shown_with_rates_and_sweeps(tmp_path: Path) -> None:
    path = tmp_path / "flight.bin"
    path.write_bytes(dataflash(ardupilot_rows()))
    outcome = swash("inspect", path)
    assert (outcome.code, outcome.err) == (0, "")
    for part in ("rates", "mixer_roll", "50.0", "roll mixer: 22.00 to 34.00 s, 0.5 to 8 Hz (as the log says)", "XYZ1"):
        assert part in outcome.out
    document = json.loads(swash("inspect", path, "--json").out)
    assert document["sweeps"][0]["high"] == 8.0
    assert document["damage"] == []


def test_a_cut_log_is_shown_as_far_as_it_goes_and_ends_with_an_error(tmp_path: Path) -> None:
    path, content = tmp_path / "flight.bin", dataflash(ardupilot_rows())
    path.write_bytes(content[: len(content) // 2])
    outcome = swash("inspect", path)
    assert outcome.code == 2
    assert "mixer_roll" in outcome.out
    assert "the log is cut off" in outcome.out
    assert outcome.err.startswith("Error: ")
    assert outcome.err.count("\n") == 1
    for part in ("flight.bin", "cut off", "Everything else was read"):
        assert part in outcome.err
    assert json.loads(swash("inspect", path, "--json").out)["damage"]


def test_a_reset_clock_is_said(tmp_path: Path) -> None:
    path = tmp_path / "flight.bin"
    rows = ardupilot_rows(start=100.0, until=104.0, disarm=False) + ardupilot_rows(start=20.0)
    path.write_bytes(dataflash(rows))
    outcome = swash("inspect", path)
    assert outcome.code == 2
    assert "clock starts anew" in outcome.err
    assert "22.00 to 34.00 s" in outcome.out


def test_a_damaged_ulog_and_an_empty_log_are_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.ulg").write_bytes(ulog()[:400])
    assert "a.ulg: holds no flight" in one_message(swash("inspect", tmp_path / "a.ulg"))
    (tmp_path / "a.bin").write_bytes(dataflash([]))
    assert "a.bin: holds no flight" in one_message(swash("inspect", tmp_path / "a.bin"))


def test_a_log_cut_off_is_named_where_a_model_is_held_against_it(tmp_path: Path) -> None:
    path, model = tmp_path / "cut.bin", tmp_path / "model.toml"
    whole = dataflash(ardupilot_rows())
    path.write_bytes(whole[: len(whole) // 2])
    model.write_text(to_toml(structure("rotor_body")), encoding="utf-8")
    done = swash("validate", "--vehicle", model, "--flight", path, "--out", tmp_path / "out")
    assert done.code == 2
    assert "cut off" in done.err
    assert "what was read is used" in done.out  # the numbers come all the same, marked
    assert "J_rms" in done.out
    assert "cut off" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
