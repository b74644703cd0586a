"""Links without sockets, for tests: a plant, its sensors, a session, and a sender with a clock of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from swashplate.compiled import can_compile
from swashplate.engine.equations import SURROUNDINGS
from swashplate.export.stepping_c import CompiledEngine
from swashplate.links.ardupilot.session import ArduPilotSession
from swashplate.links.estimating import Estimating
from swashplate.links.notices import Notices
from swashplate.links.plant import Plant, Surroundings
from swashplate.links.recorder import Recorder
from swashplate.links.sensing import Sensing
from swashplate.links.servos import servo_mapping
from swashplate.models.catalogue import vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend
from swashplate.physics.environment import Environment
from swashplate.simulation.discretisation import rk4_step
from swashplate.simulation.record import unflown
from swashplate.simulation.sensors import InertialUnit
from swashplate.simulation.standing import standing
from swashplate.simulation.stepping import MakeEngine, motion_row

QUICK: MakeEngine | None = CompiledEngine if can_compile() else None
"""What `swash link` steps with here."""


class PlainFloats:
    """What moves a vehicle without a compiler."""

    def __init__(self, moved: Vehicle, environment: Environment) -> None:
        self.moved, self.parameters, self.environment = moved, moved.values(), environment

    def place(self, row: np.ndarray) -> None:
        self.row = row

    def advance(self, inputs: Sequence[float], around: np.ndarray, step: float, steps: int) -> list[float]:
        air, xp = self.environment._replace(**dict(zip(SURROUNDINGS, around.tolist(), strict=True))), FloatBackend()

        def rates(x: np.ndarray, w: Sequence[float]) -> np.ndarray:
            return np.array(self.moved.rates(x.tolist(), w, self.parameters, air, xp))

        for _ in range(steps):
            self.row = rk4_step(rates, self.row, lambda _: inputs, step)
        slope = rates(self.row, inputs).tolist()
        return motion_row(self.row.tolist(), slope, float(air.gravity), xp)


@dataclass
class Bench:
    """A session and what it said; `send` is the loss-free line to it."""

    session: ArduPilotSession
    plant: Plant
    said: list[str]
    recorder: Recorder | None = None
    sender: tuple[str, int] = ("127.0.0.1", 50_001)
    now: float = 0.0
    sent: int = field(default=0)

    def send(self, data: bytes) -> bytes | None:
        self.now += 1e-3
        self.sent += 1
        return self.session.handle(data, self.sender, self.now)


def bench(
    name: str,
    *,
    environment: Environment | None = None,
    unit: InertialUnit | None = None,
    seed: int = 0,
    sag: float = 0.0,
    record: Path | None = None,
    record_rate: float = 200.0,
    engine: MakeEngine | None = None,
    estimating: Estimating | None = None,
) -> Bench:
    made = standing(vehicle(name))
    around = Surroundings(environment or Environment(), sag)
    said: list[str] = []
    recorder = None
    if record is not None:
        recorder = Recorder(record, like=unflown(made, details={"link": True, "rate": record_rate}), say=said.append)
    plant = Plant(
        made,
        servo_mapping(name, made),
        around,
        recorder=recorder,
        record_rate=record_rate,
        engine=engine,
        estimating=estimating,
    )
    return Bench(
        ArduPilotSession(plant, Sensing(plant, unit=unit, seed=seed), Notices(said.append)), plant, said, recorder
    )
