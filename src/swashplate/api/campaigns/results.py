"""What a campaign has found, as far as it is: its table, what its kind makes of it, and what failed."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from swashplate import atomic
from swashplate.api.campaigns.kind import CAMPAIGNS, CampaignFindings, settings_of
from swashplate.api.campaigns.plan import planned_in
from swashplate.api.campaigns.result_files import tabulated
from swashplate.api.campaigns.shares import quantile
from swashplate.api.campaigns.store import CampaignStore
from swashplate.api.campaigns.tasks import Columns
from swashplate.errors import CampaignError
from swashplate.extras import library
from swashplate.reporting.campaign import FailedTask, Shape, WorstRow, compose_campaign
from swashplate.reporting.structure import Report
from swashplate.shown import Shown
from swashplate.text_table import text_table

QUANTILES = (0.05, 0.5, 0.95, 0.99)
_WORST = 10


@dataclass(frozen=True, repr=False)
class Campaign(Shown):
    """What a campaign has found so far.

    Attributes:
        folder: its store.
        of, document: its kind, and what its file says.
        names: of its tasks, in the order of their rows. rows: numbers of each task's. done: those whose result is here.
        failed: tasks that were given up, by name.
        at_work: who computes it now, in words; "" for nobody.
    """

    folder: Path
    of: str
    document: Mapping[str, Any]
    names: tuple[str, ...]
    rows: tuple[range, ...] = field(repr=False)
    done: frozenset[str]
    failed: Mapping[str, Mapping[str, Any]] = field(repr=False)
    at_work: str = ""

    @property
    def complete(self) -> bool:
        """Whether every task is done, and its result is what was computed."""
        return len(self.done) == len(self.names) and not self.refused

    @property
    def table(self) -> Columns:
        """All rows that are here, by column, in the order of their numbers; those of `refused` are in no figure.

        Raises:
            CampaignError: columns that differ.
        """
        return self._read[0]

    @property
    def refused(self) -> Mapping[str, str]:
        """Tasks whose result is not what was computed (damaged, another task's, changed), and why: name by words."""
        return self._read[1]

    @cached_property
    def _read(self) -> tuple[Columns, dict[str, str]]:
        store, parts, refused = CampaignStore(self.folder), [], {}
        for name, rows in zip(self.names, self.rows, strict=True):
            if name in self.done:
                try:
                    parts.append(store.columns(name))
                except CampaignError as error:
                    refused[name] = f"rows {rows[0]} to {rows[-1]} are refused: {error}"
                    continue
                if parts[-1].keys() != parts[0].keys():
                    raise CampaignError("has other columns than the first task.", where=self.folder, channel=name)
        return ({c: np.concatenate([part[c] for part in parts]) for c in parts[0]} if parts else {}), refused

    @cached_property
    def findings(self) -> CampaignFindings:
        """What its kind makes of the table."""
        document = {key: value for key, value in self.document.items() if key not in ("kind", "of")}
        return CAMPAIGNS[self.of].findings(settings_of(self.of, document, where=str(self.folder)), self.table)

    @property
    def quantiles(self) -> dict[str, tuple[tuple[float, float, float], ...]]:
        """Quantiles of what is shown, in its units, by column: each with the ends of its 95 % interval."""
        by_column = {}
        for name, (_, factor) in self.findings.shown.items():
            values = factor * np.asarray(self.table[name], dtype=np.float64)
            by_column[name] = tuple(quantile(values[~np.isnan(values)], share) for share in QUANTILES)
        return by_column

    def worst(self, count: int = _WORST) -> tuple[WorstRow, ...]:
        """Rows with the largest of the kind's measure of badness, the worst first."""
        by = self.findings.worst
        if not by or not self.table:
            return ()
        values = np.asarray(self.table[by], dtype=np.float64)
        order = np.argsort(-np.where(np.isnan(values), -np.inf, values), kind="stable")[:count]
        factor = self.findings.shown.get(by, ("", 1.0))[1]
        rows, replay_command = self.table, f"swash campaign replay {self.folder}"
        worst = []
        for k in order:
            number = int(rows["number"][k])
            command = f"{replay_command} {number} -o worst-{number}{self.findings.again}"
            worst.append(WorstRow(number, int(rows["seed"][k]), float(factor * values[k]), command))
        return tuple(worst)

    @property
    def standing(self) -> str:
        """How far it is, in words."""
        text = f"{len(self.done)} of {len(self.names)} tasks done"
        if self.refused:
            text += f", the results of {len(self.refused)} refused"
        if self.failed:
            text += f", {len(self.failed)} given up"
        left = len(self.names) - len(self.done) - len(self.failed) + len(self.refused)
        if left and not self.at_work:
            text += f"; `swash campaign resume {self.folder}` goes on"
        return text + (f"; at work: {self.at_work}" if self.at_work else "")

    def to_document(self) -> dict[str, object]:
        """The summary as what becomes JSON."""
        return {
            "kind": "campaign-results",
            "of": self.of,
            "tasks": len(self.names),
            "done": len(self.done),
            "rows": len(self.table.get("number", ())),
            "refused": dict(self.refused),
            "failed": {name: dict(failure) for name, failure in self.failed.items()},
            "summary": {label: text for label, text, _ in self.findings.summary},
            "careful": list(self.findings.careful),
            "quantiles": {
                name: {f"{share:g}": list(estimate) for share, estimate in zip(QUANTILES, every, strict=True)}
                for name, every in self.quantiles.items()
            },
            "worst": [row._asdict() for row in self.worst()],
        }

    def page(self, *, title: str | None = None) -> Report:
        """What `sp.report` writes: distributions, convergence, worst rows, failures."""
        findings = self.findings
        shapes = [
            Shape(name, unit, factor * np.asarray(self.table[name], dtype=np.float64), quantiles)
            for (name, (unit, factor)), quantiles in zip(findings.shown.items(), self.quantiles.values(), strict=True)
        ]
        unit = findings.shown.get(findings.worst, ("", 1.0))[0]
        return compose_campaign(
            title or str(self.document.get("title") or f"{self.of}: {self.folder.name}"),
            standing=self.standing,
            rows=CAMPAIGNS[self.of].rows,
            summary=findings.summary,
            careful=findings.careful,
            shares=QUANTILES,
            shapes=shapes,
            worst=self.worst(),
            worst_by=f"{findings.worst} [{unit}]" if unit else findings.worst,
            folder=str(self.folder),
            tables=findings.tables,
            refused=tuple(self.refused.values()),
            failed=[FailedTask(f["first"], f["count"], f["seed"], f["of"], tuple(f["tries"]))
                    for f in self.failed.values()],
        )  # fmt: skip

    def save(self, path: str | Path) -> Path:
        """Write the table: .nc (netCDF), .csv or .parquet.

        Raises:
            CampaignError: another ending.
            MissingLibraryError: for .parquet without the extra `scale`.
            WriteError: where it cannot be written.
        """
        import pandas as pd

        place, table = Path(path), tabulated(self.table)
        if place.suffix == ".nc":
            data = xr.Dataset({name: ("row", values) for name, values in table.items()})
            stream = io.BytesIO()
            data.to_netcdf(stream, engine="h5netcdf")
            return atomic.write_bytes(place, stream.getvalue())
        if place.suffix == ".parquet":
            library("pyarrow", what="a table in Parquet")
            return atomic.write_bytes(place, pd.DataFrame(table).to_parquet(engine="pyarrow", index=False))
        if place.suffix != ".csv":
            raise CampaignError(f"ends in '{place.suffix}', expected .nc, .csv or .parquet.", where=place)
        return atomic.write_text(place, pd.DataFrame(table).to_csv(index=False, na_rep="nan"))

    def __repr__(self) -> str:
        lines = [
            f"{self.of}: {self.standing}",
            *self.refused.values(),
            *(f"Careful: {text}" for text in self.findings.careful),
        ]
        lines += [f"{label}: {text}" for label, text, _ in self.findings.summary]
        if self.table and self.findings.shown:
            head = ("", *(f"{100 * share:g} %" for share in QUANTILES), "95 % interval of the last")
            rows = []
            for (name, (unit, _)), every in zip(self.findings.shown.items(), self.quantiles.values(), strict=True):
                last = f"{every[-1][1]:.4g} to {every[-1][2]:.4g}"
                rows.append((f"{name} [{unit}]" if unit else name, *(f"{estimate[0]:.4g}" for estimate in every), last))
            lines.append(text_table(head, rows))
        for caption, head, cells in self.findings.tables:
            lines.append(text_table(head, cells, left=(0, len(head) - 1)) if cells else caption)
        by = self.findings.worst
        if row := next(iter(self.worst(1)), None):
            lines.append(f"worst {by}: number {row.number}, seed {row.seed}: {row.command}")
        for failed in list(self.failed.values())[:3]:
            lines.append(f"given up: rows from {failed['first']} (seed {failed['seed']}): {failed['tries'][-1]}")
        return "\n".join(lines)


def campaign_results(folder: str | Path) -> Campaign:
    """What a campaign has found so far, also while it is computed.

    Args:
        folder: of the campaign.

    Raises:
        CampaignError: where there is none.
    """
    store = CampaignStore(folder)
    plan = planned_in(store)
    names = tuple(task.name for task in plan.tasks)
    failed = {name: failure for name, failure in store.failed().items() if name in set(names)}
    done = store.done() & set(names)
    rows = tuple(range(t.portion.first, t.portion.first + t.portion.count) for t in plan.tasks)
    return Campaign(Path(folder), plan.of, plan.document, names, rows, done, failed, at_work=store.owner)
