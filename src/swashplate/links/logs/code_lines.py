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

    def to_document(self) -> dict[str, str]:
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
    def option_text(self) -> str:
        """The options of a command that reads this log."""
        mapping = f"--mapping {shlex.quote(self.mapping)}" if self.mapping else ""
        return " ".join(part for part in (mapping, self.options.option_text) if part)

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

    def called(self, name: str) -> Read:
        """The same of a file of another name, with a mapping that lies beside it."""
        return replace(self, file=name, mapping="mapping.toml" if self.mapping else "")

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
    shell = " ".join(part for part in ("swash inspect", read.named(), read.option_text) if part)
    return Code(
        f"Read {PurePath(read.file).name}", shell, "\n".join([IMPORT, read.python(), "print(sp.inspect(flight))"])
    )


def reviewed(read: Read) -> Code:
    """What a flight tells without a sweep."""
    shell = " ".join(part for part in ("swash inspect", read.named(), read.option_text) if part)
    return Code(
        f"Review {PurePath(read.file).name}", shell, "\n".join([IMPORT, read.python(), "print(sp.review(flight))"])
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
    options = {read.option_text for read in reads}
    # One command has one set of options: logs that were read differently, or lack a channel, have none.
    alike = len(options) == 1 and len({tuple(names) for names in channels}) == 1
    shell = (
        f"swash inspect {' '.join(named)} --channels {every} --out flight.pdf {options.pop()}".strip() if alike else ""
    )
    return Code("Plot", shell, "\n".join(lines))


def aligned(first: Read, second: Read) -> Code:
    """Bringing a log on the clock of another one."""
    given = "from swashplate.flights.conditioning.synchronise import synchronise"
    reads = [first.python("first"), second.python("second")]
    lines = [IMPORT, given, *reads, "print(synchronise(first, second))"]
    return Code(f"Align {PurePath(second.file).name} with {PurePath(first.file).name}", "", "\n".join(lines))


def spectra(read: Read, channel: str, start: float, stop: float, *, rotor: bool) -> Code:
    """The density of a channel, and what a rotor shakes into it."""
    part = f"'{channel}', start={start:.6g}, stop={stop:.6g}"
    lines = [IMPORT, read.python(), f"density = sp.spectrum(flight, {part})", "print(density)"]
    lines.append(f"over_time = sp.spectrogram(flight, {part})")
    if rotor:
        lines.append(f"print(sp.harmonics(flight, {part}))")
    asked = f"--channels {channel} --figure spectrum --out spectrum.pdf"
    shell = f"swash inspect {read.named(start, stop)} {asked} {read.option_text}"
    return Code(f"Spectrum of {channel}", shell.strip(), "\n".join(lines))


def tracked(read: Read, channels: Sequence[str], *, replayable: bool) -> Code:
    """The channels of the track over time; where place and attitude are whole, `swash live --replay` draws it too."""
    lines = [IMPORT, read.python(), f"figure = flight.plot(channels={list(channels)!r})", 'figure.savefig("track.pdf")']
    shell = f"swash live --replay {read.named()} {read.option_text}".strip() if replayable else ""
    return Code("Track", shell, "\n".join(lines))


def identified(
    parts: Sequence[tuple[Read, float, float]],
    chosen: Sequence[tuple[str, str, str]],
    references: Sequence[str],
    band: tuple[float, float],
    hold_outs: Sequence[tuple[Read, float, float, bool]],
    fits: Sequence[tuple[str, tuple[float, float], bool]],
) -> Code:
    """From sweeps to gains, axis by axis.

    Args:
        parts: of the logs that are fitted. chosen: input, output and reference of each axis.
        hold_outs: what each axis' model is flown along, and whether the fit has not seen that; else the lines say so.
        fits: form, band [Hz] and whether gains are asked for, by axis.
    """
    inputs, outputs = ([one[k] for one in chosen] for k in (0, 1))
    warning = "# The fit has seen this stretch: it verifies nothing."
    reads: list[Read] = []
    for read, *_ in parts:
        reads += [read] if read not in reads else []
    options = " ".join(dict.fromkeys(read.option_text for read in reads if read.option_text))
    logs = " ".join(read.named(start, stop) for read, start, stop in parts)
    asked = f"--inputs {','.join(inputs)} --outputs {','.join(outputs)}"
    given = f" --references {','.join(references)}" if references else ""
    shell = [f"swash respond {logs} {asked}{given} --band {band[0]:g}-{band[1]:g} --out responses {options}".rstrip()]
    names, lines = [*inputs, *outputs, *references], [IMPORT]
    flights = ["flight" if len(reads) == 1 else f"flight_{k + 1}" for k in range(len(reads))]
    lines += [read.python(name) for read, name in zip(reads, flights, strict=True)]
    pieces = [f"{flights[reads.index(read)]}.between({start:.10g}, {stop:.10g})" for read, start, stop in parts]
    listed = pieces[0] if len(pieces) == 1 else f"[{', '.join(pieces)}]"
    lines.append(f"records = sp.uniform_records({listed}, {names!r})")
    given = f"references={list(references)!r}, " if references else ""
    lines.append(f"responses = sp.respond(records, inputs={inputs!r}, outputs={outputs!r}, {given}band={band!r})")
    for k, (axis, stretch, fit) in enumerate(zip(chosen, hold_outs, fits, strict=True)):
        (driven, answer, _), (other, start, stop, unseen), (form, (low, high), wanted) = axis, stretch, fit
        end = "" if len(chosen) == 1 else f"-{answer}"
        shell += [] if unseen else [warning]
        asked = f"--input {driven} --outputs {answer} --form {form} --band {low:g}-{high:g}{' --gains' * wanted}"
        unseen_part = f"--hold-out {other.named(start, stop)} --out study{end} {other.option_text}".rstrip()
        shell.append(f"swash identify --responses responses {asked} {unseen_part}")
        called, study = "unseen" if unseen else "fitted", "study" if len(chosen) == 1 else f"study_{k + 1}"
        lines += [other.python("other"), *([] if unseen else [warning])]
        lines += [
            f"{called} = other.between({start:.10g}, {stop:.10g})",
            f"{study} = sp.fit_tf(responses, input={driven!r}, outputs=[{answer!r}], form={form!r}, "
            f"band=({low:g}, {high:g}), gains={wanted}, hold_out={called})",
            f"print({study})",
            f'{study}.save("study{end}")',
        ]
    title = ", ".join(f"{answer} / {driven}" for driven, answer, _ in chosen)
    return Code(f"Identify {title}", "\n".join(shell), "\n".join(lines))
