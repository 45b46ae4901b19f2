"""What all source code made from a robot is written with: names that C and Python allow, comments and texts of C."""

from __future__ import annotations

import re
import textwrap
import unicodedata
from collections.abc import Iterable, Sequence


def identifier(name: str, taken: Iterable[str] = (), prefix: str = "x") -> str:
    """``name`` with what C and Python do not allow in a name replaced by underscores, not among ``taken``."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    word = re.sub(r"[^A-Za-z0-9]+", "_", plain).strip("_")
    if not word or word[0].isdigit():
        word = f"{prefix}_{word}".rstrip("_")
    taken, unique, count = set(taken), word, 2
    while unique in taken:
        unique, count = f"{word}_{count}", count + 1
    return unique


def identifiers(names: Iterable[str], prefix: str) -> list[str]:
    """An identifier of its own for each name."""
    out: list[str] = []
    for name in names:
        out.append(identifier(name, out, prefix))
    return out


def filled(template: str, words: dict[str, str]) -> str:
    """A template with its words in capitals replaced, all at once; a word may be the beginning of a longer name."""
    return re.sub(rf"\b({'|'.join(words)})(?=\b|_)", lambda found: words[found[1]], template)


def comment(paragraphs: Sequence[str], indent: str = "") -> str:
    """A block comment of C; what would end it or start another is taken apart. Lines that begin with a space stay."""
    lines: list[str] = []
    for paragraph in paragraphs:
        clean = paragraph.replace("\n", " ").replace("*/", "* /").replace("/*", "/ *")
        lines.extend([clean] if clean.startswith(" ") else textwrap.wrap(clean, 110) or [""])
    if len(lines) == 1:
        return f"{indent}/* {lines[0]} */"
    return "\n".join([f"{indent}/* {lines[0]}", *(f"{indent}   {line}".rstrip() for line in lines[1:]), f"{indent}*/"])


def indices(prefix: str, names: Sequence[str]) -> str:
    """Lines of an enum of C: every name with its place."""
    return ",\n".join(f"    {prefix}{name} = {i}" for i, name in enumerate(names))


def literal(name: str) -> str:
    """A C string literal of UTF-8 bytes; what C could read otherwise is written in octal."""
    safe = {*range(32, 127)} - {ord(c) for c in '"\\?'}
    return '"' + "".join(chr(byte) if byte in safe else f"\\{byte:03o}" for byte in name.encode()) + '"'
