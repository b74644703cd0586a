"""The live page as one HTML file that flies by itself, its modules, libraries and the model as WebAssembly in it."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.engine.equations import parameter_row
from swashplate.flights.maneuvers.series import Maneuver
from swashplate.links.live.axes import STICKS
from swashplate.links.live.frame_code import frame_code, web_assembly
from swashplate.links.live.picture import inputs_of, picture, pose_of
from swashplate.links.live.sensors import BODY
from swashplate.links.live.world import FAN_SECONDS, World, gust_filters
from swashplate.links.web.libraries import PAGE
from swashplate.links.web.single_file import WEB_ASSEMBLY, single_file
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.record import largest_states

_KINDS = {"sweep": (30.0, (0.3, 5.0)), "doublet": (1.0, None), "3211": (3.5, None)}
LOGGED_RATE = 20.0
"""Rows a second of a flight that is shown beside the model."""
_CARD_HEAD = ("name", "value", "unit", "±", "source")


def single_page(world: World, *, name: str, origin: Sequence[str] = (), logged: Array | None = None) -> str:
    """The text of the page.

    Args:
        world: what flies, at its start.
        name: of the model, for what is recorded.
        origin: what it was made from, a line each: commit, card, data.
        logged: body states of the flight that it was learnt from, `LOGGED_RATE` rows a second, shape (n, 12).

    Raises:
        SwashError: without the page's libraries, ziglang or CasADi, or for equations that become no C.
    """
    return single_file(
        PAGE / "live.html",
        title=world.vehicle.card.title,
        documents={"model": page_model(world, name=name, logged=logged is not None)},
        packed={
            WEB_ASSEMBLY: web_assembly(frame_code(world)),
            **({} if logged is None else {"log": np.ascontiguousarray(logged, dtype="<f4").tobytes()}),
        },
        instead={"/page/connection.js": "/page/alone.js"},
        within={'<p id="folder"></p>': f'<p id="folder"></p>\n{_card(world.vehicle)}\n{_origin(origin)}'},
    )


def page_model(world: World, *, name: str, **more: Any) -> dict[str, Any]:
    """All that `page/flight.js` must know beside the code.

    Args:
        world: what flies, at its start.
        name: of the model.
        more: of `hello`, what a server adds: what it estimates, where recordings go, the bar that it can take off.
    """
    vehicle, pilot = world.vehicle, world.pilot
    names = vehicle.input_names
    nominal = world.nominal_voltage
    around = world.environment
    law = pilot.decide.graph(len(vehicle.state_names) + 4, pilot.memory.size, pilot.gain_count)
    off = {"bar": False, "barred": False, "hows": [], "folder": "", "estimates": [], "learns": False, "logged": False}
    return {
        "name": name,
        "hello": {
            "title": vehicle.card.title,
            "trust": vehicle.card.trust,
            "about": vehicle.traits.about,
            "wind": vehicle.traits.wind,
            "controller": pilot.title,
            "sensors": str(world.sensors[0]) if pilot.reads else "the controller's own sensors",
            "picture": picture(vehicle),
            "inputs": inputs_of(vehicle),
            "modes": list(pilot.modes),
            "decoupling": pilot.decouples,
            "voltages": None if nominal is None else [round(0.8 * nominal, 1), round(1.08 * nominal, 1)],
            "rate": 1.0 / world.period,
            "fan": len(world.draws),
            "fan_seconds": FAN_SECONDS,
            **off,
            **more,
        },
        "states": [list(pair) for pair in zip(vehicle.state_names, vehicle.state_units, strict=True)],
        "period": world.period,
        "logged": LOGGED_RATE,
        "sizes": {
            "depth": world.depth,
            "carried": pilot.memory.size,
            "gains": pilot.gain_count,
            "draws": law.draws + BODY,
            "crafts": 2 + len(world.draws),
        },
        "back": [one.ravel().tolist() for one in world.steps_back],
        "sensors": [[*one.placed, *one.sigma] for one in world.sensors],
        "trim": {"x": world.trim.state.tolist(), "u": np.asarray(world.trim.inputs).tolist()},
        "carried": np.asarray(pilot.memory).tolist(),
        "card": parameter_row(vehicle, around).tolist(),
        "draws": [parameter_row(one, around).tolist() for one in world.draws],
        "gains": {mode: [pilot.gains[mode, on].tolist() for on in (True, False)] for mode in pilot.modes},
        "mode": world.mode,
        "voltage": float(around.voltage),
        "speed": pilot.speed,
        "climb": pilot.climb,
        "turn": pilot.turn,
        "linear": vehicle.traits.linear,
        "ground": bool(vehicle.card.options.get("ground")),
        "fastest": vehicle.card.fastest,
        "held": list(dict(vehicle.trim_held)),
        "largest": largest_states(vehicle).tolist(),
        "gusts": [
            {part: np.atleast_1d(value).tolist() for part, value in one._asdict().items()}
            for one in gust_filters(rate=1.0 / world.period)
        ],
        "maneuvers": {kind: _shape(kind, world.period) for kind in _KINDS},
        "axes": {axis: _vector(world, axis, names) for axis in STICKS},
        "pose": _pose(world),
    }


def _shape(kind: str, period: float) -> list[float]:
    """One maneuver of the amplitude 1, a number a period."""
    duration, band = _KINDS[kind]
    maneuver = Maneuver(kind, ("axis",), duration, 1.0, band)
    time = np.arange(0.0, duration, period)
    return np.round(maneuver.offsets(time, inputs=["axis"])["axis"], 6).tolist()


def _vector(world: World, axis: str, names: Sequence[str]) -> list[float]:
    """What a maneuver of the usual size adds to each input at its largest."""
    pilot, vehicle = world.pilot, world.vehicle
    one = Maneuver("step", (pilot.excited[axis],), 1.0, pilot.amplitude[axis])
    added = one.offsets(np.array([0.5]), inputs=names, axes=vehicle.stick_axes)
    return [float(added[name][0]) for name in names]


def _pose(world: World) -> dict[str, Any]:
    """How rotors, bar and tail stand in the hover, and how states and inputs move that, to first order."""
    pose, around = pose_of(world.vehicle), world.environment
    x, u = np.array(world.trim.state, dtype=float), np.array(world.trim.inputs, dtype=float)

    def flat(row: Array) -> tuple[Array, dict[str, Any]]:
        parts_of = pose(row[: x.size].tolist(), row[x.size :].tolist(), around)
        parts = [*parts_of["rotors"], parts_of["bar"] or [], parts_of["tail"] or []]
        return np.concatenate([np.asarray(part, dtype=float) for part in parts]), parts_of

    row = np.concatenate([x, u])
    at, drawn = flat(row)
    slopes = np.empty((at.size, row.size))
    for k in range(row.size):
        step = 1e-5 * max(1.0, abs(row[k]))
        away = np.zeros(row.size)
        away[k] = step
        slopes[:, k] = (flat(row + away)[0] - flat(row - away)[0]) / (2.0 * step)
    return {
        "at": np.round(at, 7).tolist(),
        "slopes": [[float(f"{v:.6g}") for v in line] for line in slopes],
        "rotors": len(drawn["rotors"]),
        "bar": drawn["bar"] is not None,
        "tail": drawn["tail"] is not None,
    }


def _card(vehicle: Vehicle) -> str:
    """The card's numbers with their bounds and sources, as a table that unfolds."""
    rows = []
    for name, one in vehicle.card.parameters.items():
        spread = "" if one.sigma is None or not np.isfinite(one.sigma) else f"{one.sigma:.2g}"
        cells = (name, f"{one.value:.6g}", one.unit, spread, one.source)
        rows.append("<tr>" + "".join(f"<td>{html.escape(str(cell))}</td>" for cell in cells) + "</tr>")
    head = "".join(f"<th>{name}</th>" for name in _CARD_HEAD)
    return f"<details><summary>Numbers of the card</summary><table><tr>{head}</tr>{''.join(rows)}</table></details>"


def _origin(lines: Sequence[str]) -> str:
    return "".join(f"<p>{html.escape(line)}</p>" for line in lines)
