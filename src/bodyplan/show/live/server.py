"""The viewer's web server: on this machine only, and for its own page only."""

from __future__ import annotations

import contextlib
import io
import logging
import socket
from collections.abc import Iterator
from ipaddress import ip_address
from typing import Any

from bodyplan.arrays import whole
from bodyplan.errors import InputError, MissingExtraError

HOST = "127.0.0.1"
#: port where nobody says, if it is free
PORT = 8080
#: most ports there are
LAST_PORT = 65535


class _RefusedError(Exception):
    """A page of another origin asked for a connection."""


def library() -> Any:
    """viser; MissingExtraError where it is not installed."""
    try:
        import viser
    except ImportError as error:
        raise MissingExtraError("viser", "view", "the live viewer") from error
    return viser


def loopback(host: str) -> str:
    """``host`` as an address of this machine alone; InputError for any other: nothing may leave the machine."""
    name = "127.0.0.1" if host == "localhost" else str(host)
    try:
        inside = ip_address(name).is_loopback
    except ValueError:
        inside = False
    if not inside:
        raise InputError(f"host: the viewer listens on this machine only (127.0.0.1 or localhost), got {host!r}.")
    return name


def start(title: str, port: int | None = None, host: str = HOST) -> Any:
    """A running viser server. ``port`` None: :data:`PORT`, or any free one where it is busy; 0: any free one.

    Raises InputError for a host that is not this machine, a port out of range or busy, MissingExtraError without viser.
    """
    where = loopback(host)
    asked = PORT if port is None else whole(port, "port", at_least=0, at_most=LAST_PORT)
    if asked and not free(where, asked):
        if port is not None:
            raise InputError(f"port: {asked} is busy; choose another one, or 0 for any that is free.")
        asked = 0
    viser = library()

    class Server(viser.ViserServer):  # type: ignore[misc, name-defined]  # viser is loaded when it is needed
        """A server that hands out no address outside this machine, whatever its page asks for."""

        def request_share_url(self, verbose: bool = True) -> str | None:
            return None

        def disconnect_share_url(self) -> None:
            pass

    with quiet():
        server = Server(host=where, port=asked, label=title, verbose=False)
    if asked and server.get_port() != asked:  # taken in between
        stop(server)
        raise InputError(f"port: {asked} is busy; choose another one, or 0 for any that is free.")
    _own_pages_only(server)
    return server


def stop(server: Any) -> None:
    """End a server and its threads."""
    with quiet():
        server.stop()


def free(host: str, port: int) -> bool:
    """Whether a server may listen on a port."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError:
            return False
    return True


def address(server: Any) -> str:
    """What to open in a browser."""
    host = server.get_host()
    return f"http://[{host}]:{server.get_port()}" if ":" in host else f"http://{host}:{server.get_port()}"


def own_origin(origin: str | None, port: int) -> bool:
    """Whether a page of ``origin`` is the viewer's own; programs that are no browsers have none."""
    return origin is None or origin in {f"http://{host}:{port}" for host in ("127.0.0.1", "localhost", "[::1]")}


def _own_pages_only(server: Any) -> None:
    """Refuse connections of pages from elsewhere that a browser on this machine has open."""
    inner = server._websock_server
    logging.getLogger("websockets.server").addFilter(_known)

    async def guard(connection: Any) -> None:
        there = inner._live_connections[connection.client_id]
        origin = there.request.headers.get("Origin")
        if not own_origin(origin, server.get_port()):
            await there.close(1008, "this viewer is for its own page only")
            raise _RefusedError(f"a page of {origin} asked for the viewer's data")

    inner.on_client_connect(guard)


def _known(record: logging.LogRecord) -> bool:
    """Whether a log record is worth printing: a refused page is not."""
    return not (record.exc_info and isinstance(record.exc_info[1], _RefusedError))


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """viser tells of itself on the terminal; the viewer has its own words."""
    with contextlib.redirect_stdout(io.StringIO()):
        yield
