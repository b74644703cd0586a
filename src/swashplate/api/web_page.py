"""The format "web": a model as one HTML file that flies by itself, without a server and without a network."""

from __future__ import annotations

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import ExportError, FlightError
from swashplate.export.formats import Export, ExportRequest
from swashplate.flights.flight import Flight
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.links.live.replay import flight_at
from swashplate.links.live.single_page import LOGGED_RATE, single_page
from swashplate.links.live.world import MOST_DRAWS, World
from swashplate.models.linear.linear_vehicle import linear_vehicle
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.surroundings import input_delays
from swashplate.models.vehicle import Vehicle

LONGEST_LOGGED = 180.0
"""Seconds of a flight that a page takes along."""


def web(request: ExportRequest) -> Export:
    """The live page with the model in it, its physics and its law compiled to WebAssembly.

    Raises:
        ExportError: matrices of an export, which are no vehicle; too many draws; equations that become no C.
        MissingLibraryError: without CasADi (extra `model`) or ziglang (extra `compiler`).
        SwashError: a model that cannot hover, or a controller for another vehicle.
    """
    model = linear_vehicle(request.model) if isinstance(request.model, StateSpaceModel) else request.model
    if not isinstance(model, Vehicle):
        raise ExportError(
            "is matrices only, and a page flies vehicles.", where=request.name, hint="Export the model's own file."
        )
    if len(request.draws) > MOST_DRAWS:
        raise ExportError(f"is {len(request.draws)}, expected {MOST_DRAWS} at most.", channel="draws")
    at_once = model.structure is None and request.late is None and any(input_delays(model).values())  # as was asked for
    world = World(model, controller=request.controller, draws=request.draws, at_once=at_once)
    logged, left = (None, "") if request.flight is None else beside(request.flight)
    page = single_page(world, name=request.name, origin=request.origin, logged=logged)
    drawn = f"; {len(request.draws)} models drawn from the fit" if request.draws else ""
    drawn += f"; {request.flight.provenance.source or 'the flight'}{left}" if request.flight is not None else ""
    inside = f"the equations and numbers of {model.name}, its card's sources, {world.pilot.title}{drawn}"
    return Export(
        {f"{request.name}.html": page.encode()},
        (
            f"Inside: {inside}. Open it by double-click.",
            *((f"Careful: the page's own pilot {world.not_held} (--controller).",) if world.not_held else ()),
        ),
    )


def beside(flight: Flight) -> tuple[Array, str]:
    """Body states of a flight at `LOGGED_RATE` that a page shows, shape (n, 12), and what of it was cut, in words.

    Raises:
        FlightError: where its place, velocity, attitude or rates are missing.
    """
    clean = flight.provenance.simulated and "phi" in flight
    shown = flight.condition(rate=100.0, outliers=not clean, trim_ground=not clean)
    if missing := [name for name in PREDICTED if name not in shown]:
        raise FlightError(
            f"lacks {', '.join(missing)}.",
            where=flight.provenance.source,
            channel="flight",
            hint="Beside a model flies what has place and attitude at least.",
        )
    begun, end = (float(shown.time("phi")[k]) for k in (0, -1))
    time = np.arange(begun, min(end, begun + LONGEST_LOGGED), 1.0 / LOGGED_RATE)
    cut = f", its first {LONGEST_LOGGED:g} s of {end - begun:.0f}" if end - begun > LONGEST_LOGGED else ""
    return flight_at(shown, time), cut
