"""Closed-loop CoaX flights in gusts with sensor noise, many at once, against one flight after the other."""

from __future__ import annotations

import resource
import time

import numpy as np

from benchmarks.timing import Result, Span, best_rate
from swashplate.control.draws.spread import spread
from swashplate.control.draws.variations import SENSOR_NOISE, draw_numbers
from swashplate.control.laws.autopilot import autopilot
from swashplate.control.lqg.design import design
from swashplate.filtering.sensor_suite import suite
from swashplate.models.catalogue import vehicle as load_vehicle
from swashplate.simulation.closed_loop import simulate_closed_loop
from swashplate.simulation.closed_loop_batch import simulate_closed_loops
from swashplate.simulation.trim import trim
from swashplate.simulation.wind import INDOOR, dryden

SECONDS, CONTROLLER, PHYSICS = 20.0, 100.0, 500.0
WITHIN, OF = 30.0, 1000
"""Seconds that are promised for so many flights."""
MEMORY = 2.0  # GB
SAMPLES = 100_000.0
"""A second that are promised under a full observer, on two cores: 1,000 flights of 20 s in 20 s."""


def flights(*, count: int, one_by_one: int = 5) -> Span:
    """The controller at 100 Hz, the physics at 500 Hz; the second call in a process, gusts and draws included."""
    coax = load_vehicle("coax")
    hover = trim(coax)
    place = autopilot(coax, hover, rate=CONTROLLER)
    samples = round(SECONDS * CONTROLLER)

    def run() -> None:
        many = simulate_closed_loops(
            coax,
            place,
            duration=SECONDS,
            size=count,
            parameters=draw_numbers(coax, {"mass": 0.005}, count=count, seed=0),
            wind=dryden(INDOOR, samples=samples, rate=CONTROLLER, seed=0, count=count),
            noise=SENSOR_NOISE,
            start=hover,
            rate=PHYSICS,
            keep=5,
        )
        assert spread(many, hover).lost == 0

    run()
    begin = time.perf_counter()
    run()
    seconds = time.perf_counter() - begin
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9
    gusts = {
        name: np.repeat(series[:, 0], round(PHYSICS / CONTROLLER))
        for name, series in dryden(INDOOR, samples=samples + 1, rate=CONTROLLER, seed=0).items()
    }
    n = round(SECONDS * PHYSICS) + 1
    gusts = {name: series[:n] for name, series in gusts.items()}

    def one() -> None:
        simulate_closed_loop(coax, place, duration=SECONDS, wind=gusts, start=hover, rate=PHYSICS)

    one()
    begin = time.perf_counter()
    for _ in range(one_by_one):
        one()
    single = (time.perf_counter() - begin) / one_by_one
    note = f"{single * count / seconds:.1f} times faster than one after the other; peak of the process {peak:.2f} GB"
    return Span(f"{count} closed-loop flights of 20 s", seconds, WITHIN * count / OF, note, kept=peak < MEMORY)


def observers(*, count: int, repeats: int) -> Result:
    """Samples of closed loops whose filter finds its gains as it flies: readings, estimates, commands, five steps."""
    coax = load_vehicle("coax")
    controller = design(coax, sensors=suite("imu@100,mocap@100+10ms"))
    seconds: list[float] = []

    def run() -> None:
        begin = time.process_time()
        simulate_closed_loops(coax, controller, duration=SECONDS, size=count, rate=PHYSICS, keep=5)
        seconds.append(time.process_time() - begin)

    samples = round(SECONDS * controller.rate) * count
    rate = best_rate(run, samples, repeats=repeats)
    note = f"samples at {controller.rate:g} Hz, all cores; {1e6 * min(seconds) / samples:.0f} us of processor time each"
    return Result(f"{count} closed loops with a full observer", rate, SAMPLES, note)
