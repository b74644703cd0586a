"""The documentation's pages: what is generated is generated anew, what is shown as output is run (`docs_running`).

    python docs/site/docs_pages.py           writes the generated pages and refreshes every quick output
    python docs/site/docs_pages.py --real docs/tutorials/first-model.md ...
                                           only these pages, with what identifies from the real flights (minutes)

What lies between `<!-- generated: NAME -->` and `<!-- end -->` is made by the function NAME of `GENERATED`.
"""

from __future__ import annotations

import os
import re
import sys
import tempfile
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from docs_running import Command, Fence, run_command, run_page
from own_package import EXAMPLES
from real_results import flights_claims_text, results_text, trusted_text

from swashplate.atomic import write_bytes, write_text

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
_REGION = re.compile(r"(<!-- generated: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def pages() -> list[Path]:
    """Every page with something to run or to generate."""
    return [ROOT / "README.md", *sorted(p for p in DOCS.rglob("*.md") if p.name != "proof.md")]


# ---- generated parts -------------------------------------------------------------------------------------------------
def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *("| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows)])


def commands_text() -> str:
    """`--help` of every command."""
    import typer

    from swashplate.cli.app import app

    verbs: list[tuple[str, ...]] = [()]
    for name, command in typer.main.get_command(app).commands.items():  # type: ignore[attr-defined]
        verbs.append((name,))
        verbs += [(name, inner) for inner in getattr(command, "commands", {})]
    parts = []
    for verb in verbs:
        title = " ".join(("swash", *verb))
        parts.append(f"## {title}\n\n```text\n{run_command(Command(f'{title} --help', ''))}\n```")
    return "\n\n".join(parts)


def parameters_text() -> str:
    """The coax card as a table."""
    from swashplate.models.card import packaged_cards
    from swashplate.reporting.glossary import meaning

    rows = []
    for name, p in packaged_cards()["coax"].parameters.items():
        bounds = "" if p.lower is None and p.upper is None else f"{_bound(p.lower)} to {_bound(p.upper)}"
        source = p.source + (f" ({p.note})" if p.note else "")
        rows.append((f"`{name}`", f"{p.value:.6g}", p.unit, bounds, p.status, meaning(name), source))
    return _table(
        ("parameter", "value", "unit", "physical bounds", "status", "meaning [symbol in the paper]", "source"), rows
    )


def _bound(value: float | None) -> str:
    return "…" if value is None else f"{value:g}"


def trust_text() -> str:
    """What the coax card says of itself."""
    from swashplate.models.card import packaged_cards

    card = packaged_cards()["coax"]
    options = ", ".join(f"`{name} = {str(value).lower()}`" for name, value in card.options.items())
    return f"**{card.title}.** {card.trust}\n\nOptions of the equations: {options}."


def choices_text() -> str:
    """The ready choices of free parameters with their priors."""
    import swashplate as sp
    from swashplate.models.coax_choices import CHOICES

    coax = "\n\n".join(map(_choice, CHOICES.values()))
    others = "\n\n".join(map(_choice, sp.vehicle("raptor50", bar=True).choices.values()))
    words = "A single-rotor helicopter's take their priors from its card; here those of `raptor50` with `bar = true`."
    return f"For the CoaX:\n\n{coax}\n\n{words}\n\n{others}"


def _choice(choice: Any) -> str:
    rows = [(f"`{f.name}`", "none" if f.mean is None else f"{f.mean:g} ± {f.sigma:g}", f.source) for f in choice.free]
    set_too = ", ".join(f"`{name} = {value:g}`" for name, value in choice.fixed)
    ties = f"\n\nTies: {', '.join(f'`{tie}`' for tie in choice.ties)}." if choice.ties else ""
    text = f"`{choice.name}`: {choice.description}.\n\n{_table(('free', 'prior (mean ± sigma)', 'from'), rows)}{ties}"
    return text + (f" Set: {set_too}." if set_too else "")


def channels_text() -> str:
    """The schema's channels."""
    from swashplate.flights.schema import CHANNELS

    rows = [
        (
            *(f"`{c.name}`", c.unit, c.shown_unit, c.frame.replace("->", " → "), c.description),
            f"{c.shown_factor * c.largest:.3g}",
        )
        for c in CHANNELS.values()
    ]
    return _table(("channel", "unit inside", "on screens", "frame", "meaning and sign", "at most (on screens)"), rows)


def terms_text() -> str:
    """The glossary."""
    from swashplate.reporting.terms import TERMS

    return _table(("word", "meaning"), [(word, TERMS[word]) for word in sorted(TERMS, key=str.lower)])


def thresholds_text() -> str:
    """The verdict's thresholds."""
    from swashplate.identification.time import feedback
    from swashplate.validation.verdict import THRESHOLDS

    rows = [
        (name, f"every channel of the axis at {value:g} % or more, and better than every rival")
        for name, value in THRESHOLDS.items()
    ]
    rows.append(("poor", "otherwise"))
    rows.append(
        (
            "cannot be judged",
            f"past motion explains {100 * feedback.EXPLAINED:g} % or more of the command in every record; or even the "
            f"ceiling stays below {THRESHOLDS['usable']:g} % and the model is as good as it",
        )
    )
    return _table(("verdict", "condition"), rows)


def bench_columns_text() -> str:
    """The columns of a bench record."""
    from swashplate.bench.record import COLUMNS

    return _table(
        ("column", "unit", "meaning and sign"), [(f"`{n}`", unit, words) for n, (unit, words) in COLUMNS.items()]
    )


def bench_procedures_text() -> str:
    """The bench's procedures with what they need."""
    from swashplate.bench.evaluate import PROCEDURES

    rows = [
        (f"`{name}`", module.title, ", ".join(f"`{column}`" for column in module.columns), module.source)
        for name, module in PROCEDURES.items()
    ]
    return _table(("procedure", "measures", "needs the columns", "by"), rows)


def package_text(name: str) -> str:
    """An example package: its module, and its entry point."""
    code, project = ((EXAMPLES / name / file).read_text(encoding="utf-8") for file in (f"{name}.py", "pyproject.toml"))
    points = project[project.index("[project.entry-points") :].split("\n\n")[0]
    return f"```python\n{code}```\n\nIts `pyproject.toml` names it:\n\n```toml\n{points}\n```"


def decisions_text() -> str:
    """Every decision's page by its heading, in the order of their numbers."""
    pages = sorted(page for page in (DOCS / "decisions").glob("*.md") if page.name != "index.md")
    headings = [page.read_text(encoding="utf-8").partition("\n")[0].removeprefix("# ") for page in pages]
    return "\n".join(f"* [{heading}]({page.name})" for heading, page in zip(headings, pages, strict=True))


PACKAGES = ("ducted_fan", "rate_least_squares", "triax_log", "attitude_pd", "stability_table")


GENERATED: Mapping[str, Callable[[], str]] = {
    "commands": commands_text,
    "parameters": parameters_text,
    "trust": trust_text,
    "choices": choices_text,
    "channels": channels_text,
    "terms": terms_text,
    "thresholds": thresholds_text,
    "bench_columns": bench_columns_text,
    "bench_procedures": bench_procedures_text,
    "decisions": decisions_text,
    "results": results_text,
    "trusted": trusted_text,
    "flights_claims": flights_claims_text,
    **{name: partial(package_text, name) for name in PACKAGES},
}


def regenerated(text: str) -> str:
    """A page with its generated parts made anew."""
    return _REGION.sub(lambda m: f"{m[1]}{GENERATED[m[2]]()}\n{m[3]}", text)


# ---- refreshing ------------------------------------------------------------------------------------------------------
def refreshed(text: str, *, real: bool) -> str:
    """A page with the outputs that came out. Run in a folder of its own."""
    edits: dict[int, tuple[Fence, str]] = {}
    for shown in run_page(text, real=real):
        if shown.came is None:
            continue
        fence, now = edits.get(shown.fence.start, (shown.fence, shown.fence.text))
        if fence.language == "text":
            now = shown.came + "\n"
        elif shown.said:
            now = now.replace(shown.said, shown.came, 1)
        edits[fence.start] = (fence, now)
    for fence, now in sorted(edits.values(), key=lambda edit: -edit[0].start):
        text = text[: fence.start] + now + text[fence.stop :]
    return text


def main(arguments: list[str]) -> None:
    real = "--real" in arguments
    named = [Path(name).resolve() for name in arguments if name != "--real"]
    for page in named or pages():
        if not page.exists():
            continue
        text = page.read_text(encoding="utf-8")
        here = Path.cwd()
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            try:
                new = refreshed(regenerated(text), real=real)
                for picture in Path(folder).glob("*.png"):
                    if f"pictures/{picture.name}" in text:
                        write_bytes(DOCS / "pictures" / picture.name, picture.read_bytes())
            finally:
                os.chdir(here)
        if new != text:
            write_text(page, new)
            print("changed", page.relative_to(ROOT))


if __name__ == "__main__":
    main(sys.argv[1:])
