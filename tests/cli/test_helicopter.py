"""Verbs for single-rotor helicopters: trim, linearize, derivatives, simulate, vehicles new; and what they refuse."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from commands import one_message, saying, swash

from report_pages import whole
from swashplate.flights.flight import Flight
from swashplate.models.card import read_card
from swashplate.models.catalogue import vehicle
from swashplate.models.conventional.helicopter_parameters import ADDED, MEANING
from swashplate.models.conventional.new_card import new_card as new_card_of

ROOT = Path(__file__).resolve().parents[2]


def test_trim_at_one_speed_and_over_a_range(tmp_path: Path) -> None:
    words = [line.split() for line in swash("vehicle", "trim", "raptor50", "--speed", "5").out.splitlines()]
    (collective,) = (row for row in words if row[0] == "theta0")
    assert float(collective[3]) == pytest.approx(np.degrees(float(collective[1])), abs=1e-3)
    assert collective[2] == "rad"
    page = tmp_path / "curves.html"
    document = json.loads(swash("vehicle", "trim", "raptor50", "--speed", "0-12/4", "--json", "--out", page).out)
    assert [entry["speed"] for entry in document["trims"]] == [0.0, 4.0, 8.0, 12.0]
    assert max(entry["residual"] for entry in document["trims"]) < 1e-10
    assert (document["units"]["theta0"], document["units"]["u"]) == ("rad", "m/s")
    power = [entry["power"] for entry in document["trims"]]
    assert power[0] > power[1] > power[2] < power[3]  # least between hover and fast flight
    text = whole(page)
    assert "root-locus" in text
    assert "trim-curves" in text
    assert "power [W]" in text
    table = swash("vehicle", "trim", "raptor50", "--speed", "0-8/8").out.splitlines()
    assert len(table) == 3
    assert "B1 [deg]" in table[0]


@pytest.mark.parametrize("verb", ["trim", "linearize", "derivatives"])
def test_every_verb_says_where_it_is_not_to_be_believed(verb: str) -> None:
    outcome = swash("vehicle", verb, "raptor50", "--settings", "climb=-4")
    assert outcome.code == 0
    assert "vortex ring" in outcome.err


def test_weight_altitude_wind_numbers_and_options_change_the_trim() -> None:
    def collective(*extra: str) -> float:
        document = json.loads(swash("vehicle", "trim", "raptor50", "--json", *extra).out)
        return float(document["trims"][0]["inputs"]["theta0"])

    plain = collective()
    assert collective("--set", "mass=5.5") > plain
    assert collective("--settings", "altitude=2500") > plain
    assert collective("--settings", "wind=-6,0,0") < plain
    assert collective("--set", "rotor_chord=0.06") < plain
    assert collective("--set", "inflow=pitt-peters") == pytest.approx(plain, rel=1e-3)


def test_linearize_tells_modes_and_matrices() -> None:
    assert "+0.772 +/- 0.979j" in swash("vehicle", "linearize", "raptor50").out
    document = json.loads(swash("vehicle", "linearize", "raptor50", "--json").out)
    model = document["models"][0]
    assert np.array(model["A"]).shape == (14, 14)
    assert model["inputs"] == ["theta0", "B1", "A1", "theta0T"]


@pytest.mark.parametrize(
    ("form", "states"),
    [
        ("paper", ["u", "w", "q", "theta", "v", "p", "phi", "r"]),
        ("lateral", ["v", "p", "phi", "r"]),
        ("flapping", ["u", "v", "w", "p", "q", "r", "phi", "theta", "a1", "b1"]),
        ("bar-and-gyro", ["u", "v", "p", "q", "phi", "theta", "a1", "b1", "w", "r", "r_gyro", "c", "d"]),
    ],
)
def test_linear_models_in_the_papers_and_in_hybrid_forms(form: str, states: list[str]) -> None:
    """Forms with fewer states keep heave, which hardly meets anything else."""
    switches = ("--set", "bar=true", "--set", "gyro=true")
    document = json.loads(swash("vehicle", "linearize", "raptor50", *switches, "--form", form, "--json").out)
    model = document["models"][0]
    assert model["states"] == states
    assert np.array(model["A"]).shape == (len(states), len(states))
    assert np.array(model["B"]).shape == (len(states), len(model["inputs"]))
    if form != "lateral":
        assert min(abs(mode["real"] + 0.985) for mode in model["modes"]) < 0.02


def test_what_leaving_out_each_derivative_changes() -> None:
    document = json.loads(swash("vehicle", "derivatives", "raptor50", "--left-out", "--json").out)
    study = {entry["derivative"]: entry for entry in document["studies"][0]["left_out"]}
    assert len(study) == 60
    assert max(study["Xr"]["modes"], study["Xr"]["response"]) < 1e-3  # the paper leaves it out
    assert study["Mq"]["modes"] > 0.1
    assert "Xtheta0T" in swash("vehicle", "derivatives", "raptor50", "--left-out").out


def test_derivatives_by_contributor_in_both_units(tmp_path: Path) -> None:
    metric = json.loads(swash("vehicle", "derivatives", "raptor50", "--json").out)["tables"][0]["derivatives"]
    feet = json.loads(swash("vehicle", "derivatives", "raptor50", "--json", "--settings", saying(imperial=True)).out)[
        "tables"
    ][0]["derivatives"]
    assert metric["Mu"]["value"] * 0.3048 == pytest.approx(feet["Mu"]["value"])
    assert feet["Mu"]["unit"] == "1/(ft s)"
    assert sum(metric["Yv"]["by"].values()) == pytest.approx(metric["Yv"]["value"])
    page = tmp_path / "derivatives.html"
    swash("vehicle", "derivatives", "raptor50", "--speed", "0-8/4", "--out", page)
    text = whole(page)
    assert "Which part of the helicopter makes which derivative?" in text
    assert all(f"<b>{name} [" in text for name in metric)


def test_primed_rows_mix_roll_and_yaw_by_the_product_of_inertia() -> None:
    plain, mixed = (
        json.loads(swash("vehicle", "derivatives", "lynx", "--json", *extra).out)["tables"][0]["derivatives"]
        for extra in ((), ("--primed",))
    )
    assert mixed["Mq"] == plain["Mq"]
    card = vehicle("lynx").card.values()
    whole = 1.0 - card["inertia_xz"] ** 2 / (card["inertia_xx"] * card["inertia_zz"])
    expected = (plain["Lp"]["value"] + card["inertia_xz"] / card["inertia_xx"] * plain["Np"]["value"]) / whole
    assert mixed["Lp"]["value"] == pytest.approx(expected)


def test_uncertainty_bounds_hold_the_cards_value_and_repeat() -> None:
    arguments = ("vehicle", "derivatives", "raptor50", "--uncertainty", "--settings", "draws=10", "--json")
    first, second = swash(*arguments), swash(*arguments)
    assert first.out == second.out
    document = json.loads(first.out)["tables"][0]
    found = document["derivatives"]
    assert (document["draws"], document["refused"]) == (10, 0)
    assert [mode["real"]["value"] for mode in document["modes"]] == pytest.approx(
        [
            m["real"]
            for m in json.loads(swash("vehicle", "linearize", "raptor50", "--json").out)["models"][0]["modes"]
            if m["real"]
        ]
    )
    assert all(mode["real"]["5 %"] < mode["real"]["value"] < mode["real"]["95 %"] for mode in document["modes"][:3])
    for name in ("Lp", "Mq", "Zw", "Xu"):
        assert found[name]["5 %"] < found[name]["value"] < found[name]["95 %"]
    assert "5 % and 95 % bounds: of 10 samples" in swash(*arguments[:-1]).out


def test_a_sweep_in_hover_is_flown_and_saved(tmp_path: Path) -> None:
    out = tmp_path / "sweep.nc"
    outcome = swash("simulate", "--vehicle", "raptor50", "--maneuver", "doublet:pitch,0.5s,0.03", "--out", out)
    assert outcome.code == 0, outcome.err
    assert "Careful" not in outcome.err
    flight = Flight.load(out)
    assert np.ptp(flight.values("B1")) > 0.05
    assert np.ptp(flight.values("q")) > np.ptp(flight.values("p"))


def test_a_simulation_in_numbers_and_as_a_page(tmp_path: Path) -> None:
    """Of the truth, whatever the sensors make of it."""
    asked = ("simulate", "--vehicle", "raptor50", "--maneuver", "doublet:pitch,0.5s,0.03", "--speed", "5")
    page = tmp_path / "flight.html"
    outcome = swash(*asked, "--sensors", "clean", "--out", tmp_path / "a.nc", "--json", "--out", page)
    assert outcome.code == 0, outcome.err
    document = json.loads(outcome.out)
    assert document["written"] == [str(tmp_path / "a.nc"), str(page)]
    assert document["remarks"] == []
    assert document["channels"]["q"]["unit"] == "rad/s"
    assert document["channels"]["x"]["end"] == pytest.approx(5.0 * document["duration"], rel=0.1)
    assert document["channels"]["u"]["start"] == pytest.approx(5.0, rel=0.01)
    text = whole(page)
    assert all(word in text for word in ("flight-commands", "flight-inner", "theta0T [deg]", "q [deg/s]", "w [m/s]"))


def test_a_simulation_says_when_it_leaves_what_its_equations_hold_for(tmp_path: Path) -> None:
    """A rotor at little more than half its speed would stall in hover."""
    card = tmp_path / "slow.toml"
    vehicle("raptor50").with_values({"rotor_speed": 90.0, "collective_high": 0.4, "tail_high": 0.8}).save(card)
    outcome = swash("simulate", "--vehicle", card, "--maneuver", "doublet:pitch,0.5s,0.01", "--out", tmp_path / "x.nc")
    assert outcome.code == 0
    assert outcome.err.startswith("Careful: At 0.0 s C_T / sigma is 0.")


def test_a_new_card_is_commented_and_flies(tmp_path: Path) -> None:
    mine = tmp_path / "mine.toml"
    outcome = swash("vehicle", "new", mine, "--mass", "8", "--radius", "0.78", "--title", "Mine", "--rotation", "ccw")
    assert outcome.code == 0, outcome.err
    text, card = mine.read_text(encoding="utf-8"), read_card(mine)
    assert all(f"# {meaning}" in text for meaning in MEANING.values())
    assert card.values()["mass"] == 8.0
    assert card.parameters["rotor_chord"].status == "assumed"
    assert swash("vehicle", "trim", mine, "--speed", "5").code == 0
    assert "exists already" in one_message(swash("vehicle", "new", mine, "--mass", "8", "--radius", "0.78"))


def test_a_new_cards_class_is_said_and_can_be_chosen(tmp_path: Path) -> None:
    sized = ("--mass", "8", "--radius", "0.78")
    outcome = swash("vehicle", "new", tmp_path / "a.toml", *sized)
    assert "Numbers of class 90 (the largest model helicopters" in outcome.out
    assert "because of its mass of 8 kg and rotor radius of 0.78 m" in outcome.out
    assert not outcome.err
    outcome = swash("vehicle", "new", tmp_path / "b.toml", *sized, "--settings", saying(size_class="600"))
    assert "Numbers of class 600, as asked." in outcome.out
    assert outcome.err.startswith("Careful: mass and radius ask for class 90")
    areas = [read_card(tmp_path / name).values()["fuselage_area_x"] for name in ("a.toml", "b.toml")]
    assert areas[0] != areas[1]
    assert "not both" in one_message(
        swash("vehicle", "new", tmp_path / "c.toml", *sized, "--like", "lynx", "--settings", saying(size_class="600"))
    )


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("vehicle", "trim", "raptor50", "--speed", "50"), "but its limit is"),
        (("vehicle", "trim", "raptor50", "--speed", "9-3"), "no ascending range"),
        (("vehicle", "trim", "raptor50", "--speed", "fast"), "is not a number"),
        (("vehicle", "trim", "raptor50", "--settings", saying(altitude=20000)), "expected -500 to 11000"),
        (("vehicle", "trim", "raptor50", "--set", "rotor_cord=0.05"), "has no parameter rotor_cord"),
        (("vehicle", "trim", "raptor50", "--set", "inertia_xx=0.9"), "more than the two others together"),
        (("vehicle", "trim", "raptor50", "--set", "rotor_chord=55"), "lies outside"),
        (("vehicle", "trim", "raptor50", "--set", "flybar=true"), "is not an option"),
        (("vehicle", "trim", "raptor51"), "neither a vehicle's name nor a file"),
        (("vehicle", "derivatives", "coax"), "needs a single-rotor card"),
        (("vehicle", "derivatives", "raptor50", "--uncertainty", "--speed", "0-5"), "takes one speed"),
        (("vehicle", "derivatives", "raptor50", "--uncertainty", "--primed"), "has no bounds"),
        (("vehicle", "derivatives", "raptor50", "--left-out", "--primed"), "goes with --json and the conditions only"),
        (("vehicle", "derivatives", "coax", "--left-out"), "needs a single-rotor card"),
        (("vehicle", "linearize", "raptor50", "--form", "short"), "expected one of full, paper"),
        (("vehicle", "linearize", "coax", "--form", "paper"), "is for single-rotor helicopters"),
        (("vehicle", "linearize", "raptor50", "--form", "bar-and-gyro"), "r_gyro: is not a state of this model"),
        (("vehicle", "linearize", "raptor50", "--form", "paper", "--out", "x.html"), "is of the full model"),
        (("vehicle", "trim", "raptor50", "--climb=-30"), "Ask for a slower flight."),
        (("vehicle", "trim", "raptor50", "--set", "engine_lag=true"), "needs a rotor speed that the engine can change"),
        (("vehicle", "trim", "raptor50", "--set", "rotor_chord=0"), "lies outside"),
        (("vehicle", "trim", "raptor50", "--set", "inertia_xx=-0.1"), "lies outside"),
        (("vehicle", "trim", "raptor50", "--settings", saying(wind="3,4")), "is not 3 numbers"),
        (("vehicle", "trim", "raptor50", "--set", "mass=nan"), "is not a number"),
        (("vehicle", "trim", "raptor50", "--set", "mass=60"), "lies outside"),
        (
            ("vehicle", "trim", "raptor50", "--settings", saying(turn=20, wind="3,0,0")),
            "a turn in wind is no steady flight",
        ),
        (("vehicle", "trim", "raptor50", "--speed", "3", "--out", "x.html"), "needs a range of speeds"),
        (("vehicle", "new", "x.toml", "--mass=-1", "--radius", "1"), "expected both finite and above 0"),
    ],
)
def test_what_is_refused(arguments: tuple[str, ...], said: str) -> None:
    assert said in one_message(swash(*arguments))


@pytest.fixture(scope="module")
def new_card(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The text of a fresh card."""
    path = tmp_path_factory.mktemp("cards") / "new.toml"
    assert swash("vehicle", "new", path, "--mass", "5", "--radius", "0.7").code == 0
    return path.read_text(encoding="utf-8")


def _changed(text: str, name: str, **entries: object) -> str:
    """A card's text with other entries of one parameter, and without what bounds it."""
    before, found, after = text.partition(f"[parameters.{name}]\n")
    assert found
    body, _, rest = after.partition("\n\n")
    lines = [line for line in body.splitlines() if line.split(" = ")[0] not in {"lower", "upper", *entries}]
    lines += [f"{key} = {value}" for key, value in entries.items() if value is not None]
    return before + found + "\n".join(lines) + "\n\n" + rest


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("mass", -5, "is -5, expected more than 0"),
        ("mass", "nan", "is nan, expected a finite number"),
        ("mass", '"heavy"', "value is 'heavy', expected a number"),
        ("mass", "true", "value is True, expected a number"),
        ("inertia_yy", -0.1, "is -0.1, expected more than 0"),
        ("inertia_zz", 5, "is 5, more than the two others together"),
        ("inertia_xz", 0.14, "with it the principal moments differ by"),
        ("rotor_chord", 0, "is 0, expected more than 0"),
        ("rotor_chord", 55, "longer than its rotor's radius"),
        ("tail_chord", 0.5, "longer than its rotor's radius"),
        ("rotor_blades", 2.5, "expected a whole number of at least 2"),
        ("tail_blades", 1, "expected a whole number of at least 2"),
        ("rotor_speed", 0, "expected more than 0"),
        ("blade_inertia", 0, "expected more than 0"),
        ("hub_stiffness", -3, "is -3, expected 0 or more"),
        ("hub_height", -0.2, "expected more than 0"),
        ("hinge_offset", 0.7, "expected 0 to 0.5 of the radius"),
        ("wake_distortion", -5, "expected 0 or more"),
        ("fin_blockage", 10, "leaves nothing of the tail rotor"),
        ("rotor_twist", -8, "is -8 rad, more than 57 deg"),
        ("phase_lag", 30, "is 30 rad, more than 57 deg"),
        ("collective_low", 0.5, "not below collective_high"),
        ("bar_inner", 2, "not below bar_outer"),
        ("servo_time", 0, "expected more than 0"),
        ("skid_depth", -0.1, "expected more than 0"),
        ("gyro_gain", -1, "expected 0 or more"),
    ],
)
def test_a_card_with_a_number_that_no_helicopter_has(
    new_card: str, name: str, value: object, said: str, tmp_path: Path
) -> None:
    """Also where the card itself allows it: the file, the parameter and what physics asks for are named."""
    card = tmp_path / "mine.toml"
    card.write_text(_changed(new_card, name, value=value), encoding="utf-8")
    message = one_message(swash("vehicle", "trim", card))
    assert message.startswith((f"Error: {card}: {name}: ", f"Error: {card}: parameters.{name}.value: "))
    assert said in message


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t: _changed(t, "mass", unit='"lb"'), "mass: unit is 'lb', expected 'kg'"),
        (lambda t: _changed(t, "rotor_speed", unit='"rpm"'), "rotor_speed: unit is 'rpm', expected 'rad/s'"),
        (lambda t: _changed(t, "rotor_twist", unit='"deg"'), "rotor_twist: unit is 'deg', expected 'rad'"),
        (lambda t: _changed(t, "mass", source=None), "mass: lacks source"),
        (lambda t: _changed(t, "mass", status='"guessed"'), "mass: status is 'guessed', expected one of"),
        (lambda t: _changed(t, "mass", weight=3), "mass: has unknown weight"),
        (lambda t: t.replace("[parameters.mass]", "[parameters.weight]"), '[parameters.mass] with value, unit = "kg"'),
        (lambda t: t + '\n[parameters.wings]\nvalue = 2\nunit = "1"\nsource = "x"\nstatus = "assumed"\n',
         "wings: is not a parameter of 'conventional'. Is it misspelt?"),
        (lambda t: t.replace('vehicle = "conventional"', 'vehicle = "gyrocopter"'), "expected one of coax"),
        (lambda t: t.replace('rotation = "cw"', 'rotation = "left"'), "rotation: is 'left', expected one of"),
        (lambda t: t.replace("[options]", "[options]\nflybar = true"), "flybar: is not an option"),
        (lambda t: t.replace('kind = "vehicle"', 'kind = "boat"'), "kind is 'boat', expected 'vehicle'"),
        (lambda t: t.replace("schema = 1", "schema = 9"), "schema is 9, expected a whole number up to 1"),
        (lambda t: t[: t.index("conventional") + 4], "is not TOML"),
        (lambda t: "", "says no kind. A card begins with the line kind = 'vehicle'"),
    ],
)  # fmt: skip
def test_a_card_that_is_written_wrongly(new_card: str, change: Callable[[str], str], said: str, tmp_path: Path) -> None:
    card = tmp_path / "mine.toml"
    text = change(new_card)
    assert text != new_card
    card.write_text(text, encoding="utf-8")
    message = one_message(swash("vehicle", "derivatives", card))
    assert str(card) in message
    assert said in message


def test_a_card_like_the_lynx_cones_feels_the_yaw_and_takes_a_fuselage() -> None:
    """What the Lynx's table leaves out is on in a card like it, whose bounds leave room for a real number."""
    card = new_card_of("A report's", mass=2200.0, radius=4.9, rotation="cw", like="lynx")
    felt = {"yaw_at_blades": True, "precession_torque": True}
    assert dict(card.options) == {"rotation": "cw", "coning": True, **felt}
    assert (card.values()["tailplane_wake"], card.values()["fuselage_wake"]) == (1.5, 1.0)
    for name, real in (("fuselage_area_x", 1.2), ("fuselage_area_z", 8.0), ("bar_gain", 0.8)):
        entry = card.parameters[name]
        assert entry.lower is not None
        assert entry.upper is not None
        assert entry.lower <= real <= entry.upper


def test_a_card_of_an_earlier_version_flies_and_says_what_it_lacks_where_that_counts(
    new_card: str, tmp_path: Path
) -> None:
    """Servo delay and engine lag came later: without their options nothing of them is needed."""
    card, text = tmp_path / "old.toml", new_card + "\n"
    for name in ADDED:
        start = text.index(f"# {MEANING[name]}")
        text = text[:start] + text[text.index("\n\n", start) + 2 :]
        assert name not in text
    card.write_text(text, encoding="utf-8")
    assert swash("vehicle", "trim", card).code == 0
    assert vehicle(card).card.parameters["servo_delay"].status == "assumed"
    message = one_message(swash("vehicle", "trim", card, "--set", "delay=true"))
    assert "servo_delay: is missing, and option 'delay' needs it" in message
    assert 'Add [parameters.servo_delay] with value, unit = "s"' in message
    lag = one_message(swash("vehicle", "trim", card, "--set", "rotor_speed=governed", "--set", "engine_lag=true"))
    assert "engine_time: is missing, and option 'engine_lag' needs it" in lag


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--mass", "nan", "--radius", "1"), "--mass: 'nan' is not a number"),
        (("--mass", "inf", "--radius", "1"), "--mass: 'inf' is not a number"),
        (("--mass", "5", "--radius", "0"), "radius 0 m, expected both finite and above 0"),
        (("--mass", "5", "--radius", "0.7", "--like", "coax"), "coax: is no packaged single-rotor helicopter"),
        (("--mass", "5", "--radius", "0.7", "--like", "zeppelin"), "zeppelin: is no packaged single-rotor helicopter"),
    ],
)
def test_a_new_card_that_cannot_be_is_not_written(arguments: tuple[str, ...], said: str, tmp_path: Path) -> None:
    assert said in one_message(swash("vehicle", "new", tmp_path / "n.toml", *arguments))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--maneuver", "nonsense"), "does not begin with one of sweep"),
        (("--maneuver", "doublet:barrel,0.5s,0.02"), "barrel"),
        (("--maneuver", "doublet:roll,-5s,0.02"), "is no band, time or amplitude"),
        (("--maneuver", "sweep:roll,0.3-4Hz,5s,0.02"), "expected at least 4"),
        (("--maneuver", "doublet:roll,0.5s,0.02", "--speed", "50"), "but its limit is"),
        (("--maneuver", "doublet:roll,0.5s,0.02", "--speed", "nan"), "--speed: 'nan' is not a number"),
        (("--maneuver", "doublet:roll,0.5s,0.02", "--wind", "nan,0,0"), "is not 3 numbers"),
        (("--maneuver", "doublet:roll,0.5s,0.02", "--rate", "1"), "expected a multiple of the controller's 50 Hz"),
        (("--maneuver", "doublet:roll,0.5s,0.02", "--set", "flybar=true"), "is not an option"),
        (("--maneuver", "doublet:roll,0.5s,0.02", "--pilot"), "is for a --controller"),
        (
            ("--maneuver", "doublet:roll,0.5s,0.02", "--out", "flight.pdf"),
            "ends in '.pdf', expected one of .nc, .html, .csv",
        ),
    ],
)
def test_a_simulation_that_cannot_be_leaves_no_file(arguments: tuple[str, ...], said: str, tmp_path: Path) -> None:
    out = tmp_path / "flight.nc"
    assert said in one_message(swash("simulate", "--vehicle", "raptor50", "--out", out, *arguments))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("arguments", [("--out",), ("--speed", "0-5", "--out")])
def test_a_page_of_a_trim_that_is_refused_is_not_written(arguments: tuple[str, ...], tmp_path: Path) -> None:
    assert swash("vehicle", "trim", "raptor50", *arguments, tmp_path / "x.html", "--set", "rotor_chord=55").code == 2
    assert not list(tmp_path.iterdir())


def test_a_card_beside_published_matrices() -> None:
    """Padfield's Lynx: what its table leaves out is found, in the card's own words, and the table comes nearer."""
    report = ROOT / "tests" / "oracle" / "lynx" / "padfield_00kn.csv"
    found = json.loads(swash("vehicle", "derivatives", "lynx", "--primed", "--published", report, "--json").out)
    assert [step["with"] for step in found["steps"]] == ["", "--set rotor_drag_thrust=0"]
    assert found["steps"][1]["within 10 %"] >= 52
    assert found["steps"][1]["mean"] < found["steps"][0]["mean"] < 0.07
    assert found["derivatives"]["Ntheta0"]["off"] == pytest.approx([0.045, 0.0], abs=0.006)
    assert found["derivatives"]["Zr"]["small"]
    shown = swash("vehicle", "derivatives", "lynx", "--published", report).out
    assert "--primed" in shown
    assert "--set rotor_drag_thrust=0" in shown
    assert "small" in shown
    for bad in (("--settings", "imperial=true"), ("--speed", "0-8/4")):
        assert "--published" in one_message(swash("vehicle", "derivatives", "lynx", "--published", report, *bad))


def test_a_descent_that_the_air_drives_is_told() -> None:
    climbing = swash("vehicle", "trim", "raptor50", "--climb", "-12")
    assert "the air drives the rotors with" in climbing.err
