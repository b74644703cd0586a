"""Fits and validations that look like real ones, made from simple signals in a moment, for the tests of the report."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.nuisance import Nuisance
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.identification.core.records import POSE, Comparison, Record
from swashplate.identification.core.result import Constant, Direction, Estimate, Result
from swashplate.identification.core.sources import sources_of
from swashplate.identification.time.feedback import AxisExcitation, FlightDetails
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.models.catalogue import vehicle
from swashplate.simulation.linearize import Mode
from swashplate.validation.floors import Floor
from swashplate.validation.validation import (
    PREDICTORS,
    AxisVerdict,
    Example,
    InnovationCheck,
    Score,
    Validation,
)

INPUTS = ("motor_lower", "motor_upper", "servo_roll", "servo_pitch")
HORIZONS = (0.5, 1.0, 2.0, 5.0)
RATE = 100.0


def motion(seconds: float, *, seed: int) -> tuple[Array, Array, Array]:
    """Time (n,), body states (n, 12) and inputs (n, 4) of something that wanders like a hovering helicopter."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(seconds * RATE)) / RATE
    waves = np.stack(
        [
            scale * sum(np.sin(2 * np.pi * f * time + p) / (1 + f) for f, p in rng.uniform((0.1, 0), (2, 6), (6, 2)))
            for scale in (0.5, 0.5, 0.2, 0.3, 0.3, 0.1, 0.05, 0.05, 0.4, 0.4, 0.4, 0.8)
        ],
        axis=1,
    )
    inputs = np.stack([np.full(time.size, 0.55), np.full(time.size, 0.54), waves[:, 6], waves[:, 7]], axis=1)
    return time, waves, inputs + 0.01 * rng.standard_normal(inputs.shape)


def flight(seconds: float = 30.0, *, name: str = "sweep.mat", seed: int = 1, simulated: bool = False) -> Flight:
    """A conditioned flight with a history."""
    time, states, inputs = motion(seconds, seed=seed)
    channels = dict(zip((*PREDICTED, *INPUTS), np.concatenate([states, inputs], axis=1).T, strict=True))
    provenance = Provenance(
        source=name,
        sha256="" if simulated else f"{seed:02d}" * 32,
        reader="coax56",
        reader_version="1",
        simulated=simulated,
        notes=("no battery channel: the supply voltage is unknown",),
    )
    return (
        Flight({"uniform": stream(time, channels)}, provenance)
        .done("remove_outliers", threshold=6.0, by_channel={"x": 3, "phi": 2})
        .done("resample", rate=RATE, max_gap=0.06, native_rate=150.0, segments=1)
        .done("lowpass", cutoff=15.0, order=4, zero_phase=True)
        .done("unheard_of", strength=3)
    )


def record(of: Flight, *, start: int = 0, stop: int | None = None) -> Record:
    """A piece of a flight as estimators see it."""
    time = of.time("x")[start:stop]
    return Record(
        name=f"{of.provenance.source} {time[0]:.2f}-{time[-1]:.2f} s",
        time=time,
        inputs=of.array(INPUTS)[start:stop],
        outputs=of.array(POSE)[start:stop],
        voltage=np.full(time.size, 12.0),
        output_names=POSE,
        voltage_known=False,
        log=of.provenance.source,
    )


def fit(
    *, name: str = "sweep.mat", failed: bool = False, simulated: bool = False, method: str = "filter-error"
) -> Result[Any, Any]:
    """A fit of the CoaX to two pieces of a flight."""
    flown = flight(name=name, simulated=simulated)
    rng = np.random.default_rng(2)
    sigma = np.array([3e-4, 3e-4, 3e-4, 2e-3, 2e-3, 2e-3])
    comparisons = []
    for piece in (record(flown, stop=1200), record(flown, start=1300)):
        coloured = np.cumsum(rng.standard_normal(piece.outputs.shape), axis=0) * 0.05 + rng.standard_normal(
            piece.outputs.shape
        )
        counted = np.ones(piece.time.size)
        counted[:50] = 0.0
        states = flown.array(PREDICTED)[np.searchsorted(flown.time("x"), piece.time)]
        comparisons.append(Comparison(piece, counted, piece.outputs - sigma * coloured, sigma, states))
    published = vehicle("coax")
    names = ("linkage_lower", "tau_f_upper", "o_zeta_upper", "inertia_zz", "damping_r")
    values = {
        "linkage_lower": 0.11,
        "tau_f_upper": 1.21,
        "o_zeta_upper": -0.09,
        "inertia_zz": 3.1e-4,
        "damping_r": 8.8e-4,
    }
    card = published.card.values()
    estimates = [
        Estimate(
            n,
            published.card.parameters[n].unit,
            card[n],
            values[n],
            0.02 * abs(values[n]),
            0.05 * abs(values[n]),
            prior_mean=card[n] if i > 2 else None,
            prior_sigma=0.5 * abs(values[n]) if i > 2 else None,
            prior_share=0.93 if i > 2 else 0.02,
            at_bound=failed and i == 3,
        )
        for i, n in enumerate(names)
    ]
    estimates.append(Estimate("a_beta_u", "rad s^2/m^2", 0.0125, 0.02, 0.001, 0.003, tie="a_alpha_v"))
    half = rng.standard_normal((5, 5))
    covariance = half @ half.T + np.eye(5)
    scale = np.sqrt(np.diag(covariance))
    identified = published.with_values(values, status="identified", source="identified from sweep.mat")
    return Result(
        method=method,
        solution=identified,
        start=published,
        estimates=tuple(estimates),
        constants=tuple(
            Constant(log, n, u, v, s)
            for log in dict.fromkeys(c.record.log for c in comparisons)
            for n, u, v, s in (("delay_servo", "s", 0.021, 0.002), ("lever_y", "m", 0.17, 0.004))
        ),
        noise=Noise(),
        nuisance=Nuisance(delay_servo=0.021, lever_y=0.17),
        names=names,
        covariance=covariance,
        covariance_corrected=4.0 * covariance,
        correlation=covariance / np.outer(scale, scale),
        directions=(Direction({"inertia_zz": 0.8, "damping_r": 0.6}, 2.5, "inertia_zz and damping_r up together"),),
        details=FlightDetails(
            excitation=(
                AxisExcitation(
                    flown.provenance.source, "roll", "servo_roll", 0.6, 0.8, -1.2, 0.05, True, "Moved by itself."
                ),
                AxisExcitation(
                    flown.provenance.source,
                    "yaw",
                    "motor_upper - motor_lower",
                    0.99,
                    0.99,
                    1.6,
                    0.02,
                    False,
                    "The command answers the motion. Fly a yaw sweep on the reference.",
                ),
            )
        ),
        history=(5000.0, 3200.0, 3100.0, 3099.5),
        converged=True,
        problems=("inertia_zz ended at its physical bound.",) if failed else (),
        failed=failed,
        comparisons=tuple(comparisons),
        data=sources_of([flown]),
        seconds=12.3,
        settings={"choice": "full", "flights": [name], "max_iterations": 30},
    )


def validation(*, name: str = "hover.mat", simulated: bool = False) -> Validation:
    """A validation of the CoaX on another flight."""
    unseen = flight(20.0, name=name, seed=3, simulated=simulated)
    piece = record(unseen)
    states = unseen.array(PREDICTED)
    rng = np.random.default_rng(4)
    quality = {"model": 1.0, "published card": 0.5, "constant rates": 0.6, "hold": 0.0}
    scores = []
    for horizon in HORIZONS:
        for channel in PREDICTED:
            for predictor in PREDICTORS:
                share = (
                    0.0
                    if predictor == "hold"
                    else quality[predictor] * 85.0 - 20.0 * horizon + 10 * rng.standard_normal()
                )
                share = -4000.0 if (predictor, channel) == ("published card", "psi") else share
                rms = (1.0 - share / 100.0) * 0.05 * horizon
                scores.append(Score(channel, horizon, predictor, share, rms, min(1.0, rms / 0.3), 150))
    examples = []
    for start in (200, 350, 600, 900, 1300):
        rows = slice(start, start + 200)
        drift = np.linspace(0, 1, 200)[:, None] * 0.1 * rng.standard_normal(12)
        examples.append(
            Example(
                piece.name,
                piece.time[start],
                piece.time[rows],
                states[rows] + drift,
                np.linspace(0.001, 0.08, 200)[:, None] * np.ones(12),
            )
        )
    beside = tuple(
        Floor(
            channel=s.channel, unit="", horizon=s.horizon, fit=s.fit, low=s.fit - 8.0, high=s.fit + 8.0, rms=s.rms,
            moved=0.05 * s.horizon, rival="constant rates", lead=5.0, lead_low=-3.0, lead_high=13.0, expected=60.0,
            ceiling=math.nan if s.channel == "psi" else s.fit + 1.0, by="blocked cross-validation", gap_low=-4.0,
            gap_high=6.0, leak=31.0 if s.channel == "psi" else 2.0, seen=s.fit + 1.0, past=20.0,
            refused="its inputs answer the motion" if s.channel == "psi" else "", blocks=9.0,
        )
        for s in scores
        if s.predictor == "model"
    )  # fmt: skip
    published = vehicle("coax")
    return Validation(
        vehicle=published.with_values({"tau_f_upper": 1.21}, status="identified"),
        published=published,
        scores=tuple(scores),
        innovations=tuple(
            InnovationCheck(n, 1e-3, 9e-4, 1.2 if n != "psi" else 3.4, 0.05 if n != "z" else 0.4, 0.06) for n in POSE
        ),
        log_likelihood={"model": 18.4, "published card": 12.1},
        verdict=(
            AxisVerdict("roll", "good", "roll is predicted 1 s ahead to 80 % (threshold 60 %)."),
            AxisVerdict("pitch", "usable", "pitch is predicted 1 s ahead to 45 %."),
            AxisVerdict("yaw", "cannot be judged", "the command only answers the motion."),
        ),
        thresholds={"good_fit": 60.0, "usable_fit": 30.0},
        examples=tuple(examples),
        records=(piece,),
        measured=(states,),
        data=sources_of((unseen,)),
        settings={
            "every": 0.1,
            "horizons": list(HORIZONS),
            "calibration": 5.0,
            "noise": {"gust_tilt": 3.0, "wind": 0.0, "tau_wind": 1.0, "speed": 0.0},
        },
        calibrated=(Nuisance(delay_servo=0.092, lever_y=0.156),),
        floors=beside,
    )


def modes() -> dict[str, tuple[Mode, ...]]:
    """Eigenvalues without the seconds that a linearisation takes."""
    pair: Any = (("phi", 0.6), ("p", 0.4))
    return {
        "published": (
            Mode(complex(0.25, 9.99), 9.99, -0.025, -4.0, pair),
            Mode(complex(-12.5, 0), 12.5, 1.0, 0.08, (("alpha_lower", 0.9), ("p", 0.1))),
            Mode(0j, 0.0, 0.0, float("inf"), (("x", 1.0),)),
        ),
        "identified": (
            Mode(complex(-0.8, 9.1), 9.13, 0.088, 1.25, pair),
            Mode(complex(-20.0, 0), 20.0, 1.0, 0.05, (("alpha_lower", 0.9), ("p", 0.1))),
        ),
    }
