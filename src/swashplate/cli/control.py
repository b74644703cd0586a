"""`swash control`: the verbs about a controller for any vehicle."""

from __future__ import annotations

import typer

from swashplate.cli import control_check

app = typer.Typer(
    help="Design a controller for a model, and check it.",
    rich_markup_mode=None,
    no_args_is_help=True,
)
app.command("check", short_help="Margins, handling qualities and steps of a controller.")(control_check.check)
