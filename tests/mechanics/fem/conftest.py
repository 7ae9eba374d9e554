"""Small bodies for the tests of the plane-strain solver."""

import numpy as np
import pytest

from graben.mechanics.fem.body import Material, make_body
from graben.mechanics.materials.laws import LAWS, pack
from graben.mechanics.meshes.mesh2d import QuadMesh


@pytest.fixture(scope="session")
def material():
    def make(name, **values):
        parameters = pack(name, values)
        return Material(LAWS[name].id, parameters, LAWS[name].initial_state(parameters))

    return make


@pytest.fixture(scope="session")
def grid():
    """Rectangle of nx x ny quads; `bend` moves inner nodes (a part of the pitch), in a fixed irregular way."""

    def make(width, height, nx, ny, bend=0.0):
        x, y = np.meshgrid(np.linspace(0, width, nx + 1), np.linspace(0, height, ny + 1), indexing="ij")
        number = np.arange(x.size).reshape(x.shape)
        wave = np.sin(7.0 * number) * bend
        x[1:-1, 1:-1] += (wave * width / nx)[1:-1, 1:-1]
        y[1:-1, 1:-1] += (np.cos(5.0 * number) * bend * height / ny)[1:-1, 1:-1]
        ids = np.arange(x.size).reshape(x.shape)
        quads = np.stack([ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]], axis=-1).reshape(-1, 4)
        return QuadMesh(np.stack([x.ravel(), y.ravel()], axis=1), quads)

    return make


@pytest.fixture(scope="session")
def body():
    """Body of one material; `fix(x, y)` gives the two masks of prescribed displacement."""

    def make(mesh, material, fix, **options):
        fixed = np.stack(fix(*mesh.points.T), axis=1)
        return make_body(mesh, [material], fixed.ravel(), **options)

    return make
