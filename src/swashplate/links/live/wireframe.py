"""The helicopter as lines in space, and a camera that puts them on paper: for films and figures without a browser."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from swashplate.arrays import Array

Lines = list[tuple[str, Array]]

_TURN = np.linspace(0.0, 2.0 * np.pi, 33)


def helicopter(picture: dict[str, Any], x: Array, parts: dict[str, Any], *, time: float) -> Lines:
    """Polylines in north, east, down [m], each with what it is: "body", "disc", "bar", "thrust" or "tail".

    Args:
        picture: of `swashplate.links.live.picture`.
        x: body state row.
        parts: its pose.
        time: turns the blades [s].
    """
    R, per = picture["size"], 1.6 * picture["size"] / picture["weight"]
    hubs = [rotor["hub"] for rotor in picture["rotors"]]
    top = min([hub[2] for hub in hubs] + ([picture["bar"]["hub"][2]] if picture["bar"] else []))
    skids = picture["skids"]
    length, width, depth = skids["length"], skids["width"], skids["depth"]
    lines: list[tuple[str, Any]] = [("body", [[0, 0, 0], [hubs[0][0], hubs[0][1], top]])]
    for side in (-width, width):
        lines.append(("body", [[-length, side, depth], [length, side, depth]]))
        lines += [("body", [[end, 0.2 * side, 0.1 * R], [end, side, depth]]) for end in (-0.5 * length, 0.5 * length)]
    ring = np.stack([0.5 * R * np.cos(_TURN), 0.0 * _TURN, 0.22 * R * np.sin(_TURN)], axis=1)
    lines += [("body", ring), ("body", ring[:, [0, 2, 1]] * [1.0, 0.75, 1.0])]
    for rotor, told in zip(picture["rotors"], parts["rotors"], strict=True):
        alpha, beta, omega, *force = told
        turn = Rotation.from_euler("y", -rotor["tilt"]) * Rotation.from_euler("XYZ", [alpha, beta, 0.0])
        circle = np.stack([np.cos(_TURN), np.sin(_TURN), 0.0 * _TURN], axis=1) * rotor["radius"]
        lines.append(("disc", turn.apply(circle) + rotor["hub"]))
        phase = rotor["sense"] * omega * time
        for k in range(rotor["blades"]):
            angle = phase + 2.0 * np.pi * k / rotor["blades"]
            tip = rotor["radius"] * np.array([np.cos(angle), np.sin(angle), 0.0])
            lines.append(("blade", np.array([np.zeros(3), turn.apply(tip)]) + rotor["hub"]))
        lines.append(("thrust", np.array([np.zeros(3), per * np.array(force)]) + rotor["hub"]))
    if picture["bar"] and parts["bar"]:
        turn = Rotation.from_euler("XYZ", [*parts["bar"], 0.0])
        angle = picture["rotors"][0]["sense"] * parts["rotors"][0][2] * time + 0.5 * np.pi
        end = picture["bar"]["radius"] * np.array([np.cos(angle), np.sin(angle), 0.0])
        lines.append(("bar", turn.apply(np.array([-end, end])) + picture["bar"]["hub"]))
    if picture["tail"]:
        hub, radius = np.array(picture["tail"]["hub"]), picture["tail"]["radius"]
        lines.append(("body", [[-0.3 * R, 0.0, -0.05 * R], hub]))
        lines.append(("tail", np.stack([radius * np.cos(_TURN), 0.0 * _TURN, radius * np.sin(_TURN)], axis=1) + hub))
        if parts["tail"]:
            lines.append(("thrust", [hub, hub + np.array([0.0, 3.0 * per * parts["tail"][1], 0.0])]))
    attitude = Rotation.from_euler("ZYX", [x[8], x[7], x[6]])
    return [(kind, attitude.apply(np.asarray(points, dtype=np.float64)) + x[:3]) for kind, points in lines]


def ground(center: Array, cell: float, *, floor: float = 0.0, cells: int = 12) -> Lines:
    """Grid lines at a depth [m] about a place, a line every `cell` [m]."""
    north, east = (np.round(value / cell) * cell for value in center[:2])
    steps = np.arange(-cells, cells + 1) * cell
    fine = np.linspace(-cells * cell, cells * cell, 2 * cells + 1)
    lines: Lines = [("grid", np.stack([north + fine, east + 0 * fine + s, floor + 0 * fine], axis=1)) for s in steps]
    return lines + [("grid", np.stack([north + 0 * fine + s, east + fine, floor + 0 * fine], axis=1)) for s in steps]


class Camera:
    """A perspective camera behind and above what it looks at.

    Args:
        at: what is in the middle [m, NED].
        heading: from behind which it looks [rad].
        distance: from there [m].
        lift: above the horizon [rad].
    """

    def __init__(self, at: Array, *, heading: float, distance: float, lift: float = 0.3) -> None:
        level = np.array([np.cos(heading), np.sin(heading), 0.0])
        down = np.array([0.0, 0.0, 1.0])
        self._at = at
        self._forward = np.cos(lift) * level + np.sin(lift) * down
        self._right = np.array([-level[1], level[0], 0.0])
        self._up = np.cross(self._right, self._forward)
        self._distance = distance

    def project(self, points: Array) -> Array:
        """Places on the picture, shape (n, 2), in units of its half height; NaN behind the camera."""
        relative = points - self._at
        depth = relative @ self._forward + self._distance
        depth = np.where(depth > 0.05 * self._distance, depth, np.nan)
        return np.stack([relative @ self._right / depth, relative @ self._up / depth], axis=1) / 0.42
