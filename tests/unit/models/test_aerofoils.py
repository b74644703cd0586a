"""Aerofoil tables on single-rotor cards: the file and its refusals, flight with them, and what is said of a flight."""

from __future__ import annotations

import math
import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.engine.equations import equations_of, parameter_row
from swashplate.engine.slopes import rates_and_slopes
from swashplate.errors import CardError, ExportError, SwashError, TrimError
from swashplate.models.catalogue import from_card, vehicle
from swashplate.models.conventional.aerofoil_file import packaged_aerofoils, parse_aerofoil
from swashplate.models.conventional.buildup import build_up
from swashplate.models.conventional.helicopter_limits import doubts_by_kind
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import CasadiBackend
from swashplate.physics.environment import Environment
from swashplate.physics.tabled_blades import section
from swashplate.simulation.trim import Trim

HEAD = "mach,reynolds,alpha_deg,cl,cd"


def rows(mach: float = 0.0, reynolds: float = 1e5, slope: float = 0.1, last: int = 16) -> list[str]:
    return [f"{mach},{reynolds},{a},{slope * a},{0.01 + 1e-4 * a * a}" for a in range(-last, last + 1, 2)]


def straight_file(folder: Path, drag: float = 0.015, slope: float = 5.5) -> Path:
    """The Raptor's own straight line as a table."""
    lines = [f"0,1e5,{a},{slope * math.radians(a)},{drag}" for a in range(-30, 31)]
    path = folder / "straight.csv"
    path.write_text("\n".join(["# source: the card's lift slope and drag", HEAD, *lines]), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def tabled() -> Vehicle:
    return vehicle("raptor50", aerofoil="naca0012")


def test_a_table_goes_through_its_points_and_between_them() -> None:
    text = "\n".join([HEAD, *rows(), *rows(0.5, slope=0.12), *rows(0.0, 1e7, slope=0.11), *rows(0.5, 1e7, slope=0.13)])
    table = parse_aerofoil(text, "two.csv")
    angle, mach = np.radians([4.0, 4.0, 4.0, 4.0, 60.0, -130.0]), np.array([0.0, 0.5, 0.25, 0.9, 0.0, 0.0])
    at = section(table, angle, mach, np.array([1e5, 1e7, 1e6, 1e3, 1e5, 1e5]), np)
    np.testing.assert_allclose(at.lift[:4], [0.4, 0.52, 4.0 * 0.115, 0.48], rtol=1e-6)
    np.testing.assert_allclose(at.drag[:2], 0.0116, rtol=1e-6)
    plate = np.sin(2.0 * angle[4:]), 0.01 + 2.0 * np.sin(angle[4:]) ** 2
    np.testing.assert_allclose((at.lift[4:], at.drag[4:]), plate, atol=5e-3)
    step = 1e-6
    up, down = (section(table, angle + side * step, mach, at.lift * 0.0 + 2e5, np) for side in (1.0, -1.0))
    here = section(table, angle, mach, at.lift * 0.0 + 2e5, np)
    np.testing.assert_allclose((up.lift - down.lift) / (2 * step), here.lift_slope, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose((up.drag - down.drag) / (2 * step), here.drag_slope, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty, expected a line mach,reynolds,alpha_deg"),
        ("mach,reynolds,alpha,cl,cd\n", r"line 1: lacks alpha_deg and has alpha; expected are mach, .*degrees"),
        (f"{HEAD},cl\n", "names a column twice"),
        (f"{HEAD}\n", "has column names and no numbers"),
        (f"{HEAD}\n0,1e5,0,0\n", r"line 2: has 4 entries, expected 5"),
        (f"{HEAD}\n0,1e5,0,nan,0.01\n", r"line 2, cl: is 'nan', expected a number from -5 to 5"),
        (f"{HEAD}\n0,1e5,0,0,1e300\n", r"line 2, cd: is '1e300', expected a number from 0 to 5"),
        (f"{HEAD}\n0,1e5,0,0,-0.01\n", r"line 2, cd: is '-0.01'"),
        (f"{HEAD}\n0,ten,0,0,0.01\n", r"line 2, reynolds: is 'ten', expected a number from 100 to 1e\+09"),
        ("\n".join([HEAD, *rows(), *rows()]), r"line 19, alpha_deg: is -16 after 16 at Mach 0 .*expected to rise"),
        ("\n".join([HEAD, *rows(), *rows(0.5, 1e6)]), "has no block at Mach 0 and Reynolds number 1e.06"),
        ("\n".join([HEAD, *rows(last=4)]), r"has 5 angles from -4 to 4 deg; expected at least 5, from -5 or less"),
        (
            "\n".join([HEAD, *(line for k in range(25) for line in rows(k / 30))]),
            "mach: has 25 values, expected at most",
        ),
    ],
)
def test_what_is_no_table_is_refused(text: str, words: str) -> None:
    with pytest.raises(CardError, match=words) as said:
        parse_aerofoil(text, "mine.csv")
    assert str(said.value).startswith("mine.csv")


def test_a_card_points_to_its_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By a name, or by a path from the card; a model that is saved elsewhere still finds it."""
    straight_file(tmp_path)
    card = replace(vehicle("raptor50").card, options={"rotation": "cw", "aerofoil": "straight.csv"})
    (tmp_path / "mine.toml").write_text(card.to_toml(), encoding="utf-8")
    monkeypatch.chdir("/")
    flown = vehicle(tmp_path / "mine.toml")
    assert flown.options.aerofoil.source == "the card's lift slope and drag"
    (tmp_path / "elsewhere").mkdir()
    flown.save(tmp_path / "elsewhere" / "model.toml")
    assert vehicle(tmp_path / "elsewhere" / "model.toml").options == flown.options
    with pytest.raises(CardError, match=r"aerofoil: is 'naca0013', neither a packaged table \(naca0012\).*'naca0012'"):
        vehicle("raptor50", aerofoil="naca0013")
    with pytest.raises(CardError, match="aerofoil: is True, expected a table's name or file"):
        vehicle("raptor50", aerofoil=True)
    (tmp_path / "picture.csv").write_bytes(b"\x89PNG\xff")
    with pytest.raises(CardError, match="cannot be read as text"):
        vehicle("raptor50", aerofoil=str(tmp_path / "picture.csv"))
    for options in ({"inflow": "pitt-peters-static"}, {"in_plane": "thrust-tilt"}):
        with pytest.raises(CardError, match="written for a straight lift line"):
            vehicle("raptor50", aerofoil="naca0012", **options)


def test_the_packaged_table_is_what_its_script_writes() -> None:
    script = Path(__file__).parents[3] / "scripts" / "aerofoil_table.py"
    made = runpy.run_path(str(script))
    assert packaged_aerofoils() == ("naca0012",)
    assert made["TARGET"].read_text(encoding="utf-8") == made["table_text"]()


def test_none_is_the_card_without_the_option() -> None:
    x, u = 0.1 * np.random.default_rng(0).normal(size=14), np.array([0.1, 0.01, 0.02, 0.15])
    plain, none = vehicle("raptor50"), vehicle("raptor50", aerofoil="none")
    assert plain.rates(x, u, plain.values()) == none.rates(x, u, none.values())


ALSO = [{}, {"coning": True, "tip_loss": True}, {"inflow": "pitt-peters"}]
MOVING = np.array([0, 0, -10, 3.0, 0.5, 0.4, 0.02, -0.03, 0, 0.3, 0.2, 0.1, 0.01, 0.02])
STICKS = (0.1, 0.01, 0.02, 0.15)


@pytest.mark.parametrize("options", ALSO)
def test_the_cards_own_straight_line_moves_as_the_card(options: dict[str, object], tmp_path: Path) -> None:
    """Slow flight with small angles, disc turning: what is left is their square, and drag across the disc."""
    flown = [vehicle("raptor50", **options), vehicle("raptor50", aerofoil=str(straight_file(tmp_path)), **options)]
    x = [*MOVING, *([0.045, 0.01, 0.0] if "inflow" in options else [])]
    rates = [dict(zip(one.state_names, one.rates(x, STICKS, one.values()), strict=True)) for one in flown]
    for name in ("w", "a1", "b1"):
        assert rates[1][name] == pytest.approx(rates[0][name], rel=0.02, abs=0.02), name
    for name in ("lam0", "lam_c", "lam_s") if "inflow" in options else ():
        assert rates[1][name] == pytest.approx(rates[0][name], rel=0.05, abs=0.05), name


@pytest.mark.proof
@pytest.mark.parametrize("options", ALSO)
def test_the_cards_own_straight_line_trims_as_the_card(options: dict[str, object], tmp_path: Path) -> None:
    flown = [vehicle("raptor50", **options), vehicle("raptor50", aerofoil=str(straight_file(tmp_path)), **options)]
    plain, table = (sp.trim(one, speed=4.0) for one in flown)
    for name, value in plain.commands().items():
        assert table.commands()[name] == pytest.approx(value, rel=0.03, abs=7e-4)


@pytest.mark.parametrize("inflow", ["glauert", "pitt-peters"])
def test_slopes_are_right(inflow: str) -> None:
    flown = vehicle("raptor50", aerofoil="naca0012", inflow=inflow, coning=True, tip_loss=True)
    x = np.array([0, 0, -10, 12.0, 1, 0.5, 0.05, -0.1, 0, 0.2, 0.1, 0.1, 0.03, 0.01, 0.02, 0.01, 0.0])
    x = x[: len(flown.state_names)]
    u = (0.12, 0.03, 0.02, 0.1)

    around, step = Environment(), 1e-5
    w = np.array([*u, 0.0, 0.0, 0.0, 12.0])
    values, slopes, _ = rates_and_slopes(equations_of(flown), x, w, parameter_row(flown, around))
    np.testing.assert_allclose(values, flown.rates(list(x), u, flown.values()), rtol=1e-9, atol=1e-10)
    for k in (3, 5, 9, 10, 12, 13, *range(14, len(x))):
        moved = [list(x + side * step * np.eye(len(x))[k]) for side in (1.0, -1.0)]
        ahead, behind = (np.array(flown.rates(row, u, flown.values())) for row in moved)
        scale = 1e-4 * np.max(np.abs(slopes[:, k]))
        np.testing.assert_allclose((ahead - behind) / (2 * step), slopes[:, k], rtol=2e-4, atol=scale)


def test_a_mirrored_helicopter_does_the_same() -> None:
    right = vehicle("raptor50", rotation="cw", aerofoil="naca0012", coning=True)
    left = vehicle("raptor50", rotation="ccw", aerofoil="naca0012", coning=True)
    left = left.with_values({"hub_y": -right.card.values()["hub_y"]})
    mirror = {"y", "v", "phi", "psi", "p", "r", "b1"}
    signs = np.array([-1.0 if name in mirror else 1.0 for name in right.state_names])
    x = np.array([0.0, 0.0, -0.5, 13.0, 1.0, 0.3, 0.05, -0.04, 0.2, 0.1, -0.2, 0.3, 0.02, -0.01])
    u, turned = np.array([0.1, 0.01, 0.02, 0.15]), np.array([0.1, 0.01, -0.02, 0.15])
    rates, other = np.array(right.rates(x, u, right.values())), np.array(left.rates(signs * x, turned, left.values()))
    np.testing.assert_allclose(other, signs * rates, rtol=1e-11, atol=1e-11)


def said(flown: Vehicle, speed: float, collective: float, **values: float) -> dict[str, str]:
    changed, x = flown.with_values(values), np.zeros(14)
    x[3] = speed
    return doubts_by_kind(
        changed, x, np.array([collective, 0.0, 0.0, 0.1]), Environment(air_density=1.225, gravity=9.81)
    )


def test_stall_divergence_and_a_table_that_ends_are_said(tabled: Vehicle) -> None:
    """Each is said where it is so and not where it is not."""
    assert said(tabled, 0.0, 0.09) == {}
    assert "beyond the angle of their largest lift on" in said(tabled, 12.0, 0.3)["stall"]
    assert "stall" not in said(tabled, 12.0, 0.09)
    assert "drag diverges on" in said(tabled, 40.0, 0.03, rotor_speed=390.0)["divergence"]
    assert "divergence" not in said(tabled, 40.0, 0.03)
    assert "Reynolds number 3e+04 to 1e+07" in said(tabled, 0.0, 0.09, rotor_chord=0.002)["table"]
    assert "from behind on" in said(tabled, 80.0, 0.05)["advance"]
    assert said(vehicle("raptor50"), 80.0, 0.05)["advance"].endswith("reversed flow and stall are left out")


@pytest.mark.proof
def test_a_trim_says_where_blades_stall(tabled: Vehicle) -> None:
    assert sp.trim_curve(tabled, (0.0, 10.0)).remarks == ()
    heavy = tabled.with_values({"mass": 14.0})
    assert any("largest lift" in words for words in sp.trim_curve(heavy, (6.0,)).remarks)
    with pytest.raises(TrimError, match=r"no equilibrium was found for 12 m/s.*Near there the blades are beyond"):
        sp.trim(heavy, speed=12.0)


def test_c_is_refused(tabled: Vehicle) -> None:
    pytest.importorskip("casadi")
    with pytest.raises(
        ExportError, match=r"aerofoil: equations with an aerofoil table cannot be written as C.*linearize"
    ):
        tabled.rates((0.1,) * 14, (0.1,) * 4, tabled.values(), xp=CasadiBackend())
    calm, names = Environment(air_density=1.225, gravity=9.81, voltage=0.0), (tabled.state_names, tabled.input_names)
    hover = Trim(np.zeros(14), np.array(STICKS), *names, calm, 0.0, 0.0, 0.0, 0.0)
    with pytest.raises(ExportError, match="cannot be written as C"):
        sp.export_model(tabled, "c", trim=hover)
    with pytest.raises(SwashError, match="aerofoil tables have no closed-form build-up"):
        build_up(tabled, hover.state, hover.inputs, hover.environment)


def test_what_the_table_stands_for_is_not_fitted(tabled: Vehicle) -> None:
    free = {each.name for each in tabled.choices["full"].free}
    assert {"rotor_lift_slope", "rotor_drag"} & {each.name for each in vehicle("raptor50").choices["full"].free}
    assert not {"rotor_lift_slope", "rotor_drag", "rotor_drag_thrust"} & free
    effects = {each.name for each in tabled.traits.effects(tabled.card)}
    assert "profile drag that grows with thrust" not in effects
    assert from_card(tabled.card).options == tabled.options
