"""The comparisons of Bhandari et al. (AIAA 2005-6422, Figs 2 and 6 to 9), and a T-Rex 550: docs/pictures/helicopter-*.

    python scripts/helicopter_figures.py [DATA]

About two minutes on 2 cores. The paper's flight data are not public: "flight" is the nonlinear Raptor 50 with
stabilizer bar (and without), dynamic inflow, coning, governor and servos, in gusts, under a hold, seen by noisy
sensors. DATA/trex550 holds a real helicopter's record; without it that picture is left out. The docs' errors are
printed.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import swashplate as sp
from swashplate.arrays import Array
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.identification.frequency.transfer_function_fit import (
    TransferFunctionFit,
    as_state_space,
    fit_transfer_function,
)
from swashplate.identification.responses.respond import respond
from swashplate.identification.time.linear_simulation import delayed, free_and_forced
from swashplate.models.conventional.helicopter_vehicle import conventional
from swashplate.models.conventional.new_card import new_card
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.theme import BLACK, BLUE, GREEN, VERMILION
from swashplate.simulation.linearize import LinearModel
from swashplate.simulation.lpv import simulate_lpv
from swashplate.simulation.reduction import LONGITUDINAL, PAPER_INPUTS, PAPER_STATES, paper_model, part, residualise
from swashplate.simulation.wind import dryden, outdoor

PICTURES = Path(__file__).resolve().parent.parent / "docs" / "pictures"
RATE = 100.0
EVERYTHING = {"bar": True, "inflow": "pitt-peters", "coning": True, "rotor_speed": "governed", "servos": True}
NOISE = {**dict.fromkeys(("u", "v", "w"), 0.05), **dict.fromkeys(("p", "q", "r"), 0.01), "phi": 0.005, "theta": 0.005}
"""Standard deviations of the sensors [m/s, rad/s, rad]."""
UNITS = {"u": "m/s", "v": "m/s", "w": "m/s", "p": "rad/s", "q": "rad/s", "r": "rad/s", "phi": "rad", "theta": "rad"}
WEIGHT = {"rad": np.degrees(1.0), "rad/s": np.degrees(1.0), "m/s": 1.0 / 0.3048}
"""1 deg, 1 deg/s and 1 ft/s weigh alike."""
SHOWN = 7.0
"""Seconds of a comparison, as in the paper."""
MEAN_WIND = 2.0


Line = tuple[str, tuple[str, str], Mapping[str, Array]]
"""Words, colour and dash, and a column for each channel."""


def flight(axis: str, *, seed: int, bar: bool) -> tuple[Array, dict[str, Array]]:
    """Time and channels of a sweep in hover; the inputs are where the servos stand, as the paper's transducers tell."""
    flown = sp.vehicle("raptor50", **{**EVERYTHING, "bar": bar})
    length = 60.0
    gusts = dryden(outdoor(MEAN_WIND), samples=round((length + 6.0) * RATE) + 1, rate=RATE, seed=seed)
    log = sp.simulate_maneuver(
        flown,
        f"sweep:{axis},0.3-4Hz,{length:g}s,0.03",
        controller=sp.state_hold,
        wind={name: series[:, 0] for name, series in gusts.items()},
        rate=RATE,
    )
    random = np.random.default_rng(seed)
    columns = {name: log.values(name) + NOISE[name] * random.standard_normal(len(log.time(name))) for name in UNITS}
    columns |= {name: log.values(f"{name}_servo") for name in PAPER_INPUTS}
    return log.time("q"), columns


def linear(model: LinearModel, columns: Mapping[str, Array], here: slice) -> tuple[dict[str, Array], Array, Array]:
    """A linear model along a stretch: its states, the deviation it begins with, and the shifts of the controls.

    Where the helicopter begins and where its controls' zeros are is solved for by least squares, as the book does
    (Tischler and Remple 2012, ch. 14); everything that moves comes from the model and the measured controls.
    """
    inputs = np.column_stack([columns[name][here] - np.mean(columns[name]) for name in model.inputs])
    forced, started, pushed = free_and_forced(model.A, model.B, inputs, 1.0 / RATE)
    at = model.trim.states()
    seen = [i for i, name in enumerate(model.states) if name in UNITS]
    basis = np.concatenate([started, pushed @ model.B], axis=2)
    truth = np.column_stack([columns[model.states[i]][here] - at[model.states[i]] for i in seen])
    weights = np.array([WEIGHT[UNITS[model.states[i]]] for i in seen])
    rows = (basis[:, seen] * weights[:, None]).reshape(-1, basis.shape[2])
    constants = np.linalg.lstsq(rows, ((truth - forced[:, seen]) * weights).ravel(), rcond=None)[0]
    states = forced + basis @ constants
    n = len(model.states)
    return {name: states[:, i] + at[name] for i, name in enumerate(model.states)}, constants[:n], constants[n:]


def six_degrees(card: Vehicle, columns: Mapping[str, Array], here: slice) -> dict[str, Array]:
    """The paper's LPV model as printed along a stretch; begin and shifts of the controls by least squares."""
    start = sp.trim(card)
    model = paper_model(sp.linearize(card))
    _, begin, shifts = linear(model, columns, here)
    fine, n = 5, len(columns["q"][here])
    at = np.arange((n - 1) * fine + 1) / fine
    moved = {name: np.interp(at, np.arange(n), columns[name][here] - np.mean(columns[name])) for name in PAPER_INPUTS}
    truth = np.column_stack([columns[name][here] for name in PAPER_STATES])
    weights = np.array([WEIGHT[UNITS[name]] for name in PAPER_STATES])

    def flown(constants: Array) -> Array:
        initial = {name: start.states()[name] + constants[i] for i, name in enumerate(PAPER_STATES)}
        controls = {
            name: start.commands()[name] + moved[name] + constants[8 + i] for i, name in enumerate(PAPER_INPUTS)
        }
        log = simulate_lpv(card, controls, start=start, scheme="as-printed", initial=initial, rate=fine * RATE)
        return log.array(PAPER_STATES)[::fine]

    def misfit(constants: Array) -> Array:
        residual = np.nan_to_num((flown(constants) - truth) * weights, nan=1e3, posinf=1e3, neginf=-1e3)
        return np.clip(residual, -1e3, 1e3).ravel()

    constants = np.concatenate([begin, shifts])
    step = np.array([1e-3] * 8 + [1e-5] * 4)
    for _ in range(15):  # Gauss and Newton, with a step that is halved until the misfit shrinks
        now = misfit(constants)
        slope = np.column_stack([(misfit(constants + step * unit) - now) / (step @ unit) for unit in np.eye(12)])
        change = -np.linalg.lstsq(slope, now, rcond=None)[0]
        halves = (constants + change * 0.5**k for k in range(8))
        better = next((tried for tried in halves if np.sum(misfit(tried) ** 2) < np.sum(now**2)), None)
        if better is None:
            break
        constants = better
    return dict(zip(PAPER_STATES, flown(constants).T, strict=True))


def identified(
    columns: Mapping[str, Array],
    time: Array,
    pair: tuple[str, str],
    form: str,
    *,
    band: tuple[float, float] = (0.3, 4.0),
) -> TransferFunctionFit:
    """A transfer function from a whole record."""
    names = dict.fromkeys((pair[1],), "1")
    log = Flight({"uniform": stream(time, {n: columns[n] for n in pair}, names)}, Provenance("sweep", simulated=True))
    return fit_transfer_function(respond(log, inputs=[pair[1]], outputs=[pair[0]], band=band), form, input=pair[1])


def answered(fit: TransferFunctionFit, columns: Mapping[str, Array], pair: tuple[str, str], here: slice) -> Array:
    """What a transfer function makes of the measured input; a bias is the flight's mean, as in the paper."""
    model = as_state_space(fit)
    a, b, c, d = model.explicit()
    output, source = pair
    moved = delayed(columns[source] - np.mean(columns[source]), model.delay(output, source) * RATE)[:, None]
    states = free_and_forced(a, b, moved, 1.0 / RATE)[0] if a.size else np.zeros((len(moved), 0))
    out = (states @ c.T + moved @ d.T)[here, 0]
    return np.asarray(out + np.mean(columns[output][here]) - np.mean(out))


def error(line: Array, truth: Array) -> float:
    """Root mean square of the difference over that of the flight's deviation from its mean [%]."""
    return float(100.0 * np.sqrt(np.mean((line - truth) ** 2)) / np.std(truth))


def drawn(title: str, rows: list[tuple[str, Array, list[Line]]], path: Path) -> None:
    """A channel over time in each row; the first line of a row is the flight and sets its scale."""
    figure = Figure(figsize=(8.2, max(1.25, 4.0 / len(rows)) * len(rows) + 0.9), layout="constrained")
    panels: Any = np.atleast_1d(figure.subplots(len(rows), 1))
    for panel, (name, time, row) in zip(panels, rows, strict=True):
        unit, factor = UNITS[name], 1.0
        if unit.startswith("rad"):
            unit, factor = unit.replace("rad", "deg"), np.degrees(1.0)
        first = factor * row[0][2][name]
        for words, (color, dash), columns in row:
            if name in columns:
                off = error(columns[name], row[0][2][name])
                label = words if columns is row[0][2] else f"{words}: {off:.0f} %"
                panel.plot(time, factor * columns[name], color=color, ls=dash, lw=1.2, label=label)
        reach = 0.6 * float(np.ptp(first))
        panel.set_ylim(first.min() - reach, first.max() + reach)
        panel.set_ylabel(f"{name} [{unit}]")
        panel.grid(color="#e4e4e4", lw=0.7)
        panel.legend(loc="upper right", ncols=len(row), frameon=False, fontsize=7)
    panels[-1].set_xlabel("time [s]")
    figure.suptitle(title, fontsize=9)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110, metadata={"Software": None})
    print(path.name)
    for name, _, row in rows:
        print(
            f"  {name}: "
            + ", ".join(f"{w} {error(c[name], row[0][2][name]):.0f} %" for w, _, c in row[1:] if name in c)
        )


SAID = "THE FLIGHT IS A SIMULATION: nonlinear Raptor 50, gusts, noise. Errors: rms, % of the flight's deviation"


def paper_figures() -> None:
    """Figs 2 and 6 to 9."""
    card = sp.vehicle("raptor50")
    six = paper_model(sp.linearize(card))
    barred = sp.linearize(sp.vehicle("raptor50", bar=True))
    twelve = residualise(barred, (*PAPER_STATES, "a1", "b1", "c", "d"))
    here = slice(round(30.0 * RATE), round((30.0 + SHOWN) * RATE))
    black, red, blue, green = (BLACK, "-"), (VERMILION, "--"), (BLUE, "-."), (GREEN, ":")
    for axis, pair, number in (("pitch", ("q", "B1"), 6), ("roll", ("p", "A1"), 7)):
        rates: list[tuple[str, Array, list[Line]]] = []
        for bar in (False, True):
            row: list[Line]
            time, columns = flight(axis, seed=3, bar=bar)
            shown: dict[str, Array] = {name: columns[name][here] for name in UNITS}
            words = "flight with the bar" if bar else "flight without the bar"
            if bar:
                model = ("with bar and flapping, 12 states", red, linear(twelve, columns, here)[0])
            else:
                model = ("6 DoF as printed", red, six_degrees(card, columns, here))
                title = f"Fig. {number}: {axis} sweep in hover, LPV with six degrees of freedom.\n{SAID}"
                row = [(words, black, shown), model]
                drawn(
                    title,
                    [(name, time[here], row) for name in PAPER_STATES],
                    PICTURES / f"helicopter-figure-{number}.png",
                )
            if axis == "pitch" and not bar:
                three = linear(part(six, *LONGITUDINAL), columns, here)[0]
                full = linear(six, columns, here)[0]
                row = [(words, black, shown), ("3 DoF", blue, three), ("6 DoF", red, full)]
                drawn(
                    f"Fig. 2: pitch sweep in hover, three and six degrees of freedom.\n{SAID}",
                    [(name, time[here], row) for name in ("u", "w", "q", "theta")],
                    PICTURES / "helicopter-figure-2.png",
                )
            row = [(words, black, shown), model]
            for form, name, style in (("0/0", "gain and delay", blue), ("1/2", "one zero, two poles", green)):
                fit = identified(columns, time, pair, form)
                print(f"  {fit.solution[0]!r}   J = {fit.cost:.0f}")
                row.append((name, style, {pair[0]: answered(fit, columns, pair, here)}))
            rates.append((pair[0], time[here], row))
        title = f"Fig. {number + 2}: {pair[0]} in the {axis} sweep, with identified transfer functions.\n{SAID}"
        drawn(title, rates, PICTURES / f"helicopter-figure-{number + 2}.png")


_STICKS = {"theta0": "collective", "B1": "longitudinal", "A1": "lateral", "theta0T": "pedal"}


def behind_sticks(model: LinearModel, columns: Mapping[str, Array], here: slice) -> dict[str, Array]:
    """A linear model whose controls are the sticks times gains: gains, begin and zeros by least squares."""
    sticks = np.column_stack([columns[f"stick_{_STICKS[name]}"][here] for name in model.inputs])
    sticks = sticks - sticks.mean(axis=0)
    bases = []
    for i in range(sticks.shape[1]):
        forced, started, pushed = free_and_forced(model.A, model.B[:, [i]], sticks[:, [i]], 1.0 / RATE)
        bases.append(forced[:, :, None])
    basis = np.concatenate([*bases, started, pushed @ model.B], axis=2)
    seen = [model.states.index(name) for name in ("p", "q", "r", "phi", "theta")]
    truth = np.column_stack([columns[model.states[i]][here] for i in seen])
    weights = np.linalg.lstsq(basis[:, seen].reshape(-1, basis.shape[2]), truth.ravel(), rcond=None)[0]
    return dict(zip(model.states, (basis @ weights).T, strict=True))


def trex_figure(file: Path) -> None:
    """A real T-Rex 550: gain and delay from its first two thirds, flown along the rest; a model from geometry too."""
    rows = np.genfromtxt(file, delimiter=",", names=True)
    time = np.arange(0.0, rows["time"][-1], 1.0 / RATE)
    columns = {name: np.interp(time, rows["time"], rows[name]) for name in rows.dtype.names if name != "time"}
    cut = round(0.66 * time.size)
    here = slice(cut, cut + round(SHOWN * RATE))
    card = conventional(new_card("T-Rex 550, scaled", mass=3.2, radius=0.594, like="raptor50"))
    model = paper_model(sp.linearize(card))
    geometry = behind_sticks(model, columns, here)
    lines: list[tuple[str, Array, list[Line]]] = []
    for pair in (("p", "stick_lateral"), ("q", "stick_longitudinal")):
        fit = identified(
            {name: values[:cut] for name, values in columns.items()}, time[:cut], pair, "0/0", band=(0.1, 2.0)
        )
        print(f"  {fit.solution[0]!r}   J = {fit.cost:.0f}")
        row: list[Line] = [
            ("T-Rex 550", (BLACK, "-"), {pair[0]: columns[pair[0]][here]}),
            ("gain and delay", (BLUE, "-."), {pair[0]: answered(fit, columns, pair, here)}),
            ("6 DoF, scaled card, stick gains fitted", (VERMILION, "--"), geometry),
        ]
        lines.append((pair[0], time[here], row))
    title = "A real flight: T-Rex 550 with its autopilot; gain and delay from the part before (not seen: this one)"
    drawn(title, lines, PICTURES / "helicopter-trex550.png")


def main() -> int:
    paper_figures()
    file = Path(sys.argv[1] if len(sys.argv) > 1 else "../shared/data") / "trex550" / "trex550_flight.csv"
    if file.is_file():
        trex_figure(file)
    else:
        print(f"{file} is missing: no picture of the T-Rex 550.")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
