"""The web server of the live view, by default reachable from this machine only."""

from __future__ import annotations

import io
import socket
from contextlib import redirect_stdout
from ipaddress import ip_address
from typing import TYPE_CHECKING, Any

from mjtactile.errors import ViewError

if TYPE_CHECKING:
    import viser

LOOPBACK, PORT = "127.0.0.1", 8080
_LAST_PORT = 65535


def check_host(host: str, *, anyone: bool) -> None:
    """Refuse an address that other machines can reach, unless `anyone` may: every visitor controls the simulation.

    Raises:
        ViewError: other machines may not connect, but can reach the address.
    """
    if not anyone and not _is_loopback(host):
        raise ViewError(
            f"host {host!r} can be reached from other machines, and whoever opens the page controls the simulation. "
            f"Leave host at {LOOPBACK} (from another machine: ssh -L {PORT}:localhost:{PORT} this-machine), or allow "
            "it: --anyone, or Viewer(..., anyone=True)."
        )


def open_server(host: str, port: int, *, anyone: bool) -> viser.ViserServer:
    """Start a server.

    Args:
        host: address to listen on.
        port: first port to try; 0 for any free port.
        anyone: see `check_host`.

    Raises:
        ViewError: other machines may not connect but can reach the address, this machine cannot listen on the
            address, or the port is not valid.
    """
    check_host(host, anyone=anyone)
    _check_address(host, port)
    import viser

    class LocalServer(viser.ViserServer):
        """viser's server without its tunnel, which would make the page public on the internet."""

        def request_share_url(self, verbose: bool = True) -> str | None:
            return None

    with redirect_stdout(io.StringIO()):  # suppresses viser's own output
        return LocalServer(host=host, port=port, label="mjtactile", verbose=False)


def _check_address(host: str, port: Any) -> None:
    """Refuse an address that cannot be listened on: viser would wait for its server for ever."""
    if isinstance(port, bool) or not isinstance(port, int) or not 0 <= port <= _LAST_PORT:
        raise ViewError(f"port = {port!r}; expected a whole number from 1 to {_LAST_PORT}, or 0 for any free port.")
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, protocol) as tried:
            tried.bind(address)
    except (OSError, UnicodeError) as error:
        raise ViewError(
            f"cannot listen on host {host!r}: {error}. Expected an address of this machine: {LOOPBACK}, or 0.0.0.0 for "
            "all its addresses."
        ) from error


def _is_loopback(host: str) -> bool:
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
