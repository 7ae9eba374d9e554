"""The block models of the tests."""

import importlib.util
from pathlib import Path

import pytest

_SPEC = importlib.util.spec_from_file_location("synthetic_blocks", Path(__file__).with_name("synthetic.py"))
_MODULE = importlib.util.module_from_spec(_SPEC)
import sys  # noqa: E402

sys.modules["synthetic_blocks"] = _MODULE
_SPEC.loader.exec_module(_MODULE)


@pytest.fixture(scope="session")
def synthetic():
    return _MODULE
