"""From an autopilot's outputs to a vehicle's inputs, as a small TOML says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path

import numpy as np

from swashplate import documents
from swashplate.errors import LinkError
from swashplate.files import is_file
from swashplate.links.mapping_table import MappingTable
from swashplate.links.plate import Plate
from swashplate.links.servo import FLOATS
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend, Scalar


class Engine:
    """A rotor speed control's output, behind which an engine starts.

    The throttle follows its output no faster than `spool` allows, as an engine that is started does: an autopilot only
    ramps its output, and a governor that gets the whole engine at once would turn the helicopter on its skids.

    Attributes:
        servo: the output. full: share of its travel that is the whole engine. spool: from rest to that [s].
        throttle: now, 0 to 1.
    """

    def __init__(self, throttle: MappingTable, servos: MappingTable, table: MappingTable) -> None:
        self.servo = throttle.servo(throttle.number("channel"), servos)
        self.full = throttle.number("full", missing=1.0)
        self.spool = throttle.number("spool_time", missing=8.0)
        if not (self.full > 0.0 and self.spool > 0.0):
            raise table.error("throttle", "expected full and spool_time above zero.")
        self.restart()

    def restart(self) -> None:
        """Engine off."""
        self.throttle: Scalar = 0.0

    def running(self, pulses: Sequence[Scalar], duration: Scalar, xp: Backend) -> Scalar:
        """The throttle, 0 to 1, after pulses [us] by output were held for `duration` [s]."""
        asked = xp.minimum(1.0, self.servo.share(pulses[self.servo.channel - 1], xp) / self.full)
        self.throttle = xp.minimum(asked, self.throttle + duration / self.spool)
        return self.throttle


class HelicopterMapping:
    """Swashplate, tail and rotor speed control of a conventional helicopter.

    Attributes:
        channels: outputs that it uses, from 1.
        shares: those of them that go from nothing to all (motors, throttles) instead of both ways.
        type: of the swashplate. swash, tail, throttle: its outputs.
        angles: of its servos from the nose [deg]; empty where the file has none, or a phase.
        engine: behind the throttle.
        collective_pulse, collective_deg, cyclic_deg, tail_deg, full, spool: as the file has them [us], [deg], [1], [s].
    """

    def __init__(self, table: MappingTable, vehicle: Vehicle) -> None:
        tail, servos = table.part("tail"), table.part("servos", missing={})
        self._plate = Plate(table.part("swashplate"), servos, where=table.where)
        self.type, self.swash, self.angles = self._plate.type, self._plate.servos, self._plate.angles
        self.collective_pulse, self.collective_deg = self._plate.collective_pulse, self._plate.collective_deg
        self.cyclic_deg = self._plate.cyclic_deg
        self.tail = tail.servo(tail.number("channel"), servos)
        self.tail_deg = tail.pair("deg")
        self._tail_pitch = np.radians(self.tail_deg).tolist()
        self.engine = Engine(table.part("throttle"), servos, table)
        self.throttle, self.full, self.spool = self.engine.servo, self.engine.full, self.engine.spool
        table.done()
        self.channels = tuple(s.channel for s in (*self.swash, self.tail, self.throttle))
        self.shares = (self.throttle.channel,)

    def restart(self) -> None:
        """Engine off."""
        self.engine.restart()

    def inputs(self, pulses: Sequence[Scalar], duration: Scalar, xp: Backend = FLOATS) -> list[Scalar]:
        """theta0, B1, A1, theta0T [rad] and throttle for pulses [us] by output, held for `duration` [s]."""
        low, high = self._tail_pitch
        tail = 0.5 * (low + high) + 0.5 * (high - low) * self.tail.travel(pulses[self.tail.channel - 1], xp)
        return [*self._plate.pitches(pulses, xp), tail, self.engine.running(pulses, duration, xp)]


class TwinMapping:
    """Two swashplates and one rotor speed control of a coaxial helicopter with collective pitch.

    Attributes:
        upper, lower: the swashplates; both have the same linkage.
        yaw_share: how much of the swashplates' collective a full yaw command moves (H_DCP_SCALER).
        first: of these two the one whose rotor turns counter-clockwise from above, which more yaw to the right gives
            more collective; ArduPilot's swashplate 1. second: the other.
        engine: of both rotors.
        channels, shares: as `HelicopterMapping`.
    """

    def __init__(self, table: MappingTable, vehicle: Vehicle) -> None:
        swash, servos = table.part("swashplates"), table.part("servos", missing={})
        self.upper, self.lower = (Plate(swash, servos, where=table.where, channels=s) for s in ("upper", "lower"))
        self.yaw_share = swash.number("yaw_share", missing=0.25)
        if not 0.0 < self.yaw_share <= 1.0:
            raise swash.error("yaw_share", f"is {self.yaw_share:g}, expected more than 0, and 1 at most.")
        self.engine = Engine(table.part("throttle"), servos, table)
        table.done()
        self._sense = float(vehicle.options.upper.sense)
        self.first, self.second = (self.upper, self.lower) if self._sense > 0.0 else (self.lower, self.upper)
        self._names = vehicle.input_names
        outputs = (*self.upper.servos, *self.lower.servos, self.engine.servo)
        self.channels = tuple(s.channel for s in outputs)
        if len(set(self.channels)) < len(self.channels):
            raise swash.error("lower", f"outputs {list(self.channels)} are not all different ones.")
        self.shares = (self.engine.servo.channel,)

    def restart(self) -> None:
        """Engine off."""
        self.engine.restart()

    def inputs(self, pulses: Sequence[Scalar], duration: Scalar, xp: Backend = FLOATS) -> list[Scalar]:
        """The vehicle's inputs [rad, 1] for pulses [us] by output, held for `duration` [s]."""
        u, d = self.upper.pitches(pulses, xp), self.lower.pitches(pulses, xp)
        mean, half = ([0.5 * (a + sign * b) for a, b in zip(u, d, strict=True)] for sign in (1.0, -1.0))
        known = {
            "theta0": mean[0],
            "B1": mean[1],
            "A1": mean[2],
            "theta0d": self._sense * half[0],
            "B1d": half[1],
            "A1d": half[2],
            "throttle": self.engine.running(pulses, duration, xp),
        }
        return [known[name] for name in self._names]


class CoaxialMapping:
    """Two motors and two servos of a coaxial helicopter. Attributes as `HelicopterMapping`, and its outputs."""

    engine = None

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

    def inputs(self, pulses: Sequence[Scalar], duration: Scalar, xp: Backend = FLOATS) -> list[Scalar]:
        """motor_lower, motor_upper (0 to 1) and servo_roll, servo_pitch (-1 to 1) for pulses [us] by output.

        An output at its low end holds the rotor still: less would ask the drive train of the card for a negative speed.
        """
        motors = [
            xp.maximum(stopped, s.share(pulses[s.channel - 1], xp))
            for s, stopped in zip(self.motors, self.stopped, strict=True)
        ]
        servos = [k * s.travel(pulses[s.channel - 1], xp) for s, k in zip(self.servos, self.travel, strict=True)]
        # Autopilots count nose up as positive pitch, the CoaX nose down.
        return [*motors, servos[0], -servos[1]]


ServoMapping = HelicopterMapping | TwinMapping | CoaxialMapping
_LAYOUTS: Mapping[str, type[HelicopterMapping] | type[TwinMapping] | type[CoaxialMapping]] = {
    "swashplate": HelicopterMapping,
    "two swashplates": TwinMapping,
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
        resource = resources.files("swashplate.links") / "mappings" / f"{name_or_file}.toml"
        return resource.read_text(encoding="utf-8"), str(name_or_file)
    path = Path(name_or_file)
    if not is_file(path):
        raise LinkError(
            "is neither the name of a servo mapping nor a file.",
            where=path,
            hint=f"Names are {', '.join(packaged())}.",
        )
    return documents.read_text(path, form="toml", error=LinkError), str(path)
