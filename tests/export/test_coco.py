import json

import numpy as np
import pytest
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from riseg_drake.export.coco import CocoExport
from riseg_drake.export.export_error import ExportError
from tests.export.segmented_frames import FRAMES, NOTHING


@pytest.fixture
def file(tmp_path):
    export = CocoExport(tmp_path / "coco")
    for frame in FRAMES:
        export.take(frame)
    assert export.finish() == []
    return tmp_path / "coco" / "annotations.json"


@pytest.mark.filterwarnings("ignore:__array__ implementation")  # pycocotools' own, when it decodes
def test_pycocotools_reads_back_every_mask_to_the_pixel_under_its_id(file):
    coco = COCO(str(file))
    assert [image["file_name"] for image in coco.dataset["images"]] == [frame.name for frame in FRAMES]
    for frame in FRAMES:
        mask = np.zeros_like(frame.mask)
        for annotation in coco.loadAnns(coco.getAnnIds(imgIds=frame.number)):
            mine = coco.annToMask(annotation) > 0
            assert not mask[mine].any()
            mask[mine] = annotation["track_id"]
            assert annotation["area"] == np.count_nonzero(mine)
            assert annotation["score"] == frame.confidence[annotation["track_id"]]
        np.testing.assert_array_equal(mask, frame.mask)
    assert coco.getAnnIds(imgIds=NOTHING) == []


def test_a_box_is_the_first_pixel_and_the_number_of_pixels(file):
    annotation = json.loads(file.read_text())["annotations"][0]
    assert annotation["bbox"] == [10, 5, 20, 15]


def test_the_evaluation_of_coco_finds_every_object_of_the_file_in_itself(file):
    coco = COCO(str(file))
    evaluation = COCOeval(coco, coco.loadRes(coco.dataset["annotations"]), "segm")
    evaluation.evaluate()
    evaluation.accumulate()
    evaluation.summarize()
    assert evaluation.stats[0] == pytest.approx(1.0)


def test_without_pycocotools_one_line_names_the_command_that_brings_it(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pycocotools.mask", None)
    with pytest.raises(
        ExportError, match=r"^--export coco needs pycocotools .* pip install 'riseg-drake\[export\]'$"
    ):
        CocoExport(tmp_path / "coco")
    assert list(tmp_path.iterdir()) == []
