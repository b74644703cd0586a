"""An estimator, a reader, a controller and an export of other packages, found through their entry points."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import own_package
import pytest
from commands import swash

import swashplate as sp
from swashplate.control.kinds import save_controller
from swashplate.errors import ControllerError, FlightError, IdentificationError, SwashError
from swashplate.flights.flight import Flight
from tipping import TRUTH, tipped, tipping

GAINS = (0.3, 0.3, 0.3, 0.3, 0.06)
PACKAGES = ("rate_least_squares", "triax_log", "attitude_pd", "stability_table", "ducted_fan", "gym_hover")


@pytest.fixture(scope="module", autouse=True)
def _installed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with ExitStack() as stack:
        for name in PACKAGES:
            stack.enter_context(own_package.installed(name, tmp_path_factory.mktemp(name)))
        yield


@pytest.mark.parametrize("name", PACKAGES)
def test_a_package_is_short_and_lies_outside(name: str) -> None:
    folder = own_package.EXAMPLES / name
    assert len((folder / f"{name}.py").read_text().splitlines()) < 60
    project = tomllib.loads((folder / "pyproject.toml").read_text())["project"]
    assert all(group.startswith("swashplate.") for group in project.get("entry-points", {}))


def test_an_estimator_is_chosen_by_its_name() -> None:
    """On a flight without noise and gusts least squares of the rates is right but for the differences' error."""
    flown = tipped(0, gust=0.0, noise=0.0)
    fit = sp.identify(tipping(), flown, free=list(TRUTH), method="rate-least-squares")
    for name, value in TRUTH.items():
        assert fit[name].value == pytest.approx(value, rel=0.1)
    assert sp.Result.from_document(fit.to_document(), equations=tipping()).method == "rate-least-squares"
    assert len(fit.draw(3, seed=0)) == 3
    with pytest.raises(IdentificationError, match="do not have the states theta, q"):
        sp.identify(tipping(), flown.with_streams({"u": flown.streams["uniform"][["stick"]]}), free=list(TRUTH),
                    method="rate-least-squares")  # fmt: skip
    with pytest.raises(IdentificationError, match="outputs: the method 'rate-least-squares' does not know it"):
        sp.identify(tipping(), flown, free=list(TRUTH), outputs=("q",), method="rate-least-squares")


def _triax(folder: Path, *, head: str = "seconds,roll,pitch,yaw,height,stick", last: str = "") -> Path:
    rows = [f"{0.01 * k},{k % 7},0,{10 * k % 360},1.5,0.1" for k in range(50)]
    path = folder / "flight.txt"
    path.write_text("\n".join(["TRIAX 1", head, *rows, last]).rstrip("\n") + "\n", encoding="utf-8")
    return path


def test_a_reader_is_found_by_what_the_file_holds(tmp_path: Path) -> None:
    flight = sp.read(_triax(tmp_path))
    assert isinstance(flight, Flight)
    assert flight.provenance.reader == "triax"
    assert flight.values("phi")[6] == pytest.approx(np.radians(6.0))
    assert np.all(flight.values("z") == -1.5)
    assert np.ptp(flight.values("psi")) == pytest.approx(np.radians(490.0))
    assert "servo_roll" in swash("inspect", _triax(tmp_path)).out
    with pytest.raises(FlightError, match="has the columns a, b, expected seconds"):
        sp.read(_triax(tmp_path, head="a,b"))
    with pytest.raises(FlightError, match="no row of 6 numbers"):
        sp.read(_triax(tmp_path, last="0.5,1,2"))


def test_a_controller_flies_and_returns_from_its_file(tmp_path: Path) -> None:
    from attitude_pd import AttitudePD  # type: ignore[import-not-found]

    fan = sp.vehicle("ducted_fan")
    hover = sp.trim(fan).commands()
    save_controller(AttitudePD(np.array([hover["fan"], hover["yaw"], *GAINS])), tmp_path / "mine.toml")
    again = sp.load_controller(tmp_path / "mine.toml")
    flown = sp.simulate_closed_loop(fan, again, duration=8.0, reference={"z": -1.0, "psi": 0.5}, rate=100.0)
    assert flown.values("z")[-1] == pytest.approx(-1.0, abs=0.02)
    assert flown.values("psi")[-1] == pytest.approx(0.5, abs=0.02)
    text = (tmp_path / "mine.toml").read_text()
    (tmp_path / "mine.toml").write_text(text.replace("sink = 0.3", 'sink = "much"'))
    with pytest.raises(ControllerError, match=r"mine.toml: gains.sink: is no number"):
        sp.load_controller(tmp_path / "mine.toml")


def test_an_export_is_a_format_like_any_other(tmp_path: Path) -> None:
    made = swash("export", "ducted_fan", "--format", "stability-table", "--out", tmp_path / "out")
    assert made.code == 0, made.err
    (file,) = (tmp_path / "out").glob("*.csv")
    table = [line.split(",") for line in file.read_text().splitlines()]
    fan = sp.vehicle("ducted_fan")
    model = sp.linearize(fan, sp.trim(fan))
    row = next(line for line in table if line[0] == "omega")
    assert float(row[table[0].index("fan [1]")]) == pytest.approx(model.B[model.states.index("omega"), 0], rel=1e-4)
    assert row[1] == "rad/s/s"


def test_a_vehicle_is_an_environment_of_gymnasium() -> None:
    """Gymnasium accepts it, proportional feedback keeps the place for ten seconds, and rotors that stop lose it."""
    gymnasium = pytest.importorskip("gymnasium")
    import gym_hover  # type: ignore[import-not-found]  # noqa: F401
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make("swashplate/Hover-v0", vehicle="coax").unwrapped
    check_env(env, skip_render_check=True)

    def flown(policy: Callable[[np.ndarray], np.ndarray]) -> tuple[list[float], bool]:
        (seen, _), rewards, over = env.reset(seed=0), [], False
        while not over:
            seen, reward, lost, truncated, _ = env.step(policy(seen))
            rewards.append(reward)
            over = lost or truncated
        return rewards, lost

    def held(seen: np.ndarray) -> np.ndarray:
        north, east, down, u, v, w, roll, pitch, heading, p, q, r = seen
        climb, turn = 0.6 * (down + w), -0.3 * heading - 0.2 * r
        nose = 1.5 * (pitch - np.clip(-0.15 * north - 0.25 * u, -0.3, 0.3)) - 0.15 * q
        right = 1.5 * (roll + np.clip(-0.15 * east - 0.25 * v, -0.3, 0.3)) - 0.15 * p
        return np.clip([climb - turn, climb + turn, right, -nose], -1.0, 1.0)

    rewards, lost = flown(held)
    assert (len(rewards), lost) == (500, False)
    assert np.mean(rewards) > 0.9
    rewards, lost = flown(lambda seen: np.array([-1.0, -1.0, 0.0, 0.0]))
    assert lost
    assert rewards[-1] == -10.0


def test_a_name_that_no_package_has_is_told() -> None:
    with pytest.raises(SwashError, match="is no format"):
        sp.export_model("ducted_fan", "stability-tables")
