"""Mesh files: the same body in every format and dialect gives the closed form; everything else is named."""

import json

import meshio
import numpy as np
import pytest
from click.testing import CliRunner

from graben.cli.fem_run import main
from graben.errors import BadInput
from graben.stages.fem_run.mesh import read_quads

# A block 3 m wide and 2 m high between smooth walls under a pressure on top: oedometer.
SCENE = """
kind = "fem"
[mesh]
method = "file"
file = "FILE"
[material]
law = "elastic"
parameters = { young_modulus = "80 MPa", poisson_ratio = 0.25 }
[gravity]
density = "1900 kg/m^3"
[[supports]]
name = "base"
start = ["0 m", "0 m"]
end = ["3 m", "0 m"]
fix = "y"
[[supports]]
name = "left"
start = ["0 m", "0 m"]
end = ["0 m", "2 m"]
fix = "x"
[[supports]]
name = "right"
start = ["3 m", "0 m"]
end = ["3 m", "2 m"]
fix = "x"
[[loads]]
name = "top"
start = ["0 m", "2 m"]
end = ["3 m", "2 m"]
rate = "0.5 MPa/s"
[stepping]
goal = "end"
end = "1 s"
first = "1 s"
"""
OEDOMETER = 80e6 * (1 - 0.25) / ((1 + 0.25) * (1 - 2 * 0.25))
SETTLEMENT = 2.0 * 0.5e6 / OEDOMETER


def block(nx=3, ny=2):
    i, j = np.meshgrid(np.arange(nx + 1), np.arange(ny + 1), indexing="ij")
    points = np.stack([3.0 * i.ravel() / nx, 2.0 * j.ravel() / ny, np.zeros(i.size)], axis=1)
    first = (np.arange(nx)[:, None] * (ny + 1) + np.arange(ny)).ravel()
    return points, np.stack([first, first + ny + 1, first + ny + 2, first + 1], axis=1)


def deck(
    kind="CPE4", element="*Element, type={}", before=(), after=(), node="*Node", skip=(), shape="{}, {}, {}, 0."
):
    """The block as an Abaqus deck whose labels have gaps."""
    points, quads = block()
    lines = ["*Heading", " block", *before, node]
    lines += [shape.format(10 * k + 10, x, y) for k, (x, y, _) in enumerate(points)]
    lines += [element.format(kind)]
    lines += [
        f"{500 + 2 * e}, " + ", ".join(str(10 * n + 10) for n in q) for e, q in enumerate(quads) if e not in skip
    ]
    return "\n".join([*lines, *after]) + "\n"


def run(folder, name):
    (folder / "scene.toml").write_text(SCENE.replace("FILE", name))
    return CliRunner().invoke(main, [str(folder / "scene.toml"), "-o", str(folder / "out.nc"), "--json", "-q"])


def settlement(result) -> float:
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)["settlement_m"]


def refused(path) -> str:
    with pytest.raises(BadInput) as caught:
        read_quads(path)
    assert str(path) in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("a.msh", {"file_format": "gmsh22", "binary": False}),
        ("b.msh", {"file_format": "gmsh22", "binary": True}),
        ("c.msh", {"file_format": "gmsh", "binary": False}),
        ("d.msh", {"file_format": "gmsh", "binary": True}),
        ("e.vtu", {}),
        ("f.vtk", {}),
        ("g.inp", {}),
    ],
)
def test_formats_hold_the_same_body_and_lines_are_left_out(tmp_path, name, options):
    points, quads = block()
    lines = np.stack([[0, 3, 6], [3, 6, 9]], axis=1)
    cells = [("line", lines), ("quad", quads)]
    if options.get("file_format") == "gmsh":  # meshio writes one kind in this format
        cells = cells[1:]
    meshio.Mesh(points, cells).write(tmp_path / name, **options)
    mesh, notes = read_quads(tmp_path / name)
    assert len(mesh.quads) == 6
    assert len(cells) == 1 or any("3 cells of kind" in n and "left out" in n for n in notes)
    np.testing.assert_allclose(mesh.areas().sum(), 6.0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (deck("CPE4"), None),
        (deck("cpe4", "*ELEMENT,TYPE={},ELSET=ALL", node="*NODE, NSET=N"), None),
        (deck("CPE4R"), "6 CPE4R elements are computed with 2 x 2 points"),
        (deck("CPS4"), "6 CPS4 elements are computed in plane strain"),
        (deck("S4"), "6 S4 elements"),
        (deck(shape="{}, {}, {}"), None),
        (deck(shape="{}, {:.3e}, {:.3e},").replace("e+", "D+").replace("e-", "D-"), None),
        (deck(before=["*Part, name=P"], after=["*End Part", "*Assembly, name=A", "*Instance, name=I, part=P",
              "0., 40., 0.", "*End Instance", "*Node", "1, 5., 5., 0.", "*End Assembly"]), "part by (0, 40, 0)"),
        (deck(after=["*Nset, nset=L", "10, 20", "*Elset, elset=TOP", "500, 502", "*Elset, elset=B", "TOP"]), None),
        (deck(after=["*Material, name=M", "*Elastic", "1e8, 0.3", "*Step", "*Node Output", "U", "*End Step"]), None),
        (deck().replace("*Element", "*Node\n10, 0., 0., 0.\n*Element"), None),
        (deck().replace("*Element", "*Nset, nset=L\n10, 20\n  *Element"), None),  # blanks before a keyword
        ("\ufeff" + deck(), None),
    ],
)  # fmt: skip
def test_decks_in_the_dialects_that_people_have(tmp_path, text, words):
    (tmp_path / "deck.inp").write_text(text, encoding="utf-8")
    result = run(tmp_path, "deck.inp")
    np.testing.assert_allclose(settlement(result), SETTLEMENT, rtol=1e-9)
    notes = json.loads(result.stdout).get("mesh_notes", [])
    assert (notes == []) if words is None else any(words in n for n in notes)


def test_a_deck_in_two_files(tmp_path):
    head, _, tail = deck().partition("*Element")
    (tmp_path / "nodes.inc").write_text(head)
    (tmp_path / "deck.inp").write_text("*Include, input=nodes.inc\n*Element" + tail)
    assert len(read_quads(tmp_path / "deck.inp")[0].quads) == 6


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (deck("CPE8"), ["the 8 nodes of a CPE8"]),
        (deck(skip=range(6), after=["1, 10, 70, 90, 30, 40, 80, 60, 20"], kind="CPE8R"),
         ["1 of kind CPE8R", "number 1 near", "second order are not computed yet"]),
        (deck(skip=[4], after=["*Element, type=CPE3", "7, 70, 100, 110", "8, 70, 110, 80"]),
         ["2 of kind CPE3", "number 7 near (2.66667, 0.333333)", "recombine"]),
        (deck("CAX4"), ["6 of kind CAX4", "axisymmetric"]),
        (deck("GAPUNI"), ["6 of kind GAPUNI"]),
        (deck(after=["506, 10, 20, 40"]), ["element 506", "3 nodes"]),
        (deck("CAX4P", before=["written by meshio"], after=["506, 10,", "20,"]), ["506", "4 nodes of a CAX4P"]),
        (deck(after=["900, 10, 20, 5000, 40"]), ["element 900", "node 5000"]),
        (deck(after=["900, 10, twenty, 50, 40"]), ["*Element", "twenty"]),
        (deck(shape="{}, x{}, {}"), ["*Node", "numbers"]),
        (deck(after=["*Ngen", "1, 5, 1"]), ["*Ngen", "written out"]),
        (deck(node="*Node, system=C"), ["system=C", "Cartesian"]),
        (deck(after=["*Include, input=none.inp"]), ["none.inp"]),
        (deck(before=["*Part, name=P"], after=["*End Part", "*Instance, name=I, part=P", "*End Instance",
              "*Instance, name=J, part=P", "9., 0., 0.", "*End Instance"]), ["2 of part P", "one instance"]),
        (deck(before=["*Part, name=P"], after=["*End Part", "*Instance, name=I, part=P", "0., 0., 0.",
              "0., 0., 0., 0., 0., 1., 90.", "*End Instance"]), ["rotate"]),
        (deck(before=["*Part, name=P"], after=["*End Part", "*Part, name=Q", "*Node", "1, 0., 0.",
              "*Element, type=MASS", "1, 1", "*End Part"]), ["part P, part Q", "one part"]),
        ("*Heading\n nothing\n", ["nodes and elements"]),
        ("", ["nodes and elements"]),
    ],
)  # fmt: skip
def test_decks_that_are_refused_say_what_and_where(tmp_path, text, words):
    (tmp_path / "deck.inp").write_text(text)
    message = refused(tmp_path / "deck.inp")
    for word in words:
        assert word in message


def test_cells_of_another_kind_among_quads_are_refused_by_number_and_place(tmp_path):
    points, quads = block()
    split = quads[3]
    cells = [("quad", np.delete(quads, 3, axis=0)), ("triangle", [split[[0, 1, 2]], split[[0, 2, 3]]])]
    for name, first in (("mixed.vtu", 5), ("mixed.msh", 6)):
        meshio.Mesh(points, cells).write(tmp_path / name)
        message = refused(tmp_path / name)
        assert f"2 of kind triangle, the first number {first} near (1.66667, 1.33333)" in message
        assert "recombine" in message
    meshio.Mesh(points, [("tetra", [[0, 1, 3, 4]])]).write(tmp_path / "solid.vtu")
    assert "1 of kind tetra" in refused(tmp_path / "solid.vtu")


def test_faults_of_the_body_name_the_numbers_of_the_file(tmp_path):
    (tmp_path / "deck.inp").write_text(deck(skip=[2, 3]))
    message = refused(tmp_path / "deck.inp")
    assert "2 parts" in message and ("elements 500, 502" in message or "elements 508, 510" in message)
    points, quads = block()
    meshio.Mesh(points, [("quad", quads), ("quad", quads[:2])]).write(tmp_path / "twice.msh", file_format="gmsh22")
    mesh, notes = read_quads(tmp_path / "twice.msh")
    assert len(mesh.quads) == 6 and "2 elements are written twice and kept once (the first is number 7)" in notes


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: p[:, [0, 2, 1]], "constant y"),
        (lambda p: p + [[0.0, 0.0, 1.0]] * p[:, :1], "z from 0 to 3"),
        (lambda p: np.where(p == 3.0, np.nan, p), "finite"),
    ],
)
def test_other_planes_and_broken_coordinates(tmp_path, change, words):
    points, quads = block()
    meshio.Mesh(change(points), [("quad", quads)]).write(tmp_path / "a.vtu")
    assert words in refused(tmp_path / "a.vtu")


def test_a_constant_z_and_a_far_node_of_no_element_do_not_matter(tmp_path):
    points, quads = block()
    points[:, 2] = 7.0
    meshio.Mesh(np.concatenate([points, [[0.0, 0.0, 99.0]]]), [("quad", quads)]).write(tmp_path / "a.vtu")
    mesh, notes = read_quads(tmp_path / "a.vtu")
    assert len(mesh.points) == 12 and notes == ["1 nodes of no element were dropped"]


@pytest.mark.parametrize("name", ["a.msh", "a.vtu", "a.vtk", "a.xdmf", "a.inp", "a.med", "a.dat", "a.txt", "a"])
@pytest.mark.parametrize("content", [b"", b"not a mesh\n", bytes(range(256)) * 8])
def test_files_that_hold_no_mesh_are_exit_2_and_stdout_stays_empty(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    result = run(tmp_path, name)
    assert result.exit_code == 2, result.output
    assert result.stdout == "" and name in result.stderr
    assert {p.name for p in tmp_path.iterdir()} == {name, "scene.toml"}


@pytest.mark.parametrize("name", ["a.msh", "a.vtu", "a.vtk"])
def test_truncated_files_are_bad_input(tmp_path, name):
    points, quads = block()
    meshio.Mesh(points, [("quad", quads)]).write(tmp_path / name)
    whole = (tmp_path / name).read_bytes()
    for part in (0.2, 0.5, 0.8):
        (tmp_path / name).write_bytes(whole[: int(part * len(whole))])
        refused(tmp_path / name)


def test_corners_that_name_no_node_are_bad_input(tmp_path):
    (tmp_path / "a.vtk").write_text(
        "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n"
        "0 0 0 1 0 0 1 1 0 0 1 0\nCELLS 1 5\n4 0 1 2 9\nCELL_TYPES 1\n9\n"
    )
    assert "node 9" in refused(tmp_path / "a.vtk")


def test_quads_of_three_corners_are_bad_input(tmp_path, monkeypatch):
    # Damaged files of gmsh come so from the library that reads them.
    points, quads = block()
    mesh = meshio.Mesh(points, [("quad", quads)])
    mesh.write(tmp_path / "a.vtu")
    mesh.cells[0].data = mesh.cells[0].data[:, :3]
    monkeypatch.setattr("meshio.read", lambda path, file_format=None: mesh)
    assert "quad of 3 corners" in refused(tmp_path / "a.vtu")


def test_a_mesh_in_millimetres_is_refused_with_both_sizes(tmp_path):
    points, quads = block()
    meshio.Mesh(1000.0 * points, [("quad", quads)]).write(tmp_path / "a.vtu")
    result = run(tmp_path, "a.vtu")
    assert result.exit_code == 2
    assert "supports.0" in result.stderr and "loads.0" in result.stderr
    assert "the mesh spans 3000 m x 2000 m, loads and supports 3 m x 2 m" in result.stderr
