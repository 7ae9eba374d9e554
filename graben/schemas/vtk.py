"""Fields for ParaView: VTU files and a PVD that puts them on a time axis, written by pyvista."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from graben.schemas.files import whole_file


def write_vtu(
    path: str | Path,
    points: np.ndarray,
    cells: Mapping[str, np.ndarray],
    point_data: Mapping[str, np.ndarray] | None = None,
    cell_data: Mapping[str, np.ndarray] | None = None,
) -> None:
    """Write one unstructured grid.

    Parameters
    ----------
    points : (n, 2) or (n, 3), m; 2D points and 2D vectors (n, 2) get a zero third component
    cells : cell type ("vertex", "line", "triangle", "quad", "hexahedron") -> connectivity (m, k)
    point_data : name -> (n,) or (n, k)
    cell_data : name -> (m_total, ...) in the order of `cells`. Symmetric tensors have 6 components
        (xx, yy, zz, xy, yz, zx), the order that VTK uses too
    """
    import pyvista

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
    for name, values in (cell_data or {}).items():
        grid.cell_data[name] = _three(values) if _is_plane_vector(values) else np.asarray(values)
    with whole_file(path) as temporary:
        grid.save(temporary, binary=True)


def _is_plane_vector(values: Any) -> bool:
    array = np.asarray(values)
    return array.ndim == 2 and array.shape[1] == 2


def _three(vectors: np.ndarray) -> np.ndarray:
    vectors = np.asarray(vectors, dtype=np.float64)
    if vectors.shape[1] == 3:
        return np.ascontiguousarray(vectors)
    return np.hstack([vectors, np.zeros((len(vectors), 1))])


class VtuSeries:
    """VTU files of a run in the folder ``NAME.vtu/`` and a ``NAME.pvd`` beside it, written last.

    >>> with VtuSeries("results/run.nc") as series:          # doctest: +SKIP
    ...     series.add(0.0, points, {"triangle": triangles})

    Leaving the block puts the files in place; leaving it by an exception leaves nothing.
    """

    def __init__(self, artifact: str | Path) -> None:
        artifact = Path(artifact)
        self.pvd = artifact.with_suffix(".pvd")
        self.folder = artifact.with_suffix(".vtu")
        self._building = artifact.with_name(f".{artifact.stem}.part.vtu")
        shutil.rmtree(self._building, ignore_errors=True)
        self._times: list[float] = []

    def __enter__(self) -> VtuSeries:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: object, trace: object) -> None:
        if kind is None:
            self.close()
        else:
            self.discard()

    def add(
        self,
        time: float,
        points: np.ndarray,
        cells: Mapping[str, np.ndarray],
        point_data: Mapping[str, np.ndarray] | None = None,
        cell_data: Mapping[str, np.ndarray] | None = None,
    ) -> None:
        """Write the next state; see `write_vtu`."""
        write_vtu(self._building / f"{len(self._times):04d}.vtu", points, cells, point_data, cell_data)
        self._times.append(float(time))

    def close(self) -> Path:
        """Put the folder in place and write the PVD; returns its path."""
        shutil.rmtree(self.folder, ignore_errors=True)
        self._building.rename(self.folder)
        rows = "".join(
            f'    <DataSet timestep="{t!r}" part="0" file={quoteattr(f"{self.folder.name}/{i:04d}.vtu")}/>\n'
            for i, t in enumerate(self._times)
        )
        with whole_file(self.pvd) as temporary:
            temporary.write_text(
                '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
                f"  <Collection>\n{rows}  </Collection>\n</VTKFile>\n",
                encoding="utf-8",
            )
        return self.pvd

    def discard(self) -> None:
        """Forget what was added, after a failure."""
        shutil.rmtree(self._building, ignore_errors=True)
