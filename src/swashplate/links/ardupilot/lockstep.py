"""Ordinary frames of ArduPilot in C: a packet in, the physics on, the answer out, without Python in between.

Ordinary is the next frame of the same sender at the same rate, with pulses of servos, while the vehicle is whole. What
is not is left to `session`, which decides. Outputs, readings and the answer's form are traced from what
the session itself uses, so both say the same.
"""

from __future__ import annotations

import ctypes
import os
import socket
import sys
from copy import deepcopy

import numpy as np

from swashplate.compiled import loaded
from swashplate.engine.emit import fill_template, print_graph
from swashplate.engine.graph import Graph
from swashplate.engine.roots import require_casadi
from swashplate.errors import SwashError
from swashplate.links.ardupilot.answer import form, in_order
from swashplate.links.ardupilot.frames import Address
from swashplate.links.ardupilot.packets import FORMS, LONGEST
from swashplate.links.notices import Say
from swashplate.links.plant import FASTEST, Plant
from swashplate.links.sensing import Sensing
from swashplate.links.servo import CHANNELS, NO_PULSE, PULSES
from swashplate.links.servos import ServoMapping
from swashplate.physics.backend import CasadiBackend
from swashplate.physics.frames import Vector
from swashplate.physics.rigid_body import RigidBody
from swashplate.simulation.stepping import Motion, steps_of

_AT_ONCE = 0.1
"""s that are flown until Python is asked again: keys, other threads and clocks are looked at there."""
_ROOM = 1024
_OPTIONS = ("-O1",)


class _Link(ctypes.Structure):
    _fields_ = (
        ("frame", ctypes.c_void_p),
        *((name, ctypes.c_void_p) for name in ("x", "u", "s", "p", "g", "told")),
        ("form", ctypes.c_char_p),
        *((name, ctypes.c_double) for name in ("duration", "time", "until", "throttle", "voltage")),
        *((name, ctypes.c_int) for name in ("fd", "steps", "rate", "flown", "length", "size", "held")),
        ("count", ctypes.c_uint),
        ("address", ctypes.c_ubyte * 4),
        ("port", ctypes.c_ubyte * 2),
        ("data", ctypes.c_ubyte * (LONGEST + 1)),
        ("answer", ctypes.c_char * _ROOM),
    )


class Lockstep:
    """Flies ordinary frames of a plant.

    Args:
        plant: stepped by C. sensing: of it, without noise.

    Attributes:
        answer: the newest one.
    """

    def __init__(self, plant: Plant, sensing: Sensing) -> None:
        native = plant.native
        assert native is not None
        source, count = _source(plant, sensing)
        library = loaded(source, options=_OPTIONS)
        self._fly = library.fly
        self._fly.argtypes, self._fly.restype = [ctypes.POINTER(_Link)], None
        self._plant = plant
        self._link = _Link(frame=native.function, form=form(count).encode("ascii"))
        for name, row in zip(("x", "u", "s", "p", "g", "told"), native.rows, strict=True):
            setattr(self._link, name, row.ctypes.data)

    @property
    def answer(self) -> bytes:
        return bytes(self._link.answer[: self._link.length])

    def fly(self, bound: socket.socket, sender: Address, count: int, rate: int, until: float) -> int:
        """Fly on.

        Args:
            bound: the socket. sender: whose packets are answered.
            count: of the last frame. rate: of the frames [Hz].
            until: the physics' time to which it flies [s].

        Returns:
            How many frames were flown; `holding` and `left` say why no more.
        """
        plant, link = self._plant, self._link
        link.fd, link.rate, link.count, link.duration = bound.fileno(), rate, count & 0xFFFFFFFF, 1.0 / rate
        link.steps, link.time, link.until = steps_of(link.duration), plant.time, min(until, plant.time + _AT_ONCE)
        engine = plant.mapping.engine
        link.voltage, link.throttle = plant.voltage, 0.0 if engine is None else engine.throttle
        link.address[:], link.port[:] = socket.inet_aton(sender[0]), sender[1].to_bytes(2, "big")
        self._fly(link)
        plant.was_flown(link.time, link.throttle)
        return int(link.flown)

    @property
    def holding(self) -> bool:
        """Whether the newest answer is held until it is flown on."""
        return bool(self._link.held)

    @property
    def left(self) -> tuple[bytes, Address] | None:
        """What came and was not answered, and its sender."""
        link = self._link
        if link.held or link.size < 0:
            return None
        return bytes(link.data[: link.size]), (socket.inet_ntoa(bytes(link.address)), int.from_bytes(link.port, "big"))


def lockstep(plant: Plant, sensing: Sensing, say: Say) -> Lockstep | None:
    """What flies a plant's ordinary frames; None where only Python can: without a compiler, with noisy sensors, a
    battery that sags or something that is estimated. `say` is told where a compiler refuses."""
    if os.name != "posix" or sys.byteorder != "little" or sensing.noisy or plant.native is None:
        return None
    try:
        return Lockstep(plant, sensing)
    except (SwashError, OSError) as error:
        say(f"Python answers every packet, which is slower: {error}")
        return None


def _source(plant: Plant, sensing: Sensing) -> tuple[str, int]:
    """The C, and of how many numbers its answer is."""
    casadi, xp = require_casadi(), CasadiBackend()
    mapping = deepcopy(plant.mapping)
    assert isinstance(mapping, ServoMapping)
    pulses, duration, throttle = (casadi.SX.sym(*each) for each in (("pulses", CHANNELS), ("duration",), ("throttle",)))
    if mapping.engine is not None:
        mapping.engine.throttle = throttle
    inputs = mapping.inputs([pulses[k] for k in range(CHANNELS)], duration, xp)
    low, high = np.transpose([(float(a), float(b)) for a, b in plant.vehicle.input_limits])
    held = [xp.maximum(a, xp.minimum(u, b)) for u, a, b in zip(inputs, low, high, strict=True)]
    after = throttle if mapping.engine is None else mapping.engine.throttle
    advance = casadi.Function("f", [pulses, duration, throttle], [casadi.vertcat(*held), casadi.vertcat(after)])
    n = len(plant.vehicle.state_names)
    numbers, time, voltage = casadi.SX.sym("told", n + 6), casadi.SX.sym("time"), casadi.SX.sym("voltage")
    row = [numbers[k] for k in range(n + 6)]
    body_of = RigidBody._make(row[: len(RigidBody._fields)])
    motion = Motion(body_of, Vector._make(row[n : n + 3]), Vector._make(row[n + 3 :]), row[:n])
    values = in_order(sensing.sensed(motion, time, voltage, None, xp))
    felt = casadi.Function("f", [numbers, time, voltage], [casadi.vertcat(*values)], {"cse": True})
    names = [("pulses", "duration", "throttle"), ("told", "time", "voltage")]
    blanks = {
        "MOVED": _c(advance, names[0], ["u", "after"]),
        "FELT": _c(felt, names[1], ["r"]),
        "NUMBERS": str(len(values)),
        "PRINTED": ", ".join(f"r[{k}]" for k in range(len(values))),
        "STATES": str(n),
        "CHANNELS": str(CHANNELS),
        "USED": ", ".join(str(c - 1) for c in plant.mapping.channels),
        "LEAST": str(PULSES[0]), "MOST": str(PULSES[1]), "NONE": str(NO_PULSE),
        "FASTEST": repr(FASTEST), "Z": str(RigidBody._fields.index("z")),
        "U": str(RigidBody._fields.index("u")), "P": str(RigidBody._fields.index("p")),
        "FORMS": ", ".join(f"{{{magic}, {form.size}}}" for magic, form in FORMS.items()),
        "ROOM": str(_ROOM), "LONGEST": str(LONGEST + 1),
    }  # fmt: skip
    return fill_template("lockstep.c", blanks), len(values)


def _c(function: Graph, inputs: tuple[str, ...], outputs: list[str]) -> str:
    nods = "".join(f"  (void){name};\n" for name in inputs)  # strict compilers ask for one where it is not read
    return print_graph(function, real="double", precision="double", inputs=inputs, outputs=outputs) + nods
