"""Structures composed of parts: "compose:body+flap+inflow" as the document of a state-space model file.

A pair among the parts ("compose:body+flap+r/pedal") gives that response a delay of its own, a derivative and an input
("compose:body+flap+r_dot/pedal") that entry of G.

What the parts are is said in `structure_parts`. Quasi-steady body and first-order tip-path plane: Tischler and Remple
2012, ch. 15, and Mettler, Tischler and Kanade 1999; inflow: Pitt and Peters 1981, Chen and Hindson 1986.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from swashplate.errors import CardError
from swashplate.models.linear.accelerometer import TRIM
from swashplate.models.linear.expressions import Expression
from swashplate.models.linear.structure_parts import HELD, INPUTS, PARTS, SERVO, SHORT, number
from swashplate.registry import nearest

PREFIX = "compose:"

_CORES = tuple(name for name, part in PARTS.items() if part.core)
_TRIM_NAMES = {"u": "U0", "v": "V0", "w": "W0", "phi": "phi0", "theta": "theta0"}
_ACCELEROMETERS = {"ax": ("x", "u"), "ay": ("y", "v"), "az": ("z", "w")}


def is_composed(name: object) -> bool:
    """Whether a name says what a structure is composed of."""
    return str(name).startswith(PREFIX)


def parts_of(text: str) -> tuple[str, ...]:
    """The parts that "compose:body+flap" names, in the order in which they are put together; pairs are left out.

    Raises:
        CardError: an unknown part (with what it may stand for), or parts that make no sense together.
    """
    given = [part for part in _named(text) if "/" not in part]
    if not any(given):
        raise CardError("names no part.", where=text, hint=f"An example: {PREFIX}body+flap. {_listed()}")
    for name in given:
        if name not in PARTS:
            raise CardError(
                f"'{name}' is no part of a structure.", where=text, hint=f"{nearest(name, PARTS)} {_listed()}".strip()
            )
        if given.count(name) > 1:
            raise CardError(f"'{name}' is named twice.", where=text)
    reason = nonsense(given)
    if reason:
        raise CardError(reason, where=text, hint=f"See `swash structures list`. {_listed()}")
    return tuple(name for name in PARTS if name in given)


def pairs_of(text: str) -> tuple[str, ...]:
    """The responses (output/input) or entries (state_dot/input) with a delay of their own that a name holds."""
    return tuple(part for part in _named(text) if "/" in part)


def _named(text: str) -> list[str]:
    return [part.strip() for part in text.removeprefix(PREFIX).split("+")]


def nonsense(parts: Sequence[str]) -> str:
    """Why these parts make no sense together; empty where they do."""
    if not any(PARTS[name].core for name in parts):
        return f"there is nothing that flies: it lacks one of {', '.join(_CORES)}."
    for name in parts:
        part = PARTS[name]
        for other, why in part.excludes.items():
            if other in parts:
                return f"'{name}' and '{other}' cannot stand together: {why}."
        if part.needs and not set(part.needs) & set(parts):
            return f"'{name}' needs {' or '.join(part.needs)}: {part.why}."
    return ""


def _listed() -> str:
    return f"Parts are {', '.join(PARTS)}."


def document(text: str) -> dict[str, Any]:
    """The model file of "compose:..." as a document.

    Args:
        text: parts; an output and input among them ("r/pedal") has a delay of its own in that response, a derivative
            and input ("r_dot/pedal") in that equation.

    Raises:
        CardError: an unknown part, parts that make no sense together, a pair that they do not have.
    """
    names, pairs = parts_of(text), pairs_of(text)
    parts = [PARTS[name] for name in names]
    states = {state: unit for part in parts for state, unit in part.states.items()}
    equations: dict[str, dict[str, str]] = {state: {} for state in states}
    for part in parts:
        for row, column in part.replaces:
            entry = equations.get(row, {})
            if column in entry:
                entry[column] = _kinematic(entry[column])
        for row, entries in part.equations.items():
            for column, expression in entries.items():
                if row in states and (column in states or column in INPUTS):
                    old = equations[row].get(column, "")
                    equations[row][column] = f"{old} + {expression}" if old and old != "0" else expression
    equations = {row: {c: text for c, text in entries.items() if text != "0"} for row, entries in equations.items()}
    used = {column for entries in equations.values() for column in entries}
    inputs = {name: unit for name, unit in INPUTS.items() if name in used}
    left = {row: dict(entries) for part in parts for row, entries in part.left.items()}
    if "actuators" in names:
        _behind_actuators(states, equations, left, inputs)
    outputs: dict[str, Any] = {
        name: {"unit": unit, "of": {name: "1"}}
        for name, unit in states.items()
        if name in ("p", "q", "r", "phi", "theta", "u", "v", "w")
    }
    outputs |= {
        name: {"unit": "m/s^2", "specific_force": axis}
        for name, (axis, speed) in _ACCELEROMETERS.items()
        if speed in states
    }
    model: dict[str, Any] = {
        "kind": "state-space",
        "name": "+".join(names),
        "title": f"Composed of {', '.join(names)}: {len(states)} states",
        "trust": _trust(names),
        "composed": PREFIX + "+".join((*names, *pairs)),
        "states": states,
        "inputs": inputs,
        "equations": equations,
        "left": left,
        "outputs": outputs,
        "delays": _delays(text, pairs, tuple(inputs), tuple(outputs), equations),
    }
    if "body" in names:
        model["trim"] = {state: _TRIM_NAMES[state] for state in TRIM}
    return model | {"parameters": _parameters(model)}


def _delays(
    text: str,
    pairs: Sequence[str],
    inputs: Sequence[str],
    outputs: Sequence[str],
    equations: Mapping[str, Mapping[str, str]],
) -> dict[str, str]:
    """One delay for each input, and one for each pair or entry that is named; an input whose all are has none left."""
    own: dict[str, str] = {}
    entries = [f"{row}_dot/{name}" for row, terms in equations.items() for name in terms if name in inputs]
    for pair in pairs:
        output, _, name = pair.partition("/")
        if pair not in entries and (output not in outputs or name not in inputs):
            near = nearest(pair, [*entries, *(f"{o}/{i}" for o in outputs for i in inputs)])
            listed = f"Outputs are {', '.join(outputs)}; inputs are {', '.join(inputs)}; entries are " + ", ".join(
                entries
            )
            raise CardError(
                f"'{pair}' is no pair output/input of these parts, which could have a delay of its own.",
                where=text,
                hint=f"{near} {listed}".strip(),
            )
        if pair in own:
            raise CardError(f"'{pair}' is named twice.", where=text)
        own[pair] = f"tau_{output}_{SHORT[name]}"
    shared = [
        name
        for name in inputs
        if any(f"{output}/{name}" not in own for output in outputs)
        and any(entry not in own for entry in entries if entry.endswith(f"/{name}"))
    ]
    return {name: f"tau_{SHORT[name]}" for name in shared} | own


def _kinematic(expression: str) -> str:
    """What is left of an entry when the rotor has taken the derivative out: the trim's speeds; "0" for nothing."""
    kept = [term for term in expression.split(" + ") if term.lstrip("-") in _TRIM_NAMES.values()]
    return " + ".join(kept) or "0"


def _behind_actuators(
    states: dict[str, str],
    equations: dict[str, dict[str, str]],
    left: dict[str, dict[str, str]],
    inputs: dict[str, str],
) -> None:
    """Put a lag between each input and everything that it moves."""
    for row, entries in equations.items():
        equations[row] = {f"{c}_servo" if c in inputs else c: text for c, text in entries.items()}
    for name in inputs:
        servo = f"{name}_servo"
        states[servo] = inputs[name]
        equations[servo] = {servo: "-1", name: "1"}
        left[servo] = {servo: SERVO[name]}


def _trust(names: Sequence[str]) -> str:
    holds = list(dict.fromkeys(PARTS[name].holds for name in names if PARTS[name].holds))
    text = "; ".join(holds) or "about hover"
    return f"{text[0].upper()}{text[1:]}. Remove what the responses do not determine (--reduce)."


def _parameters(model: dict[str, Any]) -> dict[str, Any]:
    """Every parameter that an expression uses, with its start value and where that comes from."""
    texts = [text for part in ("equations", "left") for entries in model[part].values() for text in entries.values()]
    texts += [*model["delays"].values(), *model.get("trim", {}).values()]
    if any("specific_force" in output for output in model["outputs"].values()) and "body" in model["name"].split("+"):
        texts.append("g")
    made: dict[str, Any] = {}
    used = dict.fromkeys(n for text in texts for n in sorted(Expression(text).names))
    for name in sorted(used, key=lambda n: n not in HELD):
        one = number(name)
        entry: dict[str, Any] = {"value": one.value, "unit": one.unit}
        entry |= {"fixed": True} if name in HELD else {}
        entry |= {"lower": one.lower} if one.lower is not None else {}
        entry |= {"upper": one.upper} if one.upper is not None else {}
        made[name] = entry | {"note": one.source}
    return made
