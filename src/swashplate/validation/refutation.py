"""Does a record refute a linear model? One-step predictions of all models behind one and the same noise filter.

A record y of a helicopter in a loop is y = H u + d: what the controls do, and gusts and noise. An autoregression with
controls, A y = B u + e, fitted to the record itself, tells how d is coloured and how large its innovations e are
(`noise_filter`). A model M predicts by its own answer to the controls and by that same filter:

    y(t | t-1) = M u(t) + (1 - A) (y - M u)

With the right M the errors A (y - M u) are white noise w. The autoregression leaves e = (1 - P) w, P the projection on
its own columns. So the two differ by P w, which is small and whose size is known; a wrong model adds A (H - M) u to
that. The difference is compared by record, output and band, beside that of a model without any control.

Which of its own parameters a record asks a model to change, and whether that matters.

Behind the noise filter a right model's errors are white, and one whose parameters are off by d has S d besides, S what
they do to its predictions. Bounds say how large d may be. Of one parameter, the others free within their bounds, least
squares over all records, outputs and bands at once tell the change that the records ask for and how sure it is. An
error that hides below what noise allows in every single band does not hide from that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, Complex
from swashplate.identification.frequency.response_cost import INDISTINGUISHABLE, PHASE_WEIGHT, POINTS
from swashplate.identification.time.linear_simulation import answers
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.validation.noise_filter import INDEPENDENT, NoiseFilter, NoiseLevel, Piece, averaged, spectrum


@dataclass(frozen=True)
class AskedChange:
    """A parameter that the records want elsewhere.

    Attributes:
        name, value, wanted: of the parameter, and what the records ask for instead.
        sigmas: how far apart, in standard deviations of its bound and of what the records tell, together.
        share: of what the controls do that the change moves, in the band and output where it moves most.
    """

    name: str
    value: float
    wanted: float
    sigmas: float
    share: float

    @property
    def summary_text(self) -> str:
        return (
            f"{self.name} = {self.value:.4g}, and the records ask for {self.wanted:.4g}, {self.sigmas:.0f} standard "
            f"deviations away; that moves up to {100.0 * self.share:.0f} % of what the controls do."
        )


class ParameterErrors:
    """What records tell of a model's parameters, gathered record by record in units of their bounds."""

    def __init__(self, count: int) -> None:
        self.information, self.pull = np.zeros((count, count)), np.zeros(count)

    def add(self, slopes: Complex, error: Complex, used: NDArray[np.bool_]) -> None:
        """Lines of one record, each of noise of size one.

        Args:
            moved: what one bound of each parameter does (n, k, p). error: of the predictions (n, k).
            used: which lines (n, k).
        """
        s, e = slopes[used], error[used]
        self.information += 2.0 * INDEPENDENT * np.real(s.conj().T @ s)
        self.pull += 2.0 * INDEPENDENT * np.real(s.conj().T @ e)

    def asked(self) -> tuple[Array, Array]:
        """Change of every parameter that the records ask for, and its standard deviation, in bounds."""
        change, spread = np.zeros(self.pull.size), np.full(self.pull.size, np.inf)
        for i in range(self.pull.size):
            rest = np.arange(self.pull.size) != i
            beside = np.linalg.solve(
                self.information[np.ix_(rest, rest)] + np.eye(rest.sum()), self.information[rest, i]
            )
            remaining = self.information[i, i] - self.information[i, rest] @ beside
            if remaining > 1e-9 * max(self.information[i, i], 1e-300):
                change[i] = (self.pull[i] - self.pull[rest] @ beside) / remaining
                spread[i] = 1.0 / np.sqrt(remaining)
        return change, spread


REFUTED, STANDS, OPEN = "refuted", "not refuted", "cannot be judged"

FALSE_ALARM = 1e-3
"""Chance that the noise alone refutes a right model, over all records, outputs and bands together."""

SIGMAS = 3.0
"""Standard deviations of its parameters by which a model's answer may be off."""

DOUBTED = 2.0
"""By so much bounds may be too narrow: a parameter refutes a model only beyond as many times `SIGMAS` of them."""

_DB, _DEG = 20.0 / np.log(10.0), 180.0 / np.pi
MATERIAL = float(np.sqrt(INDISTINGUISHABLE / POINTS / (0.5 * _DB**2 + 0.5 * PHASE_WEIGHT * _DEG**2)))
"""An error below this share of what the controls do refutes no model (0.19).

It is the relative error of a response whose J is 50, up to which a model can hardly be told from the flight (Tischler
and Remple 2012): J per point is 20 [(8.69 Re)^2 + 0.01745 (57.3 Im)^2] of it, its two parts taken as equal.
"""

UNSEEN = 1.0
"""Errors up to this many times the noise refute no model: a controller may have felt more of the gusts than the record
shows, and then the controls predict a part of the noise, whatever the model."""

HEARD = 2.0
"""What the controls do counts where its power is this many times the noise's largest."""

_TOP, _PER_TOP, _STEP_OF_BANDS, _STEP_OF_SLOPES = 10.0, 4.0, 3.4, 0.02
"""Highest frequency [Hz] where no band is given; samples per period of it; ratio of bands; relative step of slopes."""


@dataclass(frozen=True)
class Finding:
    """One output of one record within one band; all figures are rms over that of the innovations.

    Attributes:
        source, output, band_hz: where.
        error: of the model's predictions. controls: what a model without any control would leave beyond the noise.
        allowed: noise, what controls may predict of it, and the larger of the model's own bounds and `MATERIAL` of
            `controls`.
        heard: whether the controls stand out of the noise there.
        admitted: whether the record moves the controls by itself, and tells its noise there; others refute nobody.
        noise: what a right model leaves there on average.
    """

    source: str
    output: str
    band_hz: tuple[float, float]
    error: float
    controls: float
    allowed: float
    heard: bool
    admitted: bool
    noise: float

    @property
    def telling(self) -> bool:
        """Whether a model without any control would be refuted here."""
        return self.heard and np.hypot(self.noise, self.controls) > self.allowed

    @property
    def against(self) -> bool:
        """Whether the model is refuted here."""
        return self.admitted and self.error > self.allowed


@dataclass(frozen=True)
class Judgement:
    """What records say about a model.

    Attributes:
        verdict: `REFUTED`, `STANDS` or `OPEN`. reasons: in words.
        findings: by record, output and band. silent: inputs about which the records say nothing.
        samples, constants: numbers compared, and constants solved for, in all records together.
        share: rms error of the predictions beyond the noise over that of a model without controls; NaN where open.
        changes: of the model's parameters that the records ask for beyond bounds and noise, and that matter.
    """

    verdict: str
    reasons: tuple[str, ...]
    findings: tuple[Finding, ...] = ()
    silent: tuple[str, ...] = ()
    samples: int = 0
    constants: int = 0
    share: float = float("nan")
    changes: tuple[AskedChange, ...] = ()


def judge(
    model: StateSpaceModel,
    pieces: Sequence[Piece],
    outputs: Sequence[str],
    *,
    band: tuple[float, float] | None = None,
) -> Judgement:
    """Whether records refute a model.

    Args:
        model: with the bounds of its parameters, if it was identified.
        pieces: records of the model's inputs and of `outputs`, at one rate.
        outputs: which are compared.
        band: limits [Hz]; from two periods of a record to 10 Hz where None.
    """
    longest = max(pieces, key=lambda p: p.inputs.shape[0])
    span = longest.inputs.shape[0] * longest.dt
    high = min(_TOP if band is None else band[1], 0.4 / longest.dt)
    low = max(2.0 / span, 0.0 if band is None else band[0])
    if low >= high:
        return Judgement(OPEN, (f"the longest record has {span:.3g} s, too short for a band up to {high:.3g} Hz.",))
    still = [name for j, name in enumerate(outputs) if not any(np.ptp(p.outputs[:, j]) for p in pieces)]
    if still:
        return Judgement(OPEN, (f"{', '.join(still)} never moves in the records.",))
    every = max(1, int(1.0 / (_PER_TOP * high * longest.dt)))
    filter = NoiseFilter.of(pieces, every, low)
    if filter is None:
        samples = sum(p.inputs.shape[0] for p in pieces)
        return Judgement(OPEN, (f"the records have {samples} samples, too few to tell gusts from controls.",))
    edges = np.geomspace(low, high, 1 + max(1, round(np.log(high / low) / np.log(_STEP_OF_BANDS))))
    findings: list[Finding] = []
    claims = np.zeros(len(model.inputs), dtype=bool)
    samples = constants = 0
    chance = FALSE_ALARM / (len(pieces) * len(outputs) * (edges.size - 1))
    step = longest.dt * every
    noise = NoiseLevel.behind(filter, step, edges)
    grid = 2.0 * np.pi * np.geomspace(low, high, 2 + int(np.log(high / low) / _STEP_OF_SLOPES))
    bounded, slopes = own_bounds(model, outputs, grid)
    errors = ParameterErrors(len(bounded))
    loudest, shares = np.zeros((2, len(bounded)))
    for r, piece in enumerate(pieces):
        if not noise.lines[r].all():
            continue
        piece_seen = _Seen(filter, r, model, piece, tuple(outputs))
        samples, constants = samples + piece_seen.samples, constants + piece_seen.constants
        left, bare = noise.power(r, piece_seen.error), noise.power(r, piece_seen.measured)
        floor = noise.floor[r][:, None]
        controls = np.sqrt(np.maximum(bare - floor, 0.0))
        slopes_seen = piece_seen.driven_motion(grid, slopes, noise, step)
        by_parameter = noise.of_lines(r, np.abs(slopes_seen) ** 2)
        tolerated = SIGMAS * np.sqrt(by_parameter.sum(axis=2))
        unsure = np.maximum(np.sqrt(noise.power(r, filter.together[r])), UNSEEN)
        largest = noise.largest(r, chance)
        # No sum of errors is larger than the sum of their sizes.
        allowed = largest + np.maximum(tolerated, MATERIAL * controls) + unsure
        limit = HEARD * largest**2
        admitted = noise.known & piece.moved & np.ones(left.shape, dtype=bool)
        heard = (bare > limit) & admitted
        claims |= [bool(np.any(noise.power(r, part) > limit)) for part in np.moveaxis(piece_seen.forced, 2, 0)]
        for share, power in ((loudest, np.ones(controls.shape)), (shares, np.maximum(controls, 1e-300))):
            apart = np.sqrt(by_parameter) * (heard / power)[:, :, None]
            np.maximum(share, np.max(apart, axis=(0, 1), initial=0.0), out=share)
        white = noise.inverse(r)
        errors.add(white[:, :, None] * slopes_seen, white * spectrum(piece_seen.error), noise.inside(r, admitted))
        findings += [
            Finding(
                piece.source,
                output,
                (float(edges[b]), float(edges[b + 1])),
                float(np.sqrt(left[b, k])),
                float(controls[b, k]),
                float(allowed[b, k]),
                bool(heard[b, k]),
                bool(admitted[b, k]),
                float(np.sqrt(noise.floor[r, b])),
            )
            for b in range(edges.size - 1)
            for k, output in enumerate(outputs)
        ]
    silent = tuple(n for n, errors in zip(model.inputs, claims, strict=True) if not errors)
    led = any(piece.moved for piece in pieces)
    changes = _asked(model, bounded, errors, loudest, shares)
    return _in_words(tuple(findings), changes, silent, samples, constants, led=led)


def _asked(
    model: StateSpaceModel, bounded: Sequence[str], errors: ParameterErrors, loudest: Array, shares: Array
) -> tuple[AskedChange, ...]:
    """The changes of parameters that are beyond doubt, heard, and matter; the surest first.

    Args:
        loudest, shares: what one bound of each parameter makes where the controls are heard, at most in any band and
            output: over the noise, and over what the controls do.
    """
    change, spread = errors.asked()
    sigmas = np.abs(change) / np.sqrt(1.0 + spread**2)
    matters = (np.abs(change) * loudest > UNSEEN) & (np.abs(change) * shares > MATERIAL)
    asked = []
    for i in map(int, np.flatnonzero((sigmas > DOUBTED * SIGMAS) & matters)):
        p = model.parameters[bounded[i]]
        wanted = float(p.value + change[i] * p.cramer_rao)
        asked.append(AskedChange(bounded[i], p.value, wanted, float(sigmas[i]), float(abs(change[i]) * shares[i])))
    return tuple(sorted(asked, key=lambda one: -one.sigmas))


def _in_words(
    findings: tuple[Finding, ...],
    changes: tuple[AskedChange, ...],
    silent: tuple[str, ...],
    samples: int,
    constants: int,
    *,
    led: bool,
) -> Judgement:
    telling = [f for f in findings if f.telling]
    against = sorted((f for f in findings if f.against), key=lambda f: f.allowed / f.error)
    quiet = [f"the records say nothing about {', '.join(silent)}."] if silent else []
    if not against and not telling and not changes:
        heard = any(f.heard for f in findings)
        text = (
            "the model's own bounds are so wide that a model without any control would pass too."
            if heard
            else "the controls do not stand out of gusts and noise in any output or band: fly a sweep."
            if led
            else "nothing from outside moved the controls: they are a controller's answer, or nobody can tell."
        )
        return Judgement(OPEN, (text,), findings, silent, samples, constants)
    audible = [f for f in findings if f.heard]
    beyond = sum(max(f.error**2 - f.noise**2, 0.0) for f in audible)
    share = float(np.sqrt(beyond / sum(f.controls**2 for f in audible))) if audible else float("nan")
    if not against and not changes:
        text = f"{len(telling)} of {len(findings)} outputs and bands could have refuted it, and none does."
        return Judgement(STANDS, (text, *quiet), findings, silent, samples, constants, share)
    worst = tuple(
        f"{f.output} between {f.band_hz[0]:.2g} and {f.band_hz[1]:.2g} Hz in {f.source}: predictions are off by "
        f"{f.error:.3g} times the noise, up to {f.allowed:.3g} would be its own bounds and noise, {f.controls:.3g} is "
        "a model without controls."
        for f in against[:3]
    )
    head = [f"{len(against)} of {len(telling)} outputs and bands that can refute it do; the worst:"] if against else []
    asked = tuple(change.summary_text for change in changes[:3])
    return Judgement(REFUTED, (*head, *worst, *asked, *quiet), findings, silent, samples, constants, share, changes)


class _Seen:
    """A model along one record, behind the filter, without what its free constants can explain."""

    def __init__(
        self, filter: NoiseFilter, record: int, model: StateSpaceModel, piece: Piece, outputs: tuple[str, ...]
    ) -> None:
        self._filter, self._record = filter, record
        forced, basis = answers(model, outputs, piece.inputs, piece.dt)
        columns = filter(basis, record)
        flat = columns.reshape(-1, columns.shape[2])
        left, size, _ = np.linalg.svd(flat / np.maximum(np.linalg.norm(flat, axis=0), 1e-300), full_matrices=False)
        self._constants = left[:, size > 1e-8 * size[0]]
        self.samples, self.constants = flat.shape[0], self._constants.shape[1]
        self.measured = self._rest(filter(piece.outputs, record) - filter.innovations[record])
        self.forced = self._rest(filter(forced, record))
        self.error = self.measured - self.forced.sum(axis=2)
        self._inputs = averaged(piece.inputs, filter.every)[-len(self.error) :]

    def _rest(self, values: Array) -> Array:
        flat = values.reshape(self._constants.shape[0], -1)
        return np.asarray((flat - self._constants @ (self._constants.T @ flat)).reshape(values.shape))

    def driven_motion(self, grid: Array, slopes: Complex, noise: NoiseLevel, step: float) -> Complex:
        """Lines of what one standard deviation of each parameter makes, (n_lines, n_outputs, n_parameters)."""
        hertz = np.fft.rfftfreq(len(self._inputs), step)
        used = np.any(noise.bands[self._record], axis=0)
        omega = np.asarray(2.0 * np.pi * hertz[used], dtype=np.float64)
        at = np.clip(np.searchsorted(grid, omega) - 1, 0, grid.size - 2)
        share = np.clip((omega - grid[at]) / (grid[at + 1] - grid[at]), 0.0, 1.0)[:, None, None, None]
        between = (1.0 - share) * slopes[at] + share * slopes[at + 1]
        driven = (between @ spectrum(self._inputs)[used][:, None, :, None])[..., 0]
        filtered = np.swapaxes(self._filter.response(omega, step), 1, 2) @ driven
        lines = np.zeros((used.size, *filtered.shape[1:]), dtype=np.complex128)
        lines[used] = filtered / self._filter.noise[self._record][:, None]
        return lines


def own_bounds(model: StateSpaceModel, outputs: Sequence[str], grid: Array) -> tuple[tuple[str, ...], Complex]:
    """What one standard deviation of each free parameter that has any does to the responses at `grid` [rad/s].

    Returns:
        Their names, and (n, n_outputs, n_parameters, n_inputs).
    """
    known = {name: model.parameters[name].cramer_rao for name in model.free}
    known = {name: bound for name, bound in known.items() if np.isfinite(bound) and bound > 0.0}
    rows, m = [model.outputs.index(o) for o in outputs], len(model.inputs)
    if not known:
        return (), np.zeros((grid.size, len(rows), 0, m), dtype=np.complex128)
    values = np.array([model.parameters[name].value for name in known])
    _, slopes = model.sensitivities(tuple(known), values, [(o, j, grid) for o in rows for j in range(m)])
    by_pair = np.array(slopes).reshape(len(rows), m, grid.size, len(known))
    return tuple(known), np.asarray(by_pair.transpose(2, 0, 3, 1) * np.array(list(known.values()))[:, None])
