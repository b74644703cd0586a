"""A coaxial helicopter under ArduPilot's dual frame: pulses of its mixer back to pitches, parameters, and a flight."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from heli_autopilot import SETPOINT, Gains, HeliAutopilot
from link_bench import QUICK, bench
from swashplate.errors import LinkError
from swashplate.links.ardupilot.gains import ardupilot_law
from swashplate.links.ardupilot.mixing import mixer_of
from swashplate.links.ardupilot.parameters import parameter_file, parameters
from swashplate.links.px4.gains import px4_law
from swashplate.links.px4.parameters import parameters as px4_parameters
from swashplate.links.servos import TwinMapping, servo_mapping
from swashplate.physics.environment import Environment
from swashplate.simulation.standing import standing

COAXIAL = sp.vehicle("coaxial15")
DCP, COLLECTIVE = 0.2, (0.3, 0.4)
"""H_DCP_SCALER; H_COL_MIN and its way to H_COL_MAX as shares of 1000 us."""
H3_120 = (-60.0, 60.0, 180.0)


def dual_outputs(roll: float, pitch: float, yaw: float, collective: float) -> list[float]:
    """Six servos' pulses [us], from AP_MotorsHeli_Dual::mix_intermeshing and AP_MotorsHeli_Swash, H_YAW_SCALER 0."""
    pulses = []
    for sense in (1.0, -1.0):
        share = COLLECTIVE[0] + COLLECTIVE[1] * collective + sense * 0.45 * DCP * yaw
        for at in np.radians(H3_120):
            servo = share + 0.45 * (math.cos(at + 0.5 * math.pi) * roll + math.cos(at) * pitch)
            pulses.append(1000.0 + 1000.0 * min(1.0, max(0.0, servo)))
    return pulses


class DualAutopilot(HeliAutopilot):
    """The same firmware with FRAME_CLASS 11 and H_DUAL_MODE 2."""

    def _mixed(self, mixer: np.ndarray, collective: float) -> list[int]:
        roll, pitch, yaw = map(float, mixer)
        pulses = [int(pulse) for pulse in dual_outputs(roll, pitch, yaw, collective)]
        return [*pulses, 0, int(1000 + 1000 * SETPOINT * self._ramp)]


def mapping() -> TwinMapping:
    made = servo_mapping("coaxial15", standing(COAXIAL))
    assert isinstance(made, TwinMapping)
    return made


def test_pulses_of_the_dual_frame_are_the_pitches_that_were_meant() -> None:
    made = mapping()
    pulses = [*dual_outputs(0.2, 0.1, 0.5, 0.5), 0, 1660]
    theta0, B1, A1, theta0d, throttle = made.inputs(pulses, 0.5)
    # 18 deg of collective on 400 us: half of full yaw moves each collective by 45 us.
    np.testing.assert_allclose(np.degrees([theta0, B1, A1, theta0d]), [5.0, -0.72, 1.44, 45 * 18 / 400], atol=1e-6)
    assert throttle == pytest.approx(0.5 / 8.0)
    made.restart()
    assert made.inputs([*pulses[:7], 1000], 0.5)[4] == 0.0
    # The rebuilt law's mixer says the same of the same commands.
    hover = sp.trim(COAXIAL)
    mixed = mixer_of(made, COAXIAL, hover).mix(np.array([0.2, 0.1, 0.5, 0.5]), {"H_CYC_MAX": 2500.0}, np)
    np.testing.assert_allclose(np.asarray(mixed.inputs)[:4], [theta0, B1, A1, theta0d], atol=1e-7)


def test_a_rotor_the_other_way_round_changes_places() -> None:
    """ArduPilot's swashplate 1 gets more collective to turn right: it is the counter-clockwise rotor's."""
    hover = sp.trim(COAXIAL)
    upper = parameters(mapping(), COAXIAL, hover)
    assert [upper[f"SERVO{n}_FUNCTION"] for n in (1, 2, 3, 4, 5, 6, 8)] == [33, 34, 35, 36, 37, 38, 31]
    assert upper["FRAME_CLASS"] == 11
    assert upper["H_DUAL_MODE"] == 2
    assert upper["H_DCP_SCALER"] == DCP
    assert upper["H_YAW_SCALER"] == 0.0
    assert (upper["H_COL_MIN"], upper["H_COL2_MAX"]) == (1300, 1700)
    assert "copter-heli-dual.parm" in parameter_file(upper, title="coaxial")
    turned = sp.vehicle("coaxial15", rotation="cw")
    other = servo_mapping("coaxial15", standing(turned))
    swapped = parameters(other, turned, hover)
    assert [swapped[f"SERVO{n}_FUNCTION"] for n in (1, 2, 3, 4, 5, 6)] == [36, 37, 38, 33, 34, 35]
    # More collective above turns the nose the other way there: half of the difference counts with the other sign.
    pulses = [*dual_outputs(0.0, 0.0, 0.5, 0.5), 0, 1660]
    assert other.inputs(pulses, 0.5)[3] == pytest.approx(-mapping().inputs(pulses, 0.5)[3])


def test_what_cannot_be_is_refused(tmp_path: Path) -> None:
    text = (Path(sp.__file__).parent / "links" / "mappings" / "coaxial15.toml").read_text(encoding="utf-8")
    for was, instead, words in (
        ("lower = [4, 5, 6]", "lower = [3, 4, 5]", "not all different"),
        ("yaw_share = 0.2 ", "yaw_share = 0.0 ", "yaw_share: is 0, expected more than 0"),
        ("lower = [4, 5, 6]", "lower = [4, 5]", "has 2 servos, the type has 3"),
    ):
        file = tmp_path / "own.toml"
        file.write_text(text.replace(was, instead), encoding="utf-8")
        with pytest.raises(LinkError, match=words):
            servo_mapping(file, standing(COAXIAL))
    with pytest.raises(LinkError, match="PX4 has no frame with two swashplates"):
        px4_parameters(mapping())
    with pytest.raises(LinkError, match="PX4 has no frame with two swashplates"):
        px4_law(mapping(), COAXIAL, sp.trim(COAXIAL))


@pytest.mark.proof
def test_it_takes_off_hovers_turns_and_lands_under_the_dual_frame() -> None:
    """Behind the stand-in's loops with ArduPilot's gains and the feed-forward that the parameter file gets."""
    line = bench("coaxial15", environment=Environment(0.5, -0.5, 0.0), engine=QUICK)
    law = ardupilot_law(mapping(), COAXIAL, sp.trim(COAXIAL)).parameters
    forward = (law["ATC_RAT_RLL_FF"], law["ATC_RAT_PIT_FF"], 0.0)
    pilot = DualAutopilot(line.send, rate=200, gains=Gains(forward=forward))
    pilot.fly(0.5)
    pilot.armed = pilot.interlock = True
    pilot.fly(9.0)
    np.testing.assert_allclose(pilot.answers[-1]["position"], 0.0, atol=0.02)
    pilot.height, pilot._lift = 3.0, 0.6
    pilot.fly(9.0)
    pilot._heading += 0.5
    hovering = pilot.fly(4.0)
    assert -hovering["position"][2] == pytest.approx(3.0, abs=0.1)
    assert math.hypot(*hovering["position"][:2]) < 1.0
    assert hovering["attitude"][2] == pytest.approx(pilot._heading, abs=0.05)
    pilot.height = 0.01
    landed = pilot.fly(10.0)
    assert -landed["position"][2] == pytest.approx(0.0, abs=0.05)
    assert not line.plant.broken
    assert max(abs(a) for answer in pilot.answers for a in answer["attitude"][:2]) < 0.3
