"""A headless Chromium that tests can ask and press: the DevTools protocol over a websocket."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import time
import urllib.request
from pathlib import Path
from typing import Any

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
#: nothing of the browser's own may reach out or ask
QUIET = (
    "--headless",
    "--no-sandbox",
    "--no-first-run",
    "--disable-quic",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
#: pictures in 3D are drawn without a graphics card
DRAWING = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")


def dump(address: str, profile: Path, width: int, height: int = 900) -> str:
    """The page at an address as text, as it is after 4 s of its own time; ``profile`` is an empty folder."""
    assert BROWSER is not None
    size = (f"--user-data-dir={profile}", f"--window-size={width},{height}", "--virtual-time-budget=4000")
    command = [BROWSER, *QUIET, "--disable-gpu", *size, "--dump-dom", address]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout


class Page:
    """One page of a headless browser with an empty profile in ``folder``."""

    def __init__(self, folder: Path, width: int = 1200, height: int = 800) -> None:
        from websockets.sync.client import connect

        assert BROWSER is not None
        command = [BROWSER, *QUIET, *DRAWING, f"--user-data-dir={folder}", f"--window-size={width},{height}"]
        command += ["--remote-debugging-port=0", "about:blank"]
        self._process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            port = self._port(folder / "DevToolsActivePort")
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/json") as answer:
                pages = [target for target in json.load(answer) if target["type"] == "page"]
            self._socket = connect(pages[0]["webSocketDebuggerUrl"], max_size=None)
        except BaseException:
            self._process.kill()
            raise
        self._count = 0
        #: errors that the page wrote on its console or threw, and the addresses that it asked for
        self.errors: list[str] = []
        self.asked: list[str] = []
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")

    def _port(self, file: Path) -> int:
        end = time.monotonic() + 30.0
        while time.monotonic() < end:
            if file.is_file() and (lines := file.read_text().split()):
                return int(lines[0])
            time.sleep(0.05)
        raise TimeoutError("the browser did not start")

    def call(self, method: str, **parameters: Any) -> Any:
        """The result of a DevTools method."""
        self._count += 1
        self._socket.send(json.dumps({"id": self._count, "method": method, "params": parameters}))
        while True:
            message = json.loads(self._socket.recv(timeout=60.0))
            if message.get("id") == self._count:
                assert "error" not in message, message
                return message["result"]
            self._note(message)

    def _note(self, message: dict[str, Any]) -> None:
        what, data = message.get("method"), message.get("params", {})
        if what == "Runtime.exceptionThrown":
            details = data["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description") or details["text"])
        elif what == "Runtime.consoleAPICalled" and data["type"] in ("error", "assert"):
            self.errors.append(" ".join(str(a.get("value", a.get("description"))) for a in data["args"]))
        elif what == "Log.entryAdded" and data["entry"]["level"] == "error":
            self.errors.append(f"{data['entry']['text']} {data['entry'].get('url', '')}")
        elif what == "Network.requestWillBeSent":
            self.asked.append(data["request"]["url"])
        elif what == "Network.webSocketCreated":
            self.asked.append(data["url"])

    def open(self, url: str) -> None:
        """Load a page."""
        self.call("Page.navigate", url=url)

    def ask(self, expression: str) -> Any:
        """The value of an expression in the page."""
        found = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def wait(self, expression: str, timeout: float = 30.0) -> Any:
        """The value of an expression in the page as soon as it is true."""
        end = time.monotonic() + timeout
        while not (value := self.ask(expression)):
            if time.monotonic() > end:
                raise TimeoutError(f"not true within {timeout} s: {expression}; the page says: {self.text()[-800:]}")
            time.sleep(0.1)
        return value

    def text(self) -> str:
        """All text that the page shows."""
        return str(self.ask("(document.body || {innerText: ''}).innerText"))

    def mouse(self, kind: str, x: float, y: float) -> None:
        """Press, move or release the left button."""
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)

    def click(self, x: float, y: float) -> None:
        """Click at a place."""
        self.mouse("mousePressed", x, y)
        self.mouse("mouseReleased", x, y)

    def picture(self, path: Path) -> Path:
        """Write what the page looks like as PNG."""
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))
        return path

    def close(self) -> None:
        """End the browser."""
        try:
            self.call("Browser.close")
        except Exception:
            self._process.kill()
        self._socket.close()
        self._process.wait(timeout=20.0)
