"""`swash inspect FILE --map`: a person's own table is read, and the next one like it opens by itself."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from commands import swash

import swashplate as sp


@pytest.fixture
def german(shared_data: Path, tmp_path: Path) -> Path:
    source = shared_data / "field" / "flug1_roll.csv"
    if not source.is_file():
        pytest.skip("flug1_roll.csv is not here")
    return source


def test_a_table_is_mapped_and_the_next_opens_by_itself(
    german: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    told = swash("inspect", german, "--map", "--json")
    assert told.code == 0, told.err
    document = json.loads(told.out)
    channels = tomllib.loads(document["mapping"])["channels"]
    assert channels["p"]["column"] == "Rollrate"
    assert channels["phi"]["unit"] == "°"
    assert Path(document["path"]).is_file()
    again = swash("inspect", german, "--json")
    assert "read with the mapping that was kept for these columns" in again.err
    names = {channel["name"] for channel in json.loads(again.out)["channels"]}
    assert {"p", "q", "phi", "theta", "mixer_roll"} <= names
    flight = sp.read(german, mapping=tomllib.loads(document["mapping"]))
    assert np.degrees(np.abs(flight.values("phi")).max()) < 90.0


def test_what_does_not_read_is_told_at_once_and_kept_nowhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    table = tmp_path / "wrong.csv"
    rows = "".join(f"{0.02 * k:.2f},{k % 9},x{k},{k % 5}\n" for k in range(100))
    table.write_text("time,Rollrate,mixer_roll,Nickrate\n" + rows)
    mapping = tmp_path / "mapping.toml"
    mapping.write_text(
        "[channels]\ntime = {column = 'time', unit = 's'}\np = {column = 'Rolrate', unit = 'deg/s'}\n"
        "q = {column = 'Nickrate', unit = 'V'}\nmixer_roll = {column = 'mixer_roll', unit = '1'}\n"
    )
    told = swash("inspect", table, "--map", "--mapping", mapping)
    assert told.code == 2
    for fault in ("Rolrate", "is not a number", "unit"):
        assert fault in told.err
    assert not (tmp_path / "config").exists() or not list((tmp_path / "config").rglob("*.toml"))


def test_a_log_that_names_its_channels_has_no_map(shared_data: Path) -> None:
    told = swash("inspect", shared_data / "ardupilot_sitl" / "heli_sid_allbits_roll_rate.BIN", "--map")
    assert told.code == 2
    assert "is no table" in told.err
