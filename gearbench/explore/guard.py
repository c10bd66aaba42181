"""Protection of the page: a secret token in its address, and a content security policy for its scripts."""

from __future__ import annotations

import re
import secrets
from typing import Any

from tornado.httputil import HTTPHeaders, HTTPServerRequest
from tornado.routing import Matcher
from tornado.web import OutputTransform, RequestHandler

#: Script tags as Bokeh writes them. Text from a result file never looks like this, because HTML and JSON escape it.
_SCRIPT = re.compile(r'<script(?=>| type="text/javascript")')


def new_token() -> str:
    """Random token that may stand in an address."""
    return secrets.token_hex(24)


class TokenMatches(Matcher):
    """Requests whose path begins with the token, including those of the websocket."""

    def __init__(self, token: str) -> None:
        self._token = token

    def match(self, request: HTTPServerRequest) -> dict[str, Any] | None:
        """Empty mapping if the path begins with the token, else None."""
        given = (request.path or "").lstrip("/").partition("/")[0]
        return {} if secrets.compare_digest(given.encode(), self._token.encode()) else None


class Refused(RequestHandler):
    """Handler that answers 403."""

    def prepare(self) -> None:
        """Refuse every request."""
        self.set_status(403)
        self.finish("The address of the explorer holds a token: take the one that gearbench explore prints.\n")


def policy(nonce: str, *, own: str = "", connect: str = "'none'") -> str:
    """Content security policy: only the page's own scripts run, even if a name contains HTML.

    Bokeh needs ``unsafe-eval`` because it makes functions from texts, and ``unsafe-inline`` for its inline styles.
    """
    return (
        f"default-src 'none'; script-src 'nonce-{nonce}' {own} 'unsafe-eval'; style-src {own} 'unsafe-inline'; "
        f"img-src data: blob:; font-src data:; connect-src {connect}; base-uri 'none'; form-action 'none'"
    )


def with_nonce(html: str, nonce: str) -> str:
    """Add the nonce of the policy to the scripts of a Bokeh page."""
    return _SCRIPT.sub(f'<script nonce="{nonce}"', html)


def guarded_file(html: str) -> str:
    """Add a policy to a page that is a file; the nonce is drawn last, so the contents of the page cannot know it."""
    nonce = new_token()
    tag = f'<meta http-equiv="Content-Security-Policy" content="{policy(nonce)}">'
    return with_nonce(html, nonce).replace('<meta charset="utf-8">', f'<meta charset="utf-8">\n    {tag}', 1)


class Policy(OutputTransform):
    """Transform of every answer of the server: adds the policy, and its nonce to the scripts of the page."""

    def __init__(self, request: HTTPServerRequest) -> None:
        self._host = request.host

    def transform_first_chunk(
        self, status_code: int, headers: HTTPHeaders, chunk: bytes, finishing: bool
    ) -> tuple[int, HTTPHeaders, bytes]:
        """Return status, headers and first bytes of an answer with the policy added."""
        nonce = secrets.token_urlsafe(16)
        headers["Content-Security-Policy"] = (
            policy(nonce, own="'self'", connect=f"'self' ws://{self._host}") + "; frame-ancestors 'none'"
        )
        headers["Referrer-Policy"] = "no-referrer"
        headers["X-Content-Type-Options"] = "nosniff"
        if finishing and headers.get("Content-Type", "").startswith("text/html"):
            chunk = with_nonce(chunk.decode(), nonce).encode()
            headers["Content-Length"] = str(len(chunk))
        return status_code, headers, chunk
