# SPDX-License-Identifier: Apache-2.0
"""Pronunciations by rule for words that the dictionary lacks (names of things a scene offers)."""

from __future__ import annotations

# Longest first; letters to the phones of cmudict. Rough, as English spelling is: good enough to find a word again.
_SPELLINGS = """
tion=SH+AH+N sion=ZH+AH+N ture=CH+ER ough=AO augh=AO eigh=EY igh=AY tch=CH dge=JH sch=SH air=EH+R
ear=IH+R eer=IH+R oor=AO+R our=AW+ER ing=IH+NG ous=AH+S qu=K+W ch=CH sh=SH th=TH ph=F wh=W ck=K
ng=NG nk=NG+K kn=N wr=R gh=G ar=AA+R er=ER ir=ER or=AO+R ur=ER ai=EY ay=EY au=AO aw=AO ea=IY ee=IY
ei=IY eu=Y+UW ew=UW ey=IY ie=IY oa=OW oe=OW oi=OY oo=UW ou=AW ow=OW oy=OY ue=UW bb=B cc=K dd=D ff=F
gg=G ll=L mm=M nn=N pp=P rr=R ss=S tt=T zz=Z ce=S+EH ci=S+IH cy=S+IY a=AE b=B c=K d=D e=EH f=F g=G
h=HH i=IH j=JH k=K l=L m=M n=N o=AA p=P r=R s=S t=T u=AH v=V w=W x=K+S y=IY z=Z
"""
_RULES: tuple[tuple[str, str], ...] = tuple(
    (spelling, sound.replace("+", " ")) for spelling, _, sound in (rule.partition("=") for rule in _SPELLINGS.split())
)
# Southern British forms that no rule gives.
_BRITISH = {
    "banana": "B AH N AA N AH",
    "bananas": "B AH N AA N AH Z",
    "basket": "B AA S K AH T",
    "glass": "G L AA S",
    "grasp": "G R AA S P",
    "can't": "K AA N T",
    "tomato": "T AH M AA T OW",
    "vase": "V AA Z",
    "plastic": "P L AA S T IH K",
    "last": "L AA S T",
    "after": "AA F T AH",
}
_CONSONANTS = frozenset(
    [
        "B",
        "CH",
        "D",
        "DH",
        "F",
        "G",
        "HH",
        "JH",
        "K",
        "L",
        "M",
        "N",
        "NG",
        "P",
        "S",
        "SH",
        "T",
        "TH",
        "V",
        "W",
        "Y",
        "Z",
        "ZH",
    ]
)


def with_accents(word: str, variants: tuple[str, ...]) -> tuple[str, ...]:
    """Return pronunciations (cmudict) with those of speakers who drop the r after a vowel."""
    found = dict.fromkeys(variants)
    for phones in variants:
        found.setdefault(_without_r(phones.split()), None)
    if word in _BRITISH:
        found.setdefault(_BRITISH[word], None)
    return tuple(found)


def _without_r(phones: list[str]) -> str:
    made: list[str] = []
    for index, phone in enumerate(phones):
        following = phones[index + 1] if index + 1 < len(phones) else ""
        closed = not following or following in _CONSONANTS
        if phone == "ER" and closed and index > 0 and phones[2:]:
            made.append("AH")
        elif phone == "R" and closed and index > 0 and phones[index - 1] in ("AO", "AA", "EH", "IH", "UH", "AE"):
            if phones[index - 1] in ("EH", "IH", "UH"):
                made.append("AH")
        else:
            made.append(phone)
    return " ".join(made)


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
        elif letter == "e" and position == len(letters) - 1 and letters[3:]:
            position += 1
        else:
            spelling, sound = next((rule for rule in _RULES if letters.startswith(rule[0], position)), (letter, "AH"))
            phones.append(sound)
            position += len(spelling)
    return " ".join(phones) or "AH"


def _silent_e(letters: str, position: int) -> bool:
    """Whether a vowel is long because of an e after the next consonant, at the word's end: "plate"."""
    return position == len(letters) - 3 and letters.endswith("e") and letters[position + 1] not in "aeiouwxy"
