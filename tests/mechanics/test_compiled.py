"""The kernel cache: filled once, found again, and never stale when another file of the room changes."""

import shutil
import subprocess
import sys
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "graben"

LAW = "from graben.mechanics.compiled import kernel\n\n@kernel\ndef law(x):\n    return {}\n"
LOOP = (
    "from graben.mechanics.compiled import kernel\nfrom graben.mechanics.wear.law import law\n\n"
    "@kernel\ndef loop(x):\n    return law(x) + 1.0\n"
)


def run(house: Path) -> tuple[float, bool]:
    """The value of loop(2.0) in a fresh interpreter, and whether it came from the disk cache."""
    script = (
        "from graben.mechanics.wear.loop import loop; v = loop(2.0); "
        "print(v, sum(loop.stats.cache_hits.values()) > 0)"
    )
    out = subprocess.run([sys.executable, "-c", script], cwd=house, capture_output=True, text=True, check=True)
    value, hit = out.stdout.split()
    return float(value), hit == "True"


def test_an_edit_of_a_called_law_reaches_its_cached_callers(tmp_path):
    mechanics = tmp_path / "graben" / "mechanics"
    (mechanics / "wear").mkdir(parents=True)
    (mechanics / "materials").mkdir()
    shutil.copy(PACKAGE / "mechanics" / "compiled.py", mechanics)
    for folder in (tmp_path / "graben", mechanics, mechanics / "wear", mechanics / "materials"):
        (folder / "__init__.py").touch()
    (mechanics / "wear" / "law.py").write_text(LAW.format("2.0 * x"))
    (mechanics / "wear" / "loop.py").write_text(LOOP)

    assert run(tmp_path) == (5.0, False)
    assert run(tmp_path) == (5.0, True)
    (mechanics / "wear" / "law.py").write_text(LAW.format("3.0 * x"))
    assert run(tmp_path) == (7.0, False)
