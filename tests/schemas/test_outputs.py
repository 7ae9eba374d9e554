"""What a run will write is checked before it: names, inputs, what lies there, the folder."""

import os
import socket
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from graben.errors import BadInput, MachineFailed
from graben.schemas import files
from graben.schemas.outputs import CHECKPOINT, LAST_GOOD, MATERIAL, PARTIAL, SERIES, Outputs, beside, picture_mark
from graben.schemas.vtk import vtu_series

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])


def fields(artifact: Path, tag: str = "") -> None:
    with vtu_series(artifact, tag) as series:
        series.add(0.0, SQUARE, {"triangle": np.array([[0, 1, 2]])})


def refused(outputs: Outputs, *inputs: Path, **options: bool) -> str:
    before = tree(outputs.main.parent)
    with pytest.raises(BadInput) as caught:
        outputs.claim(inputs, **options)
    assert tree(outputs.main.parent) == before
    return str(caught.value)


def tree(folder: Path) -> dict[str, bytes | None]:
    found = sorted(folder.rglob("*")) if folder.is_dir() else []
    return {str(p): p.read_bytes() if p.is_file() and not p.is_symlink() else None for p in found}


@pytest.mark.parametrize(
    ("output", "material"),
    [
        ("run.nc", "run.material.toml"),
        ("run.v1.nc", "run.v1.material.toml"),
        ("run.h5", "run.h5.material.toml"),
        ("p=0.5MPa", "p=0.5MPa.material.toml"),
        (".nc", ".nc.material.toml"),
    ],
)
def test_names_are_kept_whole(output, material):
    assert beside(Path("d") / output, MATERIAL) == Path("d") / material


def test_runs_of_different_names_share_no_output(tmp_path):
    names = ("a.nc", "a.h5", "a.b.nc", "a.c.nc", "b")
    paths = [p for n in names for p in Outputs(tmp_path / n, (*SERIES, MATERIAL), (CHECKPOINT,)).paths()]
    assert len(set(paths)) == len(paths)


def test_the_name_with_and_without_its_suffix_would_share_what_lies_beside(tmp_path, small_blocks):
    (tmp_path / "a.nc").write_bytes(small_blocks.read_bytes())
    assert "a.nc" in refused(Outputs(tmp_path / "a", SERIES), overwrite=True)
    Outputs(tmp_path / "a", kept=()).claim([])


def test_a_free_place_is_taken_and_nothing_left_there(tmp_path):
    Outputs(tmp_path / "new/deep/a.nc", SERIES, (CHECKPOINT,)).claim([tmp_path / "scene.toml"])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("end", [*SERIES, MATERIAL, CHECKPOINT, ".nc"])
@pytest.mark.parametrize("overwrite", [False, True])
def test_what_the_user_has_there_is_refused(end, overwrite, tmp_path):
    (tmp_path / f"k{end}").write_text("precious")
    said = refused(Outputs(tmp_path / "k.nc", (*SERIES, MATERIAL), (CHECKPOINT,)), overwrite=overwrite)
    assert f"k{end}" in said and ("graben wrote" if overwrite else "`overwrite`") in said


@pytest.mark.parametrize("content", ["notes.txt", "0000.vtu.bak", "0001.vtu/x", "0000.vtu"])
def test_a_folder_with_files_of_the_user_is_refused(content, tmp_path):
    artifact = tmp_path / "k.nc"
    fields(artifact)
    Outputs(artifact, SERIES).claim([], overwrite=True)
    path = tmp_path / "k.vtu" / content
    path.parent.mkdir(exist_ok=True)
    path.write_text("precious")
    assert "k.vtu" in refused(Outputs(artifact, SERIES), overwrite=True)


@pytest.mark.parametrize("name", ["a.jpg", "a.txt", "a", ".png", "a.png.gz", "a.PNG"])
def test_pictures_of_other_forms_are_refused_before_work_begins(name, tmp_path):
    assert ".png, .pdf, .svg" in refused(Outputs(tmp_path / "a.nc", others=(tmp_path / name,)))


@pytest.mark.parametrize("end", ["png", "pdf", "svg"])
def test_pictures_of_the_users_own_are_refused(end, tmp_path):
    from matplotlib.figure import Figure

    picture = tmp_path / f"k.{end}"
    Figure().savefig(picture)
    for outputs in (Outputs(picture, kept=()), Outputs(tmp_path / "a.nc", others=(picture,)), Outputs(picture)):
        assert "graben wrote" in refused(outputs, overwrite=True)
    Figure().savefig(picture, metadata=picture_mark(picture.suffix))
    Outputs(picture, kept=()).claim([], overwrite=True)
    refused(Outputs(picture), overwrite=True)  # as an artifact


def test_a_mesh_of_the_users_is_no_artifact(tmp_path):
    (tmp_path / "m.vtu").write_text('<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid">')
    refused(Outputs(tmp_path / "m.vtu"), overwrite=True)


def test_all_faults_are_named_at_once(tmp_path):
    for name in ("k.pvd", "k.material.toml", "k.nc"):
        (tmp_path / name).write_text("precious")
    said = refused(Outputs(tmp_path / "k.nc", (*SERIES, MATERIAL)))
    assert all(name in said for name in ("k.pvd", "k.material.toml", "k.nc"))


def test_fields_of_another_artifact_are_refused(tmp_path):
    fields(tmp_path / "a.nc", "-joints")
    assert "a-joints.pvd" in refused(Outputs(tmp_path / "a-joints.nc", SERIES), overwrite=True)
    Outputs(tmp_path / "a.nc", tuple("-joints" + end for end in SERIES)).claim([], overwrite=True)


@pytest.mark.parametrize("end", [PARTIAL, LAST_GOOD + ".nc"])
def test_names_of_what_failed_runs_leave_are_reserved(end, tmp_path):
    assert "fail" in refused(Outputs(tmp_path / f"a{end}"))


class TestInputs:
    def test_an_input_is_never_an_output(self, tmp_path):
        mesh = tmp_path / "a.vtu"
        mesh.write_text("<VTKFile UnstructuredGrid>")
        for overwrite in (False, True):
            said = refused(Outputs(tmp_path / "a.nc", SERIES), mesh, overwrite=overwrite)
            assert "input" in said and str(mesh) in said

    @pytest.mark.parametrize("way", ["same", "dots", "folder", "symlink", "hard link", "case"])
    def test_under_whatever_name(self, way, tmp_path):
        source = tmp_path / "in" / "a.nc"
        source.parent.mkdir()
        source.write_bytes(b"")
        output = {
            "same": source,
            "dots": tmp_path / "in" / ".." / "in" / "a.nc",
            "folder": tmp_path / "other" / "a.nc",
            "symlink": tmp_path / "link.nc",
            "hard link": tmp_path / "hard.nc",
            "case": tmp_path / "in" / "A.nc",
        }[way]
        (tmp_path / "other").symlink_to(source.parent)
        (tmp_path / "link.nc").symlink_to(source)
        os.link(source, tmp_path / "hard.nc")
        assert "input" in refused(Outputs(output), source, overwrite=True)

    def test_links_in_a_loop_are_no_input(self, tmp_path):
        (tmp_path / "loop").symlink_to("loop")
        Outputs(tmp_path / "a.nc", SERIES).claim([tmp_path / "loop", tmp_path / "loop/b.csv"])  # reading it says so

    def test_nor_does_one_lie_in_a_folder_that_is_replaced(self, tmp_path):
        fields(tmp_path / "a.nc")
        assert "input" in refused(Outputs(tmp_path / "a.nc", SERIES), tmp_path / "a.vtu/0000.vtu", overwrite=True)

    def test_outputs_of_one_run_are_apart(self, tmp_path):
        for other in (tmp_path / "a.nc", tmp_path / "a.pvd", tmp_path / "a.vtu/x.png"):
            assert "another name" in refused(Outputs(tmp_path / "a.nc", SERIES, others=(other,)))


@pytest.mark.parametrize("kind", ["folder", "pipe", "socket", "dangling link", "link to a file", "device"])
@pytest.mark.parametrize("overwrite", [False, True])
def test_anything_but_a_regular_file_is_refused(kind, overwrite, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # names of sockets are short
    path = Path("/dev/null") if kind == "device" else Path("o.nc")
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "socket":
        with socket.socket(socket.AF_UNIX) as it:
            it.bind("o.nc")
    elif kind != "device":
        if kind == "link to a file":
            (tmp_path / "there").write_bytes(b"")
        path.symlink_to("there")
    before = path.lstat()
    with pytest.raises(BadInput, match=r"a regular file|not a folder"):
        Outputs(path).claim([], overwrite=overwrite)
    assert path.lstat() == before


@pytest.mark.parametrize("name", ["", ".", "..", "a/../.."])
def test_names_that_are_none(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BadInput, match="folder"):
        Outputs(Path(name)).claim([], overwrite=True)


@pytest.mark.parametrize("name", [".nc", "..nc", "a..nc", "...", "~", "~/a.nc", "a.vtu"])
def test_odd_names_that_are_some(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Outputs(Path(name), SERIES, (CHECKPOINT, LAST_GOOD + ".nc")).claim([])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.sep == "\\", reason="backslashes are separators")
@pytest.mark.parametrize(
    ("name", "words"), [("a\\b.nc", "backslash"), ("d\\e/a.nc", "backslash"), ("\udcff", "UTF-8")]
)
def test_names_that_libraries_do_not_take(name, words, tmp_path):
    assert words in refused(Outputs(tmp_path / name, SERIES))
    Outputs(tmp_path / name, kept=()).claim([])  # pictures


def test_the_fields_of_another_run_are_no_folder_for_outputs(tmp_path):
    fields(tmp_path / "a.nc")
    for name in ("z.nc", "0007.vtu", "sub/z.nc"):
        assert "fields of a run" in refused(Outputs(tmp_path / "a.vtu" / name))
        assert "fields of a run" in refused(Outputs(tmp_path / "z.nc", others=(tmp_path / "a.vtu" / "z.png",)))
    (tmp_path / "user.vtu").mkdir()
    Outputs(tmp_path / "user.vtu/z.nc").claim([])


def test_names_too_long_and_folders_that_are_files(tmp_path):
    with pytest.raises(BadInput, match=r"shorter|long"):
        Outputs(tmp_path / ("n" * 250 + ".nc"), SERIES).claim([])
    with pytest.raises(BadInput, match=r"long|shorter"):
        Outputs(tmp_path / ("n" * 300) / "a.nc").claim([])
    (tmp_path / "file").write_text("x")
    with pytest.raises(BadInput, match="file"):
        Outputs(tmp_path / "file" / "a.nc").claim([])


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs a folder in which nobody may write")
def test_a_folder_that_cannot_be_written_is_the_machines_fault():
    with pytest.raises(MachineFailed, match=r"a\.nc"):
        Outputs(Path("/proc/none/a.nc")).claim([])


@pytest.mark.skipif(os.name != "posix", reason="working folders cannot be removed there")
def test_a_working_folder_that_is_gone_is_the_machines_fault(tmp_path, monkeypatch):
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    with pytest.raises(MachineFailed, match=r"a\.nc"):
        Outputs(Path("a.nc"), SERIES).claim([tmp_path / "scene.toml"])


@pytest.mark.parametrize("overwrite", [False, True])
def test_what_another_run_wrote_meanwhile_is_replaced_by_overwrite_only(overwrite, tmp_path):
    artifact = tmp_path / "a.nc"
    Outputs(artifact, SERIES).claim([], overwrite=overwrite)
    artifact.write_text("other")  # by another process
    with nullcontext() if overwrite else pytest.raises(MachineFailed, match="meanwhile"), files.together():
        fields(artifact)
        with files.whole_file(artifact) as own:
            own.write_text("own")
    names = {p.name for p in tmp_path.iterdir()}
    assert names == ({"a.nc", "a.vtu", "a.pvd"} if overwrite else {"a.nc"})
    assert artifact.read_text() == ("own" if overwrite else "other")


def test_what_a_stopped_run_kept_may_be_replaced_by_its_restart(tmp_path):
    outputs = Outputs(tmp_path / "a.nc", (), (CHECKPOINT,))
    np.savez(tmp_path / "a.checkpoint.npz", scene=np.array("digest"), x=np.arange(3))
    assert "`restart`" in refused(outputs)
    outputs.claim([], restart=True)
    outputs.claim([], overwrite=True)
    whole = (tmp_path / "a.checkpoint.npz").read_bytes()
    (tmp_path / "a.checkpoint.npz").write_bytes(whole[: len(whole) // 2])
    outputs.claim([], overwrite=True)
    np.savez(tmp_path / "a.checkpoint.npz", weights=np.arange(3))
    refused(outputs, overwrite=True)


class TestKilled:
    """Leftovers of processes that are no more."""

    GONE = 2**31 - 7

    def test_parts_are_cleaned(self, tmp_path):
        for path in (tmp_path / "a.nc", tmp_path / "a.pvd", tmp_path / "b.nc"):
            files.part_of(path, self.GONE).write_bytes(b"half")
        files.part_of(tmp_path / "a.vtu", self.GONE).mkdir()
        alive = files.part_of(tmp_path / "a.nc", os.getppid())
        alive.write_bytes(b"of a run that goes on")
        Outputs(tmp_path / "a.nc", SERIES).claim([])
        assert {p.name for p in tmp_path.iterdir()} == {alive.name, files.part_of(tmp_path / "b.nc", self.GONE).name}

    def test_a_half_done_replacement_is_taken_back(self, tmp_path):
        (tmp_path / "a.nc").write_bytes(b"")
        fields(tmp_path / "a.nc")
        before = tree(tmp_path)
        files.part_of(tmp_path / "a.nc", self.GONE).write_bytes(b"new")
        (tmp_path / "a.pvd").rename(tmp_path / f".a.pvd.{self.GONE}.old")
        (tmp_path / "a.pvd").write_bytes(b"new")
        (tmp_path / "a.vtu").rename(tmp_path / f".a.vtu.{self.GONE}.old")
        Outputs(tmp_path / "a.nc", SERIES).claim([], overwrite=True)
        assert tree(tmp_path) == before

    def test_a_complete_one_is_kept(self, tmp_path):
        fields(tmp_path / "a.nc")
        before = tree(tmp_path)
        (tmp_path / f".a.pvd.{self.GONE}.old").write_bytes(b"old")
        Outputs(tmp_path / "a.nc", SERIES).claim([], overwrite=True)
        assert tree(tmp_path) == before


@pytest.mark.parametrize("name", ["run.nc", "run"])
def test_the_last_good_state_of_a_failed_run_may_be_replaced(tmp_path, name):
    """Its PVD names an artifact of its own, NAME.last-good.nc."""
    output = tmp_path / name
    fields(beside(output, LAST_GOOD + ".nc"))
    Outputs(output, kept=tuple(LAST_GOOD + end for end in SERIES)).claim([], overwrite=True)


def test_a_material_file_with_warnings_may_be_replaced(tmp_path):
    from graben.schemas.scenes.material import write_material

    values = {"young_modulus": 1e9, "poisson_ratio": 0.2}
    write_material(tmp_path / "c.material.toml", "elastic", values, "fitted to a curve", ["a doubt"])
    Outputs(tmp_path / "c.nc", (MATERIAL,)).claim([], overwrite=True)
