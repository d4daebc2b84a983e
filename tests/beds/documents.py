"""Comparison of docs/documents.md with the keys of a JSON document."""

import re

from tests.beds.places import ROOT

SHARED = "In several documents"
# fields whose keys are names: of effects, of kinds of rows, of families, of what a method gives
NAMED = {"detectable", "left_out", "channels", "families", "details", "determined"}
NAMED |= {"variance_ratio", "passes", "tied_with"}


def keys_of(value):
    "Every key in a document, those that are names left out"
    if isinstance(value, list):
        for item in value:
            yield from keys_of(item)
    if isinstance(value, dict):
        for key, item in value.items():
            yield key
            is_named = key in NAMED and isinstance(item, dict)
            yield from keys_of(list(item.values()) if is_named else item)


def undocumented(document):
    "Keys of a document that its section of docs/documents.md lacks"
    sections = (ROOT / "docs" / "documents.md").read_text().split("\n## ")
    name = re.fullmatch(r"mlscorr\.(\w+)/1", document["schema"])[1]
    own = {SHARED, f"{name}.json"}
    text = "".join(section for section in sections if section.partition("\n")[0] in own)
    assert f"{name}.json\n" in text
    return set(keys_of(document)) - set(re.findall(r"\w+", " ".join(re.findall("`(.*?)`", text))))
