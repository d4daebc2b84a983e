"""Measure how easily the pages of the manual read.

    python benchmarks/readability.py [PAGE ...] [--words]

Per page: words of prose, Flesch reading ease (206.835 - 1.015 words per sentence - 84.6 syllables
per word; Flesch 1948), the longest sentence, and words with a private meaning. Code, tables,
formulas, headings and the targets of links do not count; code within a line counts as one word.
--words lists each private word with its line, for a person to judge.
"""

import argparse
import json
import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGES = (
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *sorted((ROOT / "docs").glob("*.md")),
    *sorted((ROOT / "docs").glob("*.ipynb")),
)
EASE = 45.0  # Flesch reading ease that a page of prose should reach; a quality newspaper has 40-50
LONGEST = 35  # words that no sentence should exceed
PRIVATE = re.compile(  # words that earlier pages used with a meaning of their own
    r"\b(held|holds?(?! for\b)|told|tells?|says?|said|fall-?backs?|raised|looks?|lead|"
    r"looked(?! up)|"
    r"seen twice|both saw|left out in turn|what is left|what remains|misfits?|believed|believes|"
    r"made-up|lies|lie|lay|stands?|lacks?|lacked|beside|apart|the way|weak stretch(?:es)?|"
    r"stretch(?:es)?|by itself|whole or not at all|can't be told|look alike|mechanisms?)\b",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Reading:
    """Readability of a page.

    Parameters
    ----------
    words : int
    ease : float
        Flesch reading ease, 0 (hard) to 100.
    longest : str
        The longest sentence.
    private : tuple of (int, str, str)
        Line, word and text of the line of each private word.
    """

    words: int
    ease: float
    longest: str
    private: tuple


def text_of(path):
    """The Markdown of a page; of a notebook that of its text cells."""
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".ipynb":
        return text
    cells = [cell for cell in json.loads(text)["cells"] if cell["cell_type"] == "markdown"]
    return "\n\n".join("".join(cell["source"]) for cell in cells)


def without(pattern, text):
    """The text with what matches a pattern made blank, so that lines keep their numbers."""
    return re.sub(pattern, lambda match: "\n" * match[0].count("\n"), text, flags=re.S | re.M)


def prose(text):
    """The sentences that a reader reads, line by line where they stood."""
    for pattern in (
        r"^```.*?^```",
        r"\$\$.*?\$\$",
        r"<!--.*?-->",
        r"^#.*?$",
        r"^ *\|.*?$",
        r"!\[[^\]]*\]\([^)]*\)",
    ):
        text = without(pattern, text)
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"`[^`]*`", "code", text)
    text = re.sub(r"\$[^$]*\$", "x", text)
    return re.sub(r"[*_]+|https?://\S+", "", text)


def sentences(text):
    """Sentences of prose, which end at full stops, with an item of a list, and at blank lines."""
    for block in re.split(r"\n\s*\n|\n\s*(?:[-*]|\d+\.)\s+|\A\s*(?:[-*]|\d+\.)\s+", text):
        for one in re.split(r"(?<=[.!?])\s+(?=[A-Z0-9(\"x]|code)", " ".join(block.split())):
            if words_of(one):
                yield one


def words_of(sentence):
    """Words of a sentence: letters, with an apostrophe or hyphens within."""
    return re.findall(r"[A-Za-zÀ-ÿ]+(?:['’-][A-Za-zÀ-ÿ]+)*", sentence)


def syllables(word):
    """Number of the groups of vowels, without a silent e at the end."""
    word = re.sub(r"[^a-zà-ÿ]", "", word.lower())
    count = len(re.findall(r"[aeiouyà-ÿ]+", word))
    is_silent = re.search(r"[^aeiouyl]e$|[^aeiouydt]ed$|[^aeiouysxz]es$", word)
    return max(count - bool(is_silent), 1)


def reading(text):
    """Readability of a page of Markdown."""
    plain = prose(text)
    all_sentences = list(sentences(plain))
    words = [word for sentence in all_sentences for word in words_of(sentence)]
    if not words:
        return Reading(0, 100.0, "", ())
    per_sentence = len(words) / len(all_sentences)
    per_word = sum(map(syllables, words)) / len(words)
    private = tuple(
        (number, match[0], line.strip())
        for number, line in enumerate(plain.splitlines(), start=1)
        for match in PRIVATE.finditer(line)
    )
    ease = 206.835 - 1.015 * per_sentence - 84.6 * per_word
    return Reading(
        len(words), ease, max(all_sentences, key=lambda one: len(words_of(one))), private
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pages", nargs="*", type=Path, help="Markdown or notebooks; all if none")
    parser.add_argument("--words", action="store_true", help="list private words with their lines")
    arguments = parser.parse_args()
    print(f"{'page':34} words  Flesch  longest  private")
    found = {page: reading(text_of(page)) for page in arguments.pages or PAGES}
    for page, one in found.items():
        long = len(words_of(one.longest))
        marks = ("*" if one.ease < EASE else " "), ("*" if long > LONGEST else " ")
        print(
            f"{page.name:34} {one.words:5} {one.ease:6.1f}{marks[0]} {long:7}{marks[1]} "
            f"{len(one.private):7}"
        )
        if long > LONGEST:
            print(f"    {one.longest}")
    total = sum(one.words for one in found.values())
    count = sum(len(one.private) for one in found.values())
    print(f"{'all':34} {total:5} {'':7} {'':8} {count:7}")
    if arguments.words:
        for page, one in found.items():
            for number, word, line in one.private:
                print(f"{page.name}:{number}: {word}: {line}")


if __name__ == "__main__":
    main()
