"""graben show and graben report: pictures of artifacts, and one page of a folder of them."""

import pytest

from graben.errors import BadInput
from graben.stages.tools import picture, report


@pytest.fixture
def folder(small_blocks, small_curves, small_bed, tmp_path):
    for path in (small_blocks, small_curves, small_bed):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    return tmp_path


@pytest.mark.parametrize(("suffix", "magic"), [(".png", b"\x89PNG"), (".pdf", b"%PDF"), (".svg", b"<?xml")])
def test_pictures_in_each_format(folder, suffix, magic):
    output = folder / f"bed{suffix}"
    picture.run(folder / "bed.nc", output)
    assert output.read_bytes().startswith(magic)
    with pytest.raises(BadInput, match="overwrite"):
        picture.run(folder / "bed.nc", output)


def test_one_page_holds_every_artifact_and_needs_no_other_file(folder):
    page = folder / "page.html"
    assert report.run(folder, page)["artifacts"] == 3
    text = page.read_text()
    assert text.count("data:image/png;base64,") == 3
    assert 'src="http' not in text and "href=" not in text
    assert "energy_error" in text  # the cost record
    assert "SHA-256" in text  # the inputs of the averages
    assert "[tessellation]" in text  # the scene as it was run


def test_a_faulty_artifact_is_named_and_no_page_is_written(folder):
    (folder / "worse.nc").write_bytes(b"nothing")
    with pytest.raises(BadInput, match=r"worse\.nc"):
        report.run(folder, folder / "page.html")
    assert not (folder / "page.html").exists()


def test_numbers_that_another_program_wrote_and_that_cannot_be_drawn_are_bad_input(folder, monkeypatch):
    import xarray

    from graben.stages.tools.show import curves

    def fails(*arguments):
        raise IndexError("index -1 is out of bounds")

    with xarray.open_dataset(folder / "curves.nc", decode_times=False) as data:
        data = data.load()
    del data.attrs["content_sha256"]
    data.to_netcdf(folder / "edited.nc")
    picture.run(folder / "edited.nc", folder / "edited.png")
    monkeypatch.setattr(curves, "draw", fails)
    with pytest.raises(BadInput, match=r"edited\.nc: .*another program"):
        picture.run(folder / "edited.nc", folder / "other.png")
    with pytest.raises(IndexError):  # a fault of the program
        picture.run(folder / "curves.nc", folder / "other.png")
    assert not (folder / "other.png").exists()
