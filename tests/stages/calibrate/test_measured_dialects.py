"""One triaxial test in the spellings of laboratories: the same curve to the bit, or a named fault."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graben.errors import BadInput
from graben.stages.calibrate.measured import Reading, read_files, read_measured

PLAIN = ["name", "time_s", "stress_yy_kpa", "stress_xx_kpa", "strain_yy_percent", "strain_xx_percent"]
SPOKEN = ["Specimen", "Time [s]", "Axial stress (kPa)", "Cell pressure [kPa]", "axial strain, %", "Radial strain [%]"]
BARE = ["Test ID", "Time", "axial stress", "lateral stress", "axial strain", "lateral strain"]
UNITS = ["-", "[s]", "kPa", "[kPa]", "%", "[%]"]
COMPRESSION = Reading("triaxial", "compression-positive")


def rows(steps=12):
    """Two tests of one rock, stresses in kPa, strains in percent, compression positive."""
    out = []
    for name, cell in (("R 1", 1200.5), ("R 2", 2400.25)):
        for i in range(steps):
            push = 1234.5 * i
            out.append([name, 30.0 * i, cell + push, cell, 0.0625 * i, -0.015625 * i * (1 + 0.1 * i)])
    return out


def spell(cell, mark):
    return cell if isinstance(cell, str) else f"{cell:.9f}".replace(".", mark)


def text(
    titles=PLAIN,
    separator=",",
    mark=".",
    eol="\n",
    before=(),
    units=None,
    tail="",
    empty=0,
    comments=False,
    data=None,
):
    quoted = [f'"{t}"' if separator in t or (separator == " " and " " in t) else t for t in titles]
    lines = [*before, separator.join(quoted) + tail]
    if units:
        lines.append(separator.join(units) + tail)
    for i, row in enumerate(rows() if data is None else data):
        cells = [spell(c, mark) for c in row]
        lines.append(separator.join(f'"{c}"' if separator in c else c for c in cells) + tail)
        if empty and i % empty == 0:
            lines.append(separator * (len(row) - 1) if separator != " " else "")
        if comments and i == 3:
            lines.append("# valve moved, 3 kPa")
    return eol.join(lines) + eol


def put(folder, content, encoding="utf-8", name="lab.csv"):
    path = folder / name
    path.write_bytes(content.encode(encoding))
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("dialects")


@pytest.fixture(scope="module")
def wanted(folder):
    return read_measured([put(folder, text(), name="wanted.csv")], COMPRESSION)


def same(curves, wanted):
    assert [c.name for c in curves] == [c.name for c in wanted] == ["R 1", "R 2"]
    for one, other in zip(curves, wanted, strict=True):
        np.testing.assert_array_equal(one.stress, other.stress)
        np.testing.assert_array_equal(one.strain, other.strain)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(data=st.data())
def test_one_curve_in_any_spelling_is_one_curve(folder, wanted, data):
    separator = data.draw(st.sampled_from([",", ";", "\t", "|", " ", "   "]))
    mark = data.draw(st.sampled_from(".," if separator != "," else "."))
    titles, units = data.draw(st.sampled_from([(PLAIN, None), (SPOKEN, None), (BARE, UNITS), (PLAIN, UNITS)]))
    blanks = separator.strip(" ") == ""
    if blanks:
        titles = PLAIN
    encoding = data.draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252"]))
    content = text(
        titles,
        " " if blanks else separator,
        mark,
        data.draw(st.sampled_from(["\n", "\r\n", "\r"])),
        data.draw(
            st.sampled_from([(), ("Date: 12.03.2024", "Prüfer; 2", 'Specimen: "R-17", 50 x 100 mm', "", "sep=;")])
        ),
        units,
        "" if blanks else data.draw(st.sampled_from(["", separator, separator * 2])),
        data.draw(st.sampled_from([0, 5])),
        data.draw(st.booleans()),
    )
    if blanks:
        content = content.replace(" ", separator).replace(f"R{separator}", "R ")
    same(read_measured([put(folder, content, encoding)], COMPRESSION), wanted)


def test_what_was_found_out_is_reported(tmp_path, caplog):
    caplog.set_level("INFO")
    content = text(BARE, ";", ",", "\r\n", ("Labor für Fels", ""), UNITS, ";", 6, True)
    (part,) = read_files([put(tmp_path, content, "cp1252")], COMPRESSION)
    assert part.read | {
        "encoding": "cp1252", "line_ends": "CRLF", "separator": "semicolon", "decimal_mark": "comma",
        "preamble_rows": 2, "header_row": 3, "units_row": 4, "rows": 24, "empty_rows": 4, "comment_rows": 1,
        "dropped_rows": 0, "ignored_columns": [],
    } == part.read  # fmt: skip
    assert "separator semicolon, decimal mark comma, header in row 3, units in row 4, 24 rows" in caplog.text
    assert part.read["columns"]["strain_xx"] == "lateral strain"
    assert [t["name"] for t in part.read["tests"]] == ["R 1", "R 2"]
    assert part.read["tests"][1]["lateral_stress_pa"] == pytest.approx(-2400250.0)


@pytest.mark.parametrize(
    ("stress", "strain", "push", "share"),
    [
        ("MPa", "%", 1e6, 1e-2), ("N/mm²", "mm/mm", 1e6, 1.0), ("GPa", "microstrain", 1e9, 1e-6),
        ("kN/m2", "‰", 1e3, 1e-3),
        ("bar", "µm/m", 1e5, 1e-6), ("Pa", "-", 1.0, 1.0), ("mpa", "percent", 1e6, 1e-2), ("kPa", "µε", 1e3, 1e-6),
    ],
)  # fmt: skip
@pytest.mark.parametrize("below", [False, True])
def test_units_in_titles_and_below_them(tmp_path, wanted, stress, strain, push, share, below):
    units = ["", "s", stress, stress, strain, strain]
    scale = [None, 1.0, 1e3 / push, 1e3 / push, 1e-2 / share, 1e-2 / share]
    data = [[c if f is None else f"{c * f:.17g}" for c, f in zip(r, scale, strict=True)] for r in rows()]
    titles = BARE if below else [f"{t} [{u}]" if u else t for t, u in zip(BARE, units, strict=True)]
    content = text(titles, "\t", units=["", "s", *units[2:]] if below else None, data=data)
    for one, other in zip(read_measured([put(tmp_path, content)], COMPRESSION), wanted, strict=True):
        np.testing.assert_allclose(one.stress, other.stress, rtol=1e-12)
        np.testing.assert_allclose(one.strain, other.strain, rtol=1e-12, atol=1e-17)


def test_columns_in_another_order_and_others_left_out(tmp_path, wanted):
    order = [4, 0, 5, 2, 1, 3]
    titles = [*(PLAIN[k] for k in order), "Load [kN]", "", "remark"]
    data = [[*(r[k] for k in order), 3.5, "", "ok"] for r in rows()]
    (part,) = read_files([put(tmp_path, text(titles, data=data))], COMPRESSION)
    same(part.curves, wanted)
    assert part.read["ignored_columns"] == ["Load [kN]", "remark"]


def test_a_commented_header_and_exponents(tmp_path, wanted):
    data = [[c if isinstance(c, str) else f"{c:.12e}".replace(".", ",").upper() for c in r] for r in rows()]
    content = "# " + text(separator=";", data=data)
    same(read_measured([put(tmp_path, content)], COMPRESSION), wanted)


def test_quoted_decimal_commas_between_commas(tmp_path, wanted):
    (part,) = read_files([put(tmp_path, text(mark=","))], COMPRESSION)
    same(part.curves, wanted)
    assert (part.read["separator"], part.read["decimal_mark"]) == ("comma", "comma")


def test_a_title_over_two_lines_and_an_index_without_title(tmp_path, wanted):
    data = [[f"{i}", *r] for i, r in enumerate(rows())]
    content = text(["", *PLAIN], data=data).replace("stress_yy_kpa", '"Axial stress\n[kPa]"')
    (part,) = read_files([put(tmp_path, content)], COMPRESSION)
    same(part.curves, wanted)
    assert part.read["header_row"] == 2 and part.read["ignored_columns"] == ["(column 1)"]


def faults(folder, content, encoding="utf-8", reading=COMPRESSION, name="lab.csv"):
    path = put(folder, content, encoding, name) if isinstance(content, str) else folder / name
    if isinstance(content, bytes):
        path.write_bytes(content)
    with pytest.raises(BadInput) as error:
        read_measured([path], reading)
    assert str(path) in str(error.value)
    return str(error.value)


def changed(row, column, cell):
    data = rows()
    data[row][column] = cell
    return data


@pytest.mark.parametrize(
    ("content", "texts"),
    [
        (text(data=changed(5, 2, "abc")), ["row 7", "stress_yy_kpa", "'abc'", "a number"]),
        (text(data=changed(5, 2, "1_000.5")), ["row 7", "a number"]),
        (text(data=changed(5, 2, "inf")), ["row 7", "a number"]),
        (text(data=changed(5, 2, "1e999")), ["row 7", "finite"]),
        (text(separator=";", data=changed(5, 2, "7 372.500")), ["row 7", "thousands"]),
        (text(separator=";", data=changed(5, 2, "7,372.50")), ["row 7", "thousands"]),
        (text(separator=";", data=changed(5, 2, "7'372.5")), ["row 7", "thousands"]),
        (text(separator=";", mark=",", data=changed(5, 2, "7.372,50")), ["row 7", "thousands"]),
        (text(separator=";", data=changed(5, 2, "7372,55")), ["row 7", "one decimal mark", "'7372,55'"]),
        (text(mark=",").replace('"', ""), ["row 2", "cells", "decimal comma", "semicolons"]),
        (text([*PLAIN[:4], "strain_yy_percent", "strain_yy_1"]), ["strain_yy_1", "means strain_yy", "leave one out"]),
        (text([*PLAIN[:5], "Radial strain [psi]"]), ["Radial strain [psi]", "'psi'", "microstrain"]),
        (text([*PLAIN[:2], "stress_yy [mPa]", *PLAIN[3:]]), ["'mPa'", "MPa"]),
        (text(units=["-", "[s]", "MPa", "[kPa]", "%", "%"]), ["stress_yy_kpa", "MPa below it", "one unit"]),
        (text(BARE, ";"), ["axial stress", "a unit"]),
        (text(["name", "Load [kN]", *PLAIN[2:4], "displacement_mm", "strain_xx_percent"]), ["strain_yy", "(absent)"]),
        (text(data=changed(5, 0, "")), ["row 7", "name", "in each row"]),
        ("a,b,c\n1,2,3\n", ["header", "stress_yy_mpa"]),
        ("\n \n", ["empty"]),
        (",".join(PLAIN) + "\n", ["no rows"]),
        (b"PK\x03\x04 and more", ["spreadsheet", "export it as CSV"]),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", ["spreadsheet", "export it as CSV"]),
        (bytes(range(256)) * 4, ["export it as CSV"]),
        (b"\xff\xfea", ["export it as CSV"]),
        (b"name\x81,\x8f", ["utf-8 nor cp1252"]),
    ],
)
def test_what_cannot_be_read_says_where_and_what_to_do(tmp_path, content, texts):
    message = faults(tmp_path, content)
    for part in texts:
        assert part in message


def test_a_number_of_two_meanings_is_refused_with_both(tmp_path):
    titles = ["time_s", "stress_yy_kpa", "stress_xx_kpa", "strain_yy_percent", "strain_xx_percent"]
    data = [
        ["1", "1,500", "1,250", "1", "-1"],
        ["2", "2,500", "1,250", "2", "-1"],
        ["3", "3,500", "1,250", "3", "-1"],
    ]
    message = faults(tmp_path, text(titles, ";", data=data))
    assert "row 2" in message and "1.500 or 1500" in message
    data[2][3] = "3,25"  # one proof, and all are decimal
    (curve,) = read_measured([put(tmp_path, text(titles, ";", data=data))], COMPRESSION)
    assert curve.stress[:, 1].tolist() == [-1500.0, -2500.0, -3500.0]


@pytest.mark.parametrize("word", ["", "nan", "NaN", "-", "n/a", "NA", "#N/A", "#DIV/0!"])
def test_a_row_without_a_number_is_left_out_and_counted(tmp_path, word, caplog):
    (part,) = read_files([put(tmp_path, text(data=changed(5, 2, word)))], COMPRESSION)
    assert part.read["dropped_rows"] == 1 and [len(c.stress) for c in part.curves] == [11, 12]
    assert "left out 1 rows" in caplog.text
    data = changed(5, 2, word)
    data[7][4] = word
    message = faults(tmp_path, text(data=data))
    assert "curve R 1, row 7, stress_yy_kpa" in message and "row 9, strain_yy_percent" in message
    assert "2 of 12 rows" in message


def test_a_row_that_begins_with_an_error_of_a_spreadsheet_is_no_comment(tmp_path):
    titles = ["stress_yy_kpa", "stress_xx_kpa", "strain_yy_percent", "strain_xx_percent"]
    data = [[1200.5 + i, 1200.5, 0.5 * i, -0.1 * i] for i in range(12)]
    data[4][0] = "#N/A"
    (part,) = read_files([put(tmp_path, text(titles, data=data))], COMPRESSION)
    assert part.read["comment_rows"] == 0 and part.read["dropped_rows"] == 1
    data[5][0] = data[6][0] = "#VALUE!"
    assert "3 of 12 rows" in faults(tmp_path, text(titles, data=data))


def test_a_strain_without_a_unit_that_may_be_in_percent_is_told(tmp_path, caplog):
    titles = ["stress_yy_kpa", "stress_xx_kpa", "strain_yy", "strain_xx"]
    data = [[1200.5 + i, 1200.5, 0.03 * i, -0.001 * i] for i in range(12)]
    (part,) = read_files([put(tmp_path, text(titles, data=data))], COMPRESSION)
    assert part.read["strains_without_unit"] == pytest.approx({"strain_yy": 0.33, "strain_xx": 0.011})
    assert "strain_yy has no unit and is read as a fraction, up to 0.33 (33 %)" in caplog.text
    assert "strain_xx has no unit" not in caplog.text


def test_a_row_said_twice_counts_once(tmp_path, wanted):
    data = rows()
    data.insert(4, list(data[3]))
    (part,) = read_files([put(tmp_path, text(data=data))], COMPRESSION)
    same(part.curves, wanted)
    assert part.read["repeated_rows"] == 1


def test_strain_in_percent_without_a_unit_is_not_taken_for_a_fraction(tmp_path):
    titles = [*PLAIN[:4], "strain_yy", "strain_xx"]
    message = faults(tmp_path, text(titles))
    assert "up to 0.6875 without a unit" in message and "strain_yy_percent" in message


@pytest.mark.parametrize(
    ("turned", "sign", "texts"),
    [
        ((), "tension-positive", ["compression-positive"]),
        ((2, 3, 4, 5), "compression-positive", ["sign"]),
        ((4, 5), "compression-positive", ["strain_yy, sign", "goes with its stress"]),
        ((4, 5, 2, 3), "tension-positive", None),
        ((5,), "compression-positive", ["strain_xx, sign", "allow_narrowing"]),
        ((2, 3), "tension-positive", ["strain_yy, sign"]),
    ],
)
def test_signs_that_contradict_the_data_are_refused(tmp_path, wanted, turned, sign, texts):
    data = [[-c if k in turned else c for k, c in enumerate(r)] for r in rows()]
    reading = Reading("triaxial", sign)
    if texts is None:
        same(read_measured([put(tmp_path, text(data=data))], reading), wanted)
        return
    message = faults(tmp_path, text(data=data), reading=reading)
    for part in texts:
        assert part in message


def test_a_specimen_that_narrows_is_read_when_it_is_said(tmp_path):
    data = [[*r[:5], -r[5]] for r in rows()]
    curves = read_measured(
        [put(tmp_path, text(data=data))], Reading("triaxial", "compression-positive", allow_narrowing=True)
    )
    assert curves[0].strain[-1, 0] < 0.0
