"""A real T-Rex 550 beside a gain with a delay and a model from geometry: docs/pictures/helicopter-trex550.png.

    python scripts/trex_figure.py [DATA]

DATA/trex550 holds the record. The errors that docs/explanation/helicopter-comparisons.md quotes are printed.
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
from swashplate.identification.time.linear_simulation import delayed, two_sided
from swashplate.models.conventional.helicopter_vehicle import conventional
from swashplate.models.conventional.new_card import new_card
from swashplate.reporting.theme import BLACK, BLUE, VERMILION
from swashplate.simulation.linearize import LinearModel
from swashplate.simulation.reduction import paper_model

PICTURE = Path(__file__).resolve().parent.parent / "docs" / "pictures" / "helicopter-trex550.png"
RATE = 100.0
SHOWN = 7.0
"""Seconds of the comparison."""
STICKS = {"theta0": "collective", "B1": "longitudinal", "A1": "lateral", "theta0T": "pedal"}

Line = tuple[str, tuple[str, str], Array]
"""Words, colour and dash, and the rate."""


def identified(columns: Mapping[str, Array], time: Array, pair: tuple[str, str]) -> TransferFunctionFit:
    """Gain and delay from a stretch of the record."""
    log = Flight(
        {"uniform": stream(time, {n: columns[n] for n in pair}, {pair[1]: "1"})}, Provenance("sweep", simulated=False)
    )
    responses = respond(log, inputs=[pair[1]], outputs=[pair[0]], band=(0.1, 2.0))
    return fit_transfer_function(responses, "0/0", input=pair[1])


def answered(fit: TransferFunctionFit, columns: Mapping[str, Array], pair: tuple[str, str], here: slice) -> Array:
    """What gain and delay make of the stick; the bias is the flight's mean."""
    model = as_state_space(fit)
    output, source = pair
    moved = delayed(columns[source] - np.mean(columns[source]), model.delay(output, source) * RATE)
    line = float(model.explicit()[3][0, 0]) * moved[here]
    return np.asarray(line + np.mean(columns[output][here]) - np.mean(line))


def behind_sticks(model: LinearModel, columns: Mapping[str, Array], here: slice) -> dict[str, Array]:
    """A linear model whose controls are the sticks times gains: gains, begin and constant rates by least squares."""
    sticks = np.column_stack([columns[f"stick_{STICKS[name]}"][here] for name in model.inputs])
    basis = np.concatenate(two_sided(model.A, model.B, sticks - sticks.mean(axis=0), 1.0 / RATE), axis=2)
    seen = [model.states.index(name) for name in ("p", "q", "r", "phi", "theta")]
    truth = np.column_stack([columns[model.states[i]][here] for i in seen])
    weights = np.linalg.lstsq(basis[:, seen].reshape(-1, basis.shape[2]), truth.ravel(), rcond=None)[0]
    return dict(zip(model.states, (basis @ weights).T, strict=True))


def drawn(title: str, time: Array, rows: Mapping[str, list[Line]]) -> None:
    """A rate in each row; the first line of a row is the flight and sets its scale."""
    figure = Figure(figsize=(8.2, 4.9), layout="constrained")
    panels: Any = figure.subplots(len(rows), 1)
    for panel, (name, lines) in zip(panels, rows.items(), strict=True):
        flown = lines[0][2]
        for words, (color, dash), line in lines:
            off = 100.0 * np.sqrt(np.mean((line - flown) ** 2)) / np.std(flown)
            label = words if line is flown else f"{words}: {off:.0f} %"
            print(f"{name}: {label}")
            panel.plot(time, np.degrees(line), color=color, ls=dash, lw=1.2, label=label)
        first, reach = np.degrees(flown), 0.6 * float(np.ptp(np.degrees(flown)))
        panel.set_ylim(first.min() - reach, first.max() + reach)
        panel.set_ylabel(f"{name} [deg/s]")
        panel.grid(color="#e4e4e4", lw=0.7)
        panel.legend(loc="upper right", ncols=len(lines), frameon=False, fontsize=7)
    panels[-1].set_xlabel("time [s]")
    figure.suptitle(title, fontsize=9)
    figure.savefig(PICTURE, dpi=110, metadata={"Software": None})


def main(file: Path) -> None:
    record = np.genfromtxt(file, delimiter=",", names=True)
    time = np.arange(0.0, record["time"][-1], 1.0 / RATE)
    columns = {name: np.interp(time, record["time"], record[name]) for name in record.dtype.names if name != "time"}
    cut = round(0.66 * time.size)
    here = slice(cut, cut + round(SHOWN * RATE))
    card = conventional(new_card("T-Rex 550, scaled", mass=3.2, radius=0.594, like="raptor50"))
    geometry = behind_sticks(paper_model(sp.linearize(card)), columns, here)
    rows = {}
    for pair in (("p", "stick_lateral"), ("q", "stick_longitudinal")):
        fit = identified({name: values[:cut] for name, values in columns.items()}, time[:cut], pair)
        print(f"{pair[0]}: {fit['K'].value:.2f} rad/s per stick, J {fit.cost:.0f}")
        rows[pair[0]] = [
            ("T-Rex 550", (BLACK, "-"), columns[pair[0]][here]),
            ("gain and delay", (BLUE, "-."), answered(fit, columns, pair, here)),
            ("6 DoF, scaled card, stick gains fitted", (VERMILION, "--"), geometry[pair[0]]),
        ]
    title = "A real flight: T-Rex 550 with its autopilot; gain and delay from the part before (not seen: this one)"
    drawn(title, time[here], rows)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "../shared/data") / "trex550" / "trex550_flight.csv")
