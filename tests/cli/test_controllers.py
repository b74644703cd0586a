"""`swash control decouple` and `swash simulate --controller`: the file between them, and what they say to bad input."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from commands import saying, swash

import swashplate as sp
from made_results import result
from report_pages import whole
from swashplate.control.kinds import load_controller, save_controller
from swashplate.control.laws.autopilot import autopilot
from swashplate.errors import ControllerError


@pytest.fixture(scope="module")
def held(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of a law that holds its place."""
    file = tmp_path_factory.mktemp("held") / "place.toml"
    assert swash("control", "decouple", "coax", "--mode", "place", "--out", file, "--quiet").code == 0
    return file


def test_figure_10_by_two_commands(tmp_path: Path) -> None:
    drift = {}
    for name, options, lag in (
        ("by the paper", ("--lag", "battery"), "17.01"),
        ("straight", ("--step", "0.2"), "19.77"),
        ("constant", ("--lag", "20"), "20.00"),
    ):
        file, flown = tmp_path / f"{name}.toml", tmp_path / f"{name}.nc"
        designed = swash("control", "decouple", "coax", *options, "--out", file)
        assert designed.code == 0, designed.err
        assert lag in designed.out
        maneuver = ("--maneuver", "step:pitch,4.6s,0.2", "--pilot", "--rate", "500")
        simulated = swash("simulate", "--vehicle", "coax", "--controller", file, *maneuver, "--out", flown, "--quiet")
        assert simulated.code == 0, simulated.err
        flight = sp.read(flown).between(0.0, 7.6)  # 3 s of hover before
        assert flight.values("x")[-1] > 5.8
        drift[name] = abs(flight.values("y")[-1])
    assert drift["by the paper"] == pytest.approx(0.65, abs=0.05)
    assert drift["straight"] < 0.1
    assert drift["constant"] < 0.15


def test_a_controller_comes_back_from_its_file(tmp_path: Path) -> None:
    coax = sp.vehicle("coax")
    made = autopilot(coax, sp.trim(coax), mode="speed", lag="motor", rate=50.0)
    save_controller(made, tmp_path / "c.toml")
    again = load_controller(tmp_path / "c.toml")
    assert again == made
    np.testing.assert_array_equal(again.gains, made.gains)


def test_c_code_is_written_where_asked(tmp_path: Path) -> None:
    pytest.importorskip("casadi")
    outcome = swash("control", "decouple", "coax", "--out", tmp_path / "c.c", "--settings", saying(precision="float"))
    assert outcome.code == 0, outcome.err
    assert "operations, " in outcome.out
    assert "void swash_step(float memory[5]" in (tmp_path / "c.c").read_text()


def test_decoupling_of_a_linear_model_as_a_page(tmp_path: Path) -> None:
    outcome = swash("control", "decouple", "hybrid", "--out", tmp_path / "d.html")
    assert outcome.code == 0, outcome.err
    page = whole(tmp_path / "d.html")
    assert "p over q [%]" in page
    assert "largest off-axis over on-axis response at 3 rad/s: bare inputs" in page
    assert "The filter's modes" in page or "The filter&#39;s modes" in page


def test_json_says_what_the_table_says() -> None:
    found = json.loads(swash("control", "decouple", "coax", "--lag", "hover", "--json").out)
    assert found["lag_at_hover_deg"] == pytest.approx(17.01, abs=0.01)
    assert found["law"]["k_zeta"] == 0.0
    assert found["least_stable_mode"]["real"] == pytest.approx(0.247, abs=0.002)
    assert "margins" not in found  # of an unstable loop
    held = json.loads(swash("control", "decouple", "coax", "--mode", "place", "--json").out)["margins"]
    assert held["servo_roll"]["phase_deg"] > held["together"]["phase_deg"] > 20.0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            ("control", "decouple", "coax", "--lag", "wrong"),
            "lag: is 'wrong', expected straight, hover, motor, battery or a number.",
        ),
        (
            ("control", "decouple", "coax", "--lag", "44", "--settings", saying(mixing="as_printed")),
            "no inverse at 45 deg",
        ),
        (("control", "decouple", "coax", "--lag", "1e9"), "--lag: is 1e9 degrees, expected at most 180 either way"),
        (("control", "decouple", "coax", "--settings", saying(voltage="nan")), "voltage: 'nan' is not a number"),
        (("vehicle", "trim", "raptor50", "--climb", "nan"), "--climb: 'nan' is not a number"),
        (("control", "decouple", "coax", "--out", "c.json"), "ends in '.json', expected .toml, .c or .html"),
        (("control", "decouple", "coax", "--out", "c.h"), "ends in '.h', expected one of .toml, .c"),
        (("control", "decouple", "nothing.toml"), "neither a vehicle's name nor a file"),
        (("control", "decouple", "coax", "--mode", "place", "--settings", saying(rate=6)), "growing mode"),
        (("control", "decouple", "coax", "--step", "0.2", "--to-speed", "1.8"), "--step and --to-speed: are two steps"),
        (("control", "decouple", "coax", "--to-speed", "-1"), "--to-speed: is -1, expected at least 0.01 m/s"),
        (("control", "decouple", "coax", "--to-speed", "40"), "reaches"),
        (("control", "decouple", "coax", "--drift", "0.4"), "--drift: was seen on a step"),
        (("control", "decouple", "coax", "--step", "0.2", "--drift", "60"), "--drift: is 60, expected -6 to 6 m"),
        (("control", "decouple", "coax", "--out", "path.pdf"), "ends in '.pdf', expected one of"),
        (("control", "decouple", "raptor50", "--pair", "cyclic=p"), "has no input cyclic; it has theta0, B1, A1"),
        (("control", "decouple", "hybrid", "--pair", "lateral=p", "--pair", "longitudinal=p"), "gives p to two inputs"),
        (("control", "decouple", "hybrid", "--settings", saying(at="1,0")), "at: '1,0' is not all positive"),
        (("control", "check", "coax", "--controller", "nowhere.toml"), "nowhere.toml: there is no such file"),
        (("control", "check", "coax", "--controller", "x.toml", "--scale", "0"), "--scale: is 0, expected a positive"),
        (
            ("simulate", "--vehicle", "coax", "--maneuver", "step:pitch,1s", "--pilot", "--out", "f.nc"),
            "--pilot: is for",
        ),
    ],
)
def test_bad_input_gives_2_and_says_why(arguments: tuple[str, ...], said: str) -> None:
    outcome = swash(*arguments)
    assert outcome.code == 2
    assert said in outcome.err


def test_bad_files_are_named_with_their_entry(tmp_path: Path) -> None:
    coax = sp.vehicle("coax")
    good = tmp_path / "good.toml"
    save_controller(autopilot(coax, sp.trim(coax)), good)
    text = good.read_text()
    for change, said in (
        (("linkage", "leverage"), r"law.leverage: is not known here"),
        (('kind = "controller"', 'kind = "vehicle"'), "kind is 'vehicle', expected 'controller'"),
        (("schema = 1", "schema = 9"), "schema: invalid enum value 9"),
        (('type = "autopilot"', 'type = "autopiolt"'), "is 'autopiolt', expected ardupilot, autopilot, lqg"),
        (('mode = "place"', 'mode = "acro"'), "mode: is 'acro'"),
        (("rate = 100.0", "rate = 0.0"), "rate: is 0 Hz"),
        (("climb = 3.0", "climb = nan"), r"motors\.climb: is nan, expected a finite number"),
        (("[cyclic]", "[cyclic"), "is not TOML"),
    ):
        bad = tmp_path / "bad.toml"
        assert change[0] in text
        bad.write_text(text.replace(*change))
        with pytest.raises(ControllerError, match=said):
            load_controller(bad)
    bad.write_text(text.replace('vehicle = "coax"', 'vehicle = "raptor"'))
    command = ("simulate", "--vehicle", "coax", "--maneuver", "step:pitch,1s", "--controller", bad)
    outcome = swash(*command, "--out", tmp_path / "f.nc")
    assert outcome.code == 2
    assert "is for 'raptor', not for 'coax'" in outcome.err


def test_the_step_is_flown_on_models_that_the_data_cannot_tell_apart(tmp_path: Path) -> None:
    coax, names = sp.vehicle("coax"), ["o_zeta_lower", "o_zeta_upper"]
    values, covariance = coax.card.values(), np.radians(1.0) ** 2 * np.eye(2)
    fit = result(coax, {n: values[n] for n in names}, covariance, corrected=covariance).save(tmp_path / "fit.json")
    how = ("--step", "0.2", "--lag", "battery", "--fit", fit, "--settings", "draws=60")
    found = json.loads(swash("control", "decouple", "coax", *how, "--json").out)["step"]
    assert found["without"]["drift"] == pytest.approx(-0.77, abs=0.05)
    assert found["with"]["drift"] == pytest.approx(0.65, abs=0.03)
    low, high = (found[f"with, {percent} %"]["drift"] for percent in (5, 95))
    # One degree of either lag is 0.1 to 0.25 m at 6 m.
    assert 0.2 < high - low < 1.5
    assert low < 0.65 < high
    outcome = swash("control", "decouple", "coax", "--fit", fit)
    assert outcome.code == 2
    assert "--fit: is for the paths of a --step" in outcome.err


@pytest.mark.proof  # test_linear_monte_carlo.py flies many in short, tests/unit/control/draws many of the coax
def test_many_flights_are_summarised_and_the_worst_is_kept(held: Path, tmp_path: Path) -> None:
    worst = tmp_path / "worst.nc"
    command = ("control", "monte-carlo", "--vehicle", "coax", "--controller", held, "--out", worst, "--count", "20")
    outcome = swash(
        *command, "--maneuver", "doublet:pitch,1s,0.1", "--gusts", "indoor", "--settings", "sag=0.1", "--seed", "3"
    )
    assert outcome.code == 0, outcome.err
    assert "20 flights, 0 lost" in outcome.out
    largest = float(next(line for line in outcome.out.splitlines() if "place, largest" in line).split()[-3])
    flight = sp.read(worst)
    assert np.max(np.hypot(flight.values("x"), flight.values("y"))) == pytest.approx(largest, rel=1e-3)
    assert flight.values("voltage")[-1] == pytest.approx(12.22 - 0.8, abs=0.02)
    page = tmp_path / "many.html"
    strict = ("--limit", "lean=2deg", "--limit", "place=none", "--out", page, "--json")
    judged = swash(*command, "--maneuver", "doublet:pitch,1s,0.1", "--gusts", "indoor", "--seed", "3", *strict)
    assert judged.code == 0, judged.err
    found = json.loads(judged.out)
    assert found["lost"] == found["lost_by"]["lean"] == 20  # a doublet of a tenth leans further than 2 degrees
    assert found["limits"]["lean"] == {"value": pytest.approx(2.0), "unit": "deg"}
    assert found["limits"]["place"]["value"] is None
    assert found["worst"]["lean"] == pytest.approx(found["figures"]["lean, largest [deg]"][-1])
    assert "LOST: 20 of 20 flights lost" in page.read_text(encoding="utf-8")


def test_many_flights_that_cannot_be_are_refused(held: Path, tmp_path: Path) -> None:
    worst = tmp_path / "worst.nc"
    command = ("control", "monte-carlo", "--vehicle", "coax", "--controller", held, "--out", worst, "--count", "20")
    for text, said in (
        ("lean=0", "--limit: lean is 0, expected more than 0 deg"),
        ("drift=1m", "--limit: 'drift' is no limit; expected lean, rate, place, height, heading"),
        ("height=1deg", "--limit"),
    ):
        refused = swash(*command, "--maneuver", "doublet:pitch,1s,0.1", "--limit", text)
        assert refused.code == 2
        assert said in refused.err
    yaw = swash(*command, "--maneuver", "doublet:yaw,1s,0.1")
    assert yaw.code == 2
    assert "moves yaw; with many flights a maneuver is a pilot's roll or pitch" in yaw.err


def test_a_controller_is_checked_and_the_report_written(held: Path, tmp_path: Path) -> None:
    out = tmp_path / "check"
    outcome = swash("control", "check", "coax", "--controller", held, "--out", out)
    assert outcome.code == 0, outcome.err
    assert "all at once: gain +- 3.9 dB" in outcome.out
    assert "provisional" in outcome.out
    found = json.loads((out / "check.json").read_text())
    assert found["margins"]["together"]["disc"] == pytest.approx(0.45, abs=0.01)
    assert found["handling"]["phi"]["level"] == 2
    assert found["steps"]["psi"]["overshoot"] == pytest.approx(0.19, abs=0.03)
    own = [boundary["name"] for boundary in found["boundaries"] if boundary["checked"]]
    assert own == ["delay margin [ms]"]  # of the check itself; no standard's text was at hand
    page = whole(out / "report.html")
    assert "How well are disturbances rejected?" in page
    assert "Level 2" in page
    for options, level in ((("--scale", "1"), 1), (("--task", "tracking"), 3)):
        again = swash("control", "check", "coax", "--controller", held, *options, "--json")
        assert json.loads(again.out)["handling"]["phi"]["level"] == level


def test_a_loop_that_does_not_stand_ends_with_2_and_is_still_reported(tmp_path: Path) -> None:
    controller, out = tmp_path / "manual.toml", tmp_path / "check"
    assert swash("control", "decouple", "coax", "--out", controller, "--quiet").code == 0
    outcome = swash("control", "check", "coax", "--controller", controller, "--out", out, "--quiet")
    assert outcome.code == 2
    assert "growing mode at +0.247" in outcome.err
    assert "PROBLEM: No margins" in (out / "report.html").read_text()
    other = swash("control", "check", "raptor50", "--controller", controller)
    assert other.code == 2
    assert "is for 'coax', not for 'conventional'" in other.err


def test_the_papers_figure_as_a_report(tmp_path: Path) -> None:
    page = tmp_path / "path.html"
    outcome = swash(
        "control", "decouple", "coax", "--out", page, "--gusts", "indoor=0.05", "--json", "--settings", saying(draws=12)
    )
    assert outcome.code == 0, outcome.err
    found = json.loads(outcome.out)["step"]
    assert found["gusts"]["sigma"][0] == pytest.approx(0.05)
    assert found["with, 5 %"]["drift"] < found["with, 50 %"]["drift"] < found["with, 95 %"]["drift"]
    assert found["nearer_than"]["without"] == [12, 12]
    wins, of = found["nearer_than"]["by the paper"]
    assert wins > 0.5 * of + np.sqrt(of)  # beyond chance
    assert found["with"]["speed"] == pytest.approx(1.8, abs=0.01)
    assert found["without"]["rightmost"] > 0.6
    assert found["without"]["drift"] < -0.6
    text = page.read_text()
    assert "SIMULATED FLIGHT" in text
    assert "each in gusts of its own (0.05 m/s)" in text
    assert f"{found['with']['drift']:+.2f} m with it" in text
    assert abs(found["with"]["drift"]) < 0.05 < 0.4 < found["by the paper"]["drift"]


@pytest.mark.proof
def test_aircraft_that_differ_by_more_than_a_fit_says(held: Path, tmp_path: Path) -> None:
    worst = tmp_path / "worst.nc"
    command = ("control", "monte-carlo", "--vehicle", "coax", "--controller", held, "--out", worst)
    many = (*command, "--maneuver", "doublet:pitch,1s,0.1", "--count", "20")
    scatter = ("--battery", "12.5-10.5", "--vary", "linkage_lower=10%", "--payload", "0.02", "--delay", "0.015")
    outcome = swash(*many, *scatter)
    assert outcome.code == 0, outcome.err
    flight = sp.read(worst)
    assert flight.values("voltage")[0] == pytest.approx(12.5, abs=0.01)
    assert flight.values("voltage")[-1] == pytest.approx(10.5, abs=0.02)
    drawn = next(step for step in flight.history if step.operation == "drawn").details
    assert set(drawn["parameters"]) == {"linkage_lower", "mass"}
    assert 0.0 < drawn["delay"] <= 0.015
    for options, said in (
        (("--vary", "weight=5%"), "weight: is not a number of the card"),
        (("--settings", "tolerances=true"), "no number of the card has a sigma"),
        (("--battery", "10.5-12.5"), "does not fall"),
        (("--battery", "12.5-10.5", "--settings", "sag=0.1"), "says what voltage and sag say"),
    ):
        refused = swash(*many, *options)
        assert refused.code == 2
        assert said in refused.err


def test_any_linear_model_is_decoupled_with_its_ratios_against_frequency(tmp_path: Path) -> None:
    out = tmp_path / "raptor.json"
    outcome = swash("control", "decouple", "raptor50", "--out", out, "--settings", saying(at="1,3"))
    assert outcome.code == 0, outcome.err
    found = json.loads(out.read_text())
    assert found["axes"] == {"inputs": ["A1", "B1"], "outputs": ["p", "q"]}
    ratios = found["off_over_on_axis"]
    assert set(ratios) >= {"bare", "matrix"}
    for axis, bare in ratios["bare"].items():
        assert ratios["matrix"][axis][1] < bare[1]  # at 3 rad/s, where the matrix was made
    rigid = ("x", "y", "z", "psi", "u", "v", "w", "phi", "theta", "p", "q", "r")
    refused = swash("control", "decouple", "raptor50", "--json", "--settings", saying(keep=str(",".join(rigid))))
    assert refused.code == 2
    assert "No filter" in refused.err
    assert "matrix" in json.loads(refused.out)["off_over_on_axis"]
