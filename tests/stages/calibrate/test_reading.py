"""Curves from CSV and artifacts: units, signs, and every kind of fault named with file, curve, row and column."""

from pathlib import Path

import numpy as np
import pytest

from graben.errors import BadInput
from graben.stages.calibrate.measured import Reading, read_measured

REFERENCE = Path(__file__).parents[3] / "pipelines/upscaling/reference/udec_voronoi_granite_fit.csv"
HEADER = "confining_stress_pa,time_s,stress_xx_pa,stress_yy_pa,strain_xx,strain_yy\n"
ROWS = ["5e5,0,-5e5,-5e5,0,0", "5e5,1,-5e5,-1e6,1e-4,-1e-3", "5e5,2,-5e5,-2e6,2e-4,-2e-3"]


def write(tmp_path, header=HEADER, rows=ROWS):
    path = tmp_path / "curves.csv"
    path.write_text(header + "\n".join(rows) + "\n")
    return path


def faults(path, **reading):
    with pytest.raises(BadInput) as error:
        read_measured([path], Reading(**reading))
    return str(error.value)


def test_the_reference_file_holds_four_curves():
    curves = read_measured([REFERENCE], Reading())
    assert [c.name for c in curves] == ["0.5 MPa", "1 MPa", "2 MPa", "4 MPa"]
    assert all(c.stress.shape == (51, 4) for c in curves)
    assert curves[0].stress[1, 1] == -2.05446e6 and curves[3].strain[-1, 1] < -0.04


def test_units_and_sign_come_from_names_and_settings(tmp_path):
    header = "name,stress_xx_mpa,stress_yy_kpa,strain_xx_percent,strain_yy\n"
    path = write(tmp_path, header, ["a,0.5,500,0,0", "a,0.5,1000,-0.01,0.001"])
    (curve,) = read_measured([path], Reading(sign="compression-positive"))
    np.testing.assert_allclose(curve.stress[:, :2], [[-5e5, -5e5], [-5e5, -1e6]])
    np.testing.assert_allclose(curve.strain[1, :2], [1e-4, -1e-3])


def test_a_triaxial_test_takes_the_lateral_stress_for_both_axes(tmp_path):
    (curve,) = read_measured([write(tmp_path)], Reading(test="triaxial"))
    assert curve.control == "sese" and (curve.stress[:, 2] == curve.stress[:, 0]).all()


def test_two_readings_of_the_lateral_stress_are_one_in_a_triaxial_test(tmp_path):
    path = tmp_path / "both.csv"
    head = "time_s,stress_xx_pa,stress_yy_pa,stress_zz_pa,strain_xx,strain_yy\n"
    path.write_text(head + "0,-5e5,-5e5,-5.02e5,0,0\n1,-5e5,-1e6,-4.96e5,1e-4,-1e-3\n")
    (curve,) = read_measured([path], Reading(test="triaxial"))
    np.testing.assert_allclose(curve.stress[:, [0, 2]], [[-5.01e5] * 2, [-4.98e5] * 2])
    path.write_text(head + "0,-5e5,-5e5,-5e5,0,0\n1,-5e5,-1e6,-2e5,1e-4,-1e-3\n")
    with pytest.raises(BadInput, match=r"row 3, stress_zz = -2e\+05 Pa beside -5e\+05 Pa"):
        read_measured([path], Reading(test="triaxial"))
    read_measured([path], Reading())


@pytest.mark.parametrize(
    ("rows", "texts"),
    [
        (ROWS[:1], ["curve 0.5 MPa", "1 point", "at least two"]),
        ([ROWS[0], "5e5,1,-5e5,nan,1e-4,-1e-3", ROWS[2]], ["row 3", "stress_yy", "finite"]),
        ([ROWS[0], "5e5,1,-5e5,,1e-4,-1e-3", ROWS[2]], ["row 3", "stress_yy", "finite"]),
        ([ROWS[0], "5e5,1,-5e5,abc,1e-4,-1e-3", ROWS[2]], ["row 3", "stress_yy_pa", "'abc'", "a number"]),
        ([ROWS[0], ROWS[2], ROWS[1]], ["row 4", "time", "1 after 2", "increases"]),
        (["5e5,0,5e5,5e5,0,0", "5e5,1,5e5,1e6,-1e-4,1e-3"], ["sign", "compression-positive"]),
        ([ROWS[0], "5e5,1,-5e5,-1e6"], ["row 3", "4 cells", "6 cells"]),
        (["5e5,0,-5e5,-5e5,0,0", "5e5,1,-5e5,-1e6,1e-4,0"], ["strain_yy", "changes"]),
        (["5e5,0,-5e5,-5e5,0,0", "5e5,1,-5e5,-1e6,1e-4,-5"], ["fraction, not percent"]),
        ([], ["no rows"]),
    ],
)
def test_faults_in_rows_name_curve_row_and_column(tmp_path, rows, texts):
    path = write(tmp_path, rows=rows)
    message = faults(path)
    assert str(path) in message
    for text in texts:
        assert text in message


@pytest.mark.parametrize(
    ("header", "texts"),
    [
        (HEADER.replace("stress_yy_pa", "stress_yy"), ["stress_yy", "a unit at the end of its name"]),
        (HEADER.replace("stress_yy_pa", "stress_yy_psi"), ["stress_yy_psi", "a unit"]),
        (HEADER.replace("time_s", "time"), ["time", "time_s"]),
        (HEADER.replace("strain_xx", "colour"), ["colour", "no such column"]),
    ],
)
def test_faults_in_the_header_name_the_column(tmp_path, header, texts):
    message = faults(write(tmp_path, header))
    for text in texts:
        assert text in message


def test_all_faults_of_a_file_come_at_once(tmp_path):
    rows = [ROWS[0], "5e5,1,-5e5,nan,1e-4,-1e-3", "1e6,0,-1e6,-1e6,0,0"]
    message = faults(write(tmp_path, rows=rows))
    assert "row 3" in message and "curve 1 MPa" in message


def test_missing_and_foreign_files_are_named(tmp_path):
    foreign = tmp_path / "x.nc"
    foreign.write_text("not NetCDF")
    with pytest.raises(BadInput) as error:
        read_measured([tmp_path / "absent.csv", foreign], Reading())
    assert "absent.csv" in str(error.value) and "x.nc" in str(error.value)
