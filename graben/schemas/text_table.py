"""Tables of text as laboratories and spreadsheets write them: encoding, line ends, separator and header are found.

Nothing is taken from statistics. The header is the line with the most titles that the caller understands, and the
separator is the one that splits it so; the rest of the file has to fit.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from graben.errors import BadInput, Fault
from graben.schemas.reading import read_bytes

SEPARATORS = {",": "comma", ";": "semicolon", "\t": "tab", "|": "pipe", " ": "blanks"}
_SEARCHED = 500  # lines in which the header must stand
_LARGEST = 256 * 2**20  # bytes
_SHOWN = 5  # faults of one kind
SPREADSHEET = ("#n/a", "#na", "#nv", "#div/0!", "#value!", "#wert!", "#ref!", "#num!", "#zahl!", "#name?", "#null!")
_FOREIGN = (
    (b"PK\x03\x04", "a spreadsheet or another packed file"),
    (b"\xd0\xcf\x11\xe0", "an old spreadsheet or document"),
    (b"\x89HDF", "HDF5 or NetCDF without the ending .nc"),
    (b"CDF", "NetCDF without the ending .nc"),
    (b"%PDF", "PDF"),
    (b"\x1f\x8b", "packed by gzip"),
)
_MARKS = (
    (b"\xff\xfe\x00\x00", "utf-32"),
    (b"\x00\x00\xfe\xff", "utf-32"),
    (b"\xef\xbb\xbf", "utf-8-sig"),
    (b"\xff\xfe", "utf-16"),
    (b"\xfe\xff", "utf-16"),
)


@dataclass(frozen=True)
class TextTable:
    """titles of the columns; rows: (line number in the file, one cell per title), none of them empty; and how the
    file was read."""

    titles: list[str]
    rows: list[tuple[int, list[str]]]
    encoding: str
    line_ends: str
    separator: str
    header_row: int
    preamble_rows: int
    comment_rows: int
    empty_rows: int


def read_text_table(path: Path, understood: Callable[[str], bool], expected: str) -> TextTable:
    """The table of a text file.

    Lines that begin with # are comments; the header may be one. Cells beyond the last title must be empty.

    Parameters
    ----------
    understood : whether a title is one of those the caller knows
    expected : the titles to expect, for the message where there is no header

    Raises
    ------
    BadInput : no readable text, no header, or rows whose cells do not fit the header
    """
    text, encoding = _decoded(path)
    ends = {"CRLF": text.count("\r\n")}
    ends["CR"], ends["LF"] = text.count("\r") - ends["CRLF"], text.count("\n") - ends["CRLF"]
    kinds = [k for k, n in ends.items() if n] or ["none"]
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if not any(line.strip() for line in lines):
        raise BadInput(Fault(str(path), "", "empty", "a header and rows"))
    found = _header(lines, understood)
    if found is None:
        first = next(line for line in lines if line.strip())
        raise BadInput(
            Fault(str(path), "header", repr(first[:80]), f"titles such as {expected} in one of the first lines")
        )
    at, separator, titles = found
    width = len(titles)
    comments = [_is_comment(line) for line in lines]
    body = ["" if comment or i < at else line for i, (line, comment) in enumerate(zip(lines, comments, strict=True))]
    body[at] = lines[at].lstrip().lstrip("#")
    reader = _split(body[at:], separator)
    rows, faults, wrong = [], [], 0
    next(reader)
    first_row, empty = at + reader.line_num, 0
    try:
        for cells in reader:
            number = at + reader.line_num
            cells = [c.strip() for c in cells]
            if not any(cells):
                empty += 0 if comments[number - 1] else 1
                continue
            if any(cells[width:]) or len(cells) < width:
                wrong += 1
                if wrong <= _SHOWN:
                    comma = separator == "," and len(cells) > width
                    cure = " (a decimal comma? then separate by semicolons, or write points)" if comma else ""
                    faults.append(Fault(str(path), f"row {number}", f"{len(cells)} cells", f"{width} cells{cure}"))
                continue
            rows.append((number, cells[:width]))
    except csv.Error as error:
        faults.append(Fault(str(path), f"row {at + reader.line_num}", "", f"a row of a table ({error})"))
    if wrong > _SHOWN:
        faults.append(Fault(str(path), "rows", f"{wrong - _SHOWN} more", f"{width} cells, as the header"))
    if faults:
        raise BadInput(faults)
    if body[-1] == "" and not comments[-1] and empty:
        empty -= 1  # what follows the last line end is no row
    return TextTable(
        titles, rows, encoding, " and ".join(kinds), SEPARATORS[separator], first_row, at - sum(comments[:at]),
        sum(comments) - comments[at], empty,
    )  # fmt: skip


def _is_comment(line: str) -> bool:
    """Lines that begin with #, but not with a word that a spreadsheet writes where a number is missing."""
    text = line.lstrip().lower()
    return text.startswith("#") and not text.startswith(SPREADSHEET)


def _decoded(path: Path) -> tuple[str, str]:
    """The text and its encoding: what a byte order mark says; else UTF-16 if every other byte is zero; else UTF-8;
    else cp1252, the encoding of western Windows."""

    def refused(found: str, expected: str) -> BadInput:
        return BadInput(Fault(str(path), "", found, expected))

    data = read_bytes(path, "table of text", _LARGEST)
    for magic, what in _FOREIGN:
        if data.startswith(magic):
            raise refused(what, "text: export it as CSV")
    encoding = next((name for mark, name in _MARKS if data.startswith(mark)), None)
    if encoding is None:
        head = data[: min(len(data), 4096) & ~1]
        even, odd = head[::2].count(0), head[1::2].count(0)
        if odd > 0.8 * (len(head) // 2) and even == 0:
            encoding = "utf-16-le"
        elif even > 0.8 * (len(head) // 2) and odd == 0:
            encoding = "utf-16-be"
    for name in [encoding] if encoding else ["utf-8", "cp1252"]:
        try:
            text = data.decode(name).lstrip("\ufeff")
            break
        except UnicodeDecodeError:
            continue
    else:
        tried = encoding or "neither utf-8 nor cp1252"
        raise refused(f"not text ({tried})", "text in UTF-8, UTF-16 or cp1252: export it as CSV")
    if any(c < " " and c not in "\t\n\r\f\v" for c in set(text)):
        raise refused("binary", "text: export it as CSV")
    label = {"utf-8-sig": "utf-8 with mark"}.get(name, name)
    if name == "utf-16":
        label = "utf-16-le with mark" if data[0] == 0xFF else "utf-16-be with mark"
    return text, label


def _split(lines: list[str], separator: str) -> csv._reader:  # type: ignore[name-defined]
    """Cells of lines; blanks of any number and kind count as one separator."""
    if separator == " ":
        lines = [" ".join(line.split()) for line in lines]
    return csv.reader((line + "\n" for line in lines), delimiter=separator, skipinitialspace=True)


def _header(lines: list[str], understood: Callable[[str], bool]) -> tuple[int, str, list[str]] | None:
    """Line, separator and titles of the line with most understood titles, at least two; the first of equals. Comments
    count where no other line does."""
    for commented in (False, True):
        best, found = 1, None
        for i, line in enumerate(lines[:_SEARCHED]):
            bare = line.lstrip()
            if _is_comment(line) != commented or not bare:
                continue
            for separator in SEPARATORS:
                # a title in quotes may run over lines
                start = [bare.lstrip("#"), *lines[i + 1 : i + 20]]
                try:
                    titles = [" ".join(c.split()) for c in next(_split(start, separator))]
                except csv.Error:
                    continue
                score = sum(map(understood, titles))
                if score > best:
                    best, found = score, (i, separator, titles)
        if found is not None:
            at, separator, titles = found
            while not titles[-1]:
                titles.pop()
            return at, separator, titles
    return None
