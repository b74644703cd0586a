"""Handling qualities and margins of flights and of the models fitted to them, side by side, each with its error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, fields, replace
from typing import TypeVar

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.errors import IdentificationError
from swashplate.flights.motion_signs import expected_sense
from swashplate.identification.frequency.handling import (
    Handling,
    ReadNumber,
    ResponseMargins,
    attitude_of,
    handling_qualities,
    margins,
)
from swashplate.identification.frequency.reading_accuracy import Fitted, has_pair, spread
from swashplate.identification.frequency.response_cost import Target
from swashplate.identification.responses.frequency_response import FrequencyResponse

ANGLES = {"p": "phi", "q": "theta", "r": "psi"}
"""The attitude behind each rate."""

OWN = 0.25
"""Share of an output's power that an input must have made for the output's axis to be its own."""

_NO_LOOP = "no delay margin: a loop that flew is stable, so this is no broken loop, or its sign is turned"
_WIDE = np.geomspace(0.3, 300.0, 800)
_Kind = TypeVar("_Kind", Handling, ResponseMargins)


@dataclass(frozen=True)
class Line:
    """What was read off one response.

    Attributes:
        response: "phi / mixer_roll". source: "flight" or "model".
        read: the numbers; None where there are none.
        problem: why; beside numbers, what a reader must know of them.
    """

    response: str
    source: str
    read: Handling | ResponseMargins | None
    problem: str = ""

    def to_document(self) -> dict[str, object]:
        """Numbers and words as JSON types: each number with its error."""
        numbers = {f.name: list(astuple(getattr(self.read, f.name))) for f in fields(self.read)} if self.read else {}
        return {"response": self.response, "from": self.source, **numbers, "problem": self.problem}

    def __repr__(self) -> str:
        head, r = f"{self.response} ({self.source}): ", self.read
        if isinstance(r, ResponseMargins):
            head += f"crossover {r.crossover!r} rad/s, phase margin {r.phase_margin!r} deg, "
            head += f"gain margin {r.gain_margin!r} dB at {r.omega_180!r} rad/s, "
            flew = self.source == "flight" and r.delay_margin.value == 0.0
            return head + (_NO_LOOP if flew else f"delay margin {r.delay_in_words()}")
        if r is None:
            return head + self.problem
        remark = f"; {self.problem}" if self.problem else ""
        return head + f"bandwidth {r.bandwidth!r} rad/s, phase delay {r.phase_delay_line!r} s{remark}"


def own_input(responses: FrequencyResponse, output: str) -> str | None:
    """The input that moved an output most where it was coherent; None where others, not named, moved it more."""
    o = responses.outputs.index(output)
    reached: dict[str, float] = {}
    for i, name in enumerate(responses.inputs):
        band = responses.band(output, name)
        if band is not None:
            inside = (responses.omega >= band[0]) & (responses.omega <= band[1])
            gain = np.abs(responses.response[inside, o, i]) ** 2
            power, total = responses.input_power[inside, i], responses.output_power[inside, o]
            # Responses from elsewhere (control.FRD) know no powers; then the gain decides.
            known = np.isfinite(power).any() and np.isfinite(total).any()
            share = np.nansum(gain * power) / np.nansum(total) if known else 1.0 + np.nanmean(gain)
            reached[name] = float(share)
    best = max(reached, key=lambda name: reached[name], default=None)
    return best if best is not None and reached[best] > OWN else None


def handling_lines(responses: FrequencyResponse, fits: Sequence[Fitted] = ()) -> list[Line]:
    """Bandwidth and phase delay of the attitude behind every rate, by its own input, of flight and models."""
    lines = []
    for rate, angle in ANGLES.items():
        name = own_input(responses, rate) if rate in responses.outputs else None
        if name is None:
            continue
        title = f"{angle} / {name}"
        try:
            omega, attitude, error, coherence = attitude_of(responses, rate, name)
            sign = _pilots(attitude)
            qualities = handling_qualities(omega, sign * attitude, error=error, coherence=coherence)
            lines.append(Line(title, "flight", qualities, _turned(sign, name, angle)))
        except IdentificationError as problem:
            lines.append(Line(title, "flight", None, problem.problem))

        for fit in fits:
            if has_pair(fit, rate, name):
                h = fit.solution.response(_WIDE)[:, fit.solution.outputs.index(rate), fit.solution.inputs.index(name)]
                sign = _pilots(h / (1j * _WIDE))

                def by_model(h: Complex, sign: float = sign) -> Handling:
                    return handling_qualities(_WIDE, sign * h / (1j * _WIDE))

                line = _of_model(title, fit, rate, name, _WIDE, by_model, Handling)
                lines.append(replace(line, problem=line.problem or _turned(sign, name, angle)))
    return lines


def margin_lines(responses: FrequencyResponse, fit: Fitted, targets: Sequence[Target]) -> list[Line]:
    """Crossover and margins of responses that are taken as broken loops, of the flight and of the model."""
    lines = []
    for wanted in targets:
        h, _, error = responses.pair(wanted.output, wanted.input)
        inside = (responses.omega >= wanted.omega[0]) & (responses.omega <= wanted.omega[-1]) & np.isfinite(h)
        omega = responses.omega[inside]
        lines.append(Line(wanted.name, "flight", margins(omega, h[inside], error=error[inside])))
        wide = np.geomspace(omega[0] / 10.0, omega[-1] * 10.0, 800)

        def by_model(h: Complex, wide: Array = wide) -> ResponseMargins:
            return margins(wide, h)

        lines.append(_of_model(wanted.name, fit, wanted.output, wanted.input, wide, by_model, ResponseMargins))
    return lines


def model_margins(fit: Fitted, output: str, input: str, omega: Array, controller: Complex) -> ResponseMargins:
    """Margins of controller and fitted model in one loop, with what the model's bounds make of them."""
    reading = _of_model("", fit, output, input, omega, lambda h: margins(omega, controller * h), ResponseMargins).read
    assert isinstance(reading, ResponseMargins)
    return reading


def _of_model(
    title: str,
    fit: Fitted,
    output: str,
    input: str,
    omega: Array,
    read: Callable[[Complex], _Kind],
    kind: type[_Kind],
) -> Line:
    names = [f.name for f in fields(kind)]

    def numbers(h: Complex) -> Array:
        try:
            reading = read(h)
        except IdentificationError:
            return np.full(len(names), np.nan)
        return np.array([getattr(reading, name).value for name in names])

    value, sigma = spread(fit, output, input, omega, numbers)
    if not np.isfinite(value).any() and kind is Handling:
        return Line(title, "model", None, "the phase does not fall through -180 degrees")
    return Line(title, "model", kind(*(ReadNumber(float(v), float(s)) for v, s in zip(value, sigma, strict=True))))


def _pilots(attitude: Complex) -> float:
    """What turns a response to the sign that a pilot expects, 1 or -1: a positive command turns positively."""
    return -1.0 if (1j * attitude[len(attitude) // 4]).real < 0.0 else 1.0


def _turned(sign: float, input: str, angle: str) -> str:
    """That a response was read with its sign turned, in words."""
    if sign > 0.0:
        return ""
    text = f"read with its sign turned: a positive {input} makes {angle} negative"
    return f"{text}, {'as its name says' if expected_sense(angle, input) < 0 else 'look at the units of both'}"
