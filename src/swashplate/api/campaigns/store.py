"""The folder of a campaign: its file, its plan, one file a task, and a lock that says who is at work."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec

from swashplate import atomic, documents, systems
from swashplate.api.campaigns.result_files import ENDING, LARGEST, packed, unpacked
from swashplate.api.campaigns.tasks import CampaignTask, Columns
from swashplate.errors import CampaignError
from swashplate.files import read_bytes

FILE, PLAN, LOCK = "campaign.toml", "plan.json", "lock"
RESULTS, FAILED, INPUTS = "results", "failed", "inputs"
_SCHEMA = 3


class _Plan(msgspec.Struct):
    """What `CampaignPlan.stored` writes."""

    of: str
    document: dict[str, Any]
    files: dict[str, str]
    program: dict[str, str]
    portions: list[tuple[int, int, int, str, str]]


class CampaignStore:
    """Results by the names of their tasks.

    A result is one file, `results/NAME.npz`, that appears by rename when it is complete and is never written again: a
    task that two workers have done after all is in the table once. What failed for good is `failed/NAME.json`.

    Args:
        folder: of the campaign; it need not be there.
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)

    @property
    def exists(self) -> bool:
        """Whether a campaign was ever begun here."""
        return (self.folder / PLAN).is_file()

    # ---- plan ------------------------------------------------------------------------------------------------------
    def begin(self, text: str, plan: Mapping[str, Any], files: Mapping[str, bytes]) -> None:
        """Write what the campaign is: its file, the files that it names, and what was made of it, the plan last."""
        for folder in (RESULTS, FAILED, INPUTS):
            atomic.make_folder(self.folder / folder)
        for content in files.values():
            atomic.write_bytes(self.folder / INPUTS / hashlib.sha256(content).hexdigest(), content)
        atomic.write_text(self.folder / FILE, text)
        atomic.write_json(self.folder / PLAN, {"kind": "campaign-plan", "schema": _SCHEMA, **plan})

    def plan(self) -> dict[str, Any]:
        """What `begin` was given.

        Raises:
            CampaignError: where there is no campaign, or one of another schema.
        """
        if not self.exists:
            raise CampaignError(
                "holds no campaign.", where=self.folder, hint="Begin one: swash campaign run FILE -o FOLDER"
            )
        path = self.folder / PLAN
        document = documents.read_document(path, form="json", error=CampaignError)
        if document.get("kind") != "campaign-plan" or document.get("schema") != _SCHEMA:
            raise CampaignError(
                f"is of schema {document.get('schema')}, expected {_SCHEMA}.",
                where=path,
                hint="Finish it with the version that began it, or begin anew in another folder.",
            )
        documents.checked(
            document, _Plan, where=path, error=CampaignError, hint="It is damaged: begin anew in another folder."
        )
        return document

    def text(self) -> str:
        """The campaign's file as it was."""
        return documents.read_text(self.folder / FILE, form="toml", error=CampaignError)

    def input(self, digest: str) -> bytes:
        """A file that the campaign's file names, by its SHA-256.

        Raises:
            CampaignError: where it is gone or another one.
        """
        path = self.folder / INPUTS / digest
        content = path.read_bytes() if path.is_file() else b""
        if hashlib.sha256(content).hexdigest() != digest:
            raise CampaignError(
                "is not the file that the campaign was begun with.", where=path, hint="Begin anew in another folder."
            )
        return content

    # ---- results ---------------------------------------------------------------------------------------------------
    def done(self) -> frozenset[str]:
        """Names of the tasks whose result is here."""
        return self._names(RESULTS, ENDING)

    def failed(self) -> dict[str, dict[str, Any]]:
        """What failed for good, by the task's name: see `give_up`."""
        failures = {}
        for name in sorted(self._names(FAILED, ".json") - self.done()):
            failures[name] = documents.read_document(self.folder / FAILED / f"{name}.json", form="json")
        return failures

    def _names(self, folder: str, ending: str) -> frozenset[str]:
        place = self.folder / folder
        if not place.is_dir():
            return frozenset()
        names = (Path(entry.name) for entry in os.scandir(place))
        return frozenset(n.stem for n in names if n.suffix == ending and not n.name.startswith("."))

    def _result(self, name: str) -> Path:
        """The file of a task's result."""
        return self.folder / RESULTS / f"{name}{ENDING}"

    def keep(self, task: CampaignTask, columns: Columns) -> None:
        """Write a task's result, once: where it is there already, nothing happens.

        Raises:
            WriteError: a full disk and the like; nothing of this result is left then, and everything before it is.
        """
        if self._result(task.name).exists():
            return
        try:
            content = packed(columns, task=task.name)
        except CampaignError as error:
            raise CampaignError(error.problem, where=f"task {task.name}", channel=error.channel) from None
        atomic.write_bytes(self._result(task.name), content)
        (self.folder / FAILED / f"{task.name}.json").unlink(missing_ok=True)

    def give_up(self, task: CampaignTask, reasons: Sequence[str]) -> None:
        """Write that a task has failed for good, with what was said at each try."""
        portion = task.portion
        document = {"first": portion.first, "count": portion.count, "seed": portion.seed, "of": portion.of}
        atomic.write_json(self.folder / FAILED / f"{task.name}.json", {**document, "tries": list(reasons)})

    def columns(self, name: str) -> Columns:
        """The result of a task.

        Raises:
            CampaignError: a file that cannot be read, that is no result, another task's, or whose values were changed.
        """
        return _unpacked(*self._content(name), name)

    def forget_refused(self, names: Iterable[str]) -> tuple[str, ...]:
        """Remove results that are not what was computed, so that their tasks are done again; returns these names.

        Raises:
            CampaignError: a file that cannot be read: it may be whole.
        """
        refused = []
        for name in names:
            path, content = self._content(name)
            try:
                _unpacked(path, content, name)
            except CampaignError:
                path.unlink(missing_ok=True)
                refused.append(name)
        return tuple(refused)

    def _content(self, name: str) -> tuple[Path, bytes]:
        path = self._result(name)
        try:
            return path, read_bytes(path, most=LARGEST)
        except OSError as error:
            raise CampaignError(f"cannot be read: {error.strerror}.", where=path, hint="Check the disk.") from None

    # ---- lock ------------------------------------------------------------------------------------------------------
    @contextmanager
    def held(self) -> Iterator[None]:
        """The store, for one client alone; the lock goes when the process ends, however it ends.

        Raises:
            CampaignError: where another client has it, with who that is.
        """
        atomic.make_folder(self.folder)
        path = self.folder / LOCK
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | systems.BYTES, 0o644)
        try:
            if not _locked(descriptor):
                raise CampaignError(
                    f"is in use by {_owner(path)}.",
                    where=self.folder,
                    hint="Wait for it, or look at it with `swash campaign status`; each store has one client.",
                )
            now = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
            me = {"process": os.getpid(), "host": platform.node(), "since": now}
            os.ftruncate(descriptor, 0)
            os.lseek(descriptor, 0, os.SEEK_SET)
            os.write(descriptor, json.dumps(me).encode())
            yield
            os.ftruncate(descriptor, 0)
        finally:
            os.close(descriptor)

    @property
    def owner(self) -> str:
        """Who is at work here, in words; "" where nobody is."""
        try:
            descriptor = os.open(self.folder / LOCK, os.O_RDONLY)
        except OSError:
            return ""
        try:
            systems.lock(descriptor, shared=True)
        except OSError:
            return _owner(self.folder / LOCK)
        finally:
            os.close(descriptor)
        return ""


def _unpacked(path: Path, content: bytes, name: str) -> Columns:
    try:
        return unpacked(content, task=name)
    except Exception as error:  # whatever the libraries raise on damaged bytes is the file's fault
        reason, hint = str(error).rstrip(".") or type(error).__name__, "`swash campaign resume` does the task again."
        raise CampaignError(f"is no result of its task: {reason}.", where=path, hint=hint) from None


def _locked(descriptor: int) -> bool:
    """The lock, taken; asked some times, for whoever only looks at a store holds it for an instant."""
    for attempt in range(5):
        try:
            systems.lock(descriptor)
            return True
        except OSError:
            time.sleep(0.02 * (attempt < 4))
    return False


def _owner(path: Path) -> str:
    try:
        owner = json.loads(path.read_text(encoding="utf-8"))
        return f"process {owner['process']} on {owner['host']} since {owner['since']}"
    except (OSError, ValueError, KeyError, TypeError):
        return "another process"
