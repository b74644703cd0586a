"""A designed multisine as a Lua script for ArduPilot's Copter firmwares, where its chirp cannot fly it.

The script asks for angles: `vehicle:set_target_angle_and_climbrate` in Guided mode, from ArduPilot's own list of
scripting functions (libraries/AP_Scripting/docs/docs.lua). No scripting function adds to what the mixer gets, and
overriding sticks switches the failsafe of the radio off. So the lines are those of the motion, which the autopilot
follows as far as its attitude loop reaches.
"""

from __future__ import annotations

from collections.abc import Mapping

FASTEST = 3.0
"""Hz: an attitude loop of a small aircraft does not follow angles that are faster."""
LEAD = 2.0
"""Seconds in which the signal fades in before its period, and out after it."""
TURNED = ("roll", "pitch", "yaw")
"""Axes that are asked for as angles [rad]; "heave" as a rate of climb [m/s]."""

Lines = Mapping[str, tuple[tuple[int, float, float], ...]]
"""Harmonic number of the period, amplitude, phase of the cosine [rad], by axis."""


def ardupilot_script(lines: Lines, *, duration: float, limits: Mapping[str, float], title: str) -> str:
    """The text of the script.

    Args:
        lines: of the angles [rad] and of the rate of climb [m/s].
        duration: one period [s].
        limits: attitude [deg], rate [deg/s] and place [m] at which it gives the aircraft back.
        title: said when it begins.
    """
    tables = []
    for axis in (*TURNED, "heave"):
        scale = 57.29577951308232 if axis in TURNED else 1.0
        rows = ", ".join(f"{{{n}, {scale * a:.6g}, {p:.6g}}}" for n, a, p in lines.get(axis, ()))
        tables.append(f"  {axis} = {{{rows}}},")
    quoted = title.replace("\\", " ").replace("'", " ").replace("\n", " ")
    return _SCRIPT.format(
        title=quoted,
        tables="\n".join(tables),
        duration=repr(float(duration)),
        lead=repr(LEAD),
        attitude=repr(float(limits["attitude"])),
        rate=repr(float(limits["rate"])),
        place=repr(float(limits["place"])),
    )


_SCRIPT = """-- {title}
-- For ArduPilot's Copter and Heli firmwares with scripting (SCR_ENABLE 1); put it into APM/scripts.
--
-- RCn_OPTION 300 (Scripting1) is the switch. Hover in Guided mode, then put the switch high: the maneuver begins.
-- Switch low, another mode, disarming, or a limit below ends it; after a limit the mode becomes Loiter.
-- The place is held softly during the maneuver (lean of at most 5 degrees). The pilot keeps a thumb on the mode switch.
-- Log: LOG_BITMASK with fast attitude and motors, so that what the loops made of it is in the log.

local LINES = {{  -- harmonic number, amplitude [deg, heave m/s], phase [rad]
{tables}
}}
local DURATION, LEAD = {duration}, {lead}            -- s
local ATTITUDE, RATE, PLACE = {attitude}, {rate}, {place}  -- deg, deg/s, m
local GUIDED, LOITER, OPTION = 4, 5, 300
local begun, ready, start = nil, false, {{}}

local function say(text) gcs:send_text(5, 'maneuver: ' .. text) end

local function angle(name)  -- newer firmwares call it get_roll_rad
  local ok, value = pcall(function() return ahrs['get_' .. name .. '_rad'](ahrs) end)
  if not ok then value = ahrs['get_' .. name](ahrs) end
  return math.deg(value)
end

local function sum(lines, t)
  local total = 0.0
  for _, line in ipairs(lines) do
    total = total + line[2] * math.cos(2.0 * math.pi * line[1] * t / DURATION + line[3])
  end
  return total
end

local function fade(t)  -- 0 to 1 within LEAD before the period, back within LEAD after it
  local part = math.min(1.0, (t + LEAD) / LEAD, (DURATION + LEAD - t) / LEAD)
  return 0.5 - 0.5 * math.cos(math.pi * math.max(0.0, part))
end

local function stop(why, mode)
  if begun then say('ended, ' .. why) end
  begun, ready = nil, false
  if mode then vehicle:set_mode(mode) end
end

local function clipped(value, most) return math.max(-most, math.min(most, value)) end

function update()
  local switch = rc:find_channel_for_option(OPTION)
  local high = switch and switch:get_aux_switch_pos() == 2
  if not high then
    if begun then vehicle:set_target_angle_and_climbrate(0, 0, start.yaw, 0, false, 0) end
    stop('switch')
    ready = switch ~= nil  -- it was low once: high now means begin
    return update, 100
  end
  if not (arming:is_armed() and vehicle:get_mode() == GUIDED) then
    stop('not in Guided mode')
    return update, 100
  end
  local place, speed = ahrs:get_relative_position_NED_home(), ahrs:get_velocity_NED()
  if not (place and speed) then
    stop('no position', LOITER)
    return update, 100
  end
  if not begun then
    if not ready then return update, 100 end
    begun, ready = millis():tofloat(), false
    start = {{north = place:x(), east = place:y(), yaw = angle('yaw'), roll = angle('roll'), pitch = angle('pitch')}}
    say('{title}')
  end
  local t = 0.001 * (millis():tofloat() - begun) - LEAD
  if t > DURATION + LEAD then
    vehicle:set_target_angle_and_climbrate(start.roll, start.pitch, start.yaw, 0, false, 0)
    stop('complete', LOITER)
    return update, 100
  end
  local north, east = place:x() - start.north, place:y() - start.east
  local gyro = ahrs:get_gyro()
  local fastest = math.deg(math.max(math.abs(gyro:x()), math.abs(gyro:y()), math.abs(gyro:z())))
  local off = math.max(math.abs(angle('roll') - start.roll), math.abs(angle('pitch') - start.pitch))
  if off > ATTITUDE then stop('attitude beyond the limit', LOITER) return update, 100 end
  if fastest > RATE then stop('rate beyond the limit', LOITER) return update, 100 end
  if math.sqrt(north * north + east * east) > PLACE then stop('place beyond the limit', LOITER) return update, 100 end
  -- Acceleration that brings it back, in the axes of the heading; 9.81 m/s^2 are one radian of lean.
  local back_n, back_e = -0.25 * north - 0.9 * speed:x(), -0.25 * east - 0.9 * speed:y()
  local c, s = math.cos(math.rad(start.yaw)), math.sin(math.rad(start.yaw))
  local ahead, right = c * back_n + s * back_e, c * back_e - s * back_n
  local share = fade(t)
  vehicle:set_target_angle_and_climbrate(
    start.roll + share * sum(LINES.roll, t) + clipped(math.deg(right / 9.81), 5.0),
    start.pitch + share * sum(LINES.pitch, t) - clipped(math.deg(ahead / 9.81), 5.0),
    start.yaw + share * sum(LINES.yaw, t), share * sum(LINES.heave, t), false, 0)
  return update, 10
end

return update, 1000
"""
