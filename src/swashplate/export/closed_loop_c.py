"""Flights under a controller in C: vehicle, sensors and law compiled together, in half a second instead of three.

The vehicle's Runge-Kutta step is the one of `stepping_c`, the law the one of `controller_c`. What happens between them
is what `simulation.closed_loop` traces for XLA: the two agree to rounding.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.compiled import NATIVE, can_compile, loaded
from swashplate.control.kinds import FELT, draw_names, kind_of
from swashplate.engine.equations import SURROUNDINGS
from swashplate.errors import SwashError
from swashplate.export.controller_c import printed_function
from swashplate.export.model_c import flying_code
from swashplate.export.traced import trace_vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.closed_loop import REFERENCES, Controller, FlyLoop, LoopTables
from swashplate.simulation.trim import Trim

_OPTIONS = ("-O1", "-w", NATIVE, "-ftree-vectorize", "-fno-trapping-math")
"""The loops of the covariance as vectors: as fast as -O3, in half of its time. CasADi prints what nothing reads."""
_LOOP = """
static double within(double v, double low, double high) { return v < low ? low : v > high ? high : v; }

/* sent: what was sent to the actuators in the last `depth` samples, newest first; depth 0 sends at once. */
void body_fly(int n, int every, int depth, double dt, const int *place, const int *late, double *memory,
              const double *start, const double *p, const double *limits, double *sent, const double *around,
              const double *voltage, const double *wanted, const double *added, const double *draws, double *states,
              double *inputs) {
  double work[N_LONGEST], after[N_MEMORY + N_INPUTS]; /* on the stack: several threads may fly */
  int whole[N_WHOLE], i, j, k;
  const double *arguments[N_ARGUMENTS];
  double *results[N_RESULTS], x[N_STATES], told[N_TOLD], measured[N_MEASURED];
  double command[N_INPUTS] = {0}, acting[N_INPUTS];
  for (i = 0; i < N_STATES; ++i) x[i] = start[i];
  for (k = 0; k < n; ++k, around += N_SURROUNDINGS, wanted += N_REFERENCES, added += N_INPUTS) {
    for (i = 0; i < N_STATES; ++i) states[k * N_STATES + i] = x[i];
    if (k % every == 0) {
      for (j = 0; j < N_INPUTS; ++j) /* until now */
        acting[j] = depth ? sent[late[j] * N_INPUTS + j] : within(command[j], limits[j], limits[N_INPUTS + j]);
      for (i = 0; i < N_STATES; ++i) told[i] = x[i];
      readings(x, acting, around, p, told + N_STATES);
      told[N_STATES + 3] = voltage[k];
      for (i = 0; i < N_DRAWS; ++i) told[N_STATES + 4 + i] = draws[k / every * N_DRAWS + i];
      for (i = 0; i < N_MEASURED; ++i) measured[i] = told[place[i]];
      arguments[0] = memory;
      arguments[1] = measured;
      arguments[2] = wanted;
      results[0] = after;
      swash_traced(arguments, results, whole, work, 0);
      for (i = 0; i < N_MEMORY; ++i) memory[i] = after[i];
      for (j = 0; j < N_INPUTS; ++j) command[j] = after[N_MEMORY + j];
    }
    for (j = 0; j < N_INPUTS; ++j) acting[j] = within(command[j] + added[j], limits[j], limits[N_INPUTS + j]);
    if (depth) {
      for (i = depth - 1; i > 0; --i)
        for (j = 0; j < N_INPUTS; ++j) sent[i * N_INPUTS + j] = sent[(i - 1) * N_INPUTS + j];
      for (j = 0; j < N_INPUTS; ++j) sent[j] = acting[j];
      for (j = 0; j < N_INPUTS; ++j) acting[j] = sent[late[j] * N_INPUTS + j];
    }
    for (j = 0; j < N_INPUTS; ++j) inputs[k * N_INPUTS + j] = acting[j];
    body_step(x, acting, around, p, dt);
  }
}
"""
_POINTER, _WHOLE = ctypes.POINTER(ctypes.c_double), ctypes.POINTER(ctypes.c_int)


def loop_in_c(vehicle: Vehicle, controller: Controller, trim: Trim) -> FlyLoop | None:
    """What flies a vehicle under a law; None where there is no compiler, or no C of the two: XLA flies them then.

    Args:
        vehicle: what flies.
        controller: the law; another memory and another seed of its sensors may fly too.
        trim: the vehicle's, to trace it.
    """
    if not can_compile():
        return None
    try:
        return _Loop(vehicle, controller, trim)
    except (SwashError, OSError):  # a law or equations that are no C, a compiler without headers
        return None


class _Loop:
    def __init__(self, vehicle: Vehicle, controller: Controller, trim: Trim) -> None:
        model = trace_vehicle(vehicle, trim, name="body", jacobians=False)
        self._kind = kind_of(controller)
        law = self._kind.flown(controller)
        self._draws = sum(name.startswith("draw_") for name in law.measured)
        told = (*vehicle.state_names, *FELT, "voltage", *draw_names(self._draws))
        self._place = np.array([told.index(name) for name in law.measured], dtype=np.intc)
        self._names = [v.name for v in model.surroundings]
        self._numbers = np.array([v.start for v in model.parameters])
        printed, _ = printed_function(law.function, "double")
        f = law.function
        sizes = {
            "states": len(model.states),
            "inputs": len(model.inputs),
            "surroundings": len(model.surroundings),
            "references": len(REFERENCES),
            "told": len(told),
            "measured": len(law.measured),
            "memory": len(law.start),
            "draws": self._draws,
            "longest": max(1, int(f.sz_w())),
            "whole": max(1, int(f.sz_iw())),
            "arguments": max(3, int(f.sz_arg())),
            "results": max(1, int(f.sz_res())),
        }
        counts = "".join(f"#define N_{name.upper()} {count}\n" for name, count in sizes.items())
        self._fly = loaded(printed + flying_code(model) + counts + _LOOP, options=_OPTIONS).body_fly
        self._fly.restype = None

    def __call__(self, controller: Controller, tables: LoopTables) -> tuple[Array, Array]:
        n, every = len(tables.around), tables.every
        states, inputs = np.empty((n, tables.start.size)), np.empty((n, tables.first.size))
        columns = [
            tables.around[:, SURROUNDINGS.index(name)]
            if name in SURROUNDINGS
            else np.full(n, float(getattr(tables.environment, name)))
            for name in self._names
        ]
        around = np.stack(columns, axis=1) if columns else np.zeros((n, 0))
        voltage = tables.around[:, SURROUNDINGS.index("voltage")]
        draws = self._kind.draws(controller, -(-n // every)) if self._draws else np.zeros((1, 0))
        depth = int(tables.late.max()) + 1
        sent = np.tile(tables.first, (depth, 1))
        memory = np.array(controller.memory, dtype=np.float64)
        self._fly(
            ctypes.c_int(n), ctypes.c_int(every), ctypes.c_int(depth if tables.late.any() else 0),
            ctypes.c_double(tables.dt), _whole(self._place), _whole(tables.late),
            *map(_real, (memory, tables.start, self._numbers, tables.limits, sent, around, voltage, tables.wanted,
                         tables.added, draws, states, inputs)),
        )  # fmt: skip
        return states, inputs


def _real(values: Array) -> Any:
    return np.ascontiguousarray(values, dtype=np.float64).ctypes.data_as(_POINTER)


def _whole(values: Any) -> Any:
    return np.ascontiguousarray(values, dtype=np.intc).ctypes.data_as(_WHOLE)
