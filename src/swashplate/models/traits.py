"""What a kind of model can do, and what the rest of the package must know of it: said once, beside its equations.

Nothing outside `swashplate.models` asks for a model's name. The defaults are right for a rigid body of anybody's own
equations that says nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from swashplate.arrays import Array
from swashplate.models.card import Card
from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.environment import Environment


@dataclass(frozen=True)
class Free:
    """One parameter that an identification may move.

    Attributes:
        name: its name on the card.
        scale: a change of the order that matters, in the parameter's unit.
        mean, sigma: prior (None: the data alone decides), in the parameter's unit.
        start: first guess (None: the card's value).
        source: where the prior comes from.
    """

    name: str
    scale: float
    mean: float | None = None
    sigma: float | None = None
    start: float | None = None
    source: str = ""


@dataclass(frozen=True)
class Choice:
    """A ready set of free parameters and ties.

    Attributes:
        name: what the user calls it.
        description: what it is for.
        free: the parameters to move.
        ties: "name = expression" each.
        fixed: values that the choice sets for the equations' switches.
    """

    name: str
    description: str
    free: tuple[Free, ...]
    ties: tuple[str, ...] = ()
    fixed: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class PhysicalEffect:
    """A part of a model's physics that its numbers can leave out: what a report asks the flights about.

    Attributes:
        name: in words.
        without: the parameters that make it, and the values at which it is not there.
    """

    name: str
    without: Mapping[str, float]


def uncertain_numbers(card: Card) -> Mapping[str, Choice]:
    """The one choice of a model that has none of its own: what its card itself is uncertain of.

    The prior of each is the card's value with the card's sigma; a card without a sigma has no choice.
    """
    free = tuple(
        Free(name, entry.sigma, entry.value, entry.sigma, source="the card with its sigma")
        for name, entry in card.parameters.items()
        if entry.sigma
    )
    return {"full": Choice("full", "every number that the card gives a sigma", free)} if free else {}


Model = Any
"""A `Vehicle`: it has traits, so that its type cannot be imported here."""

Pose = Callable[[Sequence[float], Sequence[float], Environment], dict[str, Any]]
"""From a state row, an input row and surroundings to how the moving parts stand (see `Traits.pose`)."""
Doubts = Callable[[Model, Array, Array, Environment], Mapping[str, str]]
Hover = Callable[[Any, Scalar, Backend], tuple[Mapping[str, Scalar], Sequence[Scalar]]]
Settled = Callable[[Any, Any, Scalar, Any, Scalar], Mapping[str, Scalar]]


Role = Literal["body", "flapping", "bar", "rotor speed", "other"]
"""What a state is: of the rigid body, a rotor's tilt, a stabilizer bar's, a speed at which something turns, or else."""


@dataclass(frozen=True)
class Axis:
    """One of the four axes that a model is flown and judged in.

    Attributes:
        name: "roll", "pitch", "yaw" or "heave".
        inputs: what drives it, with their shares.
        parameters: those that only this axis tells; a fit holds them where a flight does not move it by itself.
    """

    name: str
    inputs: Mapping[str, float]
    parameters: tuple[str, ...] = ()


@dataclass(frozen=True)
class RecordingFit:
    """How the live page fits a model to a recording.

    Attributes:
        options: of `swash identify`, beside the vehicle and the flight.
        longest: of the recording that is used, the part in which the inputs move most [s]; None for all of it.
    """

    options: tuple[str, ...] = ()
    longest: float | None = None


@dataclass(frozen=True)
class Traits:
    """What a model says of itself.

    Attributes:
        axes: that it is flown in, with their inputs: whether a flight moves each by itself is judged in these.
        roles: what its inner states are, by name. One that is not named is a rotor's speed where its unit is rad/s,
            else "other".
        motors: inputs that are a motor's command, late by another time than a servo's.
        linear: it holds near one trim only: small angles, deviations, input ranges that are often assumed.
        remark: what whoever flies it must know, in a line; "" for nothing.
        about: the same at length.
        no_trim: why it cannot be brought into equilibrium as a flying body; "" where it can.
        rest: of a card, the states in which it rests where it cannot be brought into equilibrium; None where no such
            states are known.
        wind, ground: whether they are in its equations (a battery is where the card has `voltage_nominal`). What has no
            `ground` cannot stand either.
        standing: options of its card with which it stands on the ground and starts its engine; others get skids.
        rotorcraft: it is a single-rotor helicopter's equations: derivatives by contributor, the forms of papers.
        coaxial: two rotors on drive trains, as the autopilot with the decoupling inverts them.
        observed: the observer of validation (tracked pose, gusts, delays of servos and motors) is made for it.
        gyroscope: fits and predictions also read the logged body rates: for bodies so small and quick that a tracked
            attitude says little of them.
        published: name of the packaged card of just these equations, "" where cards differ by aircraft.
        servos: name of its packaged servo mapping, "" where that is its card's.
        servo_layout: what an autopilot's outputs drive: "swashplate" (with tail and throttle), "two swashplates" (with
            one throttle), "two motors" (and two cyclic servos), or "" where no autopilot can be linked.
        no_link: why no autopilot can be linked, where there is something to say; "" where nothing is.
        choices: a card's ready choices of what a fit may free.
        effects: parts of a card's physics that numbers can leave out: a report says which of them the flights ask for.
        recording: how the live page fits it to a recording; None where only frequency responses are made.
        switches: options of the card that may be changed in flight on the live page.
        picture: shapes in body axes (forward, right, down) [m] that the live page draws; None for a plain one.
        pose: of a vehicle, the function from state, inputs and surroundings to how its moving parts stand.
        hover: from parameters, voltage [V] and operations to the hover in closed form: states that are not zero, and
            inputs; None where it is found by Newton's method.
        settled: from inputs, parameters, voltage, attitude and the seconds since the flight's time zero to the inner
            states in slow flight, by name; None where they are found where they rest.
        doubts: what of its equations does not hold at a state, in words by kind; None where nothing is known.
        power: of a state, the shaft power [W]; None where it has none.
        balance: from the vehicle before a fit, the one after it and the motors' trims, what keeps it in balance, in
            words; None where nothing is to be said.
        delayed_by: of the card, the seconds by which its equations themselves delay every command; "" for none.
        voltage_seconds: over which a logged voltage is averaged each way: long where it sags slowly and is noisy, short
            where the motors' commands are shares of it.
    """

    axes: tuple[Axis, ...] = ()
    roles: Mapping[str, Role] = field(default_factory=dict)
    motors: tuple[str, ...] = ()
    linear: bool = False
    remark: str = ""
    about: str = ""
    no_trim: str = ""
    rest: Callable[[Card], Mapping[str, float]] | None = None
    wind: bool = True
    ground: bool = True
    standing: Mapping[str, Any] = field(default_factory=dict)
    rotorcraft: bool = False
    coaxial: bool = False
    observed: bool = False
    gyroscope: bool = False
    published: str = ""
    servos: str = ""
    servo_layout: str = ""
    no_link: str = ""
    choices: Callable[[Card], Mapping[str, Choice]] = uncertain_numbers
    effects: Callable[[Card], Sequence[PhysicalEffect]] = lambda card: ()
    recording: RecordingFit | None = None
    switches: tuple[str, ...] = ()
    picture: Callable[[Model], dict[str, Any]] | None = None
    pose: Callable[[Model], Pose] | None = None
    hover: Hover | None = None
    settled: Settled | None = None
    doubts: Doubts | None = None
    power: Callable[[Model, Array, Array, Environment], float] | None = None
    balance: Callable[[Model, Model, Mapping[str, float]], Sequence[str]] | None = None
    delayed_by: str = ""
    voltage_seconds: float = 8.0
