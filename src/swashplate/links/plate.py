"""One swashplate behind an autopilot's outputs: from its servos' pulses to blade pitch."""

from __future__ import annotations

from collections.abc import Sequence
from operator import mul

import numpy as np

from swashplate.links import swashplates
from swashplate.links.mapping_table import MappingTable
from swashplate.links.servo import CENTRE, FLOATS, HALF
from swashplate.physics.backend import Backend, Scalar


class Plate:
    """A swashplate as its table in a mapping's file has it.

    Attributes:
        type: of the swashplate. servos: its outputs.
        angles: of its servos from the nose [deg]; empty where the file has none, or a phase.
        collective_pulse, collective_deg, cyclic_deg: as the file has them [us], [deg].
    """

    def __init__(self, swash: MappingTable, servos: MappingTable, *, where: str, channels: str = "channels") -> None:
        self.type = swash.text("type")
        self.servos = tuple(swash.servo(number, servos) for number in swash.numbers(channels))
        angles, phase = swash.numbers("angles", missing=()), swash.number("phase", missing=0.0)
        self.angles = tuple(angles) if phase == 0.0 else ()
        rows = swashplates.shares(self.type, angles=angles, phase=phase, matrix=swash.rows("matrix"), where=where)
        if len(rows) != len(self.servos):
            raise swash.error(channels, f"has {len(self.servos)} servos, the type has {len(rows)}.")
        self._inverse = swashplates.unmixed(rows).tolist()
        self.collective_pulse, self.collective_deg = swash.pair("collective_pulse"), swash.pair("collective_deg")
        pulses, pitches = (np.array(self.collective_pulse) - CENTRE) / HALF, np.radians(self.collective_deg)
        if pulses[0] == pulses[1]:
            raise swash.error("collective_pulse", "has two equal pulses.")
        self._collective = (*pulses.tolist(), *pitches.tolist())
        self.cyclic_deg = swash.pair("cyclic_deg")
        self._cyclic = np.radians(self.cyclic_deg).tolist()

    def pitches(self, pulses: Sequence[Scalar], xp: Backend = FLOATS) -> tuple[Scalar, Scalar, Scalar]:
        """Collective, longitudinal (forward) and lateral (right) cyclic pitch [rad] for pulses [us] by output."""
        throws = [s.throw(pulses[s.channel - 1], xp) for s in self.servos]
        collective, roll, pitch = (sum(map(mul, row, throws)) for row in self._inverse)
        first, last, least, most = self._collective
        side, ahead = self._cyclic
        theta0 = least + (collective - first) / (last - first) * (most - least)
        return theta0, -ahead * pitch, side * roll
