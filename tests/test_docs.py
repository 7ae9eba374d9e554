"""The documentation: links and citations lead somewhere, and its commands exist."""

import re
from pathlib import Path

import pytest

from graben.cli.main import TOOLS

ROOT = Path(__file__).parents[1]
DOCS = sorted((ROOT / "docs").rglob("*.md"))
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *DOCS]
BIBLIOGRAPHY = ROOT / "docs" / "references.bib"
CODE = re.compile(r"^```.*?^```$|`[^`\n]*`", flags=re.M | re.S)
every_page = pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))


def anchors(page: Path) -> set[str]:
    """Anchors of a page's headings as GitHub makes them: lower case, blanks to hyphens, punctuation dropped."""
    found: set[str] = set()
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    for title in re.findall(r"^#+ (.+)$", text, flags=re.M):
        name = re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
        found.add(name if name not in found else f"{name}-1")
    return found


def cited(text: str) -> set[str]:
    return {key for group in re.findall(r"\[(@[^\]]+)\]", text) for key in re.findall(r"@([a-z]+\d{4}[a-z]?)", group)}


@every_page
def test_links_and_anchors_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)\s]+)", CODE.sub("", page.read_text(encoding="utf-8"))):
        if target.startswith(("http:", "https:", "mailto:")):
            continue
        name, _, anchor = target.partition("#")
        goal = page.parent / name if name else page
        assert goal.exists(), target
        assert not anchor or anchor in anchors(goal), target


def test_paths_of_pages_in_code_and_scenes_exist():
    for folder in ("graben", "pipelines", "benchmarks", "tests"):
        for file in (ROOT / folder).rglob("*"):
            if file.suffix in (".py", ".toml", ".mk", ".md"):
                for target in re.findall(r"\bdocs/[\w/.-]+\.(?:md|bib)\b", file.read_text(encoding="utf-8")):
                    assert (ROOT / target).exists(), f"{file.relative_to(ROOT)}: {target}"


def test_what_is_cited_is_in_the_bibliography_and_the_other_way_round():
    keys = re.findall(r"^@\w+\{([^,\s]+),", BIBLIOGRAPHY.read_text(encoding="utf-8"), flags=re.M)
    assert len(keys) == len(set(keys))
    assert set().union(*(cited(p.read_text(encoding="utf-8")) for p in PAGES)) == set(keys)


def test_the_readme_names_the_seven_commands():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    for name in ("dem-run", "homogenize", "rev-study", "calibrate", "fem-run", "scratch", "wear-estimate"):
        assert f"[`{name}`]" in text
        assert name in TOOLS


@every_page
def test_make_targets_in_the_text_exist(page):
    makefiles = "\n".join(p.read_text() for p in [ROOT / "Makefile", *ROOT.glob("pipelines/*/*.mk")])
    for target in re.findall(r"(?:^|`)make (?:-j2 )?([a-z-]+)", page.read_text(encoding="utf-8"), flags=re.M):
        assert re.search(rf"^{re.escape(target)}:", makefiles, flags=re.M), target
