"""The virtual test bench: the CoaX held still on a force and torque sensor (Fankhauser et al., sec. IV-A, Figs 4, 5).

The equations are those of flight (`vehicles.coax.loads`); only the rigid body does not move, and the stabilizer bar is
free or held by a magnet. What a bench adds is here: motors with a dead zone and a saturation, a sensor with noise,
bias, drift and the rotors' vibration, a tachometer that counts in steps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.bench.record import LOADS, BenchRecord
from swashplate.bench.refusals import COMMANDS
from swashplate.engine.roots import require_casadi
from swashplate.engine.symbols import Operand
from swashplate.models.coax import CoaxialLoads, CoaxInputs, CoaxParameters, CoaxState, Drive, loads
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend, CasadiBackend
from swashplate.physics.environment import Environment
from swashplate.physics.ground_effect import thrust_gain
from swashplate.physics.rigid_body import RigidBody
from swashplate.physics.rotor import TipPathPlane
from swashplate.physics.stabilizer_bar import StabilizerBar

DRIVING = (
    "motor_lower",
    "motor_upper",
    "servo_roll",
    "servo_pitch",
    "voltage",
    "airspeed_x",
    "airspeed_y",
    "bar_alpha",
    "bar_beta",
    "phi",
    "theta",
)
"""What drives the bench, in the order of a compiled row."""

_STATES = ("alpha_lower", "beta_lower", "eta_bar", "zeta_bar", "omega_lower", "omega_upper")


@dataclass(frozen=True)
class Setup:
    """What a bench is made of. Standard deviations are per sample, biases and drifts of one record.

    The numbers are assumptions for a small six-axis sensor: those of the paper's bench are not published.

    Attributes:
        force_noise, moment_noise: [N], [N m].
        force_bias, moment_bias: standard deviation of the offset of a record [N], [N m].
        force_drift, moment_drift: standard deviation of its steady drift [N/min], [N m/min].
        force_vibration, moment_vibration: amplitude at each rotor's frequency at 240 rad/s, as its speed squared.
        speed_noise, speed_step: noise and step of the tachometers [rad/s].
        speed_scatter: how well a motor repeats its speed from point to point, standard deviation [rad/s].
        voltage_noise, airspeed_noise, angle_noise: [V], [m/s], [rad].
        dead_zone, saturation: motor commands below which the motor stands and above which it no longer follows.
        interference: thrust of a rotor alone over its thrust above or below the other, less one.
        air_density: [kg/m^3]; None for that of the card.
        height: of the rotors above the floor [m], with its ground effect; None for free air.
    """

    force_noise: float = 0.02
    moment_noise: float = 0.002
    force_bias: float = 0.05
    moment_bias: float = 0.005
    force_drift: float = 0.005
    moment_drift: float = 0.0005
    force_vibration: float = 0.05
    moment_vibration: float = 0.005
    speed_noise: float = 0.4
    speed_step: float = 0.5
    speed_scatter: float = 1.0
    voltage_noise: float = 0.01
    airspeed_noise: float = 0.05
    angle_noise: float = 0.002
    dead_zone: float = 0.33
    saturation: float = 0.78
    interference: float = 0.15
    air_density: float | None = None
    height: float | None = None


@dataclass(frozen=True)
class RecordSchedule:
    """One record before it is measured.

    Attributes:
        name: of the record.
        procedures: what it is for.
        driving: rows of `DRIVING` by sample, shape (n,); what is left out is zero (the supply: nominal).
        point: number of the measuring point by sample, 0 on the way.
        rate: samples per second.
        bar: "held" (level, or where a magnet holds it) or "free".
        removed: the rotor that is taken off ("" for none).
        about: the points in words, for the plan.
    """

    name: str
    procedures: tuple[str, ...]
    driving: Mapping[str, Array]
    point: Array
    rate: float
    bar: str = "held"
    removed: str = ""
    about: str = ""

    @property
    def duration(self) -> float:
        return self.point.size / self.rate


def points(
    name: str,
    procedures: Sequence[str],
    settings: Sequence[Mapping[str, float]],
    *,
    settle: float = 1.0,
    hold: float = 2.0,
    rate: float = 100.0,
    removed: str = "",
    about: str = "",
) -> RecordSchedule:
    """A schedule of steady points, one after the other.

    Args:
        settings: what differs from zero at each point, by the names of `DRIVING`.
        settle, hold: seconds before a point counts, and for which it does.
    """
    way, held = round(settle * rate), round(hold * rate)
    names = [key for key in DRIVING if any(key in setting for setting in settings)]
    driving = {key: np.repeat([setting.get(key, 0.0) for setting in settings], way + held) for key in names}
    counted = np.repeat(np.arange(1.0, len(settings) + 1.0), way + held)
    number = counted * np.tile(np.r_[np.zeros(way), np.ones(held)], len(settings))
    return RecordSchedule(name, tuple(procedures), driving, number, rate, removed=removed, about=about)


@dataclass(frozen=True)
class _Held:
    """How the vehicle is held."""

    mixing: str
    dt: float


def _acting(plan: _Held, x: Sequence[Operand], w: Sequence[Operand], p: Sequence[Operand], xp: Backend) -> CoaxialLoads:
    """Loads and rates of the moving parts of the held vehicle."""
    drive = dict(zip(DRIVING, w, strict=True))
    parameters, density = CoaxParameters(*p[:-2]), p[-1]
    body = RigidBody(*(0.0,) * 6, drive["phi"], drive["theta"], *(0.0,) * 4)
    held = StabilizerBar(drive["phi"] + drive["bar_alpha"], drive["theta"] + drive["bar_beta"])
    is_free = p[-2] > 0.5
    bar = StabilizerBar(xp.where(is_free, x[2], held.eta), xp.where(is_free, x[3], held.zeta))
    state = CoaxState(body, TipPathPlane(x[0], x[1]), bar, Drive(x[4], x[5]))
    inputs = CoaxInputs(*(drive[name] for name in COMMANDS))
    air = Environment(
        wind_north=-drive["airspeed_x"],
        wind_east=-drive["airspeed_y"],
        air_density=density,
        gravity=0.0,
        voltage=drive["voltage"],
    )
    return loads(state, inputs, parameters, air, xp, mixing=plan.mixing)


@lru_cache(maxsize=8)
def _graphs(plan: _Held) -> tuple[Any, Any]:
    """A step of Runge and Kutta's classical method from row to next row, and the loads: CasADi functions.

    Commands are held between samples, attitudes go straight to the next.
    """
    casadi, xp = require_casadi(), CasadiBackend()
    x, w, then = (casadi.SX.sym(name, n) for name, n in (("x", len(_STATES)), ("w", len(DRIVING)), ("t", len(DRIVING))))
    p, dt = casadi.SX.sym("p", len(CoaxParameters._fields) + 2), plan.dt

    def entries(column: Operand) -> list[Operand]:
        return [column[i] for i in range(column.shape[0])]

    acting = _acting(plan, entries(x), entries(w), entries(p), xp)
    rates_of = [rate for part in (acting.lower, acting.bar or (), acting.drive) for rate in part]
    rates = casadi.Function("rates", [x, w, p], [casadi.vertcat(*rates_of)])
    loads_of = casadi.Function("loads", [x, w, p], [casadi.vertcat(*acting.force, *acting.moment)])
    glides = casadi.DM([float(name in ("phi", "theta")) for name in DRIVING])
    end = w + glides * (then - w)
    middle = (w + end) / 2
    k1 = rates(x, w, p)
    k2 = rates(x + dt / 2 * k1, middle, p)
    k3 = rates(x + dt / 2 * k2, middle, p)
    k4 = rates(x + dt * k3, end, p)
    after = x + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return casadi.Function("step", [x, w, then, p], [after], {"cse": True}), loads_of


def _run(plan: _Held, start: Array, rows: Array, p: Array) -> tuple[Array, Array]:
    """States (n, 6) and loads (n, 6) of a record for its driving rows (n, 11)."""
    step, loads_of = _graphs(plan)
    n = len(rows)
    numbers = np.repeat(p[:, None], n, axis=1)
    after = step.mapaccum("record", n - 1)(start, rows[:-1].T, rows[1:].T, numbers[:, 1:]).full()
    states = np.concatenate([start[:, None], after], axis=1)
    return states.T, loads_of.map(n)(states, rows.T, numbers).full().T


def virtual_bench(
    vehicle: Vehicle, schedules: Sequence[RecordSchedule], *, setup: Setup | None = None, seed: int = 0
) -> tuple[BenchRecord, ...]:
    """Records of the virtual bench, one for each schedule.

    Args:
        vehicle: the CoaX on the bench; its card is the truth.
        schedules: all at one rate.
        setup: what the bench is made of.
        seed: of everything random.
    """
    setup = setup or Setup()
    rngs = [np.random.default_rng([seed, number]) for number in range(len(schedules))]
    rows = [_driving_rows(vehicle, schedule) for schedule in schedules]
    reached = [
        _motors(vehicle, schedule, row, setup, rng) for schedule, row, rng in zip(schedules, rows, rngs, strict=True)
    ]
    plan = _Held(str(vehicle.card.options.get("mixing", "rotation")), 1.0 / schedules[0].rate)
    runs = [
        _run(plan, _start(vehicle, row[:1])[0], row, _parameter_row(vehicle, schedule, setup))
        for schedule, row in zip(schedules, reached, strict=True)
    ]
    return tuple(
        _observe(schedule, row, x, load, setup, rng)
        for schedule, row, (x, load), rng in zip(schedules, rows, runs, rngs, strict=True)
    )


def _driving_rows(vehicle: Vehicle, schedule: RecordSchedule) -> Array:
    nominal = vehicle.card.values()["voltage_nominal"]
    columns = [
        schedule.driving.get(name, np.full(schedule.point.size, nominal if name == "voltage" else 0.0))
        for name in DRIVING
    ]
    return np.column_stack(columns).astype(np.float64)


def _motors(vehicle: Vehicle, schedule: RecordSchedule, rows: Array, setup: Setup, rng: np.random.Generator) -> Array:
    """The commands that reach the drive trains: dead zone, saturation, scatter; no motor turns backwards."""
    card, standing = vehicle.card.values(), rows.copy()
    above = card["k_drive_voltage"] * (rows[:, DRIVING.index("voltage")] - card["voltage_nominal"])
    changed = np.any(np.diff(rows, axis=0, prepend=rows[:1]) != 0.0, axis=1)
    changes = np.cumsum(changed | (np.diff(schedule.point, prepend=0.0) < 0.0))  # a point set twice is two points
    visits = changes if schedule.point.max() > 1 else np.zeros_like(changes)
    for name in ("lower", "upper"):
        place = DRIVING.index(f"motor_{name}")
        k, standstill = card[f"k_drive_{name}"], -(card[f"o_drive_{name}"] + above) / card[f"k_drive_{name}"]
        scatter = setup.speed_scatter / k * rng.standard_normal(visits.max() + 1)[visits]
        command = np.minimum(rows[:, place], setup.saturation) + scatter
        stopped = (rows[:, place] < setup.dead_zone) | (schedule.removed == name)
        standing[:, place] = np.where(stopped, standstill, np.maximum(command, standstill))
    return standing


def _parameter_row(vehicle: Vehicle, schedule: RecordSchedule, setup: Setup) -> Array:
    card = vehicle.card.values()
    if schedule.removed:
        gone, left = schedule.removed, "lower" if schedule.removed == "upper" else "upper"
        alone = 1.0 + setup.interference
        card = {**card, f"k_thrust_{gone}": 0.0, f"k_torque_{gone}": 0.0, f"inertia_drive_{gone}": 0.0}
        card = {**card, f"k_thrust_{left}": alone * card[f"k_thrust_{left}"]}
    density = card["air_density"] if setup.air_density is None else setup.air_density
    if setup.height is not None:
        gain = thrust_gain(setup.height, radius=card["rotor_radius"])
        card = {**card, **{name: gain * card[name] for name in ("k_thrust_upper", "k_thrust_lower")}}
    free = float(schedule.bar == "free")
    return np.array([*(card[name] for name in vehicle.parameter_names), free, density], dtype=np.float64)


def _start(vehicle: Vehicle, first: Array) -> Array:
    """Settled states at each record's first driving row, shape (records, 6)."""
    card = vehicle.card.values()
    start = np.zeros((len(first), len(_STATES)))
    start[:, 2:4] = first[:, [DRIVING.index("phi"), DRIVING.index("theta")]]
    above = card["k_drive_voltage"] * (first[:, DRIVING.index("voltage")] - card["voltage_nominal"])
    for place, name in ((4, "lower"), (5, "upper")):
        command = first[:, DRIVING.index(f"motor_{name}")]
        start[:, place] = card[f"k_drive_{name}"] * command + card[f"o_drive_{name}"] + above
    return start


def _observe(
    schedule: RecordSchedule, rows: Array, states: Array, acting: Array, setup: Setup, rng: np.random.Generator
) -> BenchRecord:
    """What sensors make of the truth."""
    n, rate = schedule.point.size, schedule.rate
    time = np.arange(n) / rate
    commanded = dict(zip(DRIVING, rows.T, strict=True))
    truth = dict(zip(_STATES, states.T, strict=True))
    channels: dict[str, Array] = {"time": time, "point": schedule.point.astype(np.float64)}
    if schedule.bar == "free":
        for name, angle in (*((k, commanded[k]) for k in ("phi", "theta")), *((k, truth[k]) for k in _STATES[2:4])):
            channels[name] = angle + setup.angle_noise * rng.standard_normal(n)
        return BenchRecord(f"{schedule.name}.csv", schedule.procedures, channels)
    channels |= {name: commanded[name] for name in COMMANDS}
    channels["voltage"] = commanded["voltage"] + setup.voltage_noise * rng.standard_normal(n)
    for name in ("omega_lower", "omega_upper"):
        noisy = truth[name] + setup.speed_noise * rng.standard_normal(n)
        channels[name] = np.maximum(np.round(noisy / setup.speed_step) * setup.speed_step, 0.0)
    turning = [np.cumsum(truth[name]) / rate for name in ("omega_lower", "omega_upper")]
    strength = [(truth[name] / 240.0) ** 2 for name in ("omega_lower", "omega_upper")]
    for place, name in enumerate(LOADS):
        kind = "force" if name.startswith("F") else "moment"
        bias = getattr(setup, f"{kind}_bias") * rng.standard_normal()
        drift = getattr(setup, f"{kind}_drift") / 60.0 * rng.standard_normal() * time
        shaking = sum(
            s * np.sin(angle + rng.uniform(0.0, 2.0 * np.pi)) for s, angle in zip(strength, turning, strict=True)
        )
        noise = getattr(setup, f"{kind}_noise") * rng.standard_normal(n)
        channels[name] = acting[:, place] + bias + drift + getattr(setup, f"{kind}_vibration") * shaking + noise
    for name in ("airspeed_x", "airspeed_y"):
        if name in schedule.driving:
            channels[name] = commanded[name] + setup.airspeed_noise * rng.standard_normal(n)
    for name in ("bar_alpha", "bar_beta"):
        if name in schedule.driving:
            channels[name] = commanded[name]
    header = {"rotor_removed": schedule.removed} if schedule.removed else {}
    if setup.air_density is not None:
        header["air_density"] = f"{setup.air_density:g}"
    if setup.height is not None:
        header["height"] = f"{setup.height:g}"
    return BenchRecord(f"{schedule.name}.csv", schedule.procedures, channels, header)


def repeated(schedule: RecordSchedule, repeats: int) -> RecordSchedule:
    """The schedule run `repeats` times, one after the other, its points numbered through."""
    last = schedule.point.max()
    again = np.concatenate([np.where(schedule.point > 0, schedule.point + i * last, 0) for i in range(repeats)])
    driving = {name: np.tile(values, repeats) for name, values in schedule.driving.items()}
    return replace(schedule, driving=driving, point=again)
