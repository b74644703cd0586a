"""Published derivatives from a file: names, signs, units, matrices, and what is wrong with a file."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from swashplate.errors import SwashError
from swashplate.models.published import read_published


def written(folder: Path, text: str) -> Path:
    path = folder / "report.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_list_of_names_values_and_units(tmp_path: Path) -> None:
    lines = [
        "# a report",
        "name,value,unit",
        "X_u,-0.02,1/s",
        "M_u,0.01,1/(ft s)",
        "Xq,2.0,ft/s",
        "Zth0,-300,ft/s^2/rad",
        "M_\N{GREEK SMALL LETTER THETA}1s,0.46,1/s^2/deg",
        "L'_theta1c,-150,",
        "N_theta0T,-10,",
        "Lv,nan,",
    ]
    path = written(tmp_path, "\n".join(lines))
    found = read_published(path)
    assert found == pytest.approx(
        {
            "Xu": -0.02,
            "Mu": 0.01 / 0.3048,
            "Xq": 2.0 * 0.3048,
            "Ztheta0": -300.0 * 0.3048,
            "MB1": -0.46 * 180.0 / math.pi,
            "LA1": 150.0,
            "Ntheta0T": -10.0,
        }
    )
    assert read_published(path, sense=-1.0)["LA1"] == -150.0


def test_matrices_lose_their_angles_and_kinematic_terms(tmp_path: Path) -> None:
    """u' = X_q q - W q and so on: with U = 30, V = 1, W = 2 m/s what is left of a matrix of only those is 0."""
    path = written(
        tmp_path,
        ",u,w,q,theta,v,p,phi,r,theta0,theta1s\n"
        "u,-0.02,0,-2,-9.8,0,0,0,1,5,-9\n"
        "wdot,0,-0.7,30,0,0,-1,0.3,0,-100,0\n"
        "theta,0,0,1,0,0,0,0,0,0,0\n"
        "Y,0,0,0,0,-0.1,2,9.8,-30,0,0\n",
    )
    found = read_published(path, flight={"u": 30.0, "v": 1.0, "w": 2.0})
    assert all(found[name] == 0.0 for name in ("Xq", "Xr", "Zq", "Zp", "Yp", "Yr"))
    assert found["Zw"] == -0.7
    assert found["XB1"] == 9.0
    assert read_published(path)["Zq"] == 30.0
    assert not [name for name in found if "phi" in name or "psi" in name]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("name,value\n", "no rows under its head"),
        ("name,value\nQ_u,1\n", "Q_u: is no derivative that is known here"),
        ("name,value\nX_u,much\n", "Xu: is 'much', expected a number"),
        ("name,value\nX_u,inf\n", "Xu: is 'inf', expected a number"),
        ("name,value,unit\nM_B1,1,1/s^2/inch\n", "divide them by the radians"),
        ("name,value\nXu,1\nX_u,2\n", "Xu: is there twice"),
        (",u,w\npitch,1,2\n", "pitch: is no derivative"),
        (",u,w\nphi,1,2\n", "has no derivative in it"),
    ],
)
def test_what_is_wrong_with_a_file(text: str, said: str, tmp_path: Path) -> None:
    path = written(tmp_path, text)
    with pytest.raises(SwashError) as raised:
        read_published(path)
    assert said in str(raised.value)
    assert str(path) in str(raised.value)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(SwashError, match=r"none\.csv: cannot be read"):
        read_published(tmp_path / "none.csv")
