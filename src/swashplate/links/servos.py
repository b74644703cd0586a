"""From an autopilot's outputs to a vehicle's inputs, as a small TOML says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import resources
from operator import mul
from pathlib import Path

import numpy as np

from swashplate import documents
from swashplate.errors import LinkError
from swashplate.files import is_file
from swashplate.links import swashplates
from swashplate.links.mapping_table import MappingTable
from swashplate.links.servo import CENTRE, HALF
from swashplate.models.vehicle import Vehicle


class HelicopterMapping:
    """Swashplate, tail and rotor speed control of a conventional helicopter.

    The throttle follows its output no faster than `spool` allows, as an engine that is started does: an autopilot only
    ramps its output, and a governor that gets the whole engine at once would turn the helicopter on its skids.

    Attributes:
        channels: outputs that it uses, from 1.
        shares: those of them that go from nothing to all (motors, throttles) instead of both ways.
        type: of the swashplate. swash, tail, throttle: its outputs.
        angles: of its servos from the nose [deg]; empty where the file has none, or a phase.
        collective_pulse, collective_deg, cyclic_deg, tail_deg, full, spool: as the file has them [us], [deg], [1], [s].
    """

    def __init__(self, table: MappingTable, vehicle: Vehicle) -> None:
        swash, tail, throttle = (table.part(name) for name in ("swashplate", "tail", "throttle"))
        servos = table.part("servos", missing={})
        numbers = swash.numbers("channels")
        self.type = swash.text("type")
        self.swash = tuple(swash.servo(number, servos) for number in numbers)
        angles, phase = swash.numbers("angles", missing=()), swash.number("phase", missing=0.0)
        self.angles = tuple(angles) if phase == 0.0 else ()
        rows = swashplates.shares(
            self.type,
            angles=angles,
            phase=phase,
            matrix=swash.rows("matrix"),
            where=table.where,
        )
        if len(rows) != len(self.swash):
            raise table.error("swashplate.channels", f"has {len(self.swash)} servos, the type has {len(rows)}.")
        self._inverse = swashplates.unmixed(rows).tolist()
        self.collective_pulse, self.collective_deg = swash.pair("collective_pulse"), swash.pair("collective_deg")
        pulses, pitches = (np.array(self.collective_pulse) - CENTRE) / HALF, np.radians(self.collective_deg)
        if pulses[0] == pulses[1]:
            raise swash.error("collective_pulse", "has two equal pulses.")
        self._collective = (*pulses.tolist(), *pitches.tolist())
        self.cyclic_deg = swash.pair("cyclic_deg")
        self._cyclic = np.radians(self.cyclic_deg).tolist()
        self.tail = tail.servo(tail.number("channel"), servos)
        self.tail_deg = tail.pair("deg")
        self._tail_pitch = np.radians(self.tail_deg).tolist()
        self.throttle = throttle.servo(throttle.number("channel"), servos)
        self.full = throttle.number("full", missing=1.0)
        self.spool = throttle.number("spool_time", missing=8.0)
        if not (self.full > 0.0 and self.spool > 0.0):
            raise table.error("throttle", "expected full and spool_time above zero.")
        table.done()
        self.channels = tuple(s.channel for s in (*self.swash, self.tail, self.throttle))
        self.shares = (self.throttle.channel,)
        self.restart()

    def restart(self) -> None:
        """Engine off."""
        self._running = 0.0

    def inputs(self, pulses: Sequence[float], duration: float) -> list[float]:
        """theta0, B1, A1, theta0T [rad] and throttle for pulses [us] by output, held for `duration` [s]."""
        throws = [s.throw(pulses[s.channel - 1]) for s in self.swash]
        collective, roll, pitch = (sum(map(mul, row, throws)) for row in self._inverse)
        first, last, least, most = self._collective
        theta0 = least + (collective - first) / (last - first) * (most - least)
        side, ahead = self._cyclic
        low, high = self._tail_pitch
        tail = 0.5 * (low + high) + 0.5 * (high - low) * self.tail.travel(pulses[self.tail.channel - 1])
        asked = min(1.0, self.throttle.share(pulses[self.throttle.channel - 1]) / self.full)
        self._running = min(asked, self._running + duration / self.spool)
        return [theta0, -ahead * pitch, side * roll, tail, self._running]


class CoaxialMapping:
    """Two motors and two servos of a coaxial helicopter. Attributes as `HelicopterMapping`, and its outputs."""

    def __init__(self, table: MappingTable, vehicle: Vehicle) -> None:
        motors, cyclic = table.part("motors"), table.part("cyclic")
        servos = table.part("servos", missing={})
        self.motors = tuple(motors.servo(motors.number(name), servos) for name in ("lower", "upper"))
        self.servos = tuple(cyclic.servo(cyclic.number(name), servos) for name in ("roll", "pitch"))
        self.travel = (cyclic.number("roll_travel", missing=1.0), cyclic.number("pitch_travel", missing=1.0))
        table.done()
        numbers = vehicle.card.values()
        stopped = [-numbers[f"o_drive_{name}"] / numbers[f"k_drive_{name}"] for name in ("lower", "upper")]
        self.stopped = tuple(max(0.0, command) for command in stopped)
        self.channels = tuple(s.channel for s in (*self.motors, *self.servos))
        self.shares = tuple(s.channel for s in self.motors)

    def restart(self) -> None:
        """Nothing is carried over."""

    def inputs(self, pulses: Sequence[float], duration: float) -> list[float]:
        """motor_lower, motor_upper (0 to 1) and servo_roll, servo_pitch (-1 to 1) for pulses [us] by output.

        An output at its low end holds the rotor still: less would ask the drive train of the card for a negative speed.
        """
        motors = [
            max(stopped, s.share(pulses[s.channel - 1])) for s, stopped in zip(self.motors, self.stopped, strict=True)
        ]
        servos = [k * s.travel(pulses[s.channel - 1]) for s, k in zip(self.servos, self.travel, strict=True)]
        # Autopilots count nose up as positive pitch, the CoaX nose down.
        return [*motors, servos[0], -servos[1]]


ServoMapping = HelicopterMapping | CoaxialMapping
_LAYOUTS: Mapping[str, type[HelicopterMapping] | type[CoaxialMapping]] = {
    "swashplate": HelicopterMapping,
    "two motors": CoaxialMapping,
}
"""By `Traits.servo_layout`."""


def packaged() -> tuple[str, ...]:
    """Names of the mappings that come with the package."""
    folder = resources.files("swashplate.links") / "mappings"
    return tuple(sorted(f.name.removesuffix(".toml") for f in folder.iterdir() if f.name.endswith(".toml")))


def servo_mapping(name_or_file: str | Path, vehicle: Vehicle) -> ServoMapping:
    """A servo mapping by the name of a packaged one or by its file.

    Args:
        name_or_file: e.g. "raptor50", or a path.
        vehicle: whose inputs it must give.

    Raises:
        LinkError: naming the file and the entry that is missing, unknown, impossible or for another vehicle; or why no
            autopilot can fly this vehicle.
    """
    if vehicle.traits.no_link:
        raise LinkError(
            f"no autopilot can be linked: {vehicle.traits.no_link}.",
            where=vehicle.card.where,
            channel="--servos",
            hint="Fly it with `swash live`, or with a controller of your own.",
        )
    text, where = _read(name_or_file)
    document = documents.parse(text, form="toml", where=where, error=LinkError)
    table = MappingTable(document, where)
    if document.get("kind") != "servo-mapping" or document.get("schema") != 1:
        raise table.error("kind", 'is no servo mapping: expected kind = "servo-mapping" and schema = 1.')
    table.text("kind"), table.number("schema")
    table.text("title")
    meant = table.text("vehicle")
    layout = _LAYOUTS.get(vehicle.traits.servo_layout)
    if meant != vehicle.name or layout is None:
        raise table.error("vehicle", f"is '{meant}', the vehicle has the equations of '{vehicle.name}'.")
    return layout(table, vehicle)


def _read(name_or_file: str | Path) -> tuple[str, str]:
    if str(name_or_file) in packaged():
        found = resources.files("swashplate.links") / "mappings" / f"{name_or_file}.toml"
        return found.read_text(encoding="utf-8"), str(name_or_file)
    path = Path(name_or_file)
    if not is_file(path):
        raise LinkError(
            "is neither the name of a servo mapping nor a file.",
            where=path,
            hint=f"Names are {', '.join(packaged())}.",
        )
    return documents.read_text(path, form="toml", error=LinkError), str(path)
