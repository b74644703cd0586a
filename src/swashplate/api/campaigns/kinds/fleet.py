"""Campaigns of logs: each of a folder through inspect, respond, fit and a verdict, into one table."""

from __future__ import annotations

import hashlib
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from swashplate.api.campaigns.kind import CampaignFindings, CampaignSettings, NamedFile
from swashplate.api.campaigns.shares import share_words
from swashplate.api.campaigns.tasks import Columns, Portion, seed_of
from swashplate.errors import CampaignError, SwashError
from swashplate.flights.conditioning.uniform_records import uniform_records
from swashplate.flights.flight import Flight
from swashplate.flights.inspect import inspect
from swashplate.flights.readers.read import read
from swashplate.identification.core.result import Result
from swashplate.identification.frequency.transfer_function_fit import fit_transfer_function
from swashplate.identification.responses.respond import respond
from swashplate.models.linear.transfer_function import Form

GOOD = "good"
_SHOWN = 40


class FleetCampaign(CampaignSettings, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """The file of a campaign of logs.

    Attributes:
        folder: where the logs are, on every worker. pattern: which files, `**/*.bin` for folders inside it too.
        input, output: channels of the response that is fitted. others: inputs that it is conditioned on.
        names: the log's channel by the name used here, where the log calls it otherwise.
        mapping: a TOML file that says which columns are which channels.
        rate: to which logs are brought [Hz]. band: limits [Hz]. form: of the transfer function.
        least_coherence: from which a response is used. largest_cost: above it a fit is poor (J of Tischler and Remple).
    """

    folder: str
    pattern: str = "*"
    input: str
    output: str
    others: list[str] = msgspec.field(default_factory=list)
    names: dict[str, str] = msgspec.field(default_factory=dict)
    mapping: str | None = None
    rate: float = 100.0
    band: tuple[float, float] | None = None
    form: str = "1/2"
    least_coherence: float = 0.6
    largest_cost: float = 100.0


class FleetKind:
    """See `CampaignKind`."""

    rows = "log"
    schema = FleetCampaign

    def files(self, settings: FleetCampaign) -> Sequence[NamedFile]:
        return () if settings.mapping is None else (NamedFile("mapping", settings.mapping),)

    def parts(self, settings: FleetCampaign, folder: Path) -> tuple[Portion, ...]:
        Form.parse(settings.form)
        place = folder / settings.folder
        if not place.is_dir():
            raise CampaignError("there is no such folder.", where=place, channel="folder")
        logs = sorted(path for path in place.glob(settings.pattern) if path.is_file())
        if not logs:
            raise CampaignError(f"has no file '{settings.pattern}'.", where=place, channel="pattern")
        return tuple(Portion(k, 1, seed_of(settings.seed, k), str(path), _digest(path)) for k, path in enumerate(logs))

    def run(self, settings: FleetCampaign, portion: Portion, files: Mapping[str, Path]) -> Columns:
        path = Path(portion.of)
        if not path.is_file() or _digest(path) != portion.digest:
            raise CampaignError("is not the log that the campaign was begun with, or not on this worker.", where=path)
        names = Form.parse(settings.form).names
        facts: dict[str, Any] = {"duration": math.nan, "sweeps": -1, "problems": ""}
        numbers: dict[str, float] = dict.fromkeys(("cost", "coherence", *names), math.nan)
        verdict = self._judge(settings, path, files, facts, numbers)
        row: dict[str, Any] = {"log": path.name, "verdict": verdict, **facts, **numbers}
        return {name: np.array([value]) for name, value in row.items()}

    def replay(
        self, settings: FleetCampaign, portion: Portion, files: Mapping[str, Path], row: int
    ) -> Result[Any, Any]:
        return self._fit(settings, self._read(settings, Path(portion.of), files), {})

    def findings(self, settings: FleetCampaign, table: Columns) -> CampaignFindings:
        if "verdict" not in table:
            return CampaignFindings((), {})
        verdicts = [str(words) for words in table["verdict"]]
        kinds = Counter(words.partition(":")[0] for words in verdicts)
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
        settings: FleetCampaign,
        path: Path,
        files: Mapping[str, Path],
        facts: dict[str, Any],
        numbers: dict[str, float],
    ) -> str:
        """What a log is worth, in words; `facts` and `numbers` are filled in as far as it goes."""
        try:
            raw = self._read(settings, path, files)
        except SwashError as error:
            return f"cannot be read: {error.problem}"
        look = inspect(raw)
        facts |= {"duration": float(look.duration), "sweeps": len(look.sweeps), "problems": "; ".join(look.problems)}
        if look.damage:
            return f"damaged: {'; '.join(look.damage)}"
        try:
            fit = self._fit(settings, raw, numbers)
        except SwashError as error:
            return f"no response: {error.problem}"
        numbers |= {"cost": float(fit.cost), **{e.name: float(e.value) for e in fit.estimates if e.name in numbers}}
        if fit.failed:
            return f"fit failed: {'; '.join(fit.problems)}"
        if not fit.cost <= settings.largest_cost:
            return f"poor fit: J = {fit.cost:.3g}, above {settings.largest_cost:g}"
        return GOOD

    def _read(self, settings: FleetCampaign, path: Path, files: Mapping[str, Path]) -> Flight:
        return read(path, mapping=None if settings.mapping is None else files[settings.mapping])

    def _fit(self, settings: FleetCampaign, raw: Flight, numbers: dict[str, float]) -> Result[Any, Any]:
        inputs = (settings.input, *settings.others)
        records = uniform_records(raw, (*inputs, settings.output), rate=settings.rate, names=settings.names)
        measured = respond(records, inputs=inputs, outputs=(settings.output,), band=settings.band)
        numbers["coherence"] = float(np.nanmedian(measured.coherence[:, 0, 0]))
        return fit_transfer_function(
            measured, settings.form, input=settings.input, band=settings.band, least_coherence=settings.least_coherence
        )


def _digest(path: Path) -> str:
    with path.open("rb") as log:
        return hashlib.file_digest(log, "sha256").hexdigest()


FLEET = FleetKind()
