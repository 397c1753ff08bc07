"""The map from a sheet's millimetres to the pixels of a scanner or a phone.

Pixels are those of the stored image; the centre of its top left pixel is (0, 0). With a lens the
homography gives undistorted pixels u; the stored pixel p satisfies u = c + (p - c)(1 + k1 |p - c|^2 / r^2)
with c the image's centre and r half its diagonal.
"""

from dataclasses import dataclass

import numpy as np

from samples.simulation.page import PAPER_MM
from samples.simulation.settings import Scan
from samples.simulation.strokes import FloatArray, Rng

_PHONE_PX = (4000, 3000)
_PHONE_DPI = 220.0
_FOCAL = 1.05
"""A phone's focal length in image widths."""


@dataclass(frozen=True, slots=True)
class PaperView:
    """A mapping from sheet to stored pixels.

    Attributes
    ----------
    homography : (3, 3) sheet mm, y down, to (undistorted) pixels
    size : height and width of the stored image
    k1 : the lens's distortion, 0 for none
    turns : quarter turns counter-clockwise by which the stored image is turned
    paper_mm : the sheet's outline x0, y0, x1, y1 in its own millimetres
    curl_mm : a bow across the sheet, on top of the homography: the shift of its middle, upwards
    """

    homography: FloatArray
    size: tuple[int, int]
    k1: float
    turns: int
    paper_mm: tuple[float, float, float, float]
    curl_mm: float = 0.0

    @property
    def centre(self) -> FloatArray:
        """The lens's centre, pixels."""
        return np.array([(self.size[1] - 1) / 2.0, (self.size[0] - 1) / 2.0])

    @property
    def radius(self) -> float:
        """Half the image's diagonal, pixels."""
        return float(np.hypot(*self.size) / 2.0)

    def to_px(self, xy_mm: FloatArray) -> FloatArray:
        """Sheet millimetres (n, 2) to stored pixels (n, 2)."""
        flat = projected(self.homography, xy_mm - self._bow(xy_mm))
        if self.k1 == 0.0:
            return flat
        arm = flat - self.centre
        place = arm.copy()
        for _ in range(8):
            place = arm / (1.0 + self.k1 * (place**2).sum(axis=1, keepdims=True) / self.radius**2)
        return np.asarray(self.centre + place)

    def to_mm(self, px: FloatArray) -> FloatArray:
        """Stored pixels (n, 2) to sheet millimetres (n, 2)."""
        arm = px - self.centre
        if self.k1 != 0.0:
            arm = arm * (1.0 + self.k1 * (arm**2).sum(axis=1, keepdims=True) / self.radius**2)
        back = np.asarray(np.linalg.inv(self.homography), dtype=np.float64)
        flat = projected(back, np.asarray(arm + self.centre))
        return np.asarray(flat + self._bow(flat))

    def _bow(self, xy_mm: FloatArray) -> FloatArray:
        """Shifts of points by the sheet's bow, mm along y."""
        lift = self.curl_mm * np.sin(np.pi * np.clip(xy_mm[:, 0] / PAPER_MM[0], 0.0, 1.0))
        return np.column_stack([np.zeros_like(lift), lift])

    @property
    def px_per_mm(self) -> float:
        """Mean resolution over the sheet."""
        w, h = PAPER_MM
        corners = self.to_px(np.array([[0, 0], [w, 0], [w, h], [0, h]], dtype=float))
        x, y = corners.T
        area = 0.5 * abs(float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))))
        return float(np.sqrt(area / (w * h)))


def projected(homography: FloatArray, xy: FloatArray) -> FloatArray:
    """Points (n, 2) through a homography."""
    lifted = np.column_stack([xy, np.ones(len(xy))]) @ homography.T
    return np.asarray(lifted[:, :2] / lifted[:, 2:])


def view_of(scan: Scan, rng: Rng) -> PaperView:
    """The view of the sheet by this scanner or phone."""
    upright, size = _phone(scan, rng) if scan.device == "phone" else _glass(scan, rng)
    homography = upright
    for _ in range(scan.quarter_turns % 4):
        homography = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, size[1] - 1.0], [0.0, 0.0, 1.0]]) @ homography
        size = (size[1], size[0])
    w, h = PAPER_MM
    grow = (1.0 / scan.copy_scale - 1.0) / 2.0
    paper = (-grow * w, -grow * h, (1 + grow) * w, (1 + grow) * h)
    phone = scan.device == "phone"
    k1, curl = (scan.lens_k1, scan.curl_mm) if phone else (0.0, 0.0)
    return PaperView(homography, size, k1, scan.quarter_turns % 4, paper, curl)


def _glass(scan: Scan, rng: Rng) -> tuple[FloatArray, tuple[int, int]]:
    """The homography and image size of a flatbed or copier: skewed, shifted, unequal scales."""
    pitch = scan.dpi / 25.4
    extra = rng.choice([0.0, 0.0, 6.0, 12.0]) if scan.shift_mm > 0 else 0.0
    w, h = PAPER_MM[0] + extra, PAPER_MM[1] + 0.7 * extra
    size = (round(h * pitch), round(w * pitch))
    angle = np.radians(np.clip(rng.normal(0.0, scan.skew_deg), -4.0, 4.0)) if scan.skew_deg else 0.0
    shift = rng.normal(0.0, scan.shift_mm, 2) if scan.shift_mm else np.zeros(2)
    stretch = 1.0 + np.clip(rng.normal(0.0, scan.stretch, 2), -0.002, 0.002) if scan.stretch else np.ones(2)
    middle = np.array([PAPER_MM[0] / 2, PAPER_MM[1] / 2])
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    linear = np.diag(pitch * stretch) @ turn * scan.copy_scale
    offset = (np.array([w, h]) / 2 + shift) * pitch - 0.5 - linear @ middle
    if scan.cropped_mm > 0:
        left, top, right, bottom = rng.uniform(0.0, 2.0 * scan.cropped_mm, 4) * pitch
        size = (round(PAPER_MM[1] * pitch - top - bottom), round(PAPER_MM[0] * pitch - left - right))
        offset = np.array([-left, -top]) - 0.5
    return np.array([[*linear[0], offset[0]], [*linear[1], offset[1]], [0.0, 0.0, 1.0]]), size


def _phone(scan: Scan, rng: Rng) -> tuple[FloatArray, tuple[int, int]]:
    """The homography and image size of a phone: tilted a little, the sheet nearly filling the picture."""
    width, height = (round(side * scan.dpi / _PHONE_DPI) for side in _PHONE_PX)
    axis, tilt = rng.uniform(0, 2 * np.pi), np.radians(scan.tilt_deg)
    roll = np.radians(np.clip(rng.normal(0.0, scan.skew_deg), -6.0, 6.0))
    ux, uy = np.cos(axis), np.sin(axis)
    cross = np.array([[0, 0, uy], [0, 0, -ux], [-uy, ux, 0]])
    rotation = np.eye(3) + np.sin(tilt) * cross + (1 - np.cos(tilt)) * cross @ cross
    c, s = np.cos(roll), np.sin(roll)
    rotation = rotation @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    focal, distance = _FOCAL * width, _FOCAL * PAPER_MM[0] / 0.92
    to_middle = np.array([[1, 0, -PAPER_MM[0] / 2], [0, 1, -PAPER_MM[1] / 2], [0, 0, 1.0]])
    pose = np.column_stack([rotation[:, 0], rotation[:, 1], [0, 0, distance]])
    seen = np.diag([focal, focal, 1.0]) @ pose @ to_middle
    corners = projected(seen, np.array([[0, 0], [420, 0], [420, 297], [0, 297.0]]))
    low, high = corners.min(axis=0), corners.max(axis=0)
    scale = min(np.array([width, height]) / (high - low)) * rng.uniform(0.9, 0.965)
    slack = np.array([width, height]) - scale * (high - low)
    offset = slack * rng.uniform(0.25, 0.75, 2) - scale * low - 0.5
    fit = np.array([[scale, 0, offset[0]], [0, scale, offset[1]], [0, 0, 1.0]])
    homography = fit @ seen
    return np.asarray(homography / homography[2, 2]), (height, width)
