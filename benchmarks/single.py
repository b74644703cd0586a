"""One CoaX with classical Runge-Kutta in float64: `simulate`, a plain NumPy loop, and the limit in C."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.timing import Result, best_rate
from swashplate.engine.equations import SURROUNDINGS, equations_of, parameter_row, unpack_rows
from swashplate.models.catalogue import vehicle as load_vehicle
from swashplate.physics.backend import CasadiBackend
from swashplate.simulation.discretisation import rk4_step
from swashplate.simulation.integrate import simulate_open_loop
from swashplate.simulation.trim import trim

TARGET = 180_000.0
DT = 0.01

_LOOP = """
#include <string.h>
int coax_step(const double** arg, double** res, long long int* iw, double* w, int mem);
int coax_step_work(long long int*, long long int*, long long int*, long long int*);
void fly(double* x, const double* w, const double* p, int n) {
    long long int sz_arg, sz_res, sz_iw, sz_w;
    coax_step_work(&sz_arg, &sz_res, &sz_iw, &sz_w);
    long long int iw[sz_iw + 1];
    double work[sz_w + 1], next[NX];
    const double* arg[sz_arg];
    double* res[sz_res];
    for (int i = 0; i < n; ++i) {
        arg[0] = x; arg[1] = w; arg[2] = p; res[0] = next;
        coax_step(arg, res, iw, work, 0);
        memcpy(x, next, sizeof(next));
    }
}
"""


class _NumpyBackend:
    """NumPy's functions on scalars, as a plain loop would call them."""

    sin, cos, tan, sqrt = np.sin, np.cos, np.tan, np.sqrt
    atan2, abs, where, minimum, maximum = np.arctan2, np.abs, np.where, np.minimum, np.maximum
    detached = staticmethod(lambda x: x)


def _start() -> tuple:
    vehicle = load_vehicle("coax")
    hover = trim(vehicle)
    x = np.array(hover.state)
    x[vehicle.index("p")] = 0.1
    row = np.array([*hover.inputs, *(getattr(hover.environment, name) for name in SURROUNDINGS)])
    return vehicle, x, row, parameter_row(vehicle, hover.environment)


def scan(*, steps: int, repeats: int) -> Result:
    """`simulate` as users call it, its checks and its flight included."""
    vehicle, x, row, _ = _start()
    inputs = np.tile(row[: len(vehicle.input_names)], (steps + 1, 1))
    start = dict(zip(vehicle.state_names, x, strict=True))

    def run() -> None:
        simulate_open_loop(vehicle, inputs, start=start, rate=1.0 / DT)

    return Result("swashplate, simulate", best_rate(run, steps, repeats=repeats), TARGET, "float64, one core")


def numpy_loop(*, steps: int, repeats: int) -> Result:
    """The same equations in an interpreted loop."""
    vehicle, start, row, p = _start()
    equations, xp = equations_of(vehicle), _NumpyBackend()

    def rates(x, w):
        u, parameters, environment = unpack_rows(equations, w, p)
        return np.array(vehicle.rates(x, u, parameters, environment, xp))

    def run() -> None:
        x = start
        for _ in range(steps):
            x = rk4_step(rates, x, lambda _: row, DT)

    return Result("plain NumPy loop", best_rate(run, steps, repeats=repeats))


def c_loop(*, steps: int, repeats: int) -> Result:
    """The same equations exported to C by CasADi and compiled with gcc -O3: what this machine can do at most."""
    import casadi

    if shutil.which("gcc") is None:
        raise FileNotFoundError("gcc is not installed")
    vehicle, start, row, p = _start()
    equations, xp = equations_of(vehicle), CasadiBackend()
    x, w, q = casadi.SX.sym("x", start.size), casadi.SX.sym("w", row.size), casadi.SX.sym("p", p.size)

    def rates(x, w):
        u, parameters, environment = unpack_rows(equations, w, q)
        return casadi.vertcat(*vehicle.rates(x, u, parameters, environment, xp))

    step = casadi.Function("coax_step", [x, w, q], [rk4_step(rates, x, lambda _: w, DT)])
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)
        source = Path(step.generate("coax_step.c", {"main": False}))
        (here / "step.c").write_text(source.read_text())
        source.unlink()
        (here / "loop.c").write_text(f"#define NX {start.size}\n{_LOOP}")
        command = ["gcc", "-O3", "-march=native", "-shared", "-fPIC", "-o", "step.so", "step.c", "loop.c", "-lm"]
        subprocess.run(command, cwd=here, check=True)
        fly = ctypes.CDLL(str(here / "step.so")).fly
        as_c = np.ctypeslib.ndpointer(dtype=np.float64, flags="C_CONTIGUOUS")
        fly.argtypes = [as_c, as_c, as_c, ctypes.c_int]
        fly.restype = None

        def run() -> None:
            fly(start.copy(), row, p, steps)

        rate = best_rate(run, steps, repeats=repeats)
    return Result("equations in C by CasADi, gcc -O3", rate, None, "the limit")
