"""The kernel cache: filled once, found again, never stale, never torn, never anybody else's."""

import logging
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numba
import pytest

from graben.mechanics import compiled, kernel_cache

PACKAGE = Path(__file__).parents[2] / "graben"

LAW = "from graben.mechanics.compiled import kernel\n\n@kernel\ndef law(x):\n    return {}\n"
LOOP = (
    "from graben.mechanics.compiled import kernel\n"
    "from graben.mechanics.averaging import (\n    law as other,\n)\n\n"
    "law = other.law\n\n@kernel\ndef loop(x):\n    return law(x) + 1.0\n"
)
SCRIPT = (
    "from graben.mechanics.wear.loop import loop; v = loop(2.0); print(v, sum(loop.stats.cache_hits.values()) > 0)"
)


@pytest.fixture
def house(tmp_path):
    """A small package with a kernel in one room and what it calls in another."""
    mechanics = tmp_path / "graben" / "mechanics"
    for room in ("wear", "averaging"):
        (mechanics / room).mkdir(parents=True)
        (mechanics / room / "__init__.py").touch()
    for folder in (mechanics, mechanics.parent):
        (folder / "__init__.py").touch()
    for name in ("compiled.py", "kernel_cache.py"):
        shutil.copy(PACKAGE / "mechanics" / name, mechanics)
    (mechanics / "averaging" / "law.py").write_text(LAW.format("2.0 * x"))
    (mechanics / "wear" / "loop.py").write_text(LOOP)
    return tmp_path


def start(house: Path) -> subprocess.Popen:
    """A fresh interpreter that prints loop(2.0) and whether it came from the disk cache."""
    about = {**os.environ, "XDG_CACHE_HOME": str(house / "cache")}
    return subprocess.Popen([sys.executable, "-c", SCRIPT], cwd=house, env=about, stdout=subprocess.PIPE, text=True)


def run(house: Path) -> tuple[float, bool]:
    value, hit = start(house).communicate()[0].split()
    return float(value), hit == "True"


def test_an_edit_of_a_called_law_in_another_room_reaches_its_cached_callers(house):
    assert run(house) == (5.0, False)
    assert run(house) == (5.0, True)
    (house / "graben/mechanics/averaging/law.py").write_text(LAW.format("3.0 * x"))
    assert run(house) == (7.0, False)


def test_installations_with_the_same_sources_share_their_kernels(house, tmp_path):
    assert run(house) == (5.0, False)
    other = tmp_path / "elsewhere"
    shutil.copytree(house / "graben", other / "graben")
    (other / "cache").symlink_to(house / "cache")
    assert run(other) == (5.0, True)


def test_a_kernel_that_another_called_can_be_called_from_python(house):
    assert run(house) == (5.0, False)
    script = SCRIPT.replace("import loop;", "import law, loop;").replace("print(", "print(law(2.0) + ")
    about = {**os.environ, "XDG_CACHE_HOME": str(house / "cache")}
    for order in (script, script.replace("v = loop(2.0)", "law(2.0); v = loop(2.0)")):
        ended = subprocess.run([sys.executable, "-c", order], cwd=house, env=about, capture_output=True, text=True)
        assert ended.stdout.split()[0] == "9.0", ended.stderr


def test_another_setting_of_numba_makes_another_kernel(folders, monkeypatch):
    assert not called()
    monkeypatch.setattr(numba.config, "LOOP_VECTORIZE", 0)
    assert not called()
    assert called()


def test_processes_may_fill_the_cache_side_by_side(house):
    both = [start(house), start(house)]
    assert [process.communicate()[0].split()[0] for process in both] == ["5.0", "5.0"]
    assert run(house) == (5.0, True)


def test_digests_follow_imports_from_room_to_room():
    assert "graben.mechanics.materials.point" in compiled._imported("graben.mechanics.fitting.curves")
    for stored in (
        compiled.digest_of_sources,
        compiled._imported,
        compiled._digest,
        compiled._read,
        compiled._sources,
    ):
        stored.cache_clear()
    begun = time.process_time()
    for module in compiled._sources():
        compiled.digest_of_sources(module)
    assert time.process_time() - begun < 1.0  # some 20 ms: whole files are not parsed


def doubled(x):
    return 2.0 * x


def called() -> bool:
    """Call a fresh dispatcher of `doubled`; whether its code came from the disk cache."""
    dispatcher = numba.njit(doubled)
    dispatcher._cache = kernel_cache.KernelCache(doubled, "the same sources")
    assert dispatcher(3.0) == 6.0
    return sum(dispatcher.stats.cache_hits.values()) > 0


@pytest.fixture
def folders(tmp_path, monkeypatch):
    """Where kernels are kept: in the user's cache folder, or beside the sources."""
    sources, user = tmp_path / "sources", tmp_path / "user"
    sources.mkdir(mode=0o700)
    monkeypatch.setattr(kernel_cache, "__file__", str(sources / "kernel_cache.py"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(user))
    kernel_cache.folder.cache_clear()
    kernel_cache._say_once.cache_clear()
    yield user / "graben" / "kernels", sources / "__pycache__" / "kernels"
    kernel_cache.folder.cache_clear()


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: b"",
        lambda data: data[: len(data) // 2],
        lambda data: data[:40],
        lambda data: data[:-9] + bytes([data[-9] ^ 1]) + data[-8:],
        lambda data: b"\x80\x04garbage" + data,
    ],
)
def test_a_broken_file_of_the_cache_is_rebuilt(folders, damage):
    assert not called()
    (file,) = folders[0].iterdir()
    file.write_bytes(damage(file.read_bytes()))
    assert not called()
    assert called()


def test_a_file_that_others_can_write_is_not_run(folders):
    assert not called()
    (file,) = folders[0].iterdir()
    file.chmod(0o666)
    assert not called()
    assert file.stat().st_mode & 0o777 == 0o600
    assert called()


def test_kernels_are_kept_in_the_users_folder_closed_to_others(folders):
    assert not called()
    assert not folders[1].exists()
    assert len(list(folders[0].iterdir())) == 1
    assert folders[0].stat().st_mode & 0o777 == 0o700
    assert called()


def test_without_a_folder_of_the_user_kernels_lie_beside_sources_of_ones_own(folders):
    folders[0].parents[1].touch()
    assert not called()
    assert len(list(folders[1].iterdir())) == 1
    assert called()


def test_a_folder_that_others_can_write_is_not_used(folders, caplog):
    folders[0].mkdir(parents=True)
    for folder in (folders[0], folders[1].parents[1]):
        folder.chmod(0o777)
    assert [called(), called()] == [False, False]
    assert list(folders[0].iterdir()) == []
    assert sum("not kept" in record.message for record in caplog.records) == 1


def test_the_folder_of_another_user_is_not_used(folders, monkeypatch):
    monkeypatch.setattr(os, "geteuid", lambda: folders[1].parents[1].stat().st_uid + 1)
    assert kernel_cache.folder() is None


def test_without_a_folder_kernels_run_and_it_is_said_once(folders, caplog):
    folders[0].parents[1].touch()
    folders[1].parent.touch()
    with caplog.at_level(logging.WARNING):
        assert [called(), called()] == [False, False]
    assert sum("not kept" in record.message for record in caplog.records) == 1
