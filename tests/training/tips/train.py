"""Train the network that finds the ends of vectors along strokes (`grader/scan/strokes/ends.py`).

    pip install torch onnx
    python -m tests.training.tips.train sheets FOLDER --first 0 --last 300
    python -m tests.training.tips.train network FOLDER --steps 8000 --out grader/scan/strokes/tips.onnx

The drawings are simulated sheets of every built-in assignment, hand, pen and scanner.
"""

import pickle
from pathlib import Path

import numpy as np
import torch
from torch import nn
from torch.nn import functional

from grader.scan.pixels import flatten
from grader.scan.strokes.ends import BEYOND_MM, CELL, HALF, KINDS, LEAST_MM, STEP_MM, strip_of
from tests.training.pages import run, simulated_pages

OFF_MM, FAR_OFF_MM, TILT = 0.5, 0.9, 0.16
"""Largest distances of a drawn vector's nearer and farther end from the stroke found for it."""
LINK_MM = 1.2
SPREAD_MM = 0.25
WINDOW = 144
BATCH = 48


# Training data ------------------------------------------------------------------------------------


def keep(folder: Path, seed: int) -> None:
    """Store a simulated student's strokes as bands, with the ends of the vectors drawn along each."""
    for number, (seen, truth) in enumerate(simulated_pages(seed)):
        strokes = seen.ink.strokes
        long = np.hypot(*(strokes.ends[:, 1] - strokes.ends[:, 0]).T) >= LEAST_MM
        ends, dark = strokes.ends[long], strokes.darkness[long]
        vectors, links = _drawn(truth["figures"])
        strip = strip_of(flatten(seen.image.grey), ends, dark, seen.sheet.mm_to_px)
        kept = [
            (
                np.rint(strip.ink[:, strip.band == row] * 100.0).astype(np.uint8),
                _ends_along(ends[row], vectors),
            )
            for row in range(len(ends))
            if not any(_runs_along(ends[row], link) for link in links)
        ]
        (folder / f"{seed}_{number}.pickle").write_bytes(pickle.dumps(kept))


def _drawn(figures: dict) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Vectors (2, 2) mm as drawn, and lines between all joints of the sketch, whose ends are ignored."""
    vectors = [
        np.array(vector["line_mm"])
        for figure in figures.values()
        for vector in figure.get("vectors", {}).values()
        if vector.get("line_mm")
    ]
    joints = [np.array(at) for at in figures.get("mechanism", {}).get("nodes", {}).values()]
    links = [np.array([p, q]) for row, p in enumerate(joints) for q in joints[row + 1 :]]
    return vectors, links


def _axes(stroke: np.ndarray, line: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Positions of a line's ends along and across a stroke, and the stroke's length."""
    length = float(np.hypot(*(stroke[1] - stroke[0])))
    u = (stroke[1] - stroke[0]) / length
    relative = line - stroke[0]
    return relative @ u, relative @ np.array([-u[1], u[0]]), length


def _ends_along(stroke: np.ndarray, vectors: list[np.ndarray]) -> list[tuple[float, int]]:
    """(mm along, kind) of heads and tails of vectors that lie along a stroke."""
    found = []
    for vector in vectors:
        along, off, length = _axes(stroke, vector)
        size = float(np.hypot(*(vector[1] - vector[0])))
        shared = min(along.max(), length) - max(along.min(), 0.0)
        tilted = abs(off[1] - off[0]) > TILT * size
        if size < LEAST_MM / 2.0 or tilted or shared < 0.35 * size:
            continue
        if np.abs(off).min() > OFF_MM or np.abs(off).max() > FAR_OFF_MM:
            continue
        back = int(along[1] < along[0])
        found.extend((float(along[1 - end]), 2 * end + back) for end in (0, 1) if abs(off[1 - end]) < OFF_MM)
    return found


def _runs_along(stroke: np.ndarray, link: np.ndarray) -> bool:
    along, off, length = _axes(stroke, link)
    return bool(np.abs(off).max() < LINK_MM and min(along.max(), length) - max(along.min(), 0.0) > 1.0)


# Training -----------------------------------------------------------------------------------------


def train(folder: Path, steps: int, out: Path) -> None:
    """Fit the network and store it for `cv2.dnn`."""

    class Network(nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.across = nn.Sequential(
                nn.Conv2d(1, 8, 5, stride=(2, 1), padding=(0, 2)), nn.ReLU(),
                nn.Conv2d(8, 16, (4, 5), stride=(2, CELL), padding=(0, 2)), nn.ReLU(),
                nn.Conv2d(16, 24, 3, padding=(0, 1)), nn.ReLU(),
                nn.Conv2d(24, 32, (4, 1)), nn.ReLU(),
            )  # fmt: skip
            self.along = nn.ModuleList(
                nn.Conv1d(32, 32, 7, padding=3 * gap, dilation=gap) for gap in (1, 2, 4)
            )
            self.told = nn.Conv1d(32, 2 * KINDS, 1)
            nn.init.constant_(self.told.bias, 0.0)
            self.told.bias.data[:KINDS] = -4.0

        def forward(self, ink: torch.Tensor) -> torch.Tensor:
            x = self.across(ink)[:, :, 0]
            x = torch.relu(self.along[0](x))
            x = x + torch.relu(self.along[1](x))
            x = x + torch.relu(self.along[2](x))
            return self.told(x)

    bands = [one for path in sorted(folder.glob("*.pickle")) for one in pickle.loads(path.read_bytes())]  # noqa: S301 - our own files
    rng = np.random.default_rng(0)
    marked = [one for one in bands if one[1]]
    plain = [one for one in bands if not one[1]]
    pool = marked * 3 + [plain[row] for row in rng.permutation(len(plain))[: 3 * len(marked)]]
    torch.manual_seed(0)
    network = Network()
    optimiser = torch.optim.AdamW(network.parameters(), 2e-3, weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, 3e-3, total_steps=steps, pct_start=0.15)
    for step in range(steps):
        ink, *truth = (torch.from_numpy(array) for array in _batch(pool, rng))
        loss = _loss(network(ink), *truth)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
        if step % 500 == 0:
            print(step, f"{loss.item():.3f}", flush=True)
    network.eval()
    example = torch.zeros(1, 1, 2 * HALF + 1, 4096)
    torch.onnx.export(network, (example,), str(out), opset_version=13, dynamo=False)


def _loss(
    told: torch.Tensor, near: torch.Tensor, at: torch.Tensor, off: torch.Tensor, known: torch.Tensor
) -> torch.Tensor:
    """Focal loss of the cells' log odds, and the absolute error of the positions near a tip."""
    odds = told[:, :KINDS]
    sure = torch.sigmoid(odds)
    seen = -(functional.logsigmoid(odds) * (1.0 - sure) ** 2 * at).sum()
    empty = -(functional.logsigmoid(-odds) * sure**2 * (1.0 - near) ** 4 * (1.0 - at)).sum()
    misplaced = (torch.abs(told[:, KINDS:] - off) * known).sum() / (known.sum() + 1.0)
    return (seen + empty) / (at.sum() + 1.0) + 2.0 * misplaced


def _batch(pool: list, rng: np.random.Generator) -> list[np.ndarray]:
    """Windows of bands, mirrored and dimmed at random, and their targets."""
    cells = np.arange(WINDOW // CELL) * CELL * STEP_MM
    ink = np.zeros((BATCH, 1, 2 * HALF + 1, WINDOW), np.float32)
    near, at, off, known = np.zeros((4, BATCH, KINDS, WINDOW // CELL), np.float32)
    for row in range(BATCH):
        band, tips = pool[rng.integers(len(pool))]
        part, places, kinds = _window(band, np.array(tips, dtype=float).reshape(-1, 2), rng)
        ink[row, 0, :, : part.shape[1]] = part
        for place, kind in zip(places, kinds, strict=True):
            away = cells - place
            near[row, kind] = np.maximum(near[row, kind], np.exp(-0.5 * (away / SPREAD_MM) ** 2))
            close = (np.abs(away) < 0.5) & ((known[row, kind] == 0) | (np.abs(off[row, kind]) > np.abs(away)))
            off[row, kind][close], known[row, kind][close] = -away[close], 1.0
            if np.abs(away).min() < 0.2:
                at[row, kind, np.abs(away).argmin()] = 1.0
    return [ink, near, at, off, known]


def _window(
    band: np.ndarray, tips: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    first, wide = 0, band.shape[1]
    if wide > WINDOW:
        first = int(rng.integers(0, wide - WINDOW + 1))
        if len(tips) and rng.random() < 0.7:
            middle = (tips[rng.integers(len(tips)), 0] + BEYOND_MM) / STEP_MM
            first = int(np.clip(middle - rng.integers(20, WINDOW - 20), 0, wide - WINDOW))
    part = band[:, first : first + WINDOW] / 100.0 * rng.uniform(0.85, 1.15)
    places, kinds = tips[:, 0] + BEYOND_MM - first * STEP_MM, tips[:, 1].astype(int)
    if rng.random() < 0.5:
        part = part[::-1]
    if rng.random() < 0.5:
        part, places, kinds = part[:, ::-1], (part.shape[1] - 1) * STEP_MM - places, kinds ^ 1
    return np.clip(np.roll(part, rng.integers(-1, 2), axis=0), 0.0, 1.5), places, kinds


if __name__ == "__main__":
    run(__doc__, keep, train, steps=8000)
