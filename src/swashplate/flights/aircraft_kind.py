"""What kind of aircraft a log says it is of: how many rotors carry it, and whether one of them is a main rotor.

Autopilots name their firmware and their frame, or have a parameter for it; other logs have the motors' channels. Where
a log says nothing, nothing is assumed. Sources: ArduPilot's FRAME_CLASS and the frame in its first messages, PX4's
CA_AIRFRAME and MAVLink's MAV_TYPE.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

from swashplate.flights.flight import Flight


@dataclass(frozen=True)
class AircraftKind:
    """What carries an aircraft.

    Attributes:
        noun: what it is, with its article.
        main_rotors: of a helicopter; 0 where it has none. coaxial: whether they share an axis.
        multirotor: whether rotors alone carry it, none of which is a main rotor.
        rotors: of a multirotor; 0 where the log does not say how many.
        source: what the log says that shows it.
    """

    noun: str
    main_rotors: int = 0
    coaxial: bool = False
    multirotor: bool = False
    rotors: int = 0
    source: str = ""

    @property
    def made_for(self) -> str:
        """What is made for it here and what is not, in a sentence; "" for those that everything is made for."""
        if self.main_rotors:
            return ""
        looked = "is read, checked and plotted, and its rate loops, filters, noise and incidents are told"
        if self.multirotor:
            return f"{self.noun}: it {looked}; sweeps give responses and gains. Models from geometry are of helicopters"
        return f"{self.noun}: it {looked}. Models and gains are made here for helicopters and multirotors only"


def _rotors(number: int) -> AircraftKind:
    return AircraftKind(f"a multirotor with {number} rotors", multirotor=True, rotors=number)


_HELICOPTER = AircraftKind("a helicopter", main_rotors=1)
_COAXIAL = AircraftKind("a coaxial helicopter", main_rotors=2, coaxial=True)
_TWO, _FOUR = (AircraftKind(f"a helicopter with {n} main rotors", main_rotors=n) for n in (2, 4))
_PLANE, _VTOL = AircraftKind("a plane"), AircraftKind("a plane that takes off vertically")
_ROVER, _BOAT, _SUB = AircraftKind("a rover"), AircraftKind("a boat"), AircraftKind("a submarine")
_FIRMWARES: Mapping[str, AircraftKind] = {
    r"Plane": _PLANE, r"Rover": _ROVER, r"Sub": _SUB, r"Blimp": AircraftKind("a blimp"),
    r"Tracker": AircraftKind("an antenna tracker"),
}  # fmt: skip
"""By the word behind Ardu or APM in a firmware's name. ArduCopter flies several kinds: its frame says which."""
_FRAMES: Mapping[str, AircraftKind] = {
    "QUAD": _rotors(4), "HEXA": _rotors(6), "Y6": _rotors(6), "OCTA": _rotors(8),
    "OCTA_QUAD": _rotors(8), "DODECA_HEXA": _rotors(12), "DECA": _rotors(10), "TRI": _rotors(3),
    "HELI": _HELICOPTER, "HELI_DUAL": _TWO, "HELI_QUAD": _FOUR, "COAX": _COAXIAL,
    "SINGLE": AircraftKind("a single copter", main_rotors=1),
}  # fmt: skip
_CLASSES: Mapping[int, str] = {
    1: "QUAD", 2: "HEXA", 3: "OCTA", 4: "OCTA_QUAD", 5: "Y6", 6: "HELI", 7: "TRI", 8: "SINGLE", 9: "COAX",
    11: "HELI_DUAL", 12: "DODECA_HEXA", 13: "HELI_QUAD", 14: "DECA",
}  # fmt: skip
_CONTROL_ALLOCATION: Mapping[int, AircraftKind] = {
    1: _PLANE, 2: _VTOL, 3: _VTOL, 4: _VTOL, 5: _ROVER, 6: _ROVER, 10: _HELICOPTER, 11: _HELICOPTER, 12: _COAXIAL,
    13: _ROVER,
}  # fmt: skip
_MAV_TYPES: Mapping[int, AircraftKind] = {
    1: _PLANE, 2: _rotors(4), 3: _COAXIAL, 4: _HELICOPTER, 10: _ROVER, 11: _BOAT, 12: _SUB, 13: _rotors(6),
    14: _rotors(8), 15: _rotors(3), 29: _rotors(12), 35: _rotors(10),
    **dict.fromkeys(range(19, 26), _VTOL),
}  # fmt: skip
_LEAST = 3
"""Motors from which on an aircraft with numbered motors is a multirotor."""


def aircraft_kind(flight: Flight) -> AircraftKind | None:
    """What the log says that flew; None where it does not."""
    said = flight.provenance
    kind = _ardupilot(said.vehicle, said.parameters) if said.reader in ("ardupilot", "tlog") else None
    if said.reader == "tlog" and not said.parameters.get("Q_ENABLE"):
        kind = _of_parameter(said.parameters, "MAV_TYPE", _MAV_TYPES) or kind
    if said.reader in ("ulog", "px4log"):
        kind = _of_parameter(said.parameters, "CA_AIRFRAME", _CONTROL_ALLOCATION)
        kind = kind or _of_parameter(said.parameters, "MAV_TYPE", _MAV_TYPES)
    if said.reader == "blackbox" and re.search(r"\brotorflight\b", said.vehicle, re.IGNORECASE):
        kind = (_HELICOPTER, said.vehicle)
    kind = kind or _of_motors(flight)
    if kind is None and said.reader == "blackbox" and re.search(r"\bbetaflight\b", said.vehicle, re.IGNORECASE):
        kind = (AircraftKind("a multirotor", multirotor=True), said.vehicle)
    return None if kind is None else replace(kind[0], source=kind[1])


Told = tuple[AircraftKind, str]


def _ardupilot(vehicle: str, parameters: Mapping[str, float]) -> Told | None:
    firmware, _, frame = vehicle.partition(",")
    kind = re.match(r"(?:Ardu|APM|AP)\W*(\w+)", firmware)
    if kind is None:
        return None
    if parameters.get("Q_ENABLE", 0.0) > 0.0:
        return _VTOL, f"{firmware}, Q_ENABLE"
    if kind[1] == "Rover" and parameters.get("FRAME_CLASS") == 2:
        return _BOAT, f"{firmware}, FRAME_CLASS 2"
    if kind[1] in _FIRMWARES:
        return _FIRMWARES[kind[1]], firmware
    if (named := frame.strip().partition("/")[0].upper()) in _FRAMES:
        return _FRAMES[named], vehicle
    number = int(parameters.get("FRAME_CLASS", 0.0))
    return (_FRAMES[_CLASSES[number]], f"FRAME_CLASS {number}") if number in _CLASSES else None


def _of_parameter(parameters: Mapping[str, float], name: str, kinds: Mapping[int, AircraftKind]) -> Told | None:
    number = int(parameters.get(name, -1.0))
    return (kinds[number], f"{name} {number}") if number in kinds else None


def _of_motors(flight: Flight) -> Told | None:
    """By the motors that the schema numbers, or names of coaxial rotors."""
    numbers = [int(match[1]) for name in flight.channels if (match := re.fullmatch(r"motor_(\d{1,2})", name))]
    if numbers and max(numbers) >= _LEAST:
        return _rotors(max(numbers)), f"motor_1 to motor_{max(numbers)}"
    pair = [name for name in ("motor_lower", "motor_upper", "omega_lower", "omega_upper") if name in flight]
    return (_COAXIAL, " and ".join(pair[:2])) if len(pair) > 1 else None
