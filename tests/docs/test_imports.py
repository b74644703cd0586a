"""A user's snippets need no inner module but those of a few functions for experts: all else is in `swashplate`."""

from __future__ import annotations

import re
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"
PAGES = [*sorted((DOCS / "howto").rglob("*.md")), *sorted((DOCS / "tutorials").rglob("*.md")),
         *sorted((DOCS / "explanation").rglob("*.md")), DOCS.parent / "README.md"]  # fmt: skip


EXPERT = {
    "api.excitation": {"excitation"},
    "api.track": {"recursive_estimator"},
    "control.analysis.stability": {"loop_modes"},
    "control.laws.linear_decoupling": {"coupling", "dynamic_decoupling", "static_decoupling"},
    "export.control_json": {"read_control"},
    "flights.conditioning.synchronise": {"merge", "synchronise"},
    "flights.maneuvers.series": {"parse"},
    "flights.rotor_speed": {"rotor_speed"},
    "identification.frequency.state_space_fit": {"fit_state_space"},
    "models.card": {"Card", "Parameter"},
    "physics.frames": {"Vector"},
    "simulation.lpv": {"schedule as speed_schedule", "simulate_lpv"},
}
"""What pages import from inner modules, because it is no name of `swashplate`: the list may only get shorter."""


def _inner(text: str) -> set[str]:
    """Imports of inner modules in a page's Python."""
    blocks = re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)
    lines = (line.strip() for block in blocks for line in block.splitlines())
    return {line.partition("  #")[0] for line in lines if re.match(r"(from|import) swashplate\.", line)}


def test_pages_for_users_import_swashplate_alone() -> None:
    found = {page.name: inner for page in PAGES if (inner := _inner(page.read_text(encoding="utf-8")))}
    assert len(PAGES) > 15
    allowed = {f"from swashplate.{module} import {name}" for module, names in EXPERT.items() for name in names}
    assert {page: inner - allowed for page, inner in found.items() if inner - allowed} == {}
    assert allowed <= set().union(*found.values()), "what no page needs any more leaves the list"


def test_an_inner_import_is_found() -> None:
    page = "```python\nimport swashplate as sp\nfrom swashplate.flights.flight import Flight\n```\n"
    assert _inner(page) == {"from swashplate.flights.flight import Flight"}
