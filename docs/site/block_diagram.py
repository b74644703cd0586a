"""The CoaX's block diagram (Fankhauser et al., Fig. 3), drawn from its equations as they run.

    python docs/site/block_diagram.py           writes docs/pictures/coax-block-diagram.svg
    python docs/site/block_diagram.py --print   prints blocks and arrows as text

The equations are evaluated once on numbers that remember where they come from, with every function of
`swashplate.physics` watched: what a function reads makes the arrows into its block, what its result reaches the arrows
out of it. States belong to the block that gives their rates, equation numbers come from docstrings. Only the places of
the boxes on the page are typed here; a block without a place, or with a wrong arrow, cannot go unnoticed.
"""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import wraps
from html import escape
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest import mock

from swashplate.atomic import write_text
from swashplate.models import coax
from swashplate.models.catalogue import vehicle
from swashplate.models.nesting import leaves, rebuild
from swashplate.physics import drive_train, fuselage, rigid_body, rotor, stabilizer_bar, swashplate
from swashplate.physics.environment import Environment

PICTURE = Path(__file__).resolve().parents[2] / "docs" / "pictures" / "coax-block-diagram.svg"
_COMPONENTS = (drive_train, stabilizer_bar, swashplate, rotor, fuselage, rigid_body)
_QUIET = ("air_density", "gravity")
"""Surroundings that scale everything: not drawn."""


class Signal:
    """A number that knows where it comes from."""

    def __init__(self, origins: Iterable[str] = ()) -> None:
        self.origins = frozenset(origins)

    def _with(self, other: object = None) -> Signal:
        return _joined(self, other)

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = _with
    __neg__ = _with


def _joined(*numbers: object) -> Signal:
    return Signal(frozenset().union(*(number.origins for number in numbers if isinstance(number, Signal))))


class _Operations:
    """A backend whose operations keep the origins."""

    sin = cos = tan = sqrt = atan2 = abs = where = minimum = maximum = staticmethod(_joined)


@dataclass
class Block:
    """The functions of one component for one rotor (or for none), with what they read and the states they drive."""

    component: str
    side: str
    functions: dict[str, str] = field(default_factory=dict)
    reads: set[str] = field(default_factory=set)
    states: list[str] = field(default_factory=list)

    @property
    def title(self) -> str:
        words = self.component.replace("_", " ")
        return f"{words}, {self.side}" if self.side else words


def equations_of(function: Callable[..., Any]) -> str:
    """Equation numbers that a function's docstring cites, as "eqs 9 to 11"."""
    cited = re.search(r"\beqs?\.? (\d+(?:(?:, | and | to )\d+)*)", inspect.getdoc(function) or "")
    return f"eq. {cited[1]}" if cited and cited[1].isdigit() else f"eqs {cited[1]}" if cited else ""


class Trace:
    """Blocks by title, and arrows (from, to) with the names of what flows."""

    def __init__(self) -> None:
        self._aircraft = vehicle("coax")
        self.blocks: dict[str, Block] = {}
        self._run()
        self._merge_tools()
        self.arrows = self._arrows()

    def _run(self) -> None:
        names = self._aircraft.state_names
        state = rebuild(self._aircraft.state, [Signal([f"state {name}"]) for name in names])
        inputs = coax.CoaxInputs(*(Signal([f"input {name}"]) for name in coax.CoaxInputs._fields))
        numbers = coax.CoaxParameters(*(Signal([f"parameter {name}"]) for name in coax.UNITS))
        around = Environment(*(Signal([] if n in _QUIET else [f"around {n}"]) for n in Environment._fields))
        with mock.patch.multiple(coax, **self._watched(coax, _names_of(coax))):
            for module in _COMPONENTS:
                for name, watched in self._watched(module, _names_of(module)).items():
                    patcher = mock.patch.object(module, name, watched)
                    patcher.start()
            try:
                rates = coax.derivatives(state, inputs, numbers, around, _Operations())
            finally:
                mock.patch.stopall()
        for name, rate in zip(names, leaves(rates), strict=True):
            owners = {origin.split()[1] for origin in rate.origins if origin.startswith("block")}
            (owner,) = owners  # exactly one block gives each rate
            self.blocks[owner.replace("~", " ")].states.append(name)

    def _watched(self, module: ModuleType, names: Iterable[str]) -> dict[str, Callable[..., Any]]:
        return {name: self._watch(getattr(module, name)) for name in names}

    def _watch(self, function: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(function)
        def watched(*values: Any, **named: Any) -> Any:
            given = [leaf for value in (*values, *named.values()) for leaf in leaves(value)]
            origins = frozenset().union(*(leaf.origins for leaf in given if isinstance(leaf, Signal)))
            sides = {o.rpartition("_")[2] for o in origins if o.startswith("parameter")} & {"upper", "lower"}
            # Parameters decide the side; what is given no parameter of a rotor goes by the states it reads.
            sides = sides or {o.rpartition("_")[2] for o in origins} & {"upper", "lower"}
            sides = sides or {o.rpartition(",~")[2].split()[0] for o in origins if ",~" in o}
            component = function.__module__.rpartition(".")[2]
            side = next(iter(sides)) if len(sides) == 1 and component not in ("fuselage", "rigid_body") else ""
            block = self._block(component, side)
            block.functions[function.__name__] = equations_of(function)
            mine = f"block {block.title.replace(' ', '~')}"
            block.reads |= {o for o in origins if not o.startswith("parameter") and not o.startswith(mine)}
            made = function(*values, **named)
            numbers = list(leaves(made))
            label = Signal([f"{mine} {function.__name__}"])
            return rebuild(made, [label] * len(numbers)) if hasattr(made, "_fields") else label

        return watched

    def _block(self, component: str, side: str) -> Block:
        block = Block(component, side)
        return self.blocks.setdefault(block.title, block)

    def _merge_tools(self) -> None:
        """What a component lends to another (the lower rotor's phase lag to the swashplate) is drawn where it is used:
        a block without states beside a sibling that has them."""
        for title, block in list(self.blocks.items()):
            siblings = [o for o in self.blocks.values() if o is not block and o.component == block.component]
            if block.states or not any(sibling.states for sibling in siblings):
                continue
            mine = f"block {title.replace(' ', '~')} "
            (reader,) = (other for other in self.blocks.values() if any(o.startswith(mine) for o in other.reads))
            reader.functions |= block.functions
            reader.reads = {o for o in reader.reads if not o.startswith(mine)} | block.reads
            del self.blocks[title]

    def _arrows(self) -> dict[tuple[str, str], list[str]]:
        owner = {name: title for title, block in self.blocks.items() for name in block.states}
        by_pair: dict[tuple[str, str], list[str]] = {}
        for title, block in self.blocks.items():
            for origin in sorted(block.reads):
                kind, name, *function = origin.split()
                source = {"state": owner.get(name, ""), "block": name.replace("~", " ")}.get(kind, name)
                flows = function[0] if kind == "block" else name
                if source != title:
                    by_pair.setdefault((source, title), []).append(flows)
        order = {name: i for i, name in enumerate(self._aircraft.state_names)}
        return {k: sorted(v, key=lambda n: (order.get(n, 99), n)) for k, v in by_pair.items()}


def _names_of(module: ModuleType) -> list[str]:
    """Functions of physics components that a module defines, or (the vehicle) imports by name."""
    components = {m.__name__ for m in _COMPONENTS}
    wanted = components if module is coax else {module.__name__}
    return [name for name, thing in vars(module).items() if inspect.isfunction(thing) and thing.__module__ in wanted]


def as_text(trace: Trace) -> str:
    """Blocks and arrows as lines of text."""
    lines = []
    for block in trace.blocks.values():
        inside = ", ".join(
            f"{name} ({equations})" if equations else name for name, equations in block.functions.items()
        )
        lines.append(f"[{block.title}] {inside}" + (f"; states {', '.join(block.states)}" if block.states else ""))
    lines += [f"{source} -> {target}: {', '.join(names)}" for (source, target), names in trace.arrows.items()]
    return "\n".join(lines)


# ---- the picture ---------------------------------------------------------------------------------------------------
_LINE, _PAD, _WIDTH, _HEIGHT = 16, 10, 1310, 750
_PLACES = {
    # title: left, top, width
    "drive train, upper": (170, 40, 240),
    "stabilizer bar, upper": (450, 150, 270),
    "rotor, upper": (870, 40, 200),
    "fuselage": (870, 335, 200),
    "swashplate, lower": (450, 490, 270),
    "drive train, lower": (170, 620, 240),
    "rotor, lower": (870, 535, 200),
    "rigid body": (1140, 325, 165),
}
_GIVEN = {
    # input or surrounding: left, height of its text
    "motor_upper": (20, 62),
    "voltage": (20, 340),
    "servo_roll": (300, 530),
    "servo_pitch": (300, 550),
    "motor_lower": (20, 690),
    "wind": (330, 410),
}
_COLORS = {"upper": "#e8f1fa", "lower": "#fdf1e3", "": "#f0f0f0"}
_FEEDBACK = "rigid body"


def _lines(trace: Trace, block: Block) -> list[tuple[str, str]]:
    """Lines of text in a box, as (words, style)."""
    lines = [(block.title, "title")]
    fed = trace.arrows.get((_FEEDBACK, block.title))
    if fed:
        lines += [(f"\u2190 {_short(fed)}", "fed")]
    lines += [
        (f"{name} {equations and f'({equations})'}".strip(), "function") for name, equations in block.functions.items()
    ]
    if block.states:
        lines += [(f"states {part}", "states") for part in _wrapped(block.states, 6)]
    return lines


def _short(names: list[str]) -> str:
    return f"{' '.join(names)} of the body"


def _wrapped(names: list[str], most: int) -> list[str]:
    return (
        [", ".join(names[i : i + most]) for i in range(0, len(names), most)]
        if len(names) > most
        else [", ".join(names)]
    )


def as_svg(trace: Trace) -> str:
    """The picture; the same blocks and arrows give the same text."""
    boxes = {}
    parts: list[str] = []
    for title, block in trace.blocks.items():
        left, top, width = _PLACES[title]
        lines = _lines(trace, block)
        height = _LINE * len(lines) + 2 * _PAD
        boxes[title] = (left, top, width, height)
        parts.append(
            f'<rect x="{left}" y="{top}" width="{width}" height="{height}" rx="4" fill="{_COLORS[block.side]}" '
            'stroke="#333"/>'
        )
        for i, (words, style) in enumerate(lines):
            y = top + _PAD + _LINE * i + 12
            parts.append(f'<text x="{left + _PAD}" y="{y}" class="{style}">{escape(words)}</text>')
    drawn: dict[tuple[str, str], list[str]] = {}
    for (source, target), names in trace.arrows.items():
        if source != _FEEDBACK:
            start = "wind" if source.startswith("wind") else source
            drawn.setdefault((start, target), []).extend(n for n in names if n not in drawn.get((start, target), []))
    for name in dict.fromkeys(source for source, _ in drawn if source not in boxes):
        left, height = _GIVEN[name]
        boxes[name] = (left, height - 14, 9 * len(name) + 4, 20)
        parts.append(f'<text x="{left}" y="{height}" class="input">{escape(name)}</text>')
    for (source, target), names in drawn.items():
        parts += _arrow(boxes[source], boxes[target], [] if source not in trace.blocks else names)
    style = (
        "text{font:12px sans-serif;fill:#111}.title{font-weight:bold;font-size:13px}.function{font-family:monospace;"
        "font-size:11px}.states{font-style:italic}.fed{fill:#8a1f11}.input{font-weight:bold}.flow{fill:#1f4e8a;"
        "font-size:11px}path{fill:none;stroke:#1f4e8a;stroke-width:1.3;marker-end:url(#tip)}"
    )
    tip = (
        '<marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<polygon points="0,0 8,4 0,8" fill="#1f4e8a"/></marker>'
    )
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {_HEIGHT}" width="{_WIDTH}" '
        f'height="{_HEIGHT}" role="img" aria-label="Block diagram of the CoaX">'
    )
    back = f'<rect width="{_WIDTH}" height="{_HEIGHT}" fill="white"/>'
    return "\n".join([head, f"<defs><style>{style}</style>{tip}</defs>", back, *parts, "</svg>", ""])


def _arrow(source: tuple[int, ...], target: tuple[int, ...], names: list[str]) -> list[str]:
    """A curve from the right edge of one box to the left edge of another, at heights where both have an edge."""
    x0, y0, x1, y1 = source[0] + source[2], source[1], target[0], target[1]
    low, high = max(y0, y1), min(y0 + source[3], y1 + target[3])
    if low + 8 < high:  # side by side: straight across
        start = end = (low + high) // 2 if source[3] > 30 else y0 + source[3] // 2
    else:
        upward = y1 < y0
        start = y0 + (source[3] // 3 if upward else 2 * source[3] // 3)
        end = y1 + (target[3] - 14 if upward else 14)
    bend = max(30, (x1 - x0) // 2)
    path = f'<path d="M{x0},{start} C{x0 + bend},{start} {x1 - bend},{end} {x1},{end}"/>'
    words = f'<text x="{x0 + 6}" y="{start - 5}" class="flow">{escape(", ".join(names))}</text>'
    fits = names and 5.8 * len(", ".join(names)) < x1 - x0 - 12
    return [path, words] if fits else [path]


def main(arguments: list[str]) -> None:
    trace = Trace()
    if "--print" in arguments:
        print(as_text(trace))
    else:
        print(write_text(PICTURE, as_svg(trace)).name)


if __name__ == "__main__":
    main(sys.argv[1:])
