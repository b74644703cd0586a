"""Sections on frequency responses, the models fitted to them, and suggested gains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from swashplate.arrays import Complex
from swashplate.control.analysis.ardupilot_gains import Suggestion
from swashplate.control.analysis.rate_gain_names import firmware_of, gain_text
from swashplate.identification.core.result import Estimate, Result
from swashplate.identification.frequency.handling import Handling
from swashplate.identification.frequency.handling_readings import handling_lines
from swashplate.identification.frequency.mode_accuracy import ModeAccuracy
from swashplate.identification.frequency.reading_accuracy import Fitted
from swashplate.identification.frequency.response_cost import ACCEPTABLE, INDISTINGUISHABLE, Target
from swashplate.identification.frequency.search_result import StructureSearch
from swashplate.identification.frequency.state_space_result import CR_TARGET, I_TARGET, StateSpaceFit
from swashplate.identification.frequency.transfer_function_fit import TransferFunctionFit
from swashplate.identification.frequency.transfer_function_forms import TriedStructure
from swashplate.identification.responses.frequency_response import TWO_PI, FrequencyResponse
from swashplate.identification.time.record_fit import TimeDetails
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.reporting.figures.bode_matrix import of_fit, of_responses
from swashplate.reporting.figures_fit import correlation_matrix, cost_history, eigenvalues
from swashplate.reporting.figures_responses import excitation, rate_steps_figure
from swashplate.reporting.structure import Block, Cell, Points, Section, Table, Text, tabulate
from swashplate.reporting.theme import unit_words
from swashplate.reporting.versions import versions
from swashplate.reporting.words import value_words
from swashplate.simulation.linearize import Mode
from swashplate.validation.verification import Verification


@dataclass(frozen=True)
class ResponseMaterial:
    """What a report is about; any part may be missing, not all.

    Attributes:
        responses: measured. transfer_functions: fits to them. trials: structures that were tried.
        fit: a state-space fit. search: for its structure.
        verification: in time. time_fit: a state-space model fitted to records in time.
        gains: suggested for the autopilot.
    """

    responses: FrequencyResponse | None = None
    transfer_functions: tuple[TransferFunctionFit, ...] = ()
    trials: tuple[TriedStructure, ...] = ()
    fit: StateSpaceFit | None = None
    search: StructureSearch | None = None
    verification: Verification | None = None
    time_fit: Result[StateSpaceModel, TimeDetails] | None = None
    gains: tuple[Suggestion, ...] = field(default=())

    @property
    def fits(self) -> tuple[Fitted, ...]:
        """All models fitted to responses."""
        return (*((self.fit,) if self.fit else ()), *self.transfer_functions)


def tone(cost: float) -> str:
    """The colour of a cost J: up to `INDISTINGUISHABLE` good, up to `ACCEPTABLE` a caution, beyond it bad."""
    return "good" if cost <= INDISTINGUISHABLE else "caution" if cost <= ACCEPTABLE else "bad"


def weak(p: Estimate) -> bool:
    """Whether a parameter misses its target for the standard deviation or the insensitivity."""
    return p.sigma_percent > CR_TARGET or p.insensitivity_percent > I_TARGET


def _percent(value: float, limit: float) -> Cell:
    text = f"{value:.1f} %" if value < 1000.0 else "not seen"
    return Cell(text, number=True, tone="good" if value <= limit else "caution" if value <= 2 * limit else "bad")


def parameter_table(parameters: Sequence[Estimate]) -> Table:
    """Every number with its standard deviation and insensitivity, coloured by the targets."""
    rows = []
    for p in parameters:
        moving = not p.fixed and not p.tie
        remark = f"= {p.tie}" if p.tie else "held" if p.fixed else "at its bound" if p.at_bound else ""
        rows.append(
            (
                p.name,
                unit_words(p.unit),
                value_words(p.start),
                Cell(value_words(p.value, p.sigma if moving else None), number=True, strong=True),
                _percent(p.sigma_percent, CR_TARGET) if moving else "",
                _percent(p.insensitivity_percent, I_TARGET) if moving else "",
                Cell(remark, tone="bad" if p.at_bound else "plain"),
            )
        )
    return tabulate(
        "Parameters",
        ("parameter", "unit", "start", "identified", "σ", "insensitivity", "remarks"),
        tuple(rows),
        note="σ: standard deviation, the random errors of the responses carried through the fit. Errors go together, "
        "because gusts move all outputs at once; a response that is missed by more than its errors counts with its "
        f"misfit. Insensitivity: σ, were all other numbers known. Targets: {CR_TARGET:g} % and {I_TARGET:g} % of the "
        "value; beyond twice of it a number cannot be estimated from these responses.",
    )


def fit_parameters_section(fit: StateSpaceFit) -> Section:
    """A state-space fit: problems and warnings, parameters, eigenvalues, correlations, how it was reduced, the cost."""
    blocks: list[Block] = [Text(text, tone="bad") for text in fit.problems]
    if fit.warnings:
        blocks.append(Points(fit.warnings, title="What to beware of"))
    blocks.append(parameter_table(fit.estimates))
    if fit.details.nothing_to_drop:
        blocks.append(Text("Structure reduction: nothing to take out, every parameter is within its targets."))
    if fit.details.reduction:
        blocks.append(
            tabulate(
                "Structure reduction",
                ("parameter", "why", "J_ave before", "J_ave after", "verdict", "why not", "modes"),
                tuple(
                    (
                        s.dropped,
                        s.reason,
                        f"{s.before:.1f}",
                        f"{s.after:.1f}",
                        Cell("dropped" if s.kept else "put back", tone="plain" if s.kept else "quiet"),
                        s.veto or ("" if s.kept else "J_ave grows too much"),
                        s.modes.removeprefix("modes: "),
                    )
                    for s in fit.details.reduction
                ),
            )
        )
    if fit.details.reduced_modes:
        blocks.append(Text(f"What all of the reduction did to the {fit.details.reduced_modes}."))
    modes = {"start": _modes(fit.start.eigenvalues()), "identified": _modes(fit.solution.eigenvalues())}
    blocks += [_mode_table(fit.details.modes), eigenvalues(modes)] if fit.details.modes else [eigenvalues(modes)]
    if len(fit.names) > 1:
        blocks.append(correlation_matrix(fit.names, fit.correlation))
    if len(fit.history) > 1:
        caption = "Half the sum of J over all responses, after each iteration."
        blocks.append(replace(cost_history(fit.history), caption=caption))
    return Section("parameters", "Which numbers came out, and how sure are they?", tuple(blocks), folded=True)


def _mode_table(modes: Sequence[ModeAccuracy]) -> Table:
    return tabulate(
        "Modes of the identified model",
        ("eigenvalue [1/s]", "frequency [rad/s]", "σ %", "damping", "σ", ""),
        tuple(
            (
                f"{m.eigenvalue.real:.4g}" + (f" ± {m.eigenvalue.imag:.4g} j" if m.eigenvalue.imag else ""),
                f"{m.frequency:.4g}",
                _percent(m.frequency_percent, CR_TARGET),
                f"{m.damping:.3f}",
                f"{m.damping_bound:.3f}",
                Cell("" if m.inside else "below the band", tone="plain" if m.inside else "caution"),
            )
            for m in modes
        ),
        note="The parameters' standard deviations and correlations, carried to the modes.",
    )


def time_fit_section(fit: Result[StateSpaceModel, TimeDetails]) -> Section:
    """Parameters with their standard deviations, and the modes."""
    rows = tuple(
        (
            p.name,
            unit_words(p.unit),
            value_words(p.start),
            Cell(value_words(p.value, p.best_sigma), number=True, strong=True),
            _percent(p.sigma_percent, CR_TARGET),
            Cell("at its bound" if p.at_bound else "", tone="bad" if p.at_bound else "plain"),
        )
        for p in fit.estimates
    )
    blocks: list[Block] = [Points(fit.warnings, title="What to beware of")] if fit.warnings else []
    blocks.append(
        tabulate(
            "Parameters",
            ("parameter", "unit", "start", "identified", "standard deviation", "remarks"),
            rows,
            note=f"By {fit.method}; standard deviations from the Fisher information, for white errors: with coloured "
            "ones the true scatter is larger, as the corrected ones say.",
        )
    )
    blocks.append(eigenvalues({"identified": _modes(fit.solution.eigenvalues())}))
    return Section("parameters", "Which numbers came out, and how sure are they?", tuple(blocks), folded=True)


def _modes(values: Complex) -> tuple[Mode, ...]:
    return tuple(
        Mode(complex(v), abs(v), float(-v.real / abs(v)) if abs(v) else 0.0, -1.0 / v.real if v.real else np.inf, ())
        for v in values
        if v.imag >= 0.0
    )


def _cost_table(targets: Sequence[Target], costs: Sequence[float]) -> Table:
    return tabulate(
        "Cost of each response",
        ("response", "band [Hz]", "J"),
        tuple(
            (
                t.name,
                f"{t.omega[0] / TWO_PI:.3g} to {t.omega[-1] / TWO_PI:.3g}",
                Cell(f"{cost:.1f}", number=True, tone=tone(cost)),
            )
            for t, cost in zip(targets, costs, strict=True)
        ),
        note=f"J up to {INDISTINGUISHABLE:g} is hardly different from the flight, up to {ACCEPTABLE:g} acceptable.",
    )


def fit_costs_section(fit: StateSpaceFit) -> Section:
    """J of each response, and the model beside it."""
    blocks: list[Block] = [_cost_table(fit.targets, fit.costs), of_fit(fit)]
    if fit.details.left_out:
        blocks.append(Text(f"Without a coherent band, not fitted: {', '.join(fit.details.left_out)}."))
    return Section("costs", "How well does the model follow each response?", tuple(blocks), folded=True)


def transfer_functions_section(m: ResponseMaterial) -> Section:
    """Transfer functions with their costs and parameters, and what the usual structures would cost."""
    blocks: list[Block] = []
    for k, fit in enumerate(m.transfer_functions):
        blocks += [Text(f"{model!r}") for model in fit.solution]
        blocks += [_cost_table(fit.targets, fit.costs), parameter_table(fit.estimates)]
        blocks += [Points(fit.warnings, title="What to beware of")] if fit.warnings else []
        figure = of_fit(fit)
        blocks.append(replace(figure, identifier=f"{figure.identifier}{'' if k == 0 else f'-{k + 1}'}"))
    if m.trials:
        chosen = m.transfer_functions[0].details.form if m.transfer_functions else None
        blocks.append(
            tabulate(
                "Structures tried",
                ("zeros / poles (+ integrators)", "parameters", "J", "why not"),
                tuple(
                    (
                        Cell(t.form.text, tone="good" if t.form == chosen else "plain"),
                        str(t.parameters),
                        Cell(f"{t.cost:.1f}", number=True, tone=tone(t.cost), strong=t.form == chosen),
                        Cell(t.unsound, tone="quiet"),
                    )
                    for t in m.trials
                ),
                note="Suggested: the fewest parameters that can all be estimated and cost hardly more than the best.",
            )
        )
    return Section("transfer-functions", "Which transfer functions, and how sure are they?", tuple(blocks), folded=True)


def bodes_section(m: ResponseMaterial) -> Section:
    """Where each response may be used, and the Bode plots of those that no fit shows beside its model."""
    r = m.responses
    assert r is not None
    rows = []
    for output, name in ((o, i) for o in r.outputs for i in r.inputs):
        band = r.band(output, name)
        h, coherence, error = r.pair(output, name)
        inside = np.isfinite(h) if band is None else (r.omega >= band[0]) & (r.omega <= band[1]) & np.isfinite(h)
        coherences = coherence[inside & np.isfinite(coherence)]
        level = np.nan if coherences.size == 0 else np.max(coherences) if band is None else np.median(coherences)
        rows.append(
            (
                f"{output} / {name}",
                Cell("none", tone="caution") if band is None else f"{_hz(band[0])} to {_hz(band[1])} Hz",
                value_words(float(level)) if band is None else f"{level:.2f}",
                "–" if band is None else f"{20 * np.log10(1 + np.median(error[inside])):.2f}",
                _zero_words(r, output, name),
            )
        )
    shown = {(t.output, t.input) for fit in m.fits for t in fit.targets}
    left = [pair for o in r.outputs for i in r.inputs if (pair := (o, i)) not in shown and r.band(*pair) is not None]
    blocks: list[Block] = [Text(text, tone="bad") for text in r.problems]
    blocks += [Points(r.warnings, title="What to beware of")] if r.warnings else []
    columns = ("response", "coherent band", "coherence", "error [dB]", "0 dB")
    blocks.append(tabulate("Where the responses may be used", columns, rows))
    blocks += [of_responses(r, without=shown)] if left or not shown else []
    return Section("responses", "Where may the responses be used?", tuple(blocks), folded=True)


def _hz(omega: float) -> str:
    return f"{omega / TWO_PI:.3g}"


def _zero_words(responses: FrequencyResponse, output: str, input: str) -> str:
    """What 0 dB are."""
    if not (responses.output_units and responses.input_units):
        return ""
    o, i = responses.place(output, input)
    above, below = unit_words(responses.output_units[o]), unit_words(responses.input_units[i])
    return f"1 {above} for {f'1 {below}' if below else f'a {input} of 1'}"


def excitation_section(r: FrequencyResponse) -> Section:
    """Input power and cross-control correlation: what was excited and what was mixed."""
    return Section("excitation", "What was excited?", (excitation(r),), folded=True)


def gains_section(gains: Sequence[Suggestion]) -> Section:
    """Suggested rate-loop gains in the firmware's names beside the flown ones, and the margins of both."""
    rows = tuple(
        (
            name,
            Cell(gain_text(name, g.parameters[name]) if name in g.parameters else "–", number=True, strong=True),
            gain_text(name, g.flown[name]) if name in g.flown else "not logged",
        )
        for g in gains
        for name in g.parameters or g.flown
    )
    judged = tuple(
        (g.axis, what, *(text.replace("+-", "±") for text in (suggested, logged)))
        for g in gains
        if np.isfinite(g.peak) or np.isfinite(g.flown_peak)
        for what, suggested, logged in g.table()
    )
    said = dict.fromkeys(g.words for g in gains)
    firmware = " and ".join(dict.fromkeys(firmware_of(g.axis) for g in gains))
    refused = {g.words for g in gains if g.refused}
    advice = tuple(
        Text(f"{', '.join(g.axis for g in gains if g.words == w)}: {w}", tone="bad" if w in refused else "caution")
        for w in said
    )
    tables = (
        tabulate(f"Gains ({firmware})", ("parameter", "suggested", "flown"), rows),
        tabulate(
            "The rate loop on the identified model",
            ("axis", "", "suggested", "flown"),
            judged,
            note="If the loop crosses several times, the smallest margin counts. ± follows from the standard "
            "deviations of the model's parameters. The controller's filters (FLTT, FLTE, FLTD; cutoff) are included. "
            f"The demand steps at once: {firmware}'s own shaping is not included.",
        ),
    )
    return Section(
        "gains",
        "Which gains, with which margins?",
        (
            *(advice if refused else ()),
            *(table for table in tables if table.rows),
            *(figure for g in gains if (figure := rate_steps_figure(g)) is not None),
            *(Text(f"{g.axis}: {line}") for g in gains for line in g.trade),
            *(() if refused else advice),
        ),
    )


def made_section() -> Section:
    """Versions of what made the report."""
    rows = tuple((name, number) for name, number in versions().items())
    return Section("versions", "How was this made?", (tabulate("Versions", ("package", "version"), rows),), folded=True)


def handling_section(m: ResponseMaterial) -> Section | None:
    """Bandwidth and phase delay of every rate response that is strong enough, from the flight and from the model."""
    r = m.responses
    if r is None:
        return None
    rows = []
    for line in handling_lines(r, m.fits):
        read = line.read
        cells = (read.bandwidth, read.omega_180, read.phase_delay_line) if isinstance(read, Handling) else ()
        rows.append(
            (
                line.response,
                line.source,
                *(repr(c).replace("+-", "±") for c in cells),
                *("–" for _ in range(3 - len(cells))),
                line.problem,
            )
        )
    if not rows:
        return None
    table = tabulate(
        "Attitude responses (rates over jω)",
        ("response", "from", "bandwidth [rad/s]", "ω180 [rad/s]", "phase delay [s]", "remark"),
        tuple(rows),
        note="After ADS-33E-PRF (definition from memory, not verified against its text), rate command: the lower of "
        "the frequencies of 45° phase margin and 6 dB gain margin; phase delay by a coherence-weighted line "
        "from ω180 to twice of it. Its boundaries are for manned helicopters: for a small one scale "
        "frequencies with the square root of the size (Froude). ± of the flight: random error; of the model: what "
        "the standard deviations of its parameters make of it.",
    )
    return Section("handling", "Which bandwidth and phase delay has each attitude?", (table,), folded=True)
