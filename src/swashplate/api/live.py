"""Flying a model, or looking at a logged flight, in the browser."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from swashplate.api.saying import announce
from swashplate.control.kinds import read_controller
from swashplate.errors import SwashError
from swashplate.links.live.replay import Replay, as_json
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.controller import Controller


def _silent(_: str) -> None:
    """Says nothing."""


def live(
    vehicle: Vehicle,
    *,
    controller: Controller | str | Path | None = None,
    estimate: Sequence[str] = (),
    truth: Mapping[str, float] | None = None,
    draws: Sequence[Vehicle] = (),
    folder: str | Path = "live",
    host: str = "127.0.0.1",
    port: int = 8017,
    allow_remote: bool = False,
    open_page: bool = False,
    say: Callable[[str], None] = _silent,
    ready: Callable[[str], None] = print,
    tell: Callable[[str], None] = print,
) -> None:
    """Fly a model in the browser by gamepad, keyboard or touch, until it is interrupted.

    Args:
        vehicle: what flies.
        controller: one, or its file. An autopilot (`swash control decouple`) flies in all modes; any other in
            "position", on its own sensors where it has some, with its commands as late as it takes them to be.
        estimate: parameters ("mass") and equations ("q_dot = Mq*q + Md*servo_pitch + bias") that recursive estimators
            follow while you fly; the page shows each with two standard errors (`links.estimating`).
        truth: numbers of the card that what flies has instead, which the estimators have to find.
        draws: models that a fit cannot tell from this one (`fit.draw(5, seed=1)`): they fly beside it under the same
            law and sticks, from where it is, anew every two seconds.
        folder: for recordings and reports; made with the first one.
        host, port: where the page is; port 0 takes any free one.
        allow_remote: let other machines open the page and fly.
        open_page: open it in the browser.
        say: told what is being done.
        ready: told the page's address when it can be opened.
        tell: told where recordings are: one that begins, one that an earlier session has left, one that is saved
            because this one ends.

    Raises:
        SwashError: where the address is taken, or the controller is for another vehicle.
    """
    from swashplate.links.live import server
    from swashplate.links.live.recording import recover
    from swashplate.links.live.session import LiveSession
    from swashplate.links.web import serving
    from swashplate.links.web.libraries import check_page

    place = Path(folder)
    if place.exists() and not place.is_dir():
        raise SwashError("is a file, expected a folder.", where=place, channel="--out")
    chosen = read_controller(controller) if isinstance(controller, str | Path) else controller
    check_page()
    with serving.listen(host, port, allow_remote=allow_remote) as listening:
        say("preparing")
        flown = vehicle.with_values(truth) if truth else vehicle
        recover(place, tell)
        session = LiveSession(
            flown, controller=chosen, folder=place, estimate=estimate, model=vehicle, draws=draws, tell=tell
        )
        try:
            with suppress(KeyboardInterrupt):  # from when the address is told, an interrupt is the ordinary end
                announce(serving.address_of(listening), open_page=open_page, ready=ready, say=say)
                serving.serve(server.live_app(session, remote=allow_remote), listening, frame=server.FRAME)
        finally:
            session.close()


def show_replay(
    shown: Replay | Callable[[], Replay],
    *,
    host: str = "127.0.0.1",
    port: int = 8018,
    allow_remote: bool = False,
    open_page: bool = False,
    say: Callable[[str], None] = _silent,
    ready: Callable[[str], None] = print,
) -> None:
    """Scrub through a flight in the browser until it is interrupted.

    Args:
        shown: what `sp.replay` made, or a function that makes it once the address is held.
        host, port, allow_remote, open_page, say, ready: as of `live`.

    Raises:
        SwashError: where the extra `live` is missing, or the address is taken.
    """
    from swashplate.links.live import server
    from swashplate.links.web import serving
    from swashplate.links.web.libraries import check_page

    with serving.listen(host, port, allow_remote=allow_remote) as listening:
        made = shown if isinstance(shown, Replay) else shown()
        check_page()
        with suppress(KeyboardInterrupt):
            announce(serving.address_of(listening), open_page=open_page, ready=ready, say=say)
            serving.serve(server.replay_app(as_json(made), remote=allow_remote), listening)
