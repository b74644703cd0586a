"""`swash bench`: records there, card and report back, and every way in which nothing is written."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from commands import one_message, saying, swash

import swashplate as sp
from simulated_flights import FREE, TIE
from swashplate.bench.evaluate import MEASURED, evaluate
from swashplate.bench.plan import plan, planned
from swashplate.bench.record import BenchRecord, write_record
from swashplate.bench.virtual_bench import virtual_bench
from swashplate.models.card import read_card
from swashplate.reporting.bench import compose_bench
from swashplate.reporting.structure import Table


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three small records of the virtual bench."""
    folder = tmp_path_factory.mktemp("bench") / "records"
    made = swash("bench", "simulate", folder, "--seed", "3", "--only", "drive_steps", "--only", "fuselage_drag")
    assert made.code == 0
    assert "4 records in" in made.out
    return folder


def test_records_become_a_card_and_a_report(records: Path, tmp_path: Path) -> None:
    done = swash("bench", records, "--out", tmp_path / "card.toml", "--out", tmp_path / "report.html")
    assert (done.code, done.err) == (0, "")
    assert "bench: drive_steps from steps_upper.csv" in done.out
    assert "Kept as published, no record: k_drive_voltage" in done.out
    card = sp.vehicle(tmp_path / "card.toml").card  # a vehicle like any other
    entry = card.parameters["tau_drive_upper"]
    assert entry.status == "measured"
    assert entry.sigma is not None
    assert abs(entry.value - 0.185) < 5.0 * entry.sigma
    assert card.parameters["mass"].status == "published"
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    for words in ("coax on the test bench", "Fankhauser et al., sec. IV-A2", "published value kept: no record"):
        assert words in page


def test_the_word_evaluate_may_be_left_out_and_json_has_the_numbers(records: Path) -> None:
    one, two = swash("bench", records, "--json"), swash("bench", "evaluate", records, "--json")
    assert one == two
    document = json.loads(one.out)
    assert set(document["parameters"]) == {"tau_drive_upper", "tau_drive_lower", "drag_x", "drag_y"}
    assert "tau_f_lower" in document["kept"]


def test_the_plan_says_what_to_measure_and_how_often() -> None:
    done = swash("bench", "plan", "--only", "supply", "--accuracy", "0.005")
    assert done.code == 0
    assert "supply 10.5 to 12.5 V in steps of 0.25 V and back" in done.out
    assert "passes for 0.5 %" in done.out
    rough, fine = (plan(sp.vehicle("coax"), only=["supply"], accuracy=a).aims[0] for a in (0.02, 0.002))
    assert rough.repeats == 1
    assert fine.repeats is not None
    assert fine.sigma / fine.repeats**0.5 <= 0.002 * 13.6 < fine.sigma / (fine.repeats - 1) ** 0.5
    document = json.loads(swash("bench", "plan", "--only", "supply", "--json").out)
    assert document["parameters"][0]["name"] == "k_drive_voltage"
    assert "no such procedure" in one_message(swash("bench", "plan", "--only", "weighing"))
    told = one_message(swash("bench", "plan", "--only", "supply_compensated"))
    assert "supply_compensated: is for records that exist" in told


def test_repeats_sharpen_what_comes_out(tmp_path: Path) -> None:
    sigmas = []
    for repeats in ("1", "4"):
        folder = tmp_path / repeats
        assert (
            swash("bench", "simulate", folder, "--only", "supply", "--quiet", "--settings", saying(repeats=repeats)).out
            == ""
        )
        assert swash("bench", folder, "--out", tmp_path / "c.toml", "--quiet").out == ""
        sigmas.append(read_card(tmp_path / "c.toml").parameters["k_drive_voltage"].sigma or 0.0)
    assert sigmas[1] == pytest.approx(0.5 * sigmas[0], rel=0.4)


def test_the_report_shows_every_procedure_with_its_figures() -> None:
    coax = sp.vehicle("coax")
    report = compose_bench(evaluate(virtual_bench(coax, planned(coax), seed=2), coax))
    titles = [section.title for section in report.sections]
    assert len(titles) == 15  # the card, the twelve procedures of the plan, what it was made with, the words
    assert report.picture is not None
    assert [key.words for key in report.picture.keys] == ["total", "flapping", "tilt of the thrust"]
    assert len(report.figures) > 18
    identifiers = [figure.identifier for figure in report.figures]
    assert len(set(identifiers)) == len(identifiers)
    (table,) = report.sections[0].blocks
    assert isinstance(table, Table)
    assert len(table.rows) == len(MEASURED)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda text: text.replace("Fx [N]", "F1 [N]"), "Fx: the column is missing"),
        (lambda text: text.replace("# procedure: fuselage_drag", "# procedure: weighing"), "'weighing' is not known"),
        (lambda text: "\n".join(text.splitlines()[:40]), "fan_front.csv"),
        (lambda text: text.replace("Fx [N]", "Fx [m]"), "Fx: unit 'm'"),
    ],
)
def test_a_bad_record_ends_without_a_card(records: Path, tmp_path: Path, spoil: object, message: str) -> None:
    assert callable(spoil)
    folder = tmp_path / "records"
    folder.mkdir()
    for file in records.glob("*.csv"):
        text = file.read_text(encoding="utf-8")
        (folder / file.name).write_text(spoil(text) if file.name == "fan_front.csv" else text, encoding="utf-8")
    done = swash("bench", folder, "--out", tmp_path / "card.toml", "--out", tmp_path / "report.html")
    assert message in one_message(done)
    assert [path.name for path in tmp_path.iterdir()] == ["records"]


def _cells(change: Callable[[dict[str, np.ndarray]], None]) -> Callable[[BenchRecord], BenchRecord]:
    """A record with its columns changed in place."""

    def spoiled(record: BenchRecord) -> BenchRecord:
        channels = {name: values.copy() for name, values in record.channels.items()}
        change(channels)
        return replace(record, channels=channels)

    return spoiled


@pytest.mark.parametrize(
    ("procedure", "file", "spoil", "message"),
    [
        ("thrust", "sweep_lower.csv", lambda c: c.pop("Mz"), "Mz: the column is missing"),
        ("thrust", "sweep_lower.csv", lambda c: c.update(Fz=-c["Fz"]), "Turn the sign of Fz"),
        ("thrust", "sweep_upper.csv", lambda c: c.update(Mz=-c["Mz"]), "Turn the sign of Mz"),
        ("thrust", "sweep_lower.csv", lambda c: c.update(Fz=np.maximum(c["Fz"], -4.0)), "the sensor is saturated"),
        (
            "thrust",
            "sweep_upper.csv",
            lambda c: c.update(omega_upper=0.4 * c["omega_upper"]),
            "did not reach its speed",
        ),
        (
            "thrust",
            "sweep_upper.csv",
            lambda c: c.update({name: values[:1200] for name, values in c.items()}),
            "expected at least 5",
        ),
        ("bar_linkage", "bar_linkage.csv", lambda c: c.update(Fy=-c["Fy"]), "Turn the sign of the lateral forces"),
    ],
)
def test_what_spoils_a_measurement_ends_in_words_without_a_card(
    tmp_path: Path, procedure: str, file: str, spoil: Callable[[dict[str, np.ndarray]], None], message: str
) -> None:
    """Every way of the issue, from files as a user has them: exit code 2, one message, neither card nor report."""
    folder = tmp_path / "records"
    folder.mkdir()
    for record in _bench_of(procedure):
        write_record(_cells(spoil)(record) if record.name == file else record, folder / record.name)
    done = swash("bench", folder, "--out", tmp_path / "card.toml", "--out", tmp_path / "report.html")
    words = one_message(done)
    assert file in words
    assert message in words
    assert [path.name for path in tmp_path.iterdir()] == ["records"]


@cache
def _bench_of(procedure: str) -> tuple[BenchRecord, ...]:
    coax = sp.vehicle("coax")
    return virtual_bench(coax, planned(coax, [procedure]), seed=4)


def test_real_bench_files_are_evaluated_and_shown(shared_data: Path, tmp_path: Path) -> None:
    folder = shared_data / "coax56"
    card = tmp_path / "card.toml"
    done = swash("bench", folder / "bench_input_to_rpm.mat", folder / "bench_voltage_to_rpm.mat", "--out", card)
    assert (done.code, done.err) == (0, "")
    assert "Left out: upper at 0.8: saturation" in done.out
    assert "k_drive_voltage of the lower rotor by itself" in done.out
    assert set(read_card(card).correlations) <= {"k_drive_upper", "k_drive_lower", "o_drive_upper", "o_drive_lower"}
    assert "is no bench record" in one_message(swash("bench", folder / "flight_2011-08-01_vertical.mat"))
    shown = swash("inspect", folder / "bench_input_to_rpm.mat")
    assert "bench record for speed_map; 11 averaged points without a time base" in shown.out


def test_inspect_shows_a_record_of_the_virtual_bench(records: Path) -> None:
    shown = swash("inspect", records / "fan_front.csv")
    assert "bench record for fuselage_drag" in shown.out
    assert "anemometer: speed of the air from the front" in shown.out


def test_places_that_cannot_be_written_to_are_found_first(records: Path, tmp_path: Path) -> None:
    assert "expected one of .toml, .html" in one_message(swash("bench", records, "--out", tmp_path / "card.json"))
    assert "the folder does not exist" in one_message(swash("bench", records, "--out", tmp_path / "no" / "r.html"))
    assert "is not a folder and not a file" in one_message(swash("bench", tmp_path / "nothing"))


@pytest.mark.proof  # what a card fixes and holds is in tests/unit/identification/core/test_prior_card.py
def test_a_bench_card_is_the_prior_of_a_flight(records: Path, simulated: Path, tmp_path: Path) -> None:
    assert swash("bench", records, "--out", tmp_path / "card.toml", "--quiet").code == 0
    asked = ("--free", ",".join(FREE), "--settings", f"tie={TIE}", "--method", "output-error")
    done = swash(
        "identify", "--vehicle", "coax", "--flight", simulated, *asked, "--prior", tmp_path / "card.toml",
        "--prior", "linkage_lower=0.13,0.05", "--out", tmp_path / "fit",
    )  # fmt: skip
    assert done.code == 0, done.err
    fit = json.loads((tmp_path / "fit" / "fit.json").read_text(encoding="utf-8"))
    assert set(fit["settings"]["held at the prior card"]) == {"tau_drive_upper", "tau_drive_lower", "drag_x", "drag_y"}
    card = read_card(tmp_path / "fit" / "model.toml")
    assert card.parameters["tau_drive_upper"].source.startswith("bench: drive_steps")
    assert "Do prior and flight agree?" in (tmp_path / "fit" / "report.html").read_text(encoding="utf-8")
    none = swash("identify", "--vehicle", "coax", "--flight", simulated, "--prior", "coax")
    assert "no parameter with status measured" in one_message(none)


def test_a_prior_of_two_cards_is_refused() -> None:
    two = swash("identify", "--vehicle", "coax", "--flight", "any.nc", "--prior", "coax", "--prior", "card.toml")
    assert "are two cards" in one_message(two)
