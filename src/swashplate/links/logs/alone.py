"""Where several inputs were estimated together: what one alone would have been worth, and what it does off its axis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from swashplate.errors import SwashError
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.links.logs.sweep_channels import Channels
from swashplate.public import resolve

_SEEN = 0.6
"""Coherence from which a response counts."""


def off_axis(responses: FrequencyResponse, chosen: Channels, others: Sequence[str]) -> list[dict[str, Any]]:
    """What an input does to the other axes' outputs, over what it does to its own: lines to draw, and in words.

    Args:
        responses: of all inputs together. others: outputs of the other axes.
    """
    on, _, _ = responses.pair(chosen.output, chosen.input)
    hertz, drawn = responses.omega / (2.0 * np.pi), []
    for other in others:
        h, coherence, _ = responses.pair(other, chosen.input)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = 20.0 * np.log10(np.abs(h / on))
        counted = (coherence >= _SEEN) & np.isfinite(share)
        if counted.any():
            largest = int(np.argmax(np.where(counted, share, -np.inf)))
            remark = (
                f"{chosen.input} moves {other} by at most {share[largest]:.1f} dB of {chosen.output} (at "
                f"{hertz[largest]:.2g} Hz); {counted.sum()} of {counted.size} lines are coherent enough to tell."
            )
        else:
            remark = f"What {chosen.input} does to {other} is not told: no line has a coherence of {_SEEN:g}."
        drawn.append({"output": other, "share": np.where(counted, share, np.nan), "words": remark})
    return drawn


def alone(
    records: Any, chosen: Channels, joint: FrequencyResponse, *, band: tuple[float, float], form: str
) -> dict[str, Any]:
    """The single-input answer of a sweep beside that of all inputs: its cost, how far it is off, and where.

    Args:
        records: of the sweep's own part. joint: of all inputs. form: of the transfer function that was chosen.
    """
    references = [chosen.reference] if chosen.reference else []
    try:
        single = resolve("respond")(
            records, inputs=[chosen.input], outputs=[chosen.output], references=references, band=band
        )
        fit = resolve("fit_tf")(single, input=chosen.input, form=form).fit
    except SwashError as error:
        return {"cost": None, "words": f"One input alone gives no answer: {error.problem}"}
    h, coherence, _ = single.pair(chosen.output, chosen.input)
    wanted, trusted, _ = joint.pair(chosen.output, chosen.input)
    omega = single.omega
    there = (
        np.interp(omega, joint.omega, np.log(np.abs(wanted))),
        np.interp(omega, joint.omega, np.unwrap(np.angle(wanted))),
    )
    coherent = (coherence >= _SEEN) & (np.interp(omega, joint.omega, trusted) >= _SEEN) & np.isfinite(h)
    if not coherent.any():
        return {"cost": float(fit.cost), "words": "One input alone gives no response that counts."}
    size = 20.0 / np.log(10.0) * np.abs(np.log(np.abs(h)) - there[0])
    turn = np.degrees(np.abs(np.angle(h * np.exp(-1j * there[1]))))
    worst, turned = int(np.argmax(np.where(coherent, size, -1.0))), int(np.argmax(np.where(coherent, turn, -1.0)))
    hertz = omega / (2.0 * np.pi)
    remark = (
        f"{chosen.input} alone gives J = {fit.cost:.1f}, and is off by up to {size[worst]:.1f} dB (at "
        f"{hertz[worst]:.2g} Hz) and {turn[turned]:.0f} deg (at {hertz[turned]:.2g} Hz)."
    )
    return {"cost": float(fit.cost), "decibels": float(size[worst]), "degrees": float(turn[turned]), "words": remark}
