"""Nodes and elements of an Abaqus or CalculiX deck, with the labels that the deck gives them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from graben.errors import BadInput, Fault
from graben.schemas.reading import read_bytes

# Element names by the cell that they are, and what a reader of the result should know about the name.
_PLANE_STRAIN = {f"CPE4{s}" for s in ("", "R", "H", "I", "RH", "IH")}
_OTHER_PLANES = {"CPS4", "CPS4R", "CPS4I", "S4", "S4R", "S4RS", "S4RSW", "S4R5"}
_KINDS = {
    **dict.fromkeys(_PLANE_STRAIN | _OTHER_PLANES, "quad"),
    **dict.fromkeys(("CPE3", "CPE3H", "CPS3", "S3", "S3R", "S3RS", "STRI3"), "triangle"),
    **dict.fromkeys(("CPE6", "CPE6H", "CPE6M", "CPE6MH", "CPS6", "CPS6M", "STRI65"), "triangle6"),
    **dict.fromkeys(("CPE8", "CPE8R", "CPE8H", "CPE8RH", "CPS8", "CPS8R", "S8", "S8R", "S8R5"), "quad8"),
}
_NODES = {"quad": 4, "triangle": 3, "triangle6": 6, "quad8": 8}
_LINE = re.compile(r"(T[23]D[23]|B[23][123])[A-Z]*")  # trusses and beams; Gmsh and meshio name outlines so
_QUADS_OF_MESHIO = "CAX4P"  # meshio writes this name for every quad
# Keywords that make or move nodes and elements by rule.
_BY_RULE = {"NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM", "SUBMODEL"}


@dataclass
class Block:
    """Elements of one name: cell kind, name in the file, corners (e, k) as rows of the points, labels (e,)."""

    kind: str
    name: str
    corners: np.ndarray
    numbers: np.ndarray


@dataclass
class _Scope:
    """A part, an independent instance, the assembly, or the deck outside all of these."""

    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    elements: list[tuple[str, int, list[int]]] = field(default_factory=list)


def read_deck(path: Path) -> tuple[np.ndarray, list[Block], list[str]]:
    """Points (n, 3), m, the blocks of elements, and notes on what was not taken over.

    Raises
    ------
    BadInput : not a deck, several parts or instances, a rotated instance, nodes or elements that are made by rule
    """
    reader = _Reader(path)
    reader.read(path)
    holding = {name: scope for name, scope in reader.scopes.items() if scope.elements}
    if not holding:
        raise BadInput(Fault(str(path), "*Element", "", "nodes and elements (*Node, *Element)"))
    if len(holding) > 1:
        names = ", ".join(name or "outside parts" for name in holding)
        raise BadInput(Fault(str(path), "*Part", names, "elements in one part: write the mesh as one body"))
    [(name, scope)] = holding.items()
    notes = reader.notes_on_instances(name)
    row = {label: k for k, label in enumerate(scope.nodes)}
    points = np.array(list(scope.nodes.values()), dtype=float).reshape(-1, 3)
    blocks = []
    for element_type in dict.fromkeys(kind for kind, _, _ in scope.elements):
        chosen = [(label, nodes) for kind, label, nodes in scope.elements if kind == element_type]
        for label, nodes in chosen:
            for node in nodes:
                if node not in row:
                    raise BadInput(Fault(str(path), f"element {label}", f"node {node}", "nodes that *Node defines"))
        same = min(len(nodes) for _, nodes in chosen)  # all, where the name is known
        corners = np.array([[row[n] for n in nodes[:same]] for _, nodes in chosen], dtype=np.int64)
        blocks.append(
            Block(reader.kind(element_type), element_type, corners, np.array([label for label, _ in chosen]))
        )
        if element_type in _OTHER_PLANES:
            notes.append(
                f"{len(chosen)} {element_type} elements are computed in plane strain, not as their name says"
            )
        elif element_type in _PLANE_STRAIN - {"CPE4"}:
            notes.append(f"{len(chosen)} {element_type} elements are computed with 2 x 2 points and mean dilatation")
    return points, blocks, notes


class _Reader:
    """Goes through the lines of a deck and of the files that it includes."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.by_meshio = False
        self.scopes: dict[str, _Scope] = {}
        self.instances: list[tuple[str, str, list[list[float]]]] = []  # name, part, rows of the placing
        self._scope = ""
        self._outer = ""

    def read(self, path: Path, depth: int = 0) -> None:
        if depth > 10:
            raise BadInput(Fault(str(self.path), "*Include", str(path), "files that do not include each other"))
        text = _text(path)
        self.by_meshio = self.by_meshio or "written by meshio" in text[:500]
        for keyword, options, rows, where in _sections(text):
            try:
                self._take(keyword, options, rows, path, depth)
            except (ValueError, IndexError) as error:
                if isinstance(error, BadInput):
                    raise
                place = f"line {where}, *{keyword.capitalize()}"
                raise BadInput(Fault(str(path), place, "", f"numbers separated by commas ({error})")) from None

    def kind(self, element_type: str) -> str:
        """The cell that a name means in this deck; the name itself where that is not known."""
        if element_type == _QUADS_OF_MESHIO and self.by_meshio:
            return "quad"
        return "line" if _LINE.fullmatch(element_type) else _KINDS.get(element_type, element_type)

    def _take(
        self, keyword: str, options: dict[str, str], rows: list[tuple[list[str], bool]], path: Path, depth: int
    ) -> None:
        if keyword in _BY_RULE:
            expected = "nodes and elements written out, in one Cartesian system (export an orphan mesh)"
            raise BadInput(Fault(str(path), f"*{keyword.capitalize()}", "", expected))
        if keyword == "INCLUDE":
            self.read(_beside(path, options.get("INPUT", "")), depth + 1)
        elif keyword in ("PART", "INSTANCE", "ASSEMBLY"):
            self._outer, self._scope = self._scope, f"{keyword.lower()} {options.get('NAME', '')}".strip()
            if keyword == "INSTANCE":
                placing = [[_number(v) for v in values] for values, _ in rows]
                self.instances.append((self._scope, f"part {options.get('PART', '')}", placing))
        elif keyword in ("END PART", "END INSTANCE", "END ASSEMBLY"):
            self._scope, self._outer = self._outer, ""
        elif keyword in ("NODE", "ELEMENT"):
            if "INPUT" in options:
                beside = _beside(path, options["INPUT"])
                rows = [*rows, *_data(_text(beside).splitlines())]
            scope = self.scopes.setdefault(self._scope, _Scope())
            if keyword == "ELEMENT":
                name = options.get("TYPE", "").upper()
                _elements(scope, name, _NODES.get(self.kind(name), 0), rows, path)
            elif options.get("SYSTEM", "R").upper() != "R":
                raise BadInput(Fault(str(path), "*Node", f"system={options['SYSTEM']}", "Cartesian coordinates"))
            else:
                _nodes(scope, rows, path)

    def notes_on_instances(self, holder: str) -> list[str]:
        """What the placing of the one part says; refuses what would need more than one body or a rotation."""
        placed = [i for i in self.instances if holder in (i[0], i[1])]
        if len(placed) > 1:
            raise BadInput(
                Fault(str(self.path), "*Instance", f"{len(placed)} of {holder}", "one instance of one part")
            )
        if not placed or not placed[0][2]:
            return []
        name, _, rows = placed[0]
        if len(rows) > 1:
            raise BadInput(Fault(str(self.path), name, "rotated", "a part that its instance does not rotate"))
        shift = ", ".join(f"{v:g}" for v in rows[0])
        if not any(rows[0]):
            return []
        return [f"{name} moves the part by ({shift}): not applied, coordinates are those of the part"]


def _sections(text: str) -> Iterator[tuple[str, dict[str, str], list[tuple[list[str], bool]], int]]:
    """Keyword, options (names in capitals), data rows and line number of every keyword of a deck."""
    lines = [line.strip() for line in text.splitlines()]  # a keyword may stand behind blanks
    starts = [k for k, line in enumerate(lines) if line.startswith("*") and not line.startswith("**")]
    for start, end in zip(starts, [*starts[1:], len(lines)]):
        first = start + 1
        head = lines[start].strip()
        while head.endswith(",") and first < end:  # a keyword line goes on after a comma at its end
            head, first = head + lines[first].strip(), first + 1
        keyword, *words = [word.strip() for word in head[1:].split(",")]
        options = {}
        for word in words:
            name, _, value = word.partition("=")
            options[" ".join(name.upper().split())] = value.strip().strip('"')
        keyword = " ".join(keyword.upper().split())
        wanted = keyword in ("NODE", "ELEMENT", "INSTANCE")
        yield keyword, options, list(_data(lines[first:end])) if wanted else [], start + 1


def _text(path: Path) -> str:
    data = read_bytes(path, "mesh file").removeprefix(b"\xef\xbb\xbf")
    return data.decode("latin-1")  # comments may be in any encoding


def _data(lines: list[str]) -> Iterator[tuple[list[str], bool]]:
    """Values of each data line, and whether it ends with a comma."""
    for line in lines:
        text = line.strip()
        if text and not text.startswith("**"):
            yield [value.strip() for value in text.rstrip(",").split(",")], text.endswith(",")


def _number(text: str) -> float:
    return float(text.upper().replace("D", "E")) if text else 0.0


def _nodes(scope: _Scope, rows: list[tuple[list[str], bool]], path: Path) -> None:
    for values, _ in rows:
        label, (x, y, z) = int(values[0]), ([_number(v) for v in values[1:4]] + [0.0, 0.0, 0.0])[:3]
        if scope.nodes.get(label, (x, y, z)) != (x, y, z):
            raise BadInput(Fault(str(path), f"node {label}", f"({x:g}, {y:g}, {z:g})", "one place for each node"))
        scope.nodes[label] = (x, y, z)


def _elements(scope: _Scope, name: str, length: int, rows: list[tuple[list[str], bool]], path: Path) -> None:
    """Take the elements of a section, of `length` nodes; 0: each ends where a line does not end with a comma."""
    pending: list[int] = []
    for values, goes_on in rows:
        pending += [int(v) for v in values if v]
        if len(pending) == 1 + length or (length == 0 and not goes_on):
            scope.elements.append((name, pending[0], pending[1:]))
            pending = []
        elif length and len(pending) > 1 + length:
            break
    if pending and length == 0:
        scope.elements.append((name, pending[0], pending[1:]))
    elif pending:
        found = f"{len(pending) - 1} nodes"
        raise BadInput(Fault(str(path), f"element {pending[0]}", found, f"the {length} nodes of a {name}"))


def _beside(path: Path, name: str) -> Path:
    found = path.parent / name
    if not found.is_file():
        raise BadInput(Fault(str(path), "input", name, f"a file that exists ({found})"))
    return found
