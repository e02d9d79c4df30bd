"""A parser of the command line that says in one line what is wrong, and what was probably meant."""

import argparse
import re
import sys
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from typing import Any, NoReturn

BAD_INPUT = 2
"""Exit code."""


class Parser(argparse.ArgumentParser):
    """Refuses in one line; a misspelt command, option or choice is answered with the nearest that there is."""

    def error(self, message: str) -> NoReturn:
        """End the program with what is wrong, and what would be right."""
        if wrong := re.search(r"invalid choice: '([^']*)' \(choose from (.*)\)", message):
            meant = _nearest(wrong[1], re.findall(r"[\w-]+", wrong[2]))
            message += f"; {meant}" if meant else ""
        elif "are required" in message:  # said of `riseg --verison`, too
            message = "; ".join([message, *self._meant(self._words)])
        self.exit(BAD_INPUT, f"{self.prog}: {message}; see {self.prog} --help\n")

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: Any = None
    ) -> tuple[Any, list[str]]:
        """The same as argparse's, but a command refuses itself what it does not know."""
        self._words = sys.argv[1:] if args is None else list(args)
        known, unknown = super().parse_known_args(args, namespace)
        if unknown:
            self.error("; ".join([f"unrecognized arguments: {' '.join(unknown)}", *self._meant(unknown)]))
        return known, unknown

    def _meant(self, words: Iterable[str]) -> list[str]:
        """Questions whether options were meant by words that begin like options, and are none."""
        options = [name for action in self._actions for name in action.option_strings]
        wrong = [word.partition("=")[0] for word in words if word.startswith("-")]
        return [meant for word in wrong if word not in options and (meant := _nearest(word, options))]


def _nearest(word: str, names: Iterable[str]) -> str:
    """A question with the name that a word is most like; empty where it is like none."""
    near = get_close_matches(word, list(names), n=1)
    return f"did you mean {near[0]}?" if near else ""
