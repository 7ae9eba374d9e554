"""Fields for ParaView: VTU files and a PVD that puts them on a time axis, written by pyvista."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from graben.schemas.files import together, whole_file
from graben.schemas.outputs import FOLDER, PVD, beside, owner_mark


def write_vtu(path: str | Path, *fields: Any) -> None:
    """Write one unstructured grid, a whole file or none; `fields` as for `vtu_bytes`."""
    text = vtu_bytes(*fields)
    with whole_file(path) as temporary:
        temporary.write_bytes(text)


def vtu_bytes(
    points: np.ndarray,
    cells: Mapping[str, np.ndarray],
    point_data: Mapping[str, np.ndarray] | None = None,
    cell_data: Mapping[str, np.ndarray] | None = None,
) -> bytes:
    """One unstructured grid as the text of a VTU file.

    VTK's own writing to a file ends without an error, or ends the process, where the disk is full.

    Parameters
    ----------
    points : (n, 2) or (n, 3), m; 2D points and 2D vectors (n, 2) get a zero third component
    cells : cell type ("vertex", "line", "triangle", "quad", "hexahedron") -> connectivity (m, k)
    point_data : name -> (n,) or (n, k)
    cell_data : name -> (m_total, ...) in the order of `cells`. Symmetric tensors have 6 components
        (xx, yy, zz, xy, yz, zx), the order that VTK uses too
    """
    import pyvista
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    types = {
        "vertex": pyvista.CellType.VERTEX,
        "line": pyvista.CellType.LINE,
        "triangle": pyvista.CellType.TRIANGLE,
        "quad": pyvista.CellType.QUAD,
        "hexahedron": pyvista.CellType.HEXAHEDRON,
    }
    connectivity, kinds = [], []
    for name, corners in cells.items():
        corners = np.asarray(corners, dtype=np.int64)
        count = np.full((len(corners), 1), corners.shape[1])
        connectivity.append(np.hstack([count, corners]).ravel())
        kinds.append(np.full(len(corners), int(types[name]), dtype=np.uint8))
    grid = pyvista.UnstructuredGrid(np.concatenate(connectivity), np.concatenate(kinds), _three(points))
    for name, values in (point_data or {}).items():
        grid.point_data[name] = _three(values) if _is_plane_vector(values) else np.asarray(values)
    # A grid without cells, such as the contacts of blocks that all fell, has no data either.
    for name, values in (cell_data or {}).items() if grid.n_cells else ():
        grid.cell_data[name] = _three(values) if _is_plane_vector(values) else np.asarray(values)
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetInputData(grid)
    writer.SetDataModeToBinary()
    writer.WriteToOutputStringOn()
    if not writer.Write():
        raise RuntimeError(f"VTK wrote no grid of {len(points)} points")
    return str(writer.GetOutputString()).encode()


def _is_plane_vector(values: Any) -> bool:
    array = np.asarray(values)
    return array.ndim == 2 and array.shape[1] == 2


def _three(vectors: np.ndarray) -> np.ndarray:
    vectors = np.asarray(vectors, dtype=np.float64)
    if vectors.shape[1] == 3:
        return np.ascontiguousarray(vectors)
    return np.hstack([vectors, np.zeros((len(vectors), 1))])


class VtuSeries:
    """The states of a series that is being written; see `vtu_series`."""

    def __init__(self, building: Path) -> None:
        self._building = building
        self.times: list[float] = []

    def add(
        self,
        time: float,
        points: np.ndarray,
        cells: Mapping[str, np.ndarray],
        point_data: Mapping[str, np.ndarray] | None = None,
        cell_data: Mapping[str, np.ndarray] | None = None,
    ) -> None:
        """Write the next state; see `vtu_bytes`."""
        text = vtu_bytes(points, cells, point_data, cell_data)
        (self._building / f"{len(self.times):04d}.vtu").write_bytes(text)
        self.times.append(float(time))


@contextmanager
def vtu_series(artifact: str | Path, tag: str = "") -> Iterator[VtuSeries]:
    """VTU files in the folder ``NAME.vtu/`` beside the artifact, and a ``NAME.pvd``; tag : put behind NAME.

    >>> with vtu_series("results/run.nc") as series:          # doctest: +SKIP
    ...     series.add(0.0, points, {"triangle": triangles})

    Leaving the block puts the files in place; leaving it by an exception leaves nothing.
    """
    artifact = Path(artifact)
    folder, pvd = beside(artifact, tag + FOLDER), beside(artifact, tag + PVD)
    with together():
        with whole_file(folder) as building:
            building.mkdir()
            series = VtuSeries(building)
            yield series
        rows = "".join(
            f'    <DataSet timestep="{t!r}" part="0" file={quoteattr(f"{folder.name}/{i:04d}.vtu")}/>\n'
            for i, t in enumerate(series.times)
        )
        with whole_file(pvd) as temporary:
            temporary.write_text(
                f'<?xml version="1.0"?>\n{owner_mark(artifact)}\n'
                '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
                f"  <Collection>\n{rows}  </Collection>\n</VTKFile>\n",
                encoding="utf-8",
            )
