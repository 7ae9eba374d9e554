"""The documentation's links lead somewhere, and its commands exist."""

import re
from pathlib import Path

import pytest

from graben.cli.main import TOOLS

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8")):
        if not target.startswith(("http:", "https:", "mailto:")):
            assert (page.parent / target).exists(), target


def test_the_readme_names_the_seven_commands():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    for name in ("dem-run", "homogenize", "rev-study", "calibrate", "fem-run", "scratch", "wear-estimate"):
        assert f"[`{name}`]" in text
        assert name in TOOLS


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_make_targets_in_the_text_exist(page):
    makefiles = "\n".join(p.read_text() for p in [ROOT / "Makefile", *ROOT.glob("pipelines/*/*.mk")])
    for target in re.findall(r"(?:^|`)make (?:-j2 )?([a-z-]+)", page.read_text(encoding="utf-8"), flags=re.M):
        assert re.search(rf"^{re.escape(target)}:", makefiles, flags=re.M), target
