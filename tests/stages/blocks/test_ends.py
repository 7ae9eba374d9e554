"""[loading] of blocks with platens and supports: what is refused, what restarts, what other zones make of it."""

import numpy as np
import pytest
import xarray

from graben.errors import BadInput
from graben.mechanics.blocks.shape.rectangle import rectangle_sides
from graben.schemas.artifact import check_artifact, read_artifact
from graben.stages.dem_run import stage as dem_run

SQUARE = """
kind = "blocks"
seed = 2
[domain]
width = "2 m"
height = "2 m"
[loading]
confining_pressure = "1 MPa"
speed = "0.2 mm/s"
states = 5
[numerics]
steps = 2000
[output]
vtk = false
"""
BOTTOM = '{start=["0 m","0 m"], end=["2 m","0 m"]}'
RIGHT = '{start=["2 m","0 m"], end=["2 m","2 m"], fix="x"}'
SETS = 'tessellation={method="joint-sets", sets=[{dip="30 deg", spacing="0.5 m"}, {dip="110 deg", spacing="0.6 m"}]}'


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "square.toml"
    path.write_text(SQUARE)
    return path


@pytest.mark.parametrize(
    ("settings", "key", "words"),
    [
        (['loading.platens.friction="90 deg"'], "loading.platens.friction", "1.57"),
        (['loading.platens.thickness="0 m"'], "loading.platens.thickness", "greater than 0"),
        (['loading.platens.side_friction="5 deg"'], "loading.platens", "sides = true"),
        (["loading.platens.poisson=0.3"], "loading.platens", "young"),
        (["loading.platens.rough=true"], "loading.platens.rough", ""),
        (["loading.platens={}", "numerics.force_check=0.02"], "", "force_check"),
        (["loading.platens={}", 'in_situ.sxx="-1 MPa"'], "", "in_situ"),
        (['loading.platens.young="200 GPa"', 'rock.zones="rigid"'], "", "young"),
        (["loading.platens.sides=true", 'rock.zones="mohr-coulomb"'], "", "would yield"),
        (
            ["loading.platens={}", 'loading.supports=[{start=["0 m","0 m"],end=["2 m","0 m"]}]'],
            "loading",
            "either supports or platens",
        ),
        (
            ['loading.supports=[{start=["0 m","1 m"],end=["1 m","1 m"],name="inside"}]'],
            "loading.supports.0",
            "holds a part of the outline",
        ),
        ([f"loading.supports=[{BOTTOM},{RIGHT}]"], "loading.supports", "confining pressure"),
        (['loading.supports=[{start=["0 m","2 m"],end=["2 m","2 m"]}]'], "loading.supports", "which moves"),
    ],
)
def test_what_cannot_be_is_refused_with_its_key(scene, settings, key, words):
    with pytest.raises(BadInput) as refused:
        dem_run.run(scene, scene.with_suffix(".nc"), overrides=settings)
    assert any(key in fault.key and words in fault.expected for fault in refused.value.faults), refused.value.faults
    assert not scene.with_suffix(".nc").exists()


@pytest.mark.parametrize(
    "settings",
    [
        ['loading.platens={friction="20 deg", sides=true}', "numerics.stop_loose_blocks=true"],
        ['loading.supports=[{start=["0 m","0 m"],end=["2 m","0 m"],fix="both"}]'],
    ],
)
def test_a_stopped_run_goes_on_bitwise(scene, settings):
    straight, stopped = scene.with_suffix(".a.nc"), scene.with_suffix(".b.nc")
    dem_run.run(scene, straight, overrides=settings)

    def stop(fraction, message):
        if fraction >= 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        dem_run.run(scene, stopped, overrides=settings, progress=stop)
    dem_run.run(scene, stopped, overrides=settings, restart=True, overwrite=True)
    with xarray.open_dataset(straight) as a, xarray.open_dataset(stopped) as b:
        for name in a.variables:
            assert np.array_equal(a[name].values, b[name].values), name
    assert check_artifact(straight) == []


@pytest.mark.parametrize(
    "settings",
    [
        ["loading.platens={}"],
        ["loading.platens.sides=true"],
        ["loading.platens={}", 'rock.zones="mohr-coulomb"'],
        ["loading.platens.sides=true", 'rock.zones="rigid"'],
        ['loading.platens={young="200 GPa", sides=true}'],
        ["loading.platens={}", SETS, 'joints.sets=[{set=2, friction="20 deg"}]'],
        ["loading.platens={}", 'tessellation.zone_edge="0.2 m"', 'joints.tension="50 kPa"'],
    ],
)
def test_the_artifact_holds_the_rock_alone(scene, settings):
    with_platens, walls = scene.with_suffix(".a.nc"), scene.with_suffix(".b.nc")
    headline = dem_run.run(scene, with_platens, overrides=settings)
    dem_run.run(scene, walls, overrides=[s for s in settings if "platens" not in s])
    a, b = read_artifact(with_platens, "blocks"), read_artifact(walls, "blocks")
    # The same blocks; along the curve in memory they may lie in another order.
    assert a.block_area.values == pytest.approx(b.block_area.values)
    assert {k: n for k, n in a.sizes.items() if k != "contact"} == {
        k: n for k, n in b.sizes.items() if k != "contact"
    }
    assert set(a.variables) == {*b.variables, "friction_over_confinement"}
    x, block = a.vertex_position.values, a.vertex_block.values
    assert np.array_equal(block[a.zone_vertex.values], np.repeat(a.zone_block.values[:, None], 3, axis=1))
    assert np.array_equal(block[a.block_corner.values], np.repeat(np.arange(a.sizes["block"]), a.block_corner_count))
    assert x[:, 1].min() > -0.01 and x[:, 1].max() < 2.01
    # Smooth ends bear on the rock along y alone, and what is left is small.
    assert a.friction_over_confinement.values == pytest.approx(0.0, abs=2e-3)
    sides, reaction = rectangle_sides(a.outline.values), a.wall_reaction.values
    assert reaction[:, sides.right, 0] == pytest.approx(-2e6, rel=4e-2)
    assert reaction[:, sides.left, 0] == pytest.approx(2e6, rel=4e-2)
    assert a.boundary_force.values.sum(axis=1) == pytest.approx(reaction.sum(axis=1), abs=1.0)
    assert reaction[:, sides.bottom, 1] == pytest.approx(-reaction[:, sides.top, 1], rel=1e-2)
    assert headline["bottom_over_top_reaction"] == pytest.approx(1.0, abs=2e-3)
    # The rock's own top has moved by what the headline says, as far as rest has left it near 2 m.
    moved = a.displacement.values[:, x[:, 1] > 1.999, 1].mean(axis=1) / 2.0
    peak = int(np.argmax(np.abs(reaction[:, sides.top, 1])))
    assert headline["strain_at_peak"] == pytest.approx(moved[peak], rel=0.05, abs=1e-5)


def test_rough_platens_make_the_rock_stronger_and_say_so(scene):
    smooth = dem_run.run(scene, scene.with_suffix(".a.nc"), overrides=["loading.platens={}"])
    rough = dem_run.run(scene, scene.with_suffix(".b.nc"), overrides=['loading.platens.friction="30 deg"'])
    assert rough["friction_over_confinement"] > 0.1
    assert abs(smooth["friction_over_confinement"]) < 1e-3
    assert -rough["peak_wall_stress_pa"] > -1.05 * smooth["peak_wall_stress_pa"]


def test_stiff_platens_do_not_hide_a_confinement_that_closes_the_joints(scene):
    settings = ['loading.confining_pressure="1 GPa"', 'loading.platens={normal_stiffness="1e4 GPa/m"}']
    for chosen in (settings[:1], settings):
        with pytest.raises(BadInput, match=r"it closes joints of 1e\+10 Pa/m"):
            dem_run.run(scene, scene.with_suffix(".nc"), overrides=chosen)
