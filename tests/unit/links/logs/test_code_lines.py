"""What the page gives to copy runs as it stands, and gives what the page shows."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pytest
from typer.testing import CliRunner

import swashplate as sp
from logs_page import table
from swashplate.cli.app import app
from swashplate.links.logs.code_lines import Read
from swashplate.links.logs.desk import Desk
from swashplate.links.logs.remedies import Remedy
from swashplate.links.logs.spectra import spectra
from swashplate.links.logs.track import track


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    mpl.use("Agg")
    table(tmp_path / "my flight.csv", flip=True, seed=4)
    table(tmp_path / "other.csv", seed=4, shift=2.5)
    return tmp_path


def python(code: dict[str, str]) -> dict[str, Any]:
    """The names that the lines leave."""
    names: dict[str, Any] = {}
    exec(code["python"], names)
    return names


def shell(code: dict[str, str]) -> str:
    """What the commands print."""
    said = ""
    for line in code["shell"].splitlines():
        words = shlex.split(line)
        assert words[0] == "swash"
        done = CliRunner().invoke(app, words[1:])
        assert done.exit_code == 0, done.output
        said += done.output
    return said


@pytest.fixture
def desk(folder: Path) -> Iterator[Desk]:
    mend = Remedy({"p": "-rad/s"})
    made = Desk(
        [(folder / name, Read(name, mend if name[0] == "m" else Remedy())) for name in ("my flight.csv", "other.csv")]
    )
    made.read_given()
    yield made
    made.close()


def test_a_log_read_with_options(desk: Desk, capsys: pytest.CaptureFixture[str]) -> None:
    code = desk.to_document()["logs"][0]["code"]
    flight = python(code)["flight"]
    assert flight.values("p").tolist() == desk.log(1).ready.values("p").tolist()
    assert str(sp.inspect(flight)) in capsys.readouterr().out
    assert "other sign" not in shell(code)
    unmended = desk.log(1).read.file
    assert "other sign" in CliRunner().invoke(app, ["inspect", unmended]).output


def test_a_part_of_channels_drawn(desk: Desk, folder: Path) -> None:
    code = desk.plot_code([(1, "p"), (1, "phi")], (5.0, 10.0))
    flight = python(code)["flight"]
    assert (flight.start, flight.stop) == pytest.approx((5.0, 10.0))
    assert (folder / "flight.pdf").stat().st_size > 1000
    (folder / "flight.pdf").unlink()
    shell(code)
    assert (folder / "flight.pdf").stat().st_size > 1000


def test_channels_of_two_logs_drawn(desk: Desk, folder: Path) -> None:
    code = desk.plot_code([(1, "p"), (2, "p"), (2, "q")], None)
    assert code["shell"] == "", "logs that were read differently are no one command"
    python(code)
    assert {path.name for path in folder.glob("*.pdf")} == {"flight-1.pdf", "flight-2.pdf"}


def test_one_log_brought_on_the_clock_of_another(desk: Desk, capsys: pytest.CaptureFixture[str]) -> None:
    found = desk.align(1, 2)
    python(found["code"])
    assert capsys.readouterr().out.strip() == found["words"]


def test_the_spectrum_of_a_channel(desk: Desk, capsys: pytest.CaptureFixture[str]) -> None:
    found = spectra(desk.log(1), "p", 2.0, 28.0)
    names = python(found["code"])
    assert names["density"].density[1:].tolist() == pytest.approx(found["density"].tolist())
    assert found["words"] in capsys.readouterr().out
    shell(found["code"])
    assert Path("spectrum.pdf").stat().st_size > 1000
    assert found["rotor"]["speed"] is None
    assert "no rotor speed" in found["rotor"]["words"]


def test_the_track(desk: Desk, folder: Path) -> None:
    found = track(desk.log(1))
    python(found["code"])
    assert (folder / "track.pdf").is_file()
    assert found["code"]["shell"] == "", "a log without a place is nothing for swash replay"
    assert found["notes"] == [
        "The log has no place: the attitude is drawn at one point.",
        "The log does not say what flew: the shape of raptor50 is drawn.",
    ]
    assert found["angles"][:, 0].max() == pytest.approx(desk.log(1).ready.values("phi").max(), abs=1e-3)


def test_every_option_of_a_reading_is_in_both() -> None:
    read = Read("a b.bbl", Remedy({"p": "deg/s"}, True), "m.toml", 2)
    assert read.named(1.0, 2.5) == "'a b.bbl#2@1-2.5'"
    assert read.option_text == "--mapping m.toml --unit p=deg/s --drop-bad-stamps"
    line = read.python()
    assert line == "flight = sp.read('a b.bbl', units={'p': 'deg/s'}, mapping='m.toml', bad_stamps=\"drop\", log=2)"
