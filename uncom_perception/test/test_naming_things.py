# SPDX-License-Identifier: Apache-2.0
"""Words for things: lexicon, adjectives, ranks, and things described by the user."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from uncom_perception.exceptions import InvalidLexiconError
from uncom_perception.objects.attributes.colour import COLOUR_NAMES, name_colours
from uncom_perception.objects.attributes.lexicon import Noun, ObjectClass, load_lexicon
from uncom_perception.objects.attributes.phrase_matcher import PhraseMatcher
from uncom_perception.objects.attributes.shape import Shape, measure

BALL = Shape(0.07, 0.07, 0.07, 1.0, 1.0, 0.75, 0.8, 0.0, 0.0, 0.01, 0.15, 0.44, 0.67, 1.4)
BOWL = Shape(0.17, 0.17, 0.065, 1.0, 0.37, 0.93, 0.8, 1.0, 0.85, 0.01, 0.1, 0.16, 1.3, 1.3)


@pytest.fixture(scope="module")
def matcher():
    return PhraseMatcher(load_lexicon())


@pytest.fixture(scope="module")
def things(matcher):
    red, blue = {"red": 0.9, "orange": 0.1}, {"blue": 0.95, "purple": 0.05}
    return [
        matcher.describe(BOWL, red, 0.17),
        matcher.describe(replace(BOWL, length=0.22, width=0.22, height=0.08), blue, 0.22),
        matcher.describe(BALL, {"orange": 0.9, "yellow": 0.1}, 0.07),
    ]


@pytest.mark.parametrize(
    ("phrase", "index"),
    [
        ("red bowl", 0),
        ("the bowl that is blue bowl", 1),
        ("biggest bowl", 1),
        ("the smaller bowl", 0),
        ("smallest thing", 2),
        ("the orange", 2),
        ("orange one", 2),
        ("the fruit", 2),
        ("the blue one", 1),
        ("large container", 1),
        ("yellow-orange round fruit", 2),
    ],
)
def test_the_phrase_picks_the_thing(matcher, things, phrase, index):
    """Colour, size, class and noun each decide where they differ."""
    scores, none = matcher.match(phrase, things)
    assert int(np.argmax(scores)) == index
    assert scores.sum() + none == pytest.approx(1.0)


def test_a_red_bowl_is_a_bowl(matcher, things):
    """Bowls of any colour are bowls, and their label says so."""
    assert {matcher.label(thing)[0] for thing in things[:2]} == {"bowl"}


def test_nothing_is_meant_where_nothing_fits(matcher, things):
    """A bottle among bowls is most likely none of them."""
    _, none = matcher.match("bottle", things)
    assert none > 0.7
    assert matcher.match("bottle", [])[1] == 1.0


def test_an_unknown_noun_is_weak_and_even(matcher, things):
    """A word that the lexicon does not know says nothing about which thing is meant."""
    scores, none = matcher.match("the wozzle", things)
    assert scores == pytest.approx(np.full(3, scores[0]))
    assert none > 0.2


def test_plurals_aliases_and_many_words_are_known():
    """The longest noun counts: a cereal box is no box."""
    lexicon = load_lexicon()
    assert isinstance(lexicon.find("bananas"), Noun)
    assert lexicon.find("skillets").name == "frying pan"
    assert isinstance(lexicon.find("dishes"), ObjectClass)
    assert PhraseMatcher(lexicon).parse("the big red cereal box").noun.name == "cereal box"


def test_a_user_describes_a_thing_never_told(tmp_path):
    """An entry in the user's file names a shape that the package does not know."""
    file = tmp_path / "mine.yaml"
    file.write_text(
        "things:\n"
        "  gong: {is_a: [toy], shape: {length: [0.3, 0.5], height: [0.3, 0.5], width: [0.01, 0.04]}}\n"
        "classes:\n  toy: {}\n"
    )
    matcher = PhraseMatcher(load_lexicon(file))
    gong = replace(BALL, length=0.4, width=0.02, height=0.4, elongation=20.0, flatness=1.0, neck=0.5)
    things = [matcher.describe(shape, {"yellow": 1.0}, 0.1) for shape in (BALL, BOWL, gong)]
    for phrase in ("gong", "toy"):
        scores, none = matcher.match(phrase, things)
        assert int(np.argmax(scores)) == 2
        assert none < 0.5


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("things: {x: {shape: {length: [2, 1]}}}", "low end"),
        ("things: {x: {shape: {colour: [0, 1]}}}", "may hold only"),
        ("things: {x: {shape: {length: 3}}}", "ranges"),
        ("nouns: {}", "things"),
        ("things: [", "not YAML"),
    ],
)
def test_a_broken_lexicon_is_refused_in_one_line(tmp_path, text, complaint):
    """The message names the file and what is wrong."""
    file = tmp_path / "broken.yaml"
    file.write_text(text)
    with pytest.raises(InvalidLexiconError, match=complaint) as caught:
        load_lexicon(file)
    assert "\n" not in str(caught.value)
    with pytest.raises(InvalidLexiconError, match="cannot read"):
        load_lexicon(tmp_path / "none.yaml")


@pytest.mark.parametrize(
    ("name", "rgb"),
    [
        ("red", (200, 25, 30)),
        ("orange", (245, 130, 20)),
        ("yellow", (240, 210, 40)),
        ("green", (40, 140, 60)),
        ("blue", (30, 70, 180)),
        ("purple", (115, 45, 155)),
        ("pink", (240, 130, 170)),
        ("brown", (105, 65, 35)),
        ("white", (240, 240, 235)),
        ("black", (18, 18, 20)),
        ("grey", (130, 132, 135)),
        ("beige", (220, 195, 150)),
    ],
)
@pytest.mark.parametrize("light", [0.85, 1.0, 1.08])
def test_colours_keep_their_names_in_other_light(name, rgb, light):
    """A little darker and a little lighter the name stays."""
    rng = np.random.default_rng(1)
    pixels = np.clip(np.array(rgb) * light + rng.normal(0, 3, (500, 3)), 0, 255).astype(np.uint8)
    shares = name_colours(pixels)
    assert next(iter(shares)) == name
    assert sum(shares.values()) == pytest.approx(1.0, abs=1e-3)
    assert set(shares) == set(COLOUR_NAMES)


def test_measures_of_a_block_are_its_own():
    """Length, width, height and rectangularity of a block turned by 30 degrees."""
    x, y = np.meshgrid(np.linspace(-0.06, 0.06, 80), np.linspace(-0.02, 0.02, 40))
    angle = np.radians(30.0)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    flat = np.column_stack([x.ravel(), y.ravel()]) @ turn
    shape = measure(np.column_stack([flat, np.full(len(flat), 0.05)]), np.array([-1.0, 0.0, 1.0]))
    assert shape.length == pytest.approx(0.12, abs=0.008)
    assert shape.width == pytest.approx(0.04, abs=0.008)
    assert shape.height == pytest.approx(0.05, abs=1e-6)
    assert shape.rectangularity > 0.85
    assert shape.hollowness < 0.1
    assert shape.curvature < 0.02


def test_a_rim_around_a_lower_middle_is_hollow():
    """A ring of 6 cm height about a floor at 1 cm holds water, a dome does not."""
    x, y = np.meshgrid(np.linspace(-0.08, 0.08, 120), np.linspace(-0.08, 0.08, 120))
    r = np.hypot(x, y).ravel()
    inside = r < 0.08
    points = np.column_stack([x.ravel(), y.ravel(), np.where(r > 0.07, 0.06, 0.01)])[inside]
    dome = np.column_stack([x.ravel(), y.ravel(), 0.06 * np.sqrt(np.maximum(0.0, 1 - (r / 0.085) ** 2))])[inside]
    eye = np.array([-0.5, 0.0, 0.7])
    assert measure(points, eye).hollowness > 0.7
    assert measure(points, eye).cavity > 0.6
    assert measure(dome, eye).hollowness < 0.1


def test_a_crescent_is_curved_and_a_bar_is_not():
    """The bow of a quarter circle is a large share of its length."""
    angle = np.linspace(0.0, np.pi / 2, 300)
    rng = np.random.default_rng(2)
    arc = 0.12 * np.column_stack([np.cos(angle), np.sin(angle)]) + rng.normal(0, 0.004, (300, 2))
    bar = np.column_stack([np.linspace(0, 0.18, 300), rng.normal(0, 0.004, 300)])
    eye = np.array([-0.5, 0.0, 0.7])
    assert measure(np.column_stack([arc, np.full(300, 0.03)]), eye).curvature > 0.1
    assert measure(np.column_stack([bar, np.full(300, 0.03)]), eye).curvature < 0.04


def test_colour_naming_agrees_with_opencv_lab():
    """The table of names is made in CIELAB as OpenCV computes it: mid grey is neutral."""
    lab = cv2.cvtColor(np.full((1, 1, 3), 0.5, np.float32), cv2.COLOR_RGB2LAB)
    assert abs(lab[0, 0, 1]) < 0.5
    assert abs(lab[0, 0, 2]) < 0.5


def test_a_colour_between_two_names_is_called_as_is_usual_for_such_a_thing(matcher):
    """Light grey metal is grey as a spoon; a bowl may as well be white, and a spoon that is plainly white stays so."""
    spoon = Shape(0.17, 0.042, 0.012, 4.0, 0.07, 0.35, 0.6, 0.2, 0.1, 0.06, 0.02, 0.5, 0.8, 1.0)
    between, white = {"white": 0.5, "grey": 0.4, "beige": 0.1}, {"white": 0.95, "grey": 0.05}

    def first(shape: Shape, colours: dict[str, float]) -> str:
        thing = matcher.describe(shape, colours, 0.1)
        assert sum(thing.colours.values()) == pytest.approx(1.0)
        return next(iter(thing.colours))

    assert matcher.label(matcher.describe(spoon, between, 0.1))[0] == "spoon"
    assert first(spoon, between) == "grey"
    assert first(spoon, white) == "white"
    assert first(BOWL, between) == "white"


def test_a_mug_is_a_cup_where_there_is_no_other(matcher):
    """Beside a cup "the cup" is the cup; a bowl is none in either case."""
    mug = Shape(0.12, 0.085, 0.095, 1.4, 0.8, 0.85, 0.8, 1.0, 0.9, 0.035, 0.05, 0.2, 1.0, 1.0)
    cup = replace(mug, length=0.08, width=0.08, elongation=1.0, flatness=1.2, handle=0.0, taper=1.25)
    one, other, bowl = (matcher.describe(s, {"red": 1.0}, 0.1) for s in (mug, cup, BOWL))
    alone, none = matcher.match("the red cup", [bowl, one])
    assert alone.argmax() == 1
    assert none < 0.8
    both, _ = matcher.match("the red cup", [one, other])
    assert both[1] > 5.0 * both[0]


def test_a_cereal_box_is_a_box_where_there_is_no_other(matcher):
    """Beside a plain box "the box" is the plain one."""
    tall = Shape(0.19, 0.06, 0.28, 3.0, 1.45, 0.4, 0.95, 0.0, 0.0, 0.0, 0.0, 0.9, 1.0, 1.0)
    plain = replace(tall, length=0.12, width=0.09, height=0.07, elongation=1.33, flatness=0.58)
    cereal, box, ball = (matcher.describe(s, {"red": 1.0}, 0.1) for s in (tall, plain, BALL))
    alone, none = matcher.match("the red box", [ball, cereal])
    assert alone.argmax() == 1
    assert none < 0.8
    both, _ = matcher.match("the red box", [cereal, box])
    assert both[1] > 5.0 * both[0]
