"""Linear models fitted in time: Jategaonkar's unstable aircraft and his aircraft in turbulence."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from swashplate.errors import IdentificationError
from swashplate.flights.flight import Flight, stream
from swashplate.identification.equation_error import equation_error
from swashplate.identification.linear_time_fit import fit_in_time
from swashplate.identification.state_space import StateSpaceModel
from swashplate.identification.state_space_file import parse, structure


def model(
    name: str, states: str, inputs: str, equations: str, outputs: str, parameters: dict[str, float]
) -> StateSpaceModel:
    lines = [f"{key} = {{value = {value}}}" for key, value in parameters.items()]
    text = f'kind = "state-space"\nname = "{name}"\n[states]\n{states}\n[inputs]\n{inputs}\n[equations]\n{equations}\n'
    return parse(text + outputs + "\n[parameters]\n" + "\n".join(lines))


def test_unstable_aircraft_is_the_truth_within_a_percent(shared_data: Path) -> None:
    rows = np.array((shared_data / "fvsysid" / "unStabAC_sim.asc").read_text(encoding="utf-8").split(), dtype=float)
    time, _, w, q, elevator, az = rows.reshape(251, 6).T
    flight = Flight({"uniform": stream(time, {"w": w, "q": q, "elevator": elevator, "az": az})})
    aircraft = model(
        "unstable",
        'w = "m/s"\nq = "rad/s"',
        'elevator = "rad"',
        'w = {w = "Zw", q = "U0 + Zq", elevator = "Zde"}\nq = {w = "Mw", q = "Mq", elevator = "Mde"}',
        '[outputs.w]\nof = {w = "1"}\n[outputs.q]\nof = {q = "1"}\n'
        '[outputs.az]\nof = {w = "Zw", q = "Zq", elevator = "Zde"}',
        {"U0": 44.5695, "Zq": -1.4768, "Zw": -1.0, "Zde": -5.0, "Mw": 0.1, "Mq": -3.0, "Mde": -10.0},
    )
    held = {name: aircraft.parameters[name].value for name in ("U0", "Zq")}
    fit = fit_in_time(aircraft.with_values(held, free=False), flight, shifts=False)
    text = (shared_data / "fvsysid" / "unstable_aircraft_table9_1.csv").read_text(encoding="utf-8")
    table = {r["method"]: r for r in csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))}
    for name in ("Zw", "Mw", "Mq"):
        assert fit[name].value == pytest.approx(float(table["true"][name]), rel=0.01)
    assert fit.model.eigenvalues()[-1].real > 0.5  # it is unstable


def test_aircraft_in_turbulence_within_the_scatter_of_coloured_errors(shared_data: Path) -> None:
    """Truth from the file's own noise-free columns, where the equations hold to seven digits."""
    text = (shared_data / "fvsysid" / "y13aus_da1.asc").read_text(encoding="utf-8")
    rows = np.array(text.split(), dtype=float).reshape(321, -1)
    names = ("pdot", "rdot", "ay", "p_", "r_", "aileron", "rudder", "vk", "p", "r")
    measured, clean = dict(zip(names, rows[:, 1:11].T, strict=True)), dict(zip(names, rows[:, 11:21].T, strict=True))
    regressors = ("p", "r", "aileron", "rudder", "vk")
    truth = {}
    for output, letters in (("pdot", "L"), ("rdot", "N"), ("ay", "Y")):
        exact = equation_error(clean[output], np.column_stack([clean[n] for n in regressors]), regressors)
        assert exact.determination > 1 - 1e-9
        truth |= {f"{letters}{n}": exact[n] for n in regressors}

    def row(letter: str) -> str:
        return "{" + ", ".join(f'{n} = "{letter}{n}"' for n in regressors) + "}"

    aircraft = model(
        "lateral",
        'p = "rad/s"\nr = "rad/s"',
        'aileron = "rad"\nrudder = "rad"\nvk = "m/s"',
        f"p = {row('L')}\nr = {row('N')}",
        '[outputs.pdot]\nrates = {p = "1"}\n[outputs.rdot]\nrates = {r = "1"}\n'
        f'[outputs.ay]\nof = {row("Y")}\n[outputs.p]\nof = {{p = "1"}}\n[outputs.r]\nof = {{r = "1"}}',
        {name: 0.7 * value for name, value in truth.items()},
    )
    flight = Flight({"uniform": stream(rows[:, 0], {n: v for n, v in measured.items() if n not in ("p_", "r_")})})
    fit = fit_in_time(aircraft, flight, biases=["ay"])
    off = np.array([(fit[n].value - v) / fit[n].cramer_rao for n, v in truth.items()])
    assert np.max(np.abs(off)) < 4.0
    assert np.sqrt(np.mean(off**2)) < 2.5  # gusts colour the errors: the plain bounds are too small by about two
    for name in ("Lp", "Lr", "Laileron", "Lvk", "Nrudder", "Nr", "Yvk", "Yrudder", "Yr"):
        assert fit[name].value == pytest.approx(truth[name], rel=0.03), name


def test_delays_are_refused() -> None:
    nothing = np.zeros(100)
    flight = Flight({"uniform": stream(np.arange(100) * 0.01, {"mixer_collective": nothing, "az": nothing})})
    with pytest.raises(IdentificationError, match="has delays"):
        fit_in_time(structure("heave"), flight)
