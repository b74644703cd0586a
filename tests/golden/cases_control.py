"""Golden cases of controllers: holds, decoupling, linear-quadratic design, margins, many drawn aircraft."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import swashplate as sp

from . import extract
from .case import Values, case, named
from .extract import swash, swash_json


def numbers(document: Any, most: int = 8) -> Values:
    """What is a number in a JSON document, at most 150 entries."""
    entries = {k: v for k, v in extract.of_json(document, most=most).items() if isinstance(v, float | list)}
    return dict(list(entries.items())[:150])


@case()
def holds_in_flight(folder: Path) -> Values:
    """Closed loops of three vehicles: the hover hold, the state hold in hover and ahead, the autopilot's modes."""
    coax, raptor = sp.vehicle("coax"), sp.vehicle("raptor50")
    hover = sp.trim(coax)
    how: dict[str, Any] = {"controller": sp.hover_hold, "lead": 0.5, "tail": 0.5}
    flights = {"hover_hold": sp.simulate(coax, "doublet:pitch,0.4s,0.05", **how)}
    how["controller"] = sp.state_hold
    flights["state_hold"] = sp.simulate(raptor, "doublet:roll,0.4s,0.02", **how)
    flights["ahead"] = sp.simulate(raptor, "doublet:pitch,0.4s,0.02", speed=8.0, **how)
    for mode in ("manual", "speed", "place"):
        reference = {"pitch": 0.1} if mode == "manual" else {"ahead": 0.3} if mode == "speed" else {"x": 0.2}
        law = sp.autopilot(coax, hover, mode=mode)
        flights[mode] = sp.simulate_closed_loop(coax, law, duration=2.0, reference=reference)
    found: Values = {}
    for name, flight in flights.items():
        channels = ("x", "y", "z", "u", "v", "w", "phi", "theta", "psi", "p", "q", "r", *coax.input_names)
        found |= named(name, extract.of_flight(flight, channels=channels, most=4))
    return found


@case()
def decoupling(folder: Path) -> Values:
    """`swash control decouple` with a step, and the gains in its file."""
    told = swash_json("control", "decouple", "coax", "--step", "0.2", "--lag", "20", "--out", folder / "law.toml")
    return named("told", numbers(told)) | named("file", numbers(toml(folder / "law.toml")))


def toml(path: Path) -> Any:
    """A controller's file."""
    import tomllib

    return tomllib.loads(path.read_text(encoding="utf-8"))


@case()
def decoupling_checked(folder: Path) -> Values:
    """Margins, handling qualities, steps, coupling and gusts of the decoupling autopilot."""
    swash("control", "decouple", "coax", "--mode", "place", "--out", folder / "place.toml", "-q")
    how = ("--settings", "duration=10", "--gusts", "indoor")
    return numbers(swash_json("control", "check", "coax", "--controller", folder / "place.toml", *how))


@case()
def lqg_of_the_coax(folder: Path) -> Values:
    """The design on an IMU and late motion capture, its file, and its check."""
    sensors = ("--sensors", "imu@100,mocap@50+20ms", "--delay", "20")
    told = swash_json("control", "design", "coax", *sensors, "--out", folder / "lqg.toml")
    found = named("told", numbers(told)) | named("file", numbers(toml(folder / "lqg.toml"), 12))
    how = ("--settings", "duration=5", "--gusts", "none")
    checked = swash_json("control", "check", "coax", "--controller", folder / "lqg.toml", *how)
    return found | named("check", numbers(checked))


@case()
def lqg_of_a_state_space_model(folder: Path) -> Values:
    """The 13-state helicopter, and eight of it drawn and flown."""
    sensors = ("--sensors", "gyro@100,mocap@100")
    told = swash_json("control", "design", "thirteen_state", *sensors, "--out", folder / "lqg.toml")
    found = named("told", numbers(told)) | named("file", numbers(toml(folder / "lqg.toml"), 12))
    how = ("--controller", folder / "lqg.toml", "--maneuver", "doublet:lateral,0.5s,0.1", "--vary", "Lb=10%")
    what = ("--count", "8", "--out", folder / "worst.nc")
    swash("control", "monte-carlo", "--vehicle", "thirteen_state", *how, *what, "-q")
    return found | named("worst", extract.of_flight(sp.read(folder / "worst.nc"), most=4))


@case()
def lqr_over_speed(folder: Path) -> Values:
    """Gains of the Raptor over speed, fed with the states, and a constant observer gain beside them."""
    how = ("--method", "lqr", "--holding", "speed", "--speed", "0-10/5")
    told = swash_json("control", "design", "raptor50", *how, "--out", folder / "lqr.toml")
    found = named("told", numbers(told)) | named("file", numbers(toml(folder / "lqr.toml"), 12))
    told = swash_json("control", "design", "coax", "--gain", "steady", "--out", folder / "steady.toml")
    return found | named("steady", numbers(told)) | named("steady.file", numbers(toml(folder / "steady.toml"), 12))


@case()
def monte_carlo_of_the_coax(folder: Path) -> Values:
    """Eight drawn aircraft under the decoupling autopilot."""
    swash("control", "decouple", "coax", "--mode", "place", "--out", folder / "place.toml", "-q")
    how = ("--controller", folder / "place.toml", "--maneuver", "doublet:pitch,0.4s,0.05")
    how = (*how, "--vary", "mass=2%", "--vary", "tau_f_upper=10%")
    more = ("--gusts", "indoor", "--battery", "12.5-11.5", "--payload", "0.01", "--delay", "0.02", "--seed", "2")
    what = ("--count", "8", "--out", folder / "worst.nc", "-q")
    swash("control", "monte-carlo", "--vehicle", "coax", *how, *more, *what)
    return extract.of_flight(sp.read(folder / "worst.nc"), most=6)


@case()
def sensors_and_noise(folder: Path) -> Values:
    """A simulated log with the usual sensors, gaps and outliers, and what conditioning makes of it."""
    coax = sp.vehicle("coax")
    hover = sp.trim(coax)
    series = {name: np.full(601, value) for name, value in hover.commands().items()}
    true = sp.simulate(coax, series, start=hover)
    log = sp.observe(true, coax, sensors=sp.Sensors(), seed=5)
    conditioned = log.condition(rate=100.0, cutoff=0.0)
    return named("log", extract.of_flight(log, most=5)) | named("100", extract.of_flight(conditioned, most=5))
