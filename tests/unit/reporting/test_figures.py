"""Figures of flights, responses, trims and derivatives: what is on them, with units; and their notebook form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import FlightError, SwashError
from swashplate.flights.flight import Flight, stream
from swashplate.identification.responses.frequency_response import FrequencyResponse, unwrapped_degrees
from swashplate.models.conventional.derivative_table import DerivativeTable
from swashplate.physics.environment import Environment
from swashplate.reporting.figures.bode_matrix import beside_model
from swashplate.simulation.derivatives_over_speed import Derivatives
from swashplate.simulation.trim import Trim
from swashplate.simulation.trim_curve import TrimCurve, trim_curve

TIME = np.arange(400) / 100.0


@pytest.fixture
def flight() -> Flight:
    return Flight.from_arrays(TIME, {"phi": 0.1 * np.sin(TIME), "p": 0.1 * np.cos(TIME), "knob": TIME}, source="<mine>")


@pytest.fixture
def response() -> FrequencyResponse:
    omega = np.geomspace(0.6, 60.0, 50)
    h = (1.0 / (1.0 + 1j * omega / 10.0)).reshape(-1, 1, 1)
    coherence = np.where(omega < 30.0, 0.95, 0.3).reshape(-1, 1, 1)
    none = np.full((50, 1), np.nan)
    return FrequencyResponse(
        omega, ("servo_roll",), ("p",), h, coherence, coherence[..., 0], np.full(h.shape, 0.05), none, none, coherence
    )


def _labels(figure: Any) -> list[str]:
    return [panel.get_ylabel() for panel in figure.axes]


def test_a_flight_is_drawn_in_the_units_of_pilots(flight: Flight) -> None:
    figure = flight.plot()
    assert _labels(figure) == ["phi [deg]", "p [deg/s]"]
    np.testing.assert_allclose(figure.axes[0].lines[0].get_ydata().max(), np.degrees(0.1), rtol=1e-3)
    assert figure.axes[-1].get_xlabel() == "time [s]"
    assert _labels(flight.plot(channels=["knob", "p"])) == ["knob [unit unknown]", "p [deg/s]"]
    with pytest.raises(FlightError, match="no such channel"):
        flight.plot(channels=["pp"])
    with pytest.raises(FlightError, match="nothing to draw"):
        flight.plot(channels=[])


def test_a_gap_stays_open_and_a_peak_stays_seen() -> None:
    time = np.concatenate([np.arange(20_000) / 1000.0, 30.0 + np.arange(20_000) / 1000.0])
    values = np.zeros(time.size)
    values[777] = 5.0
    drawn = Flight({"a": stream(time, {"u": values})}).plot().axes[0].lines[0]
    x, y = np.asarray(drawn.get_xdata()), np.asarray(drawn.get_ydata())
    assert x.size < 6000
    assert np.nanmax(y) == 5.0
    opened = np.flatnonzero(np.isnan(y))
    assert opened.size == 1
    assert x[opened[0] - 1] < 20.0
    assert x[opened[0] + 1] >= 30.0


def test_responses_are_black_where_they_are_coherent_and_grey_elsewhere(response: FrequencyResponse) -> None:
    figure = response.plot()
    assert _labels(figure) == ["magnitude [dB]", "phase [deg]", "coherence [-]"]
    grey, black = (np.asarray(line.get_ydata()) for line in figure.axes[0].lines[:2])
    good = response.coherence[:, 0, 0] >= 0.6
    np.testing.assert_array_equal(np.isfinite(black), good)
    assert np.isfinite(grey[~good]).all()
    assert np.sum(np.isfinite(grey) & np.isfinite(black)) == 1, (
        "the grey line meets the black one and does not double it"
    )
    hertz = np.asarray(figure.axes[0].lines[1].get_xdata())
    in_radians = np.asarray(response.plot(frequency="rad/s").axes[0].lines[1].get_xdata())
    np.testing.assert_allclose(in_radians, 2.0 * np.pi * hertz, rtol=1e-5)
    with pytest.raises(SwashError, match="is no output"):
        response.plot(pairs=[("q", "servo_roll")])


@pytest.fixture(scope="module")
def curve() -> TrimCurve:
    return trim_curve(sp.vehicle("coax"), (0.0, 0.5))


def test_a_trim_curve_tells_its_numbers_in_every_form(curve: TrimCurve) -> None:
    columns = curve.columns()
    np.testing.assert_allclose(columns["phi [deg]"], [np.degrees(at.states()["phi"]) for at in curve.trims])
    drawn = [panel.get_title(loc="left") for panel in curve.plot().axes]
    assert drawn == [head.replace("[1]", "[-]") for head in list(columns)[1:]]
    assert "0.500" in repr(curve)
    assert [at["speed"] for at in curve.to_document()["trims"]] == [0.0, 0.5]
    assert "theta [deg]" in curve._repr_html_()
    with pytest.raises(SwashError, match="at least one speed"):
        trim_curve(curve.vehicle, ())


def test_derivatives_are_drawn_in_total_and_by_contributor() -> None:
    made = np.arange(60.0).reshape(6, 10)
    table = DerivativeTable({"main_rotor": made, "fin": -0.5 * made}, np.zeros((2, 10)), "build-up")
    none = np.zeros(1)
    trims = tuple(Trim(none, none, ("u",), ("theta0",), Environment(), v, 0.0, 0.0, 0.0) for v in (0.0, 5.0))
    found = Derivatives(sp.vehicle("raptor50"), trims, (table, table), imperial=True)
    panel = next(p for p in found.plot(row="X").axes if p.get_title(loc="left").startswith("Xtheta0"))
    assert panel.get_title(loc="left") == "Xtheta0 [ft/s²/rad]"
    total, main, fin = (float(np.asarray(line.get_ydata())[0]) for line in panel.lines)
    assert main + fin == pytest.approx(total, rel=1e-5)
    assert total == pytest.approx(3.0 / 0.3048, rel=1e-5)
    assert found.to_document()["tables"][1]["derivatives"]["Xtheta0"]["value"] == pytest.approx(total)
    with pytest.raises(SwashError, match="expected one of X, Y, Z, L, M, N"):
        found.plot(row="Q")
    assert "Derivatives of Thunder Tiger Raptor 50" in found._repr_html_()


def test_notebooks_show_a_table_and_a_picture_and_no_markup_of_others(
    flight: Flight, response: FrequencyResponse
) -> None:
    page = flight._repr_html_()
    assert "&lt;mine&gt;" in page
    assert "<mine>" not in page
    assert "roll rate" in page
    assert 'src="data:image/png;base64,' in page
    assert "p / servo_roll" in response._repr_html_()


def test_noise_between_coherent_lines_adds_no_turn() -> None:
    """A lag through 300 degrees with incoherent lines in its middle that turn once around."""
    degrees = np.linspace(0.0, -300.0, 60)
    h = np.exp(1j * np.radians(degrees))
    coherent = np.ones(60, dtype=bool)
    coherent[25:31] = False
    h[25:31] = np.exp(1j * np.radians(degrees[24] + np.linspace(100.0, 400.0, 6)))
    np.testing.assert_allclose(unwrapped_degrees(h, coherent=coherent)[coherent], degrees[coherent], atol=1e-9)
    assert np.max(np.abs(unwrapped_degrees(h)[coherent] - degrees[coherent])) > 359.0, "the noise would turn it"


def test_a_flight_and_its_model_are_never_a_turn_apart() -> None:
    """At a notch the flight's phase turns the other way than the model's: nothing that a fit could see."""
    omega = np.geomspace(1.0, 30.0, 80)
    s = 1j * omega
    notch = (s**2 + 0.02 * s + 36.0) / (s + 3.0) ** 2
    other = (s**2 - 0.02 * s + 36.0) / (s + 3.0) ** 2  # the same to a thousandth, and half a turn the other way
    flown, model = unwrapped_degrees(other), unwrapped_degrees(notch)
    assert abs(flown[-1] - model[-1]) > 300.0
    drawn = beside_model(flown, omega, omega[5:-5], model[5:-5])
    assert np.max(np.abs(drawn - model)[np.abs(omega - 6.0) > 0.5]) < 5.0
