# SPDX-License-Identifier: Apache-2.0
"""The language-model back end: prompts, checks, reading; and a tiny Phi with random weights under constraint."""

from __future__ import annotations

import json

import pytest
from uncom_common.exceptions import ModelNotFoundError
from uncom_common.primitive import Primitive
from uncom_language.exceptions import AnswerError, UnknownBackendError, UnknownLanguageError
from uncom_language.language_understanding import LanguageUnderstanding
from uncom_language.llm.answer_schema import answer_schema, validate_answer
from uncom_language.llm.chat_model import ChatModel
from uncom_language.llm.llm_parser import LlmParser, whisper_json
from uncom_language.types import Act, Relation, Transcript, Word


def heard(text):
    words = tuple(Word(word, 1.0 + 0.5 * i, 1.4 + 0.5 * i) for i, word in enumerate(text.split()))
    return Transcript("u", words)


def part(text, start, end, concrete=None):
    made = {"text": text, "timestamp": [start, end]}
    return made if concrete is None else {**made, "concrete": concrete}


MUG = "take the mug and put it next to this plate"
FIRST = {
    "object": part("mug", 2.0, 2.4),
    "action": part("put", 3.0, 3.4),
    "target": part("next to this plate", 4.0, 5.9),
}
SECOND = {**FIRST, "object": {**FIRST["object"], "concrete": True}, "target": {**FIRST["target"], "concrete": True}}


class Script:
    """Says what it was told to, and keeps the conversations: a model whose mind is known."""

    name = "script"

    def __init__(self, *answers):
        self.answers = [answer if isinstance(answer, str) else json.dumps(answer) for answer in answers]
        self.asked = []

    def answer(self, messages, schema):
        self.asked.append([dict(message) for message in messages])
        return self.answers[len(self.asked) - 1]


def test_two_prompts_in_one_conversation_make_a_command():
    model = Script(FIRST, SECOND)
    (command,) = LlmParser(model).parse(heard(MUG))
    assert (command.act, command.primitive, command.relation) == (Act.COMMAND, Primitive.PLACE, Relation.NEXT_TO)
    assert (command.object.text, command.object.span.start_s) == ("mug", 2.0)
    assert (command.target.text, command.target.deictic, command.target.span.end_s) == ("plate", "this", 5.9)
    first, second = model.asked
    assert first[0]["role"] == "system"
    assert first[-1]["content"] == whisper_json(heard(MUG).words)
    assert second[: len(first)] == first
    assert second[len(first)] == {"role": "assistant", "content": json.dumps(FIRST)}
    assert "concrete" in second[-1]["content"]


def test_a_bad_answer_is_asked_for_again_with_the_reason():
    model = Script("put the mug there", FIRST, SECOND)
    (command,) = LlmParser(model).parse(heard(MUG))
    assert command.act is Act.COMMAND
    assert "no JSON" in model.asked[1][-1]["content"]


def test_after_a_second_bad_answer_it_fails_clearly():
    invented = {**FIRST, "object": part("elephant", 0.0, 1.0)}
    with pytest.raises(AnswerError, match="no usable answer: nobody said 'elephant'"):
        LlmParser(Script(invented, invented)).parse(heard(MUG))
    (command,) = LanguageUnderstanding("phi", make_model=lambda: Script("{", "{")).understand(heard(MUG))
    assert command.act is Act.REFUSED
    assert "no usable answer" in command.reason


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"extra": ""}, "exactly the keys"),
        ({"object": "mug"}, "must be empty or have"),
        ({"object": part("mug", 3.0, 2.0, True)}, "timestamp of object"),
        ({"object": part("mug", 2.0, 3.0)}, "exactly the keys concrete"),
        ({"action": part("   ", 2.0, 3.0)}, "text of action"),
    ],
)
def test_answers_that_are_not_of_the_schema_are_told_so(change, why):
    with pytest.raises(AnswerError, match=why):
        validate_answer(json.dumps({**SECOND, **change}), refined=True, words=MUG)


def test_missing_parts_are_named_and_no_action_is_no_command():
    nothing = {"object": "", "action": "", "target": ""}
    (command,) = LlmParser(Script(nothing, nothing)).parse(heard("nice weather today"))
    assert command.act is Act.REFUSED
    half = {"object": part("banana", 2.0, 2.4), "action": part("put", 1.0, 1.4), "target": ""}
    full = {**half, "object": {**half["object"], "concrete": True}}
    (command,) = LlmParser(Script(half, full)).parse(heard("put the banana"))
    assert command.act is Act.INCOMPLETE
    assert "the target is missing" in command.reason


def test_both_back_ends_note_where_they_disagree():
    agreeing = LanguageUnderstanding("both", make_model=lambda: Script(FIRST, SECOND))
    (command,) = agreeing.understand(heard(MUG))
    assert command.notes == ("the language model agrees",)
    assert "grammar" in command.backend
    assert "script" in command.backend
    wrong = {**FIRST, "target": part("this plate", 5.0, 5.9)}
    wrong2 = {**wrong, "object": SECOND["object"], "target": {**wrong["target"], "concrete": True}}
    (command,) = LanguageUnderstanding("both", make_model=lambda: Script(wrong, wrong2)).understand(heard(MUG))
    assert command.relation is Relation.NEXT_TO
    assert "reads this otherwise" in command.notes[0]


def test_unknown_names_are_clear_errors():
    with pytest.raises(UnknownBackendError, match="choose one of: grammar, phi, both"):
        LanguageUnderstanding("gpt")
    with pytest.raises(UnknownLanguageError, match="tlh"):
        LlmParser(Script(), "tlh")


TEMPLATE = (
    "{% for message in messages %}{{ '<|' + message['role'] + '|>' + message['content'] + '<|end|>' }}{% endfor %}"
    "{% if add_generation_prompt %}{{ '<|assistant|>' }}{% else %}{{ eos_token }}{% endif %}"
)


@pytest.fixture(scope="module")
def tiny_phi(tmp_path_factory):
    """Save a Phi of 30 thousand random weights with a byte-level tokenizer and the chat template of Phi-4."""
    torch = pytest.importorskip("torch")
    transformers = pytest.importorskip("transformers")
    tokenizers = pytest.importorskip("tokenizers")
    pytest.importorskip("llguidance")
    special = ["<|endoftext|>", "<|end|>", "<|system|>", "<|user|>", "<|assistant|>"]
    raw = tokenizers.Tokenizer(tokenizers.models.BPE())
    raw.pre_tokenizer = tokenizers.pre_tokenizers.ByteLevel(add_prefix_space=False)
    raw.decoder = tokenizers.decoders.ByteLevel()
    trainer = tokenizers.trainers.BpeTrainer(
        vocab_size=400, special_tokens=special, initial_alphabet=tokenizers.pre_tokenizers.ByteLevel.alphabet()
    )
    raw.train_from_iterator([json.dumps(SECOND), MUG] * 5, trainer)
    tokenizer = transformers.PreTrainedTokenizerFast(
        tokenizer_object=raw, eos_token="<|endoftext|>", pad_token="<|endoftext|>", chat_template=TEMPLATE
    )
    folder = tmp_path_factory.mktemp("tiny_phi")
    tokenizer.save_pretrained(folder)
    torch.manual_seed(1)
    config = transformers.Phi3Config(
        vocab_size=len(tokenizer),
        hidden_size=32,
        intermediate_size=64,
        num_hidden_layers=2,
        num_attention_heads=4,
        num_key_value_heads=2,
        max_position_embeddings=4096,
        pad_token_id=0,
        bos_token_id=0,
        eos_token_id=0,
    )
    transformers.Phi3ForCausalLM(config).save_pretrained(folder)
    return folder


def test_a_model_with_random_weights_writes_json_of_the_schema_or_is_cut(tiny_phi):
    model = ChatModel(str(tiny_phi), device="cpu", max_new_tokens=300)
    short = {
        "type": "object",
        "properties": {"concrete": {"type": "boolean"}, "action": {"enum": ["put", "take"]}},
        "required": ["concrete", "action"],
        "additionalProperties": False,
    }
    for question in ("put it here", "take the cup", "is this a test?"):
        data = json.loads(model.answer([{"role": "user", "content": question}], short))
        assert isinstance(data["concrete"], bool)
        assert data["action"] in ("put", "take")
    text = model.answer([{"role": "user", "content": MUG}], answer_schema(refined=False))
    assert text.startswith('{"object":')


def test_whatever_a_random_model_says_there_is_a_command_or_a_reason(tiny_phi):
    model = ChatModel(str(tiny_phi), max_new_tokens=60)
    understanding = LanguageUnderstanding("phi", make_model=lambda: model)
    (command,) = understanding.understand(heard(MUG))
    assert command.act is Act.COMMAND or command.reason
    assert str(tiny_phi) in command.backend


def test_weights_that_are_nowhere_are_a_one_line_error(tmp_path):
    pytest.importorskip("llguidance")
    pytest.importorskip("transformers")
    with pytest.raises(ModelNotFoundError, match="no usable weights") as caught:
        LanguageUnderstanding("phi", model=str(tmp_path))
    assert "\n" not in str(caught.value)
