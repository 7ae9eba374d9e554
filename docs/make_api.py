"""Write docs/api.md from the docstrings of everything that ``import graben`` offers: python docs/make_api.py"""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import graben

PAGE = Path(__file__).with_name("api.md")
ROOMS = {
    "Run and read": ["run", "homogenize", "Result", "open", "provenance", "Provenance", "scene", "check"],
    "Laws": ["material", "Material", "laws", "follow", "Followed", "law", "Parameter", "curve", "fit", "Fit"],
    "Bodies": ["voronoi_blocks", "block_model", "Blocks", "bed", "average", "Average", "mesh", "plane_analysis",
               "PlaneAnalysis"],
    "Errors": ["GrabenError", "BadInput", "Fault", "NumericsFailed", "MachineFailed"],
}  # fmt: skip
HEAD = """# Names of graben

What `import graben` offers, from its docstrings by `python docs/make_api.py`. Start with
[graben from Python](python.md).
"""


def main() -> None:
    PAGE.write_text(page(), encoding="utf-8")


def page() -> str:
    """The text of docs/api.md."""
    listed = [name for names in ROOMS.values() for name in names]
    missing = set(graben.__all__) ^ {*listed, "__version__"}
    assert not missing, f"ROOMS and graben.__all__ differ: {missing}"
    parts = [HEAD]
    for title, names in ROOMS.items():
        parts.append(f"## {title}\n")
        for name in names:
            thing = getattr(graben, name)
            members = [(f"{name}.{n}", getattr(thing, n)) for n in thing.__all__] if inspect.ismodule(thing) else []
            if inspect.isclass(thing):
                own = vars(thing).items()
                members = [(f"{name}.{n}", m) for n, m in own if inspect.isfunction(m) and n[0] != "_"]
            parts.append(entry(name, thing, 3))
            parts += [entry(n, m, 4) for n, m in members if inspect.isfunction(m)]
    return "\n".join(parts)


def entry(name: str, thing: Any, level: int) -> str:
    """A heading, and the signature with the docstring."""
    text = inspect.getdoc(thing) or ""
    made_by_callers = inspect.isfunction(thing) or name in ("Parameter", "Fault")
    shown = signature(name, thing) + "\n\n" if made_by_callers else ""
    return f"{'#' * level} {name}\n\n```text\n{shown}{text}\n```\n"


def signature(name: str, thing: Any) -> str:
    """One line, or one a parameter where that is too wide."""
    found = inspect.signature(thing)
    shown: list[str] = []
    for p in (p for p in found.parameters.values() if p.name != "self"):
        if p.kind is p.KEYWORD_ONLY and "*" not in shown:
            shown.append("*")
        stars = {p.VAR_POSITIONAL: "*", p.VAR_KEYWORD: "**"}.get(p.kind, "")
        default = "" if p.default is p.empty else f" = {p.default!r}"
        shown.append(f"{stars}{p.name}: {p.annotation}{default}")
    answer = f" -> {found.return_annotation}" if inspect.isfunction(thing) else ""
    line = f"{name}({', '.join(shown)}){answer}"
    if len(line) <= 96:
        return line
    return f"{name}(\n" + "".join(f"    {text},\n" for text in shown) + f"){answer}"


if __name__ == "__main__":
    main()
