"""What a segmentation says of a recording on the terminal, while it goes on."""

from rich.console import Console

from riseg_drake.host.terminal import one_line

MOST_LINES = 10
"""More notes than this are counted on the terminal; the summary has them all."""


class ToldNotes:
    """Tells every note once, and no more than a person can read."""

    def __init__(self, console: Console):
        self._console = console
        self._told: set[str] = set()

    def tell(self, notes: list[str]) -> None:
        """Say what was not said yet."""
        for note in notes:
            if note in self._told:
                continue
            self._told.add(note)
            if len(self._told) <= MOST_LINES:
                self._console.print(
                    one_line(note), style="yellow", markup=False, highlight=False, soft_wrap=True
                )
            elif len(self._told) == MOST_LINES + 1:
                self._console.print("more of this kind is in the summary", style="yellow")
