"""Whether a running autopilot is set up for a vehicle, would arm, and how fast it runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from swashplate.api.asking import name_of
from swashplate.api.link import mapping_of
from swashplate.links.ardupilot.parameters import as_written
from swashplate.links.ardupilot.parameters import parameters as for_ardupilot
from swashplate.links.mavlink.comparison import ComparedParameter, compared, rate_problems
from swashplate.links.mavlink.connection import Connection
from swashplate.links.mavlink.greeting import ARDUPILOT, AUTOPILOT_NAMES, PX4, greet, other_build
from swashplate.links.mavlink.health import Health, listen_to_health
from swashplate.links.mavlink.parameter_reading import ask_by_name, read_parameters
from swashplate.links.px4.parameters import parameters as for_px4
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.figures.of_results import plain_page
from swashplate.reporting.structure import Report
from swashplate.shown import Shown
from swashplate.simulation.trim import trim
from swashplate.text_table import text_table

if TYPE_CHECKING:
    from swashplate.api.verbs.link import CheckAutopilot

Firmware = Literal["ardupilot", "px4"]
ADDRESSES: Mapping[Firmware, str] = {"ardupilot": "tcp:127.0.0.1:5762", "px4": "udp:127.0.0.1:14540"}
"""Where a simulated autopilot speaks MAVLink and no ground station is: SERIAL1 of ArduPilot's SITL, PX4's port for
programs aboard."""
_AUTOPILOTS: Mapping[Firmware, int] = {"ardupilot": ARDUPILOT, "px4": PX4}
"""MAV_AUTOPILOT."""
_RATES = ("SCHED_LOOP_RATE", "INS_GYRO_RATE", "INS_GYRO_FILTER", "IMU_GYRO_RATEMAX", "IMU_INTEG_RATE")
"""Told where there are such parameters; no vehicle asks for a value."""

_STILL = 1e-3
"""Real-time factor below which nothing moves."""


@dataclass(frozen=True)
class AutopilotCheck(Shown):
    """A running autopilot beside the vehicle that it is to fly.

    Attributes:
        firmware: that answered. address: where.
        parameters: those that the vehicle needs, compared.
        rates: the firmware's own rates, as it has them.
        refusals: why it refuses to be armed, in its words.
        sick: sensors that it calls unhealthy.
        ready: whether its checks before arming passed; None where it did not say.
        armed: whether it is armed.
        real_time: simulated seconds a second, and their bound; None where too little was heard.
        problems: everything that is wrong, in words; empty where the check passes.
    """

    firmware: Firmware
    address: str
    parameters: tuple[ComparedParameter, ...]
    rates: Mapping[str, float]
    refusals: tuple[str, ...]
    sick: tuple[str, ...]
    ready: bool | None
    armed: bool
    real_time: tuple[float, float] | None
    problems: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether the parameters are right and the autopilot can be armed."""
        return not self.problems

    def to_document(self) -> dict[str, object]:
        """All of it as what becomes JSON."""
        return asdict(self) | {"passed": self.passed}

    def page(self, *, title: str | None = None) -> Report:
        """The page of `sp.report`, under a heading, its own where None."""
        verdict, *lines = repr(self).split("\n")
        told = (line.partition(": ") for line in lines if not line.startswith("problem: "))
        summary = {name.strip(): words.strip() for name, _, words in told}
        return plain_page(title or verdict, summary=summary, problems=self.problems)

    def __repr__(self) -> str:
        right = sum(p.verdict == "right" for p in self.parameters)
        who = AUTOPILOT_NAMES[_AUTOPILOTS[self.firmware]]
        lines = [f"{who} at {self.address}: {'pass' if self.passed else 'FAIL'}"]
        lines.append(f"parameters: {right} of {len(self.parameters)} as the vehicle needs them")
        rows = [(p.name, f"{p.expected:g}", "-" if p.found is None else f"{p.found:g}", p.verdict) for p in self._odd()]
        if rows:
            lines.append(text_table(("parameter", "expected", "found", "verdict"), rows, left=(0, 3)))
        lines += [f"{name}: {value:g}" for name, value in self.rates.items()]
        said = {True: "its checks pass", False: "refused", None: "not known"}[self.ready]
        lines.append(f"arming: {'it is armed' if self.armed else said}")
        lines += [f"  {text}" for text in self.refusals]
        if self.sick:
            lines.append(f"  not healthy: {', '.join(self.sick)}")
        lines.append(f"real-time factor: {_factor(self.real_time)}")
        return "\n".join([*lines, *(f"problem: {text}" for text in self.problems)])

    def _odd(self) -> list[ComparedParameter]:
        return [p for p in self.parameters if p.verdict != "right"]


def hear_autopilot(asked: CheckAutopilot) -> AutopilotCheck:
    """The check that was asked for."""
    vehicle, timeout = asked.flying(asked.vehicle), asked.timeout
    firmware: Any = asked.firmware
    expected = _expected(vehicle, firmware, name_of(asked.vehicle), asked.servos)
    packed = firmware == "px4"
    with Connection(asked.mavlink or ADDRESSES[firmware], timeout=timeout) as connection:
        kind = greet(connection, _AUTOPILOTS[firmware], timeout)
        reading = read_parameters(connection, packed=packed)
        ask_by_name(connection, reading, expected, packed=packed)
        health = listen_to_health(connection, duration=asked.listen)
    comparisons = compared(expected, reading)
    build = other_build(kind, vehicle.traits.servo_layout) if firmware == "ardupilot" else ""
    problems = [build] if build else [p.problem for p in comparisons if p.problem]
    if not reading.complete:
        told = f"{len(reading.missing)} of {reading.count} parameters never came, although they were asked for again"
        problems.append(
            f"{told}: is the connection too slow?" if reading.count else "the autopilot lists no parameters."
        )
    problems += [*rate_problems(reading.values), *_arming(health)]
    return AutopilotCheck(
        firmware,
        connection.address,
        comparisons,
        {key: reading.values[key] for key in _RATES if key in reading.values},
        tuple(health.refusals),
        health.sick,
        health.ready,
        health.armed,
        health.real_time_factor(),
        tuple(problems),
    )


def _expected(vehicle: Vehicle, firmware: Firmware, name: str | None, servos: str | Path | None) -> dict[str, float]:
    if firmware == "px4":
        return as_written(for_px4(mapping_of(vehicle, servos, name=name, suffix="_px4")))
    return as_written(for_ardupilot(mapping_of(vehicle, servos, name=name, suffix=""), vehicle, trim(vehicle)))


def _arming(health: Health) -> list[str]:
    reasons = []
    if health.restarted:
        reasons.append("the autopilot restarted during the check.")
    factor = health.real_time_factor()
    if factor is not None and factor[0] <= max(factor[1], _STILL):
        reasons.append("its simulated time stands still: is its physics (swash link) running?")
    if health.refusals and not health.armed:
        reasons.append(f"arming is refused: {'; '.join(health.refusals)}.")
    elif health.ready is False and not health.armed:
        why = (
            f"it calls unhealthy: {', '.join(health.sick)}"
            if health.sick
            else "it does not say why; wait and ask again"
        )
        reasons.append(f"arming is refused: {why}.")
    elif health.ready is None and not health.armed:
        reasons.append("whether it can be armed is not known: it did not tell the result of its checks (SYS_STATUS).")
    return reasons


def _factor(real_time: tuple[float, float] | None) -> str:
    if real_time is None:
        return "not known (its clock was heard for less than a second)"
    return f"{real_time[0]:.2f} ± {real_time[1]:.1g}"
