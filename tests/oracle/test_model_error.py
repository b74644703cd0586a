"""What blade-element models miss: measured on helicopters with published derivatives, each judged by the others.

Numbers and sources: `published_helicopters`. Lynx: Padfield's and the Rationalized Helicopter Model's, this one without
the yaw damper in its r column. R-50: roll and pitch damping are left out, which the card is made of, and yaw, which has
a gyroscope in the loop. HeLion: damping by -L_b tau and -M_a tau; no yaw either.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import proof_page
import swashplate as sp
from published_helicopters import (
    HELION,
    MQ_AT_20_KN,
    PUBLISHED,
    RADIUS,
    entered,
    lynx_published,
    lynx_rows,
    r50_identified,
)
from swashplate.models.catalogue import from_card
from swashplate.models.conventional.new_card import new_card
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.derivatives import MEASURED, kind_of, model_error, spread
from swashplate.simulation.published import _scale

KNOT = 0.514444


class Held(NamedTuple):
    """Published derivatives by speed [m/s], and how: `known` is the vehicle from its geometry, `guessed` from mass and
    radius by its size class; `primed` that the published roll and yaw rows are mixed by the product of inertia."""

    published: Mapping[float, Mapping[str, float]]
    known: Vehicle
    guessed: Vehicle
    primed: bool = False
    second: Mapping[str, float] = {}


def helicopters(data: Path) -> dict[str, Held]:
    r50, lynx = r50_identified(data), lynx_published(0)
    scale = _scale(lynx)
    lynx = {name: value for name, value in lynx.items() if abs(value) >= scale[name]}
    second = {n: row["RHM_Skogestad_SI"] for n, row in lynx_rows(data).items() if n in lynx and n[1:] != "r"}
    flown = ("Xu", "Yv", "Zw", "Mu", "Lv", "Lu", "Mv")
    damping = {"Lp": -HELION["Lb"] * HELION["tau_f"], "Mq": -HELION["Ma"] * HELION["tau_f"]}
    return {
        "UH-60A": Held(
            {0.0: PUBLISHED, 20.0 * KNOT: {"Mq": MQ_AT_20_KN}},
            entered(),
            guessed(7439.0, RADIUS, rotation="ccw"),
        ),
        "Lynx": Held({0.0: lynx}, sp.vehicle("lynx"), guessed_like("lynx"), primed=True, second=second),
        "R-50": Held({0.0: {n: r50[n] for n in flown}}, sp.vehicle("r50"), guessed_like("r50")),
        "HeLion": Held({0.0: {n: HELION[n] for n in flown} | damping}, sp.vehicle("helion"), guessed_like("helion")),
    }


def guessed(mass: float, radius: float, *, rotation: str) -> Vehicle:
    return from_card(new_card("from mass and radius", mass=mass, radius=radius, rotation=rotation))


def guessed_like(name: str) -> Vehicle:
    card = sp.vehicle(name).card
    numbers = card.values()
    return guessed(numbers["mass"], numbers["rotor_radius"], rotation=str(card.options["rotation"]))


def differences(held: Held) -> dict[str, list[float]]:
    """Squares of published less ours over ours, by kind."""
    found: dict[str, list[float]] = {}
    for speed, published in held.published.items():
        at = sp.trim(held.known, speed=speed)
        ours = sp.derivatives(held.known, at, primed=held.primed).tables[0]
        for values in (published, held.second):
            for name, value in values.items():
                found.setdefault(kind_of(name), []).append(((value - ours[name]) / ours[name]) ** 2)
    return found


def measured(data: Path) -> dict[str, dict[str, float]]:
    found: dict[str, dict[str, float]] = {kind: {} for kind in MEASURED}
    for vehicle, held in helicopters(data).items():
        for kind, squares in differences(held).items():
            found[kind][vehicle] = float(np.sqrt(np.mean(squares)))
    return found


def test_the_numbers_are_those_of_the_published_helicopters(shared_data: Path) -> None:
    found = measured(shared_data)
    assert {kind: set(told) for kind, told in found.items()} == {kind: set(told) for kind, told in MEASURED.items()}
    for kind, told in MEASURED.items():
        for vehicle, value in told.items():
            assert value == pytest.approx(found[kind][vehicle], abs=0.006), found


def unmixed(published: Mapping[str, float], vehicle: Vehicle) -> dict[str, float]:
    """Roll and yaw rows before the product of inertia mixed them; a derivative whose partner is not there is left."""
    card = vehicle.card.values()
    made = dict(published)
    for name, value in published.items():
        other = {"L": "N", "N": "L"}.get(name[0], "") + name[1:]
        if other in published:
            own = card["inertia_xx" if name[0] == "L" else "inertia_zz"]
            made[name] = value - card["inertia_xz"] / own * published[other]
    return made


class Judged(NamedTuple):
    """How many of a helicopter's derivatives lie within 5 and 95 %, with the model's error and by the card alone.

    `untold` are of a kind that no other helicopter tells: they have no model's error, and are not counted.
    """

    vehicle: str
    count: int
    untold: int
    held: int
    by_card: int
    outside: tuple[str, ...]


@cache
def judged(data: Path, draws: int) -> tuple[Judged, ...]:
    """Every helicopter from mass and radius, with the model's error that the others tell."""
    found = []
    for vehicle, held in helicopters(data).items():
        inside, alone, untold, outside = 0, 0, 0, []
        for speed, published in held.published.items():
            wide = spread(held.guessed, sp.trim(held.guessed, speed=speed), draws=draws, without=vehicle)
            for name, value in (unmixed(published, held.known) if held.primed else published).items():
                if not wide.model[name].vehicles:
                    untold += 1
                    continue
                _, low, high = wide.derivatives[name]
                least, most = wide.by_card[name]
                assert low <= least + 1e-12 * abs(least)
                assert high >= most - 1e-12 * abs(most)
                inside, alone = inside + (low <= value <= high), alone + (least <= value <= most)
                outside += [] if low <= value <= high else [name]
        count = sum(len(each) for each in held.published.values()) - untold
        found.append(Judged(vehicle, count, untold, inside, alone, tuple(outside)))
    return tuple(found)


def shares(found: tuple[Judged, ...]) -> tuple[float, float]:
    total = sum(one.count for one in found)
    return 100.0 * sum(one.held for one in found) / total, 100.0 * sum(one.by_card for one in found) / total


def test_bounds_hold_a_helicopter_that_told_them_nothing(shared_data: Path) -> None:
    """Short form, 30 samples of each card. Five to 95 % should hold 90 %; the card's spread alone holds half."""
    found = judged(shared_data, 30)
    held, by_card = shares(found)
    assert held >= 82.0, found
    assert by_card <= 60.0, "the model's error would not be needed"
    assert [one.untold for one in found if one.untold] == [10], "cyclic and collective of the Lynx"
    assert next(one for one in found if one.vehicle == "UH-60A").held >= 6


@pytest.mark.proof
def test_bounds_hold_held_out_helicopters(shared_data: Path) -> None:
    found = judged(shared_data, 200)
    held, by_card = shares(found)
    passed = 82.0 <= held <= 98.0
    proof_page.leave(
        "model_error",
        {
            "title": "Derivatives of helicopters from mass and radius, with the error of the model",
            "text": f"Four helicopters with published derivatives, each from the card that mass and radius give, with "
            f"the model's error that the other three tell: {held:.0f} % of the published values lie between the 5 % "
            f"and 95 % bounds (90 is their promise, 82 to 98 wanted of so few), {by_card:.0f} % between those of the "
            "card's samples alone.",
            "columns": ["helicopter", "published", "of a kind nobody else tells", "held", "by the card", "outside"],
            "rows": [[j.vehicle, j.count, j.untold, j.held, j.by_card, ", ".join(j.outside)] for j in found],
            "passed": passed,
        },
    )
    assert passed, found


def test_what_no_helicopter_told_is_said_and_not_guessed(shared_data: Path) -> None:
    """Without the Lynx nobody tells other controls: the samples' own quantiles stay, and the error has no number."""
    alone = model_error("MB1", without="Lynx")
    assert alone.vehicles == 0
    assert np.isnan(alone.sigma)
    samples = np.linspace(-3.0, -1.0, 201)
    assert alone.widened(samples) == pytest.approx((-2.9, -1.1))
    low, high = model_error("Xu").widened(samples)
    assert low < -4.0
    assert high > -0.5
