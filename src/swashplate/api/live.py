"""Flying a model, or looking at a logged flight, in the browser."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from swashplate.api.asking import drawn, strings
from swashplate.api.saying import Say, announce, notice, ready
from swashplate.control.kinds import load_controller
from swashplate.errors import SwashError
from swashplate.links.live.replay import Replay, as_json, replay
from swashplate.models.catalogue import vehicle as find
from swashplate.models.vehicle import Vehicle

if TYPE_CHECKING:
    from swashplate.api.verbs.live import Live


def serve_live(asked: Live, vehicle: Vehicle, say: Say) -> None:
    """A model, with its changes, flown in the browser until it is interrupted."""
    from swashplate.links.live import server
    from swashplate.links.live.recording import recover
    from swashplate.links.live.session import LiveSession
    from swashplate.links.web import serving
    from swashplate.links.web.libraries import check_page

    given = asked.controller
    chosen = load_controller(given) if isinstance(given, str | Path) else given
    draws = drawn(vehicle, asked.posterior, count=asked.draws)
    check_page()
    with serving.listen(asked.host, asked.port or 0, allow_remote=asked.allow_remote) as listening:
        say("preparing")
        flown = vehicle.with_values(asked.truth) if asked.truth else vehicle
        recover(asked.folder, notice)
        session = LiveSession(
            flown,
            controller=chosen,
            folder=asked.folder,
            estimate=strings(asked.estimate),
            model=vehicle,
            draws=draws,
            tell=notice,
        )
        try:
            begun = partial(announce, open_page=asked.open_page, ready=ready, say=say)
            app = server.live_app(session, remote=asked.allow_remote)
            serving.serve(app, listening, begun=begun, frame=server.FRAME)
        finally:
            session.close()


def serve_replay(asked: Live, say: Say) -> None:
    """A flight to scrub through in the browser until it is interrupted."""
    from swashplate.links.live import server
    from swashplate.links.web import serving
    from swashplate.links.web.libraries import check_page

    model = asked.vehicle
    chosen = find(model) if isinstance(model, str | Path) else model
    if asked.posterior is not None and chosen is None:
        raise SwashError("is of no model: name it.", channel="--posterior")
    with serving.listen(asked.host, asked.port or 0, allow_remote=asked.allow_remote) as listening:
        made = _prepared(asked, chosen, say)
        check_page()
        begun = partial(announce, open_page=asked.open_page, ready=ready, say=say)
        serving.serve(server.replay_app(as_json(made), remote=asked.allow_remote), listening, begun=begun)


def _prepared(asked: Live, model: Vehicle | None, say: Say) -> Replay:
    say("reading the flight")
    (log,) = asked.read(asked.replay)
    # A simulation's true states have no outliers, and what looks like one is a maneuver.
    clean = log.provenance.simulated and "phi" in log
    logged = log.condition(rate=asked.rate, cutoff=asked.cutoff, outliers=not clean, trim_ground=not clean)
    say(f"predicting {'(compiling takes longest the first time)' if model else ''}".strip())
    draws = () if model is None else drawn(model, asked.posterior, count=asked.draws)
    shown = replay(logged, model=model, draws=draws, ahead=asked.ahead, hold_missing=asked.hold_missing)
    for note in shown.notes:
        notice(note)
    return shown
