"""A question carried out on the command line: answered, written where `--out` says, shown, and ended."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import typer

from swashplate.api.question import VerbQuestion
from swashplate.api.saying import QUIET
from swashplate.cli.generate import checked_endings, raise_missing, typer_context
from swashplate.cli.guard import Exit, complain
from swashplate.errors import SwashError


def carry_out(question: VerbQuestion[Any], outs: tuple[Path, ...]) -> None:
    """Do what is asked. Folders are made first: a place that cannot be written to is found before an hour of computing.

    A fit that is stopped is kept as far as it came; the exit code is then 128 and the signal's number.
    """
    from swashplate.cli.console import as_json, progress
    from swashplate.identification.core.stopping import stoppable

    flags = typer_context().meta
    json, quiet = bool(flags.get("json")), bool(flags.get("quiet"))
    QUIET.set(quiet)
    checked_endings(question, outs)
    question.check_places(outs)
    if question.needs_out and not outs:
        raise_missing("'--out' / '-o'", "option")
    paths: list[Path] = []
    with stoppable() as stop, progress(quiet=quiet or json, every=question.told_every) as line, ExitStack() as stack:
        places = [stack.enter_context(written(question, out, paths)) for out in outs]
        answer = question.answer(line.say)
        question.finish(answer)
        for place, names in places:
            line.say("writing")
            question.write(answer, place, names)
    asked = [out.parent / out.stem for out in outs]
    paths.sort(key=lambda path: asked.index(path.parent / path.stem))
    for remark in question.remarks(answer):
        typer.echo(remark, err=True)
    if json:
        document = question.document(answer)
        files = {"written": list(map(str, paths))} if paths and isinstance(document, dict) else {}
        typer.echo(as_json({**document, **files} if files else document))
    elif not quiet:
        _show(question, answer, paths)
    problems = question.problems(answer)
    if problems or stop.code:
        complain(" ".join([*problems, *([stop.sentence] if stop.code and not problems else [])]))
        raise typer.Exit(stop.code or Exit.INPUT)


def _show(question: VerbQuestion[Any], answer: Any, paths: list[Path]) -> None:
    from swashplate.cli.console import console

    screen = console()
    for part in question.text(answer, screen.width):
        if isinstance(part, str):
            typer.echo(part)
        else:
            screen.print(part)
    if paths:
        typer.echo("\n" + written_text(paths))


def written_text(paths: list[Path]) -> str:
    """What was written, for the last line of a command: files, or the report in its folder."""
    reports = [path for path in paths if path.is_dir() and (path / "report.html").is_file()]
    files = [path for path in paths if path not in reports]
    lines = [f"Report: {path / 'report.html'}" for path in reports]
    return "\n".join(lines + ([f"Written: {', '.join(map(str, files))}"] if files else []))


def _is_file(question: VerbQuestion[Any], out: Path) -> bool:
    endings = {Path(name).suffix for name in (*question.files, *question.by_name)}
    return out.suffix.lower() in endings and not out.is_dir()


@contextmanager
def written(
    question: VerbQuestion[Any], out: Path, paths: list[Path] | None = None
) -> Iterator[tuple[Path, tuple[str, ...]]]:
    """A folder for what is written to `out`, and the names of it; it appears at `out` when all is complete.

    Args:
        question: says what it writes. out: a folder, or a file whose ending says which.
        paths: gets the folder, or the files.
    """
    from swashplate import atomic

    if not _is_file(question, out):
        with atomic.folder_when_complete(out, ours=question.ours(out)) as folder:
            yield folder, question.files
        if paths is not None:
            paths.append(out)
        return
    if not out.absolute().parent.is_dir():
        raise SwashError("the folder does not exist.", where=out.parent, channel="--out", hint="Make it first.")
    with atomic.scratch_folder(out.absolute().parent) as folder:
        yield folder, (out.name,)
        if (folder / out.name).is_file():
            files = sorted(file for file in folder.iterdir() if file.stem == out.stem)
        else:
            ours = (*question.files, *question.by_name)
            chosen = next(name for name in ours if Path(name).suffix == out.suffix.lower())
            files = [folder / chosen] if (folder / chosen).is_file() else []
        for file in files:
            target = out if len(files) == 1 else out.parent / file.name
            with atomic.replaced_when_complete(target) as place:
                shutil.copyfile(file, place)
            if paths is not None:
                paths.append(target)
