"""The height-velocity diagram: energy of a landing, what makes the avoided region larger, the verb and its refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import swashplate as sp
from swashplate.cli.app import app
from swashplate.errors import SwashError
from swashplate.models.surroundings import environment_of
from swashplate.simulation import engine_failure
from swashplate.simulation.engine_failure import Landing, PointMass, point_mass, power, steady
from swashplate.simulation.height_velocity import HeightVelocity, height_velocity

RAPTOR = sp.vehicle("raptor50")
SPEEDS, HEIGHTS = (0.0, 4.0), tuple(np.geomspace(0.4, 40.0, 9))


@pytest.fixture(scope="module")
def p() -> PointMass:
    return point_mass(RAPTOR, environment_of(RAPTOR))


@pytest.fixture(scope="module")
def usual() -> HeightVelocity:
    return height_velocity(RAPTOR, speeds=SPEEDS, heights=HEIGHTS)


def test_level_flight_takes_the_power_of_the_vehicles_own_trim(p: PointMass) -> None:
    """Main rotor's power of the point mass beside shaft power of the whole equations, whose tail rotor takes some."""
    thrust, taken = power(p, steady(p, np.full(1, 6.0), np.ones(1)))
    curve = sp.trim_curve(RAPTOR, (6.0,))
    whole = curve.power(curve.trims[0])
    assert thrust[0] == pytest.approx(p.mass * p.gravity, rel=0.01)
    assert 0.75 * whole < taken[0] < whole


def test_a_descent_of_the_autorotation_needs_no_power(p: PointMass) -> None:
    """Where the whole equations autorotate, the point mass gives what the tail rotor takes there: some of hover's."""
    descent = sp.trim_curve(RAPTOR, (8.0,), autorotation=True).trims[0]
    still = np.ones(1)
    induced = still
    for _ in range(50):
        induced = 0.5 * (induced + p.hover**2 / np.hypot(8.0, induced + descent.climb))
    hover = power(p, steady(p, 0.0 * still, still))[1]
    air = Landing(still, 8.0 * still, -descent.climb * still, p.rotor_speed * still, induced, *(0.0 * still,) * 3)
    carrying = engine_failure._pitch_for(
        p,
        engine_failure._air(p, air),
        p.mass * p.gravity / (p.density * p.area * (p.rotor_speed * p.radius) ** 2),
    )
    assert -0.2 * hover[0] < power(p, air._replace(pitch=carrying))[1][0] < 0.0


def test_height_speed_and_rotor_pay_for_what_the_air_takes(p: PointMass) -> None:
    """Potential, kinetic and rotor energy fall by exactly what induced flow, profile and fuselage have taken."""
    now = steady(p, np.array([0.0, 5.0]), np.array([30.0, 30.0]))

    def energy(at: Landing) -> np.ndarray:
        moving = 0.5 * p.mass * (at.ahead**2 + at.sink**2) + 0.5 * p.inertia * at.omega**2
        return np.asarray(p.mass * p.gravity * at.height + moving)

    begun, dt = energy(now), engine_failure.step_length(p) / 20.0
    for k in range(400):
        now = now._replace(tilt=now.tilt + 0.2 * dt, pitch=now.pitch - (0.05 * dt if k < 200 else -0.08 * dt))
        now = engine_failure.moved(p, now, dt)
    assert (begun - energy(now) > 0.1 * begun * 0.1).all()
    np.testing.assert_allclose(begun - energy(now), now.lost, rtol=2e-3)


def test_inertia_shrinks_the_avoided_region_and_weight_grows_it(usual: HeightVelocity) -> None:
    assert usual.low_hover < usual.high_hover
    assert usual.hover_to_avoid[0][0] == pytest.approx(usual.low_hover)
    assert usual.hover_to_avoid[-1][1] == pytest.approx(usual.high_hover)
    assert not usual.safe[4, 0]  # some metres up, at rest
    assert usual.safe[-1].all()
    numbers = RAPTOR.card.values()

    def other(**values: float) -> HeightVelocity:
        return height_velocity(RAPTOR.with_values(values), speeds=SPEEDS, heights=HEIGHTS)

    heavier, spinning = other(mass=1.3 * numbers["mass"]), other(rotor_inertia=2.0 * numbers["rotor_inertia"])
    assert spinning.margin[:, 0].max() < usual.margin[:, 0].max() < heavier.margin[:, 0].max()
    assert spinning.avoided < usual.avoided < heavier.avoided
    assert spinning.high_hover < usual.high_hover < heavier.high_hover


def test_a_pilot_who_acts_at_once_needs_less(usual: HeightVelocity) -> None:
    quick = height_velocity(RAPTOR, delay=0.0, speeds=SPEEDS, heights=HEIGHTS)
    assert quick.high_hover < usual.high_hover
    assert quick.avoided < usual.avoided


def test_no_landing_with_no_sink_and_every_landing_without_limits(usual: HeightVelocity) -> None:
    """The verdict can say both: nothing lands without any sink, and everything lands where anything is allowed."""
    assert replace(usual, margin=usual.margin + 10.0).safe.sum() == 0
    none = height_velocity(RAPTOR, sink=1e-3, speeds=SPEEDS, heights=HEIGHTS[:2])
    assert none.low_hover == 0.0
    assert np.isnan(none.high_hover)
    free = height_velocity(RAPTOR, sink=60.0, run=60.0, delay=0.0, speeds=SPEEDS, heights=HEIGHTS)
    assert free.safe.all()
    assert free.low_hover == pytest.approx(HEIGHTS[-1])
    assert free.hover_to_avoid == ()
    assert none.hover_to_avoid == ((HEIGHTS[0], HEIGHTS[1]),)


def test_it_tells_shows_and_refuses(usual: HeightVelocity) -> None:
    assert "does nothing for 1 s" in repr(usual)
    assert usual.figures == ("height-velocity",)
    assert usual.as_dict()["high_hover"] == usual.high_hover
    assert usual.page().title.startswith("Height-velocity diagram of Thunder Tiger")
    with pytest.raises(SwashError, match="single-rotor"):
        height_velocity(sp.vehicle("coax"))
    with pytest.raises(SwashError, match="delay: is -1, expected 0 to 60"):
        height_velocity(RAPTOR, delay=-1.0)
    with pytest.raises(SwashError, match=r"heights: are \[3.0, 1.0\], expected two or more, ascending"):
        height_velocity(RAPTOR, heights=[3.0, 1.0])
    result = CliRunner().invoke(app, ["height-velocity", "coax"])
    assert result.exit_code == 2
