"""What the flights behind a response tell besides their signals: gains, other commands, slow channels, means."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from swashplate.flights.channel_names import STICK
from swashplate.flights.flight import Flight
from swashplate.flights.schema import QUATERNION, channel

INJECTED = ("sweep", "sid", "reference", "excitation")
"""Names of signals that a program adds to a command: they are part of an input, not another one."""

_RATE_GAINS = re.compile(
    r"ATC_RAT_(RLL|PIT|YAW)_(P|I|D|FF|FLT[TED])|INS_GYRO_FILTER"
    r"|(roll|pitch|yaw)_([pidf]_gain|(gyro|d)_cutoff)|yaw_stop_gain_[01]"
    r"|[pid]_(roll|pitch|yaw)|dterm_lpf|yaw_lowpass_hz"
)


def autopilot_facts(flights: Sequence[Flight]) -> dict[str, Any]:
    """What suggested gains start from: the autopilot's rate gains and filters where all logs agree, its firmware."""
    said = [flight.provenance for flight in flights]
    firmware = ", ".join(dict.fromkeys(one.autopilot for one in said if one.autopilot))
    names = (n for n in said[0].parameters if _RATE_GAINS.fullmatch(n))
    values = {n: {one.parameter(n, at=f.stop) for one, f in zip(said, flights, strict=True)} for n in names}
    same = {n: float(v) for n, one in sorted(values.items()) if len(one) == 1 and (v := one.pop()) is not None}
    return ({"autopilot": same} if same else {}) | ({"firmware": firmware} if firmware else {})


def bystanders_of(flights: Sequence[Flight], named: Sequence[str]) -> tuple[str, ...]:
    """Other commands on the same time base in all flights, which may have moved with the first of the named inputs.

    A command has the unit "1", or none where that input has none (a table without units). The terms of a controller
    (`pid_p_roll`) are no commands: their sum is in the command. Nor are sticks beside what a controller makes of them.
    """

    def commands(flight: Flight) -> set[str]:
        home = flight.stream_of(named[0])
        units = {"1", str(flight[named[0]].attrs.get("units", ""))} & {"1", ""}
        data = flight.streams[home]
        return {
            str(name)
            for name, values in data.data_vars.items()
            if values.attrs.get("units", "") in units
            and np.all(np.isfinite(values.values))
            and np.ptp(values.values) > 0.0
        }

    shared = set.intersection(*(commands(flight) for flight in flights))
    none = (*INJECTED, "pid_", *(() if named[0].startswith(STICK) else STICK))
    return tuple(sorted(name for name in shared - set(named) - set(QUATERNION) if not name.startswith(none)))


def means(flights: Sequence[Flight], names: Sequence[str]) -> dict[str, float]:
    """What each channel is on average: where the flights were trimmed."""
    return {name: float(np.mean(np.concatenate([flight.values(name) for flight in flights]))) for name in names}


def unit_of(flight: Flight, name: str) -> str:
    """A channel's unit as its flight says it, otherwise the schema's."""
    return str(flight[name].attrs.get("units", "")) or channel(name).unit
