"""Requests that are made to harm: each is refused in words, and nothing of others is told or lost."""

import asyncio
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest
from starlette.testclient import TestClient

from grader.authoring.new import new_assignment
from grader.web import app as web
from grader.web import students
from grader.web.guard import COOKIE, Rim
from grader.web.store import Visit
from tests.unit.web.conftest import ADDRESS, Browser
from tests.waiting import until

pytestmark = pytest.mark.slow

HOSTILE = "\"'><img src=x onerror=alert(1)><script>alert(1)</script>"


# Visits -------------------------------------------------------------------------------------------


def test_a_visit_begins_anew_with_a_personal_link(graded, app):
    """Whoever knew the cookie before, on a shared computer, is not the student afterwards."""
    key, links = graded
    victim, other = Browser(app), Browser(app)
    for browser in (victim, other):
        browser.cookies.set(COOKIE, "a" * 43)
    assert victim.get(links["s09"]).status_code == 200
    assert victim.get(f"/api/v1/publications/{key}/feedback").status_code == 200
    assert other.get(f"/api/v1/publications/{key}/feedback").status_code == 401


def test_an_instructor_who_opens_a_link_stays_signed_in(graded, admin):
    assert admin.get(graded[1]["s09"]).status_code == 200
    assert admin.get("/api/v1/publications").status_code == 200


def test_an_invitation_is_no_token(admin, app):
    invited = admin.act("POST", "/accounts?name=Eve&is_admin=true").json()
    head = {"Authorization": f"Bearer {invited['address'].partition('token=')[2]}"}
    assert Browser(app).get("/api/v1/accounts", headers=head).status_code == 401


def test_a_link_that_was_made_up_opens_nothing(visitor):
    for token in ("x", "1.x", "MQ.AAAA", "%00", "é", "a" * 5000):
        for path in ("/s/", "/api/v1/s/"):
            assert visitor.get(path + token).status_code == 404, token


def test_a_link_signed_by_another_server_opens_nothing(graded, app, settings):
    foreign = web.application(replace(settings, secret="t" * 40, database=f"{settings.database}-2"))
    _, links = graded
    assert TestClient(foreign, base_url=ADDRESS).get(links["s09"]).status_code in {404, 500}
    foreign.state.service.store.close()
    token = links["s09"].rpartition("/")[2]
    assert Browser(app).get(f"/s/{token[:-1]}{'A' if token[-1] != 'A' else 'B'}").status_code == 404


def test_ones_own_link_shows_nothing_of_another_student(graded, student, admin):
    key, _ = graded
    other = admin.publish()
    pages = student.get(f"/c/{key}").text
    assert "Student 11" not in pages
    for place in ("1", "..", "s11", "..%2Fs11", "0%2F..%2F..%2Fs11"):
        for name in ("feedback.html", "report.json", "..%2F..%2Fs11%2Ffeedback.html", "%00"):
            answer = student.get(f"/api/v1/publications/{key}/feedback/{place}/{name}")
            assert answer.status_code in {404, 422}, (place, name)
    assert student.get(f"/api/v1/publications/{other}/feedback").status_code == 401


# Texts that people send ---------------------------------------------------------------------------


def test_names_titles_and_requests_are_text_on_every_page(admin, graded, student):
    key, _ = graded
    roster = f'student_id,name,n\ns09,"{HOSTILE.replace(chr(34), chr(34) * 2)}",27\n'.encode()
    path = f"/publications/{key}/roster/files/roster.csv"
    assert admin.act("PUT", path, content=roster).status_code == 200
    admin.act("PATCH", f"/publications/{key}", json={"title": HOSTILE, "term": HOSTILE[:40]})
    admin.act("POST", f"/accounts?name={HOSTILE[:40]}")
    admin.act("POST", f"/tokens?title={HOSTILE[:40]}")
    student.act("POST", f"/publications/{key}/regrading", json={"text": HOSTILE, "criterion": "v_A"})
    for browser, page in [
        (admin, "/"), (admin, "/account"), (admin, f"/publications/{key}"), (student, f"/c/{key}"),
        (admin, f"/join?token={HOSTILE}"), (admin, f"/{HOSTILE}"), (admin, f"/c/{key}?lang={HOSTILE}"),
    ]:  # fmt: skip
        text = browser.get(page).text
        assert "onerror=alert(1)>" not in text.replace("&gt;", ""), page
        assert "<script>alert" not in text, page
        assert "<img src=x" not in text, page


def test_a_downloads_name_is_ours_alone(graded, admin):
    for what in ("a%0d%0aX-Evil: 1", 'a"; filename="x', "%00", "..%2F.."):
        answer = admin.get(f"/api/v1/publications/{graded[0]}/exports/csv?what={what}")
        assert answer.status_code in {404, 422}, what
        assert "x-evil" not in answer.headers


def test_no_address_leads_to_another_site(visitor):
    for path in ("//evil.example/", "/review//evil.example", "/s/..%2F%2Fevil.example", "/c//evil.example/"):
        answer = visitor.get(path, follow_redirects=False)
        place = answer.headers.get("location", "/")
        assert place.startswith((f"{ADDRESS}/", "/")), path
        assert not place.startswith("//"), path


ELSEWHERE = (
    "%00.html", "..%2Fhanded-in%2Fs09.json", "s09/report.json", ".cache/x.html", "%2Fetc%2Fpasswd.html",
)  # fmt: skip


def test_results_are_read_from_their_folder_alone(graded, admin):
    for path in ELSEWHERE:
        assert admin.get(f"/publications/{graded[0]}/results/{path}").status_code == 404, path


def test_a_page_of_results_is_alone_in_a_sandbox(graded, admin):
    for top in ("publications/{}/results", "review/{}/out"):
        policy = admin.get(f"/{top.format(graded[0])}/index.html").headers["Content-Security-Policy"]
        assert "sandbox allow-scripts" in policy, top
        assert "allow-same-origin" not in policy, top


def test_an_assignment_names_no_file_outside_its_own_folder(admin, tmp_path, settings):
    """Otherwise that file would be read, and messages of its faults would show its text."""
    (settings.data / "other").mkdir(parents=True)
    new_assignment(tmp_path / "own.toml", mechanism="slider-crank")
    for path in tmp_path.glob("*.toml"):
        text = path.read_text(encoding="utf-8")
        (settings.data / "other" / path.name).write_text(text, encoding="utf-8")
    key = admin.publish(assignment=None, is_open=False)
    own = (tmp_path / "own.toml").read_text(encoding="utf-8")
    for far in ("../../../other/", f"{settings.data}/other/"):
        text = own
        for path in tmp_path.glob("own.*.toml"):
            name = path.name.split(".")[0]
            text = text.replace(f'"{name}"', f'"{far}{path.name}"')
        assert text != own
        admin.act("PUT", f"/publications/{key}/assignment/files/own.toml", content=text.encode())
        answer = admin.act("PATCH", f"/publications/{key}", json={"assignment": "own.toml"})
        assert answer.status_code == 422, far
        assert "own folder" in answer.json()["message"]


# Bodies -------------------------------------------------------------------------------------------


def test_a_host_that_is_none_is_refused(visitor):
    for host in ("[", "[::1", "evil.example@127.0.0.1", "127.0.0.1:8000:x", "é"):
        assert visitor.get("/", headers={"Host": host.encode()}).status_code in {200, 421}, host
    assert visitor.get("/", headers={"Host": "["}).status_code == 421


def test_an_origin_that_is_none_is_refused(admin):
    head = {"X-Planmark-Form": admin.token, "Origin": "http://["}
    assert admin.post("/api/v1/publications", json={}, headers=head).status_code == 403


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("PATCH", "/publications/files"),
        ("POST", "/publications/photos/checks"),
    ],
)
def test_a_long_body_is_for_files_alone(admin, method, path):
    assert admin.act(method, path, content=b"[" * 1_500_000).status_code == 413


def rim_of(settings, **known):
    """The rim around an application that waits for the whole body."""

    async def application(_scope, receive, send):
        message = {"more_body": True}
        while message["more_body"]:
            message = await receive()
        await asyncio.sleep(0.05)
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b""})

    rim = Rim(application, settings, **known)

    async def sent(address, *, stops=False):
        parts, statuses = iter([True, True, False]), []

        async def receive():
            await asyncio.sleep(3600.0 if stops else 0.01)
            return {"type": "http.request", "body": bytes(200), "more_body": next(parts)}

        async def send(message):
            statuses.append(message.get("status"))

        scope = {
            "type": "http", "path": "/api/v1/publications/x/photos", "client": (address, 1),
            "headers": [(b"host", settings.host.encode())],
        }  # fmt: skip
        await rim(scope, receive, send)
        return statuses[0]

    return sent


def finished(coroutine):
    """Its result, from a thread of its own: a browser of other tests keeps an event loop in this one."""
    with ThreadPoolExecutor(1) as apart:
        return apart.submit(asyncio.run, coroutine).result()


def test_all_bodies_together_have_a_bound(settings):
    """Two of three bodies sent at once find room; a later one finds it again."""
    sent = rim_of(settings, room=1500)

    async def all_sent():
        return sorted(await asyncio.gather(*(sent(f"10.0.0.{one}") for one in range(3)))), await sent(
            "10.0.0.1"
        )

    assert finished(all_sent()) == ([200, 200, 503], 200)


def test_one_address_does_not_fill_the_room_of_all(settings):
    sent = rim_of(settings, room=3000)

    async def all_sent():
        greedy = asyncio.gather(*(sent("10.0.0.1") for _ in range(4)))
        return await sent("10.0.0.2"), await greedy

    other, greedy = finished(all_sent())
    assert (other, 503 in greedy) == (200, True)


def test_a_body_that_does_not_come_is_waited_for_no_longer(settings, monkeypatch):
    monkeypatch.setattr("grader.web.guard.GRACE_S", 0.05)
    sent = rim_of(settings)
    assert finished(sent("10.0.0.1", stops=True)) == 408


def test_unfinished_bodies_of_one_address_stop_nobody_else(settings, monkeypatch):
    monkeypatch.setattr("grader.web.guard.GRACE_S", 0.3)
    monkeypatch.setattr("grader.web.guard.MOST_SENDING", 3)
    sent = rim_of(settings)

    async def all_sent():
        stuck = [asyncio.create_task(sent("10.0.0.1", stops=True)) for _ in range(3)]
        await asyncio.sleep(0)
        others = await sent("10.0.0.1"), await sent("10.0.0.2")
        return others, await asyncio.gather(*stuck), await sent("10.0.0.1")

    assert finished(all_sent()) == ((503, 200), [408] * 3, 200)


@pytest.mark.parametrize("what", ["photos?n=7", "sheets"])
def test_a_photo_too_many_is_refused_before_it_is_read(graded, student, what):
    key, _ = graded
    read = []

    def pieces():
        read.append(1)
        yield b"\xff\xd8\xff"

    statuses = [
        student.act("POST", f"/publications/{key}/{what}", content=pieces()).status_code for _ in range(12)
    ]
    assert statuses[-1] == 429


def test_files_in_folders_and_sheets_may_be_long(graded, admin, student):
    key, _ = graded
    long = b"\xff\xd8\xff" + bytes(1_200_000)
    assert admin.act("PUT", f"/publications/{key}/files/group%203/x/s01.jpg", content=long).status_code == 200
    admin.act("PATCH", f"/publications/{key}", json={"takes_sheets": True})
    assert student.act("POST", f"/publications/{key}/sheets", content=long[:900_000]).status_code == 201


def test_nobody_sends_a_classs_file_without_being_signed_in(visitor, admin):
    """The body is not even read: 200 MB of many strangers would fill the memory."""
    key = admin.publish()
    read = []

    def pieces():
        for _ in range(15):
            read.append(1)
            yield b"x" * 100_000

    answer = visitor.act("PUT", f"/publications/{key}/files/a.jpg", content=pieces())
    assert answer.status_code == 401


NO_FORMS = [
    b"[" * 200_000, b'{"cells": ' + b'{"a":' * 100_000, b'{"cells": {"\\ud800": "1"}, "\\ud800": 1}',
    b'{"cells": {"v_A": "\\ud800"}}', b'{"cells": {"v_A": "\\u0000"}}', b"\xff\xfe", b"", b"null",
    b'{"n": 1e400, "cells": {}}', b'{"n": ' + b"9" * 5000 + b', "cells": {}}',
    b'{"cells": {"v_A": "' + b"9" * 90 + b'"}, "n": 7}', b'{"cells": {"a;b\\n=": "1"}, "n": 7}',
]  # fmt: skip


def test_a_body_that_is_no_form_is_refused_in_words(admin, visitor):
    key = admin.publish()
    for body in NO_FORMS:
        answer = visitor.act("POST", f"/publications/{key}/checks", content=body)
        assert answer.status_code in {200, 400, 422}, body[:50]
        assert answer.status_code == 200 or answer.json()["message"]


def test_a_number_of_no_row_is_refused(admin):
    key = admin.publish()
    for number in (2**31, 2**63, 10**30, -1, "x"):
        for method, path in [
            ("DELETE", f"/accounts/{number}"), ("PUT", f"/publications/{key}/members/{number}"),
            ("DELETE", f"/publications/{key}/members/{number}"),
            ("DELETE", f"/publications/{key}/links/{number}"),
            ("GET", f"/audit?before={number}"),
        ]:  # fmt: skip
            assert admin.act(method, path).status_code in {200, 404, 409, 422}, (method, path)
        answer = admin.act("PUT", f"/publications/{key}/requests/{number}", json={"answer": "x"})
        assert answer.status_code in {404, 422}, number


# How often, how much ------------------------------------------------------------------------------


def at_once(count, act):
    answers = []
    threads = [threading.Thread(target=lambda: answers.append(act())) for _ in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return sorted(answer.status_code for answer in answers)


def test_attempts_made_at_once_are_counted_too(graded, admin, student):
    key, _ = graded
    admin.act("PATCH", f"/publications/{key}", json={"attempts": 3})
    head = {"X-Planmark-Form": student.token, "Origin": ADDRESS}
    body = {"n": 27, "cells": {"v_A": "60"}}
    path = f"/api/v1/publications/{key}/checks"
    answers = at_once(8, lambda: student.post(path, json=body, headers=head))
    assert answers.count(200) == 3, answers
    assert answers.count(403) == 5, answers


def test_sheets_handed_in_at_once_are_all_kept_and_not_without_end(graded, student, settings, monkeypatch):
    key, _ = graded
    monkeypatch.setattr(students, "MOST_SHEETS", 5)
    head = {"X-Planmark-Form": student.token, "Origin": ADDRESS}
    path = f"/api/v1/publications/{key}/sheets"
    bodies = iter([b"\xff\xd8\xff%d" % number for number in range(8)])
    answers = at_once(8, lambda: student.post(path, content=next(bodies), headers=head))
    assert answers == [201] * 5 + [403] * 3
    assert len({file.read_bytes() for file in settings.data.rglob("s09_sent*")}) == 5


def test_photos_that_wait_are_bounded(graded, app, service, monkeypatch):
    key, _ = graded
    monkeypatch.setattr(students, "MOST_WAITING", 2)
    monkeypatch.setattr(type(service.queue), "put", lambda *_: None)
    browser = Browser(app)
    path = f"/publications/{key}/photos?n=7"
    answers = [browser.act("POST", path, content=b"\xff\xd8\xff").status_code for _ in range(3)]
    assert answers == [202, 202, 503]


def test_new_cookies_do_not_make_a_new_visitor_of_an_address(graded, app):
    """Each visit counts by itself, and all of an address together."""
    key, _ = graded
    answers = []
    for _ in range(14):
        browser = Browser(app)
        browser.cookies.set(COOKIE, f"{len(answers)}" * 30)
        path = f"/publications/{key}/photos?n=7"
        answers.append(browser.act("POST", path, content=b"\xff\xd8\xff").status_code)
    assert answers[-1] == 429


# Deletion -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_deletion_leaves_students_of_similar_names(admin, settings, encoding):
    key = admin.publish()
    roster = 'student_id,name,n\ns1,"One\u2028\nOne",7\ns1_2,Two,8\ns10,\u2028Ten,9\nadmin,A,10\n'
    admin.act("PUT", f"/publications/{key}/roster/files/roster.csv", content=roster.encode(encoding))
    for name in ("s1.jpg", "s1_a.jpg", "s1_2.jpg", "s1_2_b.jpg", "s10.jpg"):
        admin.act("PUT", f"/publications/{key}/files/{name}", content=b"\xff\xd8\xff")
    assert admin.act("DELETE", f"/publications/{key}/students/s1").status_code == 200
    left = sorted(path.name for path in settings.data.rglob("*.jpg"))
    assert left == ["s10.jpg", "s1_2.jpg", "s1_2_b.jpg"]
    (kept,) = settings.data.rglob("roster.csv")
    assert kept.read_text(encoding="utf-8").splitlines(keepends=False)[0] == "student_id,name,n"
    assert "One" not in kept.read_text(encoding="utf-8")
    known = [one["student_id"] for one in admin.get(f"/api/v1/publications/{key}").json()["students"]]
    assert known == ["s1_2", "s10", "admin"]
    trail = admin.get("/api/v1/audit").text
    assert "s10.jpg" in trail
    assert "s1_2.jpg" in trail
    assert "s1_a.jpg" not in trail
    assert key in trail


@pytest.mark.usefixtures("grades_here")
def test_a_table_that_holds_others_too_is_told_and_stays(admin, settings):
    key = admin.publish()
    admin.act("PUT", f"/publications/{key}/roster/files/roster.csv", content=b"student_id,n\ns1,7\ns2,8\n")
    table = b"student_id,n,v_A\ns1,7,60\ns2,8,60\n"
    admin.act("PUT", f"/publications/{key}/files/class.csv", content=table)
    job = admin.act("POST", f"/publications/{key}/jobs").json()
    assert admin.ended(f"/publications/{key}/jobs", job)["state"] == "done"
    assert admin.act("DELETE", f"/publications/{key}/students/s1").json()["kept"] == ["class.csv"]
    assert list(settings.data.rglob("class.csv"))


def test_what_is_kept_too_long_goes_while_the_server_runs(service, monkeypatch):
    with service.store.session() as session:
        session.add(Visit(id="old", used=time.time() - 400 * 86400.0, links={}))
    monkeypatch.setattr(web, "DAY_S", 0.02)
    with TestClient(web.application(service.settings), base_url=ADDRESS):

        def is_gone():
            with service.store.session() as session:
                return session.get(Visit, "old") is None

        until(is_gone)
