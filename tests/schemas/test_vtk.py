"""VTK files are read back by VTK itself."""

import numpy as np
import pytest

from graben.schemas.vtk import vtu_series, write_vtu

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def test_a_vtu_opens_in_vtk_with_its_fields(tmp_path):
    import pyvista

    path = tmp_path / "a.vtu"
    cells = {"triangle": np.array([[0, 1, 2]]), "line": np.array([[2, 3]])}
    write_vtu(path, SQUARE, cells, {"displacement": SQUARE * 0.1}, {"stress": np.arange(12.0).reshape(2, 6)})
    grid = pyvista.read(path)
    assert grid.n_cells == 2
    assert grid.point_data["displacement"].shape == (4, 3)
    assert grid.cell_data["stress"][1].tolist() == [6, 7, 8, 9, 10, 11]


def test_a_grid_without_cells_opens_too(tmp_path):
    import pyvista

    path = tmp_path / "none.vtu"
    write_vtu(path, SQUARE, {"line": np.zeros((0, 2))}, {}, {"force": np.zeros((0, 2)), "gap": np.zeros(0)})
    grid = pyvista.read(path)
    assert grid.n_cells == 0 and grid.n_points == 4


def test_a_series_puts_states_on_a_time_axis(tmp_path):
    import pyvista

    with vtu_series(tmp_path / "run.nc") as series:
        for time in (0.0, 0.5):
            series.add(time, SQUARE, {"quad": np.array([[0, 1, 2, 3]])}, cell_data={"t": np.array([time])})
        assert not (tmp_path / "run.vtu").exists()
    reader = pyvista.get_reader(tmp_path / "run.pvd")
    assert reader.time_values == [0.0, 0.5]
    reader.set_active_time_value(0.5)
    assert reader.read()[0].cell_data["t"][0] == 0.5


@pytest.mark.parametrize("name", ["a---b", "--", "-", "a&<b>\"'c", "ü ✓", "a.b", "%41"])
def test_series_of_odd_names_open_and_are_known_again(name, tmp_path):
    import pyvista

    from graben.schemas.outputs import SERIES, Outputs

    artifact = tmp_path / f"{name}.nc"
    with vtu_series(artifact) as series:
        series.add(0.0, SQUARE, {"quad": np.array([[0, 1, 2, 3]])})
    assert pyvista.get_reader(tmp_path / f"{name}.pvd").read()[0].n_cells == 1
    Outputs(artifact, SERIES).claim([], overwrite=True)


def test_a_discarded_series_leaves_nothing(tmp_path):
    with pytest.raises(ZeroDivisionError), vtu_series(tmp_path / "run.nc") as series:
        series.add(0.0, SQUARE, {"quad": np.array([[0, 1, 2, 3]])})
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []


def test_unknown_cells_are_refused(tmp_path):
    with pytest.raises(KeyError):
        write_vtu(tmp_path / "a.vtu", SQUARE, {"hexagon": np.array([[0, 1, 2, 3]])})
