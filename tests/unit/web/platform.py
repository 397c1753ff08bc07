"""A reference platform: what 1EdTech LTI Core 1.3, Security 1.0 and AGS 2.0 ask of one, on loopback."""

import json
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import parse_qs, urlsplit

import jwt
from jwcrypto.jwk import JWK

CLAIM = "https://purl.imsglobal.org/spec/lti/claim/"
ROLE = "http://purl.imsglobal.org/vocab/lis/v2/membership#"
SCOPES = [
    "https://purl.imsglobal.org/spec/lti-ags/scope/lineitem",
    "https://purl.imsglobal.org/spec/lti-ags/scope/score",
]
KEY = JWK.generate(kty="RSA", size=2048, kid="platform-key")
CLIENT, DEPLOYMENT = "client-1", "deployment-1"


class Platform:
    """The platform's server; `scores` are what it was sent, `broken` a status that it answers instead."""

    def __init__(self):
        self.key = KEY
        self.tool_keys, self.scores, self.items, self.broken, self.tokens = "", [], [], None, []
        outer = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self):
                if self.path == "/jwks":
                    public = {**outer.key.export_public(as_dict=True), "alg": "RS256"}
                    self.answer({"keys": [public]})
                elif self.path.startswith("/items"):
                    self.answer(outer.items if self.is_allowed() else None)

            def do_POST(self):
                body = self.rfile.read(int(self.headers["Content-Length"])).decode()
                if self.path == "/token":
                    self.answer(outer.token(parse_qs(body)))
                elif not self.is_allowed() or outer.broken:
                    self.answer(None, outer.broken or 401)
                elif self.path == "/items":
                    item = {**json.loads(body), "id": f"{outer.address}/items/{len(outer.items) + 1}"}
                    outer.items.append(item)
                    self.answer(item, 201)
                else:
                    outer.scores.append((self.path, json.loads(body)))
                    self.answer({})

            def is_allowed(self):
                return self.headers.get("Authorization", "").removeprefix("Bearer ") in outer.tokens

            def answer(self, content, status=200):
                data = json.dumps(content).encode()
                self.send_response(status if content is not None else status if status != 200 else 401)
                self.send_header("Content-Type", "application/json")
                self.send_header("Content-Length", str(len(data)))
                self.end_headers()
                self.wfile.write(data)

            def log_message(self, *_arguments):
                """Nothing is printed."""

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.address = f"http://127.0.0.1:{self.server.server_port}"
        threading.Thread(target=self.server.serve_forever, args=(0.01,), daemon=True).start()

    def stop(self):
        self.server.shutdown()
        self.server.server_close()

    def token(self, asked):
        """The token endpoint: client credentials, proved by a JWT that the tool has signed."""
        (assertion,) = asked["client_assertion"]
        keys = {one["kid"]: JWK(**one).export_to_pem() for one in json.loads(self.tool_keys)["keys"]}
        key = keys[jwt.get_unverified_header(assertion)["kid"]]
        said = jwt.decode(assertion, key, algorithms=["RS256"], audience=f"{self.address}/token")
        assert said["iss"] == said["sub"] == CLIENT
        assert asked["grant_type"] == ["client_credentials"]
        self.tokens.append(f"token-{len(self.tokens)}")
        return {"access_token": self.tokens[-1], "token_type": "Bearer", "expires_in": 3600}

    @property
    def registration(self):
        return {
            "issuer": self.address, "client_id": CLIENT, "deployments": [DEPLOYMENT],
            "auth_login_url": f"{self.address}/auth", "auth_token_url": f"{self.address}/token",
            "key_set_url": f"{self.address}/jwks",
        }  # fmt: skip

    # Launches -------------------------------------------------------------------------------------

    def begun(self, browser):
        """The parameters that the tool asks with after the first request of a launch."""
        form = {"iss": self.address, "login_hint": "user", "client_id": CLIENT, "lti_message_hint": "m"}
        answer = browser.post("/lti/login", data=form, follow_redirects=False)
        assert answer.status_code == 303, answer.text
        parts = urlsplit(answer.headers["location"])
        assert f"{parts.scheme}://{parts.netloc}{parts.path}" == f"{self.address}/auth"
        asked = {name: values[0] for name, values in parse_qs(parts.query).items()}
        assert (asked["response_type"], asked["response_mode"], asked["prompt"]) == (
            "id_token", "form_post", "none",
        )  # fmt: skip
        return asked

    def claims(self, asked, **changed):
        """A message for a resource link; roles, e-mail and all else may be changed, or left out by None."""
        now = int(time.time())
        made = {
            "iss": self.address, "aud": CLIENT, "sub": "user-1", "nonce": asked["nonce"], "iat": now,
            "exp": now + 60, "name": "Maria", f"{CLAIM}message_type": "LtiResourceLinkRequest",
            f"{CLAIM}version": "1.3.0", f"{CLAIM}deployment_id": DEPLOYMENT,
            f"{CLAIM}target_link_uri": asked["redirect_uri"],
            f"{CLAIM}resource_link": {"id": "activity-1"},
            f"{CLAIM}roles": [f"{ROLE}Learner"],
            "https://purl.imsglobal.org/spec/lti-ags/claim/endpoint": {
                "scope": SCOPES, "lineitems": f"{self.address}/items",
            },
            **changed,
        }  # fmt: skip
        return {name: value for name, value in made.items() if value is not None}

    def signed(self, claims, key=None, algorithm="RS256"):
        own = None if algorithm == "none" else (key or self.key).get_op_key("sign")
        return jwt.encode(claims, own, algorithm, {"kid": "platform-key"})

    def launch(self, browser, **changed):
        """A whole launch."""
        asked = self.begun(browser)
        form = {"state": asked["state"], "id_token": self.signed(self.claims(asked, **changed))}
        return browser.post("/lti/launch", data=form, follow_redirects=False)
