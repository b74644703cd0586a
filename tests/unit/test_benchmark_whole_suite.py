"""`make test` beside that of an older revision is judged by the share that is left, and by its failures."""

from __future__ import annotations

import pytest
from benchmarks.whole_suite import as_section, said


def _run(clock: float, failed: float = 0.0) -> dict[str, float]:
    return {"clock": clock, "processor": 2.0 * clock, "passed": 9.0, "failed": failed, "error": 0.0}


@pytest.mark.parametrize(
    ("this", "met"),
    [([590.0, 610.0], True), ([600.0, 604.0], False), ([700.0, 100.0], True)],
)
def test_the_mean_of_before_and_after_is_judged(this: list[float], *, met: bool) -> None:
    assert as_section(_run(1102.0), [_run(clock) for clock in this], "abc")["passed"] is met


def test_a_failed_test_is_not_fast() -> None:
    assert not as_section(_run(1102.0), [_run(300.0), _run(300.0, failed=1.0)], "abc")["passed"]


def test_failures_of_the_former_are_said() -> None:
    this = [_run(590.0), _run(610.0)]
    assert "fail here" not in as_section(_run(1102.0), this, "abc")["text"]
    assert "3 tests of the former fail here" in as_section(_run(1102.0, 3.0), this, "abc")["text"]


def test_the_last_line_of_pytest_is_read() -> None:
    output = "x passed\n= 3 failed, 5041 passed, 8 skipped, 1 error in 603.1s (0:10:03) =\nsteps 1.2 in 3 s\n"
    assert said(output) == {"passed": 5041, "failed": 3, "error": 1}
    with pytest.raises(ValueError, match="said nothing of its tests"):
        said("make: *** [Makefile:42: lint] Error 1\n")
