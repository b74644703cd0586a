"""The verb `link_betaflight`: a multirotor as the physics of Betaflight's SITL; and its configuration written."""

from __future__ import annotations

from pathlib import Path

from swashplate.api.link import LinkAsked, Linked, Say, finish_link, linked_plant, linked_sensing
from swashplate.api.saying import silent
from swashplate.atomic import write_text
from swashplate.errors import SwashError
from swashplate.links.betaflight.binary import wait_for_sitl
from swashplate.links.betaflight.configuration import configuration
from swashplate.links.betaflight.gains import betaflight_gains
from swashplate.links.betaflight.motors import MotorMapping
from swashplate.links.betaflight.packets import MOTORS_PORT
from swashplate.links.betaflight.pilot import hovering, pilot_for
from swashplate.links.betaflight.servo_outputs import SwashServoMapping
from swashplate.links.betaflight.session import BetaflightSession, serve
from swashplate.links.notices import Notices
from swashplate.links.sockets import listen_udp
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.linearize import linearize
from swashplate.simulation.standing import airborne
from swashplate.simulation.trim import trim


def link_betaflight(
    vehicle: Vehicle,
    *,
    environment: Environment | None = None,
    voltage: float | None = None,
    sag: float = 0.0,
    noisy: bool = False,
    seed: int = 0,
    record: str | Path | None = None,
    record_rate: float = 200.0,
    idle_exit: float | None = None,
    pace: float = 1.0,
    pilot: bool = False,
    swash: str = "120",
    wait: float = 60.0,
    notice: Say = print,
    say: Say = silent,
) -> Linked:
    """Be the physics of Betaflight's SITL, whose ports are fixed: states to UDP 9003, motors from 9001.

    It is waited for until it has opened its MSP port, because a state that comes before ends it. Both sides run on
    clocks of their own: there is no lockstep. An interrupt (Ctrl-C) ends.

    Args:
        vehicle: a multirotor of at most eight motors; or a helicopter for Rotorflight, whose servos are read behind the
            motor, and whose states are the pressure shorter.
        environment, voltage, sag, noisy, seed, record, record_rate, idle_exit, notice, say: as of `link_ardupilot`.
        pace: simulated seconds a second, 0.02 to 1.
        pilot: a pilot of ours sends sticks: arms after 8 s, and hovers 1.5 m high; of a multirotor.
        swash: type of a helicopter's swashplate.
        wait: for the SITL [s].

    Raises:
        SwashError: where the vehicle is no multirotor, the port is taken, or nobody came.
    """
    if not 0.02 <= pace <= 1.0:
        raise SwashError(f"is {pace:g}, expected 0.02 to 1 simulated seconds a second.", channel="pace")
    flying = airborne(vehicle)
    helicopter = vehicle.traits.servo_layout == "swashplate"
    hover = trim(flying, environment=environment)
    mapping = SwashServoMapping(flying, hover, swash=swash) if helicopter else MotorMapping(vehicle)
    if helicopter and pilot:
        raise SwashError("flies multirotors only.", channel="--pilot")
    asked = LinkAsked(vehicle, None, environment, None, voltage, sag, record, record_rate, (), None, seed)
    notices = Notices(notice)
    with listen_udp("127.0.0.1", MOTORS_PORT) as bound:
        plant, recorder = linked_plant(asked, "", notice, mapping)
        doubles = 17 if helicopter else 18
        session = BetaflightSession(
            plant, mapping, linked_sensing(plant, noisy=noisy, seed=seed), notices, doubles=doubles
        )
        session.pace = pace
        if pilot:
            session.sticks = hovering(pilot_for(linearize(flying, hover), plant.standing_depth))
        say("waiting for a SITL of Betaflight or Rotorflight (TCP 5761)")
        wait_for_sitl(wait)
        saved: tuple[Path, ...] = ()
        try:
            serve(bound, session, idle_exit=idle_exit)
        except KeyboardInterrupt:
            pass
        finally:
            saved = finish_link(plant, recorder, session.exchanged.motors, notices.summary(), say)
    return Linked(session.exchanged.motors, plant.time, notices.summary(), saved)


def write_betaflight_configuration(vehicle: Vehicle, path: str | Path) -> Path:
    """Write the lines of Betaflight's command line that fly a multirotor, gains included; returns the file.

    Raises:
        SwashError: where the folder is missing, the vehicle is no multirotor, or no gains keep their margins.
    """
    file = Path(path)
    if not file.absolute().parent.is_dir():
        raise SwashError("the folder does not exist.", where=file.parent, channel="--write-configuration")
    mapping, flying = MotorMapping(vehicle), airborne(vehicle)
    gains = betaflight_gains(linearize(flying, trim(flying)), mapping)
    return write_text(file, configuration(mapping, gains.settings))
