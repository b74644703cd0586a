"""What an ArduPilot log says beside its measurements: parameters, modes, messages, arming and sweeps."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.maneuvers.ardupilot_chirp import MOVED, START_DELAY, Chirp
from swashplate.flights.provenance import Event
from swashplate.flights.readers.dataflash import Messages, MessageTable

_COPTER = {
    0: "STABILIZE", 1: "ACRO", 2: "ALT_HOLD", 3: "AUTO", 4: "GUIDED", 5: "LOITER", 6: "RTL", 7: "CIRCLE", 9: "LAND",
    11: "DRIFT", 13: "SPORT", 14: "FLIP", 15: "AUTOTUNE", 16: "POSHOLD", 17: "BRAKE", 18: "THROW", 19: "AVOID_ADSB",
    20: "GUIDED_NOGPS", 21: "SMART_RTL", 22: "FLOWHOLD", 23: "FOLLOW", 24: "ZIGZAG", 25: "SYSTEMID", 26: "AUTOROTATE",
    27: "AUTO_RTL", 28: "TURTLE", 29: "RATE_ACRO",
}  # fmt: skip
_PLANE = {
    0: "MANUAL", 1: "CIRCLE", 2: "STABILIZE", 3: "TRAINING", 4: "ACRO", 5: "FBWA", 6: "FBWB", 7: "CRUISE",
    8: "AUTOTUNE", 10: "AUTO", 11: "RTL", 12: "LOITER", 13: "TAKEOFF", 14: "AVOID_ADSB", 15: "GUIDED",
    16: "INITIALISING", 17: "QSTABILIZE", 18: "QHOVER", 19: "QLOITER", 20: "QLAND", 21: "QRTL", 22: "QAUTOTUNE",
    23: "QACRO", 24: "THERMAL", 25: "LOITER_ALT_QLAND", 26: "AUTOLAND",
}  # fmt: skip
_ROVER = {
    0: "MANUAL", 1: "ACRO", 3: "STEERING", 4: "HOLD", 5: "LOITER", 6: "FOLLOW", 7: "SIMPLE", 8: "DOCK", 9: "CIRCLE",
    10: "AUTO", 11: "RTL", 12: "SMART_RTL", 15: "GUIDED", 16: "INITIALISING",
}  # fmt: skip
_SUB = {
    0: "STABILIZE", 1: "ACRO", 2: "ALT_HOLD", 3: "AUTO", 4: "GUIDED", 7: "CIRCLE", 9: "SURFACE", 16: "POSHOLD",
    19: "MANUAL", 20: "MOTOR_DETECT", 21: "SURFTRAK",
}  # fmt: skip
_TRACKER = {0: "MANUAL", 1: "STOP", 2: "SCAN", 3: "SERVOTEST", 4: "GUIDED", 10: "AUTO", 16: "INITIALISING"}
_FIRMWARES: Mapping[str, Mapping[int, str]] = {
    "copter": _COPTER, "plane": _PLANE, "rover": _ROVER, "sub": _SUB, "tracker": _TRACKER, "blimp": {},
}  # fmt: skip
# "ArduCopter V4.5.7 (abc)", "APM:Plane V3.3", "AntennaTracker V1.1", "Blimp V4.2"
_SAID = re.compile(r"(?:Ardu|AP[A-Z]*:? ?|Antenna ?)?(Copter|Plane|Rover|Sub|Tracker|Blimp) ?V\d", re.IGNORECASE)


def is_firmware(text: str) -> bool:
    """Whether a message of the log is the one in which the firmware says its name and version."""
    return _SAID.match(text) is not None


def mode_name(firmware: str, number: int) -> str:
    """The mode's name in this firmware; its number where the firmware is not known or has no such mode.

    Args:
        firmware: as the log says it: "ArduPlane V4.5.7 (abc)".
    """
    said = _SAID.match(firmware)
    return _FIRMWARES[said[1].lower()].get(number, f"mode {number}") if said else f"mode {number}"


_STATISTICS = "STAT_"  # counters that ArduPilot keeps among its parameters
_EV_ARMED, _EV_DISARMED, _EV_AUTO_ARMED = 10, 11, 15
"""AP_Logger's LogEvent; AUTO_ARMED comes when the throttle is raised, of a helicopter after its run-up: later."""
# SIDS: field of the message -> field of `Chirp`.
_CHIRP = {
    "Mag": "magnitude", "FSt": "start_hz", "FSp": "stop_hz", "TFin": "fade_in", "TC": "dwell", "TR": "record",
    "TFout": "fade_out",
}  # fmt: skip


def seconds(table: MessageTable) -> Array:
    """Time stamps of a table since the autopilot's start [s], NaN where it has none."""
    micro = table.number("TimeUS")
    return micro / 1e6 if np.isfinite(micro).any() else table.number("TimeMS") / 1e3


@dataclass(frozen=True)
class Story:
    """What the log says beside its measurements.

    Attributes:
        vehicle: firmware and frame, as the log names them ("" where it does not). firmware: that alone.
        parameters: as first reported.
        events: in order of time.
        damage: what the story shows to be missing: a flight or a sweep that does not end.
    """

    vehicle: str
    firmware: str
    parameters: dict[str, float]
    events: tuple[Event, ...]
    damage: tuple[str, ...]


def _parameters(messages: Messages) -> tuple[dict[str, float], list[Event]]:
    table = messages.get("PARM")
    first: dict[str, float] = {}
    now: dict[str, float] = {}
    changes = []
    if table is not None:
        rows = zip(seconds(table).tolist(), table.text("Name"), table.number("Value").tolist(), strict=True)
        for time, name, value in rows:
            if not (name and math.isfinite(value) and name.isprintable()):
                continue
            changed = name in now and value != now[name] and not name.startswith(_STATISTICS)
            if changed and math.isfinite(time):
                text = f"{name}: {now[name]:.6g} -> {value:.6g}"
                changes.append(Event(time, "parameter", text, {"name": name, "value": value, "before": now[name]}))
            first.setdefault(name, value)
            now[name] = value
    return first, changes


def _texts(messages: Messages) -> list[Event]:
    table = messages.get("MSG")
    if table is None:
        return []
    said = [field for field in ("Message", "Msg") if field in table.columns][:1] or ["Message"]
    rows = zip(seconds(table).tolist(), table.text(said[0]), strict=True)
    return [Event(time, "message", text) for time, text in rows if math.isfinite(time) and text]


def _modes(messages: Messages, firmware: str) -> list[Event]:
    table = messages.get("MODE")
    if table is None:
        return []
    number = table.number("ModeNum") if "ModeNum" in table.columns else table.number("Mode")
    events: list[Event] = []
    for time, mode, word in zip(seconds(table).tolist(), number.tolist(), table.text("Mode"), strict=True):
        if math.isfinite(time):
            name = mode_name(firmware, int(mode)) if math.isfinite(mode) else word
            if not events or events[-1].text != name:
                events.append(Event(time, "mode", name))
    return events


def _arming(messages: Messages) -> list[Event]:
    changes, raised = list[tuple[float, bool]](), list[float]()
    if (table := messages.get("EV")) is not None:
        number = table.number("Id")
        changes += [(t, True) for t in seconds(table)[number == _EV_ARMED].tolist()]
        changes += [(t, False) for t in seconds(table)[number == _EV_DISARMED].tolist()]
        raised = seconds(table)[number == _EV_AUTO_ARMED].tolist()
    if (table := messages.get("ARM")) is not None:
        changes += list(zip(seconds(table).tolist(), (table.number("ArmState") == 1).tolist(), strict=True))
    if raised and not any(time <= raised[0] for time, _ in changes):  # it was armed before the log began
        first = (seconds(table.rows(np.arange(1))) for table in messages.tables.values())
        changes.append((min(time.item() for time in first if np.isfinite(time).any()), True))
    events: list[Event] = []
    for time, armed in sorted((time, armed) for time, armed in changes if math.isfinite(time)):
        kind = "armed" if armed else "disarmed"
        if not events or events[-1].kind != kind:
            events.append(Event(time, kind, kind))
    return events


_SUBSYSTEMS = {
    1: "main loop", 2: "radio", 3: "compass", 5: "failsafe of the radio", 6: "failsafe of the battery",
    7: "failsafe of GPS", 8: "failsafe of the ground station", 9: "failsafe of the fence", 10: "change of mode refused",
    11: "GPS", 12: "crash check", 13: "flip", 15: "parachute", 16: "EKF check", 17: "failsafe of the EKF",
    18: "barometer", 19: "CPU overload", 21: "terrain data", 22: "navigation", 23: "failsafe of terrain",
    24: "EKF changed its core", 25: "thrust loss", 26: "sensors", 27: "leak", 29: "vibration", 30: "internal error",
    31: "dead reckoning",
}  # fmt: skip
"""ERR.Subsys, as ArduPilot's page "Diagnosing problems using logs" lists it."""
_CODES = {
    (2, 2): "a frame came late", (11, 2): "a glitch", (12, 1): "a crash was detected", (12, 2): "control was lost",
    (13, 2): "abandoned", (15, 2): "too low", (15, 3): "landed", (16, 2): "the variance is bad", (18, 2): "a glitch",
    (21, 2): "missing", (22, 2): "no destination was set", (22, 5): "the destination lies outside the fence",
    **dict.fromkeys(((part, 1) for part in (5, 6, 7, 8, 9, 17, 23, 26, 27, 29, 31)), "began"),
}  # fmt: skip
"""ERR.ECode of a subsystem, as AP_Logger's LogErrorCode names it (ArduPilot 4.6)."""


def _error_text(part: int, code: int) -> str:
    """What an ERR message says. Of a mode that was refused and of the EKF's core the code is a number, 0 included."""
    if part in (10, 24):
        meaning = f"{'mode' if part == 10 else 'core'} {code}"
    else:
        meaning = _CODES.get((part, code), f"code {code}") if code else "over"
    return f"{_SUBSYSTEMS.get(part, f'subsystem {part}')}: {meaning}"


def _errors(messages: Messages) -> list[Event]:
    table = messages.get("ERR")
    if table is None:
        return []
    rows = zip(seconds(table).tolist(), table.number("Subsys").tolist(), table.number("ECode").tolist(), strict=True)
    return [
        Event(time, "error", _error_text(int(part), int(code)))
        for time, part, code in rows
        if math.isfinite(time) and math.isfinite(part) and math.isfinite(code)
    ]


def _sweeps(messages: Messages, end: float) -> tuple[list[Event], list[str]]:
    """Sweeps of the System ID mode, with start and stop on the log's clock, and those that the log does not finish."""
    settings, data = messages.get("SIDS"), messages.get("SIDD")
    events: list[Event] = []
    damage: list[str] = []
    if settings is None:
        return events, damage
    clocks = (np.zeros(0), np.zeros(0)) if data is None else (seconds(data), data.number("Time"))
    begins = seconds(settings)
    last = np.append(begins[1:], math.inf)
    columns = {ours: settings.number(theirs) for theirs, ours in _CHIRP.items()}
    for i, axis in enumerate(settings.number("Ax").tolist()):
        numbers = {name: float(values[i]) for name, values in columns.items()}
        if not math.isfinite(numbers["dwell"]):
            numbers["dwell"] = 0.0  # older firmware has none
        if not all(map(math.isfinite, (axis, begins[i], *numbers.values()))) or numbers["start_hz"] <= 0.0:
            continue
        chirp = Chirp(axis=int(axis), **numbers)
        start, stop = _on_the_clock(clocks, chirp, begins[i], last[i])
        details: dict[str, Any] = {**chirp.as_details(), "start": start, "stop": stop, "seen": min(stop, end)}
        details |= {"channel": MOVED[chirp.axis]} if chirp.axis in MOVED else {}
        text = f"{chirp.axis_name}, {chirp.start_hz:g}-{chirp.stop_hz:g} Hz in {chirp.record:g} s"
        events.append(Event(float(begins[i]), "sweep", text, details))
        reached = _reached(clocks, begins[i], last[i])
        if reached is not None and reached < START_DELAY + chirp.record - 0.1:
            details["seen"] = start + max(0.0, reached - START_DELAY)
            why = "the log is cut off" if last[i] == math.inf and end - details["seen"] < 1.0 else "it was stopped"
            damage.append(
                f"the sweep at {start:.2f} s ({text}) ends after {max(0.0, reached - START_DELAY):.1f} s: {why}"
            )
    return events, damage


def _between(clocks: tuple[Array, Array], start: float, stop: float) -> tuple[Array, Array]:
    """Stamps and the mode's elapsed time [s] of the SIDD messages of one sweep, out of those of all."""
    stamps, elapsed = clocks
    chosen = (stamps >= start) & (stamps < stop) & np.isfinite(elapsed)
    return stamps[chosen], elapsed[chosen]


def _on_the_clock(clocks: tuple[Array, Array], chirp: Chirp, begin: float, until: float) -> tuple[float, float]:
    """Start and stop of the chirp on the log's clock: the mode's own time runs by loop counts, a little off it."""
    stamps, elapsed = _between(clocks, begin, until)
    start, stop = begin + START_DELAY, begin + START_DELAY + chirp.record
    if elapsed.size > 1 and np.all(np.diff(elapsed) > 0.0) and elapsed[0] <= START_DELAY <= elapsed[-1]:
        start = float(np.interp(START_DELAY, elapsed, stamps))
        ends = START_DELAY + chirp.record
        stop = float(np.interp(ends, elapsed, stamps)) if elapsed[-1] >= ends else start + chirp.record
    return start, stop


def _reached(clocks: tuple[Array, Array], begin: float, until: float) -> float | None:
    """How far the mode's own time came [s]; None where it is not logged."""
    _, elapsed = _between(clocks, begin, until)
    return float(elapsed.max()) if elapsed.size else None


def _firmware(messages: Messages, texts: list[Event]) -> str:
    """The firmware's name and version as the log says it, in a message or in VER; "" where it does not."""
    version = messages.get("VER")
    said = [*(event.text for event in texts), *(version.text("FWS") if version is not None else ())]
    return next(filter(is_firmware, said), "")


def _vehicle(firmware: str, texts: list[Event]) -> str:
    frame = next((e.text.partition(":")[2].strip() for e in texts if e.text.startswith("Frame:")), "")
    return ", ".join(part for part in (firmware, frame) if part)


def story(messages: Messages, *, end: float) -> Story:
    """The story of a log.

    Args:
        messages: of one run of the autopilot.
        end: its last time stamp [s].
    """
    parameters, changes = _parameters(messages)
    texts, arming = _texts(messages), _arming(messages)
    firmware = _firmware(messages, texts)
    sweeps, damage = _sweeps(messages, end)
    if arming and arming[-1].kind == "armed":
        damage.append(f"the log is cut off: it ends at {end:.2f} s with the motors armed since {arming[-1].time:.2f} s")
    events = sorted(
        (*changes, *texts, *_modes(messages, firmware), *_errors(messages), *arming, *sweeps),
        key=lambda event: event.time,
    )
    return Story(_vehicle(firmware, texts), firmware, parameters, tuple(events), tuple(damage))
