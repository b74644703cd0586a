"""A page about one simulated flight: commands and what the vehicle did, over time."""

from __future__ import annotations

import math
from collections.abc import Sequence

from swashplate.flights.flight import Flight
from swashplate.flights.schema import ATTITUDE, POSITION
from swashplate.models.vehicle import Vehicle
from swashplate.physics.rigid_body import RigidBody
from swashplate.reporting.structure import Figure, Points, Report, Section
from swashplate.reporting.theme import BLUE, axis_number, kept, line, quantity, stacked

_PANEL = 118
"""Height of one panel [px]."""
_RATES, _VELOCITY = ("p", "q", "r"), ("u", "v", "w")


def compose_flight(
    vehicle: Vehicle, flight: Flight, *, remarks: Sequence[str] = (), title: str | None = None
) -> Report:
    """The page's structure.

    Args:
        vehicle: what flew.
        flight: its true states and inputs.
        remarks: what may not be believed.
        title: heading.
    """
    inner = tuple(name for name in vehicle.state_names if name not in RigidBody._fields)
    groups = (
        ("commands", "Commands", vehicle.input_names, "What the controller and the maneuver command together."),
        ("attitude", "Attitude and rates", (*ATTITUDE, *_RATES), "Roll, pitch and heading, and the body rates."),
        ("motion", "Velocity and position", (*_VELOCITY, *POSITION), "Along the body's axes; north, east and down."),
        ("inner", "Inner states", inner, "Rotor, inflow, engine and actuators: what the vehicle's options bring."),
    )
    sections = [
        Section(identifier, title, (flight_panels(flight, names, identifier=identifier, caption=caption),))
        for identifier, title, names, caption in groups
        if names
    ]
    if remarks:
        sections.append(Section("doubts", "What may not be believed", (Points(tuple(remarks)),)))
    return Report(
        title=title or f"Simulated flight of {flight.duration:.1f} s: {vehicle.card.title}",
        banners=(("caution", "No aircraft flew this flight. What is drawn is the truth, before any sensor."),),
        summary=(("Where to trust it", vehicle.card.trust or "the card does not say", "plain"),),
        picture=None,
        sections=tuple(sections),
    )


def flight_panels(flight: Flight, names: Sequence[str], *, identifier: str, caption: str) -> Figure:
    """One panel for each channel; all zoom in time together."""
    scales = [_shown(name, str(flight[name].attrs["units"])) for name in names]
    layout = stacked([quantity(name, unit) for name, (_, unit) in zip(names, scales, strict=True)], height=_PANEL)
    traces = []
    for i, (name, (factor, unit)) in enumerate(zip(names, scales, strict=True)):
        values = factor * flight.values(name)
        places = kept(values)
        hover = f"{name}<br>%{{x:.2f}} s, %{{y:.4g}} {unit}".rstrip()
        number = axis_number(i)
        traces.append(line(flight.time(name)[places], values[places], name=name, color=BLUE, axis=number, hover=hover))
    return Figure(
        f"flight-{identifier}",
        {"data": traces, "layout": layout},
        caption,
        f"{', '.join(names)} against time, one panel each.",
    )


def _shown(name: str, unit: str) -> tuple[float, str]:
    """Factor and unit for the screen: angles and body rates in degrees."""
    if unit == "rad":
        return math.degrees(1.0), "deg"
    if name in _RATES:
        return math.degrees(1.0), "deg/s"
    return 1.0, unit
