"""The pages on the papers: a section for every equation and figure, claims judged by what the pages compute.

That the pages run and print what they say is in test_pages.py.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest import mock

import docs_running as running
import matplotlib as mpl
import pytest
import real_results
from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parents[2]
PAPERS = {page.stem: page.read_text(encoding="utf-8") for page in (ROOT / "docs" / "papers").glob("*.md")}
HAS = {
    "coax": {"Equation": range(1, 23), "Figure": range(1, 11)},
    "raptor": {"Equation": range(1, 17), "Figure": range(1, 10), "Table": range(1, 5)},
}
"""What each paper numbers."""
CONSTANTS = {
    "coax": (
        "18 states and 4 inputs", "300.0", "340.0", "274 mm", "1 to 3 %", "1 to 4 %", "5 to 20 %", "49.0", "45.0",
        "about 1 m above", "10 × 10 × 10 m with 8 cameras", "200 Hz", "100 Hz", "10.5 and 12.5 V", "0.5 to 8 Hz",
        "7 deg", "1.8 m/s",
    ),
    "raptor": (
        "10.5", "52.95", "9.26", "4.56", "0.0769", "0.1973", "0.1912", "0.47", "200.0", "122.4", "21.0", "47.24 in",
        "15.26 in", "7.12 in", "8.5:1", "5.51 in", "7.5 lb", "0.50 cu. in.", "6 min", "142.8 in", "29.0 in", "6.7:1",
        "140 lb", "15 cu. in.", "60 min", "Butterworth filter of order 2 at 6 Hz", "0.00027 to 512 Hz",
        "0.5 to 40 feet", "18 V", "0.0020 s", "0.0037 s", "gain 17, delay 2.0 ms, bias 30 deg/s, cost 0.18",
        "gain 15, delay 3.7 ms, bias -22 deg/s, cost 0.166",
    ),
}  # fmt: skip
"""Every constant of the text, as the page quotes it."""
_CLAIM = re.compile(r"^claim (\d+): (.+)$", re.MULTILINE)
_ROW = re.compile(r"^\| (\d+) \| .+ \| (.+?) \| \[.+\]\(#.+\) \|$", re.MULTILINE)


def headed(page: str, kind: str) -> list[int]:
    """Numbers of the equations or figures that have a section, in the page's order."""
    numbers: list[int] = []
    for heading in re.findall(rf"^### {kind}s? ([\d, and to]+):", page, re.MULTILINE):
        found = [int(number) for number in re.findall(r"\d+", heading)]
        numbers += range(found[0], found[-1] + 1) if " to " in heading else found
    return numbers


@pytest.mark.parametrize(("paper", "kind"), [(paper, kind) for paper, kinds in HAS.items() for kind in kinds])
def test_every_equation_and_figure_has_its_section(paper: str, kind: str) -> None:
    assert sorted(headed(PAPERS[paper], kind)) == list(HAS[paper][kind])


@pytest.mark.parametrize("paper", CONSTANTS)
def test_every_constant_of_the_text_is_quoted(paper: str) -> None:
    said = re.sub(r"\s+", " ", PAPERS[paper])
    assert [words for words in CONSTANTS[paper] if re.sub(r"\s+", " ", words) not in said] == []


@pytest.mark.parametrize("paper", HAS)
def test_the_claims_at_the_top_are_what_the_page_computes(paper: str) -> None:
    page = PAPERS[paper]
    stated, printed = dict(_ROW.findall(page)), _CLAIM.findall(page)
    assert len(printed) == len(dict(printed)) > 5
    assert stated == dict(printed)


@pytest.mark.parametrize("paper", HAS)
def test_pictures_are_those_that_the_page_draws(paper: str) -> None:
    page = PAPERS[paper]
    shown = set(re.findall(rf"pictures/({paper}-paper-[\w-]+\.png)", page))
    drawn = set(re.findall(rf'"({paper}-paper-[\w-]+\.png)"', page))
    kept = {picture.name for picture in (ROOT / "docs" / "pictures").glob(f"{paper}-paper-*.png")}
    assert shown == drawn == kept


def judged(page: str, change: dict[str, str], keep: Callable[[str], bool]) -> dict[str, str]:
    """What the claims become where something on the page is changed; only the programs that are kept run, undrawn."""
    for old, new in change.items():
        assert old in page, old
        page = page.replace(old, new)
    namespace: dict[str, Any] = {}
    mpl.use("Agg")
    programs = [fence for fence in running.fences(page) if fence.language == "python" and keep(fence.text)]
    with mock.patch.object(Figure, "savefig"):
        return dict(_CLAIM.findall("\n".join(running.run_python(fence, namespace) for fence in programs)))


def _coax(*numbers: str) -> dict[str, str]:
    return {'sp.vehicle("coax")': f'sp.vehicle("coax").with_values(dict({", ".join(numbers)}))'}


_ALIGNED = _coax(*(f"{k}_zeta_{side}=0.0" for k in "ko" for side in ("upper", "lower")))
_SLOW = ("coax56", "evaluate_bench", "found.details", "sweep:pitch", "fit_ahead", "to_speed")


@pytest.mark.parametrize(
    ("change", "needs", "becomes"),
    [
        (_ALIGNED, "", {"4": "holds", "5": "holds", "6": "does not hold", "13": "holds"}),
        (_ALIGNED, "to_speed", {"14": "holds"}),
        (_coax("mass=0.1"), "", {"2": "does not hold"}),
        (_coax("mass=1.5", "k_thrust_upper=1.2e-4", "k_thrust_lower=1.6e-4") | {"3.0 / down": "1.0 / down"}, "",
         {"3": "holds"}),
        (_coax("hub_stiffness_lower=0.1"), "", {"7": "does not hold"}),
        ({"len(coax.state_names), len": "len(coax.state_names) - 1, len"}, "", {"1": "does not hold"}),
        ({"mixing=law_form)": 'mixing="rotation")'}, "", {"12": "does not hold"}),
        ({"vehicle=coax, only": "vehicle=coax.with_values({'linkage_lower': 0.15}), only"}, "simulate_bench",
         {"8": "does not hold"}),
        ({"20s,0.2": "20s,0.01"}, "sweep:pitch", {"9": "does not hold"}),
    ],
)  # fmt: skip
def test_a_claim_on_the_coax_can_turn_out_the_other_way(
    change: dict[str, str], needs: str, becomes: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)

    def keep(program: str) -> bool:
        return (bool(needs) and needs in program) or not any(word in program for word in _SLOW)

    found = judged(PAPERS["coax"], change, keep)
    assert {number: found[number] for number in becomes} == becomes


@pytest.mark.parametrize(("level", "words"), [("good", "holds"), ("poor", "does not hold")])
def test_claims_on_flights_follow_the_verdicts(level: str, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from swashplate.validation.validation import AxisVerdict

    axes = [axis for each in real_results.CLAIMS.values() for axis in each]
    verdicts = {"one": [AxisVerdict(axis, level, "") for axis in axes]}
    monkeypatch.setattr(real_results, "directions", lambda page: verdicts)
    assert set(dict(_CLAIM.findall(real_results.flights_claims_text())).values()) == {words}


@pytest.mark.proof
def test_every_claim_on_the_raptor_can_turn_out_the_other_way(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each program is changed where it judges: another card, model or scheme in the place of the paper's."""
    monkeypatch.chdir(tmp_path)
    change = {
        "printed = paper_model(full, as_printed=True)": "printed = eight",
        'max(omitted["Xr"].modes': 'max(omitted["Lv"].modes',
        "slow(part(eight, *LONGITUDINAL).A, part(eight, *LATERAL).A)": "slow(eight.A)",
        "slow(eight.A[np.ix_(aside, aside)])": "slow(part(eight, *LATERAL).A, part(eight, *LONGITUDINAL).A)",
        "for factor in (0.0, 1.5)": "for factor in (0.0, 0.1)",
        "off[round(100 * second)]": "0.01 * off[round(100 * second)]",
        "scheme=scheme, over=over": 'scheme="stitched", over=over',
        "along(part(eight, *LONGITUDINAL), pitch)": "along(eight, pitch)",
        '12 states": along(barred, columns)': '12 states": along(eight, columns)',
        'costs += [fit.cost] if form == "0/0"': 'costs += [fit.cost] if form == "1/2"',
        "printed_lpv(pitch)}": "{n: np.full(700, np.mean(pitch[n][here])) for n in UNITS}}",
        "printed_lpv(roll)}": "{n: np.full(700, np.mean(roll[n][here])) for n in UNITS}}",
    }
    stated = dict(_ROW.findall(PAPERS["raptor"]))
    found = judged(PAPERS["raptor"], change, lambda program: True)
    assert [number for number, words in found.items() if words == stated[number]] == []
