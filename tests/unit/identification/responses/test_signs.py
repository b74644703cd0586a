"""The sign from an input to its motion: told where it can be, never the wrong one, never of a controller's answer."""

from __future__ import annotations

import re

import numpy as np
import pytest

from proof_page import leave
from swashplate.arrays import Array, Complex
from swashplate.flights.flight import Flight, stream
from swashplate.flights.motion_signs import sign_of
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.responses.respond import respond
from swashplate.identification.responses.signs import response_sign, response_signs
from swashplate.models.linear.state_space_file import structure

OMEGA = 2.0 * np.pi * np.geomspace(0.4, 10.0, 60)


def first_order(omega: Array, gain: float = 25.0, pole: float = 6.0, delay: float = 0.03) -> Complex:
    return gain * np.exp(-1j * omega * delay) / (1j * omega + pole)


def controllers_answer(omega: Array, p: float, i: float, d: float) -> Complex:
    """What a log without a sweep shows between a rate controller's output and the rate: minus its inverse."""
    s = 1j * omega
    return -1.0 / (p + i / s + d * s / (1.0 + s / (40.0 * np.pi)))


def as_responses(omega: Array, h: Complex, *, output: str = "p", input: str = "mixer_roll") -> FrequencyResponse:
    shape = (omega.size, 1, 1)
    one = np.ones(shape)
    return FrequencyResponse(
        omega, (input,), (output,), h.reshape(shape), one, one[:, :, 0], 0.02 * one, one[:, :, 0], one[:, :, 0], one
    )


@pytest.mark.parametrize("sense", [1, -1])
def test_the_sign_of_a_first_order_rate(sense: int) -> None:
    told, odds, (better, worse) = sign_of(OMEGA, sense * first_order(OMEGA), integrations=1)
    assert told == sense
    assert odds > 20.0
    assert better < 0.1
    assert worse > 5.0 * better


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize(("output", "integrations"), [("az", 0), ("w", 1), ("phi", 2)])
def test_accelerations_speeds_and_angles_have_one_too(sense: int, output: str, integrations: int) -> None:
    """The same acceleration, as it is measured: K s / (s + a), integrated 0, 1 or 2 times."""
    s = 1j * OMEGA
    h = sense * 20.0 * s / (s + 2.0) * np.exp(-0.05 * s) / s**integrations
    assert sign_of(OMEGA, h, integrations=integrations)[0] == sense


def test_rotor_modes_and_slow_motors_do_not_turn_it() -> None:
    """Half a turn of lag at a hardly damped rotor mode inside the band, and a motor of 0.15 s, by other equations."""
    values = {
        "Lb": 3588.6, "Ma": 617.5, "tau_f": 0.068232, "Ba": 1.2963, "Ab": -1.3402, "Blat": 0.24493, "Blon": -0.08487,
        "Alat": 0.07285, "Alon": 0.26962, "tau_roll": 0.0534, "tau_pitch": 0.0526,
    }  # fmt: skip
    model = structure("rotor_body").with_values(values)
    h = model.response(OMEGA)[:, model.outputs.index("p"), model.inputs.index("mixer_roll")]
    assert sign_of(OMEGA, h, integrations=1)[0] == 1
    slow = first_order(OMEGA, pole=0.5) / (1.0 + 0.15j * OMEGA)
    assert sign_of(OMEGA, -slow, integrations=1)[0] == -1


@pytest.mark.parametrize("gains", [(0.135, 0.09, 0.0036), (0.135, 0.135, 0.0), (0.06, 0.1, 0.0001), (0.5, 0.5, 0.02)])
def test_a_controllers_answer_has_no_sign(gains: tuple[float, float, float]) -> None:
    told, _, (better, _) = sign_of(OMEGA, controllers_answer(OMEGA, *gains), integrations=1)
    assert told <= 0, "never the sign that an aircraft has"
    assert told == 0 or better > 0.1


def test_a_narrow_band_does_not_tell() -> None:
    narrow = 2.0 * np.pi * np.geomspace(4.0, 5.0, 20)
    for sense in (1, -1):
        assert sign_of(narrow, sense * first_order(narrow, delay=0.06), integrations=1)[0] == 0
    pairs = as_responses(narrow, first_order(narrow))
    sign = response_sign(pairs, "p", "mixer_roll", expected=1, integrations=1)
    assert (sign.sense, sign.wrong) == (0, False)
    assert "too narrow to tell" in sign.facts
    holding = controllers_answer(OMEGA, 0.135, 0.09, 0.0036) / (1.0 + 6.0 / (1j * OMEGA))  # it holds the attitude too
    answer = as_responses(OMEGA, holding)
    assert "neither sign follows" in response_sign(answer, "p", "mixer_roll", expected=1, integrations=1).facts
    turned = response_sign(as_responses(OMEGA, -first_order(OMEGA)), "p", "mixer_roll", expected=1, integrations=1)
    assert turned.wrong
    within, kept = map(
        float,
        re.findall(
            r"([\d.]+) rad off an aircraft's response with the sign turned, ([\d.]+) rad as it is", turned.facts
        )[0],
    )
    assert within < 0.1 < kept
    low = as_responses(OMEGA / 40.0, first_order(OMEGA / 40.0))
    assert "no coherent band above 0.3 Hz" in response_sign(low, "p", "mixer_roll", expected=1, integrations=1).facts


def test_only_what_names_promise_is_judged() -> None:
    assert response_signs(as_responses(OMEGA, first_order(OMEGA), input="stick_pitch", output="q")) == ()
    (sign,) = response_signs(as_responses(OMEGA, first_order(OMEGA), input="servo_pitch", output="q"))
    assert sign.wrong, "a positive servo_pitch is nose down"


# ---- what `respond` says of it ---------------------------------------------------------------------------------------
def flown(sense: float, *, unit: str = "1", seconds: float = 70.0) -> Flight:
    """A roll sweep on 25 e^(-0.03 s) / (s + 6), the stick in its own sense."""
    time = np.arange(0.0, seconds, 0.01)
    phase = 2.0 * np.pi * 0.3 * (seconds - 8.0) / np.log(25.0) * (25.0 ** ((time - 4.0) / (seconds - 8.0)) - 1.0)
    sweep = np.where((time > 4.0) & (time < seconds - 4.0), 0.1 * np.sin(phase), 0.0)
    p = np.zeros(time.size)
    for k in range(4, time.size):
        p[k] = p[k - 1] + 0.01 * (25.0 * sweep[k - 4] - 6.0 * p[k - 1])
    p += 0.003 * np.random.default_rng(2).standard_normal(time.size)
    data = stream(time, {"mixer_roll": sense * sweep, "p": p})
    data["mixer_roll"].attrs["logged_unit"] = unit
    return Flight({"log": data})


def asked(flight: Flight) -> FrequencyResponse:
    return respond(flight, inputs=["mixer_roll"], outputs=["p"], band=(0.3, 7.0))


def test_a_stick_that_is_positive_to_the_left_is_a_problem_with_its_remedy() -> None:
    assert not any("sign" in text for text in asked(flown(1.0)).problems)
    (told,) = asked(flown(-1.0, unit="%")).problems
    assert told.startswith("p / mixer_roll has the wrong sign: a positive mixer_roll makes p negative")
    assert "Give --unit mixer_roll=-%." in told
    (again,) = asked(flown(-1.0, unit="-%")).problems
    assert "Give --unit mixer_roll=%." in again, "what was turned already is turned back"


# ---- how often -----------------------------------------------------------------------------------------------------
def _counts(seeds: int) -> dict[str, int]:
    """Random aircraft and controllers' answers with noise: how often the sign is right, wrong and not told."""
    counts = dict.fromkeys(("right", "untold", "wrong", "answers", "answers taken for an aircraft"), 0)
    for seed in range(seeds):
        rng = np.random.default_rng([seed, 41])
        low = rng.uniform(0.1, 1.0)
        omega = 2.0 * np.pi * np.geomspace(low, low * 2.0 ** rng.uniform(2.0, 6.0), 60)
        s = 1j * omega
        pole, lag, delay = rng.uniform(0.1, 30.0), rng.uniform(8.0, 80.0), rng.uniform(0.0, 0.1)
        mode, damping = rng.uniform(10.0, 80.0), rng.uniform(0.1, 1.0)
        rotor = mode**2 / (s**2 + 2.0 * damping * mode * s + mode**2)
        plant = np.exp(-delay * s) * (rotor if seed % 2 else 1.0 / ((s + pole) * (1.0 + s / lag)))
        error = rng.choice([0.02, 0.1, 0.3])
        noise = np.exp(error * (rng.standard_normal(60) + 1j * rng.standard_normal(60)))
        sense = int(rng.choice([-1, 1]))
        told = sign_of(omega, sense * plant * noise, integrations=1, error=np.full(60, error))[0]
        counts["right" if told == sense else "untold" if told == 0 else "wrong"] += 1
        p = 10.0 ** rng.uniform(-2.0, 0.0)
        answer = controllers_answer(omega, p, p * rng.uniform(0.3, 5.0), p * rng.uniform(0.0, 0.05))
        counts["answers"] += 1
        counts["answers taken for an aircraft"] += sign_of(omega, answer * noise, integrations=1)[0] == 1
    return counts


@pytest.mark.parametrize("seeds", [40, pytest.param(1000, marks=pytest.mark.proof)])
def test_no_sign_is_wrong_and_most_are_told(seeds: int) -> None:
    counts = _counts(seeds)
    if seeds > 100:
        leave(
            "response-signs",
            {
                "title": "Signs from inputs to motions",
                "text": "Random aircraft over bands of 2 to 6 octaves, and controllers' answers. No sign may be wrong, "
                "no answer may be taken for an aircraft, and 90 % must be told.",
                "passed": counts["wrong"] == counts["answers taken for an aircraft"] == 0
                and counts["right"] >= 0.9 * seeds,
                "columns": ["case", "of", "count"],
                "rows": [[name, str(seeds), str(count)] for name, count in counts.items()],
            },
        )
    assert counts["wrong"] == 0
    assert counts["answers taken for an aircraft"] == 0
    assert counts["right"] >= 0.9 * seeds
