"""Requests that the server itself makes: to learning platforms, and never into a network of its own.

A name is looked up, every address that comes out is checked, and the connection goes to one of these: what
the name leads to a moment later does not count. Answers have a limit of size and of time; no text of theirs
reaches a message.
"""

import socket
import time
from ipaddress import IPv4Address, IPv6Address, IPv6Network, ip_address
from typing import Any
from urllib.parse import urlsplit

import requests
from requests.adapters import HTTPAdapter
from urllib3.connection import HTTPConnection, HTTPSConnection
from urllib3.connectionpool import HTTPConnectionPool, HTTPSConnectionPool
from urllib3.util.connection import create_connection

from grader.review.server import LOOPBACK

TIMEOUT_S = (5.0, 20.0)
"""Longest wait for a platform: to connect, and between two parts of an answer."""
MOST_S = 30.0
"""Longest wait for a whole answer: people wait for it."""
MOST_BYTES = 1_000_000
"""The most of an answer: a set of keys, or a list of line items, has a hundredth of it."""
NAT64 = IPv6Network("64:ff9b::/96")
"""Addresses that stand for those of IPv4 (RFC 6052)."""


class InsideError(OSError):
    """A name leads into the server's own network."""


def is_outside(address: str) -> bool:
    """Return whether an address belongs to the internet, however it is written or wrapped."""
    ip: IPv4Address | IPv6Address | None = ip_address(address.partition("%")[0])
    if isinstance(ip, IPv6Address):
        inner = IPv4Address(int(ip) & 0xFFFFFFFF) if ip in NAT64 else ip.ipv4_mapped or ip.sixtofour
        ip = None if ip.teredo else inner or ip
    return ip is not None and ip.is_global and not ip.is_multicast


def addresses_of(host: str, port: int, *, is_loopback: bool = False) -> list[str]:
    """Return the addresses of a name, all in the internet or, with `is_loopback`, all of this machine.

    Raises InsideError where one of the addresses is any other, OSError for a name that leads nowhere.
    """
    found = [str(entry[4][0]) for entry in socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)]
    allowed = (lambda address: ip_address(address).is_loopback) if is_loopback else is_outside
    if not all(map(allowed, found)):
        raise InsideError("is an address within a network")
    return list(dict.fromkeys(found))


def why_not_asked(url: str, *, is_local: bool) -> str | None:
    """Return the reason, as a code, why the server must not ask an address; None if it may.

    A name that leads nowhere now is let pass: it is looked up again for every connection.

    Arguments: `is_local` is of a server that serves its own machine alone, and may ask it over http.
    """
    try:
        parts = urlsplit(url)
        host, port = parts.hostname or "", parts.port
    except ValueError:
        return "address_not_https"
    if is_local and parts.scheme == "http" and host in LOOPBACK:
        return None
    if parts.scheme != "https" or not host or parts.username:
        return "address_not_https"
    if host.rstrip(".").endswith(("localhost", ".local", ".internal")):
        return "address_inside"
    try:
        addresses_of(host, port or 443)
    except InsideError:
        return "address_inside"
    except UnicodeError:  # no name that can be looked up
        return "address_not_https"
    except OSError:
        return None
    return None


def caller(*, is_local: bool) -> requests.Session:
    """Return a session to ask a platform; any fault is a requests.RequestException.

    Arguments: `is_local` as in `why_not_asked`.
    """
    session = _Bounded()
    session.trust_env = False  # a proxy would look names up by itself
    session.mount("https://", _Adapter())
    if is_local:
        session.mount("http://", _Adapter())
    else:
        del session.adapters["http://"]
    return session


class _Bounded(requests.Session):
    """With limits of time and size, and without being led elsewhere."""

    def request(self, *arguments: Any, **known: Any) -> requests.Response:  # noqa: ANN401 - as requests has it
        known |= {"timeout": TIMEOUT_S, "allow_redirects": False, "stream": True}
        until, content = time.monotonic() + MOST_S, bytearray()
        answer = super().request(*arguments, **known)
        for part in answer.iter_content(65536):
            content += part
            if len(content) > MOST_BYTES or time.monotonic() > until:
                answer.close()
                raise requests.ConnectionError("the answer is too long")
        answer._content = bytes(content)  # noqa: SLF001 - as requests keeps one that it has read itself
        return answer


class _Plain(HTTPConnection):
    def _new_conn(self) -> socket.socket:
        return _connected(self, is_loopback=True)


class _Tls(HTTPSConnection):
    def _new_conn(self) -> socket.socket:
        return _connected(self)


class _PlainPool(HTTPConnectionPool):
    ConnectionCls = _Plain


class _TlsPool(HTTPSConnectionPool):
    ConnectionCls = _Tls


class _Adapter(HTTPAdapter):
    def init_poolmanager(self, *arguments: Any, **known: Any) -> None:  # noqa: ANN401 - as requests has it
        super().init_poolmanager(*arguments, **known)
        self.poolmanager.pool_classes_by_scheme = {"http": _PlainPool, "https": _TlsPool}


def _connected(connection: HTTPConnection, *, is_loopback: bool = False) -> socket.socket:
    """Return a socket to the first address of a name that answers."""
    port = connection.port or connection.default_port
    *others, last = addresses_of(connection.host, port, is_loopback=is_loopback)
    for address in others:
        try:
            return create_connection((address, port), connection.timeout)
        except OSError:
            continue
    return create_connection((last, port), connection.timeout)
