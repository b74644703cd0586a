"""Sections on what was asked, the flights and what was done to them, and what the result was made with."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from swashplate.identification.core.result import Result
from swashplate.identification.core.sources import DataSource
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.structure import Block, Cell, Points, Section, Text, tabulate
from swashplate.reporting.versions import card_hash, date, result_hash, versions
from swashplate.reporting.words import counted, listed, noise_told, plain_words, span_words, step_words
from swashplate.validation.validation import Validation


def asked(fit: Result[Vehicle, object] | None, validation: Validation | None) -> tuple[Block, ...]:
    """What was asked: vehicle, method, flights and settings."""
    blocks: list[Block] = []
    vehicle = fit.model if fit else validation.vehicle if validation else None
    if fit:
        blocks.append(
            Text(
                f"Identify {counted(len(fit.names), 'parameter')} of the vehicle '{fit.model.card.called}' "
                f"(choice: {fit.settings.get('choice', 'given')}) "
                f"from {listed(_sources(fit.data))} by {method_words(fit.method)}."
            )
        )
    if validation:
        blocks.append(
            Text(
                f"Predict {listed(_sources(validation.data))} with the model "
                f"{', '.join(f'{h:g}' for h in sorted({s.horizon for s in validation.scores}))} s ahead from "
                "many start points, and compare with the published card (same observer, trims from the same seconds), "
                "with holding the last value and with constant rates."
            )
        )
    if vehicle is not None:
        blocks.append(Text(f"The vehicle: {vehicle.card.title}. Where its card may be trusted: {vehicle.card.trust}"))
    rows = [("fit", fit.settings)] if fit else []
    if validation:
        noise = validation.settings.get("noise")
        rows.append(("validation", {**validation.settings, **({"noise": noise_told(noise)} if noise else {})}))
    cells = tuple((_setting(k), part, plain_words(v)) for part, s in rows for k, v in s.items())
    if cells:
        blocks.append(tabulate("Settings", ("setting", "of", "value"), cells))
    return tuple(blocks)


def _setting(name: str) -> str:
    """A setting's name with its unit."""
    unit = {"rate": "Hz", "horizons": "s", "every": "s", "calibration": "s"}.get(name)
    return f"{name} [{unit}]" if unit else name


def method_words(method: str) -> str:
    """A method's name for a sentence."""
    return {
        "filter-error": "filter error (maximum likelihood with process noise)",
        "prediction-error": "prediction error (maximum likelihood with a free gain)",
        "output-error": "output error (maximum likelihood without process noise)",
    }.get(method, method)


def _sources(flights: Iterable[DataSource]) -> list[str]:
    return [flight.name or "an unnamed flight" for flight in flights]


def used_twice(fit: Result[object, object] | None, validation: Validation | None) -> list[DataSource]:
    """Flights of the validation that come from a log which the fit used: predicting them proves less."""
    if fit is None or validation is None:
        return []
    return [one for one in validation.data if any(one.same_log(other) for other in fit.data)]


def data(fit: Result[Vehicle, object] | None, validation: Validation | None) -> Section:
    """The flights: where they come from, what was done to them, what their readers found."""
    fitted, tested = fit.data if fit else (), validation.data if validation else ()
    twice = used_twice(fit, validation)
    roles = [("used for the fit", f) for f in fitted]
    for flight in tested:
        used_for_fit = flight in twice
        if flight not in fitted:
            role = (
                "predicted; a log that the fit used"
                if used_for_fit
                else "kept from the fit, predicted"
                if fit
                else "predicted"
            )
            roles.append((role, flight))
    rows = tuple(
        (
            flight.name or "unnamed",
            role,
            Cell("simulated" if flight.simulated else "flown", tone="caution" if flight.simulated else "plain"),
            span_words(flight),
            f"{flight.reader} {flight.reader_version}".strip() or "–",
            flight.sha256[:12] or "–",
        )
        for role, flight in roles
    )
    blocks: list[Block] = [
        tabulate(
            "Flights",
            ("flight", "role", "origin", "length", "reader", "SHA-256 (first 12)"),
            rows,
            note="Full hashes stand under the last heading.",
        )
    ]
    for _, flight in roles:
        name = flight.name or "unnamed"
        if flight.history:
            blocks.append(
                Points(
                    tuple(step_words(step) for step in flight.history), title=f"What was done to {name}", ordered=True
                )
            )
        else:
            blocks.append(Text(f"Nothing was done to {name} after reading."))
        if len(flight.segments) > 1:
            pieces = ", ".join(f"{a:.2f} to {b:.2f} s" for a, b in flight.segments)
            blocks.append(Text(f"Unbroken segments of {name}: {pieces}."))
        if flight.notes:
            blocks.append(Points(flight.notes, title=f"What to know about {name}"))
    return Section("data", "Which data, and what was done to it?", tuple(blocks), folded=True)


def made_with(fit: Result[Vehicle, object] | None, validation: Validation | None) -> tuple[Block, ...]:
    """Versions and hashes: enough to know whether two reports say the same about the same data."""
    rows = tuple((name, number) for name, number in versions().items())
    hashes: list[tuple[str, str]] = []
    named: set[str] = set()
    for flight in (*(fit.data if fit else ()), *(validation.data if validation else ())):
        name = flight.name or "unnamed"
        if name not in named:
            hashes.append((f"flight {name}", flight.sha256 or "none: simulated or made in memory"))
            named.add(name)
    cards = {label: vehicle.card for label, vehicle in vehicles(fit, validation).items()}
    hashes += [(f"{label} card", card_hash(card)) for label, card in cards.items()]
    results: list[tuple[str, dict[str, Any]]] = [("fit", _numbers(fit))] if fit else []
    results += [("validation", validation.to_document())] if validation else []
    hashes += [(f"numbers of the {label}", result_hash(result)) for label, result in results]
    return (
        Text(f"Written on {date()}."),
        tabulate("Versions", ("package", "version"), rows),
        tabulate(
            "SHA-256",
            ("of", "hash"),
            tuple((name, Cell(value, tone="quiet")) for name, value in hashes),
            note="Flights: of the file's bytes. Cards: of their text. Numbers: of all results rounded to six digits, "
            "wall time left out. None depends on the machine or on where files lie.",
        ),
    )


def _numbers(fit: Result[Vehicle, object]) -> dict[str, Any]:
    """A result's numbers and words; the conditioned signals' last bits, and so their hash, depend on the machine."""
    return replace(fit, data=tuple(replace(one, signals="") for one in fit.data)).to_document(comparisons=False)


def vehicles(fit: Result[Vehicle, object] | None, validation: Validation | None) -> dict[str, Vehicle]:
    """Before and after: by "published" and "identified"."""
    if fit:
        return {"published": fit.start, "identified": fit.model}
    return {"published": validation.published, "identified": validation.vehicle} if validation else {}
