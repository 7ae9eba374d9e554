"""Outlines and strains: against slow references and closed forms."""

import numpy as np
import pytest

from graben.mechanics.averaging.outline import domain_outline, find_outline, outline_area
from graben.mechanics.averaging.rev import Circle, Polygon, polygon_area
from graben.mechanics.averaging.strain import (
    joint_gradient,
    outline_gradient,
    rotation_of,
    strain_of,
    zone_gradient,
)
from graben.mechanics.averaging.stress import zone_areas

CENTRE = (5.0, 5.0)
AFFINE = np.array([[-3.1e-3, 2.2e-3], [-1.7e-3, 4.9e-3]])


def models(synthetic):
    cells = synthetic.voronoi_polygons(300, 10.0, seed=3)
    return {
        "voronoi": synthetic.from_polygons(cells),
        "fine": synthetic.from_polygons(cells, fine=True),
        "bare": synthetic.from_polygons(cells, zones=False),
        "bricks": synthetic.from_polygons(synthetic.bricks(12, 16, 10 / 12, 10 / 16)),
        "chamfered": synthetic.from_polygons(synthetic.chamfered(cells, 0.05)),
    }


KINDS = ("voronoi", "fine", "bare", "bricks", "chamfered")


@pytest.fixture(scope="module")
def every(synthetic):
    return models(synthetic)


def solid_area(model, blocks):
    return sum(polygon_area(model.position[ring]) for k, ring in enumerate(model.rings) if blocks[k])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("radius", [0.3, 1.0, 2.5, 4.0])
def test_an_affine_field_gives_its_own_strain_and_rotation(every, kind, radius):
    model = every[kind]
    outline = find_outline(model.network(), Circle(CENTRE, radius))
    u = model.position @ AFFINE.T + [7.0, -3.0]
    gradient = outline_gradient(outline.follow(model.position), outline.follow(u))
    assert np.abs(gradient - AFFINE).max() < 1e-13
    assert np.allclose(
        strain_of(gradient), [AFFINE[0, 0], AFFINE[1, 1], 0, AFFINE[[0, 1], [1, 0]].mean()], atol=1e-13
    )
    assert rotation_of(gradient) == pytest.approx((AFFINE[1, 0] - AFFINE[0, 1]) / 2, abs=1e-13)


@pytest.mark.parametrize("kind", ["voronoi", "bare"])
def test_outline_is_the_plain_one(synthetic, every, kind):
    model = every[kind]
    outline = find_outline(model.network(), Circle((4.7, 5.2), 2.2))
    lone = synthetic.plain_outline(model, outline.blocks)
    assert {v for side in lone for v in side} == set(outline.steps.ordered.tolist())
    area = outline_area(outline.follow(model.position))
    assert area == pytest.approx(solid_area(model, outline.blocks), rel=1e-12)
    u = synthetic.separate(model, 1, 0.01, 0.02)
    plain = synthetic.plain_gradient(lone, model.position, u, area)
    assert np.allclose(outline_gradient(outline.follow(model.position), outline.follow(u)), plain, atol=1e-15)


def test_bricks_with_edge_contacts_fill_their_outline(every):
    model = every["bricks"]
    outline = find_outline(model.network(), Circle(CENTRE, 2.0))
    assert outline_area(outline.follow(model.position)) == pytest.approx(solid_area(model, outline.blocks), rel=1e-12)
    # Half of the corners along the stepped sides meet the middle of a brick.
    assert (outline.node_weight > 0.0).any()


def test_blocks_are_those_the_circle_meets(every):
    model = every["voronoi"]
    radius = 2.5
    steps = find_outline(model.network(), Circle(CENTRE, radius)).steps
    edge = np.linspace(0, 2 * np.pi, 4001)
    circle = np.array(CENTRE) + radius * np.stack([np.cos(edge), np.sin(edge)], axis=1)
    centroids = np.array([model.position[r].mean(axis=0) for r in model.rings])
    for k in range(model.block_count):
        ring = model.position[model.rings[k]]
        ahead = np.roll(ring, -1, axis=0) - ring
        turn = [
            ahead[i, 0] * (circle[:, 1] - ring[i, 1]) - ahead[i, 1] * (circle[:, 0] - ring[i, 0])
            for i in range(len(ring))
        ]
        if (np.array(turn) > 1e-3).all(axis=0).any():
            assert k in steps.boundary_blocks
        elif k not in steps.boundary_blocks:
            inside = np.hypot(*(centroids[k] - CENTRE)) < radius
            assert k in (steps.inside_blocks if inside else steps.outside_blocks)


def test_the_nine_steps_agree_with_the_outline(every):
    model = every["voronoi"]
    network = model.network()
    outline = find_outline(network, Circle(CENTRE, 2.5))
    s = outline.steps
    assert set(s.corners) == set(s.ordered)
    assert set(s.outline_blocks) <= set(s.boundary_blocks)
    assert set(model.vertex_block[s.ordered]) == set(s.outline_blocks)
    assert set(s.boundary_contacts) <= set(s.block_contacts)
    assert set(s.corners) <= set(s.contact_corners) and set(s.corners) <= set(s.block_corners)
    together = np.concatenate([s.boundary_blocks, s.inside_blocks, s.outside_blocks])
    assert np.array_equal(np.sort(together), np.arange(model.block_count))


@pytest.mark.parametrize("kind", ["voronoi", "fine", "bricks", "chamfered"])
def test_strain_is_that_of_the_zones_and_that_of_the_joints(synthetic, every, kind):
    model = every[kind]
    network = model.network()
    outline = find_outline(network, Circle((5.3, 4.6), 2.7))
    x = model.position
    u = synthetic.separate(model, 5, 0.01, 0.02) + 1e-3 * np.sin(x[:, ::-1] * 2.0)
    area = outline_area(outline.follow(x))
    whole = outline_gradient(outline.follow(x), outline.follow(u)) * area
    inside = outline.blocks[model.zone_block]
    blocks = zone_gradient(x, u, model.zone_vertex, inside)
    joints = joint_gradient(network, outline, u)
    assert np.abs(whole - blocks - joints).max() < 1e-13 * np.abs(blocks).max() * 100
    assert np.abs(joints).max() > 0.1 * np.abs(blocks).max()
    # Blocks that move as one leave the joints shut; voids behind chamfers deform with them.
    rigid = np.tile([0.3, -0.2], (x.shape[0], 1))
    assert np.abs(joint_gradient(network, outline, rigid)).max() < 1e-12


def test_joint_part_is_the_sum_of_jumps(synthetic, every):
    """Rigid blocks on conforming joints: strain is the sum of jump (x) normal x length over the area."""
    model = every["voronoi"]
    network = model.network()
    outline = find_outline(network, Circle(CENTRE, 2.0))
    u = synthetic.separate(model, 8, 0.02, 0.0)
    x, total = model.position, np.zeros((2, 2))
    rings = model.rings
    for a in np.flatnonzero(outline.blocks):
        for b in np.flatnonzero(outline.blocks):
            if a < b:
                for i, j in zip(rings[a], np.roll(rings[a], -1)):
                    for k, m in zip(rings[b], np.roll(rings[b], -1)):
                        if np.allclose(x[i], x[m], atol=1e-9) and np.allclose(x[j], x[k], atol=1e-9):
                            dx, dy = x[j] - x[i]
                            total += np.outer(u[k] - u[j], [dy, -dx])
    nodes = outline.follow(x)
    assert np.allclose(outline_gradient(nodes, outline.follow(u)) * outline_area(nodes), total, atol=1e-12)


def test_many_states_at_once_equal_one_by_one(synthetic, every):
    model = every["fine"]
    outline = find_outline(model.network(), Circle(CENTRE, 2.0))
    states = np.stack([synthetic.separate(model, k, 0.01, 0.01) for k in range(3)])
    nodes = outline.follow(model.position)
    together = outline_gradient(nodes, outline.follow(states))
    for k in range(3):
        assert np.array_equal(together[k], outline_gradient(nodes, outline.follow(states[k])))


@pytest.mark.parametrize("kind", ["voronoi", "bricks"])
def test_joints_disturbed_a_little_leave_the_outline_closed(synthetic, every, kind):
    """A consolidated state: vertices of neighbours coincide only to a few millimetres."""
    model = every[kind]
    moved = model.position + synthetic.separate(model, 2, 1.5e-3, 1e-3)
    network = model.network(moved)
    # Not 2.5 m: at that radius the circle grazes a course of bricks.
    outline = find_outline(network, Circle(CENTRE, 2.4))
    assert outline_area(outline.follow(moved)) == pytest.approx(solid_area(model, outline.blocks), rel=3e-3)
    u = moved @ AFFINE.T
    assert np.abs(outline_gradient(outline.follow(moved), outline.follow(u)) - AFFINE).max() < 1e-13
    assert np.isin(
        np.flatnonzero(outline.blocks), np.concatenate([outline.steps.boundary_blocks, outline.steps.inside_blocks])
    ).all()
    # The same blocks, and the same corners, as from the undisturbed state, but for blocks that the circle grazes.
    calm = find_outline(model.network(), Circle(CENTRE, 2.4))
    assert (calm.blocks != outline.blocks).sum() <= 2


def test_outline_chosen_at_a_deformed_state(synthetic, every):
    model = every["voronoi"]
    network = model.network()
    stretched = model.position @ np.diag([1.04, 0.95]) + synthetic.separate(model, 4, 4e-3, 4e-3)
    outline = find_outline(network, Circle((5.2, 4.75), 2.5), position=stretched)
    nodes = outline.follow(stretched)
    gradient = outline_gradient(nodes, nodes @ AFFINE.T)
    assert np.abs(gradient - AFFINE).max() < 1e-13
    # The circle lies inside the curve, in the state where it was chosen.
    reach = np.hypot(*(nodes - [5.2, 4.75]).T)
    assert reach.min() > 2.5 - 0.02
    steps = outline.steps
    assert set(np.flatnonzero(outline.blocks)) == set(steps.boundary_blocks) | set(steps.inside_blocks)


def test_polygon_rev_on_block_edges_takes_whole_bricks(every):
    model = every["bricks"]
    network = model.network()
    w, h = 10 / 12, 10 / 16
    # Rows 2 to 5 have joints at different places; only whole rows align at the top and bottom.
    outline = find_outline(network, Polygon(((2.1, 2 * h), (7.9, 2 * h), (7.9, 6 * h), (2.1, 6 * h))))
    nodes = outline.follow(model.position)
    assert nodes[:, 1].min() == pytest.approx(2 * h) and nodes[:, 1].max() == pytest.approx(6 * h)
    assert outline_area(nodes) == pytest.approx(solid_area(model, outline.blocks))
    assert (nodes[:, 0].min(), nodes[:, 0].max()) == (pytest.approx(2 * w), pytest.approx(10 * w))


def test_polygon_inside_one_block_is_that_block(every):
    model = every["bricks"]
    outline = find_outline(model.network(), Polygon(((5.1, 5.1), (5.15, 5.1), (5.12, 5.12))))
    assert outline.blocks.sum() == 1 and outline.node_weight.max() < 1.0


def test_domain_outline_and_reach(every):
    for kind in KINDS:
        curve = domain_outline(every[kind].network())
        assert curve.min() == pytest.approx(0.0, abs=1e-9) and curve.max() == pytest.approx(10.0)
        assert polygon_area(curve) == pytest.approx(100.0, rel=0.01)
        assert Circle(CENTRE, 4.9).outside_by(curve) == 0.0
        # Chamfers notch the sides by at most their depth.
        notch = 0.05 if kind == "chamfered" else 1e-6
        assert Circle(CENTRE, 5.4).outside_by(curve) == pytest.approx(0.4, abs=notch)
        assert Circle((12.0, 5.0), 1.0).outside_by(curve) == pytest.approx(3.0, abs=notch)
        assert Polygon(((1, 1), (12, 1), (12, 9), (1, 9))).outside_by(curve) >= 2.0
        assert Polygon(((1, 1), (9, 1), (9, 9), (1, 9))).outside_by(curve) == 0.0


def test_holes_are_filled_and_count_as_area(synthetic):
    """A missing block inside the REV leaves a void inside the outline."""
    polygons = synthetic.bricks(8, 8, 1.25, 1.25)
    hole = next(k for k, p in enumerate(polygons) if np.hypot(*(p.mean(axis=0) - [5.0, 5.0])) < 1.0)
    gone = polygon_area(polygons[hole])
    model = synthetic.from_polygons(polygons[:hole] + polygons[hole + 1 :])
    outline = find_outline(model.network(), Circle((5.0, 5.0), 3.0))
    area = outline_area(outline.follow(model.position))
    assert area - solid_area(model, outline.blocks) == pytest.approx(gone)


def test_bad_regions_are_refused():
    with pytest.raises(ValueError, match="radius"):
        Circle((0, 0), -1.0)
    with pytest.raises(ValueError, match="simple"):
        Polygon(((0, 0), (1, 1), (1, 0), (0, 1)))
    with pytest.raises(ValueError, match="three corners"):
        Polygon(((0, 0), (1, 1)))


def test_no_block_in_the_region(every):
    with pytest.raises(ValueError, match="no block"):
        find_outline(every["voronoi"].network(), Circle((40.0, 40.0), 1.0))


def test_zone_areas_fill_the_model(every):
    model = every["fine"]
    assert zone_areas(model.position, model.zone_vertex).sum() == pytest.approx(100.0)


@pytest.mark.parametrize("kind", ["voronoi", "fine", "bricks", "chamfered"])
def test_any_region_on_disturbed_blocks(synthetic, every, kind):
    """Forty circles and polygons of all sizes: one closed curve, exact strain, parts that add up."""
    model = every[kind]
    place = model.position + synthetic.separate(model, 9, 2e-3, 2e-3)
    network = model.network(place)
    rng = np.random.Generator(np.random.PCG64(3))
    areas = zone_areas(place, model.zone_vertex)
    for k in range(40):
        r = rng.uniform(0.05, 4.0)
        x, y = rng.uniform(r, 10.0 - r, 2)
        angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, 5))
        star = Polygon(tuple((x + r * np.cos(t), y + r * np.sin(t)) for t in angles))
        outline = find_outline(network, Circle((x, y), r) if k % 2 else star)
        met = np.concatenate([outline.steps.boundary_blocks, outline.steps.inside_blocks])
        assert np.array_equal(np.flatnonzero(outline.blocks), np.sort(met))
        nodes = outline.follow(place)
        area = outline_area(nodes)
        solid = areas[outline.blocks[model.zone_block]].sum()
        assert solid == pytest.approx(area, rel=0.02)
        assert np.abs(outline_gradient(nodes, outline.follow(place @ AFFINE.T)) - AFFINE).max() < 1e-13
        u = rng.normal(0.0, 0.01, place.shape)
        parts = zone_gradient(place, u, model.zone_vertex, outline.blocks[model.zone_block])
        parts = parts + joint_gradient(network, outline, u)
        assert np.abs(outline_gradient(nodes, outline.follow(u)) * area - parts).max() < 1e-13
