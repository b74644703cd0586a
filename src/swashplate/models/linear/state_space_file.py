"""State-space model files: readable TOML, matrices as named equations, expressions parsed and never evaluated as code.

kind = "state-space"
name = "heave"
title = "Vertical speed of a helicopter in hover"
trust = "..."
# composed = "compose:heave"                 what `compose:` made it of; a fit takes start values from its core

[states]
w = "m/s"
[inputs]
collective = "1"

[equations]                                  # the right side, by state: coefficients of states and inputs
w = {w = "Zw", collective = "Zcol"}
[left]                                       # the left side, where it is not the plain derivative
# a = {a = "tau_f"}
[outputs.az]
unit = "m/s^2"
of = {}                                      # coefficients of states and inputs
rates = {w = "1"}                            # coefficients of the states' derivatives
# specific_force = "z", at = ["x_s", "y_s", "z_s"]   an accelerometer at a place from the centre of gravity
[delays]
collective = "tau"                           # by input, by "output/input", or by "w_dot/collective": one entry
[limits]                                     # of inputs, from the trim; only a controller needs them
collective = [-1.0, 1.0]
[trim]                                       # where the model stands if not in hover: accelerometers need it
# u = "U0", w = "W0", phi = "phi0"           m/s and rad; also v, theta; stitching needs all states and inputs, and
# collective = 0.4, air_density = 1.2        takes the air's density
[shape]
rotor_radius = 1.535                         # m: how large pages draw it, 1 if not given

[parameters]
Zw = {value = -0.6, unit = "1/s", upper = 0.0}
Zcol = {value = -14.0, unit = "m/s^2"}
tau = {value = 0.02, unit = "s", lower = 0.0}
# also: fixed = true, tie = "2 * Mu", dropped = 0.0, note = "..."
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from swashplate import documents
from swashplate.errors import CardError, ExpressionError
from swashplate.flights.schema import channel
from swashplate.models.linear import state_space_checks as checks
from swashplate.models.linear.accelerometer import AXES, TRIM, specific_force
from swashplate.models.linear.composition import PREFIX, document, is_composed
from swashplate.models.linear.expressions import Expression
from swashplate.models.linear.state_space import UNMOVED, Element, ModelParameter, StateSpaceModel
from swashplate.models.linear.structure_parts import PARTS
from swashplate.registry import nearest

SCHEMA = 1
_SECTIONS = {
    "kind",
    "schema",
    "name",
    "title",
    "trust",
    "states",
    "inputs",
    "equations",
    "left",
    "outputs",
    "delays",
    "parameters",
    "limits",
    "shape",
    "trim",
    "fit",
    "composed",
    UNMOVED,
}
_PARAMETER = {
    "value",
    "unit",
    "fixed",
    "lower",
    "upper",
    "tie",
    "dropped",
    "note",
    "start",
    "cramer_rao",
    "insensitivity",
}
_OUTPUT = {"unit", "of", "rates", "specific_force", "at"}


def structure_names() -> tuple[str, ...]:
    """Names of the structures that come with swashplate."""
    folder = resources.files("swashplate.models.linear") / "structures"
    return tuple(sorted(f.name.removesuffix(".toml") for f in folder.iterdir() if f.name.endswith(".toml")))


def structure(name_or_file: str | Path) -> StateSpaceModel:
    """A ready structure by name, one composed of parts ("compose:body+flap"), or a model file.

    Raises:
        CardError, ExpressionError: naming the file, the entry, what was found and what was expected.
    """
    text = str(name_or_file)
    if is_composed(text):
        return parse(tomli_w.dumps(document(text)), path=text)
    if text in structure_names():
        file = resources.files("swashplate.models.linear") / "structures" / f"{text}.toml"
        return parse(file.read_text(encoding="utf-8"), path=f"{text}.toml")
    try:
        content = documents.read_text(text, form="toml", error=CardError)
    except CardError as error:
        raise CardError(
            f"is neither a ready structure nor a file that can be read: {error.problem}",
            where=text,
            hint=f"{_alike(text)} Ready structures are {', '.join(structure_names())}; {PREFIX}body+flap+... composes "
            "one (swash vehicle structures).",
        ) from None
    return parse(content, path=text)


def _alike(text: str) -> str:
    """What a name that is none may stand for: a ready structure, or parts without the word before them."""
    if all(part.strip() in PARTS for part in text.split("+")):
        return f"Did you mean '{PREFIX}{text}'?"
    return nearest(text, structure_names())


def is_state_space(path: str | Path) -> bool:
    """Whether a file says that it is a state-space model."""
    return documents.kind_of(path) == "state-space"


def parse(text: str, *, path: str = "") -> StateSpaceModel:
    """A model from the text of its file."""
    document = documents.parse(text, form="toml", where=path, error=CardError)
    if document.get("kind") != "state-space":
        raise CardError(
            f"kind is {document.get('kind')!r}, expected 'state-space'.",
            where=path,
            hint='A model file of states and equations says kind = "state-space" in its first line.',
        )
    schema = document.get("schema", SCHEMA)
    if not isinstance(schema, int) or schema > SCHEMA:
        raise CardError(
            f"schema is {schema!r}, expected a whole number up to {SCHEMA}.", where=path, hint="Update swashplate."
        )
    unknown = sorted(set(document) - _SECTIONS)
    missing = sorted({"name", "states", "inputs", "equations", "outputs", "parameters"} - set(document))
    if unknown or missing:
        raise CardError(f"lacks {', '.join(missing) or 'nothing'} and has unknown {', '.join(unknown)}.", where=path)
    return _Reader(document, path).model()


class _Reader:
    """One document on its way to a model; every error names the file and the entry."""

    def __init__(self, document: Mapping[str, Any], path: str) -> None:
        self.document, self.path = document, path
        self.states = tuple(self._table("states"))
        self.inputs = tuple(self._table("inputs"))
        self.outputs = tuple(self._table("outputs"))
        self.parameters = {name: self._parameter(name, e) for name, e in self._table("parameters").items()}
        self.elements: list[Element] = []
        self.used: set[str] = {n for p in self.parameters.values() if p.tie for n in p.tie.names}
        self.trim = self._trim()

    def _table(self, name: str) -> Mapping[str, Any]:
        table = self.document.get(name, {})
        if not isinstance(table, Mapping):
            raise CardError("is not a table.", where=self.path, channel=name)
        return table

    def _parameter(self, name: str, entry: Any) -> ModelParameter:
        if not name.isidentifier():
            raise CardError("is no name that an expression could use.", where=self.path, channel=name)
        if isinstance(entry, int | float) and not isinstance(entry, bool):
            entry = {"value": entry}
        if not isinstance(entry, Mapping) or set(entry) - _PARAMETER or not {"value", "tie"} & set(entry):
            raise CardError(
                f"is {entry!r}, expected value or tie, and beside it only {', '.join(sorted(_PARAMETER))}.",
                where=self.path,
                channel=name,
            )
        for key in ("value", "lower", "upper", "dropped", "cramer_rao", "insensitivity"):
            number = entry.get(key, 0.0)
            if isinstance(number, bool) or not isinstance(number, int | float) or np.isnan(number):
                raise CardError(f"{key} is {number!r}, expected a number.", where=self.path, channel=name)
        low, high = float(entry.get("lower", -np.inf)), float(entry.get("upper", np.inf))
        value = float(entry.get("value", 0.0))
        if low > high:
            raise CardError(f"lower is {low:g}, above upper, {high:g}.", where=self.path, channel=name)
        if "tie" not in entry and not low <= value <= high:
            raise CardError(f"value {value:g} lies outside [{low:g}, {high:g}].", where=self.path, channel=name)
        checks.units({f"parameters.{name}.unit": entry.get("unit", "")}, path=self.path)
        return ModelParameter(
            name=name,
            value=value,
            unit=str(entry.get("unit", "")),
            free=not entry.get("fixed", False) and "tie" not in entry,
            lower=low,
            upper=high,
            tie=self._expression(entry["tie"], f"parameters.{name}.tie") if "tie" in entry else None,
            dropped=float(entry.get("dropped", 0.0)),
            note=str(entry.get("note", "")),
            cramer_rao=float(entry.get("cramer_rao", np.nan)),
            insensitivity=float(entry.get("insensitivity", np.nan)),
        )

    def _expression(self, text: Any, entry: str) -> Expression:
        if isinstance(text, int | float) and not isinstance(text, bool):
            text = repr(text)
        if not isinstance(text, str):
            raise CardError(f"is {text!r}, expected an expression in quotes.", where=self.path, channel=entry)
        try:
            expression = Expression(text)
        except ExpressionError as error:
            raise CardError(error.problem, where=self.path, channel=entry, hint=error.hint) from None
        known = self._table("parameters")
        for name in sorted(expression.names - set(known)):
            near = difflib.get_close_matches(name, known, n=1)
            raise CardError(
                f"uses '{name}', which is no parameter of this model.",
                where=self.path,
                channel=entry,
                hint=f"Did you mean '{near[0]}'?" if near else f"Add {name} to [parameters].",
            )
        return expression

    def _add(self, matrix: str, row: int, column: int, text: Any, entry: str) -> None:
        expression = self._expression(text, entry)
        self.used |= expression.names
        for k, old in enumerate(self.elements):
            if (old.matrix, old.row, old.column) == (matrix, row, column):
                joined = Expression(f"({old.expression.text}) + ({expression.text})")
                self.elements[k] = Element(matrix, row, column, joined)
                return
        self.elements.append(Element(matrix, row, column, expression))

    def _row(self, table: Any, row: int, entry: str, *, of_states: str, of_inputs: str | None) -> None:
        if not isinstance(table, Mapping):
            raise CardError("is not a table of coefficients.", where=self.path, channel=entry)
        for name, text in table.items():
            if name in self.states:
                self._add(of_states, row, self.states.index(name), text, f"{entry}.{name}")
            elif of_inputs is not None and name in self.inputs:
                self._add(of_inputs, row, self.inputs.index(name), text, f"{entry}.{name}")
            else:
                everything = (*self.states, *self.inputs)
                near = difflib.get_close_matches(name, everything, n=1)
                raise CardError(
                    f"'{name}' is no state{' or input' if of_inputs else ''} of this model.",
                    where=self.path,
                    channel=entry,
                    hint=f"Did you mean '{near[0]}'?" if near else f"There are {', '.join(everything)}.",
                )

    def _state(self, name: str, entry: str) -> int:
        if name not in self.states:
            raise CardError(
                f"needs the state '{name}'; there are {', '.join(self.states)}.", where=self.path, channel=entry
            )
        return self.states.index(name)

    def _specific_force(self, row: int, name: str, output: Mapping[str, Any]) -> None:
        entry, axis = f"outputs.{name}", output["specific_force"]
        if axis not in AXES:
            raise CardError(f"specific_force is {axis!r}, expected 'x', 'y' or 'z'.", where=self.path, channel=entry)
        at = output.get("at", [0, 0, 0])
        if not isinstance(at, list) or len(at) != 3:
            raise CardError(f"at is {at!r}, expected three expressions.", where=self.path, channel=entry)
        for matrix, state, text in specific_force(axis, at=at, trim=self.trim, states=self.states):
            self._add(matrix, row, self._state(state, entry), text, entry)

    def _trim(self) -> dict[str, str]:
        """Expressions of the trim's speeds and angles."""
        known = dict.fromkeys((*TRIM, *self.states, *self.inputs, "air_density"))
        for name, text in self._table("trim").items():
            entry = f"trim.{name}"
            if name not in known:
                raise CardError(
                    "is no part of a trim.", where=self.path, channel=entry, hint=f"It has {', '.join(known)}."
                )
            self.used |= self._expression(text, entry).names
        return {name: str(text) for name, text in self._table("trim").items()}

    def model(self) -> StateSpaceModel:
        for name, table in self._table("left").items():
            row = self._state(name, f"left.{name}")
            self._row(table, row, f"left.{name}", of_states="M", of_inputs=None)
        for name in self.states:
            if name not in self._table("equations"):
                raise CardError(
                    "has no equation.", where=self.path, channel=name, hint=f"Add it to [equations]: {name} = ..."
                )
        for name, table in self._table("equations").items():
            row = self._state(name, f"equations.{name}")
            self._row(table, row, f"equations.{name}", of_states="F", of_inputs="G")
        units = {**self._table("states"), **self._table("inputs")}
        given = {f"{part}.{name}": u for part in ("states", "inputs") for name, u in self._table(part).items()}
        checks.units(given, path=self.path)
        for row, (name, output) in enumerate(self._table("outputs").items()):
            entry = f"outputs.{name}"
            if not isinstance(output, Mapping) or set(output) - _OUTPUT:
                raise CardError(f"may have only {', '.join(sorted(_OUTPUT))}.", where=self.path, channel=entry)
            units[name] = output.get("unit", units.get(name, "") or channel(name).unit)  # a state's, or the schema's
            checks.units({f"{entry}.unit": units[name]}, path=self.path)
            self._row(output.get("of", {}), row, entry, of_states="H0", of_inputs="D")
            self._row(output.get("rates", {}), row, f"{entry}.rates", of_states="H1", of_inputs=None)
            if "specific_force" in output:
                self._specific_force(row, name, output)
        delays = {name: self._expression(text, f"delays.{name}") for name, text in self._table("delays").items()}
        self.used = self.used.union(*(expression.names for expression in delays.values()))
        entries = {(self.states[e.row], self.inputs[e.column]) for e in self.elements if e.matrix == "G"}
        checks.delays(delays, self.inputs, self.outputs, entries, path=self.path)
        checks.limits(self._table("limits"), self.inputs, path=self.path)
        checks.shape(self._table("shape"), path=self.path)
        if unknown := sorted(set(self._table(UNMOVED)) - set(self.inputs)):
            raise CardError("is no input.", where=self.path, channel=f"{UNMOVED}.{unknown[0]}")
        idle = sorted(set(self.parameters) - self.used)
        if idle:
            raise CardError(
                "stands in no equation, output, delay or tie.",
                where=self.path,
                channel=", ".join(idle),
                hint="Is it misspelt?",
            )
        model = StateSpaceModel(
            name=str(self.document["name"]),
            title=str(self.document.get("title", self.document["name"])),
            trust=str(self.document.get("trust", "")),
            states=self.states,
            inputs=self.inputs,
            outputs=self.outputs,
            parameters=self.parameters,
            elements=tuple(self.elements),
            delays=delays,
            units={name: str(unit) for name, unit in units.items()},
            document=self.document,
        )
        try:
            model = model.with_values({})  # tied values follow, circles are found
            for e in model.elements:
                e.expression(model.numbers())
        except ExpressionError as error:
            raise CardError(error.problem, where=self.path, hint=error.hint) from None
        return model


def to_toml(model: StateSpaceModel) -> str:
    """The model as the text of a file that `parse` reads: its document with the present numbers."""
    parameters: dict[str, Any] = {}
    for name, p in model.parameters.items():
        entry: dict[str, Any] = {"value": p.value}
        entry |= {"unit": p.unit} if p.unit else {}
        entry |= {"tie": p.tie.text} if p.tie is not None else {}
        entry |= {"fixed": True} if not p.free and p.tie is None else {}
        for key in ("lower", "upper"):
            if np.isfinite(getattr(p, key)):
                entry[key] = getattr(p, key)
        for key in ("cramer_rao", "insensitivity"):
            if np.isfinite(getattr(p, key)):
                entry[key] = getattr(p, key)
        entry |= {"dropped": p.dropped} if p.dropped else {}
        entry |= {"note": p.note} if p.note else {}
        parameters[name] = entry
    head = {"kind": "state-space", "schema": SCHEMA, "name": model.name, "title": model.title, "trust": model.trust}
    return tomli_w.dumps({**model.document, **head, "parameters": parameters})


def trim_of(model: StateSpaceModel) -> dict[str, float]:
    """What the model's [trim] says, in numbers; empty where it says nothing."""
    numbers = model.numbers()
    return {name: float(Expression(str(text))(numbers)) for name, text in model.document.get("trim", {}).items()}
