"""A body of quads: rigid motion, patch test, stiffness against a plain reference."""

import numpy as np
import pytest

from graben.mechanics.fem.newton import NewtonOptions, equilibrate

TIGHT = NewtonOptions(tolerance=1e-11)


def plain_stiffness(mesh, young, poisson):
    """Reference: loops, B-bar written out from its definition."""
    lame, mu = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))
    elastic = np.array([[lame + 2 * mu, lame, 0], [lame, lame + 2 * mu, 0], [0, 0, mu]])
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    stiffness = np.zeros((2 * len(mesh.points),) * 2)
    for quad in mesh.quads:
        xy = mesh.points[quad]
        points = []
        for gx, gy in corners:
            a, b = gx / 3**0.5, gy / 3**0.5
            local = np.array([[cx * (1 + cy * b) / 4, cy * (1 + cx * a) / 4] for cx, cy in corners])
            jacobian = local.T @ xy
            gradient = local @ np.linalg.inv(jacobian).T
            points.append((np.linalg.det(jacobian), gradient))
        area = sum(w for w, _ in points)
        mean = sum(w * g for w, g in points) / area
        ke = np.zeros((8, 8))
        for w, g in points:
            b = np.zeros((3, 8))
            for n in range(4):
                b[:, 2 * n] = g[n, 0], 0, g[n, 1]
                b[:, 2 * n + 1] = 0, g[n, 1], g[n, 0]
                b[:2, 2 * n] += 0.5 * (mean[n, 0] - g[n, 0])
                b[:2, 2 * n + 1] += 0.5 * (mean[n, 1] - g[n, 1])
            ke += w * b.T @ elastic @ b
        dofs = np.stack([2 * quad, 2 * quad + 1], axis=1).ravel()
        stiffness[np.ix_(dofs, dofs)] += ke
    return stiffness


def test_assembled_stiffness_equals_the_plain_reference(grid, body, material):
    mesh = grid(2.0, 1.0, 4, 3, bend=0.25)
    b = body(mesh, material("elastic", young_modulus=3e9, poisson_ratio=0.3), lambda x, y: (x == 0, x == 0))
    response = b.respond(b.untouched(), np.zeros(b.pattern.size), True)
    reference = plain_stiffness(mesh, 3e9, 0.3)
    found = b.pattern.matrix(response.values).toarray()
    np.testing.assert_allclose(found, reference, atol=1e-11 * np.abs(reference).max())
    np.testing.assert_array_equal(b.free_block.matrix(response.values).toarray(), found[np.ix_(b.free, b.free)])
    np.testing.assert_array_equal(b.coupling_block.matrix(response.values).toarray(), found[np.ix_(b.free, b.fixed)])


def test_rigid_motion_gives_no_force_and_the_stiffness_has_just_three_such_modes(grid, body, material):
    mesh = grid(1.0, 1.0, 1, 1)
    b = body(mesh, material("elastic", young_modulus=1.0, poisson_ratio=0.3), lambda x, y: (x == 0, x == 0))
    values = np.linalg.eigvalsh(b.pattern.matrix(b.respond(b.untouched(), np.zeros(8), True).values).toarray())
    assert np.sum(np.abs(values) < 1e-12) == 3  # no hourglass: B-bar keeps the shear points


@pytest.mark.parametrize("mean_dilatation", [True, False])
@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.4999])
def test_patch_test_an_affine_outline_gives_an_affine_inside(grid, body, material, mean_dilatation, poisson):
    mesh = grid(3.0, 2.0, 5, 4, bend=0.3)
    edge = lambda x, y: (  # noqa: E731
        (x == 0) | (x == 3) | (y == 0) | (y == 2),
        (x == 0) | (x == 3) | (y == 0) | (y == 2),
    )
    law = material("elastic", young_modulus=2e9, poisson_ratio=poisson)
    b = body(mesh, law, edge, mean_dilatation=mean_dilatation)
    gradient = np.array([[1e-3, 4e-4], [-2e-4, -7e-4]])
    affine = (mesh.points @ gradient.T).ravel()
    step = equilibrate(b, b.untouched(), np.zeros(b.pattern.size), affine[b.fixed], TIGHT)
    assert step.converged
    np.testing.assert_allclose(step.state.displacement, affine, atol=1e-13)
    strain = b.strain(step.state.displacement)
    np.testing.assert_allclose(strain, np.broadcast_to([1e-3, -7e-4, 0, 1e-4], strain.shape), atol=1e-13)
    lame, mu = 2e9 * poisson / ((1 + poisson) * (1 - 2 * poisson)), 1e9 / (1 + poisson)
    stress = [lame * 3e-4 + 2 * mu * 1e-3, lame * 3e-4 - 2 * mu * 7e-4, lame * 3e-4, 2 * mu * 1e-4]
    np.testing.assert_allclose(step.state.stress, np.broadcast_to(stress, strain.shape), rtol=1e-8, atol=1e-3)
