"""ff.render and what notebooks show."""

import numpy as np
import pytest

import filiform as ff


@pytest.fixture(scope="module", autouse=True)
def graphics(column):
    with ff.open(column) as opened:
        try:
            ff.render(opened, size=(16, 16))
        except (ImportError, RuntimeError) as error:
            pytest.skip(f"no OpenGL here: {error}")


def test_a_set_and_a_cell_are_drawn(s):
    image = ff.render(s, size=(320, 200))
    assert image.shape == (200, 320, 3) and image.dtype == np.uint8
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 50
    cell = ff.render(s.cells.at(0), size=(320, 200))
    assert (cell != image).any()
    np.testing.assert_array_equal(s.render(size=(320, 200)), image)


@pytest.mark.parametrize("options", [
    dict(camera="top"), dict(camera=(30, 20)), dict(camera=[[0, 0, 3000], [0, 0, 0]]), dict(colour_by="type"),
    dict(orthographic=True), dict(highlight="cell_00001"), dict(proxy=[0, 700, 0], zoom=100), dict(box=[[0, 0, 0], [100, 100, 100]])])
def test_options_change_the_picture(s, options):
    plain = ff.render(s, size=(160, 100))
    assert (ff.render(s, size=(160, 100), **options) != plain).any()


@pytest.mark.parametrize("wrong, error", [
    (dict(size=(0, 10)), ValueError), (dict(size=(10, 10**6)), ValueError), (dict(size=10), ValueError),
    (dict(camera="behind"), ValueError), (dict(camera=[1, 2, 3]), ValueError), (dict(box=[0, 0, 0]), ValueError),
    (dict(proxy=[0, 0]), ValueError), (dict(zoom=-1), ValueError), (dict(colour_by="mood"), ValueError),
    (dict(highlight="nobody"), KeyError), (dict(segments=0), ValueError), (dict(size=("a", "b")), TypeError)])
def test_wrong_options_are_refused(s, wrong, error):
    with pytest.raises(error):
        ff.render(s, **wrong)


def test_notebooks_show_sets_and_cells(s):
    for shown in (s, s.cells.at(0)):
        png = shown._repr_png_()
        assert png.startswith(b"\x89PNG\r\n\x1a\n")
    assert "<table>" in s.cells.find("*")._repr_html_()
    s.close()
    assert s._repr_png_() is None


def test_png_reads_back(tmp_path):
    image = pytest.importorskip("matplotlib.image", reason="needs python3-matplotlib")
    from filiform.png import encode
    wanted = np.random.default_rng(3).integers(0, 256, (31, 17, 3), dtype=np.uint8)
    (tmp_path / "a.png").write_bytes(encode(wanted))
    np.testing.assert_array_equal(np.round(image.imread(tmp_path / "a.png") * 255).astype(np.uint8), wanted)
