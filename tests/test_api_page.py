"""docs/api.md says what the docstrings say, and every public name has one."""

import importlib.util
import inspect
from pathlib import Path

import pytest

import graben

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def maker():
    spec = importlib.util.spec_from_file_location("make_api", ROOT / "docs" / "make_api.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_is_up_to_date(maker):
    assert (ROOT / "docs" / "api.md").read_text(encoding="utf-8") == maker.page(), "run python docs/make_api.py"


def test_every_argument_of_a_public_function_is_described():
    for name in graben.__all__:
        thing = getattr(graben, name)
        if inspect.isfunction(thing):
            text = inspect.getdoc(thing)
            assert "BadInput" in text or name in ("laws", "check"), name
            absent = [p for p in inspect.signature(thing).parameters if f"{p}" not in text.split("\n", 1)[-1]]
            assert not absent or "as in `graben.scene`" in text, (name, absent)
