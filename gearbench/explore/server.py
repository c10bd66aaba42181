"""Local server of a live page: stored designs, or the design bench."""

from __future__ import annotations

import gc
from collections.abc import Callable

from bokeh.application import Application
from bokeh.application.handlers.function import FunctionHandler
from bokeh.document import Document
from bokeh.server.server import Server

from gearbench.errors import InputError


class Explorer:
    """Server of one page on the loopback interface; Bokeh refuses connections from pages of other origins.

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
        def opened(document: Document) -> None:  # Bokeh's annotation wants a function that returns None
            open_page(document)

        page = Application(FunctionHandler(opened))
        try:
            self._server = Server({"/": page}, address="127.0.0.1", port=port)
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise InputError("port", port, f"cannot be used ({reason.lower()})") from None
        self.port: int = self._server.port or port

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://localhost:{self.port}/"

    def run(self, ready: Callable[[], None] = lambda: None) -> None:
        """Serve until interrupted; ``ready`` is called once the page can be opened."""
        loop = self._server.io_loop
        self._server.start()
        # later collections skip what is frozen: to look through all that is loaded would take longer than an answer
        gc.collect()
        gc.freeze()
        loop.add_callback(ready)
        try:
            loop.start()
        finally:
            self._server.stop()

    def stop(self) -> None:
        """Stop serving; may be called from any thread."""
        self._server.io_loop.add_callback(self._server.io_loop.stop)
