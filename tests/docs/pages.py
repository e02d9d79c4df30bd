"""The pages that people read, and what stands in them: blocks, code between backticks, tables."""

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token

CHECKOUT = Path(__file__).parents[2]
PAGES = sorted([CHECKOUT / "README.md", CHECKOUT / "CONTRIBUTING.md", *(CHECKOUT / "docs").rglob("*.md")])


def name(page: Path) -> str:
    """As tests call it."""
    return str(page.relative_to(CHECKOUT))


@dataclass(frozen=True)
class Block:
    """What stands between two fences."""

    page: Path
    line: int
    """Of its first line in the page, from 1."""
    language: str
    text: str

    def __str__(self) -> str:
        return f"{name(self.page)}:{self.line}"


@cache
def tokens(page: Path) -> list[Token]:
    """What a page consists of."""
    return MarkdownIt().enable("table").parse(page.read_text())


def blocks(page: Path, language: str | None = None) -> Iterator[Block]:
    """All of a page in order, or those of one language; `` ``` `` without a word has the language ""."""
    for token in tokens(page):
        if token.type in ("fence", "code_block"):
            assert token.map is not None
            block = Block(page, token.map[0] + 2, token.info.strip(), token.content)
            if language in (None, block.language):
                yield block


def all_blocks(language: str | None = None) -> list[Block]:
    """Of all pages."""
    return [block for page in PAGES for block in blocks(page, language)]


def code_spans(page: Path) -> Iterator[str]:
    """What stands between backticks in running text and in tables, each on one line."""
    for token in tokens(page):
        for child in token.children or ():
            if child.type == "code_inline":
                yield " ".join(child.content.split())


SHELL_WORDS = {"do", "done", "then", "fi", "else"}
"""They begin a command without being its name."""


def commands(block: Block) -> list[list[str]]:
    """The words of each command of a bash block, without comments and assignments.

    Of a loop one round is taken: a variable has the first value that `for` gives it.
    """
    found: list[list[str]] = []
    variables: dict[str, str] = {}
    for line in block.text.replace("\\\n", " ").splitlines():
        lexer = shlex.shlex(line, posix=True, punctuation_chars="&|;")
        lexer.whitespace_split, lexer.commenters = True, "#"
        words: list[str] = []
        for word in [*lexer, ";"]:
            if not set(word) <= set("&|;"):
                words.append(re.sub(r"\$(\w+)", lambda name: variables.get(name[1], name[0]), word))
                continue
            while words and (words[0] in SHELL_WORDS or re.match(r"\w+=", words[0])):
                del words[0]
            if words[:1] == ["for"]:
                variables[words[1]] = words[3]
            elif words:
                found.append(words)
            words = []
    return found


def section(page: Path, heading: str) -> str:
    """The text below a heading of the second level, up to the next one."""
    found = re.search(rf"^## {re.escape(heading)}\n(.*?)(?=^## |\Z)", page.read_text(), re.M | re.S)
    assert found, f"{name(page)} has no section {heading!r}"
    return found[1]


def table_rows(text: str) -> list[list[str]]:
    """The cells of all tables in a text, without headings; each stripped."""
    rows = [line.strip().strip("|") for line in text.splitlines() if line.startswith("|")]
    cells = [[cell.strip() for cell in re.split(r"(?<!\\)\|", row)] for row in rows]
    rules = [i for i, row in enumerate(cells) if all(set(cell) <= set("-: ") for cell in row)]
    return [row for i, row in enumerate(cells) if i not in rules and i + 1 not in rules]
