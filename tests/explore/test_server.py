"""The explorer's server: it answers its own pages; and the file that needs no server."""

import re
import socket
import threading
import urllib.error
import urllib.request
from functools import partial

import pytest

pytest.importorskip("bokeh", reason="the explorer needs the extra gearbench[explore]")

from gearbench.errors import InputError
from gearbench.explore.catalogue import catalogue
from tests.support.explore_designs import stored


@pytest.fixture(scope="module")
def designs():
    return catalogue([stored(60)])


@pytest.fixture(scope="module")
def explorer(designs):
    from gearbench.explore.live import Session
    from gearbench.explore.server import Explorer

    started, found = threading.Event(), []

    def serve():
        import asyncio

        asyncio.set_event_loop(loop := asyncio.new_event_loop())
        found.append(Explorer(partial(Session, designs)))
        found[0].run(started.set)
        loop.close()

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    assert started.wait(30)
    yield found[0]
    found[0].stop()
    thread.join(30)
    assert not thread.is_alive()


def status(url: str, **headers: str) -> int:
    try:
        with urllib.request.urlopen(urllib.request.Request(url, headers=headers), timeout=30) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        with error:
            return error.code


@pytest.fixture(scope="module")
def page(explorer):
    """The page as it is served: a few seconds of work."""
    with urllib.request.urlopen(explorer.url, timeout=120) as answer:
        return answer.read().decode()


def handshake(explorer, page, origin: str) -> str:
    """First line of the answer to a request for the connection that data goes through."""
    token = re.search(r'"token":"([^"]+)"', page)[1]
    with socket.create_connection(("127.0.0.1", explorer.port), timeout=30) as connection:
        lines = [
            "GET /ws HTTP/1.1", f"Host: 127.0.0.1:{explorer.port}", "Upgrade: websocket", "Connection: Upgrade",
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "Sec-WebSocket-Version: 13", f"Origin: {origin}",
            f"Sec-WebSocket-Protocol: bokeh, {token}", "", "",
        ]  # fmt: skip
        connection.sendall("\r\n".join(lines).encode())
        return connection.recv(4096).decode("latin-1").splitlines()[0]


def test_the_page_and_its_scripts_come_from_this_server(explorer, page):
    sources = re.findall(r'(?:src|href)="([^"]+)"', page)
    assert sources
    assert all(source.startswith(("static/", "/static/", "data:")) for source in sources)
    script = next(source for source in sources if "bokeh.min.js" in source)
    assert status(explorer.url + script.lstrip("/")) == 200


def test_its_own_pages_may_connect(explorer, page):
    assert " 101 " in handshake(explorer, page, explorer.url.rstrip("/"))


@pytest.mark.parametrize("origin", ["http://evil.example", "http://127.0.0.1:1", "http://localhost.evil.example"])
def test_other_origins_are_refused(explorer, page, origin):
    assert " 403 " in handshake(explorer, page, origin)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # Tornado leaves its socket open
def test_a_port_in_use_is_refused(explorer, designs):
    from gearbench.explore.live import Session
    from gearbench.explore.server import Explorer

    with pytest.raises(InputError, match="port"):
        Explorer(partial(Session, designs), explorer.port)


@pytest.mark.slow
def test_the_file_holds_all_it_needs(designs, tmp_path):
    from gearbench.explore.static import html

    text = html(designs, pictures=2)
    markup = re.sub(r"(<script[^>]*>).*?</script>", r"\1", text, flags=re.DOTALL)
    assert not re.search(r"<(?:script|link|img)[^>]+(?:src|href)=", markup)
    assert "Bokeh" in text
