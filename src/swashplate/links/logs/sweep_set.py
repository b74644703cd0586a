"""Which sweeps are fitted together: of other inputs in the same log, and of further logs of the same vehicle.

A loop answers a sweep of one axis with the commands of all. A response to one input is wrong where another one moved
along, unless both have been swept somewhere: then all of them are estimated at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.sweeps import Sweep
from swashplate.links.logs.hold_out import part_of
from swashplate.links.logs.opened import Opened
from swashplate.links.logs.sweep_channels import Channels, channels_of

_ALIKE = 0.02
"""Sampling rates that differ by a larger share are not joined."""


class Swept(NamedTuple):
    """A sweep with its log, its part of the log [s], and its channels."""

    opened: Opened
    sweep: Sweep
    start: float
    stop: float
    chosen: Channels

    @property
    def part(self) -> Flight:
        """What is fitted of it."""
        return self.opened.ready.between(self.start, self.stop)


def together(opened: Opened, sweep: Sweep, chosen: Channels, others: Sequence[Opened]) -> list[Swept]:
    """The sweep that is asked for, and one of every other input: in its log, else in other logs of the vehicle.

    Sweeps of the same input in other logs are left for the verification.
    """
    sweeps = [Swept(opened, sweep, *part_of(opened.ready, sweep), chosen)]
    alike = [other for other in others if _same_vehicle(opened, other)]
    for log in (opened, *alike):
        for one in log.inspection.sweeps if log.inspection else ():
            taken = {swept.chosen.input for swept in sweeps} | {swept.chosen.output for swept in sweeps}
            try:
                channels = channels_of(log.ready, one)
            except FlightError:
                continue
            if channels.input not in taken and channels.output not in taken:
                sweeps.append(Swept(log, one, *part_of(log.ready, one), channels))
    names = {name for swept in sweeps for name in swept.chosen[:2]}
    complete = [swept for swept in sweeps if names <= set(swept.opened.ready.channels)]
    return complete if sweeps[0] in complete else sweeps[:1]


def _same_vehicle(one: Opened, other: Opened) -> bool:
    if other.flight is None or one.flight is None or other.flight.provenance.sha256 == one.flight.provenance.sha256:
        return False
    if other.flight.provenance.vehicle != one.flight.provenance.vehicle:
        return False
    rates = [float(np.median(np.diff(flight.time(flight.channels[0])))) for flight in (one.flight, other.flight)]
    return abs(rates[0] - rates[1]) <= _ALIKE * max(rates)
