"""Structures that are fitted beside the truth: one follows each packaged vehicle's own linearisation, in every axis."""

from __future__ import annotations

import numpy as np
import pytest

import swashplate as sp
from swashplate.api import truth_beside
from swashplate.api.truth_beside import COHERENT, STRUCTURES, following_structure, gain_and_phase_off
from swashplate.arrays import Array
from swashplate.identification.frequency.response_cost import POINTS
from swashplate.identification.responses.frequency_response import TWO_PI, FrequencyResponse
from swashplate.links.ardupilot.mixer_responses import MIXER_AXES, mixer_response
from swashplate.models.catalogue import packaged_cards
from swashplate.simulation.linearize import LinearModel
from swashplate.simulation.standing import airborne

BAND = (0.5, 6.0)
"""Hz: what `swash link accept` fits of its sweeps from 0.4 to 8 Hz."""
LATE = 0.005
"""s: of commands and rates of a firmware at 400 Hz."""
OUTSIDE = 0.01
"""Median share of a rate's power from which on an input's part in it can be told."""
DB, DEGREES = 0.5, 3.5


def own_responses(model: LinearModel, moved: dict[str, Array], axes: tuple[str, ...]) -> FrequencyResponse:
    """The vehicle's own, in the channels of an autopilot's log; across the axes where something can be told."""
    omega = TWO_PI * np.geomspace(*BAND, 3 * (POINTS - 1) + 1)  # a fit's own points are among them
    named = [MIXER_AXES[axis] for axis in axes]
    gravity = float(model.trim.environment.gravity)
    columns = [
        [mixer_response(model, moved[axis], a.output, omega, delay=LATE, gravity=gravity) for axis in axes]
        for a in named
    ]
    h = np.moveaxis(np.array(columns), -1, 0)
    power = np.abs(h) ** 2
    share = np.median(power / power.sum(axis=2, keepdims=True), axis=0)
    return FrequencyResponse(
        omega=omega,
        inputs=tuple(a.input for a in named),
        outputs=tuple(a.output for a in named),
        response=h,
        coherence=np.where(share > OUTSIDE, np.ones(h.shape), 0.0),
        multiple=np.ones(h.shape[:2]),
        error=np.full(h.shape, 0.01),
        input_power=np.ones((omega.size, len(axes))),
        output_power=np.ones((omega.size, len(axes))),
        input_coherence=np.ones((omega.size, len(axes), len(axes))),
        input_units=("1",) * len(axes),
        output_units=tuple("m/s^2" if a.output == "az" else "rad/s" for a in named),
    )


def own(name: str) -> tuple[LinearModel, dict[str, Array]]:
    """A vehicle's linearisation in hover, and the inputs that a full command of each axis moves: up, nose up, right."""
    flying = airborne(sp.vehicle(name))
    travel = {each: 0.5 * (b - a) for each, (a, b) in zip(flying.input_names, flying.input_limits, strict=True)}
    moved = {
        axis.name: np.array([axis.inputs.get(each, 0.0) * full for each, full in travel.items()])
        for axis in flying.traits.axes
    }
    assert moved.keys() == MIXER_AXES.keys()
    if "motor_1" not in travel:
        moved["pitch"] = -moved["pitch"]  # a helicopter's own is nose down
    return sp.linearize(flying, sp.trim(flying)), moved


QUICK = ("coax", "coaxial15", "ingenuity", "raptor50")
"""Coaxial ones, and one that is none; the others are in the proof."""


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in QUICK else pytest.mark.proof) for name in sorted(packaged_cards())],
)
def test_a_structure_follows_every_packaged_vehicle(name: str) -> None:
    model, moved = own(name)
    for axes in STRUCTURES:
        exact = own_responses(model, moved, axes)
        found = following_structure(exact, axes)
        assert found is not None
        for axis, answer in zip(axes, found.answers, strict=True):
            a = MIXER_AXES[axis]
            h, coherence, _ = exact.pair(a.output, a.input)
            assert np.all(coherence > COHERENT), "each axis answers its own command"
            gain, phase = gain_and_phase_off(answer, h)
            assert found.follows, (axis, found.name)
            assert gain.max() <= DB, (axis, found.name)
            assert phase.max() <= DEGREES, (axis, found.name)


@pytest.mark.parametrize(("axes", "least"), [(("roll", "pitch"), 2.7), (("yaw",), 0.5), (("heave",), 5.0)])
def test_a_single_rotors_structures_do_not_follow_the_coax(
    axes: tuple[str, ...], least: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(truth_beside, "STRUCTURES", {each: names[:1] for each, names in STRUCTURES.items()})
    exact = own_responses(*own("coax"), axes)
    found = following_structure(exact, axes)
    assert found is not None
    assert not found.follows
    a = MIXER_AXES[axes[0]]
    assert gain_and_phase_off(found.answers[0], exact.pair(a.output, a.input)[0])[0].max() > least
