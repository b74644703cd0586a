"""Rotorflight's law rebuilt: three helicopters hover under it with its gains designed, its file, what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.control.analysis.cascade_gains import CascadeGains
from swashplate.control.analysis.rotorflight_gains import judge_rotorflight, rotorflight_gains
from swashplate.control.kinds import kind_of, save_controller
from swashplate.control.laws.rotorflight.law import RotorflightLaw, rotorflight_law
from swashplate.control.laws.rotorflight.parameters import cli_dump, known
from swashplate.errors import ControllerError
from swashplate.flights.flight import Flight
from swashplate.simulation.standing import airborne

HELICOPTERS = ("raptor50", "xcell60", "helion")


@pytest.fixture(scope="module", params=HELICOPTERS)
def judged(request: pytest.FixtureRequest) -> tuple[sp.Vehicle, CascadeGains[RotorflightLaw]]:
    vehicle = sp.vehicle(request.param)
    hover = sp.trim(vehicle)
    found = rotorflight_gains(
        vehicle, hover, rotorflight_law(vehicle, hover), delays=dict.fromkeys(vehicle.input_names, 0.005)
    )
    assert found.problems == ()
    assert found.slowest.real < 0.0
    return vehicle, found


@pytest.fixture
def designed(judged: tuple[sp.Vehicle, CascadeGains[RotorflightLaw]]) -> tuple[sp.Vehicle, RotorflightLaw]:
    return judged[0], judged[1].law


def flown(vehicle: sp.Vehicle, law: RotorflightLaw, seconds: float = 30.0, **start: float) -> Flight:
    rest = sp.trim(vehicle).states()
    held = {name: rest.get(name, 0.0) for name in ("x", "y", "z", "psi")}
    begun = {**rest, **start}
    return sp.simulate_closed_loop(
        vehicle, law, duration=seconds, start=begun, reference=held, rate=law.rate, delays=0.005
    )


def test_a_hover_at_its_own_rate(designed: tuple[sp.Vehicle, RotorflightLaw]) -> None:
    vehicle, law = designed
    assert law.rate == 1000.0
    flight = flown(vehicle, law, x=0.3, y=-0.2, z=0.2, psi=0.3)
    last = flight.time("x") > 20.0
    for name, most in (("x", 0.02), ("y", 0.02), ("z", 0.01), ("psi", 0.005)):
        assert np.abs(flight.values(name)[last]).max() < most, name
    assert np.degrees(np.abs(flight.values("p")[last])).max() < 0.5


def test_a_stick_leans_it_in_angle_mode(designed: tuple[sp.Vehicle, RotorflightLaw]) -> None:
    vehicle, law = designed
    rest, most = sp.trim(vehicle).states(), law.parameters["angle_level_limit"]
    for stick, angle, sign in (("roll", "phi", 1.0), ("pitch", "theta", -1.0)):
        held = {name: rest.get(name, 0.0) for name in ("x", "y", "z", "psi")} | {stick: 0.1}
        flight = sp.simulate_closed_loop(
            vehicle, law.in_mode("angle").at(vehicle, sp.trim(vehicle)), duration=3.0, reference=held, rate=1000.0
        )
        leaned = np.degrees(flight.values(angle)[-1] - rest[angle])
        assert leaned == pytest.approx(sign * 0.1 * most, rel=0.2), stick


def test_margins_fall_with_delay_and_say_so(judged: tuple[sp.Vehicle, CascadeGains[RotorflightLaw]]) -> None:
    """Those of the gains are judged at 5 ms, and hold."""
    vehicle, found = judged
    hover = sp.trim(vehicle)
    worth = [found] + [
        judge_rotorflight(vehicle, hover, found.law, delays=dict.fromkeys(vehicle.input_names, late))
        for late in (0.010, 0.045)
    ]
    for soon, later in zip(worth[0].stabilize, worth[1].stabilize, strict=True):
        assert later.delay == pytest.approx(soon.delay - 0.005, abs=1.5e-3), soon.name  # read on a grid
        assert later.phase < soon.phase, soon.name
    assert any("roll loop keeps" in text for text in worth[2].problems)


def test_the_governor_holds_a_head_speed() -> None:
    """The card's own governor is asked for more than there is, so that the throttle alone decides."""
    base = airborne(sp.vehicle("raptor50"))
    hover = sp.trim(base)
    omega = hover.states()["omega"]
    law = rotorflight_law(base, hover, given={"gov_headspeed": omega * 30.0 / np.pi, "gov_gain": 100.0})
    assert "throttle" in base.input_names
    driven = base.with_values({"governor_gain": 1000.0, "rotor_speed": 1.3 * base.card.values()["rotor_speed"]})
    held = dict.fromkeys(("x", "y", "z", "psi"), 0.0)
    flight = sp.simulate_closed_loop(driven, law, duration=20.0, start=hover.states(), reference=held, rate=1000.0)
    speed, throttle = flight.values("omega"), flight.values("throttle")
    assert abs(speed[-1] / omega - 1.0) < 0.005
    assert 0.1 < throttle[-1] < 0.95


def test_its_file(tmp_path: Path) -> None:
    vehicle = sp.vehicle("xcell60")
    hover = sp.trim(vehicle)
    law = rotorflight_law(vehicle, hover, given={"roll_p_gain": 60.0})
    save_controller(law, tmp_path / "law.toml")
    again = sp.load_controller(tmp_path / "law.toml")
    np.testing.assert_array_equal(again.gains, law.gains)
    assert kind_of(again).about(again, vehicle, hover) == law.at(vehicle, hover)
    text = (tmp_path / "law.toml").read_text(encoding="utf-8")
    for old, new, told in (
        ('mode = "hover"', 'mode = "loiter"', "mode"),
        ("rate = 1000.0", "rate = 100.0", "expected 250 to 4000"),
        ("roll_p_gain = 60.0", "roll_q_gain = 60.0", "no parameter of the law"),
        ("sense = -1.0", "turn = -1.0", "expected pitch, tail, centre, sense"),
    ):
        assert old in text, old
        (tmp_path / "bad.toml").write_text(text.replace(old, new), encoding="utf-8")
        with pytest.raises(ControllerError, match=told):
            sp.load_controller(tmp_path / "bad.toml")


def test_what_it_does_not_fly_is_refused() -> None:
    coax = sp.vehicle("coax")
    with pytest.raises(ControllerError, match="no helicopter with one rotor and a tail"):
        rotorflight_law(coax, sp.trim(coax))
    with pytest.raises(ControllerError, match=r"pid_mode.*is 4; the rebuilt law has no such part, expected 3"):
        known({"pid_mode": 4.0})
    vehicle = sp.vehicle("raptor50")
    law = replace(rotorflight_law(vehicle, sp.trim(vehicle)), vehicle="coax")
    with pytest.raises(ControllerError, match="is for 'coax', not for 'conventional'"):
        kind_of(law).about(law, vehicle, sp.trim(vehicle))


def test_lines_of_its_command_line() -> None:
    text = cli_dump({"roll_p_gain": 60.0, "iterm_relax_level_yaw": 50.0}, title="a helicopter")
    assert "set roll_p_gain = 60\n" in text
    assert "set iterm_relax_level = 40,40,50\n" in text
    assert text.endswith("save\n")
