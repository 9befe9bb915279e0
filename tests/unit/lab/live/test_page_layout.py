"""What the page shows without scrolling, and what its colours mean, in a browser."""

import json

import cv2
import numpy as np
import pytest

from .page_alone import hello, opened, state

MODELS = ("SA-I vector waves", "vib-TE augmented")
SENSED = ["#camera canvas", "#sa1", "#ra1", "#sa1-scale", "#ra1-scale", "#sound canvas"]
RASTER = ["#spikes canvas"]
FELT = [".felt", ".bars", ".history", "article"]
LEAST_PX = {"#camera canvas": (300, 240), "#sa1": (240, 240), "#ra1": (240, 240)}
BOXES = """names => names.flatMap(name => [...document.querySelectorAll(name)].map(element => {
  const box = element.getBoundingClientRect();
  const hidden = element.scrollHeight - element.clientHeight;
  return [name, box.left, box.top, box.right, box.bottom, hidden];
}))"""


@pytest.fixture
def show(browser):
    """Open pages that have been sent messages; none may have a fault."""
    pages = []

    def show(*messages, size=(1280, 800)):
        pages.append(opened(browser, size, *messages))
        return pages[-1]

    yield show
    for page in pages:
        assert page.faults == []
        page.close()


@pytest.mark.system
@pytest.mark.parametrize("models", [MODELS, ()], ids=["models", "looking"])
@pytest.mark.parametrize("size", [(1280, 800), (1280, 680), (390, 844)], ids=str)
def test_all_is_seen_without_scrolling(show, size, models):
    """Thirteen textures of two models; a screen of 800 lines, in a window, and a telephone."""
    page = show(hello(*models), state(*models), size=size)
    assert page.evaluate("document.documentElement.scrollWidth") <= size[0]
    if size[0] < 1000:
        return  # it scrolls down, and down only
    if size[1] >= 800:
        assert page.evaluate("document.documentElement.scrollHeight") <= size[1]
    boxes = page.evaluate(BOXES, SENSED + RASTER + (FELT if models else []))
    assert len(boxes) == len(SENSED) + 1 + len(FELT) * len(models)
    for name, left, top, right, bottom, hidden in boxes:
        assert left >= 0, name
        assert top >= 0, name
        assert right <= size[0], name
        assert bottom <= size[1], name
        least = LEAST_PX.get(name, (10, 20))
        assert (right - left >= least[0], bottom - top >= least[1]) == (True, True), name
        assert hidden <= 0 or name not in FELT, f"{name} scrolls in itself"
    for i, (name, left, top, right, bottom, _) in enumerate(boxes):
        for other, x, y, until_x, until_y, _ in boxes[:i]:
            apart = left >= until_x or right <= x or top >= until_y or bottom <= y
            assert apart or "article" in (name, other), f"{name} lies on {other}"


@pytest.mark.system
@pytest.mark.parametrize(("named", "name"), [(True, "3 mm"), (False, "3")])
def test_numbers_are_spacings_only_where_a_model_says_so(show, named, name):
    page = show(hello("m", named_by_spacing=named), state("m"))
    assert page.locator(".felt").text_content() == f"{name} 70%, sure after 1.2 s"
    assert name in page.locator(".bars span").all_text_contents()


@pytest.mark.system
def test_no_bar_is_longer_than_a_model_was_found_right(show):
    """Here one sample says 70%; what the touch says comes capped (`ModelSession`)."""
    page = show(hello("m", most_sure=0.6), state("m"))
    widths = page.evaluate("[...document.querySelectorAll('.now')].map(e => e.style.width)")
    assert max(float(width.removesuffix("%")) for width in widths) == pytest.approx(60)


@pytest.mark.system
def test_of_a_hundred_textures_twenty_are_shown_until_all_are_asked_for(show):
    hundred = [str(i) for i in range(100)]
    page = show(hello("m", textures=hundred), state("m", textures=hundred))
    assert page.locator(".bars .track").count() == 20
    page.get_by_role("button", name="All 100").click()
    page.visitor.send(json.dumps(state("m", textures=hundred)))
    page.wait_for_function("document.querySelectorAll('.bars .track').length === 100")


@pytest.mark.system
def test_the_numbers_on_the_bars_are_those_of_the_colours(show, tmp_path):
    """A column of the image holds one value; the bar shows its colour where its numbers say."""
    sa1 = np.tile(np.linspace(0, 6.4, 19), (15, 1))  # a layout that is wider than high
    ra1 = np.tile(np.linspace(0, 1.9, 19), (25, 1))
    page = show(hello(), state(sa1=sa1, ra1=ra1))
    page.screenshot(path=tmp_path / "page.png")
    picture = cv2.imread(str(tmp_path / "page.png")).astype(int)
    for name, image, said in (
        ("sa1", sa1, ["0", "4", "≥ 8 px"]),
        ("ra1", ra1, ["0", "1", "≥ 2 px"]),
    ):
        numbers = page.locator(f"#{name}-scale span").all_text_contents()
        assert numbers == said
        end = float(numbers[-1].removeprefix("≥ ").removesuffix(" px"))
        drawn, bar = (
            page.locator(place).bounding_box() for place in (f"#{name}", f"#{name}-scale")
        )
        assert bar["height"] == pytest.approx(drawn["height"], abs=2)
        across, down = drawn["width"] / 19, drawn["height"] / len(image)
        assert across == pytest.approx(down, rel=0.02)
        for column, value in enumerate(image[0]):
            x = drawn["x"] + (column + 0.5) * drawn["width"] / 19
            of_map = picture[round(drawn["y"] + drawn["height"] / 2), round(x)]
            y = bar["y"] + (1 - value / end) * (bar["height"] - 1)
            of_bar = picture[round(y), round(bar["x"] + bar["width"] / 2)]
            assert np.abs(of_map - of_bar).max() <= 8, (name, value)
        places = page.evaluate(BOXES, [f"#{name}-scale span"])
        for share, (_, _, top, _, bottom, _) in zip((0, 0.5, 1), places, strict=True):
            at = bar["y"] + (1 - share) * bar["height"]
            assert top - 1 <= at <= bottom + 1, "a number lies beside its colour"


@pytest.mark.system
def test_one_marker_that_jumps_does_not_set_the_scale(show):
    sa1 = np.full((19, 19), 2.9)
    sa1[3, 4] = 80.0
    page = show(hello(), state(sa1=sa1, ra1=0.01 * sa1))
    said = [page.locator(f"#{name}-scale span").last.text_content() for name in ("sa1", "ra1")]
    assert said == ["≥ 3 px", "≥ 0.3 px"], "noise fills no scale either"


ALPHA = """([row, column]) => {
  const canvas = document.querySelector("#sa1"), side = canvas.width / 19;
  const at = [(column + 0.1) * side, (row + 0.5) * side, 1, 1];
  return canvas.getContext("2d").getImageData(...at).data[3];
}"""


@pytest.mark.system
def test_where_no_marker_is_seen_there_is_no_colour_of_the_scale(show):
    sa1 = np.full((19, 19), 3.0)
    sa1[0, 0], sa1[5, 6] = np.nan, -1  # none belongs there; one is lost
    sent = state(sa1=sa1)
    sent["video"]["sa1"][0][0] = None
    page = show(hello(), sent)
    alphas = [page.evaluate(ALPHA, place) for place in ([0, 0], [5, 6], [5, 7])]
    assert alphas == [0, 0, 255]
    cross = ALPHA.replace("0.1", "0.5")
    assert page.evaluate(cross, [5, 6]) == 255, "the cross of a lost marker"
    assert page.evaluate(cross, [0, 0]) == 0


@pytest.mark.system
def test_what_can_not_be_played_again_is_not_offered(show):
    """What can is played in `test_a_recording_that_has_ended_is_played_again`."""
    page = show(hello(), state())
    page.visitor.send(json.dumps(state() | {"ended": "the source has ended", "repeats": False}))
    page.wait_for_function("document.querySelector('#link').textContent.includes('ended')")
    assert not page.get_by_role("button", name="Play again").is_visible()
