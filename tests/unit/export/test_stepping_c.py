"""A vehicle stepped by its own C against the one that XLA compiles: the same flight, the same edges."""

from __future__ import annotations

import numpy as np
import pytest

from link_bench import PlainFloats
from swashplate.api import link
from swashplate.api.verbs.link import LinkArduPilot
from swashplate.compiler import compiler
from swashplate.errors import DivergenceError, ExportError
from swashplate.export import stepping_c
from swashplate.export.stepping_c import CompiledEngine
from swashplate.models.catalogue import vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.standing import at_rest, standing
from swashplate.simulation.stepping import Stepping

pytest.importorskip("casadi", reason="the extra 'model' is not installed")
pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")


@pytest.mark.parametrize("height", [0.0, 10.0])
@pytest.mark.parametrize("name", ["raptor50", "coax"])
def test_it_flies_as_plain_floats_do(name: str, height: float) -> None:
    """Pressed into the ground and off it, in wind that changes and with a battery that sags."""
    made, around = standing(vehicle(name)), Environment(1.0, -0.5, 0.2, voltage=12.0)
    low, high = np.array(made.input_limits).T
    start = at_rest(made, around)
    start[2] += 0.002 - height
    start[made.index("phi")], start[made.index("u")], start[made.index("q")] = 0.02, 0.3, 0.1
    start[[name.startswith("omega") for name in made.state_names]] = 100.0
    both = [Stepping(made, start, around, engine=e) for e in (PlainFloats, CompiledEngine)]
    random = np.random.default_rng(0)
    for k in range(6):
        inputs = low + random.random(low.size) * (high - low)
        for each in both:
            each.surround(wind_north=0.1 * k, voltage=12.0 - 0.05 * k)
        one, other = (each.advance(inputs, 0.01) for each in both)
    assert np.abs(one.states - start).max() > 0.1
    np.testing.assert_allclose(other.states, one.states, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(other.force, one.force, rtol=1e-8, atol=1e-8)


@pytest.mark.proof
@pytest.mark.parametrize("name", ["raptor50", "coax"])
def test_it_flies_as_xla_does(name: str) -> None:
    """From the ground into the air, in wind that changes and with a battery that sags."""
    made, around = standing(vehicle(name)), Environment(1.0, -0.5, 0.2, voltage=12.0)
    low, high = np.array(made.input_limits).T
    both = [Stepping(made, at_rest(made, around), around, engine=e) for e in (None, CompiledEngine)]
    random = np.random.default_rng(0)
    for k in range(300):
        inputs = low + (0.5 + 0.2 * random.random(low.size)) * (high - low)
        for each in both:
            each.surround(wind_north=0.01 * k, voltage=12.0 - 0.005 * k)
            told = each.advance(inputs, 0.01)
    assert abs(told.body.z) > 0.2, "it never left the ground"
    one, other = (each.advance(inputs, 0.01) for each in both)
    np.testing.assert_allclose(other.states, one.states, rtol=1e-7, atol=1e-8)
    np.testing.assert_allclose(other.force, one.force, rtol=1e-6, atol=1e-6)


def test_one_that_flies_apart_stays_where_it_was() -> None:
    coax = vehicle("coax")
    rest = np.zeros(len(coax.state_names))
    broken = rest.copy()
    broken[coax.index("p")] = 1e160
    stepping = Stepping(coax, broken, Environment(), engine=CompiledEngine)
    with pytest.raises(DivergenceError):
        stepping.advance(np.zeros(4), 0.01)
    stepping.place(rest)
    assert np.isfinite(stepping.advance(np.zeros(4), 0.01).states).all()


def test_a_compiler_that_fails_is_told_of_and_the_link_flies_on(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []

    def refused(source: str, **options: object) -> None:
        raise ExportError("cc refused the exported sources: no math.h")

    monkeypatch.setattr(stepping_c, "loaded", refused)
    monkeypatch.setattr(link, "notice", said.append)
    monkeypatch.setattr(link, "VirtualEngine", PlainFloats)  # nothing to compile
    linked = LinkArduPilot("coax", port=0, idle_exit=0.1).answer()
    assert linked.exchanges == 0
    assert said == [
        "The vehicle's C cannot be used here, a slower virtual machine steps instead: "
        "cc refused the exported sources: no math.h"
    ]
