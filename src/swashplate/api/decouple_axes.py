"""The axes of any linear model by a matrix and by a filter, and what that reaches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from swashplate.api.asking import name_of, strings
from swashplate.control.laws.linear_decoupling import (
    Decoupling,
    HasMatrices,
    LinearSystem,
    coupling,
    dynamic_decoupling,
    static_decoupling,
)
from swashplate.errors import SwashError
from swashplate.models.linear import late_entries
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.linear_decoupling import compose_linear_decoupling
from swashplate.reporting.structure import Report
from swashplate.shown import Shown
from swashplate.simulation.linearize import linearize
from swashplate.simulation.trim import trim
from swashplate.text_table import text_table

if TYPE_CHECKING:
    from swashplate.api.verbs.decouple import Decouple

_USUAL = (
    (("lateral", "p"), ("longitudinal", "q")),
    (("A1", "p"), ("B1", "q")),
    (("servo_roll", "p"), ("servo_pitch", "q")),
)
_SLOW = ("x", "y", "z", "psi", "u", "v", "w", "phi", "theta")
"""States that a filter of fast axes leaves out of its copy, unless they are what is to be decoupled."""


@dataclass(frozen=True, repr=False)
class AxesDecoupling(Shown):
    """A matrix and a filter that decouple axes, and what they reach on their own model.

    Attributes:
        model: its name.
        system: that it is judged on, without delays.
        inputs, outputs: paired in order.
        made: "bare" (None), "matrix" and, where there is one, "filter".
        keep: states of the filter's copy.
        frequency: where the matrix decouples best [rad/s].
        frequencies: of the table [rad/s].
        problem: why there is no filter; None where there is one.
    """

    model: str
    system: HasMatrices
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    made: Mapping[str, Decoupling | None]
    keep: tuple[str, ...]
    frequency: float
    frequencies: tuple[float, ...]
    problem: str | None = None

    @property
    def problems(self) -> tuple[str, ...]:
        """Why there is no filter; empty where there is one."""
        return () if self.problem is None else (f"No filter: {self.problem}",)

    def ratios(self) -> dict[str, dict[str, Any]]:
        """Off-axis over on-axis response over the frequencies, by what was made and by axis."""
        axes = {"inputs": list(self.inputs), "outputs": list(self.outputs)}
        reached = {n: coupling(self.system, list(self.frequencies), by=by, **axes) for n, by in self.made.items()}
        return {
            name: {
                f"{output} of {self.outputs[k]}'s axis": ratios[i, k]
                for i, output in enumerate(self.outputs)
                for k in range(len(self.outputs))
                if i != k
            }
            for name, ratios in reached.items()
        }

    def to_document(self) -> dict[str, object]:
        """All of it as what becomes JSON."""
        made = self.made.get("filter")
        matrices = {"problem": self.problem} if made is None else _matrices(made.system, self.keep)
        matrix = self.made["matrix"]
        assert matrix is not None
        return {
            "kind": "decoupling",
            "model": self.model,
            "axes": {"inputs": list(self.inputs), "outputs": list(self.outputs)},
            "frequencies": list(self.frequencies),
            "matrix": matrix.matrix,
            "filter": matrices,
            "off_over_on_axis": self.ratios(),
        }

    def page(self, *, title: str | None = None) -> Report:
        """What `sp.report` writes."""
        return compose_linear_decoupling(
            self.system,
            self.made,
            name=self.model,
            inputs=self.inputs,
            outputs=self.outputs,
            frequency=self.frequency,
            problem=self.problem,
            title=title,
        )

    def __repr__(self) -> str:
        rows = [
            (f"{axis}, {name}", *(f"{100.0 * value:.1f}" for value in values))
            for name, ratios in self.ratios().items()
            for axis, values in ratios.items()
        ]
        head = ("off-axis over on-axis [%] at [rad/s]", *(f"{w:g}" for w in self.frequencies))
        matrix = self.made["matrix"]
        assert matrix is not None
        mixing = [(n, *(f"{v:+.4f}" for v in row)) for n, row in zip(self.inputs, matrix.matrix, strict=True)]
        return "\n\n".join(
            (text_table(head, rows), text_table((f"matrix made at {self.frequency:g} rad/s", *self.outputs), mixing))
        )


def decouple_axes(asked: Decouple, vehicle: Vehicle) -> AxesDecoupling:
    """The matrix and the filter that were asked for, of a vehicle with its changes."""
    system, frequency = _system(vehicle, asked.speed), asked.frequency
    chosen = tuple(asked.pair.items()) if asked.pair else _usual(system)
    axes: dict[str, Any] = {"inputs": [i for i, _ in chosen], "outputs": [o for _, o in chosen]}
    doubled = sorted({o for o in axes["outputs"] if axes["outputs"].count(o) > 1})
    if doubled:
        raise SwashError(f"gives {', '.join(doubled)} to two inputs.", channel="--pair", hint="Give each output once.")
    kept = list(strings(asked.keep) or [n for n in system.states if n not in _SLOW or n in axes["outputs"]])
    matrix = static_decoupling(system, frequency=frequency, **axes)
    made: dict[str, Decoupling | None] = {"bare": None, "matrix": matrix}
    problem = None
    try:
        made["filter"] = dynamic_decoupling(system, bandwidth=asked.bandwidth, keep=kept, **axes)
    except SwashError as error:
        problem = str(error)
    return AxesDecoupling(
        name_of(asked.vehicle) or vehicle.called,
        system,
        tuple(axes["inputs"]),
        tuple(axes["outputs"]),
        made,
        tuple(kept),
        frequency,
        tuple(asked.at),
        problem,
    )


def _usual(system: HasMatrices) -> tuple[tuple[str, str], ...]:
    """Roll and pitch rate by the inputs that this kind of model has for them."""
    return next((pairs for pairs in _USUAL if all(i in system.inputs for i, _ in pairs)), _USUAL[0])


def _system(model: Vehicle, speed: float) -> HasMatrices:
    structure = model.structure
    if structure is None:
        nominal = model.card.values().get("voltage_nominal")
        return linearize(model, trim(model, speed=speed, voltage=nominal))
    wide, owner = structure.wide  # an entry with its own delay is an input of its own there
    A, B, C, D = wide.explicit()
    shares = late_entries.shares(owner)
    return LinearSystem(A, B @ shares, C, D @ shares, structure.states, structure.inputs, structure.outputs)


def _matrices(system: LinearSystem, states: Sequence[str]) -> dict[str, Any]:
    return {"states": list(states), **{name: getattr(system, name) for name in "ABCD"}}
