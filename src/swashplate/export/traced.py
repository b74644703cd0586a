"""A model as every format in C needs it: named variables with units and starts, equations traced by CasADi."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import ModuleType

import numpy as np

from swashplate.engine.emit import identifier
from swashplate.engine.graph import Expression, Graph
from swashplate.engine.roots import Looped, Looping, require_casadi
from swashplate.errors import ExportError
from swashplate.export.linear import Linear
from swashplate.flights.schema import channel, is_known
from swashplate.models.nesting import rebuild
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend, CasadiBackend
from swashplate.physics.environment import Environment
from swashplate.simulation.trim import Trim

_SURROUNDINGS = {
    "wind_north": ("m/s", "wind towards north"),
    "wind_east": ("m/s", "wind towards east"),
    "wind_down": ("m/s", "wind downwards"),
    "air_density": ("kg/m^3", "density of the air"),
    "gravity": ("m/s^2", "acceleration of free fall"),
    "voltage": ("V", "battery voltage"),
}
_ACCELEROMETERS = ("ax", "ay", "az")


@dataclass(frozen=True)
class Variable:
    """A named number of a model: its unit, where it starts, its limits where it has any, and what it is."""

    name: str
    unit: str
    start: float = 0.0
    limits: tuple[float, float] | None = None
    meaning: str = ""


@dataclass(frozen=True)
class Traced:
    """A model and its equations as CasADi functions of (state, input, surrounding, parameter).

    Attributes:
        name: what its C functions begin with. title, trust: what it is and where it holds.
        about: what the starts are: "hover", "5 m/s ahead" or, for a linear model, deviations.
        states, inputs, surroundings, parameters, outputs: in the order of the arrays. Surroundings are those that the
            equations use; the outputs of a vehicle are what accelerometers at the CG read.
        rates, readings: derivatives of the states, and the outputs.
        jacobians: A and B, the rates by state and by input; of nothing where they were left out.
        looped: the rates again, with the roots in them found in loops; None where there are none.
        delays: of each input [s]; empty where there are none. The functions do not have them.
        origin: commit, card and data that it was made from, a line each.
    """

    name: str
    title: str
    trust: str
    about: str
    states: tuple[Variable, ...]
    inputs: tuple[Variable, ...]
    surroundings: tuple[Variable, ...]
    parameters: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    rates: Graph = field(repr=False)
    readings: Graph = field(repr=False)
    jacobians: Graph = field(repr=False)
    looped: Looped | None = field(default=None, repr=False)
    delays: tuple[float, ...] = ()
    origin: tuple[str, ...] = ()


def late_notes(model: Traced) -> tuple[str, ...]:
    """What a user of the equations alone must do about delays."""
    waits = [f"{v.name} by {d:g} s" for v, d in zip(model.inputs, model.delays, strict=False) if d]
    return (f"Delays are not in these equations; hold back {'; '.join(waits)}.",) if waits else ()


class _Remembering(CasadiBackend):
    """Values that differentiation must not look into become symbols, and are put back afterwards."""

    def __init__(self, casadi: ModuleType) -> None:
        super().__init__()
        self.hidden: list[tuple[Expression, Expression]] = []
        self._casadi = casadi

    def detached(self, x: Expression) -> Expression:
        symbol = self._casadi.SX.sym(f"hidden_{len(self.hidden)}")
        self.hidden.append((symbol, x))
        return symbol

    def shown(self, expressions: Sequence[Expression]) -> list[Expression]:
        substituted = list(expressions)
        for symbol, value in reversed(self.hidden):  # later ones may be made of earlier ones
            substituted = self._casadi.substitute(substituted, [symbol], [value])
        return substituted


def trace_vehicle(
    vehicle: Vehicle, trim: Trim, *, name: str, delays: Mapping[str, float] | None = None, jacobians: bool = True
) -> Traced:
    """A vehicle's equations, its numbers as parameters, and a trim to start from.

    Args:
        vehicle, trim, name: what is traced, where it starts, what its C begins with.
        delays: of inputs by name [s]; none where not given (see `linear.logged_delays`).
        jacobians: False leaves them out, where only steps are wanted.

    Raises:
        ExportError: without CasADi.
    """
    casadi = require_casadi()
    around = tuple(_SURROUNDINGS)
    n, m, k = len(vehicle.state_names), len(vehicle.input_names), len(vehicle.parameter_names)
    x, u, s, p = (casadi.SX.sym(a, size) for a, size in zip("xusp", (n, m, len(around), k), strict=True))
    state = rebuild(vehicle.state, [x[i] for i in range(n)])
    inputs = vehicle.inputs(*(u[i] for i in range(m)))
    parameters = vehicle.parameters(*(p[i] for i in range(k)))
    environment = Environment(**{a: s[i] for i, a in enumerate(around)})

    def rates(xp: Backend) -> Expression:
        return casadi.vertcat(*vehicle.rates(x, u, parameters, environment, xp))

    hiding = _Remembering(casadi)
    slopes = [casadi.jacobian(rates(hiding), by) for by in (x, u)] if jacobians else []
    backend = CasadiBackend()
    right = rates(backend)
    force = casadi.vertcat(*vehicle.specific_force(state, inputs, parameters, environment, backend))
    used = [i for i, does in enumerate(casadi.which_depends(casadi.vertcat(right, force), s, 1)) if does]

    rest = s[used] if used else casadi.SX(0, 1)

    def function(results: Sequence[Expression]) -> Graph:
        return casadi.Function("f", [x, u, rest, p], list(results), {"cse": True})

    looping = Looping(casadi)
    with_roots = rates(looping)
    numbers = vehicle.values()
    card = vehicle.card.parameters
    return Traced(
        name=name,
        title=vehicle.card.title,
        trust=vehicle.card.trust,
        about=_course(trim),
        states=tuple(
            Variable(a, unit, float(start), meaning=_meaning(a))
            for a, unit, start in zip(vehicle.state_names, vehicle.state_units, trim.state, strict=True)
        ),
        inputs=tuple(
            Variable(a, unit, float(start), limits, _meaning(a))
            for a, unit, start, limits in zip(
                vehicle.input_names, vehicle.input_units, trim.inputs, vehicle.input_limits, strict=True
            )
        ),
        surroundings=tuple(
            Variable(around[i], unit, float(getattr(trim.environment, around[i])), meaning=meaning)
            for i, (unit, meaning) in enumerate(_SURROUNDINGS.values())
            if i in used
        ),
        parameters=tuple(
            Variable(a, card[a].unit, float(getattr(numbers, a)), meaning=f"{card[a].status}: {card[a].source}")
            for a in vehicle.parameter_names
        ),
        outputs=tuple(Variable(a, channel(a).unit, meaning=channel(a).description) for a in _ACCELEROMETERS),
        rates=function([right]),
        readings=function([force]),
        jacobians=function(hiding.shown(slopes)),
        looped=looping.looped([x, u, rest, p], [with_roots]) if looping.roots else None,
        delays=tuple(delays.get(a, 0.0) for a in vehicle.input_names) if delays and any(delays.values()) else (),
    )


def trace_linear(model: Linear, *, name: str) -> Traced:
    """A linear model's dx/dt = A x + B u, y = C x + D u with its numbers as constants.

    Raises:
        ExportError: without CasADi, where two signals would have one name in C, or an input reaches outputs after
            different times.
    """
    casadi = require_casadi()
    x, u = casadi.SX.sym("x", len(model.states)), casadi.SX.sym("u", len(model.inputs))
    nothing = casadi.SX(0, 1)

    def sparse(matrix: Expression) -> Expression:
        return casadi.SX(casadi.sparsify(casadi.DM(np.asarray(matrix))))

    A, B, C, D = (sparse(matrix) for matrix in (model.A, model.B, model.C, model.D))

    def function(results: Sequence[Expression]) -> Graph:
        return casadi.Function("f", [x, u, nothing, nothing], list(results), {"cse": True})

    def variables(names: Sequence[str]) -> tuple[Variable, ...]:
        called = [identifier(a) for a in names]  # a file may name its signals as it likes
        if len(set(called)) != len(called):
            raise ExportError(f"names of {', '.join(names)} are the same in C.", where=model.name)
        return tuple(
            Variable(c, model.units.get(a, ""), meaning=_meaning(a)) for c, a in zip(called, names, strict=True)
        )

    delays_by_input = {i: sorted({model.delay(o, i) for o in model.outputs}) for i in model.inputs}
    if torn := [name for name, times in delays_by_input.items() if len(times) > 1]:
        listed = ", ".join(
            f"{o}/{i} {1e3 * model.delay(o, i):.3g} ms" for i in torn for o in model.outputs if model.delay(o, i)
        )
        raise ExportError(
            f"has delays that differ between outputs ({listed}); equations in C and FMU hold one of each input.",
            where=model.name,
            channel="delays",
            hint="Give the file one delay per input, or leave all of them out (--no-delays); --format matlab and "
            "control hold them.",
        )
    delays = tuple(times[0] for times in delays_by_input.values() if times)
    return Traced(
        name=name,
        title=model.title,
        trust=model.trust,
        about="linear: deviations from the flight that it was identified in",
        states=variables(model.states),
        inputs=variables(model.inputs),
        surroundings=(),
        parameters=(),
        outputs=variables(model.outputs),
        rates=function([casadi.densify(A @ x + B @ u)]),
        readings=function([casadi.densify(C @ x + D @ u)]),
        jacobians=function([A, B]),
        delays=delays if any(delays) else (),
    )


def _course(trim: Trim) -> str:
    if not (trim.speed or trim.lateral or trim.climb or trim.turn):
        return "hover"
    return f"steady flight at {trim.speed:g} m/s ahead"


def _meaning(name: str) -> str:
    return channel(name).description if is_known(name) else ""
