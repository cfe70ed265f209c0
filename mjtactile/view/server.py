"""The web server of the live view: on this machine alone, unless told otherwise."""

from __future__ import annotations

import io
from contextlib import redirect_stdout
from ipaddress import ip_address
from typing import TYPE_CHECKING

from mjtactile.errors import ViewError

if TYPE_CHECKING:
    import viser

LOOPBACK, PORT = "127.0.0.1", 8080


def check_host(host: str, *, anyone: bool) -> None:
    """Refuse to listen to other machines, unless told to: whoever reaches the page can push what is simulated.

    Args:
        host: address to listen on.
        anyone: whether other machines may connect.

    Raises:
        ViewError: they may not, but would reach that address.
    """
    if not anyone and not _is_loopback(host):
        raise ViewError(
            f"host {host!r} can be reached from other machines, and whoever opens the page can hold and push the "
            f"simulation. Leave it at {LOOPBACK} (from afar: ssh -L {PORT}:localhost:{PORT} this-machine), or allow "
            "it: --anyone, or Viewer(..., anyone=True)."
        )


def open_server(host: str, port: int, *, anyone: bool) -> viser.ViserServer:
    """Start a server.

    Args:
        host: address to listen on.
        port: the first to try; 0 for any that is free.
        anyone: see `check_host`.

    Raises:
        ViewError: see `check_host`.
    """
    check_host(host, anyone=anyone)
    import viser

    class LocalServer(viser.ViserServer):
        """Without viser's tunnel, through which anyone on the internet would reach the page."""

        def request_share_url(self, verbose: bool = True) -> str | None:
            return None

    with redirect_stdout(io.StringIO()):  # viser prints a table of its own
        return LocalServer(host=host, port=port, label="mjtactile", verbose=False)


def _is_loopback(host: str) -> bool:
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
