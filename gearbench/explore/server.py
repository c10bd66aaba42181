"""Local server of the live page."""

from __future__ import annotations

import gc
import socket
from collections.abc import Callable

from bokeh.application import Application
from bokeh.application.handlers.function import FunctionHandler
from bokeh.document import Document
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from tornado.httpserver import HTTPServer
from tornado.ioloop import IOLoop
from tornado.routing import AnyMatches, HostMatches, Rule, RuleRouter
from tornado.web import Application as TornadoApplication

from gearbench.errors import InputError
from gearbench.explore.guard import Policy, Refused, TokenMatches, new_token

ADDRESS = "127.0.0.1"


class Explorer:
    """Server on the loopback interface that serves only its own page.

    It refuses requests without the token of its address (403), websocket connections from other origins (403), and
    requests for other host names (404). Other users of this machine and pages of other sites therefore have no access,
    even if their host name resolves to this machine.

    Parameters
    ----------
    open_page
        Function that adds the page to a new document.
    port
        Port number; 0 takes any free port.

    Raises
    ------
    InputError
        If the port is not free.
    """

    def __init__(self, open_page: Callable[[Document], object], port: int = 0) -> None:
        listening = _listen(port)
        self.port: int = listening.getsockname()[1]
        self._token = new_token()

        def opened(document: Document) -> None:
            open_page(document)

        loop = IOLoop.current()
        hosts = [f"{name}:{self.port}" for name in (ADDRESS, "localhost")]
        pages = BokehTornado(
            {"/": Application(FunctionHandler(opened))}, extra_websocket_origins=hosts, use_index=False,
            include_headers=[], include_cookies=[], prefix=self._token,
        )  # fmt: skip
        pages.add_transform(Policy)
        refused = TornadoApplication([(".*", Refused)])
        known = RuleRouter([Rule(TokenMatches(self._token), pages), Rule(AnyMatches(), refused)])
        router = RuleRouter([Rule(HostMatches(r"(?:127\.0\.0\.1|localhost)$"), known)])
        http = HTTPServer(router)
        http.add_sockets([listening])
        self._server = BaseServer(loop, pages, http)
        self._loop, self._listening = loop, listening

    @property
    def url(self) -> str:
        """Address of the page, including the token."""
        return f"http://{ADDRESS}:{self.port}/{self._token}/"

    @property
    def sockets(self) -> list[socket.socket]:
        """Sockets that the server listens on."""
        return [self._listening]

    def run(self, ready: Callable[[], None] = lambda: None) -> None:
        """Serve until interrupted; ``ready`` is called once the page can be opened."""
        self._server.start()
        # a garbage collection of everything loaded so far would take longer than an answer
        gc.collect()
        gc.freeze()
        self._loop.add_callback(ready)
        try:
            self._loop.start()
        finally:
            self._server.stop()

    def stop(self) -> None:
        """Stop serving; may be called from any thread."""
        self._loop.add_callback(self._loop.stop)


def _listen(port: int) -> socket.socket:
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    listening.setblocking(False)
    try:
        listening.bind((ADDRESS, port))
    except (OSError, OverflowError) as error:
        listening.close()
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError("port", port, f"cannot be used ({reason.lower()})") from None
    listening.listen(128)
    return listening
