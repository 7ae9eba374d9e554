"""Every stage that can run for long: stopped in any way it leaves a checkpoint, and goes on bitwise, or refuses.

Interrupt, kill, failing numerics, full disk and read-only output are the same tests for all of them.
"""

import errno
import os
import signal
import tomllib
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import graben
from graben.errors import NumericsFailed
from graben.schemas.artifact import read_artifact, write_artifact
from graben.schemas.layouts.blocks import LAYOUT
from graben.schemas.provenance import Record
from graben.schemas.saved import write_saved
from graben.stages.shared import checkpoint
from tests.cli import test_outputs as outputs
from tests.cli.test_interrupt import SIGNALS, child, kill_self
from tests.conftest import command, settings
from tests.stages.fem_run.test_stage import SCENE as FEM
from tests.stages.homogenize.test_stage import blocks_arrays
from tests.stages.particles.test_stage import SCENE as BEDS
from tests.stages.rev_study.test_calibration import ELASTIC
from tests.stages.scratch.test_stage import SMALL

STEEL = """
law = "j2"
[parameters]
young_modulus = "200 GPa"
poisson_ratio = 0.3
hardening = "linear"
initial_yield = "400 MPa"
hardening_modulus = "2 GPa"
"""


@dataclass
class Case:
    """A stage on a tiny scene.

    arguments : of the command, without its output; python : those of `graben.run`
    source : a file that the run reads beside its scene; None where there is none
    artifact : of the straight run; moments : at which a run can go on
    """

    kind: str
    command: str
    arguments: list
    python: dict
    source: Path | None = None
    artifact: Path = Path()
    moments: int = 0

    def run(self, output, *options):
        return command(self.command, *self.arguments, "-q", "-o", output, *options)


def blocks(folder):
    text = outputs.SCENE.replace('end = "4 s"', 'end = "12 s"').replace("numerics = {", "seed = 1\nnumerics = {")
    squares = [outputs.square(x, y) for x in (0.0, 1.0) for y in (0.0, 1.0)]
    source = folder / "map.geojson"
    source.write_text(outputs.json.dumps({"type": "FeatureCollection", "features": squares}))
    return scene_case("blocks", "dem-run", folder, text, source=source)


def particles(folder):
    text = BEDS.replace('depth = "0.3 mm"', 'depth = "0.25 mm"') + "[shaking]\n"
    return scene_case("particles", "dem-run", folder, text)


def fem(folder):
    head, rest = FEM.split("[material]\n")
    material, supports = rest.split("[[supports]]", 1)
    source = folder / "rock.toml"
    source.write_text(material.replace("[material.parameters]", "[parameters]"))
    text = head + '[material]\nfile = "rock.toml"\n[[supports]]' + supports
    return scene_case("fem", "fem-run", folder, text, source=source)


def scratch(folder):
    source = folder / "steel.toml"
    source.write_text(STEEL)
    overrides = [*SMALL, "tip.path='8 um'"]
    case = scene_case("scratch", "scratch", folder, 'kind = "scratch"\n', overrides, source)
    case.arguments += ["--material", source]
    case.python["material"] = source
    return case


def rev_study(folder):
    source = folder / "elastic.toml"
    source.write_text(ELASTIC)
    inputs = []
    for seed in (11, 12):
        inputs.append(folder / f"run{seed}.nc")
        write_artifact(inputs[-1], LAYOUT, blocks_arrays(seed, -0.5e6)[1], Record(seed=seed))
    overrides = ["fidelity=draft", 'samples.radii=["0.8 m", "1.4 m"]', "samples.grid=2", "processes=1"]
    overrides.append(f"calibration.scene={outputs.json.dumps(str(source))}")
    case = scene_case("rev-study", "rev-study", folder, 'kind = "rev-study"\n', overrides, source)
    case.arguments = [*inputs, "--scene", *case.arguments]
    case.python["inputs"] = inputs
    return case


def scene_case(kind, name, folder, text, overrides=(), source=None):
    path = folder / "scene.toml"
    path.write_text(text)
    stored = [part.partition("=") for part in overrides]
    tables = {key: value if key == "fidelity" else tomllib.loads(f"x={value}")["x"] for key, _, value in stored}
    return Case(kind, name, [path, *settings(overrides)], {"scene": path, "set": tables}, source)


@pytest.fixture(scope="module", params=[blocks, particles, fem, scratch, rev_study], ids=lambda make: make.__name__)
def case(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("case")
    case = request.param(folder)
    case.artifact = folder / "straight.nc"
    moments = []
    with acting(10**9, lambda: None, moments):
        result = case.run(case.artifact)
    assert result.exit_code == 0, result.output
    case.moments = len(moments)
    assert case.moments > 4
    return case


@contextmanager
def acting(after: int, action: Callable[[], None], moments: list | None = None):
    """Do something when a run has kept so many states; each is taken, however long that takes."""
    told = [] if moments is None else moments
    real = checkpoint.Checkpoint.keep

    def keep(self, take, **options):
        real(self, take, **options)
        told.append(1)
        if len(told) == after:
            action()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(checkpoint.Checkpoint, "keep", keep)
        patch.setattr(checkpoint, "_SHARE", np.inf)
        yield


def raiser(error):
    def raises():
        raise error

    return raises


def stopped(case, output, after=None):
    """A run that was interrupted halfway; returns its checkpoint."""
    with acting(after or case.moments // 2, raiser(KeyboardInterrupt())):
        assert case.run(output).exit_code == 130
    return output.with_name(output.stem + ".checkpoint.npz")


def same(case, output):
    with read_artifact(case.artifact, case.kind) as straight, read_artifact(output, case.kind) as found:
        assert set(straight.variables) == set(found.variables)
        for name in straight.variables:
            left, right = straight[name].values, found[name].values
            assert left.dtype == right.dtype and left.shape == right.shape, name
            assert left.tolist() == right.tolist() if left.dtype == object else left.tobytes() == right.tobytes(), (
                name
            )
    for folder in case.artifact.parent.glob("straight*.vtu"):
        for file in folder.iterdir():
            other = output.with_name(folder.name.replace("straight", output.stem)) / file.name
            assert file.read_bytes() == other.read_bytes(), other


def names(folder):
    return sorted(p.name for p in folder.iterdir())


def test_stopped_again_and_again_it_ends_bitwise_as_the_straight_run(case, tmp_path):
    output = tmp_path / "out.nc"
    for session in range(20):
        with acting(max(2, case.moments // 4), lambda number=SIGNALS[session % 3]: kill_self(number)):
            result = case.run(output, *(["--restart"] if session else []))
        if result.exit_code == 0:
            break
        assert result.exit_code == 130, result.output
        assert "interrupted" in result.stderr and "Traceback" not in result.stderr
        assert names(tmp_path) == ["out.checkpoint.npz"]
    assert result.exit_code == 0 and session >= 3
    same(case, output)
    assert not output.with_name("out.checkpoint.npz").exists()


def test_a_killed_run_goes_on_from_what_is_on_disk(case, tmp_path):
    script = (
        "import os, sys; from graben.stages.shared import checkpoint\n"
        "checkpoint.EVERY_S, left, real = 0.0, [int(sys.argv.pop(1))], checkpoint.Checkpoint.keep\n"
        "def keep(*arguments, **options):\n"
        "    real(*arguments, **options); left[0] -= 1\n"
        "    if left[0] == 0: os.kill(os.getpid(), 9)\n"
        "checkpoint.Checkpoint.keep = keep\nfrom graben.cli.main import main; main()"
    )
    output = tmp_path / "out.nc"
    run = child(script, case.moments // 2, case.command, *case.arguments, "-q", "-o", output)
    said = run.communicate(timeout=600)[1]
    assert run.returncode == -signal.SIGKILL, said
    assert names(tmp_path) == ["out.checkpoint.npz"]
    assert case.run(output, "--restart").exit_code == 0
    same(case, output)


def test_failing_numerics_leave_a_checkpoint_too(case, tmp_path):
    output = tmp_path / "out.nc"
    with acting(case.moments // 2, raiser(NumericsFailed("no room"))):
        result = case.run(output)
    assert result.exit_code == 3 and "no room" in result.stderr
    assert "out.checkpoint.npz" in names(tmp_path) and "out.nc" not in names(tmp_path)
    result = case.run(output, "--restart")
    assert result.exit_code == 0, result.output
    same(case, output)


def test_what_belongs_to_another_run_is_refused_and_stays(case, tmp_path, monkeypatch):
    output = tmp_path / "out.nc"
    result = case.run(output, "--restart")
    assert result.exit_code == 2 and "a checkpoint, as an interrupted run leaves it" in result.stderr
    assert names(tmp_path) == []
    kept = stopped(case, output)
    whole = kept.read_bytes()

    def refused(words, *options):
        result = case.run(output, *options)
        assert result.exit_code == 2 and words in result.stderr and str(kept) in result.stderr, result.output
        assert names(tmp_path) == [kept.name]

    refused("--restart")
    refused("another scene", "--restart", "--set", "seed=9")
    with monkeypatch.context() as patch:
        patch.setattr(checkpoint, "build", lambda: "of yesterday")
        refused("another build", "--restart")
    if case.source is not None:
        before = case.source.read_bytes()
        case.source.write_bytes(before + b"\n")
        refused("another inputs", "--restart")
        case.source.write_bytes(before)
    for damaged in (whole[: len(whole) // 2], b"", whole[:2000] + b"x" + whole[2001:]):
        kept.write_bytes(damaged)
        refused("", "--restart")
    kept.write_bytes(whole)
    assert case.run(output, "--restart").exit_code == 0
    same(case, output)


def test_arrays_that_do_not_fit_are_refused_before_anything_uses_them(case, tmp_path):
    output = tmp_path / "out.nc"
    kept = stopped(case, output, case.moments - 1)
    with np.load(kept) as data:
        arrays = {name: data[name] for name in data.files if name != "sha256"}
    rng = np.random.Generator(np.random.PCG64(1))
    chosen = rng.choice(sorted(arrays), min(len(arrays), 12), replace=False)
    for name in map(str, chosen):
        values = arrays[name]
        other_kind = np.zeros(values.shape) if values.dtype.kind == "U" else values.astype("U8")
        for change in (None, other_kind, values[None], values[..., None][:0]):
            others = {k: v for k, v in arrays.items() if k != name} | ({} if change is None else {name: change})
            write_saved(kept, {}, others)
            result = case.run(output, "--restart")
            # What is left out may count as not done.
            assert result.exit_code == 2 or (result.exit_code == 0 and change is None), (name, result.output)
            if result.exit_code == 0:
                same(case, output)
                output.unlink()


@pytest.mark.parametrize(
    ("place", "error", "left"),
    [
        (
            "graben.schemas.artifact.write_netcdf",
            OSError(errno.ENOSPC, "No space left on device"),
            ["out.checkpoint.npz"],
        ),
        ("graben.schemas.files.os.replace", OSError(errno.EROFS, "Read-only file system"), []),
    ],
)
def test_a_disk_that_takes_no_result_is_exit_3_and_costs_no_run(place, error, left, case, tmp_path, monkeypatch):
    output = tmp_path / "out.nc"

    def refuse(*arguments, **options):
        raise error

    with monkeypatch.context() as patch:
        patch.setattr(place, refuse)
        result = case.run(output)
    assert result.exit_code == 3, result.output
    assert "cannot be written" in result.stderr and "Traceback" not in result.stderr
    assert names(tmp_path) == left
    if left:
        moments = []
        with acting(10**9, lambda: None, moments):
            assert case.run(output, "--restart").exit_code == 0
        assert len(moments) <= 0.5 * case.moments
        same(case, output)


def test_a_checkpoint_that_the_disk_refuses_does_not_end_the_run(case, tmp_path, monkeypatch):
    def refuse(*arguments, **options):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(checkpoint, "EVERY_S", 0.0)
    monkeypatch.setattr("graben.schemas.saved.shutil.copyfileobj", refuse)
    output = tmp_path / "out.nc"
    assert case.run(output).exit_code == 0
    same(case, output)


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="a folder in which nobody can write")
def test_a_folder_in_which_nobody_can_write_is_exit_3_before_work(case):
    with acting(1, raiser(AssertionError("the run began"))):
        result = case.run(Path("/proc/graben.nc"))
    assert result.exit_code == 3 and "/proc/graben.nc: cannot be written" in result.stderr, result.output


def test_python_restarts_too(case, tmp_path):
    output = tmp_path / "out.nc"
    told = []

    def stop(fraction, words):
        told.append(words)
        if (fraction > 0.5 and os.path.exists(output.with_name("out.checkpoint.npz"))) or fraction > 0.7:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        graben.run(**case.python, output=output, progress=stop)
    graben.run(**case.python, output=output, restart=True)
    same(case, output)
