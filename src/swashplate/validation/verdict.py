"""A verdict in words per axis, its thresholds visible."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

from swashplate.identification.time.feedback import AxisExcitation
from swashplate.validation.bands import SURE, Band
from swashplate.validation.floors import Floor
from swashplate.validation.validation import AxisVerdict, Score

THRESHOLDS = {"good": 50.0, "usable": 20.0}
"""Prediction fit [%] of every channel of an axis at its horizon; both must also beat every rival."""

LEVELS = ("good", "usable", "poor", "cannot be judged")
"""Every level, from the best to the one that says nothing about the model."""

_AXES = {
    # axis: channels, horizon [s]
    "roll": (("phi", "p"), 1.0),
    "pitch": (("theta", "q"), 1.0),
    "yaw": (("psi", "r"), 0.5),
    "heave": (("w",), 0.5),
    "horizontal": (("u", "v"), 0.5),
}
JUDGED_AT = {channel: horizon for channels, horizon in _AXES.values() for channel in channels}
"""The horizon [s] at which a channel is judged."""
JUDGED_AHEAD = max(horizon for _, horizon in _AXES.values())
"""Furthest horizon [s] that a verdict looks at."""


def verdict(
    scores: Sequence[Score],
    excitation: Sequence[AxisExcitation],
    floors: Sequence[Floor] = (),
    bands: Sequence[Band] = (),
) -> tuple[AxisVerdict, ...]:
    """Judge every axis whose channels were scored.

    Args:
        scores: of all predictors.
        excitation: of the flights that were predicted.
        floors: what the model's scores stand beside; the words say whether the model or the flight is poor.
        bands: of the predictions; the words say which hold less than they promise.
    """
    judged_axes = []
    for axis, (channels, horizon) in _AXES.items():
        rows = [s for s in scores if s.channel in channels and abs(s.horizon - horizon) < 1e-9]
        if not rows:
            continue
        judged = [item for item in excitation if item.axis == axis]
        beside = [f for f in floors if f.channel in channels and abs(f.horizon - horizon) < 1e-9]
        one = _one(axis, channels, horizon, rows, judged, beside)
        narrow = [b for b in bands if b.channel in channels and abs(b.horizon - horizon) < 1e-9 and b.promised == SURE]
        text = " ".join([one.words, *(b.warning for b in narrow if b.warning)])
        judged_axes.append(replace(one, words=text))
    return tuple(judged_axes)


def in_brief(verdicts: Iterable[AxisVerdict]) -> str:
    """The axes by level in one line, as "good: roll, horizontal; cannot be judged: pitch"."""
    judged = list(verdicts)
    by_level = {level: [v.axis for v in judged if v.level == level] for level in LEVELS}
    return "; ".join(f"{level}: {', '.join(axes)}" for level, axes in by_level.items() if axes)


def _one(
    axis: str,
    channels: tuple[str, ...],
    horizon: float,
    rows: Sequence[Score],
    judged: Sequence[AxisExcitation],
    floors: Sequence[Floor],
) -> AxisVerdict:
    model = {s.channel: s.fit for s in rows if s.predictor == "model"}
    rivals = {c: max(s.fit for s in rows if s.predictor != "model" and s.channel == c) for c in model}
    scatter = {f.channel: f" [{f.low:.0f} to {f.high:.0f}]" for f in floors if math.isfinite(f.low)}
    numbers = ", ".join(
        f"{c} {model[c]:.0f} %{scatter.get(c, '')} (best rival {rivals[c]:.0f} %)" for c in channels if c in model
    )
    said = f"{numbers} at {horizon:g} s."
    beside = "".join(f" {f.channel}: {f.summary_text}" for f in floors)
    hopeless = [f.channel for f in floors if f.reached and f.ceiling < THRESHOLDS["usable"]]
    beaten = [c for c in model if model[c] <= rivals[c]]
    worst = min(model.values())
    if judged and not any(item.identifiable for item in judged):
        return AxisVerdict(axis, "cannot be judged", f"{said} {judged[0].words}")
    if worst >= THRESHOLDS["good"] and not beaten:
        return AxisVerdict(axis, "good", said + beside)
    if worst >= THRESHOLDS["usable"] and not beaten:
        return AxisVerdict(axis, "usable", said + beside)
    why = f" Beaten in {', '.join(beaten)}." if beaten else ""
    if hopeless and min(model, key=lambda c: model[c]) in hopeless:
        return AxisVerdict(axis, "cannot be judged", said + why + beside)
    return AxisVerdict(axis, "poor", said + why + beside)
