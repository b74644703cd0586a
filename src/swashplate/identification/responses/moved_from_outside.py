"""Whether an input was moved from outside, as `respond` knows it: by a sweep, by a recorded reference or by nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

OUTSIDE = ("sweep", "reference", "sticks", "maneuver")
"""Kinds of excitation that no loop makes; the others are "controller" and "unknown"."""
_FLY = "Fly a sweep of it, or name what moved it with --references."


def excitation_of(
    inputs: Sequence[str], *, references: Sequence[str], swept: Sequence[bool], answers: Sequence[str]
) -> dict[str, dict[str, str]]:
    """What moved each input: its kind, and why in words.

    Args:
        inputs, references: names. swept: whether a sweep was followed in each input; empty where none was.
        answers: what is known of inputs that are a controller's answer, in words.
    """
    told = {}
    for i, name in enumerate(inputs):
        answer = next((words for words in answers if f"'{name}'" in words), "")
        if references:
            told[name] = {"kind": "reference", "words": f"{', '.join(references)} moved '{name}'."}
        elif answer:
            told[name] = {"kind": "controller", "words": answer}
        elif any(swept[i : i + 1]):
            told[name] = {"kind": "sweep", "words": f"a sweep of '{name}' was found."}
        else:
            told[name] = {"kind": "unknown", "words": f"nothing tells that '{name}' was moved from outside. {_FLY}"}
    return told


def moved_inputs(excitation: Mapping[str, Any]) -> tuple[str, ...]:
    """The inputs that were moved from outside."""
    return tuple(name for name, told in excitation.items() if told["kind"] in OUTSIDE)
