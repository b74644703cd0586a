"""Which parameters move: ready choices, ties in any order, priors, bounds, and everything that cannot be meant."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.errors import ExpressionError, IdentificationError
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.parameters import Free, Parameterization, parameterize
from swashplate.identification.time.filter_error import parameter_entries
from swashplate.models.catalogue import vehicle
from swashplate.models.coax_choices import CHOICES
from swashplate.models.vehicle import Vehicle


@pytest.fixture(scope="module")
def coax() -> Vehicle:
    return vehicle("coax")


def test_the_papers_six_are_a_choice(coax: Vehicle) -> None:
    """Fankhauser et al., sec. IV-B, with the symmetry that makes three more of them."""
    table = parameterize(coax, "flight")
    assert set(table.names) == {"a_alpha_v", "a_alpha_u", "a_alpha_p", "tau_f_upper", "o_zeta_upper", "o_zeta_lower"}
    moved = table.identified([0.01, 0.02, 0.03, 1.0, -0.1, 0.1])
    assert (moved["a_beta_u"], moved["a_beta_v"], moved["a_beta_q"]) == (0.01, 0.02, 0.03)
    values = table.layout.values(table.card_row, np.array([0.01, 0.02, 0.03, 1.0, -0.1, 0.1]))
    assert (values.a_beta_u, values.tau_f_upper, values.mass) == (0.01, 1.0, coax.card.values()["mass"])


@pytest.mark.parametrize("name", CHOICES)
def test_every_choice_starts_inside_what_physics_allows(coax: Vehicle, name: str) -> None:
    table = parameterize(coax, name)
    low, high = table.bounds()
    assert np.all(low <= table.starts())
    assert np.all(table.starts() <= high)
    assert all(free.scale > 0.0 for free in table.free)
    assert all(free.source for free in table.free if free.sigma is not None)


def test_a_choice_sets_the_switches_that_it_needs(coax: Vehicle) -> None:
    assert coax.card.values()["bar_heading_transport"] == 0.0
    table = parameterize(coax, "full")
    assert table.vehicle.card.values()["bar_heading_transport"] == 1.0
    assert table.switches == {"set by the choice": ["choice 'full' sets bar_heading_transport = 1 (card: 0)"]}
    assert parameterize(table.vehicle, "full").switches == {}
    assert parameterize(coax, "full", fixed={"bar_heading_transport": 0.0}).switches == {}
    assert parameterize(coax, "flight").switches == {}


def test_a_name_alone_is_free_without_a_prior(coax: Vehicle) -> None:
    for table in (parameterize(coax, "mass"), parameterize(coax, ["mass"])):
        assert table.names == ("mass",)
        assert table.starts() == [coax.card.values()["mass"]]
    assert parameterize(coax, ["tau_f_upper"]).free[0].sigma is None
    assert parameterize(coax, ["drag_z"]).free[0].scale > 0.0  # the card says zero


def test_ties_may_stand_in_any_order(coax: Vehicle) -> None:
    """A chain gives the same numbers whichever link is written first."""
    chain = ["a_beta_q = a_beta_v / 2", "a_beta_v = 3 * a_beta_u", "a_beta_u = a_alpha_u + 0.001"]
    for texts in (chain, chain[::-1], [chain[1], chain[2], chain[0]]):
        moved = parameterize(coax, ["a_alpha_u"], ties=texts).identified([0.01])
        assert [moved[name] for name in ("a_beta_u", "a_beta_v", "a_beta_q")] == pytest.approx([0.011, 0.033, 0.0165])


def test_a_tie_may_use_what_is_fixed(coax: Vehicle) -> None:
    table = parameterize(coax, ["tau_f_upper"], ties=["mass = tau_f_lower * 4"], fixed={"tau_f_lower": 0.1})
    assert table.identified([1.0])["mass"] == pytest.approx(0.4)


def test_what_the_user_says_replaces_what_the_choice_says(coax: Vehicle) -> None:
    moved = parameterize(coax, "flight", ties=["a_beta_u = 2 * a_alpha_v"]).identified([0.01, *[0.02] * 5])
    assert moved["a_beta_u"] == 0.02
    table = parameterize(coax, "flight", fixed={"a_beta_u": 0.005, "tau_f_upper": 1.1})
    assert "tau_f_upper" not in table.names
    values = table.layout.values(table.card_row, np.full(5, 0.01))
    assert (values.a_beta_u, values.tau_f_upper) == (0.005, 1.1)
    prior = parameterize(coax, "full", priors={"tau_f_upper": (1.2, 0.1)}).free
    (mine,) = (free for free in prior if free.name == "tau_f_upper")
    assert (mine.mean, mine.sigma, mine.source) == (1.2, 0.1, "given prior")


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"free": ["masss"]}, "masss: 'coax' has no such parameter"),
        ({"free": []}, "no parameter is free"),
        ({"free": ["mass"], "fixed": {"mass": 0.3}}, "no parameter is free"),
        ({"free": ["mass", "mass"]}, "mass is given twice"),
        ({"free": ["mass"], "ties": ["mass = 2 * tau_f_upper"]}, "mass is given twice"),
        ({"free": ["mass"], "ties": ["drag_x = 0.1", "drag_x = 0.2 * mass"]}, "drag_x is given twice"),
        ({"free": ["mass"], "ties": ["drag_x = mass"], "fixed": {"drag_x": 0.1}}, "drag_x is given twice"),
        ({"free": ["mass"], "ties": ["drag_x = drag_y", "drag_y = drag_x"]}, "round in a circle: drag_"),
        ({"free": ["mass"], "ties": ["drag_x = 2 * drag_x"]}, "round in a circle: drag_x = drag_x"),
        ({"free": ["mass"], "ties": ["drag_x = rudder"]}, "rudder: 'coax' has no such parameter"),
        ({"free": ["mass"], "ties": ["drag_x = mass / 0"]}, "drag_x: is tied to 'mass / 0', which is inf kg/m"),
        ({"free": ["drag_y"], "ties": ["mass = 0 - drag_y"]}, "mass: is tied to '0 - drag_y', which is -0.0129 kg"),
        ({"free": ["mass"], "fixed": {"inertia_xx": -1.0}}, "inertia_xx: is fixed, which is -1 kg m^2; physics allows"),
        ({"free": ["mass"], "fixed": {"inertia_xx": float("nan")}}, "inertia_xx: is fixed, which is nan"),
        ({"free": ["mass"], "priors": {"mass": (0.3, 0.0)}}, "mass: prior is 0.3 with sigma 0.0"),
        ({"free": ["mass"], "priors": {"mass": (float("inf"), 1.0)}}, "mass: prior is inf"),
        ({"free": ["mass"], "priors": {"drag_x": (0.3, 0.1)}}, "drag_x: has a prior but is not free. Free are mass"),
        ({"free": ["mass"], "priors": {"drag": (0.3, 0.1)}}, "drag: 'coax' has no such parameter"),
    ],
)
def test_what_cannot_be_meant_is_refused(coax: Vehicle, asked: dict[str, object], message: str) -> None:
    with pytest.raises(IdentificationError) as caught:
        parameterize(coax, **asked)  # type: ignore[arg-type]
    assert message in str(caught.value)


def test_a_tie_that_does_not_parse_is_refused(coax: Vehicle) -> None:
    with pytest.raises(ExpressionError, match="is not an expression"):
        parameterize(coax, ["mass"], ties=["drag_x = mass ** 2"])


def test_without_leaves_the_rest(coax: Vehicle) -> None:
    table = parameterize(coax, ["mass", "drag_x", "tau_f_upper"]).without(["drag_x"])
    assert table.names == ("mass", "tau_f_upper")
    assert table.identified([0.4, 1.0]) == {"mass": 0.4, "tau_f_upper": 1.0}


def test_the_signs_of_physics_are_the_bounds_of_the_row(coax: Vehicle) -> None:
    """Masses, inertias, stiffnesses and time constants are positive whatever the data say."""
    names = ["mass", "inertia_zz", "hub_stiffness_upper", "tau_f_lower", "damping_w"]
    row = Row(tuple(parameter_entries(parameterize(coax, names))))
    low, high = row.bounds()
    assert np.all(low >= 0.0)
    assert np.all(high > row.starts())
    np.testing.assert_allclose(low * row.scale, [coax.card.parameters[name].lower for name in names])


def test_a_row_is_scaled_and_its_prior_is_a_parabola() -> None:
    row = Row(
        (
            Entry("a", "parameter", 6.0, 2.0, mean=4.0, sigma=0.5),
            Entry("b", "nuisance", -1.0, 10.0),
            Entry("c", "noise", 0.5, 1.0, mean=0.5, sigma=2.0, logarithmic=True),
        )
    )
    np.testing.assert_allclose(row.starts(), [3.0, -0.1, 0.5])
    assert (len(row), row.names) == (3, ("a", "b", "c"))
    assert row.places("nuisance").tolist() == [1]
    at = np.array([2.5, 7.0, 1.5])
    cost, gradient, curvature = row.prior(at)
    assert cost == pytest.approx(0.5 * (5.0 - 4.0) ** 2 / 0.25 + 0.5 * 1.0 / 4.0)
    step = 1e-6
    for i in range(3):
        away = np.eye(3)[i] * step
        high, middle, low = (row.prior(at + s * away)[0] for s in (1.0, 0.0, -1.0))
        assert gradient[i] == pytest.approx((high - low) / (2.0 * step), abs=1e-6)
        assert curvature[i, i] == pytest.approx((high - 2.0 * middle + low) / step**2, rel=1e-3, abs=1e-3)


def test_a_free_parameter_may_be_described(coax: Vehicle) -> None:
    table = parameterize(coax, [Free("mass", 0.05, 0.33, 0.01, 0.31, "kitchen scales"), "drag_x"])
    (entry, other) = parameter_entries(table)
    assert (entry.start, entry.scale, entry.mean, entry.sigma) == (0.31, 0.05, 0.33, 0.01)
    assert other.sigma == np.inf


def test_slopes_of_no_free_parameter_are_an_empty_table(coax: Vehicle) -> None:
    table = Parameterization(coax, ())
    assert table.layout.value_slopes(np.asarray(table.card_row), np.zeros(0)).shape == (0, len(coax.parameter_names))
