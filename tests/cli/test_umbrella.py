"""`graben` lists every tool, and each answers to --help."""

import pytest
from click.testing import CliRunner

from graben.cli.main import TOOLS, main
from graben.cli.scene import KINDS
from graben.schemas.kinds import SCENES


@pytest.mark.parametrize("name", TOOLS)
def test_each_tool_has_help(name):
    result = CliRunner().invoke(main, [name, "--help"])
    assert result.exit_code == 0, result.output
    assert "Usage:" in result.output


def test_the_umbrella_names_all_tools():
    output = CliRunner().invoke(main, ["--help"]).output
    assert all(name in output for name in TOOLS)
    assert CliRunner().invoke(main, ["no-such-tool"]).exit_code == 2


def test_scene_offers_every_kind():
    assert set(KINDS) == set(SCENES)


@pytest.mark.parametrize("kind", KINDS)
def test_the_printed_template_passes_check(kind, tmp_path):
    runner = CliRunner()
    text = runner.invoke(main, ["scene", kind]).output
    path = tmp_path / "scene.toml"
    path.write_text(text)
    result = runner.invoke(main, ["check", str(path)])
    assert result.exit_code == 0, result.output
