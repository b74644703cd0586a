"""Reports on frequency responses and on the models that were fitted to them, by the same page as every other report."""

from __future__ import annotations

from swashplate.errors import SwashError
from swashplate.identification.core.sources import problem_words, scale_words
from swashplate.identification.frequency.search_result import StructureSearch
from swashplate.identification.frequency.state_space_result import CR_TARGET, I_TARGET
from swashplate.reporting import sections_responses
from swashplate.reporting.sections_responses import ResponseMaterial
from swashplate.reporting.sections_verification import verification_section
from swashplate.reporting.structure import Cell, Points, Report, Section, tabulate
from swashplate.reporting.terms import first_screen
from swashplate.reporting.words import listed


def search_section(search: StructureSearch) -> Section:
    """The structures that were tried, and why one was picked."""
    head, *rows = search.rows()
    cells = tuple(
        tuple(
            Cell(f"{text} (picked)" if c is search.pick and k == 0 else text, number=0 < k < len(row) - 1)
            for k, text in enumerate(row)
        )
        for c, row in zip(search.tried, rows, strict=True)
    )
    why = Points(tuple(text.strip() for text in search.reasons), title="Why this one")
    return Section(
        "structures", "Which structures were tried?", (why, tabulate("Structures", head, cells)), folded=True
    )


def compose_responses(material: ResponseMaterial, *, title: str | None = None) -> Report:
    """The report's structure."""
    m = material
    if not (m.responses or m.transfer_functions or m.fit or m.verification or m.time_fit):
        raise SwashError("there is nothing to report.")
    parts = [
        sections_responses.gains_section(m.gains) if m.gains else None,
        verification_section(m.verification) if m.verification else None,
        search_section(m.search) if m.search else None,
        sections_responses.fit_parameters_section(m.fit) if m.fit else None,
        sections_responses.time_fit_section(m.time_fit) if m.time_fit else None,
        sections_responses.fit_costs_section(m.fit) if m.fit else None,
        sections_responses.transfer_functions_section(m) if m.transfer_functions else None,
        sections_responses.bodes_section(m) if m.responses else None,
        sections_responses.excitation_section(m.responses) if m.responses else None,
        sections_responses.handling_section(m),
        sections_responses.made_section(),
    ]
    parts_there, lines = [part for part in parts if part is not None], _summary(m)
    picture, sections = first_screen(parts_there, lines)
    return Report(
        title=title or _title(m),
        banners=_banners(m),
        summary=lines,
        picture=picture,
        sections=sections,
    )


def _title(m: ResponseMaterial) -> str:
    if m.fit:
        return f"{m.fit.name} identified from frequency responses"
    if m.transfer_functions:
        return "Transfer functions from frequency responses"
    if m.time_fit:
        return f"{m.time_fit.name} identified in time"
    if m.responses:
        return "Frequency responses"
    assert m.verification is not None
    return f"{m.verification.model.name} along unseen records"


def _banners(m: ResponseMaterial) -> tuple[tuple[str, str], ...]:
    banners = []
    if m.verification and m.verification.fitted_sources:
        banners.append(("caution", "NOT A HOLD-OUT: the fit has seen the records that are shown."))
    if m.verification and any(one.simulated for one in m.verification.data):
        banners.append(("caution", "SIMULATED FLIGHT: no aircraft flew for these numbers."))
    if m.fit and m.fit.problems:
        banners.append(("bad", f"PROBLEM: {' '.join(m.fit.problems)}"))
    banners += [("bad", f"NO GAINS for {g.axis}: {g.refused}") for g in m.gains if g.refused]
    if m.responses and m.responses.problems:
        banners.append(("bad", f"NOT COMPUTED: {' '.join(m.responses.problems)}"))
    return tuple(banners)


def _summary(m: ResponseMaterial) -> tuple[tuple[str, str, str], ...]:
    rows = []
    if m.responses:
        r = m.responses
        pairs = [(o, i) for o in r.outputs for i in r.inputs if r.band(o, i) is not None]
        have = "response has" if len(r.outputs) * len(r.inputs) == 1 else "responses have"
        sentence = f"{len(pairs)} of {len(r.outputs) * len(r.inputs)} {have} a coherent band ({r.method} estimate)"
        rows.append(("Responses", f"{sentence}, from {listed(r.sources, most=4)}.", "plain"))
    if m.transfer_functions:
        sentence = "; ".join(
            f"{model!r} (J {c:.0f})" for f in m.transfer_functions for model, c in zip(f.solution, f.costs, strict=True)
        )
        rows.append(("Model", sentence, sections_responses.tone(max(c for f in m.transfer_functions for c in f.costs))))
    if m.fit:
        f = m.fit
        rows.append(
            (
                "Model",
                f"{f.solution.title}: J_ave {f.cost:.1f} over {len(f.targets)} responses.",
                sections_responses.tone(f.cost),
            )
        )
        weak = [p for p in f.estimates if not p.fixed and not p.tie and sections_responses.weak(p)]
        text = "all within their targets" if not weak else f"outside: {listed([p.name for p in weak])}"
        rows.append(
            (
                "Accuracy",
                f"σ ≤ {CR_TARGET:g} %, insensitivity ≤ {I_TARGET:g} %: {text}.",
                "caution" if weak else "good",
            )
        )
    if m.verification:
        v = m.verification
        inside = "" if v.inside is None else f" ({v.inside.cost:.2f} within the band of the fit)"
        rows.append(
            (
                "In time",
                f"{v.verdict}; J_rms {v.cost:.2f}{inside} on {listed([t.source for t in v.traces], most=3)}.",
                "good" if v.good else "caution",
            )
        )
    elif m.fit or m.transfer_functions:
        rows.append(("In time", "not verified: give a flight that the fit has not seen.", "caution"))
    data = [*(m.time_fit.data if m.time_fit else ()), *(m.fit.data if m.fit and not m.responses else ())]
    warnings = [
        *scale_words(data),
        *(m.time_fit.warnings if m.time_fit else ()),
        *(m.responses.warnings if m.responses else ()),
        *(m.fit.warnings if m.fit else ()),
        *(text for f in m.transfer_functions for text in f.warnings),
        *problem_words(data),
    ]
    rows.append(
        (
            "Warnings",
            " ".join(warnings[:3]) or "no problem was found in these flights.",
            "caution" if warnings else "plain",
        )
    )
    return tuple(rows)
