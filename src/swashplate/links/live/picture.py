"""What a model looks like and how its moving parts stand: as its traits say, or a plain shape."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from swashplate.models.nesting import rebuild
from swashplate.models.surroundings import environment_of
from swashplate.models.traits import Pose as Pose
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend
from swashplate.physics.environment import LABORATORY_GRAVITY, Environment

SIZE = "rotor_radius"
"""Option or parameter that says how large a model is drawn [m]."""
DEFAULT_SIZE = 1.0
"""m: where nothing says it."""
_TIP_SPEED = 60.0
"""m/s, drawn."""
_TILTS = (("b", "a"), ("b1", "a1"))
"""States that are a rotor's tilt to the right and aft [rad], as files call them (Mettler, Tischler and Kanade 1999)."""
_BARS = (("d", "c"),)
_XP = FloatBackend()


def plain_picture(vehicle: Vehicle) -> dict[str, Any]:
    """Shapes in body axes (forward, right, down) [m], of a model that says none: coaxial where it has a lower rotor's
    tilt, of the card's `rotor_radius` or of 1 m. Forces are in weights of the aircraft, rotor speeds for the eye."""
    R, names = size_of(vehicle), vehicle.state_names
    known = {"size": R, "weight": 1.0, "ground": vehicle.traits.ground, "rpm": False}
    if "alpha_lower" in names:
        rotors = [
            {"name": name, "hub": [0.0, 0.0, -h * R], "radius": R, "blades": 2, "sense": sense, "tilt": 0.0}
            for name, h, sense in (("upper", 1.0, -1), ("lower", 0.6, 1))
        ]
        bar = {"hub": [0.0, 0.0, -1.25 * R], "radius": 0.55 * R} if "eta_bar" in names else None
        skids = {"length": 0.45 * R, "width": 0.35 * R, "depth": 0.55 * R}
        return {**known, "rotors": rotors, "bar": bar, "tail": None, "skids": skids, "fin": None}
    main = {"name": "main", "hub": [0.0, 0.0, -0.3 * R], "radius": R, "blades": 2, "sense": 1, "tilt": 0.0}
    bar = {"hub": [0.0, 0.0, -0.34 * R], "radius": 0.4 * R} if _first(_BARS, names) else None
    tail = {"hub": [-1.2 * R, 0.0, -0.1 * R], "radius": 0.18 * R, "blades": 2}
    skids = {"length": 0.3 * R, "width": 0.2 * R, "depth": 0.3 * R}
    fin = {"x": -1.15 * R, "z": -0.1 * R, "side": 0.2 * R}
    return {**known, "rotors": [main], "bar": bar, "tail": tail, "skids": skids, "fin": fin}


def plain_pose(vehicle: Vehicle) -> Callable[[Sequence[float], Sequence[float], Environment], dict[str, Any]]:
    """How the moving parts stand: per rotor [alpha, beta, omega, fx, fy, fz], the bar's tilt, the tail rotor's.

    The thrust is the model's specific force turned into weights: one weight in the trim.
    """
    parameters, names = vehicle.values(), vehicle.state_names
    shape, speed = plain_picture(vehicle), _TIP_SPEED / size_of(vehicle)
    tilt, barred = _first(_TILTS, names), _first(_BARS, names)

    def pose(x: Sequence[float], u: Sequence[float], around: Environment) -> dict[str, Any]:
        here = dict(zip(names, map(float, x), strict=True))
        state = rebuild(vehicle.state, list(here.values()))
        inputs = vehicle.inputs(*map(float, u))
        felt = vehicle.specific_force(state, inputs, parameters, environment_of(vehicle, around), _XP)
        thrust = [float(part) / LABORATORY_GRAVITY for part in felt]
        if shape["tail"] is None:
            share = [0.5 * part for part in thrust]
            lower = [here["alpha_lower"], here.get("beta_lower", 0.0), speed, *share]
            bar = [here["eta_bar"] - here["phi"], here.get("zeta_bar", 0.0) - here["theta"]] if shape["bar"] else None
            return {"rotors": [[0.0, 0.0, speed, *share], lower], "bar": bar, "tail": None}
        right, aft = (here[name] for name in tilt) if tilt else (0.0, 0.0)
        bar = [here[name] for name in barred] if barred else None
        return {"rotors": [[right, aft, speed, *thrust]], "bar": bar, "tail": [4.0 * speed, 0.0]}

    return pose


def size_of(vehicle: Vehicle) -> float:
    """Rotor radius with which a vehicle is drawn [m]: what its card says, otherwise `DEFAULT_SIZE`."""
    said = vehicle.card.options.get(SIZE)
    return float(vehicle.card.values().get(SIZE, DEFAULT_SIZE) if said is None else said)


def _first(pairs: Sequence[tuple[str, str]], names: Sequence[str]) -> tuple[str, str] | None:
    """The first pair of states that the model has both of."""
    return next((pair for pair in pairs if set(pair) <= set(names)), None)


def picture(vehicle: Vehicle) -> dict[str, Any]:
    """Shapes in body axes (forward, right, down) [m]: rotors, bar, tail, fin and skids; size [m] and weight [N].

    What a card does not say (the fuselage's outline) is a plain shape of the rotor's size. `ground` is whether there is
    one, `rpm` whether rotor speeds are known.
    """
    return (vehicle.traits.picture or plain_picture)(vehicle)


def inputs_of(vehicle: Vehicle) -> list[dict[str, Any]]:
    """Name, unit and limits of each input: as the model has them."""
    return [
        {"name": name, "unit": unit, "low": low, "high": high}
        for name, unit, (low, high) in zip(vehicle.input_names, vehicle.input_units, vehicle.input_limits, strict=True)
    ]


def pose_of(vehicle: Vehicle) -> Pose:
    """A function from state row, input row and surroundings to how the moving parts stand.

    It returns per rotor [alpha, beta, omega, fx, fy, fz] (tilt right and aft [rad], speed [rad/s], force [N] in body
    axes), the bar's tilt [alpha, beta] (None without) and the tail rotor's [omega, force to the right].
    """
    return (vehicle.traits.pose or plain_pose)(vehicle)
