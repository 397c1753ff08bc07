"""Reports and pictures to be shown."""

import cv2
import numpy as np

from grader.documents import (
    CriterionDocument,
    MistakeDocument,
    ProblemDocument,
    Quantity,
    ReportDocument,
    ResultsDocument,
    RivalDocument,
    ScaleDocument,
    Tolerance,
    UnmatchedDocument,
)
from grader.overlay.scene import Arrow, Dot, Ghost, Picture, Scene

HOSTILE = '<script>alert("x")</script>'


def criterion(name="v_B", verdict="full", points=5.0, *, feedback="Right.", title=None):
    return CriterionDocument(
        id=name, title=title or f"Vector {name}", vector=name, points=points, max_points=5.0, verdict=verdict,
        measured=Quantity(length_mm=47.25, direction_deg=12.5, value=1.701, unit="m/s"),
        expected=Quantity(length_mm=46.4, direction_deg=13.5, value=1.6704, unit="m/s"),
        tolerance=Tolerance(length_mm=1.0, direction_deg=1.5), confidence=0.99, feedback=feedback,
    )  # fmt: skip


def report(**changes):
    fields = {
        "student_id": "s07",
        "assignment": "pump",
        "variant": {"n": 7},
        "position": None,
        "status": "graded",
        "score": 7.5,
        "score_range": (7.5, 7.5),
        "max_score": 10.0,
        "criteria": [criterion(), criterion("a_BA_n", "none", 2.5, feedback="It is too long.")],
        "mistakes": [
            MistakeDocument(
                code="normal_reversed",
                at="n_BA",
                explains=["a_BA_n"],
                confidence=0.9,
                detail="x = 1",
                feedback="The normal component a_BA_n was laid off away from the centre of rotation.",
                redo=["From a' lay off a'n_BA, parallel to BA; it ends in n_BA.", "They meet in b'."],
            )
        ],
        "scales": {"kv": ScaleDocument(declared=None, used=0.036, assumed=True)},
    }
    return ReportDocument(**{**fields, **changes})


def hostile_report():
    return report(
        student_id="s08",
        criteria=[criterion(title=HOSTILE, feedback=HOSTILE)],
        scales={"kv": ScaleDocument(declared=0.1, used=0.1, assumed=False, text=HOSTILE, refused=HOSTILE)},
        problems=[ProblemDocument(code="odd", message=HOSTILE, file=HOSTILE)],
        mistakes=[
            MistakeDocument(
                code="arithmetic", at=HOSTILE, explains=["a_BA_n", HOSTILE], confidence=0.9,
                detail=HOSTILE, feedback=HOSTILE, redo=[HOSTILE],
                rivals=[RivalDocument(code="scale_wrong", at=HOSTILE, confidence=0.2, feedback=HOSTILE)],
            )
        ],
    )  # fmt: skip


def results(*reports):
    nobody = UnmatchedDocument(file=HOSTILE, page=2, code="owner_unknown", message="nothing says whose it is")
    return ResultsDocument(assignment="pump", reports=list(reports), unmatched=[nobody])


def picture(source="s07.jpg", *, spread=60.0, scanned=True):
    """A white sheet with a velocity plan `spread` mm wide on it; v_B was expected to end elsewhere."""
    _ok, jpeg = cv2.imencode(".jpg", np.full((297, 420), 255, np.uint8))
    _ok, png = cv2.imencode(".png", np.full((297, 420), 255, np.uint8))
    arrows = (
        Arrow("v_A", "velocity_plan", (100.0, 100.0), (100.0 + spread, 100.0), "full", doubtful=False),
        Arrow("v_B", "velocity_plan", (100.0, 100.0), (100.0 + spread, 130.0), "none", doubtful=False),
        Arrow("v_C", "velocity_plan", (100.0, 100.0), (130.0, 140.0), "review", doubtful=True),
    )
    dots = (Dot("o", (100.0, 100.0), doubtful=False),)
    ghosts = (Ghost("v_B", "velocity_plan", (100.0, 100.0), (100.0 + spread, 150.0)),)
    scene = Scene((420.0, 297.0), arrows, ghosts, dots)
    if not scanned:
        return Picture(source, 1, b"", b"", scene)
    return Picture(source, 1, png.tobytes(), jpeg.tobytes(), scene)
