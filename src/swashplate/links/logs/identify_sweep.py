"""From a sweep to gains: the public verbs one after the other, each told to whoever watches, each stoppable."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.atomic import write_bytes, write_text
from swashplate.errors import SwashError
from swashplate.flights.csv_export import write_csv
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.sweeps import Sweep
from swashplate.flights.schema import channel
from swashplate.links.logs import code_lines
from swashplate.links.logs.hold_out import Part, hold_out, part_of
from swashplate.links.logs.opened import Opened
from swashplate.links.logs.sweep_channels import Channels
from swashplate.public import resolve

Make = Callable[[], Path]
"""Makes a file and says where it lies."""
Tell = Callable[[str, float], None]
"""Is told what is being done, and the share that is done; stops the work by raising."""
_GYRO = "INS_GYRO_FILTER"


@dataclass(frozen=True)
class Identified:
    """What came of a sweep.

    Attributes:
        document: what the page shows.
        files: what makes each, by the name under which it is downloaded.
    """

    document: dict[str, Any]
    files: Mapping[str, Make]


def identify_sweep(
    opened: Opened, sweep: Sweep, chosen: Channels, *, others: Sequence[Opened], folder: Path, tell: Tell
) -> Identified:
    """Responses, transfer function, verification in time, gains with their answers, and the files.

    Args:
        opened: the log of the sweep. others: logs that may serve for the verification.
        chosen: input, output and reference.
        folder: for the files.
        tell: hears the steps.

    Raises:
        SwashError: where a verb refuses; its words say why.
    """
    flight = opened.ready
    tell("bringing the sweep to one rate", 0.02)
    start, stop = part_of(flight, sweep)
    names = [chosen.input, chosen.output, *([chosen.reference] if chosen.reference else [])]
    records = resolve("uniform_records")(flight.between(start, stop), names)
    tell("computing the frequency response", 0.08)
    band = (float(f"{sweep.low:.3g}"), float(f"{sweep.high:.3g}"))
    references = [chosen.reference] if chosen.reference else []
    responses = resolve("respond")(
        records, inputs=[chosen.input], outputs=[chosen.output], references=references, band=band
    )
    tell("fitting transfer functions", 0.15)
    seen = hold_out(opened, sweep, chosen.input, chosen.output, others)

    def say(what: str, *, done: float = 0.0, total: float | None = None, note: str = "") -> None:
        tell(f"{what}, structure {done + 1:.0f} of {total:.0f}" if total else what, 0.15 + 0.65 * done / (total or 1e9))

    study, gained = _study(responses, chosen, seen.flight.between(seen.start, seen.stop), say)
    tell("closing the loop with the gains", 0.85)
    stretch = (seen.read, seen.start, seen.stop)
    code = code_lines.identified(
        opened.read, (start, stop), chosen, band, stretch, gains=not gained, unseen=seen.unseen
    )
    document = {
        "words": str(sweep),
        "input": chosen.input,
        "output": chosen.output,
        "reference": chosen.reference,
        "bode": _bode(responses, study, chosen),
        "fit": _fit(study),
        "warnings": [
            *responses.warnings,
            *responses.problems,
            *study.remarks,
            *(study.fit.warnings if study.fit else ()),
        ],
        "verification": _verified(study, chosen, seen),
        "gains": [_gains(suggestion) for suggestion in study.material.gains],
        "no_gains": gained,
        "code": code.as_dict(),
    }
    files = _files(study, responses, records[0], flight.between(start, stop), folder)
    return Identified({**document, "files": list(files)}, files)


def _study(responses: Any, chosen: Channels, part: Flight, say: Callable[..., None]) -> tuple[Any, str]:
    """The fit with its verification and gains, and why there are no gains where there are none."""
    fit_tf = resolve("fit_tf")
    study = fit_tf(responses, input=chosen.input, say=say)
    form = str(study.material.transfer_functions[0].details.form.text)
    held = (part,) if study.structure is not None else ()
    words, gains = "", True
    try:
        resolve("suggest_gains")(study.fit, responses)
    except SwashError as error:
        words, gains = f"{error.problem} {error.hint or ''}", False
    # Once more with the form that was chosen: the same fit, with what is asked of it.
    made = fit_tf(responses, input=chosen.input, form=form, gains=gains, hold_out=held)
    return made, words


def _decibels(h: Complex) -> Array:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(20.0 * np.log10(np.abs(h)))


def _phase(h: Complex) -> Array:
    """Degrees without turns, NaN where there is no number."""
    phase = np.full(h.shape, np.nan)
    good = np.isfinite(h)
    phase[good] = np.degrees(np.unwrap(np.angle(h[good])))
    return phase


def _bode(responses: Any, study: Any, chosen: Channels) -> dict[str, Any]:
    h, coherence, _ = responses.pair(chosen.output, chosen.input)
    fitted = study.material.transfer_functions[0]
    model = fitted.solution[0].response(responses.omega)
    measured, phase = _phase(h), _phase(np.asarray(model, dtype=np.complex128))
    good = np.isfinite(measured)
    if good.any():  # both on the same turn
        phase = phase + 360.0 * np.round(float(np.median(measured[good] - phase[good])) / 360.0)
    target = fitted.targets[0].omega
    return {
        "frequency": responses.omega / (2.0 * np.pi),
        "magnitude": _decibels(h),
        "phase": measured,
        "coherence": coherence,
        "fit_magnitude": _decibels(model),
        "fit_phase": phase,
        "fitted": [float(target[0] / (2.0 * np.pi)), float(target[-1] / (2.0 * np.pi))],
        "unit": f"{channel(chosen.output).unit or '1'} per {channel(chosen.input).unit or '1'}",
    }


def _fit(study: Any) -> dict[str, Any]:
    fitted = study.material.transfer_functions[0]
    rows = [
        [row.name, row.value, row.unit, None if not np.isfinite(row.sigma) else 100.0 * row.sigma / abs(row.value)]
        for row in fitted.estimates
        if row.value
    ]
    return {"formula": repr(fitted.solution[0]), "cost": fitted.cost, "rows": rows, "form": fitted.details.form.text}


def _verified(study: Any, chosen: Channels, seen: Part) -> dict[str, Any] | None:
    verification = study.verification
    if verification is None:
        return None
    factor, k = channel(chosen.output).shown_factor, 0
    time = np.concatenate([trace.time for trace in verification.traces])
    return {
        "on": seen.words,
        "unseen": seen.unseen,
        "headline": list(verification.headline),
        "warnings": list(verification.warnings),
        "verdict": verification.verdict if seen.unseen else "not a verification",
        "unit": channel(chosen.output).shown_unit,
        "time": time,
        "flight": factor * np.concatenate([trace.flight[:, k] for trace in verification.traces]),
        "model": factor * np.concatenate([trace.model[:, k] for trace in verification.traces]),
    }


def _margin(reading: Any) -> list[float]:
    return [float(reading.value), float(reading.sigma)]


def _gains(suggestion: Any) -> dict[str, Any]:
    """Gains before and after with what they are worth and what the loop answers with each."""
    names = list(suggestion.parameters) or list(suggestion.flown)
    rows = [[name, suggestion.flown.get(name), suggestion.parameters.get(name)] for name in names]
    steps = suggestion.steps()
    answers: dict[str, dict[str, Any] | None] = {"before": None, "after": None}
    for label, which, figures in (
        ("before", "flown", suggestion.figures_flown),
        ("after", "suggested", suggestion.figures_suggested),
    ):
        if which in steps:
            answer = steps[which]
            answers[label] = {
                "time": answer.time,
                "step": answer.step,
                "disturbance": np.degrees(answer.disturbance),
                "stable": answer.stable,
                "overshoot": answer.overshoot,
                "phase_margin": _margin(figures.margins.phase_margin),
                "gain_margin": _margin(figures.margins.gain_margin),
                "delay_margin": [1e3 * number for number in _margin(figures.margins.delay_margin)],
                "crossover": _margin(figures.margins.crossover),
                "peak": figures.peak,
                "bandwidth": figures.bandwidth,
                "rejection": figures.rejection,
            }
    words = " ".join((suggestion.words, *(f"{line[0].upper()}{line[1:]}." for line in suggestion.trade)))
    return {"axis": suggestion.axis, "rows": rows, "words": words, **answers}


def _files(study: Any, responses: Any, record: Flight, part: Flight, folder: Path) -> dict[str, Make]:
    """Everything to take away, by the name of its file; each is made when it is asked for."""
    place = folder / "study"

    def saved(name: str) -> Path:
        if not place.exists():
            study.save(place)
        return place / name

    def parameters() -> Path:
        lines = [f"{name},{value:.6g}" for g in study.material.gains for name, value in g.parameters.items()]
        return write_text(folder / "gains.param", "\n".join(lines) + "\n")

    def table() -> Path:
        return write_csv(record, folder / "sweep.csv")[0]

    def recording() -> Path:
        (content,) = resolve("export_flight")(part, name="sweep").files.values()
        return write_bytes(folder / "sweep.mcap", content)

    def measured() -> Path:
        responses.save(folder / "responses.nc")
        return folder / "responses.nc"

    files: dict[str, Make] = {"report.html": lambda: saved("report.html")}
    if any(g.parameters for g in study.material.gains):
        files["gains.param"] = parameters
    if study.structure is not None:
        files["model.toml"] = lambda: saved("model.toml")
    if study.verification is not None:
        files["verification.json"] = lambda: saved("verification.json")
    files |= {"fit.json": lambda: saved("fit.json"), "responses.nc": measured, "sweep.csv": table}
    return files | {"sweep.mcap": recording}
