"""The shape that a log's aircraft is drawn with: its own, one of its kind, or a plain one, and what is said of it."""

from __future__ import annotations

from typing import Any

import numpy as np

from swashplate.flights.aircraft_kind import aircraft_kind
from swashplate.flights.flight import Flight
from swashplate.links.live.picture import picture
from swashplate.models.card import packaged_names
from swashplate.models.catalogue import vehicle
from swashplate.models.usual import BY_ROTORS, HELICOPTER, USUAL

_ARM = 0.35
"""m: from the middle to a rotor of an aircraft whose size is not known."""

_Part = tuple[str, list[float], list[float], str]


def _crossed(x: float, span: float) -> list[_Part]:
    """Planes of a tail, level and upright."""
    return [("box", [x, 0.0, 0.0], [0.1, span, 0.02], "dark"), ("box", [x, 0.0, 0.0], [0.1, 0.02, span], "dark")]


_PLANE: list[_Part] = [
    ("ball", [0.0, 0.0, 0.0], [0.55, 0.08, 0.08], "paint"),
    ("ball", [0.2, 0.0, -0.05], [0.16, 0.06, 0.06], "glass"),
    ("box", [0.08, 0.0, -0.02], [0.18, 1.3, 0.02], "paint"),
    ("box", [-0.48, 0.0, -0.02], [0.12, 0.42, 0.015], "dark"),
    ("box", [-0.48, 0.0, -0.12], [0.14, 0.015, 0.2], "dark"),
]
_FORMS: dict[str, list[_Part]] = {
    "a plane": _PLANE,
    "a plane that takes off vertically": _PLANE,
    "a rover": [
        ("box", [0.0, 0.0, -0.12], [0.8, 0.36, 0.14], "paint"),
        ("box", [-0.08, 0.0, -0.25], [0.36, 0.3, 0.14], "glass"),
        *(("wheel", [0.28 * x, 0.24 * y, -0.02], [0.13, 0.09, 0.13], "dark") for x in (-1, 1) for y in (-1, 1)),
    ],
    "a boat": [
        ("ball", [0.0, 0.0, 0.0], [0.6, 0.2, 0.12], "paint"),
        ("box", [-0.1, 0.0, -0.14], [0.3, 0.2, 0.12], "glass"),
        ("box", [0.05, 0.0, -0.3], [0.02, 0.02, 0.34], "dark"),
    ],
    "a submarine": [
        ("ball", [0.0, 0.0, 0.0], [0.6, 0.14, 0.14], "paint"),
        ("box", [0.05, 0.0, -0.18], [0.2, 0.06, 0.14], "dark"),
        *_crossed(-0.5, 0.36),
    ],
    "a blimp": [("ball", [0.0, 0.0, 0.0], [0.6, 0.24, 0.24], "paint"), *_crossed(-0.5, 0.5)],
}
"""Of what carries no rotors, by the words for it: form, middle, size and look of each part, over the shape's size."""


def shape_of(flight: Flight) -> tuple[dict[str, Any], str]:
    """What is drawn (as of `swashplate.links.live.picture`), and a sentence where it is not the log's own vehicle."""
    if flight.provenance.vehicle in packaged_names():
        return picture(vehicle(flight.provenance.vehicle)), ""
    kind = aircraft_kind(flight)
    if kind is None:
        return _packaged(HELICOPTER, "The log does not say what flew")
    remark = f"The log is of {kind.noun} ({kind.source})"
    if kind.main_rotors:
        return _packaged(USUAL if kind.coaxial else HELICOPTER, remark)
    if kind.rotors in BY_ROTORS:
        return _packaged(BY_ROTORS[kind.rotors], remark)
    if kind.multirotor:
        return generic_shape(kind.rotors or 4), f"{remark}: a plain one is drawn."
    if kind.noun in _FORMS:
        return {**generic_shape(0), "parts": _FORMS[kind.noun]}, f"{remark}: a plain one is drawn."
    return generic_shape(0), f"{remark}: no shape of its kind is known here, a plain body shows how it stood."


def _packaged(name: str, remark: str) -> tuple[dict[str, Any], str]:
    return picture(vehicle(name)), f"{remark}: the shape of {name} is drawn."


def generic_shape(rotors: int) -> dict[str, Any]:
    """A body with so many rotors around it, the first ahead to the right; nothing but the body where there are none."""
    angles = 2.0 * np.pi * (np.arange(rotors) + 0.5) / max(rotors, 1)
    radius = min(0.45 * _ARM, 0.9 * _ARM * float(np.sin(np.pi / max(rotors, 2))))
    around = [
        {
            "name": str(i + 1),
            "hub": [float(_ARM * np.cos(angle)), float(_ARM * np.sin(angle)), 0.0],
            "radius": radius,
            "blades": 2,
            "sense": 1 if i % 2 else -1,
            "tilt": 0.0,
        }
        for i, angle in enumerate(angles)
    ]
    size = _ARM + radius
    skids = {"length": 0.4 * size, "width": 0.3 * size, "depth": 0.3 * size} if rotors else None
    parts = {"rotors": around, "bar": None, "tail": None, "skids": skids, "fin": None}
    return {"size": size, "weight": 1.0, **parts, "ground": True, "rpm": False}
