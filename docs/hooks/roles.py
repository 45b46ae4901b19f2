"""Hook of mkdocs: roles such as ``:class:`` before names in docstrings, which editors read, are left out of pages."""

from __future__ import annotations

import re
from typing import Any

_ROLE = re.compile(r":(?:attr|class|data|func|meth|mod): ?(?=<code>)")
#: names after a role may say their whole path, of which "~" shows the last part
_PATH = re.compile(r"<code>~?(?:[\w.]+\.)?(\w+)</code>")


def on_page_content(html: str, **_: Any) -> str:
    """The page without roles."""
    pieces = _ROLE.split(html)
    return pieces[0] + "".join(_PATH.sub(r"<code>\1</code>", piece, count=1) for piece in pieces[1:])
