# SPDX-License-Identifier: Apache-2.0
"""An instruct model in Transformers whose answers are held to a JSON schema while they are decoded."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from uncom_common.pretrained_models import load_pretrained, pick_device, require, weights_format

from uncom_language.llm.options import CHAT

DEFAULT_MODEL = "microsoft/Phi-4-mini-instruct"


class ChatModel:
    """A model with its tokenizer and chat template; decoding is greedy, so the same words get the same answer."""

    def __init__(
        self, name: str = DEFAULT_MODEL, device: str = "auto", max_new_tokens: int = CHAT.max_new_tokens
    ) -> None:
        """Load the model.

        Args:
            name: folder, or name on the model hub.
            device: "auto" takes a GPU where there is one.
            max_new_tokens: after which an answer is cut.

        Raises:
            NotInstalledError: torch, transformers or llguidance is missing.
            ModelNotFoundError: no weights in the folder, the cache, or on the hub.
        """
        transformers = require("transformers")
        self._guidance = require("llguidance")
        require("llguidance.hf")
        self.name = name
        self._device = pick_device(device)
        self._max_new_tokens = max_new_tokens
        self._tokenizer = load_pretrained(transformers.AutoTokenizer, name)
        model = load_pretrained(transformers.AutoModelForCausalLM, name, dtype=weights_format(self._device))
        self._model = model.to(self._device).eval()
        ends = model.generation_config.eos_token_id
        ends = self._tokenizer.eos_token_id if ends is None else ends
        self._ends: list[int] = [ends] if isinstance(ends, int) else list(ends)
        self._vocabulary = self._guidance.hf.from_tokenizer(
            self._tokenizer, n_vocab=int(model.config.vocab_size), eos_token=self._ends
        )

    def answer(self, messages: Sequence[Mapping[str, str]], schema: Mapping[str, Any]) -> str:
        """Return the answer to a conversation; it is JSON of the schema unless it was cut for its length.

        Args:
            messages: turns with role (system, user, assistant) and content.
            schema: JSON schema.
        """
        torch = require("torch")
        transformers = require("transformers")
        inputs = self._tokenizer.apply_chat_template(
            list(messages), add_generation_prompt=True, return_tensors="pt", return_dict=True
        ).to(self._device)
        length = int(inputs["input_ids"].shape[1])
        grammar = self._guidance.LLMatcher.grammar_from_json_schema(
            json.dumps(schema), defaults={"whitespace_flexible": False}
        )
        matcher = self._guidance.LLMatcher(self._vocabulary, grammar)
        constraint = _Constraint(matcher, length, self._ends)
        with torch.inference_mode():
            made = self._model.generate(
                **inputs,
                max_new_tokens=self._max_new_tokens,
                do_sample=False,
                logits_processor=transformers.LogitsProcessorList([constraint]),
                eos_token_id=self._ends,
                pad_token_id=self._ends[0],
            )
        return str(self._tokenizer.decode(made[0, length:], skip_special_tokens=True)).strip()


class _Constraint:
    """Leaves only tokens that can still become JSON of the schema."""

    def __init__(self, matcher: Any, start: int, ends: Sequence[int]) -> None:
        self._matcher = matcher
        self._seen = start
        self._ends = list(ends)

    def __call__(self, input_ids: Any, scores: Any) -> Any:
        torch = require("torch")
        new = input_ids[0, self._seen :].tolist()
        self._seen = int(input_ids.shape[1])
        if new and not self._matcher.is_stopped():
            self._matcher.consume_tokens(new)
        masked = torch.full_like(scores, float("-inf"))
        allowed = self._allowed(int(scores.shape[1]))
        masked[:, allowed] = scores[:, allowed]
        return masked

    def _allowed(self, size: int) -> list[int]:
        if self._matcher.is_stopped() or self._matcher.is_error():
            return self._ends
        bits = np.unpackbits(np.frombuffer(self._matcher.compute_bitmask(), np.uint8), bitorder="little")
        found = np.flatnonzero(bits[:size]).tolist()
        return found or self._ends
