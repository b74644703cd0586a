"""The format "web": a model as one HTML file that flies by itself, without a server and without a network."""

from __future__ import annotations

from swashplate.errors import ExportError
from swashplate.export.formats import Export, ExportRequest
from swashplate.links.live.single_page import single_page
from swashplate.links.live.world import World
from swashplate.models.linear.linear_vehicle import linear_vehicle
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle

MOST_DRAWS = 20


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
    world = World(model, controller=request.controller, draws=request.draws)
    late = {name: delay for name, delay in (request.late or {}).items() if delay}
    not_flown = ", ".join(f"{name} {1e3 * delay:.3g} ms" for name, delay in late.items())
    page = single_page(world, name=request.name, made=request.origin)
    drawn = f"; {len(request.draws)} models drawn from the fit" if request.draws else ""
    inside = f"the equations and numbers of {model.name}, its card's sources, {world.pilot.title}{drawn}"
    return Export(
        {f"{request.name}.html": page.encode()},
        (
            f"Inside: {inside}. Open it by double-click.",
            *((f"The page's pilot flies without the identified delays ({not_flown}).",) if not_flown else ()),
        ),
    )
