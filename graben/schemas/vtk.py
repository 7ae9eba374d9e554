"""Fields for ParaView: VTU files and a PVD that puts them on a time axis.

The format is small and written here: importing VTK would take longer than a small run, and its own writing to a file
ends without an error, or ends the process, where the disk is full. Tests read the files back with VTK.
"""

from __future__ import annotations

import base64
import struct
import zlib
from collections.abc import Collection, Iterator, Mapping
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

    Parameters
    ----------
    points : (n, 2) or (n, 3), m; 2D points and 2D vectors (n, 2) get a zero third component
    cells : cell type ("vertex", "line", "triangle", "quad", "hexahedron") -> connectivity (m, k)
    point_data : name -> (n,) or (n, k)
    cell_data : name -> (m_total, ...) in the order of `cells`. Symmetric tensors have 6 components
        (xx, yy, zz, xy, yz, zx), the order that VTK uses too
    """
    corners = {name: np.asarray(rows, dtype=np.int64) for name, rows in cells.items()}
    sizes = np.concatenate([np.full(len(rows), rows.shape[1]) for rows in corners.values()])
    kinds = np.concatenate([np.full(len(rows), _KINDS[name], dtype=np.uint8) for name, rows in corners.items()])
    # A grid without cells, such as the contacts of blocks that all fell, has no data either.
    of_cells = cell_data or {} if len(kinds) else {}
    return "".join(
        [
            '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"',
            ' header_type="UInt64" compressor="vtkZLibDataCompressor">\n<UnstructuredGrid>\n',
            f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(kinds)}">\n<PointData>\n',
            *(_field(name, values, len(points)) for name, values in (point_data or {}).items()),
            "</PointData>\n<CellData>\n",
            *(_field(name, values, len(kinds)) for name, values in of_cells.items()),
            "</CellData>\n<Points>\n",
            _data_array("Points", _three(points)),
            "</Points>\n<Cells>\n",
            _data_array("connectivity", np.concatenate([rows.ravel() for rows in corners.values()])),
            _data_array("offsets", np.cumsum(sizes, dtype=np.int64)),
            _data_array("types", kinds),
            "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
        ]
    ).encode()


_KINDS = {"vertex": 1, "line": 3, "triangle": 5, "quad": 9, "hexahedron": 12}
_PREFIX = {"f": "Float", "i": "Int", "u": "UInt"}
_BLOCK = 1 << 20  # bytes that are compressed at a time


def _field(name: str, values: Any, expected: int) -> str:
    array = _three(values) if _is_plane_vector(values) else np.asarray(values)
    if len(array) != expected:
        raise ValueError(f"field {name!r} of a VTU file has {len(array)} rows, expected {expected}")
    return _data_array(name, array)


def _data_array(name: str, array: np.ndarray) -> str:
    """Numbers as VTK's inline binary: base64 of a header and of compressed blocks."""
    array = array.astype(np.uint8) if array.dtype.kind == "b" else array
    kind = f"{_PREFIX[array.dtype.kind]}{8 * array.dtype.itemsize}"
    data = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("<")).tobytes()
    parts = [zlib.compress(data[k : k + _BLOCK], 1) for k in range(0, len(data), _BLOCK)]
    header = struct.pack(f"<{3 + len(parts)}Q", len(parts), _BLOCK, len(data) % _BLOCK, *map(len, parts))
    text = (base64.b64encode(header) + base64.b64encode(b"".join(parts))).decode()
    columns = array.shape[1] if array.ndim > 1 else 1
    about = f'type="{kind}" Name={quoteattr(name)} NumberOfComponents="{columns}" format="binary"'
    return f"<DataArray {about}>{text}</DataArray>\n"


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

    def __init__(self, building: Path, fields: Collection[str] | None) -> None:
        self._building, self._fields = building, fields
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
        text = vtu_bytes(points, cells, self._asked(point_data), self._asked(cell_data))
        (self._building / f"{len(self.times):04d}.vtu").write_bytes(text)
        self.times.append(float(time))

    def _asked(self, data: Mapping[str, np.ndarray] | None) -> dict[str, np.ndarray]:
        return {n: values for n, values in (data or {}).items() if self._fields is None or n in self._fields}


@contextmanager
def vtu_series(artifact: str | Path, tag: str = "", fields: Collection[str] | None = None) -> Iterator[VtuSeries]:
    """VTU files in the folder ``NAME.vtu/`` beside the artifact, and a ``NAME.pvd``.

    tag : put behind NAME; fields : those that are written of what is added, None: all

    >>> with vtu_series("results/run.nc") as series:          # doctest: +SKIP
    ...     series.add(0.0, points, {"triangle": triangles})

    Leaving the block puts the files in place; leaving it by an exception leaves nothing.
    """
    artifact = Path(artifact)
    folder, pvd = beside(artifact, tag + FOLDER), beside(artifact, tag + PVD)
    with together():
        with whole_file(folder) as building:
            building.mkdir()
            series = VtuSeries(building, fields)
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
