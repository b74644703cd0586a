"""What the CoaX says of its balance, its asymmetries, and cards that were written before them."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

import swashplate as sp
from swashplate.control.laws.decoupling import decouple, decoupler
from swashplate.errors import IdentificationError
from swashplate.filtering.disturbances import SEPARATE, Noise, unrest_of
from swashplate.identification.core.parameters import parameterize
from swashplate.models.catalogue import from_card
from swashplate.models.coax_vehicle import balance
from swashplate.physics.backend import FloatBackend
from swashplate.physics.swashplate import swashplate_tilt
from swashplate.reporting.words import noise_told

XP = FloatBackend()
ASYMMETRIES = ("linkage_asymmetry_lower", "phase_asymmetry_lower", "linkage_asymmetry_upper")


def test_what_balances_the_yaw_is_told() -> None:
    coax = sp.vehicle("coax")
    card = coax.card.values()
    assert balance(coax, coax, {}) == ()
    # All of it by the torque: at the hover of 1.07 times the upper torque, 7 % of that torque is what was missing.
    found = coax.with_values({"k_torque_upper": 1.07 * card["k_torque_upper"]})
    upper = sp.trim(found).states()["omega_upper"]
    missing = -0.07 * card["k_torque_upper"] * upper**2 / card["inertia_zz"]
    (told,) = balance(coax, found, {})
    assert f"leave {missing:+.1f} rad/s^2 of yaw" in told
    assert "k_torque_upper +7.0 %" in told
    # All of it by trims: the factors have nothing to do.
    (told,) = balance(coax, coax, {"trim_motor_upper": 0.01})
    assert "+0.0 and +0.00 with the motor trims" in told
    assert "none moved" in told


@pytest.mark.parametrize("mixing", ["rotation", "as_printed"])
def test_the_law_undoes_servos_that_differ(mixing: str) -> None:
    coax = sp.vehicle("coax").with_values({"linkage_asymmetry_lower": 0.2, "phase_asymmetry_lower": -0.15})
    card, hover = coax.card.values(), sp.trim(coax)
    law = decoupler(coax, hover, lag=0.3, speed=False, mixing=mixing)  # type: ignore[arg-type]
    roll, pitch = decouple(law, 0.3, -0.2, u=0.0, v=0.0, motor_lower=0.5, voltage=12.0, xp=XP)
    how = {"linkage": card["linkage_lower"], "lag": 0.3, "mixing": mixing, "xp": XP}
    tilt = swashplate_tilt(roll, pitch, linkage_asymmetry=0.2, phase_asymmetry=-0.15, **how)
    assert tilt.alpha == pytest.approx(0.3 * card["linkage_lower"])
    assert tilt.beta == pytest.approx(0.2 * card["linkage_lower"])
    plain = swashplate_tilt(roll, pitch, **how)
    assert math.hypot(plain.alpha - tilt.alpha, plain.beta - tilt.beta) > 0.01 * card["linkage_lower"]


def test_an_older_card_is_symmetric() -> None:
    card = sp.vehicle("coax").card
    older = replace(card, parameters={n: p for n, p in card.parameters.items() if n not in ASYMMETRIES})
    flown = from_card(older)
    assert all(flown.values()._asdict()[name] == 0.0 for name in ASYMMETRIES)


def test_trims_and_noise_of_its_own_stand_beside_the_parameters() -> None:
    table = parameterize(sp.vehicle("coax"), "asymmetric", priors={"trim_motor_upper": (0.0, 0.002)})
    assert {"k_torque_upper", *ASYMMETRIES} <= set(table.names)
    assert [(free.name, free.sigma) for free in table.of_records] == [
        ("trim_motor_upper", 0.002),
        ("trim_motor_lower", 0.007),
    ]
    assert set(table.noises) == set(SEPARATE) - {"sensor_heading"}  # the cameras' own
    moved = table.identified(table.starts())
    assert moved["k_thrust_lower"] / moved["k_thrust_upper"] == pytest.approx(3.1531e-5 / 2.2607e-5, rel=1e-9)
    with pytest.raises(IdentificationError, match="no parameter is free"):
        parameterize(sp.vehicle("coax"), ["drift_yaw"])
    with pytest.raises(IdentificationError, match="no such parameter"):
        parameterize(sp.vehicle("raptor50"), ["hub_stiffness", "trim_motor_upper"])


def test_noise_of_its_own_is_told_and_used() -> None:
    shared = {name: float(value) for name, value in Noise()._asdict().items()}
    assert not set(SEPARATE) & set(noise_told(shared))
    own = shared | {"tau_gust_yaw": 2.0}
    assert "tau_gust_yaw" in noise_told(own)
    card = sp.vehicle("coax").card
    plain, apart = (unrest_of(replace(card, observer={"noise": noise})) for noise in (shared, own))
    assert apart.moment_yaw == pytest.approx(plain.moment_yaw * math.sqrt(2.0 / shared["tau_gust_moment"]))
    assert apart.moment == plain.moment
