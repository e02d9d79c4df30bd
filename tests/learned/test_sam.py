"""The real classes of transformers with random weights: places, shapes, batches, folders."""

import json
import shutil

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="SAM needs torch (pip install 'riseg-drake[sam]')")
pytest.importorskip("transformers", reason="SAM needs transformers (pip install 'riseg-drake[sam]')")

from riseg_drake.learned.everything import EverythingParameters, segment_everything  # noqa: E402
from riseg_drake.learned.model_error import ModelError  # noqa: E402
from riseg_drake.learned.outlines import OutlineParameters, refine_outlines  # noqa: E402
from riseg_drake.learned.prompts import Prompt, prompt_of_mask  # noqa: E402
from riseg_drake.learned.sam import SamSegmenter, load_sam  # noqa: E402
from tests.learned.tiny_sam import PATCH, SIDE, tiny_sam, tiny_sam2  # noqa: E402
from tests.segmentation.drawn_scene import DrawnScene, looking_down, planar  # noqa: E402

MODELS = {"sam": tiny_sam, "sam2": tiny_sam2}
SIZES = [(48, 64), (96, 128), (300, 200)]


@pytest.fixture(scope="module", params=MODELS)
def model(request):
    return MODELS[request.param]().eval()


@pytest.fixture(scope="module")
def segmenter(model):
    return SamSegmenter(model, device="cpu", batch=4)


@pytest.mark.parametrize("size", SIZES)
def test_a_point_at_the_middle_of_a_patch_is_encoded_as_that_patch_is(model, segmenter, size):
    # The models encode places of prompts and of patches by the same function, so equal codes are equal places.
    scaling = segmenter.scaling(*size)
    codes = model.get_image_wide_positional_embeddings()[0]
    for row, column in ((0, 0), (1, 3), (2, 1)):
        in_square = np.array([column, row]) * PATCH + PATCH / 2  # from the square's corner
        uv = in_square * np.array(size[::-1]) / np.array(scaling.scaled[::-1]) - 0.5  # pixels of the image
        inputs = segmenter.inputs([Prompt(uv[None])], scaling)
        sparse, _ = model.get_prompt_embeddings(**inputs)
        kind = model.prompt_encoder.point_embed
        is_object = kind[1].weight[0] if isinstance(kind, torch.nn.ModuleList) else kind.weight[1]
        # Single precision leaves 1e-5, another on each processor; a hundredth of a pixel would be 1e-3.
        torch.testing.assert_close(sparse[0, 0, 0] - is_object, codes[:, row, column], rtol=0, atol=1e-4)


@pytest.mark.parametrize("size", SIZES)
def test_what_is_seen_at_a_pixel_lies_where_a_prompt_for_it_goes(segmenter, size):
    scaling = segmenter.scaling(*size)
    v, u = np.mgrid[: size[0], : size[1]]
    for at in ((0.4, 0.3), (0.7, 0.6)):
        spot = np.array(at) * size[::-1]
        light = 255 * np.exp(-((u - spot[0]) ** 2 + (v - spot[1]) ** 2) / (2 * 6.0**2))
        square = segmenter.pixels(np.repeat(light[..., None], 3, axis=2).astype(np.uint8), scaling)[
            0, 0
        ].numpy()
        square = square[: scaling.scaled[0], : scaling.scaled[1]]
        weight = square - square.min()
        rows, columns = np.mgrid[: square.shape[0], : square.shape[1]]
        centre = [(weight * columns).sum() / weight.sum(), (weight * rows).sum() / weight.sum()]
        np.testing.assert_allclose(centre, scaling.uv(spot), rtol=0, atol=0.25)


@pytest.mark.parametrize("size", SIZES)
def test_an_answer_comes_back_to_the_pixels_that_it_is_about(segmenter, size):
    scaling = segmenter.scaling(*size)
    resolution = SIDE // 4
    v, u = np.mgrid[:resolution, :resolution]
    spot = np.array([0.55, 0.5]) * size[::-1]
    low = (scaling.uv(spot) + 0.5) * resolution / SIDE - 0.5  # where it is in the model's coarse answer
    blob = 5.0 - np.hypot(u - low[0], v - low[1]).astype(np.float32)
    back = scaling.from_square(blob)
    assert back.shape == size
    v_peak, u_peak = np.unravel_index(back.argmax(), size)
    step = np.array(size[::-1]) / np.array(scaling.scaled[::-1]) * SIDE / resolution
    assert (np.abs([u_peak, v_peak] - spot) <= 0.75 * step + 1).all()


def test_the_padding_beside_an_image_is_empty():
    segmenter = SamSegmenter(tiny_sam(), device="cpu")
    pixels = segmenter.pixels(np.full((48, 64, 3), 255, np.uint8), segmenter.scaling(48, 64))
    assert pixels.shape == (1, 3, SIDE, SIDE)
    assert (pixels[:, :, :96] > 2).all()
    assert (pixels[:, :, 96:] == 0).all()


def ellipse(height, width, u0, v0):
    v, u = np.mgrid[:height, :width]
    return ((u - u0) / 12) ** 2 + ((v - v0) / 8) ** 2 < 1


@pytest.mark.parametrize("with_mask", [False, True])
def test_prompts_are_answered_alone_as_in_a_batch(segmenter, with_mask):
    color = np.random.default_rng(0).integers(0, 256, (48, 64, 3)).astype(np.uint8)
    prompts = [prompt_of_mask(ellipse(48, 64, u0, 24), 5, with_mask) for u0 in (14, 20, 30, 36, 44, 50)]
    together = list(segmenter(color, prompts))  # six, four at a time
    assert len(together) == 6
    for prompt, answer in zip(prompts, together, strict=True):
        assert answer.masks.shape == (3, 48, 64)
        assert answer.masks.dtype == bool
        assert answer.scores.shape == answer.stability.shape == (3,)
        (alone,) = segmenter(color, [prompt])
        assert (alone.masks == answer.masks).mean() > 0.999
        np.testing.assert_allclose(alone.scores, answer.scores, atol=1e-5)


def test_box_and_mask_reach_the_model(segmenter):
    color = np.random.default_rng(0).integers(0, 256, (48, 64, 3)).astype(np.uint8)
    bare = Prompt(np.array([[20.0, 24.0]]))
    full = prompt_of_mask(ellipse(48, 64, 20, 24), 1, with_mask=True)
    boxed = Prompt(bare.points, full.box)
    masked = Prompt(bare.points, full.box, full.mask)
    scores = [next(iter(segmenter(color, [prompt]))).scores for prompt in (bare, boxed, masked)]
    assert not np.allclose(scores[0], scores[1], rtol=0, atol=1e-8)
    assert not np.allclose(scores[1], scores[2], rtol=0, atol=1e-8)


def test_a_mask_prompt_lies_where_the_object_is(segmenter):
    mask = np.zeros((48, 64), bool)
    mask[12:24, 16:32] = True  # a quarter to a half of both sides
    scaling = segmenter.scaling(48, 64)
    logits = segmenter.inputs([prompt_of_mask(mask, 1, with_mask=True)], scaling)["input_masks"][0, 0].numpy()
    rows, columns = (np.flatnonzero((logits > 0).any(axis)) for axis in (1, 0))
    side = SIDE // 4
    reach = np.array(scaling.scaled) / SIDE * side
    assert [rows[0], rows[-1] + 1] == pytest.approx([reach[0] / 4, reach[0] / 2], abs=1)
    assert [columns[0], columns[-1] + 1] == pytest.approx([reach[1] / 4, reach[1] / 2], abs=1)


def test_random_weights_do_no_harm(segmenter):
    scene = DrawnScene([(0.06, 0.06, 0.05), (0.06, 0.06, 0.02)])
    frame, labels = scene.frame(0, looking_down(), [planar(-0.05, 0.0), planar(0.05, 0.0)])
    refined = refine_outlines(frame, labels, segmenter, OutlineParameters())
    np.testing.assert_array_equal(refined, labels)
    parameters = EverythingParameters(grid_side=3, score_min=-9, stability_min=-1, above_table_min=0.0)
    assert segment_everything(frame.color, labels > 0, segmenter, parameters).shape == labels.shape


def test_a_folder_gives_the_model_that_was_saved(model, segmenter, tmp_path):
    model.save_pretrained(tmp_path / "sam")
    loaded = load_sam(tmp_path / "sam", device="cpu")
    color = np.random.default_rng(1).integers(0, 256, (48, 64, 3)).astype(np.uint8)
    prompt = prompt_of_mask(ellipse(48, 64, 20, 24), 5, with_mask=False)
    (one,), (two,) = loaded(color, [prompt]), segmenter(color, [prompt])
    np.testing.assert_array_equal(one.masks, two.masks)
    np.testing.assert_allclose(one.scores, two.scores, atol=1e-6)


def test_a_folder_of_sam_2_for_videos_serves_as_well(tmp_path):
    # So facebook's own folders of SAM 2.1 call themselves.
    tiny_sam2().save_pretrained(tmp_path)
    config = json.loads((tmp_path / "config.json").read_text())
    (tmp_path / "config.json").write_text(json.dumps({**config, "model_type": "sam2_video"}))
    assert type(load_sam(tmp_path, device="cpu")._model).__name__ == "Sam2Model"


def test_a_folder_that_is_no_sam_is_refused_in_one_line(tmp_path):
    from safetensors.torch import load_file, save_file

    tiny_sam().save_pretrained(tmp_path / "half")
    shutil.copytree(tmp_path / "half", tmp_path / "bare")
    (tmp_path / "bare" / "model.safetensors").unlink()
    tensors = load_file(tmp_path / "half" / "model.safetensors")
    del tensors["mask_decoder.iou_token.weight"]
    save_file(tensors, tmp_path / "half" / "model.safetensors", metadata={"format": "pt"})
    (tmp_path / "empty").mkdir()
    (tmp_path / "bert").mkdir()
    (tmp_path / "bert" / "config.json").write_text('{"model_type": "bert"}')
    for folder, says in (
        ("nowhere", "is no folder"),
        ("empty", "holds no config.json"),
        ("bert", "a model of type 'bert'"),
        ("bare", "model.safetensors"),
        ("half", "lacks mask_decoder.iou_token.weight"),
    ):
        with pytest.raises(ModelError, match=says) as error:
            load_sam(tmp_path / folder, device="cpu")
        assert folder in str(error.value)
        assert "\n" not in str(error.value)
