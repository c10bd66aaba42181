"""Protection of the page: a token in its address, and a content security policy for its scripts."""

from __future__ import annotations

import re
import secrets
from typing import Any

from tornado.httputil import HTTPHeaders, HTTPServerRequest
from tornado.routing import Matcher
from tornado.web import OutputTransform, RequestHandler

#: Scripts of the page as Bokeh writes them; no text of a file is written so, in HTML or in JSON.
_SCRIPT = re.compile(r'<script(?=>| type="text/javascript")')


def new_token() -> str:
    """Random token that is valid in an address."""
    return secrets.token_hex(24)


class TokenMatches(Matcher):
    """Requests whose path begins with the token, those of the websocket included."""

    def __init__(self, token: str) -> None:
        self._token = token

    def match(self, request: HTTPServerRequest) -> dict[str, Any] | None:
        """Empty mapping if the path begins with the token, else None."""
        given = (request.path or "").lstrip("/").partition("/")[0]
        return {} if secrets.compare_digest(given.encode(), self._token.encode()) else None


class Refused(RequestHandler):
    """Handler that answers 403."""

    def prepare(self) -> None:
        """Refuse the request, whatever it asks for."""
        self.set_status(403)
        self.finish("The address of the explorer holds a token: take the one that gearbench explore prints.\n")


def policy(nonce: str, *, own: str = "", connect: str = "'none'") -> str:
    """Content security policy of the page: its own scripts run, and no other, whatever a name may hold.

    Bokeh makes functions of texts (``unsafe-eval``) and styles in place (``unsafe-inline`` for styles alone).
    """
    return (
        f"default-src 'none'; script-src 'nonce-{nonce}' {own} 'unsafe-eval'; style-src {own} 'unsafe-inline'; "
        f"img-src data: blob:; font-src data:; connect-src {connect}; base-uri 'none'; form-action 'none'"
    )


def with_nonce(html: str, nonce: str) -> str:
    """``html`` of a page of Bokeh whose own scripts carry the nonce of its policy."""
    return _SCRIPT.sub(f'<script nonce="{nonce}"', html)


def guarded_file(html: str) -> str:
    """Page in a file with its own policy; its nonce is drawn after the contents of the file are fixed."""
    nonce = new_token()
    tag = f'<meta http-equiv="Content-Security-Policy" content="{policy(nonce)}">'
    return with_nonce(html, nonce).replace('<meta charset="utf-8">', f'<meta charset="utf-8">\n    {tag}', 1)


class Policy(OutputTransform):
    """Adds the policy to every answer of the server, and its nonce to the scripts of the page."""

    def __init__(self, request: HTTPServerRequest) -> None:
        self._host = request.host

    def transform_first_chunk(
        self, status_code: int, headers: HTTPHeaders, chunk: bytes, finishing: bool
    ) -> tuple[int, HTTPHeaders, bytes]:
        """Status, headers and first bytes of an answer, guarded."""
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
