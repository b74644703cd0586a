"""`swash simulate --monte-carlo`: one controller on many aircraft in many gusts, and the worst flight kept."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from swashplate.errors import DivergenceError, SwashError

if TYPE_CHECKING:
    from swashplate.control.robustness import Spread
    from swashplate.flights.flight import Flight
    from swashplate.flights.maneuvers import Maneuver
    from swashplate.simulation.wind import Gusts
    from swashplate.vehicles.vehicle import Vehicle

_LEAD, _TAIL = 3.0, 3.0  # s of hover before and after, as `simulate_maneuver` has them
_PHYSICS = 500.0  # Hz at least
_KEPT = 20.0  # Hz of the samples that the summary sees


def fly(
    vehicle: Vehicle,
    maneuver: Maneuver,
    controller: Path,
    *,
    count: int,
    fit: Path | None,
    gusts: str,
    seed: int,
    voltage: float | None,
    sag: float,
) -> tuple[Spread, Flight]:
    """The summary of many flights, and the worst of them.

    Args:
        vehicle: the model; with `fit` the flights are of models drawn from its covariance.
        maneuver: a pilot's commands; only roll and pitch.
        controller: its file.
        count: how many flights.
        fit: a fit.json.
        gusts: "none", "indoor" or a mean wind [m/s].
        seed: of draws, gusts and sensor noise.
        voltage, sag: the battery's at the start [V] and its fall [V/s].
    """
    import numpy as np

    import swashplate as sp
    from swashplate.cli.simulate import from_file
    from swashplate.control.robustness import SENSOR_NOISE, draw_models, spread
    from swashplate.simulation.closed_loop_batch import simulate_closed_loops
    from swashplate.simulation.wind import dryden

    strange = [axis for axis in maneuver.axes if axis not in ("roll", "pitch")]
    if strange:
        raise SwashError(
            f"moves {', '.join(strange)}; with --monte-carlo a maneuver is a pilot's roll or pitch.",
            channel="--maneuver",
        )
    hover = sp.trim(vehicle, voltage=voltage)
    pilot = from_file(controller, seed=seed)(vehicle, hover)
    duration = _LEAD + maneuver.duration + _TAIL
    keep = max(1, round(pilot.rate / _KEPT))
    samples = round(duration * pilot.rate)
    time = np.arange(samples) / pilot.rate
    setting = _setting(gusts)
    flown = simulate_closed_loops(
        vehicle,
        pilot,
        duration=duration,
        size=count,
        parameters=None if fit is None else draw_models(vehicle, fit, count=count, seed=seed),
        reference=maneuver.signals(time - _LEAD),
        wind=None if setting is None else dryden(setting, samples=samples, rate=pilot.rate, seed=seed, count=count),
        voltage=float(hover.environment.voltage) - sag * time,
        noise=None if getattr(pilot.step, "feels", False) else SENSOR_NOISE,  # it brings its own sensors
        seed=seed,
        start=hover,
        rate=pilot.rate * max(1, round(_PHYSICS / pilot.rate)),
        keep=keep,
    )
    found = spread(flown)
    try:
        return found, flown.flight(found.worst)
    except DivergenceError as error:
        if error.flight is None:
            raise
        return found, error.flight  # type: ignore[return-value]


def _setting(gusts: str) -> Gusts | None:
    from swashplate.cli.options import numbers
    from swashplate.simulation.wind import INDOOR, outdoor

    if gusts == "none":
        return None
    return INDOOR if gusts == "indoor" else outdoor(numbers(gusts, option="--gusts", count=1)[0])
