"""Material tables and files: files read back to the same bits, faults are named."""

import pytest

from graben.errors import BadInput
from graben.schemas.scenes.material import MaterialTable, read_material, write_material
from graben.stages.shared.material import pack_material

VALUES = {
    "young_modulus": 1.8e9 / 3,
    "poisson_ratio": 0.2,
    "friction_angle": 0.9,
    "hardening": "table",
    "hardening_table": [[0.0, 1e6 / 3], [0.1, 3e6]],
}


def test_a_file_reads_back_to_the_same_bits(tmp_path):
    path = tmp_path / "a.material.toml"
    write_material(path, "drucker-prager", VALUES, "a note\nof two lines")
    assert read_material(path) == ("drucker-prager", VALUES)
    record, par, values = pack_material(path, "scene.toml")
    assert record.name == "drucker-prager" and values == VALUES and par[0] == VALUES["young_modulus"]


def test_a_table_in_a_scene_takes_units_words_and_percent():
    table = MaterialTable(
        law="drucker-prager",
        parameters={
            "young_modulus": "1.8 GPa", "poisson_ratio": "20 %", "friction_angle": "52 deg", "hardening": "linear",
        },
    )  # fmt: skip
    _record, _par, values = pack_material(table, "scene.toml")
    assert values["young_modulus"] == 1.8e9 and values["poisson_ratio"] == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('law = "granite"\n', ["law", "one of"]),
        ('law = "elastic"\ncolour = 1\n', ["colour"]),
        ('law = "elastic"\n[parameters]\nyoung_modulus = 2e9\n', ["parameters.young_modulus", "quantity in Pa"]),
        ('law = "elastic"\n[parameters]\nyoung_modulus = "2 m"\n', ["parameters.young_modulus", "dimension"]),
        ('law = "elastic"\n[parameters]\nyoung_modulus = "-2 GPa"\npoisson_ratio = 0.2\n', ["young_modulus", "from"]),
        ('law = "elastic"\n[parameters]\nyoung_modulus = "2 GPa"\n', ["poisson_ratio", "required"]),
        ("law = \n", ["valid TOML"]),
    ],
)
def test_faults_name_file_and_key(tmp_path, text, words):
    path = tmp_path / "m.toml"
    path.write_text(text)
    with pytest.raises(BadInput) as error:
        pack_material(path, "scene.toml")
    for word in [str(path), *words]:
        assert word in str(error.value)
