"""What commands leave on disk: all of a run or nothing, and never over what is the user's."""

import errno
import json
import os
import resource
import signal
import subprocess
import sys

import pytest

from graben.schemas import files
from tests.conftest import command
from tests.schemas.test_outputs import tree

SCENE = """
kind = "blocks"
fidelity = "draft"
domain = {width = "2 m", height = "2 m"}
tessellation = {method = "file", file = "map.geojson", edge = "1 m"}
numerics = {threads = 1}
[programme]
end = "4 s"
save_every = "2 s"
[[programme.supports]]
name = "base"
start = ["0 m", "0 m"]
end = ["2 m", "0 m"]
fix = "both"
[[programme.loads]]
name = "top"
start = ["0 m", "2 m"]
end = ["2 m", "2 m"]
rate = "0.05 MPa/s"
"""


def square(x, y):
    ring = [[x, y], [x + 1, y], [x + 1, y + 1], [x, y + 1], [x, y]]
    return {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [ring]}}


@pytest.fixture
def scene(tmp_path):
    """Four square blocks under a load, run in less than a second."""
    blocks = [square(x, y) for x in (0.0, 1.0) for y in (0.0, 1.0)]
    (tmp_path / "map.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": blocks}))
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    return path


def run(scene, output, *options):
    return command("dem-run", scene, "-o", output, "-q", *options)


def test_a_run_leaves_what_it_says_and_nothing_else(scene, tmp_path):
    folder = tmp_path / "new/deep"
    assert run(scene, folder / "run.v1.nc").exit_code == 0
    names = {p.name for p in folder.iterdir()}
    assert names == {"run.v1.nc", "run.v1.vtu", "run.v1.pvd", "run.v1-joints.vtu", "run.v1-joints.pvd"}
    assert run(scene, folder / "run.v2.nc").exit_code == 0
    assert names <= {p.name for p in folder.iterdir()}
    assert run(scene, folder / "run.v1.nc").exit_code == 2
    assert run(scene, folder / "run.v1.nc", "--overwrite").exit_code == 0
    assert len(list(folder.iterdir())) == 10


@pytest.mark.parametrize("name", ["map.geojson", "scene.toml", "sub/../map.geojson", "link.geojson"])
def test_inputs_outlive_the_run(name, scene, tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "link.geojson").symlink_to("map.geojson")
    before = tree(tmp_path)
    result = run(scene, tmp_path / name, "--overwrite")
    assert result.exit_code == 2 and "input" in result.output
    assert tree(tmp_path) == before


def test_nothing_of_the_users_is_replaced_and_no_work_begins(scene, tmp_path, monkeypatch):
    monkeypatch.setattr("graben.stages.blocks.stage.run", lambda *a, **k: pytest.fail("the run began"))
    (tmp_path / "k.vtu").mkdir()
    (tmp_path / "k.vtu/thesis.txt").write_text("precious")
    (tmp_path / "k-joints.pvd").write_text("precious")
    before = tree(tmp_path)
    for options in ((), ("--overwrite",)):
        result = run(scene, tmp_path / "k.nc", *options)
        assert result.exit_code == 2 and "k.vtu" in result.output and "k-joints.pvd" in result.output
    assert tree(tmp_path) == before


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()])
def test_an_error_while_renaming_brings_the_former_run_back(error, scene, tmp_path, monkeypatch):
    output = tmp_path / "o.nc"
    assert run(scene, output).exit_code == 0
    before = tree(tmp_path)
    plain, wanted = os.replace, set()
    for moment in range(20):
        left = moment

        def refuse(source, target):
            nonlocal left
            # The checkpoint that an interrupted run leaves is not part of this.
            left -= "checkpoint" not in str(source)
            if left == -1:
                wanted.add(str(target))
                raise error
            plain(source, target)

        with monkeypatch.context() as patch:
            patch.setattr(files.os, "replace", refuse)
            result = run(scene, output, "--overwrite")
        if left >= 0:
            break
        assert result.exit_code == (130 if isinstance(error, KeyboardInterrupt) else 3), result.output
        (tmp_path / "o.checkpoint.npz").unlink(missing_ok=True)
        assert tree(tmp_path) == before
    assert result.exit_code == 0 and len(wanted) >= 5


def test_a_full_disk_is_exit_3_and_leaves_no_part(scene, tmp_path):
    (tmp_path / "o").mkdir()
    program = "import sys; from graben.cli.dem_run import main; main()"

    def small_files():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (110_000, 110_000))

    done = subprocess.run(
        [sys.executable, "-c", program, str(scene), "-o", "o/a.nc", "-q", "--set", "tessellation.zone_edge='0.04 m'"],
        cwd=tmp_path, capture_output=True, text=True, check=False, preexec_fn=small_files,
    )  # fmt: skip
    assert done.returncode == 3, done.stderr
    assert "o/a" in done.stderr and "cannot be written" in done.stderr and "Traceback" not in done.stderr
    assert list((tmp_path / "o").iterdir()) == []


def test_pictures_and_pages_are_guarded_too(small_blocks, tmp_path):
    artifact = tmp_path / "a.nc"
    artifact.write_bytes(small_blocks.read_bytes())
    for call, name in ((("show", artifact), "a.png"), (("report", tmp_path), "a.html")):
        output = tmp_path / name
        output.write_text("precious")
        for options in ((), ("--overwrite",)):
            assert command(*call, "-o", output, *options).exit_code == 2
        assert output.read_text() == "precious"
        output.unlink()
        os.link(artifact, output)
        assert "input" in command(*call, "-o", output, "--overwrite").output
        output.unlink()
        assert command(*call, "-o", output).exit_code == 0
        assert command(*call, "-o", output, "--overwrite").exit_code == 0


def test_averages_their_picture_and_their_outlines_appear_together(small_blocks, tmp_path, monkeypatch):
    call = ("homogenize", small_blocks, "--radius", "1 m", "--vtk", "-o", tmp_path / "c.nc")
    assert "another name" in command(*call, "--steps", tmp_path / "c.vtu/steps.png").output

    def full(*arguments, **options):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("graben.schemas.artifact.write_netcdf", full)
        result = command(*call, "--steps", tmp_path / "steps.png")
    assert result.exit_code == 3 and "c.nc" in result.output
    assert list(tmp_path.iterdir()) == []
    assert command(*call, "--steps", tmp_path / "steps.png").exit_code == 0
    assert {p.name for p in tmp_path.iterdir()} == {"c.nc", "c.vtu", "c.pvd", "steps.png"}
