"""The decoupling of a linear model as a page: off-axis over on-axis response against frequency, and what steps do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from swashplate.control.laws.linear_decoupling import (
    Decoupling,
    HasMatrices,
    coupling,
    in_series,
    step_answers,
    unmixed,
)
from swashplate.reporting.structure import Block, Figure, Key, Report, Section, Text, tabulate
from swashplate.reporting.theme import axis_number, line, over_frequency, stacked, style

_WORDS = {"bare": "bare inputs", "matrix": "constant matrix", "filter": "filter"}
_LOW, _HIGH, _POINTS = 0.3, 60.0, 120
"""rad/s, of the plots."""
_STEP = 2.0
"""Seconds of the step's answers."""


def compose_linear_decoupling(
    model: HasMatrices,
    decouplings: Mapping[str, Decoupling | None],
    *,
    name: str,
    inputs: Sequence[str],
    outputs: Sequence[str],
    frequency: float,
    problem: str | None,
    title: str | None = None,
) -> Report:
    """The report's structure.

    Args:
        model: that it is judged on.
        made: "bare" (None), "matrix" and, where there is one, "filter".
        name: of the model.
        inputs, outputs: paired in order.
        frequency: where the matrix was made [rad/s].
        problem: why there is no filter.
        title: heading.
    """
    axes = {"inputs": list(inputs), "outputs": list(outputs)}
    w = np.geomspace(_LOW, _HIGH, _POINTS)
    ratios = {law: coupling(model, w, by=by, **axes) for law, by in decouplings.items()}
    pairs = [(i, k) for i in range(len(outputs)) for k in range(len(outputs)) if i != k]
    near = int(np.argmin(np.abs(w - frequency)))
    worst = {law: max(float(ratio[i, k, near]) for i, k in pairs) for law, ratio in ratios.items()}
    summary = "; ".join(f"{_WORDS[law]} {100.0 * value:.3g} %" for law, value in worst.items())
    return Report(
        title=title or f"{name}: decoupling of {', '.join(outputs)}",
        banners=(("caution", f"No filter: {problem}"),) if problem else (),
        summary=(
            ("Axes", ", ".join(f"{i} moves {o}" for i, o in zip(inputs, outputs, strict=True)), "plain"),
            ("Coupling", f"largest off-axis over on-axis response at {frequency:g} rad/s: {summary}.", "plain"),
            ("Judged", "on its own model, where the filter is exact; flown, it is as good as that model.",
             "caution")
        ),
        picture=_ratio_figure(w, ratios, pairs, outputs),
        sections=(_steps(model, decouplings, axes), _numbers(decouplings, axes, frequency))
    )  # fmt: skip


def _keys(names: Sequence[str]) -> tuple[Key, ...]:
    return tuple(Key(_WORDS[name], *style(number)) for number, name in enumerate(names))


def _ratio_figure(
    w: Any, ratios: Mapping[str, Any], pairs: Sequence[tuple[int, int]], outputs: Sequence[str]
) -> Figure:
    layout = over_frequency([f"{outputs[i]} over {outputs[k]} [%]" for i, k in pairs])
    traces = []
    for panel, (i, k) in enumerate(pairs):
        layout[f"yaxis{'' if panel == 0 else panel + 1}"]["type"] = "log"
        for number, (name, ratio) in enumerate(ratios.items()):
            color, dash = style(number)
            shown = 100.0 * np.maximum(ratio[i, k], 1e-5)  # an exact filter leaves rounding
            hover = f"{_WORDS[name]}<br>%{{x:.3g}} rad/s, %{{y:.3g}} %"
            axis = axis_number(panel)
            traces.append(line(w, shown, name=name, color=color, dash=dash, hover=hover, axis=axis))
    return Figure(
        identifier="key-picture",
        spec={"data": traces, "layout": layout},
        caption="Off-axis over on-axis response; 100 %: as much motion on the other axis as on its own.",
        alt="Off-axis over on-axis response against frequency, bare, with the matrix and with the filter.",
        keys=_keys(list(ratios)),
    )


def _steps(
    model: HasMatrices, decouplings: Mapping[str, Decoupling | None], axes: Mapping[str, Sequence[str]]
) -> Section:
    """Both outputs on a step of each axis, scaled so that the on-axis answer's largest is one."""
    outputs = axes["outputs"]
    time = np.linspace(0.0, _STEP, 201)
    titles = [f"{o} on {axis}'s axis [-]" for axis in outputs for o in outputs]
    layout, traces = stacked(titles, height=95), []
    for number, by in enumerate(decouplings.values()):
        color, dash = style(number)
        system = in_series(by or unmixed(**axes), model)
        for k in range(len(outputs)):
            answer = step_answers(system, k, time)
            largest = answer[k, np.argmax(np.abs(answer[k]))]
            answer = answer / max(abs(float(largest)), 1e-12) * np.sign(largest)
            for i in range(len(outputs)):
                panel = k * len(outputs) + i
                axis = axis_number(panel)
                traces.append(line(time, answer[i], name=titles[panel], color=color, dash=dash, axis=axis))
    figure = Figure(
        identifier="decoupled-steps",
        spec={"data": traces, "layout": layout},
        caption=f"A step of each axis for {_STEP:g} s, in units of the largest on-axis answer.",
        alt="Answers of all outputs to a step of each axis.",
        keys=_keys(list(decouplings)),
    )
    return Section("steps", "Steps", (figure,))


def _numbers(
    decouplings: Mapping[str, Decoupling | None], axes: Mapping[str, Sequence[str]], frequency: float
) -> Section:
    blocks: list[Block] = []
    matrix, filtered = decouplings["matrix"], decouplings.get("filter")
    if matrix is not None:
        rows = tuple(
            (name, *(f"{value:+.4f}" for value in row)) for name, row in zip(axes["inputs"], matrix.matrix, strict=True)
        )
        title = f"The matrix, made at {frequency:g} rad/s"
        blocks.append(tabulate(title, ("input", *(f"{o}'s axis" for o in axes["outputs"])), rows))
    if filtered is not None:
        modes = np.linalg.eigvals(filtered.system.A)
        modes = modes[np.argsort(-modes.real)]
        rows = tuple((f"{m.real:+.3f}", f"±{m.imag:.3f}" if m.imag > 0.0 else "0") for m in modes if m.imag >= 0.0)
        blocks.append(tabulate("The filter's modes", ("real part [1/s]", "imaginary part [1/s]"), rows))
    blocks.append(
        Text("The matrix's columns leave the on-axis gains as they were. Falb and Wolovich (1967) for the filter.")
    )
    return Section("numbers", "Matrix and filter", tuple(blocks))
