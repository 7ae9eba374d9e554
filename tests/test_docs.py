"""The documentation: links and citations lead somewhere, snippets are right, and pages are short and plain."""

import re
import shlex
from importlib import import_module
from itertools import pairwise
from pathlib import Path

import pytest

from graben.cli.main import TOOLS
from graben.errors import BadInput
from graben.schemas.kinds import SCENES
from graben.schemas.scene import load_scene
from graben.stages.tools.check import examine
from graben.stages.wear_estimate import stage as wear_estimate

ROOT = Path(__file__).parents[1]
DOCS = sorted((ROOT / "docs").rglob("*.md"))
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *DOCS]
MANUAL = [p for p in DOCS if p.parent.name in ("manual", "tutorials")]
BIBLIOGRAPHY = ROOT / "docs" / "references.bib"
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", flags=re.M | re.S)
MOST_LINES, WIDEST, MOST_WORDS = 130, 100, 25


def name(page: Path) -> str:
    return str(page.relative_to(ROOT))


def pages(some):
    return pytest.mark.parametrize("page", some, ids=name)


def read(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def anchors(page: Path) -> set[str]:
    """Anchors of a page's headings as GitHub makes them: lower case, blanks to hyphens, punctuation dropped."""
    found: set[str] = set()
    for title in re.findall(r"^#+ (.+)$", BLOCK.sub("", read(page)), flags=re.M):
        anchor = re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
        found.add(anchor if anchor not in found else f"{anchor}-1")
    return found


def cited(text: str) -> set[str]:
    return {key for group in re.findall(r"\[(@[^\]]+)\]", text) for key in re.findall(r"@([a-z]+\d{4}[a-z]*)", group)}


def sentences(text: str) -> list[str]:
    """Sentences of paragraphs and list items, without code, tables, headings, pictures and citations."""
    text = re.sub(r"^( {4}|\||#|!).*$", "", BLOCK.sub("", text), flags=re.M)
    text = re.sub(r"`[^`]*`", "code", text)
    text = re.sub(r"\[@[^\]]*\]|\]\([^)]*\)|[\[*]", "", text)
    parts = re.split(r"\n\s*\n|^\s*(?:[-*]|\d+\.) ", text, flags=re.M)
    return [s for part in parts for s in re.split(r"(?<=[.!?])\s+", " ".join(part.split())) if s]


@pages(PAGES)
def test_links_and_anchors_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)\s]+)", re.sub(r"`[^`\n]*`", "", BLOCK.sub("", read(page)))):
        if target.startswith(("http:", "https:", "mailto:")):
            continue
        file, _, anchor = target.partition("#")
        goal = page.parent / file if file else page
        assert goal.exists(), target
        assert not anchor or anchor in anchors(goal), target


def test_every_page_can_be_reached_from_the_readme():
    seen, ahead = set(), [ROOT / "README.md"]
    while ahead:
        page = ahead.pop()
        seen.add(page)
        goals = {(page.parent / t).resolve() for t in re.findall(r"\]\(([^)#\s]+\.md)", read(page))}
        ahead += [g for g in goals - seen if g.exists()]
    assert set(DOCS) <= seen


def test_paths_of_pages_in_code_and_scenes_exist():
    for folder in ("graben", "pipelines", "benchmarks", "tests"):
        for file in (ROOT / folder).rglob("*"):
            if file.suffix in (".py", ".toml", ".mk", ".md"):
                for target in re.findall(r"\bdocs/[\w/.-]+\.(?:md|bib|py)\b", read(file)):
                    assert (ROOT / target).exists(), f"{name(file)}: {target}"


def test_what_is_cited_is_in_the_bibliography_and_the_other_way_round():
    keys = re.findall(r"^@\w+\{([^,\s]+),", read(BIBLIOGRAPHY), flags=re.M)
    assert len(keys) == len(set(keys))
    assert set().union(*(cited(read(p)) for p in PAGES)) == set(keys)


def test_the_readme_names_the_seven_commands():
    text = read(ROOT / "README.md")
    for tool in ("dem-run", "homogenize", "rev-study", "calibrate", "fem-run", "scratch", "wear-estimate"):
        assert f"[`{tool}`]" in text
        assert tool in TOOLS


@pages(PAGES)
def test_make_targets_in_the_text_exist(page):
    makefiles = "\n".join(p.read_text() for p in [ROOT / "Makefile", *ROOT.glob("pipelines/*/*.mk")])
    for target in re.findall(r"(?:^|`)make (?:-j2 )?([a-z-]+)", read(page), flags=re.M):
        assert re.search(rf"^{re.escape(target)}:", makefiles, flags=re.M), target


@pages(PAGES)
def test_commands_and_their_options_exist(page):
    for language, block in BLOCK.findall(read(page)):
        for line in block.splitlines() if language in ("", "sh") else ():
            words = shlex.split(line, comments=True)
            if words and words[0] == "graben":
                words = words[1:]
            if words and words[0] in TOOLS:
                check_call(words)


def check_call(words: list[str]) -> None:
    """Options of a command; and its scene, where it is one of ours, with what --set makes of it."""
    module, attribute = TOOLS[words[0]][0].split(":")
    known = {o for p in getattr(import_module(module), attribute).params for o in p.opts} | {"--help"}
    # What stands behind "--" is for another command.
    words = words[: words.index("--")] if "--" in words else words
    for word in words[1:]:
        assert not re.match(r"-[a-z]|--", word) or word in known, f"{words[0]} {word}"
    scenes = [w for w in words[1:] if w.startswith("pipelines/") and w.endswith(".toml")]
    for scene in scenes:
        assert (ROOT / scene).exists(), scene
    settings = [value for option, value in pairwise(words) if option == "--set"]
    if scenes and scenes[0] == words[1]:
        load_scene(ROOT / scenes[0], tuple(SCENES), settings)
    elif words[0] == "dem-run":
        load_scene(ROOT / "pipelines/upscaling/voronoi-granite.toml", "blocks", settings)


@pages([p for p in DOCS if "```toml" in read(p)])
def test_scenes_in_the_text_are_taken_by_their_stages(page, tmp_path):
    """With the files that the text prints: a block after a paragraph that ends with `NAME`:"""
    for file, content in re.findall(r"`([\w.-]+)`:\n\n```\w+\n(.*?)^```$", read(page), flags=re.M | re.S):
        (tmp_path / file).write_text(content, encoding="utf-8")
    for k, (language, text) in enumerate(BLOCK.findall(read(page))):
        if language == "toml":
            path = tmp_path / (f"{k}.toml" if "kind" in text else f"{k}.material.toml")
            path.write_text(text, encoding="utf-8")
            faults, _needed_on_the_command_line = examine(path)
            if faults:
                raise BadInput(faults)


@pytest.mark.usefixtures("laws_as_before")
@pages([p for p in DOCS if "```python" in read(p)])
def test_python_in_the_text_runs(page, tmp_path, monkeypatch):
    """Beside wear.nc, a result that takes a moment."""
    monkeypatch.chdir(tmp_path)
    wear_estimate.run(ROOT / "pipelines/wear/astm-g65-mixtures.toml", tmp_path / "wear.nc")
    names: dict[str, object] = {}
    for language, text in BLOCK.findall(read(page)):
        if language == "python":
            exec(compile(text, name(page), "exec"), names)


@pages(MANUAL)
def test_names_in_the_text_exist_in_the_code(page):
    """Keys, variables and headline numbers: words in backquotes with an underscore."""
    files = [p for room in ("graben", "pipelines") for p in (ROOT / room).rglob("*") if p.suffix in (".py", ".toml")]
    code = {word for p in files for word in re.findall(r"\w+", read(p))}
    spans = re.findall(r"`([^`\n]+)`", BLOCK.sub("", read(page)))
    named = {word for span in spans for word in re.findall(r"\w+", span) if re.search(r"[a-z]_[a-z]", word)}
    assert named <= code, named - code


@pages(PAGES)
def test_lines_are_short(page):
    for line in BLOCK.sub("", read(page)).splitlines():
        if not line.startswith(("|", "!", "    ")):
            assert len(re.sub(r"\]\([^)]*\)", "]", line)) <= WIDEST, line


@pages(PAGES)
def test_sentences_are_short(page):
    for sentence in sentences(read(page)):
        assert len(sentence.split()) <= MOST_WORDS, sentence


@pages(MANUAL)
def test_pages_of_the_manual_are_short(page):
    assert len(read(page).splitlines()) <= MOST_LINES


@pages([p for p in DOCS if p.parent.name == "studies" and p.name != "README.md"])
def test_studies_say_when_where_and_how(page):
    text = read(page)
    assert re.search(r"^Measured \d{4}-\d\d-\d\d\b", text, flags=re.M)
    assert re.search(r"commits? [0-9a-f]{7}\b", text)
    assert BLOCK.search(text)
    assert f"({page.name})" in read(page.parent / "README.md")
