"""A folder of bench records becomes a parameter card: every procedure's numbers with their joint covariance."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from swashplate.arrays import Array
from swashplate.bench.drive_frequency import DRIVE_FREQUENCY
from swashplate.bench.fuselage_drag import FUSELAGE_DRAG
from swashplate.bench.joint import Joint
from swashplate.bench.lag import BAR_MOTION, DRIVE_STEPS, SERVO_STEPS
from swashplate.bench.phase_lag import PHASE_LAG
from swashplate.bench.record import BenchRecord
from swashplate.bench.refusals import (
    refuse_exchanged,
    refuse_other_inputs,
    refuse_out_of_range,
    refuse_saturated,
    refuse_stalled,
)
from swashplate.bench.result import Bench, BenchDetails, BenchResult, Procedure
from swashplate.bench.speed_map import SPEED_MAP
from swashplate.bench.supply import COMPENSATED, SUPPLY
from swashplate.bench.thrust import NAMES, SINGLE_ROTOR, THRUST
from swashplate.bench.tilt import BAR_LINKAGE, SWASHPLATE
from swashplate.bench.virtual_bench import RecordSchedule
from swashplate.errors import BenchError
from swashplate.identification.core.accuracy import blind_directions
from swashplate.identification.core.result import Direction, Estimate, Result, correlation_of
from swashplate.identification.core.sources import DataSource
from swashplate.models.card import Card
from swashplate.models.vehicle import Vehicle

_ORDERED = (
    *(SUPPLY, COMPENSATED, SPEED_MAP, THRUST, SINGLE_ROTOR, DRIVE_STEPS, DRIVE_FREQUENCY, PHASE_LAG),
    *(SWASHPLATE, SERVO_STEPS, BAR_LINKAGE, BAR_MOTION, FUSELAGE_DRAG),
)
PROCEDURES: Mapping[str, Procedure] = {procedure.name: procedure for procedure in _ORDERED}
"""Every procedure, in an order in which each finds what it takes as known already measured."""

MEASURED = (
    "k_drive_voltage",
    *(f"{k}_drive_{rotor}" for rotor in ("upper", "lower") for k in ("k", "o")),
    *NAMES,
    "tau_drive_upper",
    "tau_drive_lower",
    "k_zeta_lower",
    "linkage_lower",
    "hub_stiffness_lower",
    "tau_f_lower",
    "linkage_upper",
    "hub_stiffness_upper",
    "tau_f_upper",
    "drag_x",
    "drag_y",
)
"""Every parameter that the bench can measure."""

_WORTH_KEEPING = 1e-4
"""Smaller correlations are not written to the card."""


def schedules(hover: Mapping[str, float]) -> list[RecordSchedule]:
    """The records of the whole bench before they are measured.

    Args:
        hover: `motor_lower` and `motor_upper` at hover.
    """
    return [one for procedure in _ORDERED if procedure.schedules for one in procedure.schedules(hover)]


def hover_commands(card: Mapping[str, float], gravity: float = 9.81) -> dict[str, float]:
    """Motor commands that carry the card's mass without yawing at the nominal voltage (thrust and torque balance)."""
    ratio = card["k_torque_lower"] / card["k_torque_upper"]
    lower = np.sqrt(card["mass"] * gravity / (card["k_thrust_lower"] + card["k_thrust_upper"] * ratio))
    speeds = {"lower": float(lower), "upper": float(lower * np.sqrt(ratio))}
    return {
        f"motor_{rotor}": round((speed - card[f"o_drive_{rotor}"]) / card[f"k_drive_{rotor}"], 4)
        for rotor, speed in speeds.items()
    }


def evaluate(records: Sequence[BenchRecord], vehicle: Vehicle) -> Bench:
    """Every procedure that has records, and the card that follows.

    Args:
        records: in any order.
        vehicle: whose published card holds what the bench does not measure.

    Raises:
        BenchError: for a record that no procedure knows, lacks a column, or contradicts what it measures: a saturated
            sensor, a motor that did not reach its speed, signs that physics forbids, too few points.
    """
    refuse_other_inputs(vehicle)
    published = vehicle.card
    by_procedure = _sorted(records)
    for record in records:
        refuse_out_of_range(record)
        refuse_saturated(record)
        refuse_stalled(record, published.values())
        refuse_exchanged(record, published.values())
    numbers, joint, results, disagreements = published.values(), Joint(published), [], []
    for name, chosen in by_procedure.items():
        try:
            estimated = PROCEDURES[name].estimate(chosen, numbers)
        except np.linalg.LinAlgError:
            raise BenchError(
                f"{name} cannot tell its numbers from these records: something that has to be varied stood still.",
                where=", ".join(record.name for record in chosen),
                hint="`swash bench plan` says what to vary.",
            ) from None
        result, checks = joint.add(estimated)
        results.append(result)
        disagreements += checks
        numbers = {**numbers, **joint.values}
    card, covariance = _card(published, joint, results), joint.among(joint.measured)
    doubts = [check.text for result in results for check in (*result.checks, *disagreements) if not check.good]
    return Result(
        method="bench",
        solution=vehicle.with_card(card),
        start=vehicle,
        estimates=tuple(
            Estimate(
                name,
                card.parameters[name].unit,
                published.parameters[name].value,
                card.parameters[name].value,
                sigma=float(np.sqrt(covariance[i, i])),
            )
            for i, name in enumerate(joint.measured)
        ),
        names=joint.measured,
        covariance=covariance,
        covariance_corrected=np.full_like(covariance, np.nan),
        correlation=correlation_of(covariance),
        directions=_unseen(card, joint.measured, covariance),
        details=BenchDetails(
            tuple(results), tuple(name for name in MEASURED if name not in joint.measured), tuple(disagreements)
        ),
        warnings=tuple(dict.fromkeys(doubts)),
        data=tuple(DataSource(record.name, sha256=record.sha256) for record in records),
    )


def _unseen(card: Card, names: tuple[str, ...], covariance: Array) -> tuple[Direction, ...]:
    """Combinations of what was measured that the records hardly tell; a parameter's scale is its value."""
    scale = np.array([abs(card.parameters[name].value) or 1.0 for name in names])
    scaled: Array = np.asarray(covariance / np.outer(scale, scale), dtype=np.float64)
    return blind_directions(names, np.asarray(np.linalg.pinv(scaled, hermitian=True), dtype=np.float64))


def _sorted(records: Iterable[BenchRecord]) -> dict[str, list[BenchRecord]]:
    """Records by procedure, in the order of `PROCEDURES`; columns are checked."""
    by_procedure: dict[str, list[BenchRecord]] = {}
    for record in records:
        for name in record.procedures:
            if name not in PROCEDURES:
                raise BenchError(
                    f"procedure '{name}' is not known; known are {', '.join(PROCEDURES)}.",
                    where=record.name,
                    hint="Correct the line '# procedure:' of its header.",
                )
            if PROCEDURES[name].in_time:
                _ = record.dt  # says that a table of points does not do
            for column in PROCEDURES[name].columns:
                _ = record[column]  # says what is missing
            by_procedure.setdefault(name, []).append(record)
    return {name: by_procedure[name] for name in PROCEDURES if name in by_procedure}


def _card(published: Card, joint: Joint, results: Sequence[BenchResult]) -> Card:
    """The published card with what was measured."""
    card = published
    sigma = dict(zip(joint.names, np.sqrt(np.diag(joint.covariance)), strict=True))
    for name in joint.measured:
        sources = joint.sources[name]
        files = ", ".join(
            dict.fromkeys(file for result in sources for file in result.records_of.get(name, result.records))
        )
        how = ", ".join(result.procedure for result in sources)
        _refuse_impossible(published, name, joint.values[name], files)
        card = card.with_values(
            {name: joint.values[name]},
            status="measured",
            sigma=float(sigma[name]),
            source=f"bench: {how} from {files}",
        )
    if "k_zeta_lower" in joint.measured:  # both rotors alike (Fankhauser et al., sec. IV-A3)
        value = card.parameters["k_zeta_lower"]
        card = card.with_values(
            {"k_zeta_upper": value.value}, status="derived", sigma=value.sigma, source="derived: k_zeta_lower"
        )
    for name in set(MEASURED) - set(joint.measured):
        entry = card.parameters[name]
        note = "; ".join(filter(None, (entry.note, "kept as published: the bench has no record of it")))
        card = replace(card, parameters={**card.parameters, name: replace(entry, note=note)})
    done = ", ".join(result.procedure for result in results)
    return replace(
        card,
        title=f"{published.title}; measured on the bench: {done}",
        correlations=_correlations(joint.names, joint.covariance),
        path="",
    )


def _refuse_impossible(card: Card, name: str, value: float, files: str) -> None:
    entry = card.parameters[name]
    low = -np.inf if entry.lower is None else entry.lower
    high = np.inf if entry.upper is None else entry.upper
    if not low <= value <= high:
        raise BenchError(
            f"comes out as {value:.4g} {entry.unit}; physics allows {low:g} to {high:g}.",
            where=files,
            channel=name,
            hint="Check signs, units and axes of the record.",
        )


def _correlations(names: Sequence[str], covariance: Array) -> dict[str, dict[str, float]]:
    """Correlations worth keeping, by the first and the second name."""
    sigma = np.sqrt(np.diag(covariance))
    correlations: dict[str, dict[str, float]] = {}
    for i, first in enumerate(names):
        for j in range(i + 1, len(names)):
            value = float(covariance[i, j] / (sigma[i] * sigma[j]))
            if abs(value) > _WORTH_KEEPING:
                correlations.setdefault(first, {})[names[j]] = round(value, 9)
    return correlations
