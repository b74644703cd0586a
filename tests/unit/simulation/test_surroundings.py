"""In what air and at what voltage a vehicle flies where nobody says it, and commands that act late."""

import json

import numpy as np
import pytest
from tests.cli.commands import swash

import swashplate as sp
from swashplate.api.simulate_batch import simulate_batch
from swashplate.errors import CardError
from swashplate.models.surroundings import environment_of
from swashplate.physics.environment import air_density
from swashplate.simulation.record import acting_rows

HEAVE = sp.structure("heave")


@pytest.mark.parametrize(("name", "density"), [("coax", 1.2), ("crazyflie", 1.2), ("raptor50", 1.225), ("lynx", 1.225)])
def test_the_air_is_the_cards_or_the_standard_atmospheres(name: str, density: float) -> None:
    assert environment_of(sp.vehicle(name)).air_density == density


def test_what_is_given_stays_and_what_is_open_is_the_vehicles() -> None:
    around = environment_of(sp.vehicle("crazyflie"), sp.Environment(wind_north=3.0, air_density=0.9))
    assert (around.wind_north, around.air_density, around.voltage) == (3.0, 0.9, 3.7)
    other = sp.vehicle("crazyflie").with_values({"air_density": 1.1, "voltage_nominal": 4.0})
    assert environment_of(other)[3:] == (1.1, 9.81, 4.0)


def test_command_line_and_python_fly_in_the_same_air() -> None:
    for name in ("crazyflie", "raptor50"):
        (told,) = json.loads(swash("vehicle", "trim", name, "--json").out)["trims"]
        at = sp.trim(sp.vehicle(name))
        assert told["inputs"] == at.commands()
        assert told["air_density"] == at.environment.air_density
    (high,) = json.loads(swash("vehicle", "trim", "raptor50", "--json", "--settings", "altitude=2000").out)["trims"]
    assert high["air_density"] == pytest.approx(air_density(2000.0))
    assert high["inputs"]["theta0"] > told["inputs"]["theta0"]


def test_a_simulation_flies_in_the_air_of_the_trim_that_it_starts_from() -> None:
    light = sp.vehicle("crazyflie")
    thin = sp.trim(light, environment=sp.Environment(air_density=0.9))
    commands = {name: np.full(21, value) for name, value in thin.commands().items()}
    assert np.ptp(sp.simulate(light, commands, start=thin).values("z")) < 1e-9
    sunk = sp.simulate(light, commands, start=thin, environment=sp.Environment())
    assert np.ptp(sunk.values("z")) > 1e-2


def test_a_linear_models_inputs_act_after_its_delays() -> None:
    name = HEAVE.input_names[0]
    step = {name: np.r_[0.0, np.ones(40)]}
    late, now = sp.simulate(HEAVE, step), sp.simulate(HEAVE, step, delays=0.0)
    assert HEAVE.card.observer["input_delays"][name] == 0.03
    state = HEAVE.state_names[0]
    np.testing.assert_allclose(late.values(state)[3:], now.values(state)[:-3], atol=1e-12)
    assert abs(now.values(state)[-1]) > 1e-3
    np.testing.assert_array_equal(late.values(name), step[name])
    flown = simulate_batch(HEAVE, step, size=1)
    np.testing.assert_allclose(flown[state][:, 0], late.values(state), atol=1e-11)


def test_late_from_the_first_sample_on() -> None:
    rows = np.ones((4, len(HEAVE.input_names) + 4))
    acting = acting_rows(HEAVE, rows, rate=100.0, delays=0.02, start=None, environment=environment_of(HEAVE))
    assert acting[:, 0].tolist() == [0.0, 0.0, 1.0, 1.0]
    assert (acting[:, 1:] == 1.0).all()
    never = acting_rows(HEAVE, rows, rate=100.0, delays=1.0, start=None, environment=environment_of(HEAVE))
    assert not never[:, 0].any()


def test_delays_that_differ_between_outputs_are_refused() -> None:
    from dataclasses import replace

    card = replace(HEAVE.card, observer={"input_delays_by_output": {"w/mixer_collective": 0.01}})
    with pytest.raises(CardError, match=r"differ between outputs.*0 for none"):
        sp.simulate(replace(HEAVE, card=card), {HEAVE.input_names[0]: np.ones(5)})
