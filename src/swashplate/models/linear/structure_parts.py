"""The parts that a structure of a helicopter is composed of: cores, rotor, inflow, engine, gyro, actuators.

A part says which states it adds, what it adds to which equation, which entries of other parts it stands for, and which
numbers it needs. Axes are body axes (w down); a: tip-path plane tilted back, b: to the right.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

Equations = Mapping[str, Mapping[str, str]]


@dataclass(frozen=True)
class StartNumber:
    """A parameter of a part: start value, unit, bounds, and where the start value comes from."""

    value: float
    unit: str
    source: str
    lower: float | None = None
    upper: float | None = None


@dataclass(frozen=True)
class StructurePart:
    """One part.

    Attributes:
        about: what it is, in a line.
        states: units by name.
        equations: right sides, by state: expressions before states and inputs. What has no place is left out.
        left: left sides.
        replaces: entries (row, column) of other parts that it stands for.
        core: whether a structure may begin with it.
        needs: one of these must be there. excludes: parts that it cannot stand beside, with the reason.
        why: what is wrong where `needs` is not met.
        holds: where the part may be believed.
    """

    about: str
    states: Mapping[str, str] = field(default_factory=dict)
    equations: Equations = field(default_factory=dict)
    left: Equations = field(default_factory=dict)
    replaces: tuple[tuple[str, str], ...] = ()
    core: bool = False
    needs: tuple[str, ...] = ()
    why: str = ""
    excludes: Mapping[str, str] = field(default_factory=dict)
    holds: str = ""


INPUTS = {"lateral": "1", "longitudinal": "1", "pedal": "1", "collective": "1"}

SPEEDS, RATES = ("u", "v", "w"), ("p", "q", "r")

SHORT = {"lateral": "lat", "longitudinal": "lon", "pedal": "ped", "collective": "col"}

_LETTER = {"u": "X", "v": "Y", "w": "Z", "p": "L", "q": "M", "r": "N"}

_CYCLIC = ("lateral", "longitudinal")
_OF_ROTOR = (
    *((row, column) for row in ("p", "q") for column in ("p", "q", *_CYCLIC)),
    *((row, column) for row in SPEEDS for column in ("p", "q", *_CYCLIC)),
)
"""What the tip-path plane makes of rates and cyclic, so that nothing is left for quasi-steady derivatives."""


def _derivatives(row: str, columns: tuple[str, ...]) -> dict[str, str]:
    return {column: _LETTER[row] + SHORT.get(column, column) for column in columns}


_KINEMATICS = {
    "u": {"q": "-W0", "r": "V0", "theta": "-g"},
    "v": {"p": "W0", "r": "-U0", "phi": "g"},
    "w": {"p": "-V0", "q": "U0", "phi": "-g * phi0", "theta": "-g * theta0"},
    "phi": {"p": "1", "r": "theta0"},
    "theta": {"q": "1", "r": "-phi0"},
}

_BODY = {
    "u": ("u", "longitudinal"),
    "v": ("v", "lateral", "pedal"),
    "w": ("w", "collective"),
    "p": ("u", "v", "w", "p", "q", "lateral", "longitudinal", "pedal", "collective"),
    "q": ("u", "v", "w", "p", "q", "lateral", "longitudinal", "collective"),
    "r": ("v", "w", "p", "r", "pedal", "collective"),
}
_EVERY = (*SPEEDS, *RATES, *INPUTS)
_BODY_STATES = {
    "u": "m/s", "v": "m/s", "w": "m/s", "p": "rad/s", "q": "rad/s", "r": "rad/s", "phi": "rad", "theta": "rad"
}  # fmt: skip

_ONE_ROTOR = "the tip-path plane is there already; take one of the two"
_HUB = {
    "p": {"b": "Lb"},
    "q": {"a": "Ma"},
    "u": {"a": "-g"},
    "v": {"b": "g"},
}
_ROTOR_WHY = "it belongs to a rotor whose tip-path plane is a state"

PARTS: Mapping[str, StructurePart] = {
    "body": StructurePart(
        "rigid body, six degrees of freedom, the usual quasi-steady derivatives",
        states=_BODY_STATES,
        equations={row: {**_KINEMATICS.get(row, {}), **_derivatives(row, _BODY.get(row, ()))} for row in _BODY_STATES},
        core=True,
        excludes=dict.fromkeys(("cyclic", "heave", "yaw"), "'body' has that axis already"),
        holds="about a steady flight at small attitudes",
    ),
    "cyclic": StructurePart(
        "roll and pitch rate alone",
        states={"p": "rad/s", "q": "rad/s"},
        equations={row: _derivatives(row, ("p", "q", *_CYCLIC)) for row in ("p", "q")},
        core=True,
        holds="above the frequencies of speed stability",
    ),
    "heave": StructurePart(
        "vertical speed alone",
        states={"w": "m/s"},
        equations={"w": _derivatives("w", ("w", "collective"))},
        core=True,
    ),
    "yaw": StructurePart(
        "yaw rate alone",
        states={"r": "rad/s"},
        equations={"r": _derivatives("r", ("r", "pedal", "collective"))},
        core=True,
    ),
    "coupled": StructurePart(
        "every quasi-steady derivative of the body, not the usual ones alone",
        equations={row: _derivatives(row, tuple(c for c in _EVERY if c not in _BODY[row])) for row in _BODY},
        needs=("body",),
        why="its derivatives are those of all six degrees of freedom",
        excludes={"gyroscopic": "'coupled' has Lq and Mp already"},
    ),
    "flap": StructurePart(
        "main rotor's tip-path plane (a, b), first order, roll and pitch coupled; tilts the thrust and turns the body",
        states={"a": "rad", "b": "rad"},
        equations={
            **_HUB,
            "a": {"q": "-tau_f", "a": "-1", "b": "Ab", "lateral": "Alat", "longitudinal": "Alon"},
            "b": {"p": "-tau_f", "b": "-1", "a": "Ba", "lateral": "Blat", "longitudinal": "Blon"},
        },
        left={"a": {"a": "tau_f"}, "b": {"b": "tau_f"}},
        replaces=_OF_ROTOR,
        needs=("body", "cyclic"),
        why="a rotor flaps with roll and pitch",
        excludes={"flap_decoupled": _ONE_ROTOR},
        holds="below one rotor revolution",
    ),
    "flap_decoupled": StructurePart(
        "the same without coupling of roll and pitch: a follows longitudinal, b lateral",
        states={"a": "rad", "b": "rad"},
        equations={
            **_HUB,
            "a": {"q": "-tau_f", "a": "-1", "longitudinal": "Alon"},
            "b": {"p": "-tau_f", "b": "-1", "lateral": "Blat"},
        },
        left={"a": {"a": "tau_f"}, "b": {"b": "tau_f"}},
        replaces=_OF_ROTOR,
        needs=("body", "cyclic"),
        why="a rotor flaps with roll and pitch",
        excludes={"flap": _ONE_ROTOR},
        holds="below one rotor revolution",
    ),
    "forces": StructurePart(
        "specific forces of the tip-path plane free (Xa, Yb), not tied to gravity",
        equations={"u": {"a": "Xa"}, "v": {"b": "Yb"}},
        replaces=(("u", "a"), ("v", "b")),
        needs=("flap", "flap_decoupled"),
        why=_ROTOR_WHY,
    ),
    "hub": StructurePart(
        "hub moments across the axes (La, Mb)",
        equations={"p": {"a": "La"}, "q": {"b": "Mb"}},
        needs=("flap", "flap_decoupled"),
        why=_ROTOR_WHY,
    ),
    "gyroscopic": StructurePart(
        "moments of a rate across the axes beside the rotor's (Lq, Mp)",
        equations={"p": {"q": "Lq"}, "q": {"p": "Mp"}},
        needs=("flap", "flap_decoupled"),
        why="without a rotor's states the core has Lq and Mp already",
    ),
    "bar": StructurePart(
        "stabilizer bar (c, d), mixed into the cyclic of a flapping rotor",
        states={"c": "rad", "d": "rad"},
        equations={
            "a": {"c": "Ac"},
            "b": {"d": "Bd"},
            "c": {"q": "-tau_s", "c": "-1", "longitudinal": "Clon"},
            "d": {"p": "-tau_s", "d": "-1", "lateral": "Dlat"},
        },
        left={"c": {"c": "tau_s"}, "d": {"d": "tau_s"}},
        needs=("flap", "flap_decoupled"),
        why="a bar tilts a rotor that flaps",
    ),
    "inflow": StructurePart(
        "induced velocity nu as a state, Pitt-Peters form in hover: thrust feels w - nu, and moves the air",
        states={"nu": "m/s"},
        equations={
            "w": {"nu": "-Zw"},
            "nu": {
                "w": "0.5 * rate_nu - mass_nu * Zw",
                "nu": "mass_nu * Zw - rate_nu",
                "collective": "-mass_nu * Zcol",
            },
        },
        needs=("body", "heave"),
        why="inflow shows in vertical speed",
        excludes={"lead": "both stand for the inflow's lag behind thrust"},
        holds="in hover; Zw is that of a frozen inflow",
    ),
    "lead": StructurePart(
        "collective to thrust by a lead-lag of first order: a stand-in for inflow and coning of any kind",
        states={"col_lag": "1"},
        equations={"w": {"col_lag": "Zlag"}, "col_lag": {"col_lag": "-rate_lag", "collective": "rate_lag"}},
        needs=("body", "heave"),
        why="inflow shows in vertical speed",
        excludes={"inflow": "both stand for the inflow's lag behind thrust"},
    ),
    "torque": StructurePart(
        "engine: part of the main rotor's reaction follows collective by a lag of first order",
        states={"torque": "rad/s^2"},
        equations={"r": {"torque": "1"}, "torque": {"torque": "-rate_q", "collective": "Kq"}},
        needs=("body", "yaw"),
        why="torque shows in yaw",
    ),
    "droop": StructurePart(
        "rotor speed (relative) sags with collective; thrust goes with its square, in hover",
        states={"omega": "1"},
        equations={
            "w": {"omega": "-2 * g"},
            "r": {"omega": "Nomega"},
            "omega": {"omega": "-rate_omega", "collective": "Komega"},
        },
        needs=("body", "heave"),
        why="a slower rotor shows in vertical speed",
        holds="in hover",
    ),
    "gyro": StructurePart(
        "yaw-rate gyro loop inside the aircraft: what its filter has integrated is fed to the tail",
        states={"r_fb": "rad"},
        equations={"r": {"r_fb": "Nrfb"}, "r_fb": {"r": "1", "r_fb": "-Krfb"}},
        needs=("body", "yaw"),
        why="it is fed by the yaw rate",
    ),
    "actuators": StructurePart(
        "first-order lags of the actuators: one time constant for swashplate and collective, one for the tail",
        states={},
    ),
}
"""The parts by name, in the order in which they are put together."""

SERVO = {"lateral": "tau_servo", "longitudinal": "tau_servo", "collective": "tau_servo", "pedal": "tau_tail"}
"""Time constant of each input's actuator."""

_R50 = "that of a 50 kg helicopter (R-50: Mettler, Tischler and Kanade 1999), rounded"
_ORDER = "an order of magnitude for helicopters of 5 to 100 kg"
_ZERO = "not known: begins at zero"
_G = "standard gravity"
_TRIM = "hover; from the flights' means, or given"
_INFLOW = "rate 4 rho A v / m_air, m_air = 8/3 rho R^3 (Pitt and Peters 1981), for R 1.5 m, v 5 m/s"
_MASS = "helicopter's mass over the air's, 8/3 rho R^3 (Pitt and Peters 1981), for 50 kg, R 1.5 m"

NUMBERS: Mapping[str, StartNumber] = {
    "g": StartNumber(9.80665, "m/s^2", _G),
    **{name: StartNumber(0.0, "m/s", _TRIM) for name in ("U0", "V0", "W0")},
    **{name: StartNumber(0.0, "rad", _TRIM) for name in ("phi0", "theta0")},
    "Xu": StartNumber(-0.05, "1/s", _R50), "Yv": StartNumber(-0.15, "1/s", _R50), "Zw": StartNumber(-0.6, "1/s", _R50),
    "Lu": StartNumber(-0.5, "rad/(m s)", _ORDER), "Lv": StartNumber(0.5, "rad/(m s)", _ORDER),
    "Mu": StartNumber(-0.2, "rad/(m s)", _ORDER), "Mv": StartNumber(-0.2, "rad/(m s)", _ORDER),
    "Nv": StartNumber(0.1, "rad/(m s)", _ORDER), "Nr": StartNumber(-4.0, "1/s", _ORDER),
    "Lp": StartNumber(-8.0, "1/s", _R50), "Mq": StartNumber(-4.0, "1/s", _R50),
    "Xlon": StartNumber(-9.0, "m/s^2", _ORDER), "Ylat": StartNumber(9.0, "m/s^2", _ORDER),
    "Llat": StartNumber(30.0, "rad/s^2", _ORDER), "Mlon": StartNumber(15.0, "rad/s^2", _ORDER),
    "Nped": StartNumber(30.0, "rad/s^2", _ORDER), "Zcol": StartNumber(-14.0, "m/s^2", _ORDER),
    "Lb": StartNumber(166.0, "1/s^2", _R50, lower=0.0), "Ma": StartNumber(83.0, "1/s^2", _R50, lower=0.0),
    "tau_f": StartNumber(0.046, "s", _R50, 0.002, 1.0),
    "Ab": StartNumber(-0.2, "1", _R50), "Ba": StartNumber(0.35, "1", _R50),
    "Alat": StartNumber(0.03, "rad", _R50), "Alon": StartNumber(-0.1, "rad", _R50),
    "Blat": StartNumber(0.14, "rad", _R50), "Blon": StartNumber(0.014, "rad", _R50),
    "Xa": StartNumber(-9.8, "m/s^2", "thrust that carries the weight, tilted"),
    "Yb": StartNumber(9.8, "m/s^2", "thrust that carries the weight, tilted"),
    "La": StartNumber(0.0, "1/s^2", _ZERO), "Mb": StartNumber(0.0, "1/s^2", _ZERO),
    "tau_s": StartNumber(0.34, "s", _R50, 0.02, 3.0),
    "Ac": StartNumber(0.64, "1", _R50), "Bd": StartNumber(0.71, "1", _R50),
    "Clon": StartNumber(-0.26, "rad", _R50), "Dlat": StartNumber(0.27, "rad", _R50),
    "rate_nu": StartNumber(16.0, "1/s", _INFLOW, 0.1, 500.0), "mass_nu": StartNumber(4.5, "1", _MASS, 0.01, 1000.0),
    "Zlag": StartNumber(5.0, "m/s^2", _ORDER), "rate_lag": StartNumber(10.0, "1/s", _ORDER, 0.1, 100.0),
    "Kq": StartNumber(5.0, "rad/s^3", _ORDER), "rate_q": StartNumber(3.0, "1/s", _ORDER, 0.05, 50.0),
    "Nomega": StartNumber(0.0, "rad/s^2", _ZERO), "Komega": StartNumber(-0.3, "1/s", _ORDER),
    "rate_omega": StartNumber(1.0, "1/s", _ORDER, 0.05, 50.0),
    "Nrfb": StartNumber(-50.0, "1/s^2", _ORDER), "Krfb": StartNumber(8.0, "1/s", _ORDER, lower=0.01),
    "tau_servo": StartNumber(0.04, "s", "a usual servo", 0.002, 0.5),
    "tau_tail": StartNumber(0.03, "s", "a usual servo", 0.002, 0.5),
    **{f"tau_{short}": StartNumber(0.02, "s", "links and computers", 0.0, 0.5) for short in SHORT.values()},
}  # fmt: skip
"""Start values that are known by name; a derivative that is not here begins at zero."""

HELD = ("g", "U0", "V0", "W0", "phi0", "theta0")


def number(name: str) -> StartNumber:
    """The start value of a parameter; quasi-steady derivatives that have none begin at zero."""
    if name in NUMBERS:
        return NUMBERS[name]
    if name.startswith("tau_"):  # of one response
        return NUMBERS[f"tau_{name.rpartition('_')[2]}"]
    of_force, column = name[0] in "XYZ", name[1:]
    if column in SHORT.values():
        return StartNumber(0.0, "m/s^2" if of_force else "rad/s^2", _ZERO)
    if column in SPEEDS:
        return StartNumber(0.0, "1/s" if of_force else "rad/(m s)", _ZERO)
    assert column in RATES, name
    return StartNumber(0.0, "m/s" if of_force else "1/s", _ZERO)
