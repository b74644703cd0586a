"""`swash plot`: look at any log, several over each other, over time or over frequency."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swashplate.cli import options
from swashplate.cli.reading import asked
from swashplate.errors import SwashError

_ALIGNMENTS = ("auto", "motion", "clock", "start", "none")
_THEMES = ("paper", "light", "dark")


def plot(
    logs: Annotated[list[str], typer.Argument(metavar="LOG...", help="Logs, or windows of them (FILE@5-30).")],
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="FILE", help="File to write: .pdf, .svg, .png, or .html to zoom in.")
    ] = Path("plot.html"),
    channels: Annotated[
        str | None,
        typer.Option(
            "--channels", metavar="NAME,NAME", help="Channels to draw, one panel each; the usual ones by default."
        ),
    ] = None,
    spectrum: Annotated[bool, typer.Option("--spectrum", help="Power spectral density instead (Welch).")] = False,
    spectrogram: Annotated[bool, typer.Option("--spectrogram", help="Power over time and frequency instead.")] = False,
    align: Annotated[
        str, typer.Option("--align", metavar="HOW", help=f"How to align several logs: {', '.join(_ALIGNMENTS)}.")
    ] = "auto",
    theme: Annotated[
        str, typer.Option("--theme", metavar="NAME", help=f"Colours of a .pdf, .svg or .png: {', '.join(_THEMES)}.")
    ] = "paper",
    mapping: options.Mapping = None,
    unit: options.Units = None,
    drop_bad_stamps: options.BadStamps = False,
    quiet: options.Quiet = False,
) -> None:
    """Draw a log's channels as they were recorded; several logs are drawn over each other, aligned in time."""
    from swashplate.api.plot_logs import plot_logs
    from swashplate.cli.reading import read

    for value, known, option in ((align, _ALIGNMENTS, "--align"), (theme, _THEMES, "--theme")):
        if value not in known:
            raise SwashError(f"'{value}' is unknown, expected one of {', '.join(known)}.", channel=option)
    if spectrum and spectrogram:
        raise SwashError("and --spectrum are two figures.", channel="--spectrogram", hint="Give one of them.")
    how = asked(mapping, unit, drop_bad_stamps)
    flights = [read(log, how=how) for log in logs]
    drawn, aligned = plot_logs(
        flights,
        channels=[name.strip() for name in channels.split(",")] if channels else None,
        kind="spectrum" if spectrum else "spectrogram" if spectrogram else "time",
        path=out,
        theme=theme,  # one of the names above  # pyrefly: ignore[bad-argument-type]
        alignment=align,  # pyrefly: ignore[bad-argument-type]
    )
    if not quiet:
        for words in aligned.words:
            typer.echo(f"aligned: {words}")
        typer.echo(drawn.alt)
        typer.echo(f"Written: {out}")
