"""Golden cases of models: cards, trims, linear models, derivatives, open-loop flights, maneuvers, logs looked at."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import swashplate as sp
from swashplate.flights.maneuvers.series import parse
from swashplate.models.linear.linear_vehicle import structure_of

from . import extract
from .case import Values, apart, case, named, thinned
from .extract import swash, swash_json

HELICOPTERS = ("raptor50", "xcell60", "helion", "rmax", "r50", "lynx")
SPEEDS = {"coax": "0", "lynx": "0-40/20"}
"""Speeds ahead [m/s] of the trims; 0, 5 and 10 of the others."""
STRUCTURES = (
    "six_dof", "six_dof_coupled", "hybrid", "eleven_state", "thirteen_state", "coaxial", "rotor_body", "heave", "yaw",
)  # fmt: skip


NOTHING = 1e-9
"""An entry of a matrix below this is a zero with rounding."""


@case(light=True)
def cards(folder: Path) -> Values:
    """Every number of every packaged card."""
    return {
        f"{name}.{key}": float(value)
        for name in ("coax", *HELICOPTERS)
        for key, value in sorted(sp.vehicle(name).card.values().items())
    }


@case(light=True)
def state_space_structures(folder: Path) -> Values:
    """The ready structures with their start values."""
    found: Values = {}
    for name in STRUCTURES:
        model = structure_of(sp.structure(name))
        found[f"{name}.eigenvalues"] = sorted_values(model.eigenvalues())
        found[f"{name}.response"] = thinned(model.response(np.array([2.0, 12.0])), 24)
        found |= apart(f"{name}.values", thinned(list(model.numbers().values()), 16))
    return found


def sorted_values(values: Any) -> list[float]:
    """Complex numbers by modulus, real and imaginary parts apart, those about the origin left out.

    Chains of integrators leave eigenvalues of rounding's root there.
    """
    kept = np.asarray(values)[np.abs(values) > 1e-3]
    order = np.lexsort((kept.imag.round(6), kept.real.round(6), np.abs(kept).round(6)))
    return thinned(kept[order], 48)


def trimmed(name: str) -> Values:
    """Trims over speed and the linear model of the first one, row by row; modes of all."""
    speeds = SPEEDS.get(name, "0-10/5")
    found: Values = {}
    for told in swash_json("vehicle", "trim", name, "--speed", speeds)["trims"]:
        at = f"{told['speed']:g}"
        found |= {f"{at}.{key}": value for key, value in (told["inputs"] | told["states"]).items()}
        if told.get("power") is not None:
            found[f"{at}.power"] = told["power"]
    for k, model in enumerate(swash_json("vehicle", "linearize", name, "--speed", speeds)["models"]):
        at = f"{model['speed']:g}"
        for matrix, columns in (("A", model["states"]), ("B", model["inputs"])) if k == 0 else ():
            for state, row in zip(model["states"], model[matrix], strict=True):
                entries = {name: value for name, value in zip(columns, row, strict=True) if abs(value) > NOTHING}
                found |= named(f"{at}.{matrix}.{state}", entries)
        found[f"{at}.eigenvalues"] = sorted_values(np.linalg.eigvals(np.array(model["A"])))
    return found


def _trims_of(name: str) -> Callable[[Path], Values]:
    def compute(folder: Path) -> Values:
        return trimmed(name)

    compute.__name__ = f"trims_{name}"
    return compute


for _name in ("coax", *HELICOPTERS):
    case(light=_name in ("coax", "raptor50"))(_trims_of(_name))


@case()
def trims_off_the_straight(folder: Path) -> Values:
    """Climbing, sidewards, turning, in wind, higher up, heavier, with another option."""
    found: Values = {}
    for label, how in {
        "climb": ("--climb", "2"),
        "lateral": ("--settings", "lateral=3"),
        "turn": ("--speed", "6", "--settings", "turn=10"),
        "wind": ("--settings", "wind=3,1,0.2"),
        "high and heavy": ("--settings", "altitude=1500", "--set", "mass=9.0"),
        "bar": ("--set", "bar=true"),
    }.items():
        (told,) = swash_json("vehicle", "trim", "raptor50", *how)["trims"]
        found |= named(label, told["inputs"] | told["states"])
    for label, how in {"full": (), "flapping": ("--form", "flapping"), "paper": ("--form", "paper")}.items():
        vehicle = "coax" if label == "full" else "raptor50"
        (model,) = swash_json("vehicle", "linearize", vehicle, *how)["models"]
        found[f"{label}.eigenvalues"] = sorted_values(np.linalg.eigvals(np.array(model["A"])))
    return found


@case(light=True)
def derivatives_by_contributor(folder: Path) -> Values:
    """Of the Raptor at 8 m/s."""
    (table,) = swash_json("vehicle", "derivatives", "raptor50", "--speed", "8")["tables"]
    return by_contributor(table)


def by_contributor(table: Any) -> Values:
    """A derivative's value and the parts that make it."""
    return {
        name: [float(told["value"]), *(float(v) for v in told["by"].values())]
        for name, told in table["derivatives"].items()
    }


@case()
def derivatives_of_the_others(folder: Path) -> Values:
    """Of every helicopter in hover and at 10 m/s, and their bounds from the card's tolerances."""
    found: Values = {}
    for name in HELICOPTERS:
        for table in swash_json("vehicle", "derivatives", name, "--speed", "0-10/10")["tables"]:
            values = {key: float(told["value"]) for key, told in table["derivatives"].items()}
            for letter in "XYZLMN":
                chosen = [v for k, v in values.items() if k.startswith(letter)]
                found |= apart(f"{name}.{table['speed']:g}.{letter}", thinned(chosen, 3))
    how = ("--uncertainty", "--draws", "20", "--seed", "3")
    told = swash_json("vehicle", "derivatives", "raptor50", "--speed", "5", *how)
    return found | named("bounds", dict(list(extract.of_json(told, without=("by", "unit"), most=6).items())[:120]))


@case()
def open_loop_flights(folder: Path) -> Values:
    """A doublet on every input of every vehicle from hover, and of two in forward flight and wind, for 2 s."""
    found: Values = {}
    time = np.arange(201) / 100.0
    for name in ("coax", *HELICOPTERS):
        vehicle = sp.vehicle(name)
        hover = sp.trim(vehicle)
        found |= {f"{name}.{k}": v for k, v in flown(vehicle, hover, time).items()}
    for name, speed in (("raptor50", 8.0),):
        vehicle = sp.vehicle(name)
        start = sp.trim(vehicle, speed=speed)
        found |= {f"{name}.{speed:g}.{k}": v for k, v in flown(vehicle, start, time, wind_east=1.0).items()}
    return found


def flown(vehicle: Any, start: Any, time: Any, **around: float) -> Values:
    """The states at a few samples of a doublet on all inputs, one after the other."""
    commands = start.commands()
    series = {}
    for k, (name, value) in enumerate(commands.items()):
        since = time - 0.2 - 0.3 * k
        unit = np.where((since >= 0) & (since < 0.15), 1.0, np.where((since >= 0.15) & (since < 0.3), -1.0, 0.0))
        low, high = dict(zip(vehicle.input_names, vehicle.input_limits, strict=True))[name]
        series[name] = np.clip(value + 0.02 * min(high - low, 1.0) * unit, low, high)
    flight = sp.simulate(vehicle, series | around, start=start, rate=100.0)
    return extract.of_flight(flight, channels=vehicle.state_names, most=4)


@case(light=True)
def maneuvers(folder: Path) -> Values:
    """Every kind of maneuver as a series, and what the design rules say."""
    found: Values = {}
    time = np.arange(-1.0, 70.0, 0.01)
    for text in (
        "sweep:pitch,0.5-8Hz,60s,0.1",
        "multisine:roll+pitch+yaw,0.2-6Hz,30s,0.15",
        "sine:roll,2Hz,10s,0.1",
        "doublet:roll,0.5s,0.2",
        "step:heave,2s,0.05",
        "3211:yaw,0.3s,0.005",
        "pulse:pitch,0.4s,0.1",
    ):
        maneuver = parse(text)
        label = text.partition(",")[0]
        for axis, signal in maneuver.signals(time).items():
            busy = time[np.abs(signal) > 0]
            span = (time >= busy[0]) & (time <= busy[-1])
            found[f"{label}.{axis}"] = thinned(signal[span], 8)
            found[f"{label}.{axis}.energy"] = float(np.sum(signal**2))
    swash("maneuver", "sweep:roll,0.5-8Hz,30s,0.1", "--out", folder / "sweep.csv", "--ardupilot")
    rows = np.genfromtxt(folder / "sweep.csv", delimiter=",", skip_header=1)
    found["ardupilot"] = thinned(rows[np.isfinite(rows).all(axis=1)], 60)
    told = swash_json("maneuver", "multisine:roll+pitch,0.2-6Hz,30s,0.15", "--noise", "0.01", "--gain", "0.5")
    return found | {f"rules.{k}": v for k, v in extract.of_json(told).items() if not isinstance(v, str)}


@case(light=True, data=["coax56"])
def inspected_coax56(folder: Path) -> Values:
    """What `swash inspect` measures in a real flight."""
    told = swash_json("inspect", "coax56/flight_2011-07-25_hover_crash")
    return {k: v for k, v in extract.of_json(told, most=4).items() if isinstance(v, float | list)}


@case(data=["ardupilot_sitl", "logs"])
def inspected_autopilot_logs(folder: Path) -> Values:
    """The same of autopilots' logs."""
    from .cases_flights import data

    found: Values = {}
    for name in ("ardupilot_sitl/heli_sid_roll_mix.BIN", "logs/2016-07-14_06_53_11.px4log"):
        told = swash_json("inspect", data() / name)
        short = name.rpartition("/")[2][:8]
        entries = {k: v for k, v in extract.of_json(told, most=3).items() if isinstance(v, float | list)}
        found |= {f"{short}.{k}": v for k, v in list(entries.items())[:150]}
    return found


@case(data=["coax56"])
def bench_records(folder: Path) -> Values:
    """The real bench: speed maps and voltage sweeps."""
    from .cases_flights import data

    found: Values = {}
    for label, files in {
        "coax56": [f"coax56/bench_{n}.mat" for n in ("input_to_rpm", "voltage_to_rpm", "rpm_voltage_compensated")],
    }.items():
        told = swash_json("bench", *(data() / file for file in files))
        one = {k: v for k, v in extract.of_json(told, most=8).items() if isinstance(v, float | list)}
        found |= {f"{label}.{k}": v for k, v in one.items()}
    return found


@case()
def virtual_bench(folder: Path) -> Values:
    """Records of the virtual bench and the card that comes out of them."""
    swash("bench", "simulate", folder / "records", "--seed", "1", "--quiet")
    told = swash_json("bench", folder / "records", "--out", folder / "card.toml")
    found = {k: v for k, v in extract.of_json(told, most=4).items() if isinstance(v, float)}
    card = sp.vehicle(folder / "card.toml").card.values()
    return dict(list(found.items())[:200]) | named("card", {k: float(v) for k, v in sorted(card.items())})
