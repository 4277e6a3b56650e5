# SPDX-License-Identifier: Apache-2.0
"""Pronunciations by rule for words that the dictionary lacks (names of things a scene offers)."""

from __future__ import annotations

# Longest first; letters to the phones of cmudict. Rough, as English spelling is: good enough to find a word again.
_RULES: tuple[tuple[str, str], ...] = (
    ("tion", "SH AH N"), ("sion", "ZH AH N"), ("ture", "CH ER"), ("ough", "AO"), ("augh", "AO"), ("eigh", "EY"),
    ("igh", "AY"), ("tch", "CH"), ("dge", "JH"), ("sch", "SH"), ("air", "EH R"), ("ear", "IH R"), ("eer", "IH R"),
    ("oor", "AO R"), ("our", "AW ER"), ("ing", "IH NG"), ("ous", "AH S"), ("qu", "K W"), ("ch", "CH"), ("sh", "SH"),
    ("th", "TH"), ("ph", "F"), ("wh", "W"), ("ck", "K"), ("ng", "NG"), ("nk", "NG K"), ("kn", "N"), ("wr", "R"), ("gh", "G"),
    ("ar", "AA R"), ("er", "ER"), ("ir", "ER"), ("or", "AO R"), ("ur", "ER"), ("ai", "EY"), ("ay", "EY"), ("au", "AO"),
    ("aw", "AO"), ("ea", "IY"), ("ee", "IY"), ("ei", "IY"), ("eu", "Y UW"), ("ew", "UW"), ("ey", "IY"), ("ie", "IY"),
    ("oa", "OW"), ("oe", "OW"), ("oi", "OY"), ("oo", "UW"), ("ou", "AW"), ("ow", "OW"), ("oy", "OY"), ("ue", "UW"),
    ("bb", "B"), ("cc", "K"), ("dd", "D"), ("ff", "F"), ("gg", "G"), ("ll", "L"), ("mm", "M"), ("nn", "N"), ("pp", "P"),
    ("rr", "R"), ("ss", "S"), ("tt", "T"), ("zz", "Z"), ("ce", "S EH"), ("ci", "S IH"), ("cy", "S IY"), ("a", "AE"), ("b", "B"),
    ("c", "K"), ("d", "D"), ("e", "EH"), ("f", "F"), ("g", "G"), ("h", "HH"), ("i", "IH"), ("j", "JH"), ("k", "K"), ("l", "L"),
    ("m", "M"), ("n", "N"), ("o", "AA"), ("p", "P"), ("r", "R"), ("s", "S"), ("t", "T"), ("u", "AH"), ("v", "V"), ("w", "W"),
    ("x", "K S"), ("y", "IY"), ("z", "Z"),
)  # fmt: skip
_LONG = {"a": "EY", "e": "IY", "i": "AY", "o": "OW", "u": "UW"}
_DIGITS = ("Z IH R OW", "W AH N", "T UW", "TH R IY", "F AO R", "F AY V", "S IH K S", "S EH V AH N", "EY T", "N AY N")


def pronounce(word: str) -> str:
    """Return phones of cmudict for a word, by spelling; never empty."""
    letters = "".join(letter for letter in word.lower() if letter.isalnum())
    phones: list[str] = []
    position = 0
    while position < len(letters):
        letter = letters[position]
        if letter.isdigit():
            phones.append(_DIGITS[int(letter)] if letter.isascii() else "AH")
            position += 1
        elif letter in _LONG and _silent_e(letters, position):
            phones.append(_LONG[letter])
            position += 1
        elif letter == "e" and position == len(letters) - 1 and len(letters) > 3:
            position += 1
        else:
            spelling, sound = next((rule for rule in _RULES if letters.startswith(rule[0], position)), (letter, "AH"))
            phones.append(sound)
            position += len(spelling)
    return " ".join(phones) or "AH"


def _silent_e(letters: str, position: int) -> bool:
    """Whether a vowel is long because of an e after the next consonant, at the word's end: "plate"."""
    return position == len(letters) - 3 and letters.endswith("e") and letters[position + 1] not in "aeiouwxy"
