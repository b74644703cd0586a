"""A single-rotor helicopter's landing after its engine has failed: a mass point in the vertical plane, many at a time.

States are height, speed ahead, sink, rotor speed and induced velocity; controls the collective and the disc's tilt
(the augmented point mass of Chen and Zhao 1996, NASA TM 110400). Thrust and torque are those of the blade elements of
`physics.blade_element`, induced flow that of `physics.inflow` with the lag of Carpenter and Fridovich (1953). Left out:
the attitude's own motion (the tilt follows at a rate), the tail rotor's power, ground effect and the wind.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from swashplate.arrays import Array
from swashplate.models.vehicle import Vehicle
from swashplate.physics import blade_element
from swashplate.physics.coaxial_wake import APPARENT_MASS
from swashplate.physics.environment import Environment
from swashplate.physics.inflow import mass_flow

FULL_SIZE = 8.0
"""m: radius to which the pilot's rates belong; times go with the root of the radius (Froude)."""
LOADING = 0.13
"""C_T / sigma beyond which blades stall."""
FASTEST = 1.1
"""Rotor speed over the governed one at which the pilot holds it with the collective; beyond is not flown."""
_TILT, _TILT_RATE, _TILT_TIME = 0.5, 0.5, 1.5
"""rad, rad/s and s: the most tilt, how fast it changes, and how hard speed is sought, at `FULL_SIZE`."""
_LEVEL = 0.75
"""Height over the radius below which the pilot levels the helicopter."""
_PULL = 2.5
"""The most vertical force that the collective is pulled for, in weights."""
_STEPS_A_LAG, _LONGEST = 3.0, 4000
_IN_PLANE = 4.65
"""1 + 4.65 mu^2: power of the profile drag with the in-plane force's (Bramwell 2001, sec. 3.14)."""


class Autorotating(NamedTuple):
    """One way to fly the landing; entries may be arrays.

    Attributes:
        target: speed ahead that is sought above the flare [m/s].
        recovery: how much thrust is given up while the rotor is slow, share of the weight by share of rotor speed.
        flare: time to the ground at which it leans back to stop [s].
        pull: vertical deceleration over g that, when it is needed to stop at the ground, is pulled for.
    """

    target: Any
    recovery: Any
    flare: Any
    pull: Any


class PointMass(NamedTuple):
    """A helicopter's numbers, SI units, as the landing needs them."""

    mass: float
    gravity: float
    density: float
    radius: float
    solidity: float
    lift_slope: float
    twist: float
    drag: float
    drag_thrust: float
    induced_factor: float
    inertia: float
    rotor_speed: float
    low: float
    high: float
    area_x: float
    area_z: float
    blade: blade_element.Span

    @property
    def area(self) -> float:
        """Of the disc [m^2]."""
        return math.pi * self.radius * self.radius

    @property
    def hover(self) -> float:
        """Induced velocity of hover [m/s]."""
        return math.sqrt(self.mass * self.gravity / (2.0 * self.density * self.area))

    @property
    def pace(self) -> float:
        """Its times over those of a helicopter of `FULL_SIZE`."""
        return math.sqrt(self.radius / FULL_SIZE)


class Landing(NamedTuple):
    """Motion at one instant: height [m], speed ahead, sink [m/s], rotor speed [rad/s], induced velocity [m/s], tilt of
    the thrust ahead [rad], collective at the root [rad], and the energy that air has taken [J]; arrays of one shape."""

    height: Array
    ahead: Array
    sink: Array
    omega: Array
    induced: Array
    tilt: Array
    pitch: Array
    lost: Array


def point_mass(vehicle: Vehicle, environment: Environment) -> PointMass:
    """The numbers of a single-rotor helicopter, with its options, in these surroundings."""
    par, said = vehicle.values(), vehicle.options
    whole = (par.rotor_tip_loss, par.rotor_root_cutout) if said.tip_loss else (1.0, 0.0)
    return PointMass(
        mass=par.mass,
        gravity=float(environment.gravity),
        density=float(environment.air_density),
        radius=par.rotor_radius,
        solidity=par.rotor_blades * par.rotor_chord / (math.pi * par.rotor_radius),
        lift_slope=par.rotor_lift_slope,
        twist=par.rotor_twist,
        drag=par.rotor_drag,
        drag_thrust=par.rotor_drag_thrust,
        induced_factor=par.rotor_induced_factor if said.induced_factor else 1.0,
        inertia=par.rotor_inertia,
        rotor_speed=par.rotor_speed,
        low=par.collective_low,
        high=par.collective_high,
        area_x=par.fuselage_area_x,
        area_z=par.fuselage_area_z,
        blade=blade_element.span(*whole) if said.tip_loss else blade_element.WHOLE,
    )


class _Air(NamedTuple):
    """Dimensionless flow at the disc: in its plane, through it from below, induced; tip speed [m/s]."""

    mu: Array
    mu_z: Array
    lam: Array
    tip: Array


def _air(p: PointMass, now: Landing) -> _Air:
    tip = now.omega * p.radius
    c, s = np.cos(now.tilt), np.sin(now.tilt)
    return _Air((now.ahead * c + now.sink * s) / tip, (now.sink * c - now.ahead * s) / tip, now.induced / tip, tip)


def _coefficient(p: PointMass, air: _Air, pitch: Array | float) -> Array:
    """C_T at a collective."""
    still = np.zeros(())
    disc = blade_element.Disc(air.mu, still, air.mu_z, air.lam, *(still,) * 4, pitch, p.twist, *(still,) * 5)
    return np.asarray(blade_element.thrust_coefficient(disc, p.solidity, p.lift_slope, p.blade))


def _pitch_for(p: PointMass, air: _Air, CT: Array | float) -> Array:
    """Collective for a C_T within its range and the blades' stall."""
    zero = _coefficient(p, air, 0.0)
    wanted = np.clip(CT, None, LOADING * p.solidity)
    return np.asarray(np.clip((wanted - zero) / (_coefficient(p, air, 1.0) - zero), p.low, p.high))


def power(p: PointMass, now: Landing) -> tuple[Array, Array]:
    """Thrust [N] and shaft power [W] of the main rotor."""
    air = _air(p, now)
    CT = _coefficient(p, air, now.pitch)
    pressure = p.density * p.area * air.tip * air.tip
    profile = 0.5 * p.solidity * (p.drag + p.drag_thrust * CT * CT) * p.blade.d3 * (1.0 + _IN_PLANE * air.mu**2)
    CP = CT * (air.lam - air.mu_z) + (p.induced_factor - 1.0) * air.lam * np.abs(CT) + profile
    return pressure * CT, pressure * air.tip * CP


def steady(p: PointMass, ahead: Array, height: Array) -> Landing:
    """Level flight under power at speeds ahead [m/s] and heights [m], arrays of one shape."""
    weight, drag = p.mass * p.gravity, 0.5 * p.density * p.area_x * ahead * ahead
    tilt, lift = np.arctan2(drag, weight), np.hypot(drag, weight)
    nothing = np.zeros_like(ahead)
    omega = np.full_like(ahead, p.rotor_speed)
    induced, loading = np.full_like(ahead, p.hover), lift / (p.density * p.area)
    for _ in range(60):  # momentum, 2 v V = T / (rho A), by half steps
        through = induced + ahead * np.sin(tilt)
        whole = np.sqrt((ahead * np.cos(tilt)) ** 2 + through**2)
        induced = 0.5 * (induced + loading / (2.0 * whole))
    now = Landing(height, ahead, nothing, omega, induced, tilt, nothing, nothing)
    air = _air(p, now)
    return now._replace(pitch=_pitch_for(p, air, lift / (p.density * p.area * air.tip**2)))


def least_power_speed(p: PointMass) -> float:
    """Speed ahead of the least power [m/s], level; where it is slowest to sink."""
    speeds = np.linspace(0.0, 6.0 * p.hover, 121)
    return float(speeds[np.argmin(power(p, steady(p, speeds, np.ones_like(speeds)))[1])])


def _flown(p: PointMass, now: Landing, pilot: Autorotating, dt: float) -> tuple[Array, Array]:
    """Tilt and collective that the pilot sets."""
    clear, down = np.maximum(now.height, 0.02 * p.radius), np.maximum(now.sink, 0.0)
    needed = down**2 / (2.0 * clear * p.gravity)
    pulling = (needed >= pilot.pull) & (now.sink > 0.0)
    target = np.where(pulling | (now.height < pilot.flare * down), 0.0, pilot.target)
    wanted = np.clip((target - now.ahead) / (p.gravity * _TILT_TIME * p.pace), -_TILT, _TILT)
    wanted = np.where(now.height < _LEVEL * p.radius, 0.0, wanted)
    most = _TILT_RATE / p.pace * dt
    tilt = now.tilt + np.clip(wanted - now.tilt, -most, most)
    ratio = now.omega / p.rotor_speed
    # The collective holds the weight, gives some up for a slow rotor, takes more of a fast one, and pulls at the end.
    gliding = np.clip(1.0 + pilot.recovery * (ratio - 1.0), 0.2, _PULL)
    gliding = np.maximum(gliding, np.where(ratio > FASTEST, _PULL, 0.0))
    share = np.where(pulling, np.clip(1.0 + needed, None, _PULL), gliding)
    turned = now._replace(tilt=tilt)
    air = _air(p, turned)
    return tilt, _pitch_for(p, air, share * p.mass * p.gravity / np.cos(tilt) / (p.density * p.area * air.tip**2))


def step_length(p: PointMass) -> float:
    """Time step [s]: a third of the induced flow's lag in hover."""
    return APPARENT_MASS * p.radius / (4.0 * p.hover) / _STEPS_A_LAG


def moved(p: PointMass, now: Landing, dt: float) -> Landing:
    """Where it all is a step later, without an engine."""
    thrust, taken = power(p, now)
    air = _air(p, now)
    speed = np.hypot(now.ahead, now.sink)
    push_x = 0.5 * p.density * p.area_x * speed * now.ahead
    push_z = 0.5 * p.density * p.area_z * speed * now.sink
    faster = (thrust * np.sin(now.tilt) - push_x) / p.mass
    sinking = p.gravity - (thrust * np.cos(now.tilt) + push_z) / p.mass
    V, _, _ = mass_flow(air.lam, air.mu_z, air.mu * air.mu, np)  # pyrefly: ignore[bad-argument-type]
    inflow = (thrust / (p.density * p.area) - 2.0 * now.induced * V * air.tip) / (APPARENT_MASS * p.radius)
    slower = -taken / (p.inertia * now.omega)
    ahead, sink = now.ahead + faster * dt, now.sink + sinking * dt
    omega = np.maximum(now.omega + slower * dt, 0.1 * p.rotor_speed)
    through = thrust * (np.sin(now.tilt) * now.ahead - np.cos(now.tilt) * now.sink)  # thrust's work on the helicopter
    return Landing(
        now.height - 0.5 * (now.sink + sink) * dt,
        ahead,
        sink,
        omega,
        now.induced + inflow * dt,
        now.tilt,
        now.pitch,
        now.lost + (taken - through + push_x * now.ahead + push_z * now.sink) * dt,
    )


def landed(p: PointMass, start: Landing, pilot: Autorotating, delay: float) -> Landing:
    """How it touches the ground: height zero, or above it where the time was not enough.

    Args:
        p: the helicopter.
        start: flight in which the engine stops.
        pilot: what the pilot does after the delay.
        delay: [s] in which tilt and collective stay as they were.
    """
    dt, where = step_length(p), np.arange(start.height.size)
    now, left, ended = start, pilot, [np.array(part, dtype=np.float64) for part in start]
    for k in range(_LONGEST):
        if k * dt >= delay:
            tilt, pitch = _flown(p, now, left, dt)
            now = now._replace(tilt=tilt, pitch=pitch)
        now = moved(p, now, dt)
        flying = now.height > 0.0
        if not flying.all() or k == _LONGEST - 1:
            for part, last in zip(ended, now, strict=True):
                part[where] = last
            where = where[flying]
            if not where.size:
                break
            now, left = Landing(*(part[flying] for part in now)), Autorotating(*(part[flying] for part in left))
    return Landing(*ended)
