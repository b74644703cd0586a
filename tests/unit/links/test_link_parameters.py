"""The parameter file for ArduPilot says what the servo mapping says, and its gains hover at ArduPilot's own rates."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from heli_autopilot import EKF_WAIT, Gains, HeliAutopilot
from link_bench import QUICK, bench
from swashplate.api import link
from swashplate.api.link import write_ardupilot_parameters
from swashplate.errors import ControllerError, LinkError
from swashplate.links.ardupilot.gains import ardupilot_law, read_parameter_file
from swashplate.links.ardupilot.mixing import tail_sense
from swashplate.links.ardupilot.parameters import parameter_file, parameters
from swashplate.links.servos import servo_mapping


def test_the_file_says_on_top_of_which_of_ardupilots_it_is_read() -> None:
    """sim_vehicle.py reads copter-single.parm and then copter-coax.parm for `-f coaxcopter`."""
    assert "copter-single.parm and copter-coax.parm," in parameter_file({"FRAME_CLASS": 9}, title="of the test")
    assert "copter-heli.parm," in parameter_file({"FRAME_CLASS": 6}, title="of the test")


def of(name: str, mapping: str | Path | None = None, **options: object) -> dict[str, float]:
    """As a ground station reads the file."""
    vehicle = sp.vehicle(name, **options)
    voltage = vehicle.card.values().get("voltage_nominal")
    found = parameters(servo_mapping(mapping or name, vehicle), vehicle, sp.trim(vehicle, voltage=voltage))
    lines = parameter_file(found, title="of the test").splitlines()
    assert lines[0].startswith("# of the test: on top of ArduPilot's ")
    return {key: float(value) for key, value in (line.split(",") for line in lines[1:])}


def changed(folder: Path, old: str, new: str) -> Path:
    """The packaged mapping of the Raptor 50 with another line."""
    text = (Path(sp.__file__).parent / "links" / "mappings" / "raptor50.toml").read_text(encoding="utf-8")
    assert old in text
    (folder / "own.toml").write_text(text.replace(old, new), encoding="utf-8")
    return folder / "own.toml"


@pytest.fixture(scope="module")
def raptor() -> dict[str, float]:
    return of("raptor50")


@pytest.mark.proof
def test_a_helicopter_takes_off_and_hovers_at_1200_frames_a_second(tmp_path: Path) -> None:
    """The EKF's 40 s on the ground, armed, run-up, lift-off and hover with the file's gains, loops at 400 Hz."""
    vehicle, file = sp.vehicle("raptor50"), tmp_path / "raptor50.parm"
    raptor = read_parameter_file(
        write_ardupilot_parameters(vehicle, file, trim=sp.trim(vehicle), name="raptor50")  # gains included
    )
    axes = ("RLL", "PIT", "YAW")
    angle = tuple(raptor[f"ATC_ANG_{axis}_P"] for axis in axes)
    rate = {k: tuple(raptor[f"ATC_RAT_{axis}_{k}"] for axis in axes) for k in ("FF", "P", "I")}
    at = bench("raptor50", engine=QUICK)
    kept = (raptor["ATC_RAT_RLL_ILMI"], raptor["ATC_RAT_PIT_ILMI"])
    gains = Gains(angle, rate["FF"], rate["P"], rate["I"], kept)  # type: ignore[arg-type]
    pilot = HeliAutopilot(at.send, rate=400, gains=gains)
    still = pilot.wait_for_ekf()
    assert still["timestamp"][0] == pytest.approx(EKF_WAIT, abs=0.1)
    assert np.abs([*still["gyro"], *still["velocity"]]).max() < 1e-3
    assert np.allclose(still["accel_body"], (0.0, 0.0, -9.80665), atol=0.01)
    assert still["rpm_1"] == [0.0]
    assert pilot.arm() == ""
    pilot.interlock = True
    running = pilot.fly(8.0)  # ArduPilot itself would wait for H_RSC_RUNUP_TIME
    assert running["rpm_1"][0] > 1300.0
    pilot.rate, pilot.every = int(raptor["SIM_RATE_HZ"]), 3
    pilot.height, pilot._lift = 3.0, 0.5
    pilot.fly(6.0)
    first = len(pilot.answers)
    pilot.fly(1.0)
    hover = pilot.answers[first:]
    assert not at.plant.broken
    down = np.array([a["position"][2] for a in hover])
    rates = np.array([a["gyro"] for a in hover])
    assert np.abs(down + 3.0).max() < 0.3
    assert np.abs(rates).max() < 0.2
    roll = np.degrees(np.mean([a["attitude"][0] for a in hover]))
    assert roll == pytest.approx(0.01 * raptor["ATC_HOVR_ROL_TRM"], abs=1.0)
    # What the hover asks of the cyclic is within what the leaking integrals keep: no attitude error has to hold it.
    mixer = np.abs(np.mean([row[4:6] for row in pilot.log[-400:]], axis=0))
    assert np.all(mixer < kept)
    assert np.abs(pilot._sums[:2]) == pytest.approx(mixer, abs=0.02)


def test_the_file_says_what_the_mapping_says(raptor: dict[str, float]) -> None:
    assert (raptor["FRAME_CLASS"], raptor["H_SW_TYPE"]) == (6, 3)
    assert (raptor["H_COL_MIN"], raptor["H_COL_MAX"]) == (1460, 1740)
    assert (raptor["H_COL_ANG_MIN"], raptor["H_COL_ANG_MAX"]) == (-2, 12)
    assert [raptor[f"SERVO{n}_FUNCTION"] for n in (1, 2, 3, 4, 8)] == [33, 34, 35, 36, 31]
    assert raptor["H_RSC_SETPOINT"] > 50.0, "above the mapping's full"
    assert raptor["H_RSC_RUNUP_TIME"] >= raptor["H_RSC_RAMP_TIME"]
    hover = sp.trim(sp.vehicle("raptor50")).states()["phi"]
    assert raptor["ATC_HOVR_ROL_TRM"] == round(100.0 * math.degrees(hover))


def test_a_tail_that_would_turn_the_nose_left_is_reversed(raptor: dict[str, float], tmp_path: Path) -> None:
    own = changed(tmp_path, "deg = [-10.0, 30.0]", "deg = [30.0, -10.0]")
    other = of("raptor50", own)
    assert (raptor["SERVO4_REVERSED"], other["SERVO4_REVERSED"]) == (0.0, 1.0)
    vehicle = sp.vehicle("raptor50")
    turned = ardupilot_law(servo_mapping(own, vehicle), vehicle, sp.trim(vehicle)).mixer
    straight = ardupilot_law(servo_mapping("raptor50", vehicle), vehicle, sp.trim(vehicle)).mixer
    assert turned == pytest.approx(straight), "behind the reversed output yaw turns the same way, by as much"


def test_a_coaxial_has_flaps_and_motors() -> None:
    found = of("coax")
    assert found["FRAME_CLASS"] == 9, "CoaxCopter in ArduPilot's list (8: SingleCopter, 6: Heli, 9: CoaxCopter)"
    assert [found[f"SERVO{n}_FUNCTION"] for n in (1, 2, 5, 6)] == [33, 34, 37, 38]


def test_without_gains_that_hold_the_file_says_so_and_has_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def none_hold(*_: object, **__: object) -> None:
        raise ControllerError("no gains of the roll and pitch loop hold: 0 of 1 sets keep their margins.")

    monkeypatch.setattr(link, "cascade_gains", none_hold)
    vehicle, said = sp.vehicle("coax"), list[str]()
    file = link.write_ardupilot_parameters(vehicle, tmp_path / "x.parm", trim=sp.trim(vehicle), notice=said.append)
    assert not any(name.startswith(("ATC_RAT", "PSC_")) for name in read_parameter_file(file))
    assert "no gains" in said[0]


def test_a_swashplate_that_ardupilot_has_no_number_for_is_refused(tmp_path: Path) -> None:
    custom = 'type = "custom"\nmatrix = [[1, 1, 0.5], [1, -1, 0.5], [1, 0, -1]]'
    with pytest.raises(LinkError, match="type 'custom' has no number in ArduPilot"):
        of("raptor50", changed(tmp_path, 'type = "H3-120"', custom))


def test_servos_and_delays_do_not_hide_which_way_the_tail_turns() -> None:
    """Their states stand between the command and the nose; a tail that is wired the other way is still seen."""
    slow = sp.vehicle("raptor50", servos=True)
    hover = sp.trim(slow)
    assert tail_sense((-10.0, 30.0), slow, hover) == 1.0
    assert tail_sense((30.0, -10.0), slow, hover) == -1.0
    with pytest.raises(LinkError, match="the tail moves nothing"):
        tail_sense((10.0, 10.0), slow, hover)
