"""Flights: the one loop that steps vehicles, alone or many, with inputs from a table or from a law that decides them.

`fly` prints a vehicle's equations and a law's step into `templates/fly.c`, compiles them and flies; without a compiler
CasADi's own virtual machine runs the same graphs (`virtual.py`). Attitude is carried as Euler angles; a vehicle that
pitches beyond 80 degrees is flown again with a quaternion.
"""

from __future__ import annotations

import ctypes
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.compiled import NATIVE, can_compile, loaded
from swashplate.engine.emit import INTEGER, LANES, REAL, fill_template, print_graph, print_lane_searches, print_lanes
from swashplate.engine.equations import CONSTANTS, SURROUNDINGS, Equations, equations_of
from swashplate.engine.law import FELT, REFERENCES, LawGraph, law_code
from swashplate.engine.statements import ROOTS, Precision, literal, split, statements
from swashplate.engine.trace import traced_angles, traced_force, traced_rates
from swashplate.engine.tumbling import from_euler, steep_at, tumbling
from swashplate.engine.virtual import fly_virtually
from swashplate.models.vehicle import Vehicle

_PART = 512
"""Vehicles a thread flies before it takes the next: a thread that another program held up then keeps nobody waiting."""
_MANY = ("-O3", NATIVE, "-ffp-contract=fast", "-fno-math-errno", "-fno-trapping-math", "-fopenmp-simd", "-w")
"""Nothing that lets a compiler change the order of operations: infinities and NaN stay what they are."""
_ONE = ("-O1", NATIVE, "-ffp-contract=fast", "-fno-math-errno", "-fno-trapping-math", "-w")
"""One vehicle: half of the compiling, and as fast within a tenth."""
_PITCH = 7


@dataclass(frozen=True)
class Steering:
    """A law and what it decides on, for all vehicles; the last axis is one column for all, or one each.

    Attributes:
        law: its step.
        memory: what it carries, shape (memory, vehicles).
        every: steps of the flight to one of the law.
        asked: `REFERENCES`, shape (rows, 8, 1 or vehicles).
        added: to the commands, shape (rows, inputs, 1 or vehicles).
        limits: lowest, highest and whole step (0: none) of each input, shape (3, inputs).
        delay_steps: steps that commands are late, shape (inputs, vehicles).
        before: what the actuators get until the first command arrives, shape (inputs,).
        draws: of the law's own sensors, shape (decisions, draws, vehicles).
        noise: of the states that it is told, shape (decisions, states, vehicles); None: none.
    """

    law: LawGraph
    memory: Array
    every: int
    asked: Array
    added: Array
    limits: Array
    delay_steps: NDArray[np.int_]
    before: Array
    draws: Array
    noise: Array | None = None

    def of(self, members: NDArray[np.int_]) -> Steering:
        """That of some of the vehicles."""
        each = {f.name: getattr(self, f.name) for f in fields(self)}
        count = self.memory.shape[1]
        chosen = {
            name: values[..., members]
            for name, values in each.items()
            if isinstance(values, np.ndarray) and name not in ("limits", "before") and values.shape[-1] == count
        }
        return replace(self, **chosen)


@dataclass(frozen=True)
class FlightPlan:
    """What is flown, for `vehicles` of them; the last axis is one column for all, or one each.

    Attributes:
        start: state rows, shape (states, vehicles).
        numbers: parameter rows (`parameter_row`), shape (parameters + 2, 1 or vehicles).
        rows: driving rows, shape (rows, inputs + 4, 1 or vehicles); under a law `SURROUNDINGS` alone, (rows, 4, ...).
        dt: of a step [s].
        hold: steps that a row holds, or over which it changes linearly into the next.
        keep: every how many steps a sample is kept.
        samples: steps and one; by default all that the rows tell.
        held: whether a row holds; under a law it does.
        steering: the law.
    """

    start: Array
    numbers: Array
    rows: Array
    dt: float
    hold: int = 1
    keep: int = 1
    samples: int = 0
    held: bool = True
    steering: Steering | None = field(default=None, repr=False)

    @property
    def vehicles(self) -> int:
        return int(self.start.shape[1])

    @property
    def steps_and_one(self) -> int:
        return self.samples or (len(self.rows) - 1) * self.hold + 1

    @property
    def kept(self) -> int:
        return -(-self.steps_and_one // self.keep)

    def of(self, members: NDArray[np.int_]) -> FlightPlan:
        """That of some of the vehicles."""

        def chosen(table: Array) -> Array:
            return table[..., members] if table.shape[-1] == self.vehicles else table

        steering = None if self.steering is None else self.steering.of(members)
        tables = (self.start, self.numbers, self.rows)
        start, numbers, rows = map(chosen, tables)
        return replace(self, start=start, numbers=numbers, rows=rows, steering=steering)


def fly(
    vehicle: Vehicle, plan: FlightPlan, *, precision: Precision = "double", quaternion: bool | None = None
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Fly vehicles by Runge and Kutta's classical method of order 4.

    Args:
        vehicle: whose equations; its numbers are those of the plan.
        plan: what is flown.
        precision: of all numbers.
        quaternion: whether attitude is carried as one; None for those alone that come near the vertical.

    Returns:
        States at the kept samples, shape (kept, states, vehicles), and under a law what the actuators got, shape (kept,
        inputs, vehicles); without one an empty table.

    Raises:
        ExportError: for equations or a law that CasADi cannot trace.
        MissingLibraryError: without CasADi.
    """
    states, inputs = _fly_plan(vehicle, plan, precision, quaternion=quaternion or False)
    if vehicle.traits.linear or quaternion is not None:
        return states, inputs
    lost = np.flatnonzero(steep_at(states[:, _PITCH]))
    if lost.size:
        again = _fly_plan(vehicle, plan.of(lost), precision, quaternion=True)
        states[..., lost] = again[0]
        if plan.steering is not None:
            inputs[..., lost] = again[1]
    return states, inputs


def _fly_plan(
    vehicle: Vehicle, plan: FlightPlan, precision: Precision, *, quaternion: bool
) -> tuple[NDArray[Any], NDArray[Any]]:
    if not can_compile():
        return fly_virtually(vehicle, plan, precision, quaternion=quaternion)
    lanes = 1 if plan.vehicles == 1 else LANES[precision]
    law = None if plan.steering is None else plan.steering.law
    if law is None:
        flight = _open_program(equations_of(vehicle), precision, lanes, quaternion)
    else:
        flight = _program(equations_of(vehicle), law, precision, lanes, quaternion)
    return flight(plan)


@lru_cache(maxsize=32)
def _open_program(equations: Equations, precision: Precision, lanes: int, quaternion: bool) -> _Program:
    return _program(equations, None, precision, lanes, quaternion)


def _program(
    equations: Equations, law: LawGraph | None, precision: Precision, lanes: int, quaternion: bool
) -> _Program:
    source = flight_code(equations, law, precision=precision, lanes=lanes, quaternion=quaternion)
    return _Program(loaded(source, options=_ONE if lanes == 1 else _MANY).fly, precision, lanes, law, quaternion)


_LONGS = ("samples", "keep", "hold", "held", "every", "depth", "first", "last", "total")
_WIDTHS = ("rows_wide", "numbers_wide", "asked_wide", "added_wide")
_TABLES = ("start", "numbers", "rows", "asked", "added", "limits", "before", "memory", "draws", "noise")


class _Flight(ctypes.Structure):
    """The C structure `Flight` of `templates/fly.c`."""

    _fields_ = [
        *((name, ctypes.c_long) for name in (*_LONGS, *_WIDTHS)),
        ("dt", ctypes.c_double),
        *((name, ctypes.c_void_p) for name in (*_TABLES, "late", "place", "sent", "states", "inputs")),
    ]


class _Program:
    """Compiled flights of one vehicle's equations under one law.

    Args:
        fly: the C function. precision, lanes: that it was printed for.
        law: that it flies under. quaternion: whether it carries one.
    """

    def __init__(self, fly: Any, precision: Precision, lanes: int, law: LawGraph | None, quaternion: bool) -> None:
        self._fly, self._lanes, self._law, self._quaternion = fly, lanes, law, quaternion
        self._dtype = np.float64 if precision == "double" else np.float32
        fly.argtypes, fly.restype = [ctypes.POINTER(_Flight)], None

    def __call__(self, plan: FlightPlan) -> tuple[NDArray[Any], NDArray[Any]]:
        steering, total = plan.steering, plan.vehicles
        shown = plan.start
        start = np.stack([from_euler(column) for column in shown.T], axis=1) if self._quaternion else shown
        given: dict[str, Any] = {
            "start": np.concatenate([start, shown]) if self._quaternion else start,
            "numbers": plan.numbers,
            "rows": plan.rows,
        }
        widths = {"rows_wide": plan.rows.shape[-1], "numbers_wide": plan.numbers.shape[-1]}
        delay_steps, place, depth, n_inputs = np.zeros(0, dtype=np.int_), np.zeros(0, dtype=np.int_), 1, 0
        if steering is not None:
            assert self._law is not None
            n_inputs = len(steering.before)
            names = ("asked", "added", "limits", "before", "memory", "draws", "noise")
            given |= {name: getattr(steering, name) for name in names if getattr(steering, name) is not None}
            widths |= {"asked_wide": steering.asked.shape[-1], "added_wide": steering.added.shape[-1]}
            delay_steps, place = steering.delay_steps, self._law.places
            depth = int(delay_steps.max(initial=0)) + 1
        tables = {name: np.ascontiguousarray(table, self._dtype) for name, table in given.items()}
        integers = {
            "late": np.ascontiguousarray(delay_steps, np.dtype("l")),
            "place": np.ascontiguousarray(place, np.dtype("l")),
        }
        states = np.empty((plan.kept, shown.shape[0], total), self._dtype)
        inputs = np.empty((plan.kept, n_inputs, total), self._dtype)
        out = {"states": states, "inputs": inputs}
        pointers = {name: table.ctypes.data for name, table in {**tables, **integers, **out}.items()}
        every = 1 if steering is None else steering.every
        counts = {"samples": plan.steps_and_one, "keep": plan.keep, "hold": plan.hold, "every": every, "depth": depth}

        wide = _PART if steering is None else 2 * self._lanes

        def part(first: int) -> None:
            sent = np.empty(depth * max(n_inputs, 1) * self._lanes + 64, self._dtype)
            aligned = sent[(-sent.ctypes.data % 64) // sent.itemsize :]
            flight = _Flight(
                held=int(plan.held or steering is not None),
                first=first,
                last=min(first + wide, total),
                total=total,
                dt=plan.dt,
                sent=aligned.ctypes.data,
                **counts,
                **widths,
                **pointers,
            )
            self._fly(ctypes.byref(flight))

        parts = range(0, total, wide)
        if len(parts) == 1:
            part(0)
        else:
            with ThreadPoolExecutor(_cores()) as threads:
                list(threads.map(part, parts))
        return states, inputs


def _cores() -> int:
    """Those that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def flight_code(
    equations: Equations, law: LawGraph | None, *, precision: Precision, lanes: int, quaternion: bool = False
) -> str:
    """C of `fly` for a vehicle's equations (`templates/fly.c`).

    Args:
        equations: of which vehicle, with Euler angles.
        law: that decides the inputs; None where a table has them.
        precision: of all numbers. lanes: vehicles side by side.
        quaternion: whether attitude is carried as one.

    Raises:
        ExportError: for equations or a law that CasADi cannot trace or that are not printed as C.
        MissingLibraryError: without CasADi.
    """
    vehicle, real = equations.vehicle, REAL[precision]
    stepped = equations_of(tumbling(vehicle)) if quaternion else equations
    traced = traced_rates(stepped)
    function, steps = traced.function, traced.steps
    code = statements(function, precision=precision, inputs=["x", "w", "p", *(name[:-1] for name in ROOTS)])
    of_card, rest = split(code, moving=("x[", "w[", *ROOTS), fixed="cp")
    of_inputs, rest = split(rest)
    feels = law is not None and law.feels
    force, angles = "", ""
    if feels:
        force = print_graph(
            traced_force(stepped), real="real", precision=precision, inputs=["x", "w", "p"], outputs=["felt"]
        )
    if quaternion:
        angles = print_graph(traced_angles(), real="real", precision=precision, inputs=["q"], outputs=["angles"])
    return fill_template(
        "fly.c",
        {
            "REAL": real,
            "INTEGER": INTEGER[precision],
            "TURNED": fill_template(f"turned_{precision}.h", {}),
            "PI": literal(np.pi, precision),
            "LANES": lanes,
            "ALIGNED": min(64, lanes * (8 if precision == "double" else 4)),
            "STATES": len(stepped.vehicle.state_names),
            "SEEN": len(vehicle.state_names),
            "DRIVING": len(vehicle.input_names) + len(SURROUNDINGS),
            "NUMBERS": len(vehicle.parameter_names) + len(CONSTANTS),
            "ROOTS": max(1, len(steps)),
            "OF_CARD_COUNT": max(1, len(of_card.outputs)),
            "OF_INPUTS_COUNT": max(1, len(of_inputs.outputs)),
            "OF_CARD": print_lanes(of_card, "cp", precision),
            "OF_INPUTS": print_lanes(of_inputs, "c", precision),
            "MOVING": print_lane_searches(rest, steps, precision),
            "CONTROLLED": int(law is not None),
            "FELT": int(feels),
            "QUATERNION": int(quaternion),
            "FORCE": force,
            "ANGLES": angles,
            "REFERENCES": len(REFERENCES),
            "MEASURED": 0 if law is None else len(law.measured),
            "MEMORY": 0 if law is None else law.memory,
            "DRAWS": 0 if law is None else law.draws,
            "LAW": "" if law is None else law_code(law, len(vehicle.input_names)),
        },
    )


__all__ = ["FELT", "FlightPlan", "Steering", "flight_code", "fly"]
