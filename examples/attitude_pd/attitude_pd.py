"""A controller of your own: attitude and height by proportional and derivative gains, for the ducted fan."""

from dataclasses import dataclass

import numpy as np

from swashplate.control.kinds import ControllerKind
from swashplate.errors import ControllerError
from swashplate.simulation.controller import StepController

STATES = {"z": 2, "w": 5, "phi": 6, "theta": 7, "psi": 8, "p": 9, "q": 10, "r": 11}  # places in a rigid body's row
GAINS = ("hover", "straight", "height", "sink", "lean", "turn", "rate")


def step(memory, measured, reference, gains, xp):
    """One step: memory after it, and the commands (fan, roll, pitch, yaw)."""
    s = {name: measured[place] for name, place in STATES.items()}
    hover, straight, height, sink, lean, turn, rate = gains
    off = xp.arctan2(xp.sin(s["psi"] - reference[3]), xp.cos(s["psi"] - reference[3]))
    fan = hover + height * (s["z"] - reference[2]) + sink * s["w"]
    roll, pitch = -lean * s["phi"] - rate * s["p"], -lean * s["theta"] - rate * s["q"]
    return memory, xp.stack([fan, roll, pitch, straight - turn * off - rate * s["r"]])


@dataclass(frozen=True)
class AttitudePD(StepController):
    """What `sp.simulate_closed_loop` flies: a rate [Hz], a memory, gains and a step; `type` says its kind."""

    gains: np.ndarray
    rate: float = 50.0
    type: str = "attitude-pd"

    memory = np.zeros(1)
    step = staticmethod(step)


class AttitudePDKind(ControllerKind):
    """What can be asked of it beside its step: here only its file. The rest has defaults."""

    def to_document(self, controller):
        numbers = dict(zip(GAINS, map(float, controller.gains), strict=True))
        return {"kind": "controller", "type": controller.type, "rate": controller.rate, "gains": numbers}

    def from_document(self, document, path):
        numbers = document.get("gains", {})
        wrong = [name for name in GAINS if not isinstance(numbers.get(name), float)]
        if wrong:
            raise ControllerError("is no number.", where=path, channel=f"gains.{wrong[0]}")
        return AttitudePD(np.array([numbers[name] for name in GAINS]), float(document["rate"]))


KIND = AttitudePDKind()
