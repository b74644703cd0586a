"""Structures composed of parts: "compose:body+flap+inflow" as the document of a state-space model file.

A derivative among the parts ("compose:body+flap+Xv+Zb") adds that entry to its equation. A pair among the parts
("compose:body+flap+r/pedal") gives that response a delay of its own, a derivative and an input
("compose:body+flap+r_dot/pedal") that entry of G.

What the parts are is said in `structure_parts`. Quasi-steady body and first-order tip-path plane: Tischler and Remple
2012, ch. 15, and Mettler, Tischler and Kanade 1999; inflow: Pitt and Peters 1981, Chen and Hindson 1986.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Any

from swashplate.errors import CardError
from swashplate.models.linear.accelerometer import TRIM
from swashplate.models.linear.expressions import Expression
from swashplate.models.linear.structure_parts import (
    DERIVATIVES,
    HELD,
    INPUTS,
    PARTS,
    SERVO,
    SHORT,
    entry_of,
    number,
)
from swashplate.registry import nearest

PREFIX = "compose:"

_CORES = tuple(name for name, part in PARTS.items() if part.core)
_TRIM_NAMES = {"u": "U0", "v": "V0", "w": "W0", "phi": "phi0", "theta": "theta0"}
_ACCELEROMETERS = {"ax": ("x", "u"), "ay": ("y", "v"), "az": ("z", "w")}


def is_composed(name: object) -> bool:
    """Whether a name says what a structure is composed of."""
    return str(name).startswith(PREFIX)


@lru_cache(maxsize=1024)
def parts_of(text: str) -> tuple[str, ...]:
    """The parts that "compose:body+flap+Xv" names, as they are put together: derivatives last, pairs left out.

    Raises:
        CardError: an unknown part (with what it may stand for), or parts that make no sense together.
    """
    given = [part for part in _named(text) if "/" not in part]
    if not any(given):
        raise CardError("names no part.", where=text, hint=f"An example: {PREFIX}body+flap. {_listed()}")
    for name in given:
        if name not in PARTS and entry_of(name) is None:
            raise CardError(
                f"'{name}' is no part of a structure.", where=text, hint=f"{nearest(name, PARTS)} {_listed()}".strip()
            )
        if given.count(name) > 1:
            raise CardError(f"'{name}' is named twice.", where=text)
    reason = nonsense(given)
    if reason:
        raise CardError(reason, where=text, hint=f"See `swash vehicle structures`. {_listed()}")
    return in_order(given)


def in_order(parts: Iterable[str]) -> tuple[str, ...]:
    """Parts as they are put together: those of `PARTS` in its order, then derivatives by equation and column."""
    return tuple(sorted(set(parts), key=_RANK.__getitem__))


_RANK = {name: k for k, name in enumerate((*PARTS, *DERIVATIVES))}


def pairs_of(text: str) -> tuple[str, ...]:
    """The responses (output/input) or entries (state_dot/input) with a delay of their own that a name holds."""
    return tuple(part for part in _named(text) if "/" in part)


def _named(text: str) -> list[str]:
    return [part.strip() for part in text.removeprefix(PREFIX).split("+")]


def nonsense(parts: Iterable[str]) -> str:
    """Why these parts make no sense together; empty where they do.

    Whether a part has anything to add is looked up in what the others make, in this very combination.
    """
    given = in_order(parts)
    known = tuple(name for name in given if name in PARTS)
    entries = _entries(tuple(name for name in known if name != "actuators"))
    for name in given[len(known) :]:
        place = entry_of(name)
        assert place is not None, name
        if name in entries.get(place, ()) or not _has_place(place, known):
            return _superfluous(name, {place: (name,)}, entries)
    return _clash(known)


@lru_cache(maxsize=4096)
def _clash(parts: tuple[str, ...]) -> str:
    """Why parts of `PARTS` make no sense together; empty where they do."""
    if not any(PARTS[name].core for name in parts):
        return f"there is nothing that flies: it lacks one of {', '.join(_CORES)}."
    for name in parts:
        part = PARTS[name]
        for other, why in part.excludes.items():
            if other in parts:
                return f"'{name}' and '{other}' cannot stand together: {why}."
        if part.needs and not set(part.needs) & set(parts):
            return f"'{name}' needs {' or '.join(part.needs)}: {part.why}."
    entries = _entries(parts)
    for name in reversed(parts):
        others = _entries(tuple(part for part in parts if part != name))
        if others == entries:
            right = PARTS[name].equations
            entries_of_part = {(row, column): (text,) for row, terms in right.items() for column, text in terms.items()}
            return _superfluous(name, entries_of_part, others)
    return ""


def _superfluous(name: str, entries: Entries, others: Entries) -> str:
    """Why a part adds nothing to the entries that the others make."""
    there = [text for place, texts in entries.items() for text in texts if text in others.get(place, ())]
    if there:
        verb = "is" if len(there) == 1 else "are"
        return f"'{name}' adds nothing: {', '.join(dict.fromkeys(there))} {verb} there already."
    places = ", ".join(f"d{row}/dt by {column}" for row, column in entries)
    return f"'{name}' has no place: these parts have no {places}."


def _listed() -> str:
    return f"Parts are {', '.join(PARTS)}, and derivatives such as Xv, Lq or Zb."


Entries = Mapping[tuple[str, str], tuple[str, ...]]
"""The terms at each place (state, column) of the right sides."""


@lru_cache(maxsize=4096)
def _entries(parts: tuple[str, ...]) -> Entries:
    """The right sides of parts that are put together, in this order; what has no place is left out."""
    entries: dict[tuple[str, str], tuple[str, ...]] = {}
    for name in parts:
        place = entry_of(name)
        replaced = PARTS[name].replaces if place is None else (place,)
        for one in replaced:
            if one in entries:
                entries[one] = _kinematic(entries[one])
        added = PARTS[name].equations if place is None else {place[0]: {place[1]: name}}
        for row, terms in added.items():
            for column, text in terms.items():
                if _has_place((row, column), parts):
                    there = entries.get((row, column), ())
                    entries[row, column] = there if text in there else (*there, text)
    entries = {place: terms for place, terms in entries.items() if terms}
    return _behind_actuators(entries) if "actuators" in parts else entries


def _has_place(place: tuple[str, str], parts: tuple[str, ...]) -> bool:
    states = _states(parts)
    return place[0] in states and (place[1] in states or place[1] in INPUTS)


@lru_cache(maxsize=4096)
def _states(parts: tuple[str, ...]) -> dict[str, str]:
    return {state: unit for name in parts if name in PARTS for state, unit in PARTS[name].states.items()}


def _behind_actuators(entries: Entries) -> Entries:
    """The same with a lag between each input and everything that it moves."""
    behind = {(row, f"{c}_servo" if c in INPUTS else c): terms for (row, c), terms in entries.items()}
    for name in (name for name in INPUTS if any(c == name for _, c in entries)):
        behind |= {(f"{name}_servo", f"{name}_servo"): ("-1",), (f"{name}_servo", name): ("1",)}
    return behind


def document(text: str) -> dict[str, Any]:
    """The model file of "compose:..." as a document.

    Args:
        text: parts; an output and input among them ("r/pedal") has a delay of its own in that response, a derivative
            and input ("r_dot/pedal") in that equation.

    Raises:
        CardError: an unknown part, parts that make no sense together, a pair that they do not have.
    """
    names, pairs = parts_of(text), pairs_of(text)
    parts = [PARTS[name] for name in names if name in PARTS]
    entries = _entries(names)
    inputs = {name: unit for name, unit in INPUTS.items() if any(column == name for _, column in entries)}
    servos = {f"{name}_servo": unit for name, unit in inputs.items()} if "actuators" in names else {}
    states = _states(names) | servos
    equations: dict[str, dict[str, str]] = {state: {} for state in states}
    for (row, column), terms in entries.items():
        equations[row][column] = " + ".join(terms)
    left = {row: dict(terms) for part in parts for row, terms in part.left.items()}
    left |= {servo: {servo: SERVO[servo.removesuffix("_servo")]} for servo in servos}
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
    of_pairs: dict[str, str] = {}
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
        if pair in of_pairs:
            raise CardError(f"'{pair}' is named twice.", where=text)
        of_pairs[pair] = f"tau_{output}_{SHORT[name]}"
    shared = [
        name
        for name in inputs
        if any(f"{output}/{name}" not in of_pairs for output in outputs)
        and any(entry not in of_pairs for entry in entries if entry.endswith(f"/{name}"))
    ]
    return {name: f"tau_{SHORT[name]}" for name in shared} | of_pairs


def _kinematic(terms: tuple[str, ...]) -> tuple[str, ...]:
    """What is left of an entry when another part stands for its derivative: the trim's speeds."""
    return tuple(term for term in terms if term.lstrip("-") in _TRIM_NAMES.values())


def _trust(names: Sequence[str]) -> str:
    holds = list(dict.fromkeys(PARTS[name].holds for name in names if name in PARTS and PARTS[name].holds))
    text = "; ".join(holds) or "about hover"
    return f"{text[0].upper()}{text[1:]}. Remove what the responses do not determine (--settings reduce=true)."


def _parameters(model: dict[str, Any]) -> dict[str, Any]:
    """Every parameter that an expression uses, with its start value and where that comes from."""
    texts = [text for part in ("equations", "left") for entries in model[part].values() for text in entries.values()]
    texts += [*model["delays"].values(), *model.get("trim", {}).values()]
    if any("specific_force" in output for output in model["outputs"].values()) and "body" in model["name"].split("+"):
        texts.append("g")
    parameters: dict[str, Any] = {}
    used = dict.fromkeys(n for text in texts for n in sorted(Expression(text).names))
    for name in sorted(used, key=lambda n: n not in HELD):
        one = number(name)
        entry: dict[str, Any] = {"value": one.value, "unit": one.unit}
        entry |= {"fixed": True} if name in HELD else {}
        entry |= {"lower": one.lower} if one.lower is not None else {}
        entry |= {"upper": one.upper} if one.upper is not None else {}
        parameters[name] = entry | {"note": one.source}
    return parameters
