"""What can happen to a file: bytes, words, numbers, headers, and what else can lie in its place."""

import os
import random
import re
import struct
import zlib
from pathlib import Path

WORDS = (
    *(
        "",
        "0",
        "-0",
        "-1",
        "1e999",
        "nan",
        "inf",
        "1e-300",
        "99999999999999999999",
        "0.1 0.1",
        "true",
        "null",
        "~",
    ),
    *(
        "#",
        "[",
        "{",
        "]",
        "}",
        ":",
        "- ",
        "!!python/object:os.system x",
        "!x 3",
        "&a",
        "*a",
        "%YAML 9.9",
        "%TAG ! a:",
    ),
    *(
        "---",
        "\x00",
        "\x1b[31m",
        "é",
        "\u2028",
        "..",
        "../../x.png",
        "/etc/passwd",
        "/dev/zero",
        "rgb/000001.png",
    ),
    *("a" * 5000, "1" * 400, "[" * 3000, "{a: " * 3000, "package://x/y.sdf", "file:///dev/zero", "<a>", "&x;"),
)
SIZES = (0, 1, 31, 33, 20000, 30000, 60000, 65535, 2**31 - 1, 2**32 - 1)


def mutated(content: bytes, rng: random.Random) -> bytes:
    """The content with a few things done to it."""
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        change = rng.choice(_BYTES if not _is_text(content) or rng.random() < 0.2 else _TEXT)
        content = change(content, rng)
    return content


def misplaced(path: Path, rng: random.Random) -> None:
    """Something else in the place of a file: nothing, a folder, a pipe, a device, a link, or far too much."""
    path.unlink(missing_ok=True)
    kind = rng.randrange(9)
    if kind == 1:
        path.mkdir()
    elif kind == 2:
        os.mkfifo(path)
    elif kind < 8:
        elsewhere = path.parent.parent / "elsewhere"
        targets = ("/dev/zero", "/dev/full", path.name, "/nowhere", "/etc/passwd", str(elsewhere))
        path.symlink_to(rng.choice(targets))
    elif kind == 8:
        with path.open("wb") as file:
            file.truncate(3 * 2**30)


def resized_png(content: bytes, rng: random.Random) -> bytes:
    """A PNG whose header claims another size, or another kind, with a right check sum."""
    if len(content) < 33:  # it was cut before
        return content
    head = bytearray(content[:33])
    field = rng.choice((16, 20, 24, 25))
    if field < 24:
        head[field : field + 4] = struct.pack(">I", rng.choice(SIZES))
        if rng.random() < 0.5:
            head[16:24] = struct.pack(">II", *(rng.choice(SIZES) for _ in range(2)))
    else:
        head[field] = rng.choice((0, 1, 2, 3, 4, 6, 8, 16, 64, 255))
    head[29:33] = struct.pack(">I", zlib.crc32(head[12:29]))
    return bytes(head) + content[33:]


def resized_jpeg(content: bytes, rng: random.Random) -> bytes:
    """A JPEG whose frame header claims another size."""
    start = content.find(b"\xff\xc0")
    if start < 0:
        return content
    size = struct.pack(">HH", *(min(rng.choice(SIZES), 65535) for _ in range(2)))
    return content[: start + 5] + size + content[start + 9 :]


def chunked_png(content: bytes, rng: random.Random) -> bytes:
    """A PNG with another chunk in it: animation, a colour profile, text, or one that nobody knows."""
    kind = rng.choice(
        (b"acTL", b"fcTL", b"fdAT", b"iCCP", b"zTXt", b"eXIf", b"tRNS", b"PLTE", b"quEr", b"IEND")
    )
    data = rng.choice(
        (b"", rng.randbytes(26), struct.pack(">II", 2**31 - 1, 0), b"a\0\0" + zlib.compress(bytes(10**6)))
    )
    chunk = struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    return content[:33] + chunk + content[33:]


def _is_text(content: bytes) -> bool:
    return b"\0" not in content[:200] and content[:1] != b"\xff"


def _cut(content: bytes, rng: random.Random) -> bytes:
    return content[: rng.randrange(len(content) + 1)]


def _flip(content: bytes, rng: random.Random) -> bytes:
    changed = bytearray(content or b"x")
    for _ in range(rng.choice((1, 1, 2, 8, 64))):
        changed[rng.randrange(len(changed))] = rng.choice((0, 1, 127, 128, 255, rng.randrange(256)))
    return bytes(changed)


def _number(content: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(content) + 1)
    form = rng.choice((">I", "<I", ">H", ">q"))
    limit = 2 ** (8 * struct.calcsize(form)) if form != ">q" else 2**63
    return content[:at] + struct.pack(form, rng.choice(SIZES) % limit) + content[at + struct.calcsize(form) :]


def _insert(content: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(content) + 1)
    return content[:at] + rng.randbytes(rng.choice((1, 4, 100, 5000))) + content[at:]


def _drop(content: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(content) + 1)
    return content[:at] + content[at + rng.choice((1, 4, 100)) :]


def _twice(content: bytes, rng: random.Random) -> bytes:
    at, end = sorted(rng.randrange(len(content) + 1) for _ in range(2))
    return content[:end] + content[at:]


def _noise(content: bytes, rng: random.Random) -> bytes:
    return rng.choice(
        (b"", b"\0" * 1000, rng.randbytes(rng.randrange(2000)), b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff\xd9")
    )


def _word(content: bytes, rng: random.Random) -> bytes:
    """A number, a name or a quoted text becomes another word."""
    places = list(re.finditer(rb"[-+.\w/]+", content))
    if not places:
        return rng.choice(WORDS).encode()
    place = rng.choice(places)
    return content[: place.start()] + rng.choice(WORDS).encode() + content[place.end() :]


def _line(content: bytes, rng: random.Random) -> bytes:
    lines = content.split(b"\n")
    at = rng.randrange(len(lines))
    match rng.randrange(5):
        case 0:
            del lines[at]
        case 1:
            lines.insert(at, lines[at])
        case 2:
            lines[at], lines[at - 1] = lines[at - 1], lines[at]
        case 3:
            lines.insert(at, rng.choice(WORDS).encode())
        case 4:
            lines[at] = b" " * rng.randrange(9) + lines[at].strip()
    return b"\n".join(lines)


def _nested(content: bytes, rng: random.Random) -> bytes:
    opening, closing = rng.choice(
        ((b"[", b"]"), (b'{"a":', b"}"), (b"<a>", b"</a>"), (b"- ", b""), (b"a: {", b"}"))
    )
    deep = rng.choice((20, 200, 3000, 100_000))
    at = rng.randrange(len(content) + 1)
    return content[:at] + opening * deep + rng.choice((b"", b"1" + closing * deep)) + content[at:]


_BYTES = (_cut, _flip, _number, _insert, _drop, _twice, _noise)
_TEXT = (_word, _word, _word, _line, _line, _cut, _flip, _twice, _nested, _noise)
