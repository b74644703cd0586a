"""Responses under a model's names: what was asked for, ArduPilot's unfiltered twins, and hints where names differ."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from swashplate.errors import IdentificationError
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.registry import nearest

TWIN = "_sid"
"""What ArduPilot's system identification logs before the gyro's filter ends in: `r_sid` is the same rate as `r`."""


def under_names_of(
    model: StateSpaceModel, responses: FrequencyResponse, names: Mapping[str, str] | None = None
) -> tuple[FrequencyResponse, tuple[str, ...]]:
    """The responses with their channels called as the model calls them, and what was done, in words.

    Args:
        model: whose names count.
        responses: measured.
        names: the responses' channel by the model's name; others than theirs are the business of flights.

    Raises:
        IdentificationError: two channels would have one name.
    """
    given = {n: c for n, c in (names or {}).items() if n != c and c in (*responses.outputs, *responses.inputs)}
    taken = [name for name in given if name in (*responses.outputs, *responses.inputs)]
    if taken:
        raise IdentificationError(
            f"the responses have a channel of that name beside '{given[taken[0]]}'.",
            channel=taken[0],
            hint="Give --rename for a name that the responses do not have.",
        )
    notes, twins = [], {}
    for name in model.outputs:
        other = name.removesuffix(TWIN) if name.endswith(TWIN) else name + TWIN
        if name in (*responses.outputs, *given) or other not in responses.outputs or other in given.values():
            continue
        if other not in model.outputs:
            twins[name] = other
            notes.append(f"the responses' '{other}' is taken as the model's '{name}'.")
    changed = {source: name for name, source in (given | twins).items()}
    known = dict(responses.settings.get("channels", {}))
    channels = known | {name: known.get(source, source) for source, name in changed.items()}
    called = replace(
        responses,
        outputs=tuple(changed.get(name, name) for name in responses.outputs),
        inputs=tuple(changed.get(name, name) for name in responses.inputs),
        settings={**responses.settings, **({"channels": channels} if changed else {})},
    )
    notes += [
        f"the responses' '{name}' is not fitted: the model has no such output. {hint}"
        for name in called.outputs
        if name not in model.outputs and (hint := _hint(name, model, called))
    ]
    return called, tuple(notes)


def _hint(name: str, model: StateSpaceModel, responses: FrequencyResponse) -> str:
    free = [o for o in model.outputs if o not in responses.outputs]
    stem = name.split("_")[0]
    if stem in free:
        return f"If it is '{stem}', say --rename {stem}={name}."
    return nearest(name, free)
