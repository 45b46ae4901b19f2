"""One HTML file that holds all it needs: styles, scripts, plotly, data; nothing is loaded from anywhere."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from typing import Any

from bodyplan.errors import MissingExtraError
from bodyplan.show.text import esc


def document(title: str, content: Iterable[str], data: Mapping[str, Any], scripts: Sequence[str]) -> str:
    """The whole HTML file. ``content``: HTML; ``data``: JSON types by the id of the element that will hold them;
    ``scripts``: names of the page's own scripts in the order in which they run; without any, plotly is left out."""
    texts = [WATCH, *([_plotly()] if scripts else []), *(_resource(f"{name}.js") for name in scripts)]
    return "\n".join(
        [
            "<!doctype html>",
            '<html lang="en"><head><meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{_policy(texts)}">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{esc(title)} – bodyplan</title>",
            f"<style>{_resource('report.css')}</style>",
            f"<script>{texts[0]}</script></head>",
            "<body><main>",
            *content,
            "</main>",
            *(_data(name, script_json(values)) for name, values in data.items()),
            *(f"<script>{text}</script>" for text in texts[1:]),
            "</body></html>\n",
        ]
    )


#: keeps what goes wrong in the page as an attribute of it, where a test or a curious person finds it
WATCH = (
    'const note=t=>{const d=document.documentElement.dataset;d.problems=(d.problems?d.problems+" | ":"")+t};'
    'addEventListener("error",e=>note(e.message||"not loaded"),true);'
    'addEventListener("unhandledrejection",e=>note(e.reason));'
    'addEventListener("securitypolicyviolation",e=>note("blocked: "+e.violatedDirective+" "+e.blockedURI));'
)


def _policy(scripts: list[str]) -> str:
    """Nothing is loaded from anywhere, and no script runs but the report's own, whatever texts a mission
    holds."""
    hashes = [base64.b64encode(hashlib.sha256(s.encode("utf-8")).digest()).decode("ascii") for s in scripts]
    allowed = " ".join(f"'sha256-{h}'" for h in hashes)
    rules = {
        "default-src": "'none'",
        "script-src": allowed,
        "style-src": "'unsafe-inline'",
        "img-src": "data: blob:",
        "base-uri": "'none'",
        "form-action": "'none'",
    }
    return "; ".join(f"{name} {value}" for name, value in rules.items())


def _plotly() -> str:
    try:
        from plotly.offline import get_plotlyjs
    except ImportError as error:
        raise MissingExtraError("plotly", "report", "writing a report") from error
    return str(get_plotlyjs())


def _resource(name: str) -> str:
    return resources.files("bodyplan.show").joinpath(name).read_text(encoding="utf-8")


def _data(name: str, text: str) -> str:
    return f'<script type="application/json" id="{name}">{text}</script>'


def script_json(data: Any) -> str:
    """JSON that may stand inside a script element, whatever texts are in it."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
