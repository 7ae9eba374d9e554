"""Every scene that the repository ships passes its own check."""

import pytest

from graben.stages.tools.check import check
from tests.conftest import PIPELINES

STUDIES = PIPELINES / "tradeoffs" / "studies.toml"
SCENES = sorted(set(PIPELINES.glob("*/*.toml")) - {STUDIES})


def test_the_scenes_of_the_contract_are_there():
    names = {str(p.relative_to(PIPELINES)) for p in SCENES}
    assert {
        "upscaling/voronoi-granite.toml",
        "upscaling/calibrate-udec.toml",
        "upscaling/slope.toml",
        "wear/bed.toml",
        "wear/scratch.toml",
        "wear/astm-g65-mixtures.toml",
    } <= names


@pytest.mark.parametrize("scene", SCENES, ids=lambda p: p.stem)
def test_shipped_scenes_have_no_fault(scene):
    assert check(scene) == []
