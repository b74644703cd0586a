"""The frequency path compiles nothing, so it imports nothing that does: JAX takes longer than the answers."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from test_frequency_verbs import log

RUN = """
import json, sys
from typer.testing import CliRunner
from swashplate.cli.app import app

for words in json.loads(sys.argv[1]):
    done = CliRunner().invoke(app, words)
    heavy = sorted(name for name in sys.modules if name in ("jax", "jaxlib", "casadi", "matplotlib"))
    print(json.dumps([words[0], done.exit_code, heavy]))
"""


def test_from_a_log_to_a_verified_model_without_jax(tmp_path: Path) -> None:
    """Verbs and their reports in one cold process, one after the other."""
    flown, unseen = log(tmp_path / "flown.csv", seed=1), log(tmp_path / "unseen.csv", seed=2, seconds=40.0)
    answers, model = tmp_path / "responses", tmp_path / "model"
    verbs = [
        ["respond", flown, "--inputs", "mixer_roll,mixer_pitch", "--outputs", "p,q", "--band", "0.2-12"],
        ["fit-tf", answers, "--input", "mixer_roll", "--outputs", "p", "--form", "1/2", "--band", "0.5-8"],
        ["fit-ss", "rotor_body", answers, "--starts", "1"],
        ["fit-ss", "rotor_body,rotor_body", answers, "--search"],
        ["validate", "--model", model / "model.toml", "--flight", unseen],
    ]
    outs = [answers, tmp_path / "tf", model, tmp_path / "search", tmp_path / "validation"]
    words = [[*map(str, verb), "--out", str(out), "--quiet"] for verb, out in zip(verbs, outs, strict=True)]
    ran = subprocess.run(
        [sys.executable, "-c", RUN, json.dumps(words)], capture_output=True, text=True, check=False, timeout=300
    )
    told = [json.loads(line) for line in ran.stdout.splitlines()]
    assert [(verb, heavy) for verb, _, heavy in told] == [(verb[0], []) for verb in verbs], ran.stderr
    assert all((out / "report.html").is_file() for out in outs), told


def test_what_does_import_jax_would_be_noticed() -> None:
    code = "import sys, swashplate.simulation.trim; print('jax' in sys.modules)"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=300)
    assert ran.stdout.strip() == "True"
