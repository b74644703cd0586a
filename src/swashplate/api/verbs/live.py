"""`swash live`: a model flown in the browser, or a flight looked at there."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from swashplate.api.asking import FLIGHT, FromConditioned, OfVehicle
from swashplate.api.languages import Aircraft, Log, Pilot, Texts, Values
from swashplate.api.question import argument, option, setting
from swashplate.api.saying import QUIET, Say, notice, silent
from swashplate.api.verbs.look import Served
from swashplate.errors import SwashError

if TYPE_CHECKING:
    pass


class Live(OfVehicle[None], FromConditioned[None], Served):
    """Fly a model in the browser: gamepad, keyboard or touch; record, identify, and read the report.

    With --replay a logged flight is looked at instead; a model's prediction is then shown beside it.
    """

    vehicle: Aircraft | None = argument(
        default=None, metavar="MODEL", help="A vehicle's name, or a card or model file.", complete="vehicle"
    )
    replay: Log | None = option(default=None, help=f"Look at this flight instead: {FLIGHT}.", complete="flight")
    ahead: float = setting(
        default=2.0,
        help="with --replay: seconds after which the prediction starts again.",
        unit="s",
        least=0.1,
        most=60.0,
    )
    controller: Pilot | None = option(
        default=None, help="A controller's file: one of `swash control decouple` for all modes, any other for Position."
    )
    estimate: Texts = option(
        default=(),
        metavar="NAMES|EQUATION",
        help="Estimate while it flies: parameters of the model (mass), or an equation as of `swash track`. Repeatable.",
    )
    truth: Values | None = option(
        default=None, help="What flies has this number instead of the card's: for --estimate to find. Repeatable."
    )
    posterior: Aircraft | None = option(
        default=None, metavar="FILE", help="A fit.json of this model: models drawn from it fly beside it."
    )
    folder: Path = option(
        default=Path("live"),
        flag="--out",
        metavar="DIR",
        help="Folder for recordings and reports; made with the first one.",
    )
    draws: int = setting(default=5, help="with posterior: how many", least=2, most=40)
    hold_missing: bool = setting(
        default=False, help="with replay: hold the model's inputs that the log lacks at hover; the page says so"
    )
    rate: float = setting(default=100.0, help="with replay: conditioned rate", unit="Hz", least=1.0, most=2000.0)
    as_logged: bool = setting(default=False, help="with replay: use channels even where they contradict each other")

    def answer(self, say: Say = silent) -> None:
        from swashplate.api.live import serve_live, serve_replay

        if self.replay is not None:
            return serve_replay(self, say)
        if self.vehicle is None:
            raise SwashError("is missing.", channel="MODEL", hint="Name a vehicle, or a flight with --replay.")
        if self.folder.exists() and not self.folder.is_dir():
            raise SwashError("is a file, expected a folder.", where=self.folder, channel="--out")
        vehicle = self.flying(self.vehicle, whole=True)
        if vehicle.traits.remark and not QUIET.get():
            notice(vehicle.traits.remark)
        return serve_live(self, vehicle, say)
