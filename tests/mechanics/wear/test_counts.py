"""Laws for contacts per area against the numbers that H prints."""

import numpy as np
import pytest

from graben.mechanics.wear.counts import contacts_per_area, doubts

D = np.array([200e-6, 100e-6])


def test_numbers_printed_by_h():
    """H 8.4: 9e7 for 100 um alone; 1.32e7 and 4.93e7 for 70 % of 200 um with 30 % of 100 um."""
    assert contacts_per_area("hoormazdi-2021", D, np.array([0.0, 1.0])).tolist() == pytest.approx([0.0, 9e7])
    assert contacts_per_area("hoormazdi-2021", D, np.array([0.7, 0.3])) == pytest.approx([1.32e7, 4.93e7], rel=2e-3)


def test_order_of_classes_does_not_matter():
    for law in ("hoormazdi-2021", "graben"):
        straight = contacts_per_area(law, D, np.array([0.7, 0.3]))
        turned = contacts_per_area(law, D[::-1], np.array([0.3, 0.7]))
        assert straight.tolist() == turned[::-1].tolist()


def test_equal_sizes_of_h_add_up():
    """At ratio 1 both exponents are 1: two classes of one size count as one."""
    both = contacts_per_area("hoormazdi-2021", np.array([1e-4, 1e-4]), np.array([0.4, 0.6]))
    assert both.sum() == pytest.approx(0.9e8)


def test_our_law():
    assert contacts_per_area("graben", D[:1], np.ones(1)) == pytest.approx([0.98 / 4e-8])
    found = contacts_per_area("graben", D, np.array([0.5, 0.5])) * D**2
    assert found == pytest.approx([0.98 * 0.5**1.33, 0.98 * 0.5**0.63])


def test_doubts_name_the_ratio():
    assert doubts("graben", D, np.array([0.5, 0.5])) == []
    assert doubts("graben", D, np.array([0.0, 1.0])) == []
    assert "ratio" in doubts("graben", np.array([4e-4, 1e-4]), np.array([0.5, 0.5]))[0]


@pytest.mark.parametrize(
    ("law", "diameter", "share", "words"),
    [
        ("none", D, [0.5, 0.5], "unknown law"),
        ("graben", D, [0.5, 0.6], "sum 1"),
        ("graben", D, [1.5, -0.5], ">= 0"),
        ("graben", [-1e-4, 1e-4], [0.5, 0.5], "positive"),
        ("graben", D, [1.0], "one share per class"),
        ("graben", [1e-4, 2e-4, 3e-4], [0.2, 0.3, 0.5], "one or two sizes"),
    ],
)
def test_bad_mixtures(law, diameter, share, words):
    with pytest.raises(ValueError, match=words):
        contacts_per_area(law, np.array(diameter), np.array(share))
