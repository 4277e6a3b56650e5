# SPDX-License-Identifier: Apache-2.0
"""GroundingDINO and DPT on tiny random weights of the true classes: loading, processors, post-processing.

What such weights see is noise, so that shapes, ranges, order and the way of the data are tested, not accuracy.
"""

from __future__ import annotations

import numpy as np
import pytest
from perception_scenes import CAMERA, POSE, plain_table
from tiny_sam import write_tiny_sam
from uncom_common.exceptions import InvalidConfigError, ModelNotFoundError
from uncom_common.pretrained_models import pick_device
from uncom_perception.depth.dpt_depth_estimator import DptDepth, load_dpt, table_scale
from uncom_perception.depth.make_depth_estimator import make_depth_estimator
from uncom_perception.exceptions import InvalidImageError, UnknownBackendError
from uncom_perception.objects.detectors.grounding_dino_detector import GroundingOptions, _merged, load_grounding_dino
from uncom_perception.objects.detectors.make_detector import make_detector
from uncom_perception.objects.detectors.queries import query_of
from uncom_perception.rgbd_frame import RgbdFrame
from uncom_perception.segmentation.cluster_segmenter import ClusterSegmenter
from uncom_perception.segmentation.make_segmenter import make_segmenter
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
        image_size=64,
        embed_dim=8,
        depths=[1, 1, 1, 1],
        num_heads=[1, 1, 2, 2],
        window_size=2,
        out_features=["stage2", "stage3", "stage4"],
    )
    config = transformers.GroundingDinoConfig(
        backbone_config=swin,
        text_config=text,
        d_model=32,
        encoder_layers=1,
        decoder_layers=2,
        num_queries=20,
        encoder_attention_heads=2,
        decoder_attention_heads=2,
        encoder_ffn_dim=32,
        decoder_ffn_dim=32,
        num_feature_levels=4,
        max_text_len=64,
    )
    transformers.GroundingDinoForObjectDetection(config).save_pretrained(folder)
    (folder / "vocab.txt").write_text("\n".join(WORDS))
    tokenizer = transformers.BertTokenizer(str(folder / "vocab.txt"))
    images = transformers.GroundingDinoImageProcessor(size={"shortest_edge": 64, "longest_edge": 96})
    transformers.GroundingDinoProcessor(images, tokenizer).save_pretrained(folder)
    return str(folder)


@pytest.fixture(scope="module")
def sam(tmp_path_factory):
    return write_tiny_sam(tmp_path_factory.mktemp("sam"))


@pytest.fixture(scope="module")
def dpt(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dpt")
    torch.manual_seed(0)
    backbone = transformers.Dinov2Config(
        hidden_size=16,
        num_hidden_layers=4,
        num_attention_heads=2,
        image_size=56,
        patch_size=14,
        mlp_ratio=1,
        out_features=["stage1", "stage2", "stage3", "stage4"],
        reshape_hidden_states=False,
        apply_layernorm=True,
    )
    config = transformers.DPTConfig(
        backbone_config=backbone,
        neck_hidden_sizes=[8, 8, 8, 8],
        fusion_hidden_size=8,
        head_in_index=-1,
        reassemble_factors=[4, 2, 1, 0.5],
        is_hybrid=False,
    )
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
    scene = detector.detect(RgbdFrame(rgb, depth, CAMERA, POSE, stamp_s=3.0), phrases)
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


def test_all_phrases_of_one_request_go_through_the_model_together(detector, picture, monkeypatch):
    """With the table's, as many at once as fit a batch; phrases that are one query are looked for once."""
    sizes, model = [], detector._model
    monkeypatch.setattr(detector, "_model", lambda **inputs: sizes.append(len(inputs["input_ids"])) or model(**inputs))
    phrases = ["the red mug", "table", "bowl next to the mug", "red mug on the left", "object"]
    scene = detector.detect(RgbdFrame(picture[0]), phrases)
    assert sizes == [4]  # table. red mug. bowl. objects.
    assert all(d.phrase_scores[0] == d.phrase_scores[3] for d in scene.detections)
    monkeypatch.setattr(detector, "_options", GroundingOptions(box_threshold=0.001, batch=3))
    detector.detect(RgbdFrame(picture[0]), phrases)
    assert sizes == [4, 3, 1]


def test_a_plain_picture_needs_no_depth(detector, picture):
    """Without depth there is no geometry, and the table is the box of its own query."""
    scene = detector.detect(RgbdFrame(picture[0]), [])
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
    scene = detector.detect(RgbdFrame(picture[0]), ["mug"])
    box = scene.detections[0].box
    every = detector.boxes([picture[0]], ["mug."])[0][0][0]
    marks = np.column_stack([np.linspace(every[0], every[2], 21), np.linspace(every[1], every[3], 21), np.zeros(21)])
    hands = HandsFrame(0.0, "", 640, 480, (Hand("right", 1.0, marks),))
    without = detector.detect(RgbdFrame(picture[0]), ["mug"], hands)
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
