"""`FrequencyResponse`: what each input does to each output over frequency, how surely, and where not to believe it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, Complex
from swashplate.errors import IdentificationError
from swashplate.extras import library
from swashplate.identification.core.sources import DataSource, sources_named
from swashplate.identification.responses import response_file
from swashplate.identification.responses.shared_errors import SharedErrors
from swashplate.meant import taking_names
from swashplate.registry import listed, nearest
from swashplate.shown import Shown

if TYPE_CHECKING:
    pass

LEAST_COHERENCE = 0.6
"""Coherence from which on a response is used, where it stays there (Tischler and Remple 2012, ch. 7)."""

TWO_PI = 2.0 * np.pi


@dataclass(frozen=True)
class FrequencyResponse(Shown):
    """Responses of outputs to inputs; NaN where there is no number.

    Attributes:
        omega: frequencies [rad/s], shape (n_f,).
        inputs, outputs: channel names. input_units, output_units: of the channels.
        response: H [output unit / input unit], shape (n_f, n_outputs, n_inputs).
        coherence: partial coherence (ordinary with one input), same shape.
        multiple: part of each output's power that all inputs explain together, shape (n_f, n_outputs).
        error: random error: relative standard deviation of the magnitude, and of the phase [rad], shape as `response`.
        input_power: spectra of the inputs [unit^2/Hz], shape (n_f, n_inputs). output_power: shape (n_f, n_outputs).
        input_coherence: coherence between inputs, what the pilot mixed, shape (n_f, n_inputs, n_inputs).
        method: "direct", "joint" (with recorded references) or "along sweeps" (sweeps as their own references).
        windows: lengths used [s].
        sources: records used, with their intervals.
        warnings: what a reader must know. problems: what could not be computed, and why.
        settings: what was asked.
        direct, direct_error: beside a joint estimate or one along sweeps, the direct one and its random error, both as
            the windows blur them, shape as `response`; None with the direct estimate itself.
        shared: how the errors go together; None where it is not known.
    """

    omega: Array
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    response: Complex
    coherence: Array
    multiple: Array
    error: Array
    input_power: Array
    output_power: Array
    input_coherence: Array
    input_units: tuple[str, ...] = ()
    output_units: tuple[str, ...] = ()
    method: str = "direct"
    windows: tuple[float, ...] = ()
    sources: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)
    direct: Complex | None = None
    direct_error: Array | None = None
    shared: SharedErrors | None = None

    @property
    def data(self) -> tuple[DataSource, ...]:
        """The records with the hashes of their files and signals, "" where they came from elsewhere."""
        return sources_named(self.sources, self.settings.get("hashes", {}))

    def place(self, output: str, input: str) -> tuple[int, int]:
        """Indices of a pair.

        Raises:
            IdentificationError: naming the channel that is not there.
        """
        for name, names, role in ((output, self.outputs, "output"), (input, self.inputs, "input")):
            if name not in names:
                raise IdentificationError(
                    f"is no {role} of these responses; there are {listed(names)}.",
                    channel=name,
                    hint=nearest(name, names) or None,
                )
        return self.outputs.index(output), self.inputs.index(input)

    def pair(self, output: str, input: str) -> tuple[Complex, Array, Array]:
        """Response, coherence and random error of one pair, each of shape (n_f,)."""
        o, i = self.place(output, input)
        return self.response[:, o, i], self.coherence[:, o, i], self.error[:, o, i]

    def band(self, output: str, input: str, *, least: float = LEAST_COHERENCE) -> tuple[float, float] | None:
        """The widest band [rad/s] over which the coherence stays at or above `least`; None where there is none.

        Dips of a single line are bridged; a run below a quarter of an octave is a lucky point and no band.
        """
        h, coherence, _ = self.pair(output, input)
        good = np.isfinite(h) & (coherence >= least)
        bridged = good.copy()
        bridged[1:-1] |= good[:-2] & good[2:] & np.isfinite(h[1:-1])
        edges = np.flatnonzero(np.diff(np.concatenate([[0], bridged.astype(int), [0]])))
        runs = [(self.omega[a], self.omega[b - 1]) for a, b in zip(edges[::2], edges[1::2], strict=True)]
        runs = [run for run in runs if run[1] >= run[0] * 2.0**0.25]
        return max(runs, key=lambda run: run[1] / run[0]) if runs else None

    @taking_names
    def select(self, outputs: tuple[str, ...], inputs: tuple[str, ...]) -> FrequencyResponse:
        """The part with some outputs and inputs."""
        o = [self.place(name, self.inputs[0])[0] for name in outputs]
        i = [self.place(self.outputs[0], name)[1] for name in inputs]
        pairs = np.ix_(range(self.omega.size), o, i)
        return replace(
            self,
            inputs=inputs,
            outputs=outputs,
            response=self.response[pairs],
            coherence=self.coherence[pairs],
            multiple=self.multiple[:, o],
            error=self.error[pairs],
            input_power=self.input_power[:, i],
            output_power=self.output_power[:, o],
            input_coherence=self.input_coherence[np.ix_(range(self.omega.size), i, i)],
            input_units=tuple(self.input_units[j] for j in i) if self.input_units else (),
            output_units=tuple(self.output_units[j] for j in o) if self.output_units else (),
            direct=None if self.direct is None else self.direct[pairs],
            direct_error=None if self.direct_error is None else self.direct_error[pairs],
            shared=None if self.shared is None else self.shared.select(o, i),
        )

    # ---- other programs ----------------------------------------------------------------------------------------
    def to_control(self) -> Any:
        """The responses as a `control.FRD` of python-control (coherence and errors stay behind)."""
        control = library("control", what="to_control")
        data = np.moveaxis(self.response, 0, -1)
        # python-control's plots fail on responses without a name.
        return control.frd(data, self.omega, inputs=list(self.inputs), outputs=list(self.outputs), name="responses")

    @staticmethod
    def from_control(frd: Any) -> FrequencyResponse:
        """Responses from a `control.FRD`; coherence one and no random error, as nothing is known of them."""
        h = np.moveaxis(np.asarray(frd.frdata, dtype=np.complex128), -1, 0)
        n_f, n_out, n_in = h.shape
        return FrequencyResponse(
            omega=np.asarray(frd.omega, dtype=np.float64),
            inputs=tuple(frd.input_labels),
            outputs=tuple(frd.output_labels),
            response=h,
            coherence=np.ones(h.shape),
            multiple=np.ones((n_f, n_out)),
            error=np.zeros(h.shape),
            input_power=np.full((n_f, n_in), np.nan),
            output_power=np.full((n_f, n_out), np.nan),
            input_coherence=np.full((n_f, n_in, n_in), np.nan),
            settings={"from": "control.FRD"},
        )

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes the responses as netCDF without loss; returns the path."""
        return response_file.save({each.name: getattr(self, each.name) for each in fields(self)}, Path(path))

    @staticmethod
    def load(path: str | os.PathLike[str]) -> FrequencyResponse:
        """The responses in a file that `save` wrote.

        Raises:
            FlightError: where the file is missing, damaged, of a newer schema or something else.
        """
        return FrequencyResponse(**response_file.load(Path(path)))

    def to_document(self) -> dict[str, object]:
        """Summary and numbers as JSON types."""
        pairs = []
        for output in self.outputs:
            for name in self.inputs:
                h, coherence, error = self.pair(output, name)
                band = self.band(output, name)
                o, i = self.place(output, name)
                beside = {} if self.direct is None else _polar(self.direct[:, o, i], "direct_")
                pairs.append(
                    {
                        "output": output,
                        "input": name,
                        "band_hz": None if band is None else [band[0] / TWO_PI, band[1] / TWO_PI],
                        **_polar(h),
                        "coherence": coherence.tolist(),
                        "error": error.tolist(),
                        **beside,
                    }
                )
        return {
            "kind": "frequency-responses",
            "method": self.method,
            "frequency_hz": (self.omega / TWO_PI).tolist(),
            "responses": pairs,
            "windows": list(self.windows),
            "sources": list(self.sources),
            "warnings": list(self.warnings),
            "problems": list(self.problems),
            "settings": dict(self.settings),
        }

    # ---- looking -----------------------------------------------------------------------------------------------
    def rows(self, output: str, input: str, *, lines: int = 12) -> list[tuple[float, float, float, float, float]]:
        """Frequency [Hz], magnitude [dB], phase [deg], coherence and error [dB] at lines spread over the pair."""
        h, coherence, error = self.pair(output, input)
        known = np.flatnonzero(np.isfinite(h))
        chosen = known[np.unique(np.linspace(0, known.size - 1, min(lines, known.size)).astype(int))]
        phase = unwrapped_degrees(h)
        return [
            (
                float(self.omega[k] / TWO_PI),
                float(decibel(h[k])),
                float(phase[k]),
                float(coherence[k]),
                float(20.0 * np.log10(1.0 + error[k])),
            )
            for k in chosen
        ]

    def table(self, output: str, input: str, *, lines: int = 12) -> str:
        """One pair as text."""
        head = f"{output} / {input}\n{'Hz':>9}{'dB':>9}{'deg':>9}{'coherence':>11}{'+- dB':>8}"
        rows = self.rows(output, input, lines=lines)
        return "\n".join([head, *(f"{f:9.3f}{m:9.2f}{p:9.1f}{c:11.3f}{e:8.2f}" for f, m, p, c, e in rows)])

    def __repr__(self) -> str:
        low, high = self.omega[0] / TWO_PI, self.omega[-1] / TWO_PI
        lines = [
            f"FrequencyResponse ({self.method}): {_counted(self.outputs, 'output')}, {_counted(self.inputs, 'input')}, "
            f"{self.omega.size} lines {low:.3g}-{high:.3g} Hz, windows {', '.join(f'{w:.3g}' for w in self.windows)} s"
        ]
        lines.append(f"  {'output / input':<32}{'coherent band [Hz]':>20}{'coherence':>11}{'error [dB]':>12}")
        for output in self.outputs:
            for name in self.inputs:
                band, (h, coherence, error) = self.band(output, name), self.pair(output, name)
                if band is None:
                    lines.append(f"  {output + ' / ' + name:<32}{'none':>20}")
                    continue
                inside = (self.omega >= band[0]) & (self.omega <= band[1]) & np.isfinite(h)
                ends = f"{band[0] / TWO_PI:.3g} - {band[1] / TWO_PI:.3g}"
                middle = float(np.median(coherence[inside]))
                spread = float(20.0 * np.log10(1.0 + np.median(error[inside])))
                lines.append(f"  {output + ' / ' + name:<32}{ends:>20}{middle:>11.3f}{spread:>12.2f}")
        return "\n".join([*lines, *(f"! {text}" for text in (*self.problems, *self.warnings))])


def decibel(h: Any) -> Any:
    """20 log10 |h|."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return 20.0 * np.log10(np.abs(h))


def unwrapped_degrees(h: Complex, *, coherent: NDArray[np.bool_] | None = None) -> Array:
    """Phase [deg] without jumps of whole turns; NaN stay NaN and do not break the count of turns.

    The first line lies between -270 and +90 degrees, where a lag is expected.

    Args:
        h: shape (lines,).
        coherent: lines that count the turns, shape (lines,); noise between them adds none. None: all.
    """
    known = np.isfinite(h)
    counting = known if coherent is None or not (known & coherent).any() else known & coherent
    phase = np.full(h.shape, np.nan)
    if counting.any():
        degrees = np.degrees(np.unwrap(np.angle(h[counting])))
        phase[counting] = degrees - (360.0 if degrees[0] > 90.0 + 1e-9 else 0.0)
        others = known & ~counting
        phase[others] = turned_beside(np.degrees(np.angle(h)), phase)[others]
    return phase


def turned_beside(phase: Array, reference: Array) -> Array:
    """A phase [deg] with the whole turns that bring each line nearest to a reference, shapes (lines,).

    Where the reference is NaN, its value at the nearest lines that have one counts.
    """
    known = np.flatnonzero(np.isfinite(reference))
    if known.size == 0:
        return phase
    target = np.interp(np.arange(phase.size), known, reference[known])
    return np.asarray(phase + 360.0 * np.round((target - phase) / 360.0))


def _polar(h: Complex, before: str = "") -> dict[str, Any]:
    gain: Array = decibel(h)
    return {f"{before}magnitude_db": gain.tolist(), f"{before}phase_deg": unwrapped_degrees(h).tolist()}


def _counted(names: tuple[str, ...], what: str) -> str:
    return f"{len(names)} {what}{'s' * (len(names) != 1)}"
