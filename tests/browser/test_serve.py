"""The web application in a real browser: what an instructor and a student do, on a phone and on a screen."""

import base64
import os
import shutil
import socket
import threading
import time
import zipfile
from io import BytesIO
from pathlib import Path

import pytest
import uvicorn
import zxingcpp
from PIL import Image

from grader.files import samples_folder
from grader.folder.batch import grade
from grader.folder.workers import Limits
from grader.rubric import load_rubric
from grader.web.app import application, first_invitation
from grader.web.places import batch_of, places_of
from grader.web.settings import Settings
from grader.web.store import Link, Publication
from tests.browser.conftest import entered_class
from tests.inline import Inline

pytestmark = pytest.mark.slow
SAMPLES = samples_folder() / "pump"
PASSWORD = "four words make one"  # noqa: S105 - of a test
WIDTHS = (320, 390, 1400)
"""Pixels: the narrowest that WCAG 2.2 asks for (1.4.10), a phone, a screen."""
RULES = {"runOnly": {"type": "tag", "values": ["wcag2a", "wcag2aa", "wcag21aa", "wcag22aa"]}}
PATIENCE_MS = 240_000
SHOTS = "PLANMARK_SCREENSHOTS"
"""Names the folder that is given the screenshots, a third of a walk's time; without it none are taken."""


CONTROLS = """[...document.querySelectorAll(
        "a[href], button, input, select, textarea, summary, [tabindex='0']"
    )].filter((one) => !one.disabled && one.checkVisibility({ visibilityProperty: true }))"""
FOCUSABLE = f"{CONTROLS}.length"
FOCUSED = f"""(() => {{
    const one = document.activeElement, style = getComputedStyle(one);
    return [{CONTROLS}.indexOf(one), style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 1];
}})()"""


BROKEN = """() => {
    const found = [], range = document.createRange(), texts = document.createTreeWalker(document.body, 4);
    const styles = (one) => getComputedStyle(one).overflowX;
    while (texts.nextNode()) {
        const text = texts.currentNode, host = text.parentElement;
        if (!host.checkVisibility() || host.closest("code, bdi, pre, svg, script, style")) continue;
        for (const word of text.data.matchAll(/[\\p{L}\\p{N}]+/gu)) {
            range.setStart(text, word.index);
            range.setEnd(text, word.index + word[0].length);
            if (new Set([...range.getClientRects()].map((one) => Math.round(one.top))).size > 1)
                found.push(`wrapped inside: ${word[0]}`);
        }
        for (let one = host; one !== document.body; one = one.parentElement)
            if (one.clientWidth > 1 && one.scrollWidth > one.clientWidth + 1 && styles(one) !== "visible"
                && styles(one) !== "auto") { found.push(`cut: ${text.data.trim()}`); break; }
    }
    return found;
}"""
"""Words that are cut, or wrapped inside; names of files and addresses may be."""


class Served:
    """The application in a thread of the test, on a port of its own."""

    def __init__(self, top):
        listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"http://127.0.0.1:{listener.getsockname()[1]}"
        self.settings = Settings(
            top / "data", f"sqlite:///{top / 'test.sqlite'}", "s" * 40, self.address,
            limits=Limits(240.0, 3000),
        )  # fmt: skip
        self.settings.data.mkdir()
        app = application(self.settings)
        self.store = app.state.service.store
        config = uvicorn.Config(app, log_level="warning", ws="none", timeout_graceful_shutdown=1)
        self.uvicorn = uvicorn.Server(config)
        self.thread = threading.Thread(target=self.uvicorn.run, args=([listener],))
        self.thread.start()

    def stop(self):
        self.uvicorn.should_exit = True
        self.thread.join()

    def graded_class(self, lang, *scans):
        """A released class of one student with scans: its key and the student's personal link."""
        with self.store.session() as session:
            one = Publication(
                assignment="pump", title="Pump, group 3", lang=lang, is_open=True, is_released=True,
                takes_sheets=True, attempts=20,
            )  # fmt: skip
            link = Link(publication=one, student_id="s01", expires=time.time() + 1e5)
            session.add_all([one, link])
            session.flush()
            folder = places_of(self.settings.data, one).handed_in
            copied(folder, "roster.csv", *(scans or ["s01_1.jpg"]))
            grade(batch_of(self.settings.data, one), lambda *_: None, Inline())
            token = application_link(self.settings, link)
            return one.key, token


def application_link(settings, link):
    """The personal link as the server makes it."""
    from itsdangerous import URLSafeSerializer  # noqa: PLC0415

    return f"{settings.address}/s/{URLSafeSerializer(settings.secret, salt='personal link').dumps(link.id)}"


def copied(folder, *names):
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        shutil.copy(SAMPLES / name, folder)


def zipped(folder):
    """A platform's archive of one student's scan."""
    with zipfile.ZipFile(folder / "all.zip", "w") as archive:
        archive.write(SAMPLES / "s01_1.jpg", "Student 1_101_assignsubmission_file_/plan.jpg")
    return folder / "all.zip"


def dropped(page, folder, name):
    """Drop a sample as the file of a folder: what a browser gives of one is made by hand."""
    content = base64.b64encode((SAMPLES / name).read_bytes()).decode()
    page.evaluate(
        """([folder, name, content]) => {
            const file = new File([Uint8Array.from(atob(content), (sign) => sign.charCodeAt(0))], name);
            let left = [{ isFile: true, name, file: (found) => found(file) }];
            const reader = { readEntries: (found) => { found(left); left = []; } };
            const entry = { isFile: false, name: folder, createReader: () => reader };
            const event = new Event("drop", { bubbles: true, cancelable: true });
            event.dataTransfer = { items: [{ webkitGetAsEntry: () => entry }] };
            document.querySelector(".drop").dispatchEvent(event);
        }""",
        [folder, name, content],
    )


class Visit:
    """A person's browser: whatever it finds wrong with a page is a fault."""

    def __init__(self, chromium, served, shots, locale):
        self.context = chromium.new_context(viewport={"width": 1400, "height": 900}, locale=locale)
        self.page, self.faults, self.shots = self.context.new_page(), [], shots
        self.page.set_default_timeout(PATIENCE_MS)
        self.page.on("pageerror", lambda error: self.faults.append(f"{self.page.url}: {error}"))
        self.page.on("console", self._said)
        self.page.on("dialog", lambda dialog: dialog.accept())
        self.served, self.axe = served, locale.startswith("en")

    def _said(self, message):
        if message.type == "error":
            self.faults.append(f"{self.page.url}: {message.text}")

    def look(self, name, *, axe=True):
        """Look at the page at every width, in light and dark."""
        page = self.page
        for width in WIDTHS:
            page.set_viewport_size({"width": width, "height": 900})
            wide = page.evaluate("document.documentElement.scrollWidth")
            if wide > width:
                self.faults.append(f"{name} at {width} px is {wide} px wide")
            self.faults += [f"{name} at {width} px: {word}" for word in page.evaluate(BROKEN)]
            self.shoot(f"{name}-{width}")
            if axe and self.axe:
                scheme = "dark" if width == 1400 else "light"
                page.emulate_media(color_scheme=scheme)
                self.faults += [f"{name} ({scheme}) {fault}" for fault in violations(page)]
        self.shoot(f"{name}-dark")
        page.emulate_media(color_scheme="light")

    def shoot(self, name):
        """Take a screenshot of the whole page, for whoever asks for them."""
        if self.shots:
            self.page.screenshot(path=Path(self.shots) / f"{name}.png", full_page=True)

    def tab_through(self):
        """Every link, button and field is reached by keys alone, in the page's order, and shows it.

        As with axe, one language is enough: the others have the same controls in the same order.
        """
        if not self.axe:
            return
        page = self.page
        page.evaluate("document.activeElement.blur(); scrollTo(0, 0)")
        wanted, reached = page.evaluate(FOCUSABLE), []
        for _ in range(2 * wanted + 10):
            page.keyboard.press("Tab")
            place, is_shown = page.evaluate(FOCUSED)
            if reached and place == reached[-1]:  # within a date: day, month, year
                continue
            if place < 0 or place in reached:
                break
            reached.append(place)
            if not is_shown:
                self.faults.append(f"{page.url}: the focus on control {place} is not seen")
        if reached != list(range(wanted)):
            self.faults.append(f"{page.url}: of {wanted} controls Tab reaches {reached}")

    def end(self):
        self.context.close()
        assert not self.faults, "\n".join(self.faults)


def violations(page):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    found = axe.run(page, options=RULES).response["violations"]
    return [
        f"{one['id']}: {node['html'][:160]} {node['failureSummary'][:300]}"
        for one in found
        for node in one["nodes"]
    ]


@pytest.fixture
def served(tmp_path):
    running = Served(tmp_path)
    yield running
    running.stop()


@pytest.fixture
def visit(chromium, served):
    """Opens browsers; their faults fail the test at its end."""
    shots, visits = os.environ.get(SHOTS), []

    def opened(locale="en-US"):
        visits.append(Visit(chromium, served, shots, locale))
        return visits[-1]

    yield opened
    for one in visits:
        one.end()


def joined(instructor):
    """The browser, in which the first administrator has made the account."""
    page = instructor.page
    page.goto(first_invitation(instructor.served.settings))
    page.fill("#name", "admin")
    page.fill("#password", PASSWORD)
    page.click("main form button")
    page.wait_for_url(f"{instructor.served.address}/")
    return page


def follows(page, first, second):
    """Return whether a part of the page stands right behind another one."""
    return page.evaluate(f"document.querySelector('{first}').nextElementSibling.matches('{second}')")


SHOWN = """() => !document.body.dataset.busy && document.body.dataset.ready
    && !document.getElementById("question").hidden"""


def test_the_last_answer_leads_to_the_class_with_its_marks_and_the_export(served, visit, tmp_path):
    heads, *rows = entered_class().splitlines()
    entered = tmp_path / "measurements.csv"
    entered.write_text("\n".join([heads, rows[11].replace("m12", "s02")]), encoding="utf-8")
    key, _ = served.graded_class("en", str(entered))
    page = joined(visit())
    address = f"{served.address}/publications/{key}"
    page.goto(address)
    assert "waiting for review: 1" in page.inner_text("#marks").lower()
    page.click(f"a[href='/review/{key}/']")
    while "/review/" in page.url:
        page.wait_for_function(SHOWN)
        before = page.evaluate("document.body.dataset.shown")
        page.keyboard.press("Enter" if page.is_enabled("#accept") else "1")
        page.wait_for_function(f"() => document.body.dataset.shown !== {before!r}")
    assert page.url == f"{address}#marks"
    assert "waiting for review" not in page.inner_text("#marks").lower()
    with page.expect_download() as download:
        page.click("#export button")
    assert "s02" in Path(download.value.path()).read_text(encoding="utf-8")
    page.click(f"a[href='/publications/{key}/results/index.html']")
    page.wait_for_url("**/index.html")
    page.click(f"a[href='/publications/{key}#export']")
    page.wait_for_selector("#export")
    # What was pressed by mistake is taken back where it was decided.
    page.click(f"a[href='/review/{key}/']")
    page.wait_for_selector("#done:visible")
    page.keyboard.press("u")
    page.wait_for_function(SHOWN)


LOCALES = ("en-US", "ro-RO", "ru-RU")
PLATFORM = {
    "issuer": "https://moodle.example.org", "client_id": "planmark", "deployments": "1\n2",
    "auth_login_url": "https://moodle.example.org/mod/lti/auth.php",
    "auth_token_url": "https://moodle.example.org/mod/lti/token.php",
    "key_set_url": "https://moodle.example.org/mod/lti/certs.php",
}  # fmt: skip


@pytest.mark.parametrize("locale", LOCALES)
def test_a_student_checks_values_and_a_photo_and_asks_again(served, visit, locale):  # noqa: PLR0915 - one story
    lang = locale[:2]
    key, link = served.graded_class(lang)
    student = visit(locale)
    page, name = student.page, f"student-{lang}"
    page.goto(link)
    assert page.url.endswith(f"/c/{key}")
    assert page.input_value("#in-n") == "7"
    student.look(f"{name}-page")
    student.tab_through()
    for column, text in (("v_A", "60,0"), ("v_B", "12,5"), ("kv", "0,193732 (m/s)/mm")):
        page.fill(f"#f-{column}", text)
    page.click("#check button")
    page.wait_for_selector("#result:not([hidden])")
    assert page.evaluate("document.activeElement.id") == "result"
    assert page.get_attribute("#result", "aria-live") == "polite"
    assert page.locator("#result .r-off, #result .r-open").count()
    assert "19" in page.inner_text("#left")
    student.look(f"{name}-checked")
    assert follows(page, "#check", "#result")
    page.fill("#f-v_A", "abc")
    page.click("#check button")
    page.wait_for_selector("#f-v_A[aria-invalid] + .fault")
    assert page.evaluate("document.activeElement.id") == "f-v_A"
    assert page.get_attribute("#f-v_A", "aria-describedby").split()[0] == "fault-f-v_A"
    student.look(f"{name}-fault")
    page.fill("#f-v_A", "60,0")
    page.fill("#in-n", "999")
    page.click("#check button")
    page.wait_for_selector("#in-n[aria-invalid] + .fault")
    assert page.locator(".fault").count() == 1
    student.faults = [fault for fault in student.faults if "422" not in fault]
    page.fill("#in-n", "7")
    page.set_input_files("#picture", SAMPLES / "s01_1.jpg")
    page.evaluate("document.getElementById('result').replaceChildren()")
    page.click("#photo button")
    page.locator("#result h2").first.wait_for()
    assert follows(page, "#photo", "#result")
    student.look(f"{name}-photo")
    page.click("#hand-in")
    page.wait_for_selector("#sheets:visible")
    receipt = page.inner_text("#sheets li")
    assert "s01_1.jpg" in receipt
    page.reload()
    assert page.inner_text("#sheets li") == receipt
    page.click("main summary >> nth=0")
    page.fill("#why", "The arrow of a_B is there.")
    student.look(f"{name}-asks")
    page.click("form[data-told] button")
    page.wait_for_selector("form[data-told] .said.good:not(:empty)")
    page.click("main a[href*=feedback]")
    page.wait_for_url("**/feedback.html")
    student.look(f"{name}-feedback")


WORKSHEET = f"""Identifier,Full name,Status,Grade,Maximum grade,Grade can be changed,Last modified (grade)
Participant 8,A. B.,-,,{load_rubric("pump").max_score:.2f},Yes,-
""".encode()
IDS = b"student_id,participant\ns08,8\n"
TOLD = {
    "en": ("Students in the file: 1.", "withheld: nothing handed in: s03, s04", "Moodle reports must be 1"),
    "ro": (
        "Studenți în fișier: 1.",
        "fără notă deocamdată: nepredat: s03, s04",
        "numărul de note actualizate",
    ),
    "ru": ("Студентов в файле: 1.", "оценки пока нет: не сдано: s03, s04", "обновлено оценок: 1"),
}


@pytest.mark.parametrize("locale", LOCALES)
def test_an_instructor_publishes_grades_and_gives_back(served, visit, locale):  # noqa: PLR0915 - one story
    lang = locale[:2]
    instructor, name = visit(locale), f"instructor-{lang}"
    page = instructor.page
    page.goto(first_invitation(served.settings))
    instructor.look(f"{name}-join")
    page.fill("#name", "admin")
    page.fill("#password", PASSWORD)
    page.click("main form button")
    page.wait_for_url(f"{served.address}/")
    instructor.look(f"{name}-empty")
    page.select_option("#assignment", "pump")
    page.fill("#title", "Pump mechanism: velocities and accelerations, group 3")
    page.click("main form button")
    page.wait_for_url("**/publications/*")
    address, key = page.url, page.url.rpartition("/")[2]
    instructor.look(f"{name}-published")
    instructor.context.grant_permissions(["clipboard-read"])
    page.click("[data-copy]")
    page.wait_for_selector("[data-copy] ~ [role=status]:not(:empty)")
    assert page.evaluate("navigator.clipboard.readText()") == f"{served.address}/c/{key}"
    read = zxingcpp.read_barcode(Image.open(BytesIO(page.locator(".wall svg").screenshot())))
    assert read.text == f"{served.address}/c/{key}"
    with page.expect_response(f"**/api/v1/publications/{key}"):
        page.check("[name=is_open]")
    with page.expect_navigation():
        page.set_input_files("#roster", SAMPLES / "roster.csv")
    with page.expect_navigation():
        page.set_input_files("#files", [SAMPLES / "s08.json", zipped(served.settings.data.parent)])
    with page.expect_navigation():
        dropped(page, "photos", "s02_1.jpg")
    page.locator(".files img").last.scroll_into_view_if_needed()
    page.wait_for_load_state("networkidle")
    assert (
        page.evaluate("[...document.querySelectorAll('.files img')].map((one) => one.naturalWidth > 0)")
        == [True] * 2
    )
    instructor.look(f"{name}-arrived")
    whose = page.locator(".files li").all_inner_texts()
    assert [any(who in one for one in whose) for who in ("s01", "s02", "s08")] == [True, True, True], whose
    assert "s04" in page.locator("details:has(.files) + details").text_content()
    page.set_input_files("#files", {"name": "bad.zip", "mimeType": "application/zip", "buffer": b"PK"})
    page.wait_for_selector(".upload li")
    assert "bad.zip" in page.inner_text(".upload li")
    page.click("#grade")
    page.wait_for_selector("#job:not([hidden])")
    instructor.look(f"{name}-grading", axe=False)
    page.wait_for_selector(f"a[href='/publications/{key}/results/index.html']")
    page.fill("#deadline", "2126-12-01T23:59")
    with page.expect_navigation():
        page.click("form:has(#deadline) button")
    assert page.input_value("#deadline") == "2126-12-01T23:59"
    with page.expect_response(f"**/api/v1/publications/{key}"):
        page.check("[name=is_released]")
    with page.expect_navigation():
        page.click(f"[data-send='POST /api/v1/publications/{key}/links']")
    page.locator("summary:has(+ .wide)").click()
    personal = page.locator("table code").first.inner_text()
    instructor.look(f"{name}-graded")
    page.click(f"a[href='/publications/{key}/results/index.html']")
    page.wait_for_url("**/index.html")
    instructor.look(f"{name}-results")
    page.goto(address)
    instructor.tab_through()

    student = visit(locale)
    student.page.goto(personal)
    student.page.locator("main summary").first.click()
    student.page.fill("#why", "The arrow of a_B is there.")
    student.page.click("form[data-told] button")
    student.page.wait_for_selector("form[data-told] .said.good:not(:empty)")

    page.goto(address)
    page.fill(".request textarea", "You are right: one point more.")
    instructor.look(f"{name}-request")
    with page.expect_navigation():
        page.click(".request button")
    assert "You are right" in page.inner_text(".request")
    page.select_option("#platform", "moodle")
    page.set_input_files("#form-file", {"name": "Оценки.csv", "mimeType": "text/csv", "buffer": WORKSHEET})
    page.click("#export summary")
    page.set_input_files("#x-ids", {"name": "ids.csv", "mimeType": "text/csv", "buffer": IDS})
    with page.expect_download() as download:
        page.click("#export > button")
    assert download.value.suggested_filename == "export-moodle.csv"
    assert "Participant 8," in Path(download.value.path()).read_text(encoding="utf-8")
    told = page.inner_text("#exported")
    assert [word for word in TOLD[lang] if word not in told] == []
    instructor.look(f"{name}-exported")
    page.select_option("#student", "s08")
    with page.expect_navigation():
        page.click("[data-erase] button")
    assert page.locator("#student option[value=s08], #student option:text-is('s08')").count() == 0
    page.goto(f"{served.address}/account")
    page.fill("#title", "script")
    page.click("[data-shows=token] button")
    page.wait_for_selector("[data-shows=token] .said.good:not(:empty)")
    for name_of_field, text in PLATFORM.items():
        page.fill(f"#lti-{name_of_field}", text)
    with page.expect_navigation():
        page.click("[data-send='POST /api/v1/lti/platforms'] button")
    assert "moodle.example.org" in page.inner_text("main li:has([data-send^='DELETE /api/v1/lti/'])")
    instructor.look(f"{name}-account")
    instructor.tab_through()
    page.goto(f"{served.address}/")
    instructor.look(f"{name}-list")
    page.click("[data-send='DELETE /api/v1/session']")
    page.wait_for_selector("main a[href='/sign-in']")
    instructor.look(f"{name}-home")
    page.goto(f"{served.address}/publications/{key}")
    instructor.look(f"{name}-refused")
    instructor.faults = [fault for fault in instructor.faults if "401" not in fault]
