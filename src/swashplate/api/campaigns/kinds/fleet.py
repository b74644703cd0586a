"""Campaigns of logs: each of a folder through inspect, respond, fit and a verdict, into one table."""

from __future__ import annotations

import hashlib
import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from swashplate.api.campaigns.kind import CampaignFindings, CampaignKind, CampaignSettings, logged
from swashplate.api.campaigns.shares import share_words
from swashplate.api.campaigns.tasks import Columns, Portion, seed_of
from swashplate.api.verbs.identify import FitTransferFunctions
from swashplate.api.verbs.respond import Respond
from swashplate.errors import CampaignError, SwashError
from swashplate.flights.flight import Flight
from swashplate.flights.inspect import inspect
from swashplate.identification.core.result import Result
from swashplate.models.linear.transfer_function import Form

GOOD = "good"
_SHOWN = 40


class FleetWords(CampaignSettings, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """What a campaign of logs says beside the words of `swash identify` for transfer functions.

    Attributes:
        folder: where the logs are, on every worker. pattern: which files, `**/*.bin` for folders inside it too.
        input, output: channels of the response that is fitted. others: inputs that it is conditioned on.
        form: of the transfer function. largest_cost: above it a fit is poor (J of Tischler and Remple).
    """

    folder: str
    pattern: str = "*"
    input: str
    output: str
    others: list[str] = msgspec.field(default_factory=list)
    form: str = "1/2"
    largest_cost: float = 100.0


class FleetKind(CampaignKind):
    """See `CampaignKind`."""

    rows = "log"
    question = FitTransferFunctions
    settings_type = FleetWords
    without = ("responses", "hold_out", "outputs", "gains", "margins")

    def parts(self, settings: Any, folder: Path) -> tuple[Portion, ...]:
        Form.parse(settings.form)
        self.asked(settings, {})
        place = folder / settings.folder
        if not place.is_dir():
            raise CampaignError("there is no such folder.", where=place, channel="folder")
        logs = sorted(path for path in place.glob(settings.pattern) if path.is_file())
        if not logs:
            raise CampaignError(f"has no file '{settings.pattern}'.", where=place, channel="pattern")
        return tuple(Portion(k, 1, seed_of(settings.seed, k), str(path), _digest(path)) for k, path in enumerate(logs))

    def run(self, settings: Any, portion: Portion, files: Mapping[str, Path]) -> Columns:
        path = Path(portion.of)
        if not path.is_file() or _digest(path) != portion.digest:
            raise CampaignError("is not the log that the campaign was begun with, or not on this worker.", where=path)
        names = Form.parse(settings.form).names
        facts: dict[str, Any] = {"duration": math.nan, "sweeps": -1, "problems": ""}
        numbers: dict[str, float] = dict.fromkeys(("cost", "coherence", *names), math.nan)
        verdict = self._judge(settings, path, files, facts, numbers)
        row: dict[str, Any] = {"log": path.name, "verdict": verdict, **facts, **numbers}
        return {name: np.array([value]) for name, value in row.items()}

    def replay(self, settings: Any, portion: Portion, files: Mapping[str, Path], row: int) -> Result[object, object]:
        return self._fit(settings, logged(self.asked(settings, files), Path(portion.of)), files, {})

    def findings(self, settings: Any, table: Columns) -> CampaignFindings:
        if "verdict" not in table:
            return CampaignFindings((), {})
        verdicts = [str(verdict) for verdict in table["verdict"]]
        kinds = Counter(verdict.partition(":")[0] for verdict in verdicts)
        good = kinds.get(GOOD, 0)
        shown = {n: ("", 1.0) for n in ("cost", *Form.parse(settings.form).names) if n in table and good}
        tables = [("What became of the logs", ("verdict", "logs"), tuple((w, str(n)) for w, n in kinds.most_common()))]
        if "log" in table:
            logs = tuple((str(n), w) for n, w in zip(table["log"], verdicts, strict=True) if w != GOOD)
            more = f" (the first {_SHOWN} of {len(logs)})" if len(logs) > _SHOWN else ""
            if logs:
                tables.append((f"Logs without a good fit{more}", ("log", "why"), logs[:_SHOWN]))
        summary = (("Good fits", share_words(good, len(verdicts)), "good" if good else "bad"),)
        worst = "cost" if "cost" in shown else ""
        return CampaignFindings(summary, shown, worst=worst, tables=tuple(tables))

    def _judge(
        self,
        settings: Any,
        path: Path,
        files: Mapping[str, Path],
        facts: dict[str, Any],
        numbers: dict[str, float],
    ) -> str:
        """What a log is worth, in words; `facts` and `numbers` are filled in as far as it goes."""
        try:
            raw = logged(self.asked(settings, files), path)
        except SwashError as error:
            return f"cannot be read: {error.problem}"
        look = inspect(raw)
        facts |= {"duration": float(look.duration), "sweeps": len(look.sweeps), "problems": "; ".join(look.problems)}
        if look.damage:
            return f"damaged: {'; '.join(look.damage)}"
        try:
            fit = self._fit(settings, raw, files, numbers)
        except SwashError as error:
            return f"no response: {error.problem}"
        numbers |= {"cost": float(fit.cost), **{e.name: float(e.value) for e in fit.estimates if e.name in numbers}}
        if fit.failed:
            return f"fit failed: {'; '.join(fit.problems)}"
        if not fit.cost <= settings.largest_cost:
            return f"poor fit: J = {fit.cost:.3g}, above {settings.largest_cost:g}"
        return GOOD

    def _fit(
        self, settings: Any, raw: Flight, files: Mapping[str, Path], numbers: dict[str, float]
    ) -> Result[object, object]:
        asked: FitTransferFunctions = self.asked(settings, files)
        renamed: Any = asked.rename or {}
        channels = {name: renamed.get(name, name) for name in (settings.input, *settings.others)}
        output = {settings.output: renamed.get(settings.output, settings.output)}
        measured = Respond(
            (raw,), inputs=channels, outputs=output, band=asked.split_band()[0], rate=asked.rate, cutoff=asked.cutoff
        ).answer()
        numbers["coherence"] = float(np.nanmedian(measured.coherence[:, 0, 0]))
        fit = replace(asked, responses=measured).answer().fit
        assert fit is not None
        return fit


def _digest(path: Path) -> str:
    with path.open("rb") as log:
        return hashlib.file_digest(log, "sha256").hexdigest()


FLEET = FleetKind()
