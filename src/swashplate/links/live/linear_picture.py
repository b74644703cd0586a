"""What a linear model looks like: a plain shape, the flapping that it has, and the thrust that it feels.

A file of matrices says neither size nor weight. The shape is that of any helicopter of the rotor radius in its [shape],
or of 1 m; forces are in weights of the aircraft (weight 1), and rotor speeds are for the eye only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from swashplate.physics.backend import FloatBackend
from swashplate.physics.environment import LABORATORY_GRAVITY, Environment
from swashplate.vehicles.linear import size_of
from swashplate.vehicles.structure import rebuild
from swashplate.vehicles.vehicle import Vehicle

ABOUT = (
    "A linear model: deviations from one trim, trusted near it only. It has no ground, wind or battery; its input "
    "delays are flown, to 2 ms; height counts from an arbitrary level; size and rotor speed are only drawn."
)
"""What whoever flies one must know."""
_TIP_SPEED = 60.0
"""m/s, drawn."""
_TILTS = (("b", "a"), ("b1", "a1"))
"""States that are a rotor's tilt to the right and aft [rad], as files call them (Mettler, Tischler and Kanade 1999)."""
_BARS = (("d", "c"),)
_XP = FloatBackend()


def picture(vehicle: Vehicle) -> dict[str, Any]:
    """Shapes as those of `swashplate.links.live.picture`: coaxial where the model has a lower rotor's tilt."""
    R, names = size_of(vehicle), vehicle.state_names
    known = {"size": R, "weight": 1.0, "ground": False, "rpm": False}
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


def pose_of(vehicle: Vehicle) -> Callable[[Sequence[float], Sequence[float], Environment], dict[str, Any]]:
    """How the moving parts stand, as `swashplate.links.live.picture.pose_of` says it.

    The thrust is the model's specific force turned into weights: one weight in the trim.
    """
    parameters, names = vehicle.values(), vehicle.state_names
    shape, speed = picture(vehicle), _TIP_SPEED / size_of(vehicle)
    tilt, barred = _first(_TILTS, names), _first(_BARS, names)

    def pose(x: Sequence[float], u: Sequence[float], around: Environment) -> dict[str, Any]:
        here = dict(zip(names, map(float, x), strict=True))
        state = rebuild(vehicle.state, list(here.values()))
        inputs = vehicle.inputs(*map(float, u))
        felt = vehicle.specific_force(state, inputs, parameters, around, _XP)
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


def _first(pairs: Sequence[tuple[str, str]], names: Sequence[str]) -> tuple[str, str] | None:
    """The first pair of states that the model has both of."""
    return next((pair for pair in pairs if set(pair) <= set(names)), None)
