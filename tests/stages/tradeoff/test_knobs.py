"""Knobs as a caller writes them."""

import pytest

from graben.errors import BadInput
from graben.stages.tradeoff.knobs import Knob, grid, knobs_of


def test_a_grid_ends_with_the_finest_point():
    knobs = knobs_of(["mesh.size=2 m, 1 m", 'loads=[{rate="1 Pa/s"},{a=1}],[]', 'name="a,b",c'])
    assert [k.values for k in knobs] == [("2 m", "1 m"), ('[{rate="1 Pa/s"},{a=1}]', "[]"), ('"a,b"', "c")]
    points = grid(knobs)
    assert len(points) == 8 and points[-1] == {"mesh.size": "1 m", "loads": "[]", "name": "c"}


def test_fidelities_unless_given():
    assert knobs_of([]) == [Knob("fidelity", ("draft", "standard", "reference"))]


@pytest.mark.parametrize(
    ("values", "sizes"),
    [
        (("2 m", "1 m", "0.5 m"), [2.0, 1.0, 0.5]),
        (("100", "200", "400"), [0.01, 0.005, 0.0025]),
        (("2 m", "1 mm"), None),
        (("draft", "standard"), None),
        (("1", "3", "2"), None),
        (("0", "1"), None),
    ],
)
def test_sizes_fall_towards_the_fine_end(values, sizes):
    assert Knob("k", values).sizes == sizes


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        (["steps"], "two different values"),
        (["steps=1"], "two different values"),
        (["steps=1,1"], "two different values"),
        (["steps=1,,2"], "two different values"),
        (["=1,2"], "two different values"),
        (["a=1,2", "a=3,4"], "given once"),
        (["seed=1,2"], "--seeds"),
        ([f"{k}={','.join(map(str, range(14)))}" for k in "abc"], "at most 2000 points"),
    ],
)
def test_faults(texts, said):
    with pytest.raises(BadInput, match=said):
        knobs_of(texts)
