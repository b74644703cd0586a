"""The CoaX with inflow: blades by quadrature in NumPy, heave damping by hand, climb, ground, mirrors, refusals."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import fsolve

import swashplate as sp
from swashplate.bench.virtual_bench import virtual_bench
from swashplate.engine.equations import equations_of, parameter_row
from swashplate.engine.slopes import rates_and_slopes
from swashplate.errors import BenchError, CardError
from swashplate.models.catalogue import from_card, vehicle
from swashplate.models.coax_rotors import InflowOptions, RotorPair, balanced_hover, rotor_pair
from swashplate.models.coax_vehicle import acting_at, rotor_factors
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import CasadiBackend, FloatBackend
from swashplate.physics.coaxial_wake import Induced
from swashplate.physics.environment import LABORATORY_GRAVITY, Environment
from swashplate.physics.frames import Vector

XP = FloatBackend()
FROZEN = json.loads((Path(__file__).parent / "frozen_rates.json").read_text())


@pytest.mark.parametrize("name", FROZEN)
def test_without_the_options_the_rates_are_what_they_were(name: str) -> None:
    """Frozen before rotors had any of these options; every packaged card, and some of the older options."""
    head, *said = name.split()
    options = {key: {"True": True, "False": False}.get(value, value) for key, value in (one.split("=") for one in said)}
    flown = vehicle(head, **options)
    around = Environment(1.0, -2.0, 0.5, 1.15, voltage=11.9)
    for row in FROZEN[name]:
        rates = flown.rates(row["x"], row["u"], flown.values(), around)
        np.testing.assert_allclose(rates, row["rates"], rtol=1e-12, atol=1e-12)


@pytest.fixture(scope="module")
def coax() -> Vehicle:
    return vehicle("coax", rotor="inflow")


def pair_at(flown: Vehicle, air: Vector, induced: Induced, omegas: tuple[float, float], **options: str) -> RotorPair:
    level = Vector(0.0, 0.0, -1.0)
    said = flown.options._replace(**options)
    return rotor_pair(air, (level, level), omegas, induced, (0.2, 0.14), flown.values(), 1.2, said, XP)


def by_blades(
    flown: Vehicle, side: str, omega: float, flow: float, own: float, axial: float, across: float
) -> np.ndarray:
    """Thrust [N] and torque [N m] of one rotor: lift and drag of blade elements, summed over radius and azimuth."""
    p = flown.values()
    x, weights = np.polynomial.legendre.leggauss(12)
    psi = (np.arange(24) + 0.5) * np.pi / 12.0

    def over(low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
        return 0.5 * (high - low) * x[:, None] + 0.5 * (high + low), 0.5 * (high - low) * weights[:, None]

    def mean(dr: np.ndarray, f: np.ndarray) -> float:
        return float(np.sum(dr * p.rotor_radius * f) / 24.0)

    pitch, drag = getattr(p, f"pitch_{side}"), getattr(p, f"rotor_drag_{side}")
    r, dr = over(p.root_cutout, p.tip_loss)
    tangential = omega * p.rotor_radius * r + across * np.sin(psi)
    theta = pitch + p.rotor_twist * (r - 0.75)
    lift = 0.6 * p.rotor_chord * p.rotor_lift_slope * (theta * tangential**2 - (axial + flow) * tangential)
    thrust = p.rotor_blades * mean(dr, lift + 0.0 * psi)
    r, dr = over(p.root_cutout, 1.0)
    profile = 0.6 * p.rotor_chord * drag * (omega * p.rotor_radius) ** 2 * r**3 * p.rotor_radius
    tip = omega * p.rotor_radius
    profile = p.rotor_blades * mean(dr, profile + 0.0 * psi) * (1.0 + 4.65 * (across / tip) ** 2)
    return np.array([thrust, thrust * (axial + flow + (p.induced_factor - 1.0) * own) / omega + profile])


@pytest.mark.parametrize("twist", [0.0, -0.15])
@pytest.mark.parametrize(("w", "u"), [(0.0, 0.0), (-1.0, 0.0), (0.7, 1.5)])
def test_thrust_and_torque_are_the_blades(coax: Vehicle, w: float, u: float, twist: float) -> None:
    twisted = coax.with_values({"rotor_twist": twist})
    induced, omegas = Induced(2.3, 1.6), (211.0, 231.0)
    pair = pair_at(twisted, Vector(u, 0.0, w), induced, omegas)
    on_lower, on_upper = pair.shares
    flows = 2.3 + on_upper * 1.6, 1.6 + on_lower * 2.3
    for i, side in enumerate(("upper", "lower")):
        expected = by_blades(twisted, side, omegas[i], flows[i], induced[i], -w, u)
        np.testing.assert_allclose([pair[i], pair[2 + i]], expected, rtol=1e-11)


def steady(flown: Vehicle, w: float, omegas: tuple[float, float], form: str) -> float:
    """Thrust [N] of both rotors that sink at w, by blades and momentum written here: hover's neighbourhood."""
    p = flown.values()
    s = (p.hub_height_upper - p.hub_height_lower) / p.rotor_radius
    ahead = {"vortex-tube": 1.0 / (1.0 + 2.35 * s + s * s), "contracted-wake": 0.0}.get(form, 0.0)
    area = np.pi * p.rotor_radius**2

    def shares(v: float) -> tuple[float, float]:
        if form in ("none", "coplanar"):
            return float(form == "coplanar"), float(form == "coplanar")
        gain = 2.0 - ahead
        return gain * (v - w) / (gain * v - w), ahead

    def thrusts(z: np.ndarray) -> tuple[float, float]:
        on_lower, on_upper = shares(z[0])
        return tuple(
            by_blades(flown, side, omegas[i], z[i] + (on_upper, on_lower)[i] * z[1 - i], 0.0, -w, 0.0)[0]
            for i, side in enumerate(("upper", "lower"))
        )

    def unmet(z: np.ndarray) -> list[float]:
        on_lower, on_upper = shares(z[0])
        flows = z[0] + on_upper * z[1] - w, z[1] + on_lower * z[0] - w
        return [t - 2.0 * 1.2 * area * v * f for t, v, f in zip(thrusts(z), z, flows, strict=True)]

    return sum(thrusts(fsolve(unmet, [2.4, 1.5], xtol=1e-13)))


@pytest.mark.parametrize("form", ["vortex-tube", "contracted-wake", "coplanar", "none"])
def test_heave_damping_is_that_of_momentum_theory(form: str) -> None:
    """Z_w of the model, inflow settled, against that of the equations above."""
    flown = vehicle("coax", rotor="inflow", interference=form)
    hover = balanced_hover(flown.values(), flown.options, XP)
    at = {"omega_upper": hover.omega_upper, "omega_lower": hover.omega_lower, **hover.induced._asdict()}
    row = np.array([at.get(name, 0.0) for name in flown.state_names])
    places = [flown.index(name) for name in ("w", "induced_upper", "induced_lower")]

    def rates(away: np.ndarray) -> np.ndarray:
        moved = row.copy()
        moved[places] += away
        return np.array(flown.rates(moved, (0.5, 0.5, 0.0, 0.0), flown.values(), Environment(), XP))[places]

    A = np.column_stack([(rates(1e-5 * way) - rates(-1e-5 * way)) / 2e-5 for way in np.eye(3)])
    found = A[0, 0] - A[0, 1:] @ np.linalg.solve(A[1:, 1:], A[1:, 0])
    omegas = at["omega_upper"], at["omega_lower"]
    step = 1e-4
    slope = (steady(flown, step, omegas, form) - steady(flown, -step, omegas, form)) / (2.0 * step)
    mass = flown.values().mass
    assert steady(flown, 0.0, omegas, form) == pytest.approx(mass * LABORATORY_GRAVITY, rel=1e-9)
    assert found == pytest.approx(-slope / mass, rel=1e-6)
    assert -1.5 < found < -1.05
    if form == "none":  # each by itself: 2 a sigma lam0 / (16 lam0 + a sigma), with tip loss in the blades' integral
        p, total = flown.values(), 0.0
        m1 = 0.5 * (p.tip_loss**2 - p.root_cutout**2)
        for side, omega in zip(("upper", "lower"), omegas, strict=True):
            tip = omega * p.rotor_radius
            lam0, k = at[f"induced_{side}"] / tip, p.rotor_lift_slope * p.rotor_blades * p.rotor_chord / np.pi
            k = 0.5 * k / p.rotor_radius * m1
            total += 1.2 * np.pi * p.rotor_radius**2 * tip * k * 2.0 * lam0 / (4.0 * lam0 + k)
        assert found == pytest.approx(-total / mass, rel=1e-6)


def test_the_card_hovers_as_was_measured(coax: Vehicle) -> None:
    """CoaX_Specs.txt: 2020 and 2200 rpm. Shares of thrust 55 and 45 %, torques alike."""
    hover = balanced_hover(coax.values(), coax.options, XP)
    rpm = [30.0 / np.pi * speed for speed in (hover.omega_upper, hover.omega_lower)]
    assert rpm == pytest.approx([2020.0, 2200.0], abs=0.1)
    weight = coax.values().mass * LABORATORY_GRAVITY
    assert hover.thrust_upper + hover.thrust_lower == pytest.approx(weight)
    assert hover.thrust_upper / weight == pytest.approx(0.555, abs=0.002)
    pair = pair_at(coax, Vector(0.0, 0.0, 0.0), hover.induced, (hover.omega_upper, hover.omega_lower))
    assert pair.torque_upper == pytest.approx(pair.torque_lower, rel=1e-9)
    assert max(map(abs, pair.inflow)) < 1e-4
    factors = rotor_factors(coax)
    assert factors["k_thrust_upper"] * hover.omega_upper**2 == pytest.approx(hover.thrust_upper)
    paper = vehicle("coax")
    assert rotor_factors(paper)["k_thrust_upper"] == paper.values().k_thrust_upper


def test_climbing_takes_more_motor_and_sinking_less(coax: Vehicle) -> None:
    paper = vehicle("coax")
    trims = {climb: sp.trim(coax, climb=climb).commands() for climb in (-0.5, 0.0, 0.5)}
    still = {climb: sp.trim(paper, climb=climb).commands() for climb in (-0.5, 0.5)}
    for motor in ("motor_upper", "motor_lower"):
        sinks, hovers, climbs = (trims[climb][motor] for climb in (-0.5, 0.0, 0.5))
        assert sinks + 0.01 < hovers < climbs - 0.01
        assert still[-0.5][motor] == pytest.approx(still[0.5][motor], rel=1e-9)  # why there is the option


def test_energy_of_a_climb_and_of_a_flight_across(coax: Vehicle) -> None:
    """Power less profile and uneven inflow is thrust times flow: what climbs, and what the induced flow takes."""
    smooth = coax.with_values({"rotor_drag_upper": 0.0, "rotor_drag_lower": 0.0, "induced_factor": 1.0})
    for air in (Vector(0.0, 0.0, -1.5), Vector(2.0, 1.0, 0.5)):
        omegas, induced = (211.0, 231.0), Induced(2.2, 1.5)
        pair = pair_at(smooth, air, induced, omegas)
        flows = 2.2 + pair.shares.on_upper * 1.5, 1.5 + pair.shares.on_lower * 2.2
        power = pair.torque_upper * omegas[0] + pair.torque_lower * omegas[1]
        carried = pair.thrust_upper * (flows[0] - air.z) + pair.thrust_lower * (flows[1] - air.z)
        assert power == pytest.approx(carried, rel=1e-12)


def test_forward_flight_is_the_same_in_every_direction(coax: Vehicle) -> None:
    pairs = [
        pair_at(coax, Vector(2.0 * np.cos(psi), 2.0 * np.sin(psi), -0.3), Induced(2.2, 1.5), (211.0, 231.0))
        for psi in (0.0, 1.0, np.pi, 5.0)
    ]
    for pair in pairs[1:]:
        np.testing.assert_allclose(pair[:4], pairs[0][:4], rtol=1e-12)
    assert pairs[0].thrust_upper > pair_at(coax, Vector(0.0, 0.0, -0.3), Induced(2.2, 1.5), (211.0, 231.0)).thrust_upper


@pytest.mark.parametrize("form", ["cheeseman-bennett", "hayden"])
def test_ground_makes_thrust(coax: Vehicle, form: str) -> None:
    """The CoaX stands with its rotors a little above half a radius; a flight across leaves the cushion behind."""
    induced, omegas = Induced(2.37, 1.53), (211.5, 230.4)
    free = pair_at(coax, Vector(0.0, 0.0, 0.0), induced, omegas)
    near = pair_at(coax, Vector(0.0, 0.0, 0.0), induced, omegas, ground_effect=form)
    assert near.thrust_upper > 1.01 * free.thrust_upper
    assert near.thrust_lower / free.thrust_lower > near.thrust_upper / free.thrust_upper
    flying, away = (
        pair_at(coax, Vector(8.0, 0.0, 0.0), induced, omegas, ground_effect=each) for each in ("none", form)
    )
    assert 1.0 < away.thrust_lower / flying.thrust_lower < 1.0 + 0.5 * (near.thrust_lower / free.thrust_lower - 1.0)


def test_a_hover_near_the_ground_takes_less_motor() -> None:
    near = vehicle("coax", rotor="inflow", ground_effect="cheeseman-bennett")
    low, high = (sp.trim(near, height=height).commands() for height in (0.05, 3.0))
    free = balanced_hover(near.values(), near.options, XP)
    assert low["motor_lower"] < high["motor_lower"] - 0.005
    full = near.values().k_drive_lower, near.values().o_drive_lower
    assert full[0] * high["motor_lower"] + full[1] == pytest.approx(free.omega_lower, rel=1e-3)


def test_rotors_that_stand_still_do_nothing(coax: Vehicle) -> None:
    pair = pair_at(coax, Vector(0.0, 0.0, 0.0), Induced(0.0, 0.0), (0.0, -1.0))
    assert pair[:4] == (0.0, 0.0, 0.0, 0.0)
    assert tuple(pair.inflow) == (0.0, 0.0)


def test_doubts_and_power(coax: Vehicle) -> None:
    hover = sp.trim(coax)
    calm = hover.environment
    assert coax.traits.doubts is not None
    assert coax.traits.power is not None
    assert coax.traits.doubts(coax, hover.state, hover.inputs, calm) == {}
    speeds = hover.states()
    expected = sum(
        acting_at(coax, hover.state, hover.inputs, calm).torque[i] * speeds[f"omega_{side}"]
        for i, side in enumerate(("upper", "lower"))
    )
    assert coax.traits.power(coax, hover.state, hover.inputs, calm) == pytest.approx(expected)
    assert 18.0 < expected < 23.0  # W at the shafts; the battery gives about twice that
    sinking = np.array(hover.state)
    sinking[coax.index("w")] = 3.0
    assert "vortex ring" in coax.traits.doubts(coax, sinking, hover.inputs, calm)
    for name in ("omega_upper", "omega_lower"):  # it settles on the ground: no lift, no wake, no "0.0 m/s"
        sinking[coax.index(name)] = 1.0
    sinking[coax.index("w")] = 0.02
    assert coax.traits.doubts(coax, sinking, hover.inputs, calm) == {}
    steep = coax.with_values({"pitch_upper": 0.5})
    assert "stall upper" in coax.traits.doubts(steep, hover.state, hover.inputs, calm)


def test_what_does_not_fit_is_refused(coax: Vehicle) -> None:
    with pytest.raises(CardError, match="rotor: is 'momentum', expected one of 'paper', 'inflow'"):
        vehicle("coax", rotor="momentum")
    with pytest.raises(CardError, match="interference: needs rotors with inflow"):
        vehicle("coax", interference="coplanar")
    with pytest.raises(CardError, match="ground_effect: is 'yes', expected one of 'none', 'cheeseman-bennett'"):
        vehicle("coax", rotor="inflow", ground_effect="yes")
    with pytest.raises(CardError, match="rotors: is not an option"):
        vehicle("coax", rotors="inflow")
    lacking = {name: entry for name, entry in coax.card.parameters.items() if name != "rotor_chord"}
    with pytest.raises(CardError, match="rotor_chord: is missing, and rotor = 'inflow' needs it"):
        from_card(replace(coax.card, parameters=lacking))
    paper = from_card(replace(vehicle("coax").card, parameters=lacking))  # the paper's rotors do without
    assert "rotor_lift_slope" not in paper.parameter_names
    for name, value in (("tip_loss", 0.5), ("rotor_chord", 0.0), ("induced_factor", 0.9), ("hub_height_upper", 0.05)):
        wrong = replace(coax.card.parameters[name], value=value, lower=None, upper=None)
        with pytest.raises(CardError, match=f"{name}: is "):
            from_card(replace(coax.card, parameters={**coax.card.parameters, name: wrong}))
    with pytest.raises(BenchError, match="has rotors with inflow"):
        virtual_bench(coax, ())


def test_a_saved_model_flies_again(coax: Vehicle, tmp_path: Path) -> None:
    coax.save(tmp_path / "model.toml")
    again = vehicle(tmp_path / "model.toml")
    assert again.options == InflowOptions()
    assert again.values() == coax.values()


ALL = {"tip_loss": True, "induced_factor": True, "ground_effect": "hayden"}


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("coax", {"rotor": "inflow", "ground_effect": "hayden"}),
        ("coax", {"rotor": "inflow", "interference": "contracted-wake", "bar": False}),
        ("raptor50", ALL),
        ("raptor50", {"inflow": "pitt-peters", **ALL}),
    ],
)
def test_floats_and_casadi_compute_the_same(name: str, options: dict[str, object]) -> None:
    casadi = pytest.importorskip("casadi")
    flown, rng = vehicle(name, **options), np.random.default_rng(0)
    x = 0.1 * rng.normal(size=len(flown.state_names))
    x[2] = -0.2
    for i, state in enumerate(flown.state_names):
        x[i] += {"omega": 220.0, "induc": 2.0}.get(state[:5], 0.0)
    u = [0.5 * (low + high) for low, high in flown.input_limits]
    floats = flown.rates(x, u, flown.values())
    row = casadi.SX.sym("x", len(x))
    traced = casadi.Function("f", [row], [casadi.vertcat(*flown.rates(row, u, flown.values(), xp=CasadiBackend()))])
    np.testing.assert_allclose(np.array(traced(x)).ravel(), floats, rtol=1e-11, atol=1e-11)


def test_slopes_are_finite_where_everything_stands_still() -> None:
    flown = vehicle("coax", rotor="inflow", ground_effect="cheeseman-bennett")
    x, w, p = np.zeros(len(flown.state_names)), np.zeros(8), parameter_row(flown, Environment())
    assert np.all(np.isfinite(rates_and_slopes(equations_of(flown), x, w, p)[1]))
