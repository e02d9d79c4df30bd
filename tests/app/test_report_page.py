import base64
import re
from html.parser import HTMLParser

import cv2
import numpy as np
import pytest

from riseg_drake.app.report_page import Moment, Report, Table, found_objects, report_html, view
from riseg_drake.pictures.masks import draw_masks
from tests.browser import NO_PROGRAM, dumped


def made(**other):
    color = np.full((240, 320, 3), 90, np.uint8)
    mask, truth = np.zeros((2, 240, 320), np.uint16)
    mask[50:150, 50:200] = 3
    truth[50:150, 50:250] = 1
    content = {
        "title": "a scene & more",
        "facts": [("command", "riseg run '<script>alert(1)</script>'")],
        "ending": "Done: 2 of 2.",
        "views": [view("before", color, 0 * mask, truth), view("after", color, mask, truth, {3: 0.5})],
        "moments": [Moment("Interaction 1", ["pushed: cube"], [0, 1])],
        "objects": found_objects([3, 5], {3: 0.5, 5: 0.97}),
        "doubts": [],
        "tables": [Table("Scores", ("step", "F"), [("1", "99.0")])],
    }
    return report_html(Report(**content | other)), (color, mask, truth)


class Seen(HTMLParser):
    """What a browser makes of a page: tags that are open, all texts, all attributes."""

    def __init__(self, page):
        super().__init__()
        self.open, self.texts, self.attributes, self.tags = [], [], [], []
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.attributes += attributes
        if tag not in ("meta", "link", "input", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


def test_a_page_closes_what_it_opens_and_fetches_nothing():
    page, _ = made()
    seen = Seen(page)
    assert seen.open == []
    addresses = [value for name, value in seen.attributes if name in ("src", "href", "srcset", "action")]
    addresses += re.findall(r"url\(([^)]*)\)", page)
    assert addresses
    assert all(address.startswith("data:") for address in addresses)
    assert "://" not in page
    (policy,) = [value for _, value in seen.attributes if value and value.startswith("default-src")]
    assert policy.startswith("default-src 'none'; img-src data:; ")  # a browser would refuse it, too


def test_every_layer_of_every_picture_is_in_it_once_as_it_was_drawn():
    page, (color, mask, truth) = made()
    layers = re.findall(r"\.v(\d)-(\d) \{ background-image: url\(data:image/jpeg;base64,([^)]*)\)", page)
    assert [(v, k) for v, k, _ in layers] == [(v, k) for v in "01" for k in "012"]
    drawn = draw_masks(color, mask, confidence={3: 0.5})
    for wanted, (*_, content) in zip((color, drawn, draw_masks(color, truth * 3)), layers[3:], strict=True):
        jpeg = cv2.imdecode(np.frombuffer(base64.b64decode(content), np.uint8), cv2.IMREAD_COLOR)
        assert np.abs(jpeg[..., ::-1].astype(int) - wanted).mean() < 4


def test_the_slider_goes_over_as_many_layers_as_there_are():
    page, (color, mask, _) = made()
    assert ("max", "2") in Seen(page).attributes
    untold, _ = made(views=[view("before", color, mask), view("after", color, mask)])
    assert ("max", "1") in [(n, v) for n, v in Seen(untold).attributes if n == "max"]
    assert "truth" not in untold


def test_words_are_words_whatever_they_hold():
    page, _ = made()
    seen = Seen(page)
    assert "riseg run '<script>alert(1)</script>'" in "".join(seen.texts)
    assert "script" not in seen.tags


def test_the_least_sure_object_comes_first_and_is_marked():
    page, _ = made()
    words = re.sub(r"\s+", " ", " ".join(Seen(page).texts))
    assert re.search(r" 3 .*50\.0 %.*, unsure.* 5 .*97\.0 % ", words)
    assert words.count(", unsure") == 1
    assert [each.object_id for each in found_objects([1, 2, 3], {2: 0.9, 3: 0.1})] == [3, 2, 1]


def test_what_not_decided_means_is_said_where_something_is_not():
    words = "was seen in motion alone"
    assert words not in made()[0]
    page, _ = made(objects=found_objects([3, 5], {3: 0.5}))
    assert page.count("<span>not decided</span>") == 1
    assert words in page


def test_a_run_that_saw_nothing_has_a_page_too():
    page, _ = made(views=[], moments=[], objects=[], tables=[])
    assert "No object was found." in page


TRY = """<script>
const slider = document.querySelector('input'), layer = document.querySelectorAll('.view div')[1];
const shown = [1, 0.5, 0].map(value => {
  slider.value = value; slider.dispatchEvent(new Event('input')); return getComputedStyle(layer).opacity;
});
const box = document.querySelector('.view').getBoundingClientRect();
const fits = document.body.scrollWidth <= innerWidth;
document.title = [...shown, (box.width / box.height).toFixed(2), fits].join(' ');
</script></body>"""


@pytest.mark.skipif(bool(NO_PROGRAM), reason=NO_PROGRAM)
@pytest.mark.renders
@pytest.mark.parametrize("width", [1400, 400])
def test_in_a_browser_the_slider_fades_the_masks_and_nothing_is_wrong(tmp_path, width):
    page, _ = made()
    (tmp_path / "page.html").write_text(page.replace("</body>", TRY))
    shown, said = dumped(tmp_path / "page.html", "--enable-logging=stderr", f"--window-size={width},900")
    assert "<title>1 0.5 0 1.33 true</title>" in shown
    assert "CONSOLE" not in said
