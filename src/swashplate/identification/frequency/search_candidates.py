"""Which composed structures are worth a try with the channels that were measured."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from swashplate.errors import IdentificationError
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.composition import PREFIX, in_order, nonsense
from swashplate.models.linear.state_space_file import structure
from swashplate.models.linear.structure_parts import DERIVATIVES, INPUTS, PARTS, derivative_of

_CYCLIC, _MOVING = {"lateral", "longitudinal"}, {"u", "v", "ax", "ay"}
_TURNING = {"p", "q", "phi", "theta"}

_ALIKE = ("inflow", "lead", "droop", "governor", "torque")
"""Parts of which one can take the place of another in part."""

_PAIRS = ("forces", "hub", "gyroscopic")
"""Parts that are nothing but derivatives."""

_ROWS = {"phi": "p", "theta": "q", "ax": "u", "ay": "v", "az": "w"}
"""Which equation makes an output that is none of its states."""

WIDEST = "compose:body"
"""A composed structure with every channel that one can have."""


def parameter_names() -> set[str]:
    """Parameters that any composed structure can have."""
    wide = ("body+coupled+inflow+torque+governor+gyro+actuators", "body+flap+bar+forces+hub+gyroscopic+lead")
    return {name for text in wide for name in structure(PREFIX + text).parameters} | set(DERIVATIVES)


def cores(responses: FrequencyResponse) -> list[tuple[str, ...]]:
    """Cores that the channels allow, with and without a rotor.

    Raises:
        IdentificationError: where the inputs or outputs are none of a composed structure's.
    """
    inputs, outputs = set(responses.inputs), set(responses.outputs)
    cyclic = bool(inputs & _CYCLIC and outputs & (_TURNING | _MOVING))
    heave = ("heave",) if "collective" in inputs and outputs & {"w", "az"} else ()
    yaw = ("yaw",) if inputs & {"pedal", "collective"} and "r" in outputs else ()
    candidates: list[tuple[str, ...]] = []
    if cyclic:
        candidates.append(("body",))
        axes = ("cyclic", *heave, *yaw)
        measured = {state for part in axes for state in PARTS[part].states} | {"az"}
        driven = _CYCLIC | ({"collective"} if heave or yaw else set()) | ({"pedal"} if yaw else set())
        if outputs <= measured and inputs <= driven:  # compared on the same responses
            candidates.append(axes)
    elif heave or yaw:
        candidates.append((*heave, *yaw))
    if not candidates:
        raise IdentificationError(
            f"no composed structure has these responses: inputs {', '.join(responses.inputs)}, outputs "
            f"{', '.join(responses.outputs)}; it has inputs {', '.join(INPUTS)} and rates, speeds, angles, ax, ay, az.",
            hint=f"Name the channels so ({_renaming(responses.inputs)}), or name the structures to compare.",
        )
    rotors: tuple[tuple[str, ...], ...] = ((), ("flap_decoupled",), ("flap",)) if cyclic else ((),)
    return [(*core, *rotor) for core in candidates for rotor in rotors]


_LIKELY = {"roll": "lateral", "pitch": "longitudinal", "yaw": "pedal", "collective": "collective"}


def _renaming(inputs: Sequence[str]) -> str:
    """`--rename` for channels whose names tell their axis, such as `mixer_roll`; otherwise its form."""
    renamed = {ours: name for name in inputs for axis, ours in _LIKELY.items() if name.endswith(axis) and name != ours}
    return f"--rename {','.join(f'{ours}={name}' for ours, name in renamed.items()) or 'lateral=CHANNEL'}"


def offered(responses: FrequencyResponse) -> tuple[str, ...]:
    """Parts with states of their own that the channels can show, and whose worth slopes can foresee.

    `inflow` is not among them, which `lead` stands for at first (`preferred`), nor are actuators, whose lag is at first
    a delay like any other.
    """
    inputs, outputs = set(responses.inputs), set(responses.outputs)
    heave = "collective" in inputs and bool(outputs & {"w", "az"})
    shown = {
        "bar": bool(inputs & _CYCLIC),
        "lead": heave,
        "droop": heave,
        "governor": heave,
        "torque": "collective" in inputs and "r" in outputs,
        "gyro": "pedal" in inputs and "r" in outputs,
    }
    return tuple(name for name, visible in shown.items() if visible)


def preferred(parts: Iterable[str]) -> list[str]:
    """The same with an inflow of physical numbers for a lead-lag that may stand for one."""
    return ["inflow" if name == "lead" else name for name in parts]


def named(parts: Iterable[str]) -> list[str]:
    """The same with derivatives that are a part together by that part's name."""
    given = set(parts)
    for name in _PAIRS:
        texts = {text for terms in PARTS[name].equations.values() for text in terms.values()}
        if texts <= given:
            given = (given - texts) | {name}
    return list(in_order(given))


def joining(parts: Sequence[str], silent: Iterable[tuple[str, str]]) -> list[str]:
    """Derivatives that make a structure answer where it is silent: of the rotor's tilt by cyclic, of others at once.

    Args:
        parts: that are there. silent: output and input of the responses that are zero.
    """
    flaps = any("a" in PARTS[name].states for name in parts if name in PARTS)
    tilt = {"longitudinal": "a", "lateral": "b"} if flaps else {}
    derivatives = (derivative_of(_ROWS.get(output, output), tilt.get(name, name)) for output, name in silent)
    return list(dict.fromkeys(derivatives))


def contains(parts: Sequence[str], others: Sequence[str]) -> bool:
    """Whether a structure of some parts holds one of others, which it answers as with some of its numbers."""
    wide = {*parts, *(["flap_decoupled"] if "flap" in parts else [])}
    wide |= {
        text for name in parts if name in _PAIRS for terms in PARTS[name].equations.values() for text in terms.values()
    }
    return set(parts) != set(others) and set(others) <= wide


def without(parts: Sequence[str]) -> dict[str, list[str]]:
    """What is left when a part is taken out, by that part; a coupled rotor becomes a decoupled one.

    Derivatives of their own are not taken out here.
    """
    smaller: dict[str, list[str]] = {}
    for name in parts:
        if name not in PARTS or PARTS[name].core:
            continue
        kept = [p for p in parts if p != name]
        if name == "flap":
            kept.append("flap_decoupled")
        if not nonsense(kept):
            smaller[name] = kept
    return smaller


def exchanges(parts: Sequence[str], responses: FrequencyResponse) -> list[list[str]]:
    """Structures that slopes do not foresee: one part for another that shows in the same responses (inflow, engine), a
    coupled rotor for a decoupled one, actuators."""
    ours = {*offered(responses), *(["inflow"] if "lead" in offered(responses) else [])}
    exchanged = [
        [p for p in parts if p != old] + [new] for old in parts for new in _ALIKE if old in _ALIKE and new in ours
    ]
    exchanged += [["flap" if p == "flap_decoupled" else p for p in parts], [*parts, "actuators"]]
    return [one for one in exchanged if len(set(one)) == len(one) and set(one) != set(parts) and not nonsense(one)]


def ranks(parts: Iterable[str]) -> list[int]:
    """Places of the parts in the order in which they are preferred."""
    return [tuple(PARTS).index(name) if name in PARTS else len(PARTS) for name in parts]
