"""Linear models as python-control has them. It knows no delays in continuous time: they become Padé polynomials."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from swashplate.arrays import Array
from swashplate.errors import SwashError
from swashplate.extras import library

if TYPE_CHECKING:
    from control import StateSpace, TransferFunction

_HIGHEST = 12
"""Order of a Padé polynomial beyond which its coefficients lose their meaning in double precision."""


def state_space(
    matrices: tuple[Array, Array, Array, Array],
    *,
    states: Sequence[str],
    inputs: Sequence[str],
    outputs: Sequence[str],
    delays: Mapping[str, float],
    pade: int | None,
    name: str,
) -> StateSpace:
    """A `control.StateSpace` with named signals, its delays as Padé polynomials.

    Args:
        matrices: A, B, C, D.
        states, inputs, outputs: names.
        delays: [s] by input, or by "output/input".
        pade: order of the polynomials; 0 leaves the delays out, None does so too and warns where there are any.
        name: of the model, for the warning.

    Raises:
        SwashError: an order that is negative or too high.
    """
    control = library("control", what="to_control")
    undelayed = control.ss(*matrices, states=list(states), inputs=list(inputs), outputs=list(outputs))
    positive = {key: value for key, value in delays.items() if value > 0.0}
    if not asked(pade, positive, name=name):
        return undelayed
    of_pairs = {(o, i): positive.get(f"{o}/{i}", positive.get(i, 0.0)) for o in outputs for i in inputs}
    by_input = {i: {of_pairs[o, i] for o in outputs} for i in inputs}
    if all(len(distinct) == 1 for distinct in by_input.values()):
        before = control.append(*(_delay(distinct.pop(), pade) for distinct in by_input.values()))
        delayed = undelayed * before
    else:  # outputs answer one input after different times: each input has its own copy of the model
        columns = []
        for k, i in enumerate(inputs):
            after = control.append(*(_delay(of_pairs[o, i], pade) for o in outputs))
            columns.append(after * control.ss(undelayed.A, undelayed.B[:, [k]], undelayed.C, undelayed.D[:, [k]]))
        delayed = control.append(*columns)
        delayed = control.ss(delayed.A, delayed.B, _summed(delayed.C, len(outputs)), _summed(delayed.D, len(outputs)))
    return control.ss(delayed.A, delayed.B, delayed.C, delayed.D, inputs=list(inputs), outputs=list(outputs))


def joined(wide: StateSpace, shares: Array, *, inputs: Sequence[str]) -> StateSpace:
    """A `control.StateSpace` some of whose inputs are one, by which input drives which (n_wide, n_inputs)."""
    control = library("control", what="to_control")
    return control.ss(
        wide.A, wide.B @ shares, wide.C, wide.D @ shares,
        states=wide.state_labels, inputs=list(inputs), outputs=wide.output_labels,
    )  # fmt: skip


def transfer_function(
    numerator: Array, denominator: Array, *, delay: float, pade: int | None, name: str
) -> TransferFunction:
    """A `control.TransferFunction`, its delay [s] as a Padé polynomial; see `state_space` for `pade`."""
    control = library("control", what="to_control")
    undelayed = control.tf(list(numerator), list(denominator))
    delays = {name: delay} if delay > 0.0 else {}
    return undelayed * control.tf(*control.pade(delay, pade)) if asked(pade, delays, name=name) else undelayed


def asked(pade: int | None, delays: Mapping[str, float], *, name: str) -> bool:
    """Whether delays become polynomials; warns where they are left out without having been asked to be.

    Raises:
        SwashError: an order that is negative or too high.
    """
    if pade is not None and not 0 <= pade <= _HIGHEST:
        raise SwashError(f"is {pade}, expected 0 (no delays) to {_HIGHEST}.", channel="pade")
    if delays and pade is None:
        listed = ", ".join(f"{key} {1e3 * value:.3g} ms" for key, value in delays.items())
        warnings.warn(
            f"the delays of {name} are left out ({listed}): give to_control(pade=3) to have them as Padé polynomials, "
            "or pade=0 to leave them out knowingly.",
            stacklevel=4,
        )
    return bool(delays and pade)


def _delay(seconds: float, order: int | None) -> StateSpace:
    """A delay as a system of one input and one output."""
    control = library("control", what="to_control")
    return control.ss(control.tf(*control.pade(seconds, order))) if seconds > 0.0 else control.ss([], [], [], [[1.0]])


def _summed(rows: Array, outputs: int) -> Array:
    """Rows of several models' outputs, one model after the other, added up by output."""
    return rows.reshape(-1, outputs, rows.shape[1]).sum(axis=0)
