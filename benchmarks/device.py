"""The batch on whatever JAX computes on: steps per second in float32, its distance from float64, and the roofline.

python -m benchmarks.device [--vehicles N] [--seconds S] [--crazyflow]

On a card (`pip install 'swashplate[cuda]'`) JAX takes it by itself; without one it is this processor. The peaks of the
card are not known to JAX: give them (`--flops`, `--bytes`, per second) to be told what fraction was reached.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict, dataclass

import jax
import jax.numpy as jnp
import numpy as np

from swashplate.engine.card import batch_program
from swashplate.engine.equations import SURROUNDINGS, equations_of, parameter_row
from swashplate.models.catalogue import vehicle as load_vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.closed_loop_batch import Precision
from swashplate.simulation.trim import trim

PROMISED = 1e9
"""Vehicle steps per second of CoaXes in float32 that issue and docs ask of an H100 or H200."""
CLOSE = 1e-4
"""The largest distance of float32 from float64 after a second, in units of each state's own size or of 1."""
RATE = 100.0


@dataclass(frozen=True)
class Measured:
    """One batch on one device.

    Attributes:
        device: its kind, as JAX calls it.
        vehicles, steps: how many, and steps of each.
        rate: vehicle steps per second, float32, compilation left out.
        away: distance of float32 from float64 after a second, as `CLOSE` counts it.
        flops, bytes: of a vehicle step, as XLA counts them in the compiled program.
        flops_share, bytes_share: of the device's peaks that were told; None where they were not.
    """

    device: str
    vehicles: int
    steps: int
    rate: float
    away: float
    flops: float
    bytes: float
    flops_share: float | None = None
    bytes_share: float | None = None

    @property
    def close(self) -> bool:
        """Whether float32 is as near to float64 as promised."""
        return self.away <= CLOSE


def measure(
    vehicle: Vehicle,
    *,
    vehicles: int,
    seconds: float = 1.0,
    repeats: int = 3,
    peaks: tuple[float, float] | None = None,
) -> Measured:
    """Fly a batch from hover, turning at -0.1 to 0.1 rad/s, in both precisions.

    Args:
        vehicle: of which kind.
        vehicles: how many.
        seconds: of flight that are timed; the distance is that after one second.
        repeats: the best of so many.
        peaks: of the device, floating point operations and bytes per second.
    """
    steps, second = round(seconds * RATE), round(RATE)
    single = _Compiled(vehicle, vehicles, steps, "float32")
    fastest = np.inf
    for _ in range(repeats):
        begin = time.perf_counter()
        jax.block_until_ready(single.run())
        fastest = min(fastest, time.perf_counter() - begin)
    after = single if steps == second else _Compiled(vehicle, vehicles, second, "float32")
    ends = (batch.run()[-1] for batch in (after, _Compiled(vehicle, vehicles, second, "float64")))
    plain, exact = (np.asarray(end, dtype=np.float64) for end in ends)
    away = np.abs(plain - exact) / np.maximum(1.0, np.abs(exact))
    rate = vehicles * steps / fastest
    flops, moved = (float(one) for one in single.cost / (vehicles * steps))
    shares = (None, None) if peaks is None else (rate * flops / peaks[0], rate * moved / peaks[1])
    return Measured(jax.devices()[0].device_kind, vehicles, steps, rate, float(away.max()), flops, moved, *shares)


class _Compiled:
    """A compiled batch with what it is given on the device."""

    def __init__(self, vehicle: Vehicle, vehicles: int, steps: int, precision: Precision) -> None:
        hover = trim(vehicle)
        x = np.repeat(hover.state[:, None], vehicles, axis=1)
        x[vehicle.index("p")] = np.linspace(-0.1, 0.1, vehicles)
        row = np.array([*hover.inputs, *(getattr(hover.environment, name) for name in SURROUNDINGS)])
        rows = np.tile(row[:, None], (steps + 1, 1, 1))
        numbers = parameter_row(vehicle, hover.environment)[:, None]
        jax.config.update("jax_enable_x64", True)
        given = [jnp.asarray(values, precision) for values in (x, rows[:-1], numbers, 1.0 / RATE)]
        program = batch_program(equations_of(vehicle), steps).lower(*given).compile()
        self.run = lambda: program(*given)
        told = program.cost_analysis() or {}
        told = told[0] if isinstance(told, list) else told
        # XLA counts the body of a loop once, whatever its number of rounds.
        self.cost = steps * np.array([told.get("flops", np.nan), told.get("bytes accessed", np.nan)])


def crazyflow(*, vehicles: int, steps: int) -> float | str:
    """Steps per second of Crazyflow's own quadrotor in the same process, or why there are none.

    In the precision that JAX has: float32 where nothing switched it to double (tried with Crazyflow 0.4.0).
    """
    try:
        from crazyflow.sim import Sim  # type: ignore[import-not-found, unused-ignore]
    except ImportError:
        return "crazyflow is not installed: not compared"
    sim = Sim(n_worlds=vehicles, device=jax.default_backend())
    sim.reset()
    sim.step(steps)
    begin = time.perf_counter()
    sim.step(steps)
    jax.block_until_ready(sim.data.states.pos)
    return float(vehicles * steps / (time.perf_counter() - begin))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vehicle", default="coax")
    parser.add_argument("--vehicles", type=int, default=1 << 20 if jax.default_backend() != "cpu" else 4096)
    parser.add_argument("--seconds", type=float, default=1.0)
    parser.add_argument("--flops", type=float, help="peak of the device, float32 operations per second")
    parser.add_argument("--bytes", type=float, help="peak of the device's memory, bytes per second")
    parser.add_argument("--crazyflow", action="store_true", help="Crazyflow's quadrotor beside it")
    options = parser.parse_args()
    peaks = None if options.flops is None or options.bytes is None else (options.flops, options.bytes)
    # First, for `measure` switches JAX to double precision, in which Crazyflow would then compute.
    steps = round(options.seconds * RATE)
    beside = {"crazyflow": crazyflow(vehicles=options.vehicles, steps=steps)} if options.crazyflow else {}
    measured = measure(load_vehicle(options.vehicle), vehicles=options.vehicles, seconds=options.seconds, peaks=peaks)
    promised = {"promised": PROMISED, "kept": measured.rate >= PROMISED and measured.close}
    print(json.dumps({**asdict(measured), "close": measured.close, **promised, **beside}, indent=1))


if __name__ == "__main__":
    main()
