"""What was done on the page as a command line and as lines of Python, to copy: they do the same."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import PurePath

from swashplate.links.logs.remedies import Remedy


@dataclass(frozen=True)
class Code:
    """One action of the page.

    Attributes:
        title: what was done.
        shell: commands, one a line; "" where the command line has none for it.
        python: lines that run as they stand.
    """

    title: str
    shell: str
    python: str

    def as_dict(self) -> dict[str, str]:
        """As the page has it."""
        return {"title": self.title, "shell": self.shell, "python": self.python}


@dataclass(frozen=True)
class Read:
    """How one log is read: the file as the user knows it, and the options."""

    file: str
    options: Remedy = field(default_factory=Remedy)
    mapping: str = ""
    log: int | None = None

    @property
    def words(self) -> str:
        """The options of a command that reads this log."""
        mapping = f"--mapping {shlex.quote(self.mapping)}" if self.mapping else ""
        return " ".join(part for part in (mapping, self.options.words) if part)

    def named(self, start: float | None = None, stop: float | None = None) -> str:
        """The log as a command's argument, or the part of it from start to stop [s]."""
        number = "" if self.log is None else f"#{self.log}"
        part = "" if start is None or stop is None else f"@{start:.10g}-{stop:.10g}"
        return shlex.quote(f"{self.file}{number}{part}")

    def python(self, name: str = "flight") -> str:
        """The line that reads it."""
        given = [repr(self.file)]
        if self.options.units:
            given.append(f"units={dict(self.options.units)!r}")
        if self.mapping:
            given.append(f"mapping={self.mapping!r}")
        if self.options.drop_bad_stamps:
            given.append('bad_stamps="drop"')
        if self.log is not None:
            given.append(f"log={self.log}")
        return f"{name} = sp.read({', '.join(given)})"

    def with_mapping(self, mapping: str) -> Read:
        """The same by a mapping, which says the units."""
        return replace(self, mapping=mapping, options=Remedy({}, self.options.drop_bad_stamps))

    def with_remedy(self, remedy: Remedy) -> Read:
        """The same with more options."""
        units = {**self.options.units, **remedy.units}
        return replace(self, options=Remedy(units, self.options.drop_bad_stamps or remedy.drop_bad_stamps))


IMPORT = "import swashplate as sp"


def inspected(read: Read) -> Code:
    """Looking at a log."""
    shell = " ".join(part for part in ("swash inspect", read.named(), read.words) if part)
    return Code(
        f"Read {PurePath(read.file).name}", shell, "\n".join([IMPORT, read.python(), "print(sp.inspect(flight))"])
    )


def plotted(reads: Sequence[Read], channels: Sequence[Sequence[str]], span: tuple[float, float] | None) -> Code:
    """Channels of one or several logs over time, one figure a log; `span` is that of the first log [s]."""
    lines = [IMPORT]
    for k, (read, names) in enumerate(zip(reads, channels, strict=True)):
        flight = "flight" if len(reads) == 1 else f"flight_{k + 1}"
        lines.append(read.python(flight))
        if span is not None and k == 0:
            lines.append(f"{flight} = {flight}.between({span[0]:.6g}, {span[1]:.6g})")
        lines.append(f"figure = {flight}.plot(channels={list(names)!r})")
        lines.append(f'figure.savefig("{"flight" if len(reads) == 1 else f"flight-{k + 1}"}.pdf")')
    named = [read.named(*span) if k == 0 and span is not None else read.named() for k, read in enumerate(reads)]
    every = ",".join(dict.fromkeys(name for names in channels for name in names))
    words = {read.words for read in reads}
    # One command has one set of options: logs that were read differently, or lack a channel, have none.
    alike = len(words) == 1 and len({tuple(names) for names in channels}) == 1
    shell = f"swash plot {' '.join(named)} --channels {every} --out flight.pdf {words.pop()}".strip() if alike else ""
    return Code("Plot", shell, "\n".join(lines))


def aligned(first: Read, second: Read) -> Code:
    """Bringing a log on the clock of another one."""
    lines = [IMPORT, first.python("first"), second.python("second"), "print(sp.synchronise(first, second))"]
    return Code(f"Align {PurePath(second.file).name} with {PurePath(first.file).name}", "", "\n".join(lines))


def spectra(read: Read, channel: str, start: float, stop: float, *, rotor: bool) -> Code:
    """The density of a channel, and what a rotor shakes into it."""
    part = f"'{channel}', start={start:.6g}, stop={stop:.6g}"
    lines = [IMPORT, read.python(), f"density = sp.spectrum(flight, {part})", "print(density)"]
    lines.append(f"over_time = sp.spectrogram(flight, {part})")
    if rotor:
        lines.append(f"print(sp.harmonics(flight, {part}))")
    shell = f"swash plot {read.named(start, stop)} --channels {channel} --spectrum --out spectrum.pdf {read.words}"
    return Code(f"Spectrum of {channel}", shell.strip(), "\n".join(lines))


def tracked(read: Read, channels: Sequence[str], *, whole: bool) -> Code:
    """The channels of the track over time; where place and attitude are whole, `swash replay` draws it too."""
    lines = [IMPORT, read.python(), f"figure = flight.plot(channels={list(channels)!r})", 'figure.savefig("track.pdf")']
    shell = f"swash replay {read.named()} {read.words}".strip() if whole else ""
    return Code("Track", shell, "\n".join(lines))


def identified(
    read: Read,
    part: tuple[float, float],
    chosen: tuple[str, str, str],
    band: tuple[float, float],
    seen: tuple[Read, float, float],
    *,
    gains: bool,
    unseen: bool,
) -> Code:
    """From a sweep to gains; `chosen` are input, output and reference, `seen` what the model is flown along.

    `unseen`: whether the fit has not seen that; else the lines say so.
    """
    moved, answer, reference = chosen
    other, start, stop = seen
    shell = [
        f"swash respond {read.named(*part)} --inputs {moved} --outputs {answer}"
        + (f" --references {reference}" if reference else "")
        + f" --band {band[0]:g}-{band[1]:g} --out responses {read.words}".rstrip(),
        f"swash fit-tf responses --input {moved}{' --gains' if gains else ''} --hold-out {other.named(start, stop)}"
        + f" --out study {other.words}".rstrip(),
    ]
    called = "unseen" if unseen else "fitted"
    said = [] if unseen else ["# The fit has seen this stretch: it verifies nothing."]
    names = [moved, answer, *([reference] if reference else [])]
    references = f"references=[{reference!r}], " if reference else ""
    lines = [
        IMPORT,
        read.python(),
        f"records = sp.uniform_records(flight.between({part[0]:.10g}, {part[1]:.10g}), {names!r})",
        f"responses = sp.respond(records, inputs=[{moved!r}], outputs=[{answer!r}], {references}band={band!r})",
        other.python("other"),
        *said,
        f"{called} = other.between({start:.10g}, {stop:.10g})",
        f"study = sp.fit_tf(responses, input={moved!r}, gains={gains}, hold_out={called})",
        "print(study)",
        'study.save("study")',
    ]
    return Code(f"Identify {answer} / {moved}", "\n".join([shell[0], *said, *shell[1:]]), "\n".join(lines))
