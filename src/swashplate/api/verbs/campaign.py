"""`swash campaign`: many flights, fits or logs, on every core of one machine or of many."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from swashplate.api.question import Answer, VerbQuestion, argument, option, setting, verb
from swashplate.api.saying import Say, silent
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.api.campaigns.plan import CampaignPlan
    from swashplate.api.campaigns.results import Campaign
    from swashplate.api.campaigns.scheduler import DaskScheduler

_PEM = "PEM file for scheduler; by default as Dask's configuration says"


class OnWorkers(VerbQuestion[Answer]):
    """Who computes."""

    told_every: ClassVar[float | None] = 10.0

    workers: int | None = option(
        default=None, help="Processes on this machine, one core each; by default all cores.", least=1
    )
    scheduler: str | None = option(
        default=None, metavar="ADDRESS", help="Address of a Dask scheduler, tls://host:8786, whose workers are used."
    )
    insecure: bool = setting(
        default=False, help="take a scheduler without TLS: whoever reaches its port can run commands as you."
    )
    tls_ca_file: Path | None = setting(default=None, help=f"certificate that has signed all others: {_PEM}")
    tls_cert: Path | None = setting(default=None, help=f"certificate of this client: {_PEM}")
    tls_key: Path | None = setting(default=None, help=f"key of that certificate: {_PEM}")

    def where(self) -> DaskScheduler | None:
        """The scheduler, where one is named."""
        from swashplate.api.campaigns.scheduler import DaskScheduler

        if self.scheduler is None:
            if self.tls_ca_file or self.tls_cert or self.tls_key or self.insecure:
                hint = "Files for TLS and --insecure belong to one."
                raise SwashError("is missing.", channel="--scheduler", hint=hint)
            return None
        return DaskScheduler(
            self.scheduler, ca=self.tls_ca_file, certificate=self.tls_cert, key=self.tls_key, insecure=self.insecure
        )

    def problems(self, answer: Any) -> list[str]:
        return _problems(answer, judged=True)


def _problems(study: Campaign | CampaignPlan, *, judged: bool) -> list[str]:
    from swashplate.api.campaigns.plan import CampaignPlan

    if isinstance(study, CampaignPlan):
        return []
    refused = list(study.refused.values())[:3]
    if refused or not judged or not study.failed:
        return refused
    return [f"{len(study.failed)} of {len(study.names)} tasks were given up: swash campaign status {study.folder}"]


class RunCampaign(OnWorkers[Any]):
    """Compute a campaign into the folder of --out, or continue one that was stopped.

    Raises:
        CampaignError: a file that is none; one that has changed, with what has; a store that another client holds; no
            scheduler, one without TLS that was not asked for, or a worker that is another program; nothing that can be
            done.
        WriteError: a store that cannot be written to.
    """

    file: Path = argument(metavar="FILE", help="The campaign: a TOML file (docs/howto/campaigns.md).")
    folder: Path | None = option(
        default=None, flag="--out", metavar="DIR", help="Folder for the results.", kw_only=False
    )
    dry_run: bool = option(default=False, help="Only print cost and size: two tasks are computed.")
    accept_changes: bool = setting(
        default=False, help="continue although the file or the program has changed: what is the same is kept"
    )

    def answer(self, say: Say = silent) -> Any:
        from swashplate.api.campaigns.plan import plan_campaign
        from swashplate.api.campaigns.verbs import run_campaign

        self.where()  # what is wrong in what was typed comes first
        if self.dry_run:
            say("doing the first task twice")
            return plan_campaign(self.file, measure=True)
        if self.folder is None:
            plan_campaign(self.file)
            raise SwashError("is missing.", channel="--out", hint="Say where results are kept: -o FOLDER.")
        return run_campaign(self, self.folder, say)


class ResumeCampaign(OnWorkers["Campaign"]):
    """Continue a campaign from its folder, with any number of workers on any machine.

    Raises:
        CampaignError: no campaign there, another client at work, another program than it was begun with.
        WriteError: a store that cannot be written to.
    """

    folder: Path = argument(metavar="FOLDER", help="Folder of the campaign.")
    retry_failed: bool = option(default=False, help="Try failed tasks again.")

    def answer(self, say: Say = silent) -> Campaign:
        from swashplate.api.campaigns.verbs import go_on

        return go_on(self, say)


class OfCampaign(VerbQuestion["Campaign"]):
    """A campaign that was begun."""

    folder: Path = argument(metavar="FOLDER", help="Folder of the campaign.")

    def answer(self, say: Say = silent) -> Campaign:
        from swashplate.api.campaigns.results import campaign_results

        return campaign_results(self.folder)

    def problems(self, answer: Any) -> list[str]:
        return _problems(answer, judged=False)


class ShowCampaign(OfCampaign):
    """Show the progress, the workers and the results so far of a campaign, also while it runs."""


class ReportCampaign(OfCampaign):
    """Distributions, worst rows with the command that shows each again, convergence of the quantiles, and failures.

    --out FILE.html writes a page; FILE.nc, FILE.csv or FILE.parquet the table.
    """

    files: ClassVar[tuple[str, ...]] = ("report.html",)
    by_name: ClassVar[tuple[str, ...]] = ("results.nc", "results.csv", "results.parquet")
    needs_out: ClassVar[bool] = True

    def text(self, answer: Campaign, width: int) -> list[Any]:
        return []


class ReplayRow(VerbQuestion[Any]):
    """Compute one row again and save it, for example the worst flight of a thousand. Its whole task is repeated.

    --out is a flight as .nc, or a fit as .json.
    """

    by_name: ClassVar[tuple[str, ...]] = ("row.nc", "row.json", "row.csv")
    needs_out: ClassVar[bool] = True

    folder: Path = argument(metavar="FOLDER", help="Folder of the campaign.")
    number: int = argument(metavar="NUMBER", help="Number of the row in the report.")

    def answer(self, say: Say = silent) -> Any:
        from swashplate.api.campaigns.verbs import replay_campaign

        if self.number < 0:
            raise SwashError(f"is {self.number}, expected 0 or more.", channel="NUMBER")
        say("doing the row's task again")
        return replay_campaign(self.folder, self.number)

    def text(self, answer: Any, width: int) -> list[Any]:
        return []


campaign = verb("campaign", RunCampaign)
resume_campaign = verb("resume_campaign", ResumeCampaign)
