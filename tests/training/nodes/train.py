"""Train the network that locates nodes by the ink around them (`grader/scan/strokes/nodes.py`).

    pip install torch onnx
    python -m tests.training.nodes.train sheets FOLDER --first 0 --last 300
    python -m tests.training.nodes.train network FOLDER --steps 12000 --out grader/scan/strokes/nodes.onnx

A window is cut around each node of a simulated plan, turned at random, a little beside the node as a reading
would be; it holds the ink and the plan's vectors as far as they would be known. The network gives a mixture
of Student's distributions (six degrees of freedom) of the node's position, one for each cell, and the
probability that the node is not in the window.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import nn

from grader.records import InkMap, NodeView
from grader.scan.strokes.nodes import CELLS, HALF_MM, NARROWEST, SIDE_PX, USUAL, WIDEST, window_of
from tests.bench.reading_truth import OnPaper
from tests.training.pages import run, simulated_pages

PX_PER_MM = 6.0
ONE_NODE_MM = 0.45
"""Ends of vectors nearer than this are at one node."""
BATCH = 64
OFF_MM, OTHERS_MM = (0.7, 1.3, 2.0), (0.25, 0.5, 0.5)
"""Largest distance of a window's middle from its node, and standard error of the plan's other nodes."""
SHARES = (0.25, 0.35, 0.22, 0.18)
"""Shares of these three, and of windows without their node."""
NOWHERE_MM = (2.6, 9.0)
BARE = 0.25
"""Share of windows without their node that have no ink at all."""
OUTLIERS = 0.005
DEGREES = 6.0


# Training data ------------------------------------------------------------------------------------


def keep(folder: Path, seed: int) -> None:
    """Store a simulated student's ink maps, and the vectors drawn on them, in mm of the registered sheet."""
    for number, (page, truth) in enumerate(simulated_pages(seed)):
        back = OnPaper(truth, page.sheet, page.image.grey.shape).back
        drawn = [
            back(np.array([complex(x, -y) for x, y in vector["line_mm"]]))
            for figure in truth["figures"].values()
            for vector in figure.get("vectors", {}).values()
            if vector.get("line_mm")
        ]
        cv2.imwrite(str(folder / f"{seed}_{number}.png"), page.ink.where.ink)
        vectors = [[[round(p.real, 3), round(-p.imag, 3)] for p in ends] for ends in drawn]
        (folder / f"{seed}_{number}.json").write_text(json.dumps({"vectors": vectors}), encoding="utf-8")


@dataclass(frozen=True)
class Drawn:
    """A sheet's ink, its nodes (n,) complex mm, y up, vectors (k, 2) by node, and each node's plan."""

    where: InkMap
    at: np.ndarray
    vectors: np.ndarray
    plan: np.ndarray


def sheets_in(folder: Path) -> list[Drawn]:
    """Every sheet of a folder that has a vector."""
    found = []
    for path in sorted(folder.glob("*.json")):
        lines = np.array(json.loads(path.read_text(encoding="utf-8"))["vectors"]).reshape(-1, 2, 2)
        ends = (lines[..., 0] - 1j * lines[..., 1]).ravel()
        node = _joined(np.argwhere(np.abs(ends - ends[:, None]) < ONE_NODE_MM), len(ends))
        names, node = np.unique(node, return_inverse=True)
        vectors = node.reshape(-1, 2)
        vectors = vectors[vectors[:, 0] != vectors[:, 1]]
        if len(vectors):
            at = np.array([ends[node == row].mean() for row in range(len(names))])
            where = InkMap(cv2.imread(str(path.with_suffix(".png")), cv2.IMREAD_GRAYSCALE), PX_PER_MM)
            found.append(Drawn(where, at, vectors, _joined(vectors, len(at))))
    return found


def _joined(pairs: np.ndarray, count: int) -> np.ndarray:
    """(count,) group numbers: the same for all that pairs connect."""
    group = np.arange(count)
    for first, second in pairs:
        group[group == group[second]] = group[first]
    return group


def sample(sheet: Drawn, rng: np.random.Generator) -> tuple[np.ndarray, complex, bool]:
    """((4, 48, 48) window, node relative to its middle in mm, x - i y, whether the node is outside)."""
    node, kind = int(rng.integers(len(sheet.at))), int(rng.choice(4, p=SHARES))
    nowhere = kind == len(OFF_MM)
    others = OTHERS_MM[min(kind, len(OTHERS_MM) - 1)]
    known = sheet.at + others * (rng.normal(size=len(sheet.at)) + 1j * rng.normal(size=len(sheet.at)))
    away = rng.uniform(*NOWHERE_MM) if nowhere else OFF_MM[kind] * np.sqrt(rng.random())
    known[node] = sheet.at[node] + away * np.exp(2j * np.pi * rng.random())
    drawn = (sheet.plan == sheet.plan[node])[sheet.vectors[:, 0]]
    drawn &= rng.random(len(drawn)) > (0.05 if rng.random() < 0.8 else 0.3)
    turn = np.exp(2j * np.pi * rng.random())
    view = NodeView(complex(known[node]), known[sheet.vectors[drawn]])
    window = window_of(sheet.where, view, turn)
    window[0] = 0.0 if nowhere and rng.random() < BARE else _other_pen(window[0], rng)
    off = complex((sheet.at[node] - known[node]) * np.conj(turn))
    if rng.random() < 0.5:
        window, off = window[:, ::-1], off.conjugate()
    return np.ascontiguousarray(window), off, nowhere


def _other_pen(ink: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Ink as drawn and scanned in another way: darker, noisier, blurred, or clipped."""
    ink = ink * np.float32(rng.uniform(0.6, 1.5))
    if rng.random() < 0.3:
        ink = ink + rng.normal(size=ink.shape).astype(np.float32) * rng.uniform(0.0, 0.06)
    if rng.random() < 0.3:
        ink = cv2.GaussianBlur(ink, (0, 0), rng.uniform(0.3, 0.9))
    if rng.random() < 0.15:
        ink = np.clip((ink - 0.5 * rng.random()) * 3.0, 0.0, 1.0)
    return np.clip(ink, 0.0, 1.2)


# Training -----------------------------------------------------------------------------------------


class Network(nn.Module):
    """Two halvings, then layers of growing reach; each cell gives log odds, position and width."""

    def __init__(self) -> None:
        super().__init__()
        self.near = nn.Sequential(
            nn.Conv2d(4, 16, 5, 2, 2), nn.ReLU(), nn.Conv2d(16, 24, 3, 1, 1), nn.ReLU(),
            nn.Conv2d(24, 32, 3, 2, 1), nn.ReLU(),
        )  # fmt: skip
        self.far = nn.ModuleList(nn.Conv2d(32, 32, 3, 1, gap, gap) for gap in (1, 2, 4, 1))
        self.cells, self.nowhere = nn.Conv2d(32, 4, 1), nn.Linear(32, 1)

    def forward(self, window: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """(b, 4, 12, 12) outputs of the cells, and (b, 1) log odds that the node is outside."""
        x = self.near(window)
        for layer in self.far:
            x = x + torch.relu(layer(x))
        return self.cells(x), self.nowhere(x.mean((2, 3)))


def loss_of(
    cells: torch.Tensor, nowhere: torch.Tensor, off: torch.Tensor, away: torch.Tensor
) -> torch.Tensor:
    """Negative log density of the positions `off` (b, 2), or of being outside where `away`."""
    odds = torch.cat([cells[:, 0].flatten(1), nowhere], 1).log_softmax(1)
    middles = (torch.arange(CELLS) + 0.5) * (2.0 * HALF_MM / CELLS) - HALF_MM
    width = torch.clamp(cells[:, 3] + USUAL, NARROWEST, WIDEST)
    across = off[:, 0, None, None] - middles - cells[:, 1]
    down = off[:, 1, None, None] - middles[:, None] - cells[:, 2]
    distance = (across**2 + down**2) * torch.exp(-2.0 * width) / DEGREES
    density = -0.5 * (DEGREES + 2.0) * torch.log1p(distance) - 2.0 * width - np.log(2.0 * np.pi)
    there = torch.logsumexp(odds[:, :-1] + density.flatten(1), 1) + np.log1p(-OUTLIERS)
    there = torch.logaddexp(there, torch.full_like(there, np.log(OUTLIERS / (4.0 * HALF_MM**2))))
    return -torch.where(away, odds[:, -1], there)


def train(folder: Path, steps: int, out: Path) -> None:
    """Fit the network and store it for `cv2.dnn`."""
    sheets = sheets_in(folder)
    share = np.array([len(sheet.at) for sheet in sheets], dtype=float)
    rng = np.random.default_rng(0)
    torch.manual_seed(0)
    network = Network()
    optimiser = torch.optim.AdamW(network.parameters(), 3e-3, weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, 4e-3, total_steps=steps, pct_start=0.1)
    for step in range(steps):
        rows = rng.choice(len(sheets), BATCH, p=share / share.sum())
        windows, offs, away = zip(*(sample(sheets[row], rng) for row in rows), strict=True)
        off = torch.tensor([(at.real, -at.imag) for at in offs], dtype=torch.float32)
        loss = loss_of(*network(torch.from_numpy(np.stack(windows))), off, torch.tensor(away)).mean()
        optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(network.parameters(), 5.0)
        optimiser.step()
        schedule.step()
        if step % 250 == 0:
            print(step, f"{loss.item():.3f}", flush=True)
    network.eval()
    names = ["cells", "none"]
    example = torch.zeros(1, 4, SIDE_PX, SIDE_PX)
    axes = {name: {0: "windows"} for name in ("window", *names)}
    torch.onnx.export(
        network, (example,), str(out), opset_version=13, dynamo=False,
        input_names=["window"], output_names=names, dynamic_axes=axes,
    )  # fmt: skip


if __name__ == "__main__":
    run(__doc__, keep, train, steps=12000)
