"""Wrong on purpose: single-line mutations of the product, drawn by a seed, each run against its room's tests.

python -m tests.mutations --seed 0 --count 120
python -m tests.mutations --seed 0 --count 20 --rooms segmentation --jobs 2
python -m tests.mutations --seed 0 --count 20 --rooms segmentation --list

A mutant is killed by the first test that fails, at first by those of the file with its module's name, then by
all others of the room, the slow ones included. It lives in a copy of the tree; this one is left as it is.
"""

import argparse
import ast
import os
import shutil
import subprocess
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue

import numpy as np

TREE = Path(__file__).parents[1]
PRODUCT = "riseg_drake"
ROOMS = ("geometry", "segmentation", "pushing", "robot", "stations", "systems", "recording", "evaluation")
LONGEST = 600
"""s that a room's tests may take; a mutant that hangs is killed."""

Edit = tuple[ast.AST, str, str]
"""What is replaced, by which text, and what is wrong then."""


@dataclass(frozen=True)
class Mutation:
    """One line of the product made wrong."""

    file: str
    """Relative to the tree."""
    line: int
    kind: str
    before: str
    after: str
    source: str
    """Of the whole file, with it."""

    @property
    def room(self) -> str:
        """The folder of the product that the file lies in."""
        return Path(self.file).parts[1]

    def __str__(self) -> str:
        return f"{self.file}:{self.line} {self.kind}: {self.before}  ->  {self.after}"


_COMPARISONS = {ast.Lt: ">=", ast.LtE: ">", ast.Gt: "<=", ast.GtE: "<", ast.Eq: "!=", ast.NotEq: "=="}
_COMMUTE = ("max", "min", "maximum", "minimum", "hypot", "array_equal")
"""Functions of two values that are the same in either order: to swap them is no mistake."""
_OPERATORS = {ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.BitAnd: "|", ast.BitOr: "&"}


def edits(tree: ast.AST, source: str) -> Iterator[Edit]:
    """All single mutations of a module, in the order in which its nodes are walked."""

    def text(node: ast.AST) -> str:
        return ast.get_source_segment(source, node) or ""

    for node in _code(tree):
        match node:
            case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _COMPARISONS:
                turned = f"(({text(left)}) {_COMPARISONS[type(op)]} ({text(right)}))"
                yield node, turned, "comparison flipped"
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS and not _of_text(node):
                yield node, f"(({text(left)}) {_OPERATORS[type(op)]} ({text(right)}))", "operator flipped"
                if isinstance(op, ast.Add | ast.Sub):
                    yield node, f"({text(left)})", "term dropped"
            case ast.UnaryOp(op=ast.USub() | ast.Invert() | ast.Not(), operand=operand):
                yield node, f"({text(operand)})", "sign dropped"
            case ast.BoolOp(values=[first, *_, last]):
                yield node, f"({text(first)})", "condition dropped"
                yield node, f"({text(last)})", "condition dropped"
            case ast.If(test=test) | ast.IfExp(test=test):
                yield test, f"(not ({text(test)}))", "condition turned"
            case ast.Call(args=[first, second, *_]) if not {type(first), type(second)} & {ast.Starred}:
                if text(first) != text(second) and text(node.func).split(".")[-1] not in _COMMUTE:
                    yield first, text(second), "arguments swapped"
            case ast.Constant(value=float(value)) if value != 0:
                yield node, repr(2 * value), "constant doubled"
            case ast.Constant(value=int(value)) if not isinstance(value, bool):
                yield node, repr(value + 1), "off by one"


def _code(tree: ast.AST) -> Iterator[ast.AST]:
    """The nodes that do something: no annotations, no text, no arguments of decorators."""
    queue = [tree]
    while queue:
        node = queue.pop(0)
        yield node
        left_out: list[ast.AST] = []
        match node:
            case ast.FunctionDef():
                arguments = [*node.args.args, *node.args.kwonlyargs]
                left_out = [*node.decorator_list, *arguments, *([node.returns] if node.returns else [])]
            case ast.ClassDef():
                left_out = list(node.decorator_list)
            case ast.AnnAssign():
                left_out = [node.annotation]
            case ast.JoinedStr() | ast.Raise():
                continue
        queue += [child for child in ast.iter_child_nodes(node) if child not in left_out]


def _of_text(node: ast.BinOp) -> bool:
    """Whether it joins text, or types."""
    return any(isinstance(n, ast.JoinedStr) or _is_text(n) for n in ast.walk(node))


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and (isinstance(node.value, str) or node.value is None)


def mutations_of(file: Path) -> list[Mutation]:
    """All mutations of a file that change one line of it, and can be compiled."""
    source = file.read_text()
    lines = source.splitlines(keepends=True)
    found = []
    for node, new, kind in edits(ast.parse(source), source):
        spans = [node.lineno, node.end_lineno]  # type: ignore[attr-defined]
        if spans[0] != spans[1]:
            continue
        row = spans[0] - 1
        # Columns are bytes.
        line = lines[row].encode()
        a, b = node.col_offset, node.end_col_offset  # type: ignore[attr-defined]
        if kind == "arguments swapped":
            after = _swapped(line, a, b, new)
        else:
            after = (line[:a] + new.encode() + line[b:]).decode()
        if after == lines[row]:
            continue
        mutated = "".join([*lines[:row], after, *lines[row + 1 :]])
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", SyntaxWarning)
                compile(mutated, str(file), "exec")
        except SyntaxError:
            continue
        name = str(file.relative_to(TREE))
        found.append(Mutation(name, row + 1, kind, lines[row].strip(), after.strip(), mutated))
    return found


def _swapped(line: bytes, a: int, b: int, second: str) -> str:
    """The line with what stands from column a to b, and the `second` that follows it, in each other's place."""
    at = line.find(second.encode(), b)
    if at < 0:
        return line.decode()
    return (line[:a] + second.encode() + line[b:at] + line[a:b] + line[at + len(second.encode()) :]).decode()


def drawn(rooms: Sequence[str], count: int, seed: int) -> list[Mutation]:
    """As many mutations, no two of one line, shared out evenly among rooms; in each any place is as likely."""
    rng = np.random.default_rng(seed)
    chosen = []
    for number, room in enumerate(rooms):
        share = count // len(rooms) + (number < count % len(rooms))
        every = [m for file in sorted((TREE / PRODUCT / room).glob("*.py")) for m in mutations_of(file)]
        lines: set[tuple[str, int]] = set()
        for index in rng.permutation(len(every)):
            place = (every[index].file, every[index].line)
            if len(lines) < share and place not in lines:
                lines.add(place)
                chosen.append(every[index])
    return chosen


def killed_by(mutation: Mutation, tree: Path) -> str:
    """The test of the room that fails in a copy of the tree with the mutation; empty if all pass."""
    file = tree / mutation.file
    right = file.read_text()
    own = tree / "tests" / mutation.room / f"test_{file.stem}.py"
    try:
        file.write_text(mutation.source)
        for tests in ([own] if own.is_file() else [], [own.parent]):
            if tests and (name := _first_failure(tree, tests)):
                return name
        return ""
    finally:
        file.write_text(right)


def _first_failure(tree: Path, tests: Sequence[Path]) -> str:
    """The first of some tests that fails, by name; empty if all pass."""
    environment = {**os.environ, "PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-n", "0", "-p", "no:cacheprovider", "--no-header"]
    try:
        run = subprocess.run(
            [*command, *map(str, tests)],
            cwd=tree,
            env=environment,
            capture_output=True,
            text=True,
            timeout=LONGEST,
        )
    except subprocess.TimeoutExpired:
        return f"no end in {LONGEST} s"
    if run.returncode == 0:
        return ""
    named = [line for line in run.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return named[0].split(" - ")[0] if named else f"pytest's exit code {run.returncode}"


def main() -> int:
    """Draw mutations, run them, say which live; 0 if 85 in a hundred of each room, 90 of all, are killed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seed", type=int, default=0, help="draws the mutations (0)")
    parser.add_argument("--count", type=int, default=120, help="how many, over all rooms (120)")
    parser.add_argument("--rooms", nargs="+", choices=ROOMS, default=ROOMS, help="in which (all)")
    parser.add_argument("--jobs", type=int, default=2, help="so many at once, each in a copy of the tree (2)")
    parser.add_argument("--list", action="store_true", help="only say which would be run")
    chosen = parser.parse_args()
    mutations = drawn(chosen.rooms, chosen.count, chosen.seed)
    if chosen.list:
        print(*mutations, sep="\n")
        return 0
    killed: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        copies: SimpleQueue[Path] = SimpleQueue()
        for job in range(chosen.jobs):
            copies.put(Path(folder) / str(job))
            shutil.copytree(
                TREE, Path(folder) / str(job), ignore=shutil.ignore_patterns(".git", "out", ".*cache")
            )

        def judged(mutation: Mutation) -> tuple[Mutation, str]:
            tree = copies.get()
            try:
                return mutation, killed_by(mutation, tree)
            finally:
                copies.put(tree)

        with ThreadPoolExecutor(chosen.jobs) as pool:
            for mutation, by in pool.map(judged, mutations):
                killed[mutation.room] += bool(by)
                print(f"{'killed' if by else 'LIVES '} {mutation}{f'  [{by}]' if by else ''}", flush=True)
    every = Counter(mutation.room for mutation in mutations)
    for room in every:
        print(f"{room}: {killed[room]} of {every[room]} killed")
    print(f"all: {killed.total()} of {every.total()} killed")
    enough = all(killed[room] >= 0.85 * every[room] for room in every)
    return 0 if enough and killed.total() >= 0.9 * every.total() else 1


if __name__ == "__main__":
    raise SystemExit(main())
