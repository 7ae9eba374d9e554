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


@pytest.mark.parametrize("rows", [1, 3, (1 << 20) // 8, (1 << 20) // 8 + 1, 400_000])
def test_fields_of_any_size_and_type_come_back_as_they_were(rows, tmp_path):
    import pyvista

    rng = np.random.default_rng(rows)
    fields = {
        "double": rng.normal(size=rows),
        '<vector> & "name"': rng.normal(size=(rows, 3)),
        "single": rng.normal(size=rows).astype(np.float32),
        **{kind: rng.integers(0, 99, rows).astype(kind) for kind in ("i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8")},
        "big-endian": rng.normal(size=rows).astype(">f8"),
        "flag": rng.random(rows) < 0.5,
        "nan": np.full(rows, np.nan),
    }
    points = rng.normal(size=(rows, 3))
    write_vtu(tmp_path / "a.vtu", points, {"vertex": np.arange(rows)[:, None]}, fields, fields)
    grid = pyvista.read(tmp_path / "a.vtu")
    assert np.array_equal(grid.points, points) and grid.n_cells == rows
    for data in (grid.point_data, grid.cell_data):
        for name, values in fields.items():
            assert np.array_equal(data[name], values, equal_nan=values.dtype.kind == "f"), name


def test_a_field_of_another_length_is_refused(tmp_path):
    with pytest.raises(ValueError, match="has 2 rows, expected 1"):
        write_vtu(tmp_path / "a.vtu", SQUARE, {"quad": np.array([[0, 1, 2, 3]])}, {}, {"t": np.zeros(2)})
    assert not (tmp_path / "a.vtu").exists()


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
