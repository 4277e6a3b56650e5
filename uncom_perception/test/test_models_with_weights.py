# SPDX-License-Identifier: Apache-2.0
"""GroundingDINO, SAM and DPT on tiny random weights of the true classes: loading, processors, post-processing.

What such weights see is noise, so that shapes, ranges, order and the way of the data are tested, not accuracy.
"""

from __future__ import annotations

import numpy as np
import pytest
from perception_scenes import CAMERA, POSE, plain_table
from uncom_common.exceptions import InvalidConfigError, ModelNotFoundError
from uncom_common.full_models import pick_device
from uncom_perception.depth.dpt import DptDepth, load_dpt, table_scale
from uncom_perception.depth.estimator import make_depth_estimator
from uncom_perception.exceptions import InvalidImageError, UnknownBackendError
from uncom_perception.objects.backends import make_detector
from uncom_perception.objects.grounding_dino import GroundingOptions, _merged, load_grounding_dino
from uncom_perception.objects.queries import query_of
from uncom_perception.segmentation import sam as sam_module
from uncom_perception.segmentation.backends import make_segmenter
from uncom_perception.segmentation.cluster import ClusterSegmenter
from uncom_perception.segmentation.sam import load_sam
from uncom_perception.types import Box, Hand, HandsFrame

torch = pytest.importorskip("torch")
transformers = pytest.importorskip("transformers")

pytestmark = pytest.mark.slow  # importing torch alone takes seconds

WORDS = ["[PAD]", "[UNK]", "[CLS]", "[SEP]", "[MASK]", ".", "red", "mug", "bowl", "table", "object", "objects"]


@pytest.fixture(scope="module")
def dino(tmp_path_factory):
    """Write a tiny GroundingDINO with its processor into a folder, as save_pretrained does."""
    folder = tmp_path_factory.mktemp("dino")
    torch.manual_seed(0)
    text = transformers.BertConfig(
        vocab_size=len(WORDS), hidden_size=32, num_hidden_layers=1, num_attention_heads=2, intermediate_size=32
    )
    swin = transformers.SwinConfig(
        image_size=64, embed_dim=8, depths=[1, 1, 1, 1], num_heads=[1, 1, 2, 2], window_size=2,
        out_features=["stage2", "stage3", "stage4"],
    )  # fmt: skip
    config = transformers.GroundingDinoConfig(
        backbone_config=swin, text_config=text, d_model=32, encoder_layers=1, decoder_layers=2, num_queries=20,
        encoder_attention_heads=2, decoder_attention_heads=2, encoder_ffn_dim=32, decoder_ffn_dim=32,
        num_feature_levels=4, max_text_len=64,
    )  # fmt: skip
    transformers.GroundingDinoForObjectDetection(config).save_pretrained(folder)
    (folder / "vocab.txt").write_text("\n".join(WORDS))
    tokenizer = transformers.BertTokenizer(str(folder / "vocab.txt"))
    images = transformers.GroundingDinoImageProcessor(size={"shortest_edge": 64, "longest_edge": 96})
    transformers.GroundingDinoProcessor(images, tokenizer).save_pretrained(folder)
    return str(folder)


@pytest.fixture(scope="module")
def sam(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sam")
    torch.manual_seed(0)
    vision = transformers.SamVisionConfig(
        hidden_size=16, num_hidden_layers=1, num_attention_heads=2, image_size=64, patch_size=16, output_channels=16,
        mlp_dim=16, global_attn_indexes=[0], window_size=2, num_pos_feats=8,
    )  # fmt: skip
    prompt = transformers.SamPromptEncoderConfig(hidden_size=16, image_size=64, patch_size=16, mask_input_channels=4)
    decoder = transformers.SamMaskDecoderConfig(
        hidden_size=16, mlp_dim=16, num_hidden_layers=1, num_attention_heads=2, iou_head_hidden_dim=16
    )
    config = transformers.SamConfig(
        vision_config=vision.to_dict(), prompt_encoder_config=prompt.to_dict(), mask_decoder_config=decoder.to_dict()
    )
    transformers.SamModel(config).save_pretrained(folder)
    images = transformers.SamImageProcessor(size={"longest_edge": 64}, pad_size={"height": 64, "width": 64})
    transformers.SamProcessor(images).save_pretrained(folder)
    return str(folder)


@pytest.fixture(scope="module")
def dpt(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dpt")
    torch.manual_seed(0)
    backbone = transformers.Dinov2Config(
        hidden_size=16, num_hidden_layers=4, num_attention_heads=2, image_size=56, patch_size=14, mlp_ratio=1,
        out_features=["stage1", "stage2", "stage3", "stage4"], reshape_hidden_states=False, apply_layernorm=True,
    )  # fmt: skip
    config = transformers.DPTConfig(
        backbone_config=backbone, neck_hidden_sizes=[8, 8, 8, 8], fusion_hidden_size=8, head_in_index=-1,
        reassemble_factors=[4, 2, 1, 0.5], is_hybrid=False,
    )  # fmt: skip
    transformers.DPTForDepthEstimation(config).save_pretrained(folder)
    images = transformers.DPTImageProcessor(size={"height": 56, "width": 56}, ensure_multiple_of=14)
    images.save_pretrained(folder)
    return str(folder)


@pytest.fixture(scope="module")
def picture():
    return plain_table(blocks=[(0.6, 0.1, 0.1, 0.06, 0.08, (200, 30, 30)), (0.6, -0.2, 0.1, 0.1, 0.06, (30, 60, 200))])


@pytest.fixture(scope="module")
def detector(dino):
    return load_grounding_dino(ClusterSegmenter(), dino, "cpu", GroundingOptions(box_threshold=0.001))


def test_grounding_dino_answers_in_the_form_of_a_scene(detector, picture):
    """Probabilities of each phrase and of none sum to 1; geometry is in the base frame."""
    rgb, depth = picture
    phrases = ["the red mug", "table", "bowl next to the mug"]
    scene = detector.detect(rgb, depth, CAMERA, POSE, phrases, None, 3.0)
    assert scene.stamp_s == 3.0
    assert scene.detections
    for i, none in enumerate(scene.phrase_none):
        assert sum(d.phrase_scores[i] for d in scene.detections) + none == pytest.approx(1.0, abs=1e-6)
    assert scene.phrase_none[1] == 1.0
    assert scene.table.height_m == pytest.approx(0.72, abs=0.01)
    assert {d.label for d in scene.detections} <= {"red mug", "bowl"}
    assert any(d.geometry is not None for d in scene.detections)
    assert "grounding dino" in scene.backend
    for d in scene.detections:
        assert d.mask.shape == rgb.shape[:2]
        assert 0.0 <= d.box.x_min <= d.box.x_max <= 640.0


def test_queries_in_batches_find_what_they_find_alone(detector, picture):
    """Padding to the longest query of a batch does not change the boxes; so frames and phrases may go together."""
    rgb, _ = picture
    queries = ["red mug.", "bowl.", "table.", "objects.", "mug."]
    together = detector.boxes([rgb, rgb[:, ::-1].copy(), rgb, rgb, rgb], queries)
    assert len(together) == 5
    alone = detector.boxes([rgb], ["red mug."])[0]
    assert together[0][0][:3] == pytest.approx(alone[0][:3], abs=1.0)
    for boxes, scores in together:
        assert boxes.shape == (len(scores), 4)
        assert np.all((scores >= 0.0) & (scores <= 1.0))


def test_a_plain_picture_needs_no_depth(detector, picture):
    """Without depth there is no geometry, and the table is the box of its own query."""
    scene = detector.detect(picture[0], None, None, None, [])
    assert all(d.geometry is None for d in scene.detections)
    assert scene.phrase_none == ()


def test_boxes_that_lie_on_one_another_are_one_thing():
    """Over queries, too: one row with a score of each; a box apart keeps its own row."""
    first = (np.array([[10.0, 10, 50, 50], [200, 200, 260, 260]]), np.array([0.6, 0.5]))
    second = (np.array([[11.0, 10, 50, 51], [5, 5, 5, 9]]), np.array([0.8, 0.9]))
    boxes, scores = _merged([first, second], 0.7, (480, 640, 3))
    assert len(boxes) == 2
    assert sorted(scores.tolist()) == [[0.5, 0.0], [0.6, 0.8]]


def test_the_hand_that_points_is_no_object(detector, picture):
    """A box that a hand fills is left out."""
    scene = detector.detect(picture[0], None, None, None, ["mug"])
    box = scene.detections[0].box
    every = detector.boxes([picture[0]], ["mug."])[0][0][0]
    marks = np.column_stack([np.linspace(every[0], every[2], 21), np.linspace(every[1], every[3], 21), np.zeros(21)])
    hands = HandsFrame(0.0, "", 640, 480, (Hand("right", 1.0, marks),))
    without = detector.detect(picture[0], None, None, None, ["mug"], hands)
    assert len(without.detections) < len(scene.detections)
    assert isinstance(box, Box)


@pytest.mark.parametrize(
    ("phrase", "query"),
    [
        ("The red mug next to the plate", "red mug."),
        ("this", "objects."),
        ("objects", "objects."),
        ("the yellow one", "yellow object."),
        ("left bowl", "bowl."),
        ("bowl in front of the box", "bowl."),
        ("the second can", "can."),
        ("cereal box", "cereal box."),
        ("", "objects."),
    ],
)
def test_words_of_place_never_reach_the_detector(phrase, query):
    """One phrase a query, lower case, one full stop."""
    assert query_of(phrase) == query


def test_sam_gives_a_mask_for_each_prompt(sam, picture):
    """By centre points of boxes as in the paper, by boxes as an option; holes closed, scores from 0 to 1."""
    rgb, depth = picture
    boxes = [Box(100, 100, 200, 180), Box(300, 200, 400, 330)]
    points = np.array([[150.0, 140.0]])
    for as_points in (True, False):
        segmenter = load_sam(sam, "cpu", boxes_as_points=as_points)
        masks, scores = segmenter.segment(rgb, depth, points, boxes)
        assert len(masks) == len(scores) == 3
        assert all(mask.shape == rgb.shape[:2] and mask.dtype == bool for mask in masks)
        assert all(0.0 <= score <= 1.0 for score in scores)
        assert ("centre points" in segmenter.name) == as_points
    centred = load_sam(sam, "cpu").segment(rgb, None, np.zeros((0, 2)), [Box(100, 100, 200, 180)])[0][0]
    assert np.array_equal(centred, load_sam(sam, "cpu").segment(rgb, None, points, [])[0][0])
    with pytest.raises(InvalidImageError, match="outside"):
        load_sam(sam, "cpu").segment(rgb, None, np.array([[700.0, 10.0]]), [])
    assert load_sam(sam, "cpu").segment(rgb, None, np.zeros((0, 2)), []) == ([], [])


RING, DISC, EVERYTHING = range(3)


def told_by(segmenter, monkeypatch, scores):
    """Let a SAM answer every prompt with a ring, a disc and everything, and predict these IoUs (prompts, 3) of them."""
    v, u = np.mgrid[0:16, 0:16]  # the square that the tiny model's masks cover; the picture is the upper 12 rows of it
    away = np.hypot(u - 7.5, v - 5.5)
    masks = np.stack([(away < 5.0) & (away > 2.2), away < 3.0, np.ones_like(away, bool)])
    model = segmenter._model

    def answer(**inputs):
        outputs = model(**inputs)
        assert outputs.iou_scores.shape == (1, len(scores), 3)
        assert outputs.pred_masks.shape == (1, len(scores), 3, 16, 16)
        outputs.iou_scores = torch.tensor([scores])
        outputs.pred_masks = torch.tensor(np.where(masks, 9.0, -9.0)).float().expand(1, len(scores), 3, 16, 16)
        return outputs

    monkeypatch.setattr(segmenter, "_model", answer)


def test_of_the_three_masks_of_sam_the_one_of_the_best_predicted_iou_is_taken(sam, picture, monkeypatch):
    """For each prompt on its own, in the order of the prompts; a prediction beyond 1 is told as 1."""
    segmenter = load_sam(sam, "cpu")
    told_by(segmenter, monkeypatch, [[0.2, 0.3, 0.7], [0.1, 0.6, 0.2], [1.3, 0.9, 0.8]])
    points = np.array([[300.0, 220.0], [310.0, 230.0], [320.0, 240.0]])
    masks, scores = segmenter.segment(picture[0], None, points, [])
    assert scores == pytest.approx([0.7, 0.6, 1.0])
    everything, disc, ring = (float(mask.mean()) for mask in masks)
    assert everything == 1.0
    assert disc == pytest.approx(np.pi * 3.0**2 / (16 * 12), rel=0.15)
    assert ring == pytest.approx(np.pi * 5.0**2 / (16 * 12), rel=0.15)


def test_holes_of_a_mask_of_sam_are_closed_and_nothing_else(sam, picture, monkeypatch):
    """Post-processing leaves the hole of the ring; it is filled, and what lies outside the ring stays outside."""
    segmenter = load_sam(sam, "cpu")
    told_by(segmenter, monkeypatch, [[0.9, 0.1, 0.1]])
    raw = []
    closed = sam_module._closed
    monkeypatch.setattr(sam_module, "_closed", lambda mask: raw.append(mask) or closed(mask))
    (mask,), _ = segmenter.segment(picture[0], None, np.array([[320.0, 240.0]]), [])
    v, u = 5.9 * 480 / 12, 7.9 * 640 / 16  # about the middle of the ring [px]
    assert not raw[0][int(v), int(u)]
    assert mask[int(v), int(u)]
    assert mask[raw[0]].all()
    far = np.hypot(np.arange(640)[None] - u, np.arange(480)[:, None] - v) > 6.0 * 640 / 16
    assert not mask[far].any()


def test_dpt_gives_depth_of_the_size_of_the_image(dpt, picture):
    """In float32, positive or unknown."""
    depth = load_dpt(dpt, "cpu").estimate(picture[0])
    assert depth.shape == (480, 640)
    assert depth.dtype == np.float32
    assert np.all(np.isnan(depth) | (depth > 0.0))
    with pytest.raises(InvalidImageError):
        load_dpt(dpt, "cpu").estimate(np.zeros((480, 640), np.uint8))


@pytest.mark.parametrize("wrong", [0.7, 1.0, 1.6])
def test_depth_of_a_wrong_scale_is_corrected_by_the_table(picture, wrong):
    """The camera's height above the table is known, so that the factor is."""
    factor = table_scale(picture[1] * np.float32(wrong), CAMERA, POSE[2, 3] - 0.72)
    assert factor == pytest.approx(1.0 / wrong, rel=0.02)
    assert table_scale(np.full((480, 640), np.nan, np.float32), CAMERA, 0.7) is None


def test_back_ends_are_made_by_name(dino, sam, dpt):
    """The factories load from folders; unknown names and missing weights are one-line errors."""
    segmenter = make_segmenter("sam", sam, "cpu")
    made = make_detector("grounding_dino", model=dino, device="cpu", segmenter=segmenter)
    assert "sam" in made.name
    assert isinstance(make_depth_estimator("dpt", dpt, "cpu"), DptDepth)
    with pytest.raises(UnknownBackendError, match="grounding_dino"):
        make_detector("yolo")
    with pytest.raises(ModelNotFoundError, match="no usable weights") as caught:
        make_depth_estimator("dpt", "/nowhere/at/all", "cpu")
    assert "\n" not in str(caught.value)


def test_a_graphics_processor_that_is_not_there_is_refused():
    assert pick_device("cpu") == "cpu"
    if torch.cuda.is_available():
        assert pick_device("auto") == "cuda"
    else:
        assert pick_device("auto") == "cpu"
        with pytest.raises(InvalidConfigError, match="torch sees no GPU"):
            pick_device("cuda")
