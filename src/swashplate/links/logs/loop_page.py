"""An axis' loop as the page closes it by itself: names, gains, plant and its steps; the law is in `page/loop.js`."""

from __future__ import annotations

from typing import Any

import numpy as np

from swashplate.control.analysis.ardupilot_gains import Suggestion
from swashplate.control.analysis.rate_gain_names import ARDUPILOT, names_of, short
from swashplate.control.analysis.rate_loop import LOWEST, SEEN, LoopFigures
from swashplate.control.analysis.rate_loop_steps import held_model


def loop_of(suggestion: Suggestion) -> dict[str, Any]:
    """Gains flown and suggested with what they are worth, and what the page needs to judge any others."""
    loop, axis = suggestion.loop, suggestion.axis
    omega = SEEN[max(LOWEST, 3.0 * loop.unstable) <= SEEN]
    plant = loop.plant(omega)
    model = None
    if loop.structure is not None:
        held = held_model(loop.structure, loop.rate, loop.command)
        page_names = ("ad", "bd", "cd", "dd", "late")
        model = {name: np.asarray(value).tolist() for name, value in zip(page_names, held, strict=True)}
    return {
        "axis": axis,
        "rate": loop.rate,
        "words": _why(suggestion),
        "cli": axis not in ARDUPILOT,
        "gains": [
            {
                "short": key,
                "name": name,
                "unit": short({name: 1.0})[key],
                "flown": suggestion.flown.get(name),
                "suggested": suggestion.parameters.get(name),
            }
            for key, name in names_of(axis).items()
        ],
        "flown": _bounds(suggestion.figures_flown),
        "suggested": _bounds(suggestion.figures_suggested),
        "loop": {
            "omega": omega,
            "plant": np.stack([plant.real, plant.imag], axis=-1),
            "gyro": loop.gyro_filter,
            "model": model,
        },
    }


def _bounds(f: LoopFigures) -> dict[str, list[float]] | None:
    """Margins with what the fit's errors make of them; None where they were not judged."""
    if not np.isfinite(f.peak):
        return None
    read = f.margins
    named = {
        "phase_margin": read.phase_margin,
        "gain_margin": read.gain_margin,
        "delay_margin": read.delay_margin,
        "crossover": read.crossover,
    }
    return {name: [float(one.value), float(one.sigma)] for name, one in named.items()}


def _why(suggestion: Suggestion) -> str:
    """Why anybody should want it, or that nothing needs changing; then what to do first."""
    if suggestion.parameters == suggestion.flown:
        return f"Nothing needs changing. {suggestion.words}"
    if not suggestion.buys:
        return suggestion.words
    pays = f", and costs {', '.join(suggestion.costs)}" if suggestion.costs else ", and nothing is worse"
    return f"The suggestion buys {', '.join(suggestion.buys)}{pays}. {suggestion.words}".replace("->", "→")
