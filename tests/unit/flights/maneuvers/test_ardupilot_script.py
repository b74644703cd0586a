"""The script for ArduPilot, run by a Lua interpreter against a stand-in of the functions that it calls."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swashplate.flights.maneuvers.ardupilot_script import LEAD, ardupilot_script

LINES = {"roll": ((6, 0.05, 0.3), (14, 0.02, -1.0)), "pitch": ((9, 0.04, 2.0),), "heave": ((5, 0.1, 0.0),)}
DURATION = 4.0
LIMITS = {"attitude": 20.0, "rate": 120.0, "place": 3.0}

STANDIN = """
now, mode, armed, position, texts, asked = 5000.0, 4, true, 0, {}, {}
fields = {x = 0.0, y = 0.0, z = 0.0}
local function vector(x, y, z)
  return {x = function() return x end, y = function() return y end, z = function() return z end}
end
lean, off, gyro_x = 0.02, 0.0, 0.0
gcs = {send_text = function(_, _, text) texts[#texts + 1] = text end}
rc = {find_channel_for_option = function() return {get_aux_switch_pos = function() return position end} end}
arming = {is_armed = function() return armed end}
ahrs = {
  get_roll = function() return lean end, get_pitch = function() return 0.0 end, get_yaw = function() return 1.0 end,
  get_relative_position_NED_home = function() return vector(off, 0.0, -2.0) end,
  get_velocity_NED = function() return vector(0.0, 0.0, 0.0) end,
  get_gyro = function() return vector(gyro_x, 0.0, 0.0) end,
}
vehicle = {
  get_mode = function() return mode end,
  set_mode = function(_, to) mode = to end,
  set_target_angle_and_climbrate = function(_, roll, pitch, yaw, climb)
    asked = {roll = roll, pitch = pitch, yaw = yaw, climb = climb}
    return true
  end,
}
function millis() return {tofloat = function() return now end} end
"""


def text() -> str:
    return ardupilot_script(LINES, duration=DURATION, limits=LIMITS, title="it's a \n test")


def begun() -> Any:
    """The script in flight, its switch high since an instant."""
    lua = pytest.importorskip("lupa", reason="lupa, a Lua interpreter, is not installed").LuaRuntime()
    lua.execute(STANDIN)
    lua.execute(text())
    lua.execute("update() position = 2 update()")
    return lua


def test_the_title_cannot_end_its_text() -> None:
    assert text().startswith("-- it s a   test\n")
    assert text().count("it s a   test") == 2


def test_it_asks_for_the_lines_and_gives_the_aircraft_back() -> None:
    lua = begun()
    for t in (0.0, 0.37, 1.9, DURATION - 0.01):
        lua.execute(f"now = 5000.0 + {1000.0 * (t + LEAD)} update()")
        expected = {
            axis: sum(a * np.cos(2.0 * np.pi * n * t / DURATION + phase) for n, a, phase in own)
            for axis, own in LINES.items()
        }
        asked = lua.globals().asked
        assert asked.roll == pytest.approx(np.degrees(0.02 + expected["roll"]), abs=1e-4)
        assert asked.pitch == pytest.approx(np.degrees(expected["pitch"]), abs=1e-4)
        assert asked.climb == pytest.approx(expected["heave"], abs=1e-6)
        assert asked.yaw == pytest.approx(np.degrees(1.0))
    lua.execute(f"now = 5000.0 + {1000.0 * (DURATION + 2.0 * LEAD) + 20.0} update()")
    assert lua.globals().mode == 5
    assert list(lua.globals().texts.values()) == ["maneuver: it s a   test", "maneuver: ended, complete"]
    lua.execute("mode = 4 asked = {} update() update()")
    assert lua.globals().asked.roll is None  # the switch must be low once before it begins again


def test_the_place_is_held_within_five_degrees() -> None:
    lua = begun()
    lua.execute("off = 2.9 now = 5000.0 update()")
    assert lua.globals().asked.pitch == pytest.approx(np.degrees(0.25 * 2.9 / 9.81) * np.cos(1.0), abs=1e-6)


@pytest.mark.parametrize(
    ("happens", "why", "mode"),
    [
        ("lean = 0.5", "attitude beyond the limit", 5),
        ("gyro_x = -3.0", "rate beyond the limit", 5),
        ("off = 3.1", "place beyond the limit", 5),
        ("position = 0", "switch", 4),
        ("mode = 2", "not in Guided mode", 2),
        ("armed = false", "not in Guided mode", 4),
    ],
)
def test_a_limit_and_the_pilot_end_it(happens: str, why: str, mode: int) -> None:
    lua = begun()
    lua.execute(f"now = 7500.0 update() {happens} now = 7510.0 update()")
    assert list(lua.globals().texts.values())[-1] == f"maneuver: ended, {why}"
    assert lua.globals().mode == mode
