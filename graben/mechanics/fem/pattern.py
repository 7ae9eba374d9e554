"""Sparsity pattern of a stiffness matrix, computed once, in compressed columns (what SuperLU reads)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp


@dataclass(frozen=True)
class Pattern:
    """Where each entry of each element matrix goes.

    Attributes
    ----------
    indptr, indices : compressed columns of the full matrix
    slot : (e, d, d) position in the value array of entry (row, column) of each element matrix
    size : number of degrees of freedom
    """

    indptr: np.ndarray
    indices: np.ndarray
    slot: np.ndarray
    size: int

    def matrix(self, values: np.ndarray) -> sp.csc_matrix:
        """The full matrix that holds `values`."""
        return sp.csc_matrix((values, self.indices, self.indptr), shape=(self.size, self.size))


def pattern_of(dofs: np.ndarray, size: int) -> Pattern:
    """Pattern of the matrix assembled from elements with degrees of freedom `dofs` (e, d)."""
    d = dofs.shape[1]
    rows = np.repeat(dofs, d, axis=1).astype(np.int64)
    columns = np.tile(dofs, (1, d)).astype(np.int64)
    keys, inverse = np.unique(columns.ravel() * size + rows.ravel(), return_inverse=True)
    indptr = np.searchsorted(keys, np.arange(size + 1, dtype=np.int64) * size)
    return Pattern(
        indptr=indptr.astype(np.int32),
        indices=(keys % size).astype(np.int32),
        slot=np.ascontiguousarray(inverse.reshape(-1, d, d), dtype=np.int64),
        size=size,
    )


@dataclass(frozen=True)
class Block:
    """A submatrix (rows x columns) of a pattern, refilled from the full value array without searching."""

    indptr: np.ndarray
    indices: np.ndarray
    source: np.ndarray
    shape: tuple[int, int]

    def matrix(self, values: np.ndarray) -> sp.csc_matrix:
        """The submatrix for the full value array `values`."""
        return sp.csc_matrix((values[self.source], self.indices, self.indptr), shape=self.shape)


def block_of(pattern: Pattern, rows: np.ndarray, columns: np.ndarray) -> Block:
    """Submatrix of the given rows and columns (index arrays, ascending)."""
    numbered = pattern.matrix(np.arange(1, len(pattern.indices) + 1, dtype=np.float64))
    part = numbered[rows][:, columns].tocsc()
    part.sort_indices()
    return Block(part.indptr, part.indices, part.data.astype(np.int64) - 1, part.shape)
