"""Bands of predictions hold what they promise on unseen flights that the model class explains, and only there."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import proof_page
import swashplate as sp
from swashplate.arrays import Array
from swashplate.control.laws.hold import hold_step
from swashplate.engine.equations import parameter_row
from swashplate.engine.trace import unrolled_rates
from swashplate.filtering.disturbances import DISTURBED, Noise, on_axes
from swashplate.filtering.disturbed_model import StochasticModel, stochastic_model
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.identification.core.records import POSE
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.discretisation import rk4_step
from swashplate.validation.bands import Band

RATE, SECONDS, HOLDOUTS, DRAWS = 100.0, 30.0, 16, 39
FREE = ("tau_f_upper", "linkage_upper", "linkage_lower")
NOISE = Noise(gust_tilt=1.5, gust_yaw=1.0, white_tilt=0.2, white_yaw=0.2)
CHANNELS = ("u", "v", "w", "phi", "theta", "psi", "p", "q", "r")
HORIZONS = (0.5, 1.0, 2.0)


def _flown(
    vehicle: Vehicle, model: StochasticModel, x: Array, gains: Array, wanted: Array, told: tuple[Array, ...]
) -> tuple[Array, Array]:
    """States and commands along a flight in the filter's own disturbances, under the hover's hold."""
    rates, p, fade = unrolled_rates(model.equations), parameter_row(vehicle, None), model.fade(NOISE)
    gust, drift, memory, push, flown = np.zeros(6), np.zeros(6), np.array([0.0, 0.0, 1.0 / RATE]), np.zeros(x.size), []
    for added, white, kick, walk in zip(*told, strict=True):
        memory, command = hold_step(memory, np.append(x, 12.0), wanted, gains, np)
        u, push[list(model.disturbed)] = command + added, gust + drift + white
        flown.append((x, u))
        w = np.array([*u, 0.0, 0.0, 0.0, 12.0])
        x = rk4_step(lambda x, w: np.asarray(rates(x, w, p)).ravel() + push, x, lambda _, w=w: w, 1.0 / RATE)
        gust, drift = fade * gust + kick, drift + walk
    states, commands = zip(*flown, strict=True)
    return np.array(states), np.array(commands)


def explained(vehicle: Vehicle, seed: int) -> Flight:
    """A flight whose gusts, drifts and sensors are those of the filter, with roll and pitch moved."""
    random, dt, n = np.random.default_rng(seed), 1.0 / RATE, round(SECONDS * RATE)
    model = stochastic_model(vehicle, POSE, dt, noise=NOISE)
    trim = sp.trim(vehicle, height=5.0)
    hold = sp.hover_hold(vehicle, trim, rate=RATE)
    noise = {k: float(v) for k, v in NOISE._asdict().items()}
    sizes = [
        np.array(on_axes(*(noise[f"{kind}_{axis}"] for axis in ("horizontal", "vertical", "tilt", "yaw"))))
        for kind in ("white", "gust")
    ]
    walk = np.array(on_axes(noise["drift_force"], noise["drift_force"], noise["drift_moment"], noise["drift_moment"]))
    white, kick, drift = (
        size * scale * random.standard_normal((n, len(DISTURBED)))
        for size, scale in ((sizes[0], dt**-0.5), (sizes[1], dt**0.5), (walk, dt**0.5))
    )
    time = np.arange(n) * dt
    added = np.zeros((n, 4))
    for column, size in ((0, 0.02), (1, 0.02), (2, 0.12), (3, 0.12)):
        steps = np.repeat(size * random.choice([-1.0, 0.0, 1.0], n // 40 + 1), 40)[:n]
        added[:, column] = np.convolve(steps, np.ones(10) / 10.0, mode="same")
    wanted = np.array([*trim.state[:3], trim.state[8], 0.0, 0.0, 0.0, 0.0])
    x, u = _flown(vehicle, model, trim.state, np.asarray(hold.gains), wanted, (added, white, kick, drift))
    columns = {name: u[:, i] for i, name in enumerate(vehicle.input_names)}
    sigma = np.sqrt(model.sensor_variances(NOISE))
    for i, name in enumerate(POSE):
        columns[name] = x[:, vehicle.index(name)] + sigma[i] * random.standard_normal(n)
    columns["voltage"] = np.full(n, 12.0)
    units = dict(zip(vehicle.input_names, vehicle.input_units, strict=True))
    return Flight({"uniform": stream(time, columns, units)}, Provenance(source=f"explained {seed}", simulated=True))


def _bands(model: Any, flights: list[Flight], draws: tuple[Any, ...]) -> list[Band]:
    found = sp.validate(model, flights, horizons=HORIZONS, every=0.25, draws=draws)
    assert isinstance(found, sp.Validation)
    return [band for band in found.bands if band.channel in CHANNELS]


@pytest.mark.proof
def test_the_bands_hold_what_they_promise_where_the_model_class_explains_the_flight() -> None:
    coax = sp.vehicle("coax")
    fit = sp.identify(coax, explained(coax, 1), free=list(FREE))
    draws = fit.draw(DRAWS, seed=1)
    found = _bands(fit, [explained(coax, 100 + k) for k in range(HOLDOUTS)], draws)

    card, few = fit.model.card, [explained(coax, 100 + k) for k in range(HOLDOUTS // 4)]
    quiet = {k: v * (0.5 if k.startswith(("gust", "white")) else 1.0) for k, v in card.observer["noise"].items()}
    calm = replace(fit.model, card=replace(card, observer={**card.observer, "noise": quiet}))
    narrow = _bands(calm, few, draws)
    other = coax.with_values({"linkage_lower": 1.3 * coax.card.values()["linkage_lower"]})
    foreign = _bands(fit, [explained(other, 100 + k) for k in range(HOLDOUTS // 4)], draws)

    rows = []
    for title, bands in (("explained", found), ("gusts halved in the model", narrow), ("another linkage", foreign)):
        for horizon in HORIZONS:
            for promised in (50.0, 95.0):
                held = [b.held for b in bands if (b.horizon, b.promised) == (horizon, promised)]
                missed = [
                    b.channel for b in bands if b.promised == promised and b.horizon == horizon and "too" in b.level
                ]
                rows.append([title, horizon, promised, float(np.mean(held)), min(held), max(held), ", ".join(missed)])
    off = [abs(row[3] - row[2]) for row in rows if row[0] == "explained"]
    wrong = [band.summary_text for band in found if "too" in band.level]
    seen = {band.channel for band in narrow if band.level == "too narrow" or band.wider > 1.3}
    blamed = {band.channel for band in foreign if band.level == "too narrow"}
    tilted = {"phi", "theta", "p", "q"}
    suspected = blamed | {band.channel for band in foreign if band.wider > 1.3 and band.channel in tilted}
    passed = (
        max(off) <= 3.0 and not wrong and {"phi", "theta", "r"} <= seen and suspected and not {"r", "psi", "w"} & blamed
    )
    proof_page.leave(
        "prediction_bands",
        {
            "title": "Bands of predictions on flights that no fit saw",
            "text": f"A CoaX identified from {SECONDS:g} s (three parameters), {DRAWS} draws, bands held against "
            f"{HOLDOUTS} simulated flights of {SECONDS:g} s in the filter's own gusts, nine channels. Parameters, "
            "start, gusts to come and sensors' noise are in the bands. Held: mean, least and most of the channels. A "
            "channel is called too narrow or too wide where its interval lies wholly beyond 3 points. The same "
            "bands must be widened, or called too narrow, with the model's gusts halved, and on another "
            "linkage, on the latter not in heave or yaw.",
            "columns": ["flights", "ahead [s]", "promised [%]", "held, mean [%]", "least", "most", "called too"],
            "rows": rows,
            "passed": bool(passed),
        },
    )
    print("\n".join(map(str, rows)), wrong, sorted(seen), sorted(blamed), sep="\n")
    assert max(off) <= 3.0
    assert not wrong
    assert {"phi", "theta", "r"} <= seen
    assert suspected
    assert not {"r", "psi", "w"} & blamed
