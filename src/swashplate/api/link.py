"""A vehicle as the physics of a running autopilot: ArduPilot's and Betaflight's SITL over UDP, PX4's over TCP."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from swashplate.api.asking import name_of
from swashplate.api.saying import notice, notice_unless_quiet
from swashplate.atomic import write_text
from swashplate.control.analysis.cascade_gains import cascade_gains
from swashplate.errors import ControllerError, SwashError
from swashplate.links.ardupilot.gains import ASSUMED_DELAY, ardupilot_law, written_gains
from swashplate.links.ardupilot.parameters import Parameters, parameter_file, parameters
from swashplate.links.betaflight.binary import wait_for_sitl
from swashplate.links.betaflight.configuration import configuration
from swashplate.links.betaflight.gains import betaflight_gains
from swashplate.links.betaflight.motors import MotorMapping
from swashplate.links.betaflight.packets import MOTORS_PORT
from swashplate.links.betaflight.pilot import hovering, pilot_for
from swashplate.links.betaflight.servo_outputs import SwashServoMapping
from swashplate.links.betaflight.session import BetaflightSession, serve
from swashplate.links.notices import Notices
from swashplate.links.plant import Plant, Surroundings
from swashplate.links.recorder import Recorder, recover
from swashplate.links.sensing import Sensing
from swashplate.links.servos import ServoMapping, packaged, servo_mapping
from swashplate.links.sockets import is_loopback, listen_tcp, listen_udp
from swashplate.models.doubts import monitored
from swashplate.models.surroundings import complete_delays, input_delays
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.linearize import linearize
from swashplate.simulation.record import unflown
from swashplate.simulation.sensors import InertialUnit
from swashplate.simulation.standing import airborne, standing
from swashplate.simulation.stepping import MakeEngine, SteppingEngine, VirtualEngine
from swashplate.simulation.trim import Trim, trim

if TYPE_CHECKING:
    from swashplate.api.verbs.link import Link, LinkBetaflight, Linking
    from swashplate.links.estimating import KnownNow


Say = Callable[[str], None]
_ESTIMATED = 100.0
"""Samples a second of what estimates in flight [Hz]."""


@dataclass(frozen=True)
class Linked:
    """What a link did until it ended.

    Attributes:
        exchanges: messages that were answered.
        time: seconds since the vehicle was last put on the ground.
        noted: what was odd about the autopilot's messages, with counts.
        saved: recordings.
        estimates: what was asked to be estimated, as it was known at the end.
    """

    exchanges: int
    time: float
    noted: str
    saved: tuple[Path, ...]
    estimates: tuple[KnownNow, ...] = ()

    def __repr__(self) -> str:
        told = f"{self.exchanges} exchanges; {self.time:.1f} s since the vehicle was last put on the ground."
        if self.estimates:
            told += f"\nEstimated in flight: {'; '.join(map(str, self.estimates))}."
        return f"{told}\nNoted: {self.noted}." if self.noted else told


def mapping_of(vehicle: Vehicle, servos: str | Path | None, *, name: str | None, suffix: str) -> ServoMapping:
    """The servo mapping that was asked for, or the packaged one of the vehicle's name and a firmware's suffix.

    Raises:
        SwashError: where there is none, or it is for another vehicle.
    """
    if servos is None and not vehicle.traits.no_link:
        servos = f"{vehicle.traits.servos or name or vehicle.name}{suffix}"
        if servos not in packaged():
            raise SwashError(
                f"there is no servo mapping '{servos}'; those that there are: {', '.join(packaged())}.",
                where=name or vehicle.name,
                channel="--servos",
                hint="Give one of them, or a file of your own.",
            )
    return servo_mapping(servos or "", vehicle)


def _own_process() -> None:
    if threading.current_thread() is threading.main_thread():  # started in a shell's background it would be ignored
        signal.signal(signal.SIGINT, signal.default_int_handler)


def serve_ardupilot(asked: Link) -> Linked:
    """The physics of ArduPilot's SITL until an interrupt."""
    from swashplate.links.ardupilot.runner import serve
    from swashplate.links.ardupilot.session import ArduPilotSession

    plant, recorder = linked_plant(asked, "")
    notices = Notices(notice)
    with listen_udp(asked.listen, asked.port) as bound:
        _tell_where("UDP", bound.getsockname(), asked.listen, plant)
        session = ArduPilotSession(plant, linked_sensing(asked, plant), notices)
        session.prepare()
        serving = partial(serve, bound, session, idle_exit=asked.idle_exit)
        return _until_interrupt(serving, plant, recorder, notices, lambda: session.progress.exchanges)


def serve_px4(asked: Link) -> Linked:
    """The simulator of PX4's SITL until an interrupt."""
    from swashplate.links.px4.runner import serve
    from swashplate.links.px4.session import Px4Session

    plant, recorder = linked_plant(asked, "_px4")
    notices = Notices(notice)
    session = Px4Session(plant, linked_sensing(asked, plant), notices, seed=asked.seed)
    with listen_tcp(asked.listen, asked.port) as listening:
        _tell_where("TCP", listening.getsockname(), asked.listen, plant)
        serving = partial(serve, listening, session, notices, idle_exit=asked.idle_exit)
        return _until_interrupt(serving, plant, recorder, notices, lambda: session.exchanges)


def write_ardupilot_parameters(
    vehicle: Vehicle,
    path: str | Path,
    *,
    trim: Trim,
    name: str | None = None,
    servos: str | Path | None = None,
    notice: Say = print,
) -> Path:
    """Write ArduPilot's parameters for a vehicle in hover, gains of all loops included; returns the file.

    The gains are those of `autopilot_gains`. Where none hold their margins the file has none, and `notice` is told.

    Args:
        vehicle: what ArduPilot will fly.
        path: of the file.
        trim: its hover.
        name, servos, notice: as of `link_ardupilot`.

    Raises:
        SwashError: where the folder is missing or there is no servo mapping.
    """
    file = _to_write(path)
    mapping = mapping_of(vehicle, servos, name=name, suffix="")
    settings = parameters(mapping, vehicle, trim) | gains_to_write(mapping, vehicle, trim, notice=notice)
    return write_text(file, parameter_file(settings, title=vehicle.card.title))


def _to_write(path: str | Path) -> Path:
    file = Path(path)
    if not file.absolute().parent.is_dir():
        raise SwashError("the folder does not exist.", where=file.parent, channel="--out")
    return file


def gains_to_write(mapping: ServoMapping, vehicle: Vehicle, trim: Trim, *, notice: Say) -> Parameters:
    """ArduPilot's gains of all loops by `autopilot_gains`; none, and `notice` is told, where none hold margins."""
    late = complete_delays(vehicle, input_delays(vehicle) or ASSUMED_DELAY)
    try:
        return written_gains(cascade_gains(vehicle, trim, ardupilot_law(mapping, vehicle, trim), delays=late).law)
    except ControllerError as error:
        notice(f"The file has no gains, ArduPilot's own would fly: {error.problem}")
        return {}


def linked_plant(
    asked: Linking, suffix: Literal["", "_px4"], motors: MotorMapping | SwashServoMapping | None = None
) -> tuple[Plant, Recorder | None]:
    """What flies, and what keeps its flights; told what is wrong before anything is compiled."""
    _own_process()
    vehicle, (estimated, truth) = asked.whole(), asked.watched()
    around = asked.around(vehicle)
    if asked.voltage is not None:
        if not 0.0 < asked.voltage < 1000.0:
            raise SwashError(f"is {asked.voltage:g} V, expected 0 to 1000.", channel="voltage")
        around = around._replace(voltage=asked.voltage)
    aircraft = standing(vehicle.with_values(truth) if truth else vehicle)
    mapping = motors or mapping_of(aircraft, asked.servos, name=name_of(asked.vehicle), suffix=suffix)
    recorder = None
    if asked.record is not None:
        recover(asked.record, notice)
        recorder = Recorder(
            asked.record,
            like=unflown(aircraft, details={"link": True, "rate": asked.record_rate}),
            say=notice,
            judge=partial(monitored, vehicle=aircraft),
        )
    estimating = None
    if estimated:
        from swashplate.links.estimating import Estimating

        estimating = Estimating(vehicle, estimated, rate=_ESTIMATED, seed=asked.seed, say=notice)
    plant = Plant(
        aircraft,
        mapping,
        Surroundings(around, asked.sag),
        recorder=recorder,
        record_rate=asked.record_rate,
        engine=link_engine(notice),
        estimating=estimating,
    )
    plant.prepare()
    return plant, recorder


def link_engine(notice: Say) -> MakeEngine:
    """The vehicle's own C where this machine can compile it, which is quicker; the virtual machine elsewhere."""
    from swashplate.compiled import can_compile
    from swashplate.export.stepping_c import CompiledEngine

    def make(moved: Vehicle, environment: Environment) -> SteppingEngine:
        if can_compile():
            try:
                return CompiledEngine(moved, environment)
            except (SwashError, OSError) as error:  # a compiler without headers, a folder that nothing runs from
                notice(f"The vehicle's C cannot be used here, a slower virtual machine steps instead: {error}")
        return VirtualEngine(moved, environment)

    return make


def linked_sensing(asked: Linking, plant: Plant) -> Sensing:
    """What the autopilot's sensors see of it."""
    return Sensing(plant, unit=InertialUnit() if asked.noise else None, seed=asked.seed)


def _tell_where(kind: str, at: tuple[str, int], listen: str, plant: Plant) -> None:
    if not is_loopback(listen):
        notice(f"Listening beyond this machine, on {listen}: anyone who reaches it can fly this vehicle.")
    notice_unless_quiet(f"{plant.vehicle.card.title}: waiting for an autopilot on {kind} {at[0]}:{at[1]}. Ctrl-C ends.")


def _until_interrupt(
    serving: Callable[[], None],
    plant: Plant,
    recorder: Recorder | None,
    notices: Notices,
    exchanges: Callable[[], int],
) -> Linked:
    """Serve until an interrupt; whatever happens tell what the link did, and keep its flights."""
    saved: tuple[Path, ...] = ()
    try:
        with suppress(KeyboardInterrupt):
            serving()
    finally:
        known = () if plant.estimating is None else plant.estimating.known
        done = Linked(exchanges(), plant.time, notices.summary(), (), known)
        notice_unless_quiet(repr(done))
        if recorder is not None:
            saved = recorder.finish()
            told = f"written: {', '.join(map(str, saved))}" if saved else "nothing was flown, nothing is written."
            notice_unless_quiet(told)
    return replace(done, saved=saved)


def serve_betaflight(asked: LinkBetaflight, *, swash: str = "120") -> Linked:
    """The physics of Betaflight's SITL, whose ports are fixed, until an interrupt.

    It is waited for until it has opened its MSP port, because a state that comes before ends it.
    """
    vehicle = asked.whole()
    flying, around = airborne(vehicle), asked.around(vehicle)
    helicopter = vehicle.traits.servo_layout == "swashplate"
    hover = trim(flying, environment=around)
    mapping = SwashServoMapping(flying, hover, swash=swash) if helicopter else MotorMapping(vehicle)
    if helicopter and asked.pilot:
        raise SwashError("flies multirotors only.", channel="--pilot")
    notices = Notices(notice)
    with listen_udp("127.0.0.1", MOTORS_PORT) as bound:
        plant, recorder = linked_plant(asked, "", mapping)
        doubles = 17 if helicopter else 18
        session = BetaflightSession(plant, mapping, linked_sensing(asked, plant), notices, doubles=doubles)
        session.pace = asked.pace
        if asked.pilot:
            session.sticks = hovering(pilot_for(linearize(flying, hover), plant.standing_depth))
        notice_unless_quiet("waiting for a SITL of Betaflight or Rotorflight (TCP 5761)")
        wait_for_sitl(asked.wait)
        serving = partial(serve, bound, session, idle_exit=asked.idle_exit)
        return _until_interrupt(serving, plant, recorder, notices, lambda: session.exchanged.motors)


def write_betaflight_configuration(vehicle: Vehicle, path: str | Path) -> Path:
    """Write the lines of Betaflight's command line that fly a multirotor, gains included; returns the file.

    Raises:
        SwashError: where the folder is missing, the vehicle is no multirotor, or no gains keep their margins.
    """
    file = _to_write(path)
    mapping, flying = MotorMapping(vehicle), airborne(vehicle)
    gains = betaflight_gains(linearize(flying, trim(flying)), mapping)
    return write_text(file, configuration(mapping, gains.settings))
