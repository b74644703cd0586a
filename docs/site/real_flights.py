"""Both real CoaX flights, each predicted by what the other one taught: docs/real-flights.md and what quotes it.

    python docs/site/real_flights.py

About five minutes on 2 cores. Everything on the page is computed here; nothing is typed in.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from docs_pages import regenerated
from prediction_picture import prediction_picture

import swashplate as sp
from swashplate.validation.floors import CLOSED_ROWS, ROWS
from swashplate.validation.validation import PREDICTORS

ROOT = Path(__file__).resolve().parents[2]
FLIGHTS = {"august": "coax56/flight_2011-08-01_vertical", "july": "coax56/flight_2011-07-25_hover_crash"}
CHANNELS = ("u", "v", "w", "phi", "theta", "psi", "p", "q", "r")
CHOICE, HORIZON, CLOSED = "balanced", (0.25, 1.0), ("yaw",)
"""By blocked cross-validation inside each flight (`research/choose_by_blocks.py`, decision 99)."""
WANTED = {0.5: ("phi", "theta", "p", "q", "u", "v"), 1.0: ("phi", "theta", "p", "q"), 2.0: ("phi", "theta", "p", "q")}
"""Where the model is to beat every rival: horizon [s] and channels."""


def table(validation: sp.Validation, channels: Sequence[str], horizons: Sequence[float]) -> str:
    """Prediction fit [%] of every predictor."""
    lines = ["| ahead | predictor | " + " | ".join(channels) + " |", "|" + " --- |" * (2 + len(channels))]
    for horizon in horizons:
        for predictor in PREDICTORS:
            fits = [validation.score(name, horizon, predictor).fit for name in channels]
            strong = "**" if predictor == "model" else ""
            cells = " | ".join(f"{strong}{fit:.0f}{strong}" for fit in fits)
            lines.append(f"| {horizon:g} s | {predictor} | {cells} |")
        closed = {f.channel: f.fit for f in validation.loop_closed if f.horizon == horizon}
        cells = " | ".join(f"{closed[name]:.0f}" for name in channels)
        lines.append(f"| {horizon:g} s | model, {' and '.join(CLOSED)} loop closed | {cells} |")
    return "\n".join(lines)


def beside(validation: sp.Validation, channels: Sequence[str], horizon: float) -> str:
    """What the scores stand beside: interval, error, movement, what others reach, and the closed loop."""
    floors = [validation.floor(name, horizon) for name in channels]
    closed = {f.channel: f for f in validation.loop_closed if f.horizon == horizon}
    rows = [("model", lambda f: f"{f.fit:.0f}"), *ROWS]
    rows += [(f"loop closed: {words}", lambda f, cell=cell: cell(closed[f.channel])) for words, cell in CLOSED_ROWS[1:]]
    lines = [f"| {horizon:g} s ahead | " + " | ".join(channels) + " |", "|" + " --- |" * (1 + len(channels))]
    lines += [f"| {words} | {' | '.join(cell(f) for f in floors)} |" for words, cell in rows]
    return "\n".join(lines)


def missed(validation: sp.Validation) -> list[str]:
    """Where a rival is at least as good although it should not be, and how sure that is."""
    lines = []
    for horizon, channels in WANTED.items():
        for name in channels:
            own = validation.score(name, horizon).fit
            rivals = {p: validation.score(name, horizon, p).fit for p in PREDICTORS if p != "model"}
            best = max(rivals, key=lambda p: rivals[p])
            if own <= rivals[best]:
                told = validation.floor(name, horizon)
                sure = f"{told.lead:+.1f} points, 95 % from {told.lead_low:+.1f} to {told.lead_high:+.1f}"
                lines.append(f"{name} at {horizon:g} s: {own:.1f} %, {best} {rivals[best]:.1f} % ({sure})")
    return lines


def parameters(fit: sp.Result[Any, Any]) -> str:
    lines = [
        "| parameter | unit | published | identified | ± σ (corrected) | |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for e in fit.estimates:
        if not e.tie:
            bound = "at its bound" if e.at_bound else ""
            unit = e.unit or "1"
            lines.append(f"| `{e.name}` | {unit} | {e.start:.4g} | {e.value:.4g} | {e.sigma_corrected:.2g} | {bound} |")
    return "\n".join(lines)


def of_the_flight(fit: sp.Result[Any, Any]) -> str:
    units = {"1": ""}
    return ", ".join(
        f"{e.name} {e.value:.3f} ± {e.sigma:.2g} {units.get(e.unit, e.unit)}".rstrip() for e in fit.constants
    )


def section(learnt: str, predicted: str, fit: sp.Result[Any, Any], validation: sp.Validation) -> str:
    """One direction: what was identified, how it predicts, what is missed, the verdict."""
    misses = missed(validation)
    total = sum(len(channels) for channels in WANTED.values())
    told = f"Of {total} comparisons that the model should win it loses {len(misses)}" + (": " if misses else ".")
    lines = [
        f"## Learnt in {learnt.capitalize()}, predicting {predicted.capitalize()}",
        f"{'Converged' if fit.converged else 'Not converged'} after {len(fit.history) - 1} iterations, "
        f"{fit.settings['rate']:.0f} Hz, records: {', '.join(fit.settings['records'])}.",
        parameters(fit),
        f"Of the flight and not of the vehicle: {of_the_flight(fit)}.",
        *(f"* {problem}" for problem in fit.problems),
        f"Prediction fit [%] on the other flight (records: {', '.join(validation.settings['records'])}):",
        table(validation, CHANNELS, (0.5, 1.0, 2.0, 5.0)),
        told + "; ".join(misses),
        "What the scores stand beside ([what each row means](explanation/validation.md)):",
        beside(validation, CHANNELS, 0.5),
        beside(validation, CHANNELS, 1.0),
        "\n".join(f"* {law.summary_text}" for law in validation.laws),
        "\n".join(f"* {v.axis}: **{v.level}**. {v.words}" for v in validation.verdict),
    ]
    return "\n\n".join(lines)


def main() -> int:
    flights = {name: sp.read(where).condition(rate=100.0, cutoff=0.0) for name, where in FLIGHTS.items()}
    sections = []
    for learnt, predicted in (("august", "july"), ("july", "august")):
        coax = sp.vehicle("coax")
        fit = sp.identify(coax, flights[learnt], free=CHOICE, horizon=HORIZON, keep_unexcited=True)
        validation = sp.validate(fit, flights[predicted], close_loop=CLOSED)
        sections.append(section(learnt, predicted, fit, validation))
        title = f"Learnt in {learnt.capitalize()} 2011, predicting {predicted.capitalize()}"
        prediction_picture(
            validation, path=ROOT / "docs" / "pictures" / f"{learnt}_predicts_{predicted}.png", title=title
        )
        print(validation, "\n")
    command = (
        f"--free {CHOICE} --horizon {HORIZON[0]:g},{HORIZON[1]:g} --keep-unexcited --close-loop {','.join(CLOSED)}"
    )
    said = f"Written by `docs/site/real_flights.py`; do not edit. As `swash identify` with `{command}` makes it."
    page = "\n\n".join(["# The real flights", said, *sections])
    (ROOT / "docs" / "real-flights.md").write_text(page + "\n", encoding="utf-8")
    for quoting in (ROOT / "README.md", ROOT / "docs" / "explanation" / "what-to-trust.md"):
        quoting.write_text(regenerated(quoting.read_text(encoding="utf-8")), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
