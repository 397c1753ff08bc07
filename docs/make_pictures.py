"""Make the pictures of the documentation, in `docs/pictures`: `python -m docs.make_pictures`."""

import csv
import shutil
import socket
import tempfile
import threading
from collections.abc import Iterator
from contextlib import chdir, contextmanager
from html import escape
from pathlib import Path

import cv2
import uvicorn
from playwright.sync_api import Browser, Page, sync_playwright

from grader.cli.commands import app as planmark
from grader.folder.batch import Batch
from grader.review.server import application
from grader.review.session import Session
from grader.rubric import RubricFile, load_rubric
from reference.authored.assignment import load_assignment
from reference.drawing.canvas import svg
from reference.drawing.sheets import reference_drawing
from reference.plan import exact_plan

HERE = Path(__file__).resolve().parent
PICTURES = HERE / "pictures"
SAMPLES = HERE.parent / "samples" / "pump"
WORKSHEET = HERE / "assets" / "Grades-Pump.csv"
"""As Moodle gives it for the bundled class."""
WIDTH_PX = 1100
SHOWN, WRONG = "s02", "s05"
"""A student whose scan is shown, and one with a finished mark and one mistake."""
SHOWN_PX = {"feedback": 960, "class": 860, "worksheet": 360}
"""Height of a page that a picture shows, from its top."""
SHOWN_COLUMNS = (0, 1, 2, 5, 6, 10)
"""Columns of the worksheet: who, grade, maximum, comment."""


def reference_picture() -> None:
    """The reference drawings of one variant: its motion, its forces."""
    for name in ("pump", "pump-forces"):
        pump = load_assignment(name)
        plan = exact_plan(pump, [pump.variant(7)])
        sheets = reference_drawing(pump, plan)
        (PICTURES / f"{name}-7.svg").write_text(svg([sheet.shapes for sheet in sheets]), encoding="utf-8")


# The walk -----------------------------------------------------------------------------------------


def walk_pictures() -> None:
    """The bundled class from scans to the worksheet: a scan, its overlay, pages, the filled-in worksheet."""
    _small(SAMPLES / f"{SHOWN}_1.jpg", "scan")
    # Pages name the folder of results as it was given: here as the walk has it.
    with tempfile.TemporaryDirectory() as work, chdir(work):
        out = Path("marks")
        planmark(["grade", str(SAMPLES), "--assignment", "pump", "--out", str(out)], standalone_mode=False)
        _small(out / SHOWN / "overlay.png", "overlay")
        filled, table = Path("filled.csv"), Path("filled.html")
        asked = ["export", str(out), "--to", "moodle", "--worksheet", str(WORKSHEET), "--file", str(filled)]
        planmark(asked, standalone_mode=False)
        table.write_text(_as_page(filled), encoding="utf-8")
        pages = {
            "feedback": out / WRONG / "feedback.html",
            "class": out / "index.html",
            "worksheet": table,
        }
        with _browser() as browser:
            for name, path in pages.items():
                page = browser.new_page(viewport={"width": 1000, "height": SHOWN_PX[name]})
                page.goto(path.resolve().as_uri())
                page.screenshot(path=PICTURES / f"{name}.png")


def _small(path: Path, name: str) -> None:
    image = cv2.imread(str(path))
    height = round(image.shape[0] * WIDTH_PX / image.shape[1])
    small = cv2.resize(image, (WIDTH_PX, height), interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(PICTURES / f"{name}.jpg"), small, [cv2.IMWRITE_JPEG_QUALITY, 80])


def _as_page(table: Path) -> str:
    """A worksheet as a spreadsheet shows it."""
    with table.open(encoding="utf-8-sig", newline="") as file:
        head, *rows = [[row[at] for at in SHOWN_COLUMNS] for row in csv.reader(file)]
    cells = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
    style = "body{font:15px sans-serif;margin:12px}td,th{border:1px solid #bbb;padding:4px 8px}"
    top = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    return f"<style>{style}table{{border-collapse:collapse}}</style><table><tr>{top}</tr>{cells}</table>"


@contextmanager
def _browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        yield browser
        browser.close()


# The review ---------------------------------------------------------------------------------------


def review_pictures() -> None:
    """The page of the review: a question on a screen and on a phone, and one of eight students at once."""
    rubric = load_rubric("pump")
    with _reviewed(rubric) as address, _browser() as browser:
        for name, width, height in (("review", 1280, 760), ("review-phone", 390, 844)):
            _opened(browser, address, width, height).screenshot(path=PICTURES / f"{name}.png")
    # In the bundled class one student waits: this is the review of one who wants to see what is near a limit.
    doubt = rubric.doubt.model_copy(update={"in_doubt": "person", "stake": 0.0})
    with _reviewed(rubric.model_copy(update={"doubt": doubt})) as address, _browser() as browser:
        page = _opened(browser, address, 1280, 760)
        page.click("[data-mode=eight]")
        _settled(page)
        page.screenshot(path=PICTURES / "review-eight.png")


@contextmanager
def _reviewed(rubric: RubricFile) -> Iterator[str]:
    """The address of the review of the bundled class by a rubric."""
    with tempfile.TemporaryDirectory() as work:
        folder = Path(work) / "in"
        shutil.copytree(SAMPLES, folder)
        session = Session(Batch(load_assignment("pump"), rubric, folder, Path(work) / "out"))
        session.bring_up_to_date(lambda *_: None)
        listener = socket.create_server(("127.0.0.1", 0))
        config = uvicorn.Config(application(session), log_level="warning", lifespan="off", ws="none")
        server = uvicorn.Server(config)
        thread = threading.Thread(target=server.run, args=([listener],))
        thread.start()
        try:
            yield f"http://127.0.0.1:{listener.getsockname()[1]}/"
        finally:
            server.should_exit = True
            thread.join()


def _opened(browser: Browser, address: str, width: int, height: int) -> Page:
    page = browser.new_page(viewport={"width": width, "height": height})
    page.goto(address)
    page.evaluate("document.getElementById('by').value = ''")
    _settled(page)
    return page


def _settled(page: Page) -> None:
    """Wait until the scans are there."""
    page.wait_for_load_state("networkidle")
    page.wait_for_timeout(1000)


if __name__ == "__main__":
    reference_picture()
    walk_pictures()
    review_pictures()
