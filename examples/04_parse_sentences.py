# SPDX-License-Identifier: Apache-2.0
"""Sentences to commands: object, action, target, relation, or the reason why a sentence is none.

Run it with: ./uncom exec python examples/04_parse_sentences.py
"""

from uncom_language.parser import parse_text
from uncom_language.types import Act

SENTENCES = (
    "take this mug and put it next to the plate",
    "put the second bowl from the left behind the cereal box",
    "pour the bottle into the cup, no, into the mug",
    "give me the banana and then push the can to the right",
    "what a lovely day",
)

for sentence in SENTENCES:
    print(f'"{sentence}"')
    for command in parse_text(sentence):
        if command.act is not Act.COMMAND:
            print("   ", command.act.name.lower(), command.reason)
            continue
        target = command.target.text if command.target else "-"
        print("   ", command.primitive.value, "|", command.object.text, "|", command.relation.value, "|", target)
