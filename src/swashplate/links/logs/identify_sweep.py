"""From a sweep to gains: the public verbs one after the other, each told to whoever watches, each stoppable."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.atomic import write_text
from swashplate.control.analysis.rate_gain_names import ARDUPILOT, cli_lines
from swashplate.errors import SwashError
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.sweeps import Sweep
from swashplate.flights.schema import channel
from swashplate.flights.tabular import write_csv
from swashplate.links.logs import code_lines
from swashplate.links.logs.alone import alone, off_axis
from swashplate.links.logs.hold_out import Part, hold_out
from swashplate.links.logs.job import Identified, Make, Tell
from swashplate.links.logs.loop_page import loop_of
from swashplate.links.logs.opened import Opened
from swashplate.links.logs.sweep_channels import Channels
from swashplate.links.logs.sweep_set import Swept, together
from swashplate.public import resolve

_GYRO = "INS_GYRO_FILTER"


def identify_sweep(
    opened: Opened,
    sweep: Sweep,
    chosen: Channels,
    *,
    others: Sequence[Opened],
    folder: Path,
    tell: Tell,
    alone_only: bool = False,
) -> Identified:
    """Responses, transfer functions, verification in time, gains with their answers, and the files.

    Sweeps of other inputs, in the log or in others of the same vehicle, are estimated together with the one asked for.

    Args:
        opened: the log of the sweep. others: logs that may join, or serve for the verification.
        chosen: input, output and reference. alone_only: leave sweeps of other inputs out.
        folder: for the files.
        tell: hears the steps.

    Raises:
        SwashError: where a verb refuses; its words say why.
    """
    tell("bringing the sweeps to one rate", 0.02)
    swept = together(opened, sweep, chosen, [] if alone_only else others)
    swept = swept[:1] if alone_only else swept
    inputs, outputs = ([one.chosen[k] for one in swept] for k in (0, 1))
    shared = all(one.chosen.reference == chosen.reference for one in swept)
    references = [chosen.reference] if chosen.reference and shared else []
    names = [*inputs, *outputs, *references]
    records = [list(resolve("uniform_records")(one.part, names)) for one in swept]
    tell("computing the frequency responses", 0.08)
    band = (_digits(min(one.sweep.low for one in swept)), _digits(max(one.sweep.high for one in swept)))
    responses = resolve("respond")(
        [record for each in records for record in each],
        inputs=inputs,
        outputs=outputs,
        references=references,
        band=band,
    )
    axes, studies, hold_outs = [], [], []
    for k, one in enumerate(swept):
        begin, width = 0.12 + 0.73 * k / len(swept), 0.73 / len(swept)

        def say(
            what: str,
            *,
            done: float = 0.0,
            total: float | None = None,
            note: str = "",
            begin: float = begin,
            width: float = width,
            about: str = one.chosen.output,
        ) -> None:
            doing = f"{about}: {what}, structure {done + 1:.0f} of {total:.0f}" if total else f"{about}: {what}"
            tell(doing, begin + width * done / (total or 1e9))

        held = hold_out(one.opened, one.sweep, one.chosen.input, one.chosen.output, others)
        fitted = _study(responses, one.chosen, held.flight.between(held.start, held.stop), say)
        axes.append(_axis(one, responses, fitted.study, held, fitted.gained))
        if len(swept) > 1:
            sweep_band = (_digits(one.sweep.low), _digits(one.sweep.high))
            axes[-1]["off"] = off_axis(responses, one.chosen, [o for o in outputs if o != one.chosen.output])
            axes[-1]["alone"] = alone(records[k], one.chosen, responses, band=sweep_band, form=fitted.form)
        studies.append(fitted)
        hold_outs.append(held)
    tell("closing the loops with the gains", 0.88)
    code = code_lines.identified(
        [(one.opened.read, one.start, one.stop) for one in swept],
        [one.chosen for one in swept],
        references,
        band,
        [(held.read, held.start, held.stop, held.unseen) for held in hold_outs],
        [(fitted.form, fitted.band, not fitted.gained) for fitted in studies],
    )
    files = _files([fitted.study for fitted in studies], responses, records, swept, folder)
    document = {
        "words": " ".join(f"{one.sweep}." for one in swept),
        "joined": _joined(swept),
        "axes": axes,
        "code": code.to_document(),
        "files": list(files),
    }
    return Identified(document, files)


def _digits(frequency: float) -> float:
    return float(f"{frequency:.3g}")


def _joined(swept: Sequence[Swept]) -> str:
    if len(swept) == 1:
        return ""
    logs = list(dict.fromkeys(one.opened.read.file for one in swept))
    where = f"of {len(logs)} logs ({', '.join(logs)})" if len(logs) > 1 else "of this log"
    return f"The sweeps of {' and '.join(one.chosen.input for one in swept)} {where} are estimated together."


def _axis(one: Swept, responses: Any, study: Any, held: Part, gained: str) -> dict[str, Any]:
    """What the page shows of one axis."""
    refused = [_refused(suggestion) for suggestion in study.material.gains]
    return {
        "input": one.chosen.input,
        "output": one.chosen.output,
        "reference": one.chosen.reference,
        "bode": _bode(responses, study, one.chosen),
        "fit": _fit(study),
        "warnings": [
            *responses.warnings,
            *responses.problems,
            *study.remarks,
            *(study.fit.warnings if study.fit else ()),
        ],
        "verification": _verified(study, one.chosen, held),
        "gains": [loop_of(suggestion) for suggestion in study.material.gains if not suggestion.refused],
        "no_gains": " ".join(filter(None, (gained, *refused))),
        "alone": None,
        "off": [],
    }


class _Chosen(NamedTuple):
    """A fit with its verification and gains, why there are no gains (""), its form, and the band that it holds in."""

    study: Any
    gained: str
    form: str
    band: tuple[float, float]


def _study(responses: Any, chosen: Channels, part: Flight, say: Callable[..., None]) -> _Chosen:
    asked = {"input": chosen.input, "outputs": [chosen.output]}
    study = resolve("FitTransferFunctions")(responses, **asked).answer(say)
    fitted = study.material.transfer_functions[0]
    form = str(fitted.details.form.text)
    # What a model does outside of the lines that it was fitted to, nobody has told: it is judged within them.
    ends = fitted.targets[0].omega[[0, -1]] / (2.0 * np.pi)
    band = (float(np.floor(1e3 * ends[0]) / 1e3), float(np.ceil(1e3 * ends[1]) / 1e3))
    held = (part,) if study.structure is not None else ()
    refusal, gains = "", True
    try:
        resolve("suggest_gains")(study.fit, responses)
    except SwashError as error:
        refusal, gains = f"{error.problem} {error.hint or ''}", False
    # Once more with the form that was chosen: the same fit, with what is asked of it.
    final = resolve("fit_tf")(responses, **asked, form=form, band=band, gains=gains, hold_out=held)
    return _Chosen(final, refusal, form, band)


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


def _verified(study: Any, chosen: Channels, part: Part) -> dict[str, Any] | None:
    verification = study.verification
    if verification is None:
        return None
    factor, k = channel(chosen.output).shown_factor, 0
    time = np.concatenate([trace.time for trace in verification.traces])
    return {
        "on": part.description,
        "unseen": part.unseen,
        "headline": list(verification.headline),
        "warnings": list(verification.warnings),
        "verdict": verification.verdict if part.unseen else "not a verification",
        "unit": channel(chosen.output).shown_unit,
        "time": time,
        "flight": factor * np.concatenate([trace.flight[:, k] for trace in verification.traces]),
        "model": factor * np.concatenate([trace.model[:, k] for trace in verification.traces]),
    }


def _refused(suggestion: Any) -> str:
    return f"{suggestion.axis}: {suggestion.refused}" if suggestion.refused else ""


def _files(
    studies: Sequence[Any],
    responses: Any,
    records: Sequence[Sequence[Flight]],
    swept: Sequence[Swept],
    folder: Path,
) -> dict[str, Make]:
    """Everything to take away, by the name of its file; each is made when it is asked for. Of several axes each has
    its own, called by its output."""

    def saved(study: Any, place: Path, name: str) -> Path:
        if not place.exists():
            study.save(place)
        return place / name

    # Rotorflight and Betaflight take lines of their command line, ArduPilot a file of parameters.
    spoken = any(one.axis not in ARDUPILOT for study in studies for one in study.material.gains)
    named = "gains.txt" if spoken else "gains.param"

    def parameters() -> Path:
        gains = [one for study in studies for one in study.material.gains]
        settings = [(name, value) for one in gains for name, value in one.parameters.items()]
        lines = [*cli_lines(dict(settings)), "save"] if spoken else [f"{name},{value:.6g}" for name, value in settings]
        return write_text(folder / named, "\n".join(lines) + "\n")

    def measured() -> Path:
        responses.save(folder / "responses.nc")
        return folder / "responses.nc"

    def table(k: int, name: str) -> Path:
        return write_csv(records[k][0], folder / name)[0]

    files: dict[str, Make] = {}
    if any(one.parameters for study in studies for one in study.material.gains):
        files[named] = parameters
    for k, study in enumerate(studies):
        end = f"-{swept[k].chosen.output}" if len(studies) > 1 else ""
        place = folder / f"study{end}"
        wanted = {"report": "report.html", "fit": "fit.json"}
        wanted |= {"model": "model.toml"} if study.structure is not None else {}
        wanted |= {"verification": "verification.json"} if study.verification is not None else {}
        for stem, name in wanted.items():
            files[f"{stem}{end}{Path(name).suffix}"] = partial(saved, study, place, name)
        files[f"sweep{end}.csv"] = partial(table, k, f"sweep{end}.csv")
    return {**files, "responses.nc": measured}
