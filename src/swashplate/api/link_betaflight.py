"""A multirotor as the physics of Betaflight's SITL; and its configuration written."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from swashplate.api.link import Linked, finish_link, linked_plant, linked_sensing
from swashplate.api.saying import notice, notice_unless_quiet
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
from swashplate.simulation.linearize import linearize
from swashplate.simulation.standing import airborne
from swashplate.simulation.trim import trim

if TYPE_CHECKING:
    from swashplate.api.verbs.link import LinkBetaflight


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
        saved: tuple[Path, ...] = ()
        try:
            serve(bound, session, idle_exit=asked.idle_exit)
        except KeyboardInterrupt:
            pass
        finally:
            saved = finish_link(plant, recorder, session.exchanged.motors, notices.summary())
    return Linked(session.exchanged.motors, plant.time, notices.summary(), saved)


def write_betaflight_configuration(vehicle: Vehicle, path: str | Path) -> Path:
    """Write the lines of Betaflight's command line that fly a multirotor, gains included; returns the file.

    Raises:
        SwashError: where the folder is missing, the vehicle is no multirotor, or no gains keep their margins.
    """
    file = Path(path)
    if not file.absolute().parent.is_dir():
        raise SwashError("the folder does not exist.", where=file.parent, channel="--out")
    mapping, flying = MotorMapping(vehicle), airborne(vehicle)
    gains = betaflight_gains(linearize(flying, trim(flying)), mapping)
    return write_text(file, configuration(mapping, gains.settings))
