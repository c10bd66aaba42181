"""The explorer's server: it answers this machine's own pages, and nobody else; and the file that needs no server."""

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
        return answer.headers, answer.read().decode()


@pytest.fixture(scope="module")
def handshake(explorer, page):
    """First line of the answer to a request for the connection that data goes through."""
    return partial(first_line, explorer, re.search(r'"token":"([^"]+)"', page[1])[1])


def first_line(explorer, token: str, origin: str, path: str = "") -> str:
    path = path or "/" + explorer.url.split("/")[3] + "/ws"
    with socket.create_connection(("127.0.0.1", explorer.port), timeout=30) as connection:
        lines = [
            f"GET {path} HTTP/1.1", f"Host: 127.0.0.1:{explorer.port}", "Upgrade: websocket", "Connection: Upgrade",
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "Sec-WebSocket-Version: 13", f"Origin: {origin}",
            f"Sec-WebSocket-Protocol: bokeh, {token}", "", "",
        ]  # fmt: skip
        connection.sendall("\r\n".join(lines).encode())
        return connection.recv(4096).decode("latin-1").splitlines()[0]


def test_the_page_and_its_scripts_come_from_this_server(explorer, page):
    sources = re.findall(r'(?:src|href)="([^"]+)"', page[1])
    assert sources
    own = explorer.url.removeprefix(f"http://127.0.0.1:{explorer.port}")
    assert all(source.startswith((f"{own}static/", "data:")) for source in sources)
    script = next(source for source in sources if "bokeh.min.js" in source)
    assert status(explorer.url + script.removeprefix(own)) == 200


def test_only_loopback_is_listened_on(explorer):
    (listening,) = [s for s in explorer.sockets if s.family == socket.AF_INET]
    assert listening.getsockname()[0] == "127.0.0.1"


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost"])
def test_its_own_pages_may_connect(explorer, handshake, host):
    assert " 101 " in handshake(f"http://{host}:{explorer.port}")


@pytest.mark.parametrize("origin", ["http://evil.example", "http://127.0.0.1:1", "http://localhost.evil.example"])
def test_other_origins_are_refused(handshake, origin):
    assert " 403 " in handshake(origin)


@pytest.mark.parametrize(
    "path", ["", "ws", "static/js/bokeh.min.js", "autoload.js", "metadata", "{most}/", "{most}{wrong}/ws"]
)
def test_without_the_token_everything_is_refused(explorer, handshake, path):
    token = explorer.url.split("/")[3]
    assert len(token) == 48
    path = "/" + path.format(most=token[:-1], wrong="0" if token[-1] != "0" else "1")
    origin = f"http://127.0.0.1:{explorer.port}"
    assert status(origin + path) == 403
    assert " 403 " in handshake(origin, path)


def test_scripts_in_place_are_forbidden_but_for_the_pages_own(explorer, page):
    policy, text = page[0]["Content-Security-Policy"], page[1]
    (nonce,) = re.findall(r"script-src 'nonce-([^']+)' 'self' 'unsafe-eval';", policy)
    scripts = re.findall(r"<script[^>]*>", text)
    own = f'<script nonce="{nonce}"'
    assert all(script.startswith((own, '<script src="', '<script type="application/json"')) for script in scripts)
    assert any(script.startswith(own) for script in scripts)
    with urllib.request.urlopen(explorer.url, timeout=30) as again:
        assert nonce not in again.headers["Content-Security-Policy"]


def test_other_host_names_find_nothing(explorer):
    assert status(explorer.url, Host=f"evil.example:{explorer.port}") == 404
    assert status(explorer.url, Host=f"127.0.0.1.evil.example:{explorer.port}") == 404


OUTSIDE = ["front.nc", "static/../../../../etc/passwd", "static/%2e%2e/%2e%2e/server.py", "static//etc/passwd"]


@pytest.mark.parametrize("path", OUTSIDE)
def test_no_files_are_served_but_the_scripts_of_the_page(explorer, path):
    assert status(explorer.url + path) in {403, 404}


def test_a_port_in_use_is_refused(explorer, designs):
    from gearbench.explore.live import Session
    from gearbench.explore.server import Explorer

    with pytest.raises(InputError, match="port"):
        Explorer(partial(Session, designs), explorer.port)


def test_the_file_holds_all_it_needs(designs, tmp_path):
    from gearbench.explore.static import html

    text = html(designs, pictures=2)
    markup = re.sub(r"(<script[^>]*>).*?</script>", r"\1", text, flags=re.DOTALL)
    assert not re.search(r"<(?:script|link|img)[^>]+(?:src|href)=", markup)
    assert "Bokeh" in text
