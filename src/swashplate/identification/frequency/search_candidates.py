"""Which composed structures are worth a try with the channels that were measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from swashplate.errors import IdentificationError
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.composition import PREFIX, nonsense
from swashplate.models.linear.state_space_file import structure
from swashplate.models.linear.structure_parts import INPUTS, PARTS

_CYCLIC, _MOVING = {"lateral", "longitudinal"}, {"u", "v", "ax", "ay"}
_TURNING = {"p", "q", "phi", "theta"}

GROUPS: Mapping[str, tuple[str, ...]] = {
    "rotor": ("bar", "hub", "gyroscopic", "forces"),
    "heave": ("inflow", "lead", "droop"),
    "yaw": ("torque", "gyro"),
    "actuators": ("actuators",),
    "quasi-steady": ("coupled",),
}
"""Parts that show in the same responses; of one group, one is added at a time."""

_ALIKE = ("inflow", "lead", "droop", "torque")
"""Parts of which one can take the place of another in part."""

WIDEST = "compose:body"
"""A composed structure with every channel that one can have."""


def parameter_names() -> set[str]:
    """Parameters that any composed structure can have."""
    wide = ("body+coupled+inflow+torque+droop+gyro+actuators", "body+flap+bar+forces+hub+gyroscopic+lead")
    return {name for text in wide for name in structure(PREFIX + text).parameters}


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
        seen = {state for part in axes for state in PARTS[part].states} | {"az"}
        moved = _CYCLIC | ({"collective"} if heave or yaw else set()) | ({"pedal"} if yaw else set())
        if outputs <= seen and inputs <= moved:  # compared on the same responses
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
    told = {ours: name for name in inputs for axis, ours in _LIKELY.items() if name.endswith(axis) and name != ours}
    return f"--rename {','.join(f'{ours}={name}' for ours, name in told.items()) or 'lateral=CHANNEL'}"


def additions(parts: Sequence[str], responses: FrequencyResponse, *, every: bool) -> list[list[str]]:
    """Parts that can be added, by group.

    Args:
        parts: that are there. responses: measured. every: whether many numbers are worth a try too ("coupled").
    """
    inputs, outputs = set(responses.inputs), set(responses.outputs)
    shown = {
        "rotor": bool(inputs & _CYCLIC),
        "heave": "collective" in inputs and bool(outputs & {"w", "az"}),
        "yaw": "r" in outputs and bool(inputs & {"pedal", "collective"}),
        "actuators": True,
        "quasi-steady": every,
    }
    needs = {"torque": {"collective"}, "gyro": {"pedal"}}
    groups = [
        [n for n in names if n not in parts and not nonsense([*parts, n]) and needs.get(n, set()) <= inputs]
        for group, names in GROUPS.items()
        if shown[group]
    ]
    return [group for group in groups if group]


def without(parts: Sequence[str]) -> dict[str, list[str]]:
    """What is left when a part is taken out, by that part; a coupled rotor becomes a decoupled one."""
    smaller: dict[str, list[str]] = {}
    for name in parts:
        if PARTS[name].core:
            continue
        kept = [p for p in parts if p != name]
        if name == "flap":
            kept.append("flap_decoupled")
        if not nonsense(kept):
            smaller[name] = kept
    return smaller


def exchanges(parts: Sequence[str], responses: FrequencyResponse) -> list[list[str]]:
    """Structures with one part exchanged for another that shows in the same responses (inflow, lead, droop, torque)."""
    exchanged = []
    for old in (p for p in parts if p in _ALIKE):
        kept = [p for p in parts if p != old]
        for group in additions(kept, responses, every=False):
            exchanged += [[*kept, new] for new in group if new in _ALIKE and new != old]
    return exchanged
