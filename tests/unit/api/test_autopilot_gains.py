"""`sp.autopilot_gains`: gains hold their margins by two computations, fly, are written; bad ones are told."""

from __future__ import annotations

import json
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.api.autopilot_gains import STRAYS, AutopilotGains
from swashplate.api.link import gains_to_write, mapping_of
from swashplate.control.analysis.cascade_gains import GAIN_KEPT, PEAK_KEPT, PHASE_KEPT
from swashplate.errors import ControllerError, LinkError, SwashError
from swashplate.json_text import as_json
from swashplate.links.ardupilot.gains import ASSUMED_DELAY, read_parameter_file

HELICOPTERS = ("raptor50", "helion", "xcell60", "coax")


@pytest.fixture(scope="module")
def coax() -> AutopilotGains:
    return sp.autopilot_gains(sp.vehicle("coax"))


def judged(made: AutopilotGains, **changes: float) -> AutopilotGains:
    given = {**made.parameters, **changes}
    return sp.autopilot_gains(sp.vehicle("coax"), parameters=given, fly=False)


def test_every_loop_of_the_coaxial_holds_its_margins(coax: AutopilotGains) -> None:
    assert coax.problems == ()
    assert [loop.name for loop in coax.found.loops] == ["roll", "pitch", "yaw", "height", "place right", "place ahead"]
    for loop in coax.found.loops:
        assert loop.gain >= GAIN_KEPT
        assert loop.phase >= PHASE_KEPT
        assert loop.peak <= PEAK_KEPT
        assert 0.0 < loop.delay < np.inf
        assert loop.bandwidth > 0.0
        assert loop.rejection > 0.0
    assert coax.found.slowest.real < 0.0


def test_margins_are_those_of_the_sampled_law(coax: AutopilotGains) -> None:
    """Another computation: derivatives of the law's own step, sampled, exact delays."""
    vehicle = sp.vehicle("coax")
    hover = sp.trim(vehicle, voltage=vehicle.card.values()["voltage_nominal"])
    found = sp.loop_margins(vehicle, coax.controller().at(vehicle, hover), hover, delays=ASSUMED_DELAY)
    roll = coax.found.loops[0]
    servo = next(axis for axis in found.axes if axis.name == "servo_roll")
    assert min(20.0 * np.log10(servo.gain), -20.0 * np.log10(servo.gain_down)) == pytest.approx(roll.gain, abs=0.5)
    assert np.degrees(servo.phase) == pytest.approx(roll.phase, abs=2.0)
    assert servo.delay == pytest.approx(roll.delay, rel=0.15)
    assert servo.sensitivity == pytest.approx(roll.peak, rel=0.05)


def test_the_coaxial_stays_within_half_a_metre_in_loiter(coax: AutopilotGains) -> None:
    """Nonlinear, still air, integrals at zero, 5 ms late: the issue's own bound."""
    loiter = next(flight for flight in coax.flown if flight.mode == "loiter")
    assert loiter.place <= STRAYS
    assert loiter.still < 0.1
    assert {flight.mode: flight.fell for flight in coax.flown} == {"stabilize": "", "alt_hold": "", "loiter": ""}
    assert all(flight.height < 0.1 for flight in coax.flown[1:])


@pytest.mark.parametrize(
    ("names", "factor", "told"),
    [
        (("ATC_RAT_RLL_P", "ATC_RAT_RLL_D"), 4.0, "roll loop keeps"),
        (("ATC_RAT_YAW_P", "ATC_RAT_YAW_I"), 4.0, "yaw loop keeps"),
        (("PSC_ACCZ_P", "PSC_ACCZ_I", "PSC_D_ACC_P", "PSC_D_ACC_I"), 8.0, "height loop keeps"),
        (("PSC_POSXY_P", "PSC_NE_POS_P"), 12.0, "place right loop keeps"),
    ],
)
def test_raised_gains_are_told(coax: AutopilotGains, names: tuple[str, ...], factor: float, told: str) -> None:
    """Mutation of every loop: too much of its gain, and it is that loop which is named."""
    assert judged(coax).problems == ()
    worse = judged(coax, **{name: factor * coax.parameters[name] for name in names})
    assert any(told in problem for problem in worse.problems), worse.problems


def test_a_growing_mode_is_told(coax: AutopilotGains) -> None:
    names = ("ATC_RAT_RLL_P", "ATC_RAT_RLL_D", "ATC_RAT_PIT_P", "ATC_RAT_PIT_D")
    worse = judged(coax, **{name: 0.05 * coax.parameters[name] for name in names})
    assert any("A mode grows" in problem for problem in worse.problems), "the bar's own mode, hardly held any more"


def test_gains_that_grow_and_fly_refute_the_model(coax: AutopilotGains) -> None:
    names = ("ATC_RAT_RLL_P", "ATC_RAT_RLL_D", "ATC_RAT_PIT_P", "ATC_RAT_PIT_D")
    worse = judged(coax, **{name: 0.05 * coax.parameters[name] for name in names})
    told = [text for text in worse.problems if "its flight refutes this model" in text]
    assert len(told) == 1
    assert not any("refutes" in text for text in judged(coax).problems)


@pytest.mark.parametrize("axis", ["roll", "pitch"])
def test_a_travel_of_the_wrong_sign_is_named_and_gets_no_gains(tmp_path: Path, axis: str) -> None:
    """Mutation of the packaged mapping: one command turns the other way, and it is that one which is named."""
    text = (files("swashplate.links") / "mappings" / "coax.toml").read_text(encoding="utf-8")
    turned = tmp_path / "turned.toml"
    turned.write_text(text.replace("[cyclic]", f"[cyclic]\n{axis}_travel = -1.0"), encoding="utf-8")
    for given in (None, {"ATC_RAT_RLL_P": 0.1}):
        with pytest.raises(ControllerError, match=f"a positive {axis} command makes . negative, expected positive"):
            sp.autopilot_gains(sp.vehicle("coax"), servos=turned, parameters=given, fly=False)


def test_an_axis_that_was_fitted_though_nothing_moved_it_gets_no_gains(coax: AutopilotGains) -> None:
    plain = sp.vehicle("coax")
    unmoved = plain.with_card(replace(plain.card, observer={"unmoved": {"yaw": 1.0}}))
    with pytest.raises(ControllerError, match="yaw: fitted although no flight moved it from outside"):
        sp.autopilot_gains(unmoved, fly=False)
    told: list[str] = []
    hover = sp.trim(unmoved, voltage=plain.card.values()["voltage_nominal"])
    assert gains_to_write(mapping_of(unmoved, None, name="coax", suffix=""), unmoved, hover, notice=told.append) == {}
    assert "no flight moved it" in told[0]
    only = sp.autopilot_gains(unmoved, parameters=coax.parameters, fly=False)
    assert any("no flight moved it" in text for text in only.problems)
    design = sp.design_controller(unmoved, method="lqr")
    assert "Careful: yaw: fitted although no flight moved it" in repr(design)
    assert "no flight moved it" in design.to_document()["premise"]


def test_hand_made_gains_miss_their_margins(tmp_path: Path) -> None:
    (tmp_path / "hand.parm").write_text(
        "# by hand\nATC_RAT_RLL_P,0.05\nPSC_NE_POS_P 0.3 # m/s per m\nATC_ANG_RLL_P\t3\n"
    )
    assert read_parameter_file(tmp_path / "hand.parm") == {
        "ATC_RAT_RLL_P": 0.05,
        "PSC_NE_POS_P": 0.3,
        "ATC_ANG_RLL_P": 3,
    }
    made = sp.autopilot_gains(sp.vehicle("coax"), parameters=tmp_path / "hand.parm", fly=False)
    assert made.problems


def test_its_files(coax: AutopilotGains, tmp_path: Path) -> None:
    file = coax.save(tmp_path / "coax.parm")
    again = read_parameter_file(file)
    assert again == pytest.approx(dict(coax.parameters), rel=1e-4, abs=1e-6)
    assert again["FRAME_CLASS"] == 9
    assert again["PSC_D_ACC_P"] == pytest.approx(0.1 * again["PSC_ACCZ_P"], rel=1e-4), "4.7's unit"
    sp.load_controller(coax.save(tmp_path / "law.toml"))
    with pytest.raises(SwashError, match=r"expected \.parm or \.toml"):
        coax.save(tmp_path / "coax.params")
    told = json.loads(as_json(coax.to_document()))
    assert told["problems"] == []
    assert told["loops"][0]["holds"] is True
    assert "assumed" in repr(coax)
    assert "ATC_RAT_RLL_P" in repr(coax)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("ATC_RAT_RLL_P 0.1 0.2\n", "line 1"),
        ("# nothing\n", "holds no parameter"),
        ("\nATC_RAT_RLL_P much\n", "line 2"),
        ("ATC_RAT_RLL_P nan\n", "no finite number"),
    ],
)
def test_bad_parameter_files(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "bad.parm").write_text(text)
    with pytest.raises(LinkError, match=told):
        read_parameter_file(tmp_path / "bad.parm")


def test_what_is_refused() -> None:
    with pytest.raises(LinkError, match="cannot be read"):
        read_parameter_file("nowhere.parm")
    with pytest.raises(SwashError, match="no servo mapping"):
        sp.autopilot_gains("crazyflie")
    with pytest.raises(ControllerError, match="ArduPilot's parameters only"):
        sp.autopilot_gains(sp.vehicle("coax"), autopilot="px4", notch=(26.0, 10.0))
    with pytest.raises(SwashError, match="expected one of ardupilot, px4"):
        sp.autopilot_gains(sp.vehicle("coax"), autopilot="betaflight")
    with pytest.raises(SwashError, match=r"delay: is 0\.02 ms, expected 0, or 0\.5 or more\. 20 for 0\.02 s"):
        sp.autopilot_gains("coax", delay=0.02)


@pytest.mark.proof
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("name", HELICOPTERS)
def test_every_packaged_helicopter(name: str, autopilot: str, tmp_path: Path) -> None:
    """What is packaged is generated this way: margins, a stable sampled law, three modes flown nonlinearly."""
    if (name, autopilot) in (("helion", "px4"), ("xcell60", "px4")):
        pytest.skip("no packaged servo mapping for PX4")
    made = sp.autopilot_gains(name, autopilot=autopilot)  # type: ignore[arg-type]
    assert made.problems == ()
    vehicle = sp.vehicle(name)
    hover = sp.trim(vehicle, voltage=vehicle.card.values().get("voltage_nominal"))
    check = sp.loop_margins(vehicle, made.controller().at(vehicle, hover), hover, delays=ASSUMED_DELAY)
    for axis in check.axes:
        assert 20.0 * np.log10(axis.gain) >= GAIN_KEPT - 0.3, axis
        assert np.degrees(axis.phase) >= PHASE_KEPT - 2.0, axis
    if autopilot == "px4":
        text = made.save(tmp_path / "x.params").read_text(encoding="utf-8").splitlines()
        rows = [line.split("\t") for line in text if not line.startswith("#")]
        assert all(len(row) == 5 and np.isfinite(float(row[3])) for row in rows)
        assert {"MC_ROLLRATE_P", "MPC_XY_VEL_P_ACC", "CA_AIRFRAME"} <= {row[2] for row in rows}


@pytest.mark.proof
def test_more_delay_gives_lower_gains_and_at_last_none() -> None:
    """Mutation of the model: the same helicopter with later commands gets softer loops; a late coaxial none."""
    prompt, late = (sp.autopilot_gains("raptor50", delay=d, fly=False) for d in (0.0, 30.0))
    for name in ("ATC_RAT_RLL_P", "ATC_RAT_PIT_P", "PSC_VELXY_P"):
        assert late.parameters[name] < prompt.parameters[name]
    assert not late.problems
    with pytest.raises(ControllerError, match=r"no gains of the .* loop hold"):
        sp.autopilot_gains(sp.vehicle("coax"), delay=40.0, fly=False)


@pytest.mark.proof
def test_a_notch_takes_its_phase_and_gains_with_it_in_the_loop_hold() -> None:
    plain, notched = (sp.autopilot_gains("raptor50", notch=n, fly=False) for n in (None, (12.0, 8.0)))
    assert notched.parameters["INS_HNTCH_FREQ"] == 12.0
    assert not notched.problems
    same = {**plain.parameters, "INS_HNTCH_ENABLE": 1.0, "INS_HNTCH_FREQ": 12.0, "INS_HNTCH_BW": 8.0}
    kept = sp.autopilot_gains("raptor50", parameters=same, fly=False)
    assert kept.found.loops[0].phase < plain.found.loops[0].phase - 5.0


def test_rotorflights_names_and_modes(tmp_path: Path) -> None:
    helicopter = sp.vehicle("xcell60")
    made = sp.autopilot_gains(helicopter, autopilot="rotorflight")
    assert made.problems == ()
    assert [flight.mode for flight in made.flown] == ["angle", "hover"]
    assert made.flown[1].place <= STRAYS
    text = made.save(tmp_path / "cli.txt").read_text(encoding="utf-8")
    assert f"set roll_p_gain = {made.parameters['roll_p_gain']:.0f}\n" in text
    assert made.controller().type == "rotorflight"
    again = sp.autopilot_gains(helicopter, autopilot="rotorflight", parameters=made.parameters, fly=False)
    assert [loop.phase for loop in again.found.stabilize][:1] == pytest.approx([made.found.stabilize[0].phase], abs=0.5)
    with pytest.raises(ControllerError, match="expected angle, hover"):
        made.controller("loiter")
    with pytest.raises(SwashError, match=r"expected \.txt or \.toml"):
        made.save(tmp_path / "gains.parm")
    with pytest.raises(ControllerError, match="given by name"):
        sp.autopilot_gains(helicopter, autopilot="rotorflight", parameters=tmp_path / "cli.txt")
