"""Stitched models against equations with a known answer, on plain floats: nothing is compiled here."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import fsolve

from swashplate.api.verbs.vehicle import stitch
from swashplate.arrays import Array
from swashplate.errors import CardError, SwashError
from swashplate.flights.flight import Flight
from swashplate.models.catalogue import from_card, vehicle
from swashplate.models.doubts import doubts
from swashplate.models.linear.matrices_file import state_space_of_matrices
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import parse, to_toml
from swashplate.models.linear.stitched import StitchedVehicle, disagreement
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Vector
from swashplate.physics.rigid_body import BODY_UNITS, Inertia, RigidBody, gravity, rigid_body_rates

INPUTS = ("lateral", "longitudinal", "pedal", "collective")
STATES = (*RigidBody._fields, "a")
UNITS = dict(zip((*STATES, *INPUTS), (*BODY_UNITS, "rad", *("1",) * 4), strict=True))
SPEEDS = (0.0, 6.0, 12.0, 18.0)
U, V, W, PHI, THETA, A = (STATES.index(name) for name in ("u", "v", "w", "phi", "theta", "a"))


def truth(x: Array, u: Array) -> Array:
    """A helicopter of polynomials: damping that grows with speed, a power bucket, flapping that comes late."""
    b = RigidBody(*x[:12])
    lat, lon, ped, col = u
    lift = (
        9.81 * (1.0 + 0.9 * (col - 0.5) * (1.0 + 0.04 * b.u) + 0.03 * b.u - 0.0015 * b.u**2) - (0.5 + 0.05 * b.u) * b.w
    )
    felt = Vector(
        -0.03 * b.u - 0.004 * b.u**2 + 0.02 * b.w - 3.0 * x[A],
        -0.05 * b.v - 0.01 * b.u * b.v + 0.4 * ped + 0.2 * lat,
        -lift,
    )
    turned = Vector(
        -3.0 * b.p - 0.04 * b.v + 12.0 * lat + 0.2 * col,
        -1.5 * b.q + 0.01 * b.u - 0.0004 * b.u**2 + 0.02 * b.w + 25.0 * x[A],
        -(0.8 + 0.05 * b.u) * b.r + (0.02 + 0.005 * b.u) * b.v + 6.0 * ped - 1.5 * col + 0.02 * b.u,
    )
    force = felt + gravity(1.0, 9.81, b.attitude, FloatBackend())
    body = rigid_body_rates(b, force, turned, Inertia(1.0, 1.0, 1.0, 1.0), FloatBackend())
    return np.array([*body, (0.3 * lon - 0.002 * b.u - 0.1 * b.q - x[A]) / 0.1])


def trimmed(speed: float) -> tuple[Array, Array]:
    """State and inputs of level flight, by another route than the package's."""

    def rows(z: Array) -> tuple[Array, Array]:
        x = np.zeros(13)
        x[[PHI, THETA, A]] = z[0], z[1], z[2]
        st, ct, sf, cf = np.sin(z[1]), np.cos(z[1]), np.sin(z[0]), np.cos(z[0])
        x[[U, V, W]] = speed * ct, speed * sf * st, speed * cf * st
        return x, z[3:]

    places = [3, 4, 5, 9, 10, 11, 12]
    z = fsolve(lambda z: truth(*rows(z))[places], np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 0.5]), xtol=1e-13)
    x, u = rows(z)
    assert np.max(np.abs(truth(x, u)[places])) < 1e-9
    return x, u


def slopes(rates: Any, x: Array, u: Array) -> tuple[Array, Array]:
    """Jacobians by central differences."""
    h = 1e-5
    A_ = [(rates(x + h * e, u) - rates(x - h * e, u)) / (2 * h) for e in np.eye(x.size)]
    B_ = [(rates(x, u + h * e) - rates(x, u - h * e)) / (2 * h) for e in np.eye(u.size)]
    return np.array(A_).T, np.array(B_).T


def point(speed: float, **changes: float) -> StateSpaceModel:
    """The linear model at a speed; `changes` go to entries such as q_by_u."""
    x, u = trimmed(speed)
    matrices = slopes(truth, x, u)
    matrices[0][np.abs(matrices[0]) < 1e-8] = 0.0
    made = state_space_of_matrices(
        matrices,
        states=STATES,
        inputs=INPUTS,
        units=UNITS,
        trim=dict(zip((*STATES, *INPUTS), (*x, *u), strict=True)) | {"air_density": 1.2},
        limits={"collective": (0.0, 1.0)},
        delays={},
        name="point",
        title="a point",
    )
    return made.with_values(changes)


@pytest.fixture(scope="module")
def points() -> list[StateSpaceModel]:
    return [point(speed) for speed in SPEEDS]


@pytest.fixture(scope="module")
def stitched(points: list[StateSpaceModel]) -> StitchedVehicle:
    made = stitch(points)
    assert isinstance(made, StitchedVehicle)
    return made


def rates(made: Vehicle, x: Array, u: Array, environment: Environment | None = None) -> Array:
    return np.array(made.rates(x, u, made.values(), environment or Environment()))


@pytest.mark.parametrize("speed", SPEEDS[1:3])
def test_at_a_point_it_is_the_point(stitched: StitchedVehicle, speed: float) -> None:
    """At rest, and with the point's own matrices, those by speed included, which nowhere stand in it."""
    x, u = trimmed(speed)
    np.testing.assert_allclose(rates(stitched, x, u)[3:6], truth(x, u)[3:6], atol=1e-9)
    for found, wanted in zip(slopes(lambda a, b: rates(stitched, a, b), x, u), slopes(truth, x, u), strict=True):
        np.testing.assert_allclose(found, wanted, atol=2e-5)


def test_at_the_ends_slopes_are_the_points_from_both_sides(stitched: StitchedVehicle) -> None:
    for speed in (SPEEDS[0], SPEEDS[-1]):
        x, u = trimmed(speed)
        step = np.zeros(13)
        step[U] = 1e-6
        for sign in (-1.0, 1.0):
            found = sign * (rates(stitched, x + sign * step, u) - rates(stitched, x, u)) / 1e-6
            wanted = sign * (truth(x + sign * step, u) - truth(x, u)) / 1e-6
            np.testing.assert_allclose(found, wanted, atol=1e-4)


@pytest.mark.parametrize("speed", [3.0, 9.0, 15.0])
def test_between_points_trims_and_accelerations_are_near_the_truth(stitched: StitchedVehicle, speed: float) -> None:
    """Errors of the third order in the points' distance; differences of the trims make larger ones."""
    x, u = trimmed(speed)
    assert np.max(np.abs(rates(stitched, x, u)[3:6])) < 0.02
    rng = np.random.default_rng(2)
    size = np.array([0, 0, 0, 0.5, 0.5, 0.5, 0.1, 0.1, 0, 0.1, 0.1, 0.1, 0.01])
    moved = [(x + size * rng.standard_normal(13), u + 0.02 * rng.standard_normal(4)) for _ in range(50)]
    error = np.array([rates(stitched, *m) - truth(*m) for m in moved])[:, 3:]
    scale = np.array([truth(*m) for m in moved])[:, 3:].std(axis=0)
    assert np.max(error.std(axis=0) / np.maximum(scale, 1e-9)) < 0.05


def test_speed_derivatives_are_not_counted_twice() -> None:
    """With gradients from the trims, what the points say of speed acts nowhere between them."""
    plain = stitch([point(speed) for speed in SPEEDS], gradients="trims")
    wrong = stitch([point(s, q_by_u=0.3, u_by_u=-0.9) for s in SPEEDS], gradients="trims")
    x, u = trimmed(9.0)
    x = x + 0.1
    np.testing.assert_array_equal(rates(plain, x, u), rates(wrong, x, u))
    beyond = np.array(x)
    beyond[U] = 25.0
    assert np.max(np.abs(rates(plain, beyond, u) - rates(wrong, beyond, u))) > 1.0


def test_it_says_where_speed_derivatives_and_trims_disagree(stitched: StitchedVehicle) -> None:
    agreed = disagreement(stitched.points()[1])
    assert all(given == pytest.approx(implied, abs=1e-5) for given, implied in agreed.values())
    wrong = stitch([point(s, q_by_u=0.3) for s in SPEEDS], gradients="trims")
    assert isinstance(wrong, StitchedVehicle)
    given, implied = disagreement(wrong.points()[1])["M_u"]
    assert given == pytest.approx(0.3)
    assert abs(implied - agreed["M_u"][0]) < 0.01
    rows = [line.split() for line in repr(wrong).splitlines()]
    told = [row for row in rows if {"point", "trims"} & set(row[:2])]
    assert (told[2][-2], told[3][-2]) == ("0.3", f"{implied:.3g}")


def test_identified_points_take_the_gradients_of_their_trims(points: list[StateSpaceModel]) -> None:
    entry = next(iter(points[0].parameters))
    fitted = replace(
        points[0], parameters={**points[0].parameters, entry: replace(points[0].parameters[entry], cramer_rao=0.1)}
    )
    assert "differences of the trims" in stitch([fitted, *points[1:]]).card.trust
    assert "own derivatives" in stitch(points).card.trust


def test_files_hold_all_of_it(stitched: StitchedVehicle, points: list[StateSpaceModel], tmp_path: Path) -> None:
    stitched.save(tmp_path / "stitched.toml")
    again = vehicle(tmp_path / "stitched.toml")
    assert again.card.to_document() == stitched.card.to_document()
    files = []
    for k, one in enumerate(reversed(points)):  # in any order
        files.append(tmp_path / f"{k}.toml")
        files[-1].write_text(to_toml(one))
    assert stitch(files).card.values() == stitched.card.values()
    assert stitched.input_limits[3] == pytest.approx((0.0, 1.0))
    assert "longitudinal 1, pedal 1 either way" in stitched.card.trust


def test_wind_is_air_speed(stitched: StitchedVehicle) -> None:
    """Towards the south at 5 m/s, hovering over ground is flight at 5 m/s but for gravity and place."""
    x, u = trimmed(5.0)
    standing = np.array(x)
    north = 5.0
    standing[[U, V, W]] = 0.0
    found = rates(stitched, standing, u, Environment(wind_north=-north))
    np.testing.assert_allclose(found[3:], rates(stitched, x, u)[3:], atol=1e-12)


def test_beyond_the_points_it_holds_and_says_so(stitched: StitchedVehicle) -> None:
    x, u = trimmed(18.0)
    x[U] += 4.0
    told = doubts(stitched, x, u, Environment(air_density=1.225))
    assert len(told) == 1
    assert "outside the points, 0.0 to" in told[0]
    assert "1.0 kg/m^3" not in told[0]
    assert doubts(stitched, *trimmed(9.0), Environment(air_density=1.225)) == ()
    assert "not scaled" in doubts(stitched, *trimmed(9.0), Environment(air_density=1.0))[0]


def test_means_of_flights_are_trims(points: list[StateSpaceModel], stitched: StitchedVehicle) -> None:
    bare = [replace(one, document={k: v for k, v in one.document.items() if k != "trim"}) for one in points]
    flown = []
    wobble = 0.1 * np.sin(np.linspace(0.0, 2.0 * np.pi, 100, endpoint=False))
    for speed in SPEEDS:
        x, u = trimmed(speed)
        named = dict(zip((*STATES, *INPUTS), (*x, *u), strict=True))
        flown.append(Flight.from_arrays(np.arange(100) / 50.0, {k: v + wobble for k, v in named.items() if k != "a"}))
    made = stitch(bare, trim=flown, gradients="derivatives")
    assert "a counts from its trim" in made.card.trust
    assert made.card.parameters["trim_theta_2"].value == pytest.approx(stitched.card.parameters["trim_theta_2"].value)
    short = [replace(f, streams={k: s.drop_vars("w") for k, s in f.streams.items()}) for f in flown]
    with pytest.raises(SwashError, match="has no w, whose means"):
        stitch(bare, trim=short)
    with pytest.raises(SwashError, match="1 given for 4 points"):
        stitch(bare, trim=flown[:1])


def _without(model: StateSpaceModel, *names: str) -> StateSpaceModel:
    trim = {k: v for k, v in model.document["trim"].items() if k not in names}
    return replace(model, document={**model.document, "trim": trim})


def _told(model: StateSpaceModel, **trim: float) -> StateSpaceModel:
    told = {k: repr(v) for k, v in trim.items()}
    return replace(model, document={**model.document, "trim": {**model.document["trim"], **told}})


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: p[:1], "1 given, expected two or more"),
        (lambda p: [p[0], p[1], p[1]], "trim.u: is 5.997 m/s, as that of"),
        (lambda p: [p[0], _without(p[1], "theta", "pedal")], "trim: says nothing of theta, pedal"),
        (lambda p: [p[0], _without(p[1], "a")], "says nothing of a, and other points do"),
        (lambda p: [p[0], _told(p[1], theta=0.6)], "expected level flight ahead"),
        (lambda p: [p[0], _told(p[1], u=6.0, w=0.0, v=0.0, phi=0.5, theta=0.0)], "from the gravity at its trim's"),
        (lambda p: [p[0], _told(p[1], r=0.2)], "trim.r: is not zero"),
        (lambda p: [p[0], _told(p[1], air_density=1.0)], "are 1, 1.2 kg/m^3, expected one"),
        (lambda p: [p[0], p[1].with_values({"theta_by_q": 57.3})], "theta: moves with q by 57.3, kinematics say"),
        (lambda p: [p[0], parse(to_toml(p[1]).replace('\na = "rad"', '\na = "deg"'))], "a: is in deg; that of"),
    ],
)
def test_what_cannot_be_stitched(points: list[StateSpaceModel], change: Any, words: str) -> None:
    with pytest.raises(CardError, match=re.escape(words)):
        stitch(change(points))


def test_other_states_and_places_are_refused(points: list[StateSpaceModel]) -> None:
    document = {k: v for k, v in points[1].document.items() if k != "trim"}
    kept = [name for name in points[1].states if name != "a"]
    other = replace(points[1], states=tuple(kept), document=document)
    with pytest.raises(CardError, match="states: are u, v, w"):
        stitch([points[0], other])
    x, u = trimmed(6.0)
    matrices = slopes(truth, x, u)
    matrices[0][STATES.index("w"), STATES.index("z")] = 0.3
    near_ground = state_space_of_matrices(
        matrices, states=STATES, inputs=INPUTS, units=UNITS, trim={}, limits={}, delays={}, name="near", title="near"
    )
    with pytest.raises(CardError, match="z: moves w: a stitched model knows no place"):
        stitch([near_ground, near_ground])


def test_a_card_out_of_order_is_refused(stitched: StitchedVehicle) -> None:
    card = stitched.card
    with pytest.raises(CardError, match="expected ascending speeds"):
        from_card(card.with_values({"trim_u_1": 30.0}))
    with pytest.raises(CardError, match="expected two or more"):
        from_card(replace(card, options={**card.options, "points": 1}))
    with pytest.raises(CardError, match="has 1 entries, expected"):
        from_card(replace(card, options={**card.options, "high": [1.0]}))
    lost = {name: p for name, p in card.parameters.items() if name != "gradient_theta_2"}
    with pytest.raises(CardError, match="gradient_theta_2: is missing"):
        from_card(replace(card, parameters=lost))


def test_derivatives_that_leave_the_gradients_open_are_refused(points: list[StateSpaceModel]) -> None:
    silent = {name: 0.0 for name in points[0].parameters if name.endswith("_by_collective")}
    mute = [one.with_values({k: v for k, v in silent.items() if k in one.parameters}) for one in points]
    with pytest.raises(CardError, match="leaves open how its trim changes"):
        stitch(mute)
    assert stitch(mute, gradients="trims").card.options["points"] == 4
