"""Vicon and OptiTrack CSV exports: formats, frames and bad input, on exports written here in the programs' layout."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from made_logs import motive, vicon
from swashplate.errors import FlightError, UnitError
from swashplate.flights.flight import Flight
from swashplate.flights.readers import frames
from swashplate.flights.readers.read import read
from swashplate.flights.schema import QUATERNION


def _file(folder: Path, text: str) -> Path:
    path = folder / "take.csv"
    path.write_text(text, encoding="utf-8")
    return path


def _euler(flight: Flight) -> np.ndarray:
    """phi, theta, psi [rad], shape (n, 3)."""
    return Rotation.from_quat(flight.array(QUATERNION), scalar_first=True).as_euler("ZYX")[:, ::-1]


def test_vicon_helical_angles_and_millimetres(tmp_path: Path) -> None:
    flight = read(_file(tmp_path, vicon(["11,0,0.1,0,0,1000,2000,3000", "12,0,0,0.2,0,1001,2000,3000"])))
    assert flight.time("x").tolist() == [0.0, 0.01]
    assert [flight.values(name)[0] for name in "xyz"] == [1.0, -2.0, -3.0]
    # z up, y left: roll keeps its sign, nose-up pitch is a negative turn about the logged y axis
    assert _euler(flight) == pytest.approx(np.array([[0.1, 0, 0], [0, -0.2, 0]]), abs=1e-12)
    assert (flight.provenance.reader, flight.provenance.vehicle) == ("vicon", "coax:coax")
    assert any("frame 11" in note for note in flight.provenance.notes)
    assert any("forward-left-up (assumed" in note for note in flight.provenance.notes)


def test_vicon_quaternion_and_a_chosen_subject(tmp_path: Path) -> None:
    names = ",,Global Angle (Quaternion) wand:wand,,,,,,,Global Angle (Quaternion) coax:coax,,,,,,"
    columns = "Frame,Sub Frame" + 2 * ",RX,RY,RZ,RW,TX,TY,TZ"
    units = ",," + ",".join(2 * ["", "", "", "", "mm", "mm", "mm"])
    z = np.sin(0.15), np.cos(0.15)
    rows = [f"{i},0,0,0,0,1,0,0,1,0,0,{z[0]},{z[1]},5,6,7" for i in (1, 2, 3)]
    path = _file(tmp_path, vicon(rows, names=names, columns=columns, units=units))
    with pytest.raises(FlightError, match="several bodies: wand:wand, coax:coax"):
        read(path)
    with pytest.raises(FlightError, match="no body 'heli'"):
        read(path, body="heli")
    flight = read(path, body="coax:coax")
    assert _euler(flight)[0] == pytest.approx([0, 0, -0.3], abs=1e-12)  # nose left is negative yaw
    assert flight.values("x")[0] == 0.005


def test_nexus_segments_need_to_be_told_the_rotation(tmp_path: Path) -> None:
    rows = ["1,0,90,0,0,0,0,0", "2,0,90,0,10,0,0,1"]
    path = _file(tmp_path, vicon(rows, title="Segments", names=",,coax:body,,,,,", units=",,deg,deg,deg,mm,mm,mm"))
    with pytest.raises(FlightError, match="rotation='helical' or rotation='euler_xyz'"):
        read(path)
    with pytest.raises(FlightError, match="rotation 'upside-down' is not known"):
        read(path, rotation="upside-down")
    assert _euler(read(path, rotation="euler_xyz"))[0] == pytest.approx([np.pi / 2, 0, 0], abs=1e-12)
    assert read(path, mapping={"mocap": {"rotation": "helical"}}).provenance.vehicle == "coax:body"


def test_markers_give_a_position_only(tmp_path: Path) -> None:
    text = vicon(
        ["1,0,1,2,3", "2,0,1,2,4"], title="Trajectories", names=",,coax:nose,,", columns="Frame,Sub Frame,X,Y,Z"
    )
    flight = read(_file(tmp_path, text.replace(",,rad,rad,rad,mm,mm,mm", ",,mm,mm,mm")))
    assert flight.channels == ("x", "y", "z")
    assert flight.values("z").tolist() == [-0.003, -0.004]


def test_poses_are_found_behind_another_block(tmp_path: Path) -> None:
    devices = "Devices\n1000\n,,Force,,\nFrame,Sub Frame,Fx,Fy,Fz\n,,N,N,N\n1,0,1,2,3\n\n"
    flight = read(_file(tmp_path, devices + vicon(["1,0,0,0,0,1,1,1", "2,0,0,0,0.1,1,1,1"])))
    assert flight.channels == ("x", "y", "z", *QUATERNION)
    with pytest.raises(FlightError, match="holds Devices, expected Objects"):
        read(_file(tmp_path, devices))


@pytest.mark.parametrize("lost", ["2,0,,,,,,", "2,0,0,0,0,0,0,0", "2,0"])
def test_occluded_samples_are_dropped_and_counted(tmp_path: Path, lost: str) -> None:
    flight = read(_file(tmp_path, vicon(["1,0,0.1,0,0,1,1,1", lost, "3,0,0.1,0,0,1,1,2"])))
    assert flight.time("x").tolist() == [0.0, 0.02]
    assert flight.provenance.damage == ("1 of 3 samples (33.3 %) are lost: 'coax:coax' was not seen (occlusion)",)


BAD_VICON = {
    "no rate": (vicon(["1,0,0,0,0,1,1,1"]).replace("100", "fast", 1), "frame rate in line 2"),
    "header only": ("Objects\n100\n,,a\n", "ends in its header"),
    "never seen": (vicon(["1,0,,,,,,", "2,0,,,,,,"]), "seen in 0 of 2 samples"),
    "no data": (vicon([]), "seen in 0 of 0 samples"),
    "backwards": (vicon(["2,0,0,0,0,1,1,1", "1,0,0,0,0,1,1,1"]), "time goes backwards at sample 1"),
    "text": (vicon(["1,0,a,0,0,1,1,1"]), "RX: 'a' in line 6 is not a number"),
    "frame missing": (vicon(["1,0,0,0,0,1,1,1", ",0,0,0,0,1,1,1"]), "Frame: 1 of 2 samples are not finite"),
    "no pose": (vicon(["1,0,1"], columns="Frame,Sub Frame,RX", units=",,rad"), "TX, TY, TZ, RY, RZ are missing"),
    "odd unit": (
        vicon(["1,0,0,0,0,1,1,1", "2,0,0,0,0,1,1,2"], units=",,rad,rad,rad,ell,ell,ell"),
        "'ell' is not known",
    ),
    "mixed units": (vicon(["1,0,0,0,0,1,1,1"], units=",,rad,deg,rad,mm,mm,mm"), "angles' units"),
}


@pytest.mark.parametrize(("text", "message"), BAD_VICON.values(), ids=BAD_VICON.keys())
def test_a_bad_vicon_export_is_named(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(FlightError, match=message) as caught:
        read(_file(tmp_path, text))
    assert "take.csv" in str(caught.value)


def test_motive_is_y_up(tmp_path: Path) -> None:
    c, s = np.cos(0.05), np.sin(0.05)
    turns = [f"{s},0,0,{c}", f"0,{s},0,{c}", f"0,0,{s},{c}"]  # about the logged x (forward), y (up), z (right)
    rows = [f"{i},{i / 120:.6f},{q},1.0,2.0,3.0,0.0001,0,0,0" for i, q in enumerate(turns)]
    flight = read(_file(tmp_path, motive(rows)))
    assert [flight.values(name)[0] for name in "xyz"] == [1.0, 3.0, -2.0]
    assert _euler(flight) == pytest.approx(np.array([[0.1, 0, 0], [0, 0, -0.1], [0, 0.1, 0]]), abs=1e-12)
    assert flight.time("x").tolist() == [0.0, 0.008333, 0.016667]
    assert (flight.provenance.reader, flight.provenance.vehicle) == ("optitrack", "coax")


def test_motive_with_z_up_axes_told_and_millimetres(tmp_path: Path) -> None:
    rows = [f"{i},{i / 120},0,0,0,1,1000,2000,3000,0,0,0,0" for i in range(3)]
    path = _file(tmp_path, motive(rows, first="Rotation Type,Quaternion,Length Units,Millimeters"))
    flight = read(path, world_axes="north-west-up", body_axes="forward-left-up")
    assert [flight.values(name)[0] for name in "xyz"] == [1.0, -2.0, -3.0]
    assert any("forward-left-up (as told" in note for note in flight.provenance.notes)


def test_motive_euler_angles_and_the_newer_header(tmp_path: Path) -> None:
    header = (
        "Format Version,1.25,Rotation Type,XYZ,Length Units,Meters,Coordinate Space,Global\n\n"
        ",Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body\n"
        ",Name,heli,heli,heli,heli,heli,heli\n,ID,1,1,1,1,1,1\n,Parent,,,,,,\n"
        ",,Rotation,Rotation,Rotation,Position,Position,Position\nFrame,Time (Seconds),X,Y,Z,X,Y,Z\n"
    )
    flight = read(_file(tmp_path, header + "0,0.0,10,0,0,0,1,0\n1,0.01,,,,,,\n2,0.02,0,0,10,0,1,0\n"))
    assert np.rad2deg(_euler(flight)) == pytest.approx(np.array([[10, 0, 0], [0, 10, 0]]), abs=1e-9)
    assert any("1 of 3 samples (33.3 %) are lost" in said for said in flight.provenance.damage)


BAD_MOTIVE = {
    "local": (motive(["0,0,0,0,0,1,0,0,0"]).replace("Global", "Local"), "coordinate space is 'Local'"),
    "no axes row": ("Format Version,1.23\n\nnothing,here\n", "no row 'Frame, Time"),
    "markers only": (motive([]).replace("Rigid Body,", "Marker,"), "no rigid body"),
    "no length unit": (motive(["0,0,0,0,0,1,0,0,0", "1,1,0,0,0,1,0,0,0"], first="Rotation Type,Quaternion"), "unit ''"),
    "no unit quaternion": (motive(["0,0,0,0,0,3,0,0,0", "1,1,0,0,0,3,0,0,0"]), "norm is off 1 by 2"),
    "duplicated": (motive(["0,0,0,0,0,1,0,0,0", "1,0,0,0,0,1,1,0,0"]), "repeats the stamp"),
}


@pytest.mark.parametrize(("text", "message"), BAD_MOTIVE.values(), ids=BAD_MOTIVE.keys())
def test_a_bad_motive_export_is_named(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(FlightError, match=message) as caught:
        read(_file(tmp_path, text))
    assert "take.csv" in str(caught.value)


@pytest.mark.parametrize("axes", ["forward-right-up", "forward-forward-up", "sideways-left-up", "up"])
def test_axes_must_be_right_handed(tmp_path: Path, axes: str) -> None:
    rows = ["1,0,0.1,0,0,1000,2000,3000", "2,0,0,0.2,0,1001,2000,3000"]
    with pytest.raises(FlightError, match=f"'{axes}' does not describe right-handed axes"):
        read(_file(tmp_path, vicon(rows)), body_axes=axes)


def test_the_short_cut_for_z_up_is_the_general_product() -> None:
    quaternion = Rotation.random(20, rng=np.random.default_rng(1)).as_quat(scalar_first=True)
    up = frames.axes("north-west-up")
    general = Rotation.from_matrix(up @ Rotation.from_quat(quaternion, scalar_first=True).as_matrix() @ up.T)
    short = Rotation.from_quat(frames.attitude(quaternion, world=up, body=up), scalar_first=True)
    assert (short * general.inv()).magnitude() == pytest.approx(0.0, abs=1e-7)
    y_up, body = frames.axes("north-up-east"), frames.axes("forward-up-right")
    expected = y_up @ Rotation.from_quat(quaternion, scalar_first=True).as_matrix() @ body.T
    found = Rotation.from_quat(frames.attitude(quaternion, world=y_up, body=body), scalar_first=True).as_matrix()
    assert found == pytest.approx(expected, abs=1e-12)


def test_a_wrong_table_in_the_mapping(tmp_path: Path) -> None:
    path = _file(tmp_path, vicon(["1,0,0,0,0,1,1,1"]))
    with pytest.raises(FlightError, match=r"\[mocap\] may hold"):
        read(path, mapping={"mocap": {"axes": "up"}})
    with pytest.raises(FlightError, match="must be text"):
        read(path, mapping={"mocap": {"rotation": 3}})
    with pytest.raises(UnitError, match=r"unit 'deg' is a unit of"):
        read(_file(tmp_path, vicon(["1,0,0,0,0,1,1,1", "2,0,0,0,0,1,1,1"])), units={"position": "deg"})


@pytest.mark.parametrize("make", [vicon, motive])
def test_rows_longer_than_the_heads_are_never_read(tmp_path: Path, make: Callable[[list[str]], str]) -> None:
    """A column more in the middle would turn a rotation into a position."""
    row = "{k},{k},0,0,0,1,{k},2" if make is vicon else "{k},0.0{k},0,0,0,1,{k},2,3,0,0,0,0"
    rows = [row.format(k=k) for k in range(1, 7)]
    whole = read(_file(tmp_path, make(rows)))
    flight = read(_file(tmp_path, make([*rows[:4], *[f"{line},0" for line in rows[4:]]])))
    assert flight.values("x").tolist() == whole.values("x").tolist()[:4]
    assert "2 of 6 rows (33.3 %) are lost" in flight.provenance.damage[0]
    assert whole.provenance.damage == ()
