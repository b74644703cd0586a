"""What an accelerometer measures, linear about a trim, as entries of a state-space model's output equation.

a = dV/dt + omega x V - gravity + domega/dt x r (T&R ch. 13), with the trim's speeds U0, V0, W0 and its attitude to the
first order: omega x V is q W0 - r V0, r U0 - p W0, p V0 - q U0, and gravity leaves g theta, -g phi and
g (phi0 phi + theta0 theta). In hover, speeds and angles are zero.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

AXES = ("x", "y", "z")
TRIM = ("u", "v", "w", "phi", "theta")
"""What a model's [trim] may say."""

_SPEED = dict(zip(AXES, ("u", "v", "w"), strict=True))
_TURNING = {
    "x": (("q", "w", ""), ("r", "v", "-")),
    "y": (("r", "u", ""), ("p", "w", "-")),
    "z": (("p", "v", ""), ("q", "u", "-")),
}
_GRAVITY = {"x": (("theta", "g"),), "y": (("phi", "-g"),), "z": ()}
_ARMS = {
    "x": (("q", 2, ""), ("r", 1, "-")),
    "y": (("r", 0, ""), ("p", 2, "-")),
    "z": (("p", 1, ""), ("q", 0, "-")),
}


def specific_force(
    axis: str, *, at: Sequence[Any], trim: Mapping[str, str], states: Sequence[str]
) -> list[tuple[str, str, str]]:
    """Entries (matrix, state, expression) of an accelerometer: H0 before states, H1 before their rates.

    Args:
        axis: x, y or z.
        at: place from the centre of gravity, expressions [m].
        trim: expressions of the trim's speeds [m/s] and angles [rad], by state; none for hover.
        states: of the model. What turns with a rate that is no state is left out; an arm asks for its rate.
    """
    entries = [("H1", _SPEED[axis], "1")]
    gravity = [*_GRAVITY[axis]]
    if axis == "z":
        gravity += [(angle, f"g * ({trim[angle]})") for angle in ("phi", "theta") if angle in trim]
    turning = [(rate, f"{sign}({trim[speed]})") for rate, speed, sign in _TURNING[axis] if speed in trim]
    entries += [("H0", state, text) for state, text in (*gravity, *turning) if state in states]
    return entries + [("H1", rate, f"{sign}({at[k]})") for rate, k, sign in _ARMS[axis] if at[k] not in (0, "0", 0.0)]
