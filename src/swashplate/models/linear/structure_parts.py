"""The parts that a structure of a helicopter is composed of: cores, rotor, inflow, engine, gyro, actuators.

A part says which states it adds, what it adds to which equation, which entries of a core it stands for, and which
numbers it needs. A single derivative (Xv, La, Zb) is a part of its own. Axes are body axes (w down); a: tip-path plane
tilted back, b: to the right.
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
        replaces: entries (row, column) of parts before it that it stands for.
        core: whether a structure may begin with it.
        needs: one of these must be there. excludes: parts that it cannot stand beside, with the reason. That another
            part has the same entries already is no reason to be given here: `composition.nonsense` looks.
        why: what is wrong where `needs` is not met.
        absent: numbers with which it does nothing, so that a structure with it answers as one without it.
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
    absent: Mapping[str, float] = field(default_factory=dict)
    holds: str = ""


INPUTS = {"lateral": "1", "longitudinal": "1", "pedal": "1", "collective": "1"}

SPEEDS, RATES = ("u", "v", "w"), ("p", "q", "r")

SHORT = {"lateral": "lat", "longitudinal": "lon", "pedal": "ped", "collective": "col"}

LETTERS = {"X": "u", "Y": "v", "Z": "w", "L": "p", "M": "q", "N": "r", "A": "a", "B": "b"}
"""Which equation a derivative stands in, by its first letter: of the body, or of the tip-path plane."""

_ANGLES = {"a": "a", "b": "b", "c": "c", "d": "d", "rfb": "r_fb"}
COLUMNS = {n: n for n in (*SPEEDS, *RATES)} | _ANGLES | {short: name for name, short in SHORT.items()}
"""What a derivative is by, by the rest of its name: motion, tilts of the rotor and its bar, the yaw gyro, inputs."""

GRAVITY = 9.80665
"""m/s^2: what a tip-path plane that carries the weight tilts."""

_LETTER = {row: letter for letter, row in LETTERS.items()}
_REST = {column: rest for rest, column in COLUMNS.items()}
_CYCLIC = ("lateral", "longitudinal")
_OF_ROTOR = (
    *((row, column) for row in ("p", "q") for column in ("p", "q", *_CYCLIC)),
    ("u", "longitudinal"),
    ("v", "lateral"),
)
"""What the tip-path plane makes of rates and cyclic, so that nothing is left for the core's derivatives."""

_ITS_OWN = (("p", "p"), ("q", "q"), ("p", "lateral"), ("q", "longitudinal"), ("u", "longitudinal"), ("v", "lateral"))
"""What remains the rotor's where every derivative is asked for: an axis by its own rate and its own stick."""


_KINEMATIC = (("a", "a"), ("a", "q"), ("b", "b"), ("b", "p"))
"""Entries of the tip-path plane that are what it is, and no derivatives."""


def entry_of(name: str) -> tuple[str, str] | None:
    """Equation and column of a derivative by its name: ("p", "a") of "La"; None for what is no derivative."""
    row, column = LETTERS.get(name[:1]), COLUMNS.get(name[1:])
    return None if row is None or column is None or (row, column) in _KINEMATIC else (row, column)


DERIVATIVES = tuple(letter + rest for letter in LETTERS for rest in COLUMNS if entry_of(letter + rest) is not None)
"""The names of all derivatives, by equation and column."""


def derivative_of(row: str, column: str) -> str:
    """The name of a derivative: "La" of ("p", "a")."""
    return _LETTER[row] + _REST[column]


def _derivatives(row: str, columns: tuple[str, ...]) -> dict[str, str]:
    return {column: derivative_of(row, column) for column in columns}


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
        absent={"Ab": 0.0, "Ba": 0.0, "Alat": 0.0, "Blon": 0.0},
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
        holds="below one rotor revolution",
    ),
    "forces": StructurePart(
        "specific forces of the tip-path plane free (Xa, Yb), not tied to gravity",
        equations={"u": {"a": "Xa"}, "v": {"b": "Yb"}},
        replaces=(("u", "a"), ("v", "b")),
        needs=("flap", "flap_decoupled"),
        why=_ROTOR_WHY,
        absent={"Xa": -GRAVITY, "Yb": GRAVITY},
    ),
    "hub": StructurePart(
        "hub moments across the axes (La, Mb)",
        equations={"p": {"a": "La"}, "q": {"b": "Mb"}},
        needs=("flap", "flap_decoupled"),
        why=_ROTOR_WHY,
        absent={"La": 0.0, "Mb": 0.0},
    ),
    "gyroscopic": StructurePart(
        "moments of a rate across the axes beside the rotor's (Lq, Mp)",
        equations={"p": {"q": "Lq"}, "q": {"p": "Mp"}},
        needs=("body", "cyclic"),
        why="it couples roll and pitch",
        absent={"Lq": 0.0, "Mp": 0.0},
    ),
    "coupled": StructurePart(
        "every quasi-steady derivative of the body, not the usual ones alone; a rotor keeps those that it makes of an "
        "axis' own rate and stick",
        equations={row: _derivatives(row, tuple(c for c in _EVERY if (row, c) not in _ITS_OWN)) for row in _BODY},
        needs=("body",),
        why="its derivatives are those of all six degrees of freedom",
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
        absent={"Ac": 0.0, "Bd": 0.0},
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
        absent={"Zlag": 0.0},
        excludes={"inflow": "both stand for the inflow's lag behind thrust"},
    ),
    "torque": StructurePart(
        "engine: part of the main rotor's reaction follows collective by a lag of first order",
        states={"torque": "rad/s^2"},
        equations={"r": {"torque": "1"}, "torque": {"torque": "-rate_q", "collective": "Kq"}},
        needs=("body", "yaw"),
        why="torque shows in yaw",
        absent={"Kq": 0.0},
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
        absent={"Komega": 0.0},
        holds="in hover",
    ),
    "governor": StructurePart(
        "rotor speed as in 'droop' under a governor that integrates its error; the engine's torque turns the body",
        states={"omega": "1", "engine": "1/s"},
        equations={
            "w": {"omega": "-2 * g"},
            "r": {"omega": "Nomega", "engine": "Nengine"},
            "omega": {"omega": "-rate_omega", "engine": "1", "collective": "Komega"},
            "engine": {"omega": "-rate_engine"},
        },
        needs=("body", "heave"),
        why="a slower rotor shows in vertical speed",
        absent={"Komega": 0.0},
        holds="in hover",
    ),
    "gyro": StructurePart(
        "yaw-rate gyro loop inside the aircraft: what its filter has integrated is fed to the tail",
        states={"r_fb": "rad"},
        equations={"r": {"r_fb": "Nrfb"}, "r_fb": {"r": "1", "r_fb": "-Krfb"}},
        needs=("body", "yaw"),
        why="it is fed by the yaw rate",
        absent={"Nrfb": 0.0},
    ),
    "bar_rotor": StructurePart(
        "second rotor that follows its stabilizer bar alone: the bar's tilt against the body turns it, also across",
        states={"bar_pitch": "rad", "bar_roll": "rad"},
        equations={
            "p": {"bar_roll": "Lbar", "bar_pitch": "Lacross"},
            "q": {"bar_pitch": "Mbar", "bar_roll": "Macross"},
            "bar_pitch": {"q": "-tau_bar", "bar_pitch": "-1"},
            "bar_roll": {"p": "-tau_bar", "bar_roll": "-1"},
        },
        left={"bar_pitch": {"bar_pitch": "tau_bar"}, "bar_roll": {"bar_roll": "tau_bar"}},
        needs=("body", "cyclic"),
        why="the bar's tilt shows in roll and pitch",
        absent={"Lbar": 0.0, "Lacross": 0.0, "Mbar": 0.0, "Macross": 0.0},
        holds="below one rotor revolution",
    ),
    "reaction": StructurePart(
        "pedal to torque by a lead-lag of first order: motors that speed rotors up and down, felt at once",
        states={"ped_lag": "1"},
        equations={"r": {"ped_lag": "Nlag"}, "ped_lag": {"ped_lag": "-rate_ped", "pedal": "rate_ped"}},
        needs=("body", "yaw"),
        why="torque shows in yaw",
        absent={"Nlag": 0.0},
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
_COAX = "that of a coaxial of 0.2 kg (CoaX: Fankhauser et al. 2011), rounded"
_ZERO = "not known: begins at zero"
_G = "standard gravity"
_TRIM = "hover; from the flights' means, or given"
_INFLOW = "rate 4 rho A v / m_air, m_air = 8/3 rho R^3 (Pitt and Peters 1981), for R 1.5 m, v 5 m/s"
_MASS = "helicopter's mass over the air's, 8/3 rho R^3 (Pitt and Peters 1981), for 50 kg, R 1.5 m"

NUMBERS: Mapping[str, StartNumber] = {
    "g": StartNumber(GRAVITY, "m/s^2", _G),
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
    "tau_s": StartNumber(0.34, "s", _R50, 0.02, 3.0),
    "Ac": StartNumber(0.64, "1", _R50), "Bd": StartNumber(0.71, "1", _R50),
    "Clon": StartNumber(-0.26, "rad", _R50), "Dlat": StartNumber(0.27, "rad", _R50),
    "rate_nu": StartNumber(16.0, "1/s", _INFLOW, 0.1, 500.0), "mass_nu": StartNumber(4.5, "1", _MASS, 0.01, 1000.0),
    "Zlag": StartNumber(5.0, "m/s^2", _ORDER), "rate_lag": StartNumber(10.0, "1/s", _ORDER, 0.1, 100.0),
    "Kq": StartNumber(5.0, "rad/s^3", _ORDER), "rate_q": StartNumber(3.0, "1/s", _ORDER, 0.05, 50.0),
    "Nomega": StartNumber(0.0, "rad/s^2", _ZERO), "Komega": StartNumber(-0.3, "1/s", _ORDER),
    "rate_omega": StartNumber(1.0, "1/s", _ORDER, 0.05, 50.0),
    "Nengine": StartNumber(-5.0, "rad/s", _ORDER), "rate_engine": StartNumber(2.0, "1/s^2", _ORDER, lower=0.0),
    "Nrfb": StartNumber(-50.0, "1/s^2", _ORDER), "Krfb": StartNumber(8.0, "1/s", _ORDER, lower=0.01),
    "Lbar": StartNumber(100.0, "1/s^2", _COAX, lower=0.0), "Mbar": StartNumber(100.0, "1/s^2", _COAX, lower=0.0),
    "tau_bar": StartNumber(1.5, "s", _COAX, 0.05, 20.0),
    "Lacross": StartNumber(0.0, "1/s^2", _ZERO), "Macross": StartNumber(0.0, "1/s^2", _ZERO),
    "Nlag": StartNumber(5.0, "rad/s^2", _ORDER), "rate_ped": StartNumber(8.0, "1/s", _ORDER, 0.1, 100.0),
    "tau_servo": StartNumber(0.04, "s", "a usual servo", 0.002, 0.5),
    "tau_tail": StartNumber(0.03, "s", "a usual servo", 0.002, 0.5),
    **{f"tau_{short}": StartNumber(0.02, "s", "links and computers", 0.0, 0.5) for short in SHORT.values()},
}  # fmt: skip
"""Start values that are known by name; a derivative that is not here begins at zero."""

_PER = {
    tuple(INPUTS): ("m/s^2", "rad/s^2", "rad"), SPEEDS: ("1/s", "rad/(m s)", "rad s/m"),
    RATES: ("m/s", "1/s", "s"), tuple(_ANGLES.values()): ("m/s^2", "1/s^2", "1"),
}  # fmt: skip
"""Units of derivatives by what they are by: of a specific force, of an angular acceleration, of a tilt."""

HELD = ("g", "U0", "V0", "W0", "phi0", "theta0")


def number(name: str) -> StartNumber:
    """The start value of a parameter; derivatives that have none begin at zero."""
    if name in NUMBERS:
        return NUMBERS[name]
    if name.startswith("tau_"):  # of one response
        return NUMBERS[f"tau_{name.rpartition('_')[2]}"]
    row, column = LETTERS[name[0]], COLUMNS[name[1:]]
    kind = 0 if row in SPEEDS else 1 if row in RATES else 2
    return StartNumber(0.0, next(units[kind] for columns, units in _PER.items() if column in columns), _ZERO)
