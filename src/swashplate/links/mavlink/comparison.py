"""Parameters that a running autopilot has, beside those that a vehicle needs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from swashplate.links.mavlink.parameter_reading import ParameterReading

Verdict = Literal["right", "wrong", "yours", "absent", "not read"]
_YOURS = (
    "ATC_", "H_RSC_SETPOINT", "H_RSC_RAMP_TIME", "H_RSC_RUNUP_TIME", "RC8_OPTION", "RNGFND1_TYPE", "RPM1_TYPE",
    "CA_HELI_PITCH_C1", "CA_HELI_PITCH_C2", "CA_HELI_PITCH_C3", "COM_SPOOLUP_TIME", "COM_DISARM_PRFLT",
    "MPC_MANTHR_MIN",
)  # fmt: skip
"""Starts of names that a user tunes: another value is told, and is no fault."""
_DIGITS = 1e-5
"""Relative distance of two numbers that were written with six digits."""


@dataclass(frozen=True)
class ComparedParameter:
    """One parameter.

    Attributes:
        name: of it.
        expected: what the vehicle needs.
        found: what the autopilot has; None where it was not read.
        verdict: "right"; "wrong"; "yours" (another value of what one tunes); "absent" (the autopilot has no such
            parameter); "not read" (it never came).
    """

    name: str
    expected: float
    found: float | None
    verdict: Verdict

    @property
    def problem(self) -> str:
        """What is wrong, in words; empty where nothing is."""
        if self.verdict == "wrong":
            return f"{self.name} is {self.found:g}, expected {self.expected:g}."
        if self.verdict == "absent":
            return f"the autopilot has no parameter {self.name} (expected {self.expected:g})."
        return f"{self.name} was not read." if self.verdict == "not read" else ""


def compared(expected: Mapping[str, float], reading: ParameterReading) -> tuple[ComparedParameter, ...]:
    """Every expected parameter with its verdict."""
    return tuple(_compared(name, float(value), reading) for name, value in expected.items())


def _compared(name: str, expected: float, reading: ParameterReading) -> ComparedParameter:
    value = reading.values.get(name)
    verdict: Verdict
    if value is None:
        verdict = "absent" if reading.complete else "not read"
    elif math.isclose(value, expected, rel_tol=_DIGITS, abs_tol=1e-6):
        verdict = "right"
    else:
        verdict = "yours" if name.startswith(_YOURS) else "wrong"
    return ComparedParameter(name, expected, value, verdict)


def rate_problems(values: Mapping[str, float]) -> list[str]:
    """What is wrong about ArduPilot's rates: it must step its physics at least as often as its loops run."""
    steps, loop = values.get("SIM_RATE_HZ"), values.get("SCHED_LOOP_RATE")
    if steps is not None and loop is not None and 0.0 < steps < loop:
        return [f"SIM_RATE_HZ is {steps:g}, below the loop rate SCHED_LOOP_RATE of {loop:g}."]
    return []
