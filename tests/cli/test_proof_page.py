"""The page that `make proof` writes from what its tests and benchmarks left."""

from __future__ import annotations

import json
from pathlib import Path

from tests import proof
from tests.siege.run import siege_section


def test_every_result_becomes_a_section(tmp_path: Path) -> None:
    recovery = {
        "title": "Recovery",
        "text": "50 seeds.",
        "columns": ["a|b", "x"],
        "rows": [["m", 0.123456]],
        "passed": True,
    }
    (tmp_path / "a.json").write_text(json.dumps(recovery), encoding="utf-8")
    machine = {"processor": "P", "cores": 2, "load_before": 0.5}
    slow = {"name": "scan", "rate": 1000.0, "target": 2000.0, "note": "", "met": False}
    (tmp_path / "benchmarks.json").write_text(json.dumps({"machine": machine, "results": [slow]}), encoding="utf-8")
    page = proof.assemble(tmp_path, [{"command": "python -m pytest", "code": 1, "seconds": 3.0}])
    for part in (
        "## Recovery\n\n**Passed.** 50 seeds.",
        "| a\\|b | x |\n| --- | --- |\n| m | 0.1235 |",
        "## Speed\n\n**Missed.** ",
        "| scan | 1,000 | 2,000 | no |  |",
        "| `python -m pytest` | FAILED | 3 |",
    ):
        assert part in page, page


def test_a_section_is_put_anew_and_the_others_stay() -> None:
    sections = [{"title": title, "text": f"old {title}.", "passed": True} for title in ("A", "Speed", "Speed of B")]
    page = "# Proof\n\n" + "\n\n".join(map(proof.section, sections)) + f"\n\n{proof.BEGIN}\n\nS\n\n{proof.END}\n"
    again = proof.put(page, {"title": "Speed", "text": "new.", "passed": False}, "2026-11-27")
    old, new = "**Passed.** old Speed.\n", "**Missed.** Run by itself on 2026-11-27. new.\n"
    assert again == page.replace(old, new)
    assert again != page
    added = proof.put(page, {"title": "C", "text": "more."}, "2026-11-27")
    assert added == page.replace(proof.BEGIN, f"## C\n\nRun by itself on 2026-11-27. more.\n\n{proof.BEGIN}")


def test_what_ran_by_itself_stays_where_a_later_run_lacks_it() -> None:
    page = proof.put("# Proof\n", {"title": "Slurm", "text": "two jobs.", "passed": True}, "2026-11-28")
    page = proof.put(page, {"title": "Speed", "text": "slow.", "passed": False}, "2026-11-28")
    page = proof.with_siege(
        page + "\n" + proof.section({"title": "Gone", "text": "of a whole run."}), "## Siege\n\nkills"
    )
    fresh = "# Proof\n\n" + proof.section({"title": "Speed", "text": "fast.", "passed": True}) + "\n"
    kept = proof.with_siege(proof.kept_from(page, fresh), proof.siege_of(page))
    assert kept == proof.with_siege(
        f"{fresh}\n## Slurm\n\n**Passed.** Run by itself on 2026-11-28. two jobs.", "## Siege\n\nkills"
    )


def test_a_campaign_that_has_not_run_here_stays_as_the_page_has_it(tmp_path: Path) -> None:
    page = proof.with_siege("# Proof", "# Siege\n\nx\n\n## Disks\n\nold disks\n\n## Files\n\nold files")
    (tmp_path / "files-0.json").write_text(json.dumps({"title": "Files", "text": "new files"}), encoding="utf-8")
    made = siege_section(tmp_path, page)
    assert made.endswith("## Disks\n\nold disks\n\n## Files\n\nnew files")
