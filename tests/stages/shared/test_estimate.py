"""What no machine can hold is refused before work, with the key that decides it and the estimate."""

import numpy as np
import pytest

from graben.errors import BadInput
from graben.schemas.scene import load_scene
from graben.stages.blocks import stage as blocks
from graben.stages.fem_run import stage as fem_run
from graben.stages.fem_run.sizes import sizes_of
from graben.stages.particles import stage as particles
from graben.stages.rev_study import stage as rev_study
from graben.stages.scratch import stage as scratch
from graben.stages.shared.estimate import MOST_THINGS, Estimate, refuse_too_large, tiles, work
from tests.stages.tools.test_check import SMALL


def scene_of(kind, folder, *settings):
    path = folder / "scene.toml"
    path.write_text(f'kind = "{kind}"\n{SMALL.get(kind, "")}\n')
    return load_scene(path, kind, settings)


@pytest.mark.parametrize(
    ("stage", "kind", "settings", "key"),
    [
        (blocks, "blocks", ['domain.width="1000 km"', 'domain.height="1000 km"', 'tessellation.edge="1 mm"',
                            'tessellation.rounding="0.1 mm"'], "tessellation.edge"),
        (blocks, "blocks", ['tessellation.zone_edge="1 um"'], "tessellation.zone_edge"),
        (blocks, "blocks", ['tessellation={method="joint-sets",sets=[{dip="10 deg",spacing="1 um"},'
                            '{dip="80 deg",spacing="1 um"}]}'], "tessellation.sets"),
        (particles, "particles", ['grains=[{name="a",diameter="10 nm"}]'], "grains.diameter"),
        (fem_run, "fem", ['mesh.size="1 mm"'], "mesh.size"),
        (fem_run, "fem", ['mesh.refine=[{start=["55 m","50 m"],end=["60 m","50 m"],size="1 um",growth=0.05}]'],
         "mesh.refine.0.size"),
        (fem_run, "fem", ['stepping.save_every="1e-9 s"'], "stepping.save_every"),
        (scratch, "scratch", ['mesh.size="1 nm"'], "mesh.size"),
    ],
)  # fmt: skip
def test_sizes_that_no_machine_holds_are_refused_at_once(stage, kind, settings, key, tmp_path):
    scene = scene_of(kind, tmp_path, *settings)
    with pytest.raises(BadInput) as refused:
        stage.prepare(scene)
    assert key in {f.key for f in refused.value.faults}
    assert "about" in str(refused.value)


def test_draws_of_many_runs_count_in_a_study(tmp_path):
    scene = scene_of("rev-study", tmp_path, "samples.grid=50", "tests.resamples=1000000")
    with pytest.raises(BadInput) as refused:
        rev_study.prepare(scene, 2)
    assert {f.key for f in refused.value.faults} == {"tests.resamples"}


def test_an_estimate_is_near_what_the_run_has(tmp_path):
    """To a factor of two, which is all that a refusal of slips needs."""
    made = blocks.prepare(scene_of("blocks", tmp_path))
    said = {s.name: s.count for s in made.sizes}
    assert 0.5 < said["blocks"] / made.ground.blocks.size < 2.0
    assert 0.5 < said["zones"] / len(made.model.zone_area) < 2.0

    *_, sizes = particles.prepare(scene_of("particles", tmp_path))
    assert sizes[0].count == pytest.approx(0.6 * 0.6**2 * 0.3 / (np.pi / 6 * 0.1**3), rel=1e-6)

    scene = scene_of("fem", tmp_path)
    problem = fem_run.prepare(scene)[0]
    assert 0.4 < sizes_of(scene)[0].count / len(problem.body.mesh.quads) < 2.5

    scene = scene_of("scratch", tmp_path)
    assert 0.5 < scratch.prepare(scene)[-1][0].count / len(scratch.mesh_of(scene).cells) < 2.0


def test_the_key_of_the_largest_part_is_named_where_memory_is_short():
    parts = [Estimate("blocks", 10.0, 1e3, "edge", "1 m"), Estimate("states", 1e6, 1e30, "states", "1000000")]
    with pytest.raises(BadInput) as refused:
        refuse_too_large("s.toml", parts)
    (fault,) = refused.value.faults
    assert fault.key == "states" and "GB" in fault.expected


def test_counts_are_refused_one_by_one_and_nan_is_no_size():
    fine = Estimate("blocks", MOST_THINGS, 0.0, "edge", "1 m")
    refuse_too_large("s.toml", [fine])
    for bad in (work("steps", 1e9, 1e9, "steps", ""), Estimate("grains", np.nan, 0.0, "d", ""),
                Estimate("grains", tiles(1.0, 1e-300), 0.0, "d", "")):  # fmt: skip
        with pytest.raises(BadInput):
            refuse_too_large("s.toml", [fine, bad])
