"""Which other inputs of a log moved what a model does not explain: asked before gusts are blamed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.excitation import excitations, of_inputs
from swashplate.flights.feedback import share_of
from swashplate.flights.flight import Flight
from swashplate.identification.core.record_facts import bystanders_of

MUCH = 0.3
"""Share of what a model leaves from which an input that it does not have is named."""


def other_inputs(
    flights: Sequence[Flight], inputs: Sequence[str], errors: Mapping[str, Sequence[tuple[Array, Array]]]
) -> dict[str, str]:
    """By output, the inputs to add to a model, in words; outputs that no other input moved are left out.

    An input that a controller moved is none: it answers the gusts that moved the output, too.

    Args:
        flights: at one rate, with all that was logged on the inputs' time base.
        inputs: of the model.
        errors: of the model by output, each as stamps [s] and values of stretches, in the flights' order.
    """
    others = bystanders_of(flights, (*inputs, *errors))
    excitation = of_inputs(excitations(flights, others, outputs=tuple(errors))) if others else {}
    explanations: dict[str, str] = {}
    for output, stretches in errors.items():
        movers = []
        for name in (n for n in others if excitation[n].outside):
            left = total = 0.0
            for flight, (time, error) in zip(flights, stretches, strict=True):
                command = np.interp(time, flight.time(name), flight.values(name))
                share = share_of(error, command[:, None], float(time[1] - time[0]))
                total += float(np.sum(error**2))
                left += float(np.sum(error**2)) * (1.0 - max(np.nan_to_num(share), 0.0))
            if total > 0.0 and 1.0 - left / total >= MUCH:
                movers.append((1.0 - left / total, name))
        if movers:
            names = ", ".join(f"'{name}' ({100.0 * share:.0f} %)" for share, name in sorted(movers, reverse=True))
            explanations[output] = (
                f"of what the model leaves of {output}, other inputs explain much: {names}. Add them to it."
            )
    return explanations
