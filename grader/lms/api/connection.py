"""A platform's site with a token: calls, repeated where that is safe, and what their answers mean.

Python's own HTTP client. No redirect is followed, so the token goes to the site that was named alone.
"""

import email.utils
import json
import socket
import ssl
import time
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from datetime import datetime
from http.client import HTTPException
from typing import Any
from urllib.error import URLError
from urllib.parse import urlencode, urljoin, urlsplit

from grader import __version__
from grader.files import in_one_line
from grader.records import Reason

_PAUSES_S = 1.0, 2.0, 4.0, 8.0
"""Waits before a call is repeated, where the platform asks for none."""
_LONGEST_S, _TIMEOUT_S = 600.0, 60.0
_SHOWN = 300
"""Characters of an answer that are told."""
_OF_MOODLE = {"invalidtoken": 401, "accessexception": 403}
"""Its error codes about a token, and HTTP's statuses that mean the same."""


@dataclass(frozen=True, slots=True)
class Answer:
    """A platform's answer; `failed` is why the call was not carried out.

    `status` is HTTP's, or the one that fits the content, 0 where no answer came. `ends`: every further call
    would fail, too. `retry_s`: after how long it may be repeated, 0 if the platform does not say it.
    """

    status: int
    body: Any = None
    failed: Reason | None = None
    ends: bool = False
    retry_s: float | None = None


class _AsItIs(urllib.request.HTTPErrorProcessor):
    """Hands on every answer: urllib would raise errors, and follow redirects with the token."""

    def http_response(self, request: Any, response: Any) -> Any:  # noqa: ANN401, ARG002 - urllib's own
        return response

    https_response = http_response


class Connection:
    """A site and a token; `wait` sleeps for so many seconds."""

    def __init__(self, site: str, token: str = "", wait: Callable[[float], None] = time.sleep) -> None:
        self.site, self._token, self._wait = site, token, wait
        # Without https a proxy would read the token.
        handlers = [] if site.startswith("https:") else [urllib.request.ProxyHandler({})]
        self._opener = urllib.request.build_opener(_AsItIs, *handlers)

    def call(self, method: str, path: str, body: Any, function: str = "", *, is_safe: bool) -> Answer:  # noqa: ANN401 - JSON
        """Make a call, of Moodle's web service where it has a `function`.

        It is repeated where it has not arrived; where it may have, only if that `is_safe`.
        """
        headers = {"Accept": "application/json", "User-Agent": f"planmark/{__version__}"}
        data = None if body is None else json.dumps(body).encode()
        if function:
            known = {"wstoken": self._token, "wsfunction": function, "moodlewsrestformat": "json"}
            data = urlencode([*known.items(), *_fields(body)]).encode()
        else:
            headers |= {"Authorization": f"Bearer {self._token}", "Content-Type": "application/json"}
        request = urllib.request.Request(self.site + path, data, headers, method=method)  # noqa: S310 - checked
        for pause_s in (*_PAUSES_S, None):
            answer = self._once(request, is_safe=is_safe)
            if answer.retry_s is None or pause_s is None:
                break
            if answer.retry_s > _LONGEST_S:
                return replace(answer, failed=Reason("wait_long", {"wait_s": answer.retry_s}), ends=True)
            self._wait(answer.retry_s or pause_s)
        return answer

    def _once(self, request: urllib.request.Request, *, is_safe: bool) -> Answer:
        try:
            with self._opener.open(request, timeout=_TIMEOUT_S) as response:
                status, headers, raw = response.status, response.headers, response.read()
        except (OSError, HTTPException) as error:
            why = error.reason if isinstance(error, URLError) else error
            told = Reason("answer_lost", {"error": in_one_line(str(why) or type(why).__name__)})
            if isinstance(why, ssl.SSLCertVerificationError):
                return Answer(0, failed=told, ends=True)
            if is_safe or isinstance(why, ConnectionRefusedError | socket.gaierror):
                return Answer(0, failed=told, retry_s=0.0)
            return Answer(0, failed=replace(told, code="answer_unclear"))
        raw = raw.replace(self._token.encode(), b"(token)")
        text = in_one_line(" ".join(raw.decode("utf-8", "replace")[:_SHOWN].split()))
        answer = _judged(status, raw, Reason("answered", {"status": status, "text": text}))
        if 300 <= status < 400:
            place = urlsplit(urljoin(request.full_url, headers.get("Location") or ""))
            where = in_one_line(f"{place.scheme}://{place.netloc.rpartition('@')[2]}")
            return replace(answer, failed=Reason("redirected", {"text": where}), ends=True)
        asked_s = _asked_s(headers.get("Retry-After"))
        if answer.status == 429 or (answer.status >= 500 and (is_safe or asked_s is not None)):
            return replace(answer, retry_s=asked_s or 0.0)
        if answer.status >= 500:
            return replace(answer, failed=Reason("answer_unclear", {"error": f"{status}: {text}"}))
        return answer


def _judged(status: int, raw: bytes, failed: Reason) -> Answer:
    """Judge an answer by its status and its content."""
    try:
        body = json.loads(raw) if raw.strip() or status != 204 else None
    except ValueError:
        if status < 300:
            return Answer(400, failed=replace(failed, code="answer_no_api"), ends=True)
        body = None
    told = body if isinstance(body, dict) else {}
    if status == 403 and b"rate limit exceeded" in raw.lower():
        status = 429  # Canvas, developerdocs.instructure.com: Throttling
    elif status < 300 and not (told.get("exception") or told.get("error")):
        return Answer(status, body)
    elif status < 300:  # Moodle's exceptions, and a rubric that Canvas cannot store
        status = _OF_MOODLE.get(str(told.get("errorcode")), 400)
    if status == 401:
        return Answer(status, failed=replace(failed, code="token_refused"), ends=True)
    return Answer(status, failed=failed)


def _asked_s(text: str | None) -> float | None:
    """The wait that a Retry-After asks for, in seconds or by a date (RFC 9110, 10.2.3)."""
    if text is None or text.strip().isdecimal():
        return None if text is None else float(text)
    try:
        moment = email.utils.parsedate_to_datetime(text)
    except ValueError:
        return None
    return max((moment - datetime.now(moment.tzinfo)).total_seconds(), 0.0)


def _fields(values: Any, name: str = "") -> Iterator[tuple[str, Any]]:  # noqa: ANN401 - JSON
    """The fields of a form as PHP reads nested values: ``areas[0][cmid]``."""
    for key, value in values.items() if isinstance(values, dict) else enumerate(values):
        path = f"{name}[{key}]" if name else str(key)
        yield from _fields(value, path) if isinstance(value, dict | list) else [(path, value)]
