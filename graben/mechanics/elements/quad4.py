"""4-node quadrilateral: bilinear shape functions, and 2 x 2 Gauss points of weight 1. Corners counter-clockwise."""

from __future__ import annotations

import numpy as np

_CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
GAUSS = _CORNERS / np.sqrt(3.0)


def shape_functions(local: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values (g, 4) and local derivatives (g, 4, 2) of the shape functions at local points (g, 2)."""
    a, b = 1.0 + local[:, None, 0] * _CORNERS[:, 0], 1.0 + local[:, None, 1] * _CORNERS[:, 1]
    derivatives = 0.25 * np.stack([_CORNERS[:, 0] * b, _CORNERS[:, 1] * a], axis=-1)
    return 0.25 * a * b, derivatives
