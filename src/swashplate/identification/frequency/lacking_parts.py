"""What a structure may lack: parts that it does not have and that stand behind the responses which it misses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from swashplate.identification.frequency.fitted_pairs import TWINS
from swashplate.models.linear.composition import PREFIX, nonsense, pairs_of, parts_of
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.structure_parts import INPUTS, PARTS

_HEAVE, _YAW = ("w", "az"), ("r",)
_TURNING, _FORCES = ("p", "q"), ("u", "v", "ax", "ay", "phi", "theta")
_CYCLIC = (("p", "lateral"), ("q", "longitudinal"))

BEHIND: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "flap": ((*_TURNING, *_FORCES), ()),
    "bar": (_TURNING, ("lateral", "longitudinal")),
    "inflow": (_HEAVE, ("collective",)),
    "torque": (_YAW, ("collective",)),
    "droop": ((*_HEAVE, *_YAW), ("collective",)),
    "gyro": (_YAW, ("pedal",)),
    "hub": (_TURNING, ("lateral", "longitudinal")),
    "forces": (_FORCES, ("lateral", "longitudinal")),
    "actuators": ((*_TURNING, *_YAW, *_HEAVE), ()),
    "coupled": (_FORCES + _HEAVE + _TURNING + _YAW, ()),
}
"""Outputs and inputs (none: any) of the responses that show a part first, the likeliest part first."""

_MOST = 3


def parts_in(model: StateSpaceModel) -> tuple[str, ...]:
    """The parts that a model has: those that it was composed of, otherwise those whose states it has."""
    composed = str(model.document.get("composed", ""))
    if composed:
        return parts_of(composed)
    states = set(model.states)
    parts = [name for name, part in PARTS.items() if part.states and set(part.states) <= states]
    if "flap" in parts:
        crossed = {"Ab", "Ba"} & set(model.parameters)
        parts.remove("flap_decoupled" if crossed else "flap")
    core = [name for name in parts if PARTS[name].core]
    if "body" in core:
        parts = [name for name in parts if name not in ("cyclic", "heave", "yaw")]
    by_letters = {"hub": {"La", "Mb"}, "forces": {"Xa", "Yb"}, "coupled": {"Xv", "Zu", "Yw"}}
    parts += [name for name, letters in by_letters.items() if letters <= set(model.parameters)]
    return tuple(name for name in PARTS if name in parts)


def candidates(parts: Sequence[str], missed: Sequence[tuple[str, str]]) -> dict[str, list[str]]:
    """Parts that may be lacking, each with the responses that speak for it; all the same ones are one.

    Args:
        parts: that are there.
        missed: output and input of the missed responses, the worst first.
    """
    lacking: dict[str, list[str]] = {}
    for name, (outputs, inputs) in BEHIND.items():
        present = {*parts, *(["flap"] if "flap_decoupled" in parts and name != "flap" else [])}
        if name in present:
            continue
        others = [p for p in parts if not (name == "flap" and p == "flap_decoupled")]
        if nonsense([*others, name]):
            continue
        own = [f"{o} / {i}" for o, i in missed if o in outputs and (not inputs or i in inputs)]
        if name == "flap" and "flap_decoupled" in parts:
            own = [f"{o} / {i}" for o, i in missed if o in _TURNING and (o, i) not in _CYCLIC]
        if own:
            lacking[name] = own
    return lacking


def lacking_words(model: StateSpaceModel, missed: Sequence[str]) -> str:
    """What this structure may lack, in words that begin with a space; empty where nothing is known.

    Args:
        model: the structure. missed: "output / input" of the responses that it misses, the worst first.
    """
    parts = parts_in(model)
    known = {*INPUTS, *TWINS}
    if not any(name in PARTS and PARTS[name].core for name in parts) or not known >= set(model.inputs):
        return ""
    pairs = [(o, i) for o, _, i in (name.partition(" / ") for name in missed)]
    lacking = candidates(parts, pairs)
    if not lacking:
        return " It has every part that these responses could speak for: look at the trim, gusts and the signals."
    best = sorted(lacking, key=lambda name: _rank(lacking[name], pairs))
    if "flap_decoupled" in parts and "flap" in lacking:
        best = ["flap", *(name for name in best if name != "flap")]
    named = ", ".join(f"'{name}' ({lacking[name][0]})" for name in best[:_MOST])
    text = f" The parts that may be lacking are {named}."
    if composed := str(model.document.get("composed", "")):
        first = best[0]
        kept = [p for p in parts if not (first == "flap" and p == "flap_decoupled")]
        whole = [*(p for p in PARTS if p in (*kept, first)), *pairs_of(composed)]
        text += f" Try {PREFIX}{'+'.join(whole)}, or --search."
    else:
        text += " Compose one with it (swash vehicle structures), or let --search find the parts."
    return text


def _rank(speaking: Sequence[str], missed: Sequence[tuple[str, str]]) -> int:
    """Place of the worst response that speaks for a part."""
    names = [f"{o} / {i}" for o, i in missed]
    return min(names.index(name) for name in speaking)
