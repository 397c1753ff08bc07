"""Make the pictures of the documentation: `python docs/make_pictures.py`, from the project's folder."""

import shutil
import socket
import tempfile
import threading
from pathlib import Path

import cv2
import uvicorn
from playwright.sync_api import Page, sync_playwright

from grader.folder.batch import Batch, grade
from grader.review.server import application
from grader.review.session import Session
from grader.rubric import load_rubric
from reference.authored.assignment import load_assignment
from reference.drawing.canvas import svg
from reference.drawing.sheets import reference_drawing
from reference.plan import exact_plan

HERE = Path(__file__).resolve().parent
WIDTH_PX = 1100
STUDENT = "s01"


def reference_picture() -> None:
    """The reference drawing of one variant."""
    pump = load_assignment("pump")
    plan = exact_plan(pump, [pump.variant(7)])
    sheets = reference_drawing(pump, plan)
    (HERE / "pump-7.svg").write_text(svg([sheet.shapes for sheet in sheets]), encoding="utf-8")


def overlay_picture() -> None:
    """A sample scan as graded: what was read and marked, drawn over it."""
    samples = HERE.parent / "samples" / "pump"
    pump = load_assignment("pump")
    with tempfile.TemporaryDirectory() as work:
        folder, out = Path(work) / "in", Path(work) / "out"
        folder.mkdir()
        for path in samples.glob(f"{STUDENT}_*"):
            shutil.copy(path, folder)
        header, *rows = (samples / "roster.csv").read_text(encoding="utf-8").splitlines()
        own = [row for row in rows if row.startswith(f"{STUDENT},")]
        (folder / "roster.csv").write_text("\n".join([header, *own]) + "\n", encoding="utf-8")
        grade(Batch(pump, load_rubric(pump.file.rubric), folder, out, None, None, 1, "en"), lambda *_: None)
        image = cv2.imread(str(out / STUDENT / "overlay.png"))
    height = round(image.shape[0] * WIDTH_PX / image.shape[1])
    small = cv2.resize(image, (WIDTH_PX, height), interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(HERE / "overlay.jpg"), small, [cv2.IMWRITE_JPEG_QUALITY, 80])


# The review ---------------------------------------------------------------------------------------


def review_pictures() -> None:
    """The page of the review: a question, eight at once, and a question on a phone."""
    pump = load_assignment("pump")
    with tempfile.TemporaryDirectory() as work:
        folder = Path(work) / "in"
        shutil.copytree(HERE.parent / "samples" / "pump", folder)
        session = Session(Batch(pump, load_rubric("pump"), folder, Path(work) / "out"))
        session.bring_up_to_date(lambda *_: None)
        listener = socket.create_server(("127.0.0.1", 0))
        config = uvicorn.Config(application(session), log_level="warning", lifespan="off", ws="none")
        server = uvicorn.Server(config)
        thread = threading.Thread(target=server.run, args=([listener],))
        thread.start()
        try:
            _photograph(f"http://127.0.0.1:{listener.getsockname()[1]}/")
        finally:
            server.should_exit = True
            thread.join()


def _photograph(address: str) -> None:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        for name, width, height in (("review", 1280, 760), ("review-phone", 390, 844)):
            page = browser.new_page(viewport={"width": width, "height": height})
            page.goto(address)
            page.evaluate("document.getElementById('by').value = ''")
            _settled(page)
            page.screenshot(path=HERE / f"{name}.png")
            if name == "review":
                page.click("[data-mode=eight]")
                _settled(page)
                page.screenshot(path=HERE / "review-eight.png")
        browser.close()


def _settled(page: Page) -> None:
    """Wait until the scans are there."""
    page.wait_for_load_state("networkidle")
    page.wait_for_timeout(1000)


if __name__ == "__main__":
    reference_picture()
    overlay_picture()
    review_pictures()
