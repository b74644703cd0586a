"""The verdict of `verify` can say no, and does not say it of models that are right within their own bounds.

The rules of `refutation` were worked out on the R-50 in hover (seeds below 100), at 15 m/s (seeds 200 to 303) and on
HeLion (seeds below 400). The proof judges other seeds.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import r50
from swashplate.flights.excitation import excitations
from swashplate.flights.flight import Flight, stream
from swashplate.identification.frequency.response_cost import ACCEPTABLE, cost_of
from swashplate.identification.frequency.state_space_fit import fit_state_space, fit_targets
from swashplate.identification.frequency.state_space_result import StateSpaceFit
from swashplate.identification.responses.respond import respond
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.validation.noise_filter import Piece
from swashplate.validation.refutation import OPEN, REFUTED, STANDS, Judgement, judge
from swashplate.validation.verify import verify

BAND = (0.05, 6.0)
GUST = 0.5


@pytest.fixture(scope="module")
def truth(shared_data: Path) -> StateSpaceModel:
    return r50.truth(shared_data)


@pytest.fixture(scope="module")
def fit(truth: StateSpaceModel) -> StateSpaceFit:
    sweeps = [r50.fly(truth, axis, seed=k, gust=GUST) for k, axis in enumerate(truth.inputs)]
    found = respond(sweeps, inputs=truth.inputs, outputs=truth.outputs, references=["sweep"], band=BAND)
    return fit_state_space(truth, found, starts=1)


@pytest.fixture(scope="module")
def unseen(truth: StateSpaceModel) -> list[Piece]:
    return [
        piece(r50.fly(truth, axis, seed=50 + k, seconds=40.0, gust=GUST), truth) for k, axis in enumerate(truth.inputs)
    ]


def piece(flight: Flight, model: StateSpaceModel) -> Piece:
    """Every second sample of a record, as deviations from its means."""
    u, y = (flight.array(names)[::2] for names in (model.inputs, model.outputs))
    moved = any(one.outside for one in excitations(flight, model.inputs, outputs=model.outputs))
    return Piece(flight.provenance.source, u - u.mean(axis=0), y - y.mean(axis=0), 2.0 / r50.RATE, moved)


def said(model: StateSpaceModel, pieces: list[Piece]) -> Judgement:
    return judge(model, pieces, model.outputs, band=BAND)


def changed(fit: StateSpaceFit, **factors: float) -> StateSpaceModel:
    """The identified model with some parameters multiplied; their bounds stay."""
    return fit.solution.with_values({n: f * fit.solution.parameters[n].value for n, f in factors.items()})


def strong(fit: StateSpaceFit) -> list[str]:
    """Parameters of which half more or less makes some response unacceptable (J above 100); the strongest first."""
    found = {}
    for name in fit.solution.free:
        worst = []
        for factor in (0.5, 1.5):
            model = changed(fit, **{name: factor})
            h = [
                model.response(t.omega)[:, model.outputs.index(t.output), model.inputs.index(t.input)]
                for t in fit.targets
            ]
            worst.append(max(cost_of(answer, t) for answer, t in zip(h, fit.targets, strict=True)))
        if min(worst) > ACCEPTABLE:
            found[name] = min(worst)
    return sorted(found, key=lambda name: -found[name])


def unstable(fit: StateSpaceFit) -> dict[str, StateSpaceModel]:
    values = {"Nr": 6.0, "Zw": 2.0, "Xu": 1.0, "Yv": 1.0, "Kr": -4.0}
    return {f"{n} = {v:+g}": fit.solution.with_values({n: v}) for n, v in values.items()}


def reversed_controls(fit: StateSpaceFit) -> StateSpaceModel:
    names = ("Alat", "Alon", "Blat", "Blon", "Zcol", "Nped", "Ncol", "Clon", "Dlat")
    return changed(fit, **dict.fromkeys(names, -1.0))


def drawn(fit: StateSpaceFit, seed: int) -> StateSpaceModel:
    """Every parameter off by a normal share of its own bound, independently of the others: harsher than the fit is."""
    random = np.random.default_rng(seed)
    p = fit.solution.parameters
    return fit.solution.with_values(
        {
            n: p[n].value + random.standard_normal() * p[n].cramer_rao
            for n in fit.solution.free
            if np.isfinite(p[n].cramer_rao)
        }
    )


def other_structures(fit: StateSpaceFit) -> dict[str, StateSpaceModel]:
    """Structures that lack what flew, each fitted to the same responses."""
    lacking = {
        "no bar": ("Ac", "Bd", "Clon", "Dlat"),
        "no flapping coupling": ("Ab", "Ba"),
        "no cross control": ("Alat", "Blon"),
        "no yaw gyro": ("Kr",),
        "no flapping in heave": ("Za", "Zb"),
        "no coupling into yaw": ("Np", "Nw", "Ncol", "Nv"),
    }
    made = {}
    for name, out in lacking.items():
        if not any(fit.solution.parameters[n].value for n in out):
            continue  # in cruise flapping does not act on heave: without it the structure is the one that flew
        model = fit.solution.with_values(dict.fromkeys(out, 0.0), free=False)
        # A response that such a model does not have at all has no decibels to be fitted.
        h = {
            t.name: model.response(t.omega)[:, model.outputs.index(t.output), model.inputs.index(t.input)]
            for t in fit.targets
        }
        there = [t for t in fit.targets if np.all(np.abs(h[t.name]) > 0.0)]
        made[name] = fit_targets(model, there, starts=1, settings=fit.settings).solution
    return made


TWO_OR_A_DOZEN = pytest.mark.parametrize("every", [6, pytest.param(1, marks=pytest.mark.proof)], ids=["two", "dozen"])


@TWO_OR_A_DOZEN
def test_a_dozen_wrong_models_are_refuted(every: int, fit: StateSpaceFit, unseen: list[Piece]) -> None:
    names = strong(fit)
    assert len(names) >= 8, names
    wrong = {"reversed": reversed_controls(fit), **dict(list(unstable(fit).items())[:3])}
    wrong |= {f"{n} x {f:g}": changed(fit, **{n: f}) for n, f in zip(names[:8], (0.5, 1.5, -1.0, 0.5) * 2, strict=True)}
    assert len(wrong) == 12
    verdicts = {name: said(wrong[name], unseen).verdict for name in list(wrong)[::every]}
    assert set(verdicts.values()) == {REFUTED}, verdicts


@TWO_OR_A_DOZEN
def test_a_dozen_models_within_their_own_bounds_are_not(
    every: int, truth: StateSpaceModel, fit: StateSpaceFit, unseen: list[Piece]
) -> None:
    models = [truth, fit.solution, *(drawn(fit, seed) for seed in range(10))][::every]
    assert [said(model, unseen).verdict for model in models] == [STANDS] * (12 // every)


def test_the_parameter_that_is_wrong_is_named_with_what_the_records_ask_for(
    truth: StateSpaceModel, fit: StateSpaceFit, unseen: list[Piece]
) -> None:
    """Half of a delay hides in every band; all records together ask for it back, within a tenth."""
    judged = said(changed(fit, tau_col=0.5), unseen)
    asked = {c.name: c.wanted for c in judged.changes}
    assert asked["tau_col"] == pytest.approx(truth.parameters["tau_col"].value, rel=0.1)
    assert "tau_col" in " ".join(judged.reasons)
    assert said(fit.solution, unseen).changes == ()


def test_what_the_record_cannot_tell_is_said(truth: StateSpaceModel, fit: StateSpaceFit, unseen: list[Piece]) -> None:
    """Without a sweep, with an input at rest, with hopeless bounds, or too short."""
    calm = replace(unseen[2], inputs=unseen[2].inputs * [1, 1, 1, 0])
    assert "collective" in said(fit.solution, [calm]).silent
    vague = replace(
        fit.solution,
        parameters={n: replace(p, cramer_rao=100.0 * abs(p.value)) for n, p in fit.solution.parameters.items()},
    )
    judged = said(vague, unseen)
    assert judged.verdict == OPEN
    assert "too wide" in " ".join(judged.reasons) or "so wide" in " ".join(judged.reasons)
    short = replace(unseen[0], inputs=unseen[0].inputs[:60], outputs=unseen[0].outputs[:60])
    assert said(fit.solution, [short]).verdict == OPEN


def test_a_record_of_gusts_alone_refutes_nobody(
    truth: StateSpaceModel, fit: StateSpaceFit, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(r50, "AMPLITUDE", dict.fromkeys(r50.AMPLITUDE, 0.0))
    still = [piece(r50.fly(truth, "lateral", seed=7, seconds=40.0, gust=GUST), truth)]
    assert said(truth, still).verdict == OPEN
    assert said(changed(fit, Nr=-1.5), still).verdict != STANDS


def test_an_unstable_model_gets_the_same_stretches_as_any_other(truth: StateSpaceModel, fit: StateSpaceFit) -> None:
    record = r50.fly(truth, "pedal", seed=9, seconds=40.0, gust=GUST)
    thin = Flight(
        {
            "uniform": stream(
                record.time("p")[::2],
                {n: record.values(n)[::2] for n in (*truth.inputs, *truth.outputs)},
                dict.fromkeys(truth.inputs, "1"),
            )
        },
        record.provenance,
    )
    right, wrong = (verify(model, thin, low=0.1) for model in (fit.solution, unstable(fit)["Nr = +6"]))
    assert [t.source for t in right.traces] == [t.source for t in wrong.traces]
    assert (right.constants, right.samples) == (wrong.constants, wrong.samples)
    assert right.verdict == STANDS
    assert wrong.verdict == REFUTED
    assert not wrong.good
    assert right.cost < 0.5 * right.rivals["no control"]
    assert "REFUTED" in repr(wrong)
    assert "constants" in repr(wrong)


@pytest.mark.proof
@pytest.mark.parametrize(
    ("flight", "size", "seed"),
    [("hover", 1.0, 1000), ("hover", 1.0, 1200), ("cruise", 0.5, 1100), ("cruise", 0.5, 1300)],
)
def test_a_hundred_wrong_models_and_a_hundred_right_ones(
    shared_data: Path, flight: str, size: float, seed: int
) -> None:
    truth = r50.truth(shared_data, flight)
    sweeps = [r50.fly(truth, axis, seed=seed + k, gust=GUST, size=size) for k, axis in enumerate(truth.inputs)]
    found = respond(sweeps, inputs=truth.inputs, outputs=truth.outputs, references=["sweep"], band=BAND)
    fit = fit_state_space(truth, found, starts=1)
    unseen = [
        piece(r50.fly(truth, axis, seed=seed + 50 + k, seconds=40.0, gust=GUST, size=size), truth)
        for k, axis in enumerate(truth.inputs)
    ]
    random = np.random.default_rng(0)
    every = strong(fit)
    wrong = {"all controls reversed": ("sign", reversed_controls(fit))}
    wrong |= {name: ("unstable", model) for name, model in unstable(fit).items()}
    wrong |= {name: ("structure", model) for name, model in other_structures(fit).items()}
    assert every, "no parameter is strong"
    wrong |= {f"{n} x -1": ("sign", changed(fit, **{n: -1.0})) for n in every}
    wrong |= {f"{n} x {f:g}": ("half", changed(fit, **{n: f})) for n in every for f in (0.5, 1.5)}
    while len(wrong) < 100:
        pair = random.choice(every, 2, replace=False)
        factors = dict(zip(map(str, pair), map(float, random.choice([0.5, 1.5], 2)), strict=True))
        wrong[" and ".join(f"{n} x {f:g}" for n, f in factors.items())] = ("two halves", changed(fit, **factors))
    asked = dict(list(wrong.items())[:100])
    verdicts = {name: (kind, said(model, unseen).verdict) for name, (kind, model) in asked.items()}
    right = [said(drawn(fit, 1000 + k), unseen).verdict for k in range(100)]
    refuted = sum(v == REFUTED for _, v in verdicts.values())
    spared = right.count(STANDS)
    folder = os.environ.get("SWASHPLATE_PROOF")
    if folder:
        kinds = Counter(kind for kind, _ in verdicts.values())
        document = {
            "title": f"Verdicts on wrong and on right models of a helicopter in gusts, {flight}, seed {seed}",
            "text": f"An R-50 ({flight}) in gusts of {GUST:g} m/s, four unseen sweeps of 40 s. Of {len(verdicts)} "
            f"wrong models {refuted} are refuted, of {len(right)} drawn within their own bounds {spared} are not "
            f"({right.count(OPEN)} cannot be judged). Not refuted: "
            + (", ".join(n for n, (_, v) in verdicts.items() if v != REFUTED) or "none")
            + f". {len(every)} parameters are strong: half more or less lifts some response above J = 100.",
            "columns": ["kind", "models", "refuted", "not refuted", "cannot be judged"],
            "rows": [
                [kind, n, *(sum((kind, v) == found for found in verdicts.values()) for v in (REFUTED, STANDS, OPEN))]
                for kind, n in kinds.items()
            ]
            + [["within their own bounds", len(right), *(right.count(v) for v in (REFUTED, STANDS, OPEN))]],
            "passed": refuted >= 95 and spared >= 95,
        }
        (Path(folder) / f"verdicts_{flight}_{seed}.json").write_text(json.dumps(document, indent=2), encoding="utf-8")
    assert refuted >= 95, {n: v for n, v in verdicts.items() if v[1] != REFUTED}
    assert spared >= 95
