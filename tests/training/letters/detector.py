"""Train the networks that find letters on drawings and name them (`grader/scan/handwriting/*.onnx`).

    pip install torch onnx scikit-image fonttools
    python -m tests.training.letters.detector windows FOLDER DATA --count 20000
    python -m tests.training.letters.detector windows FOLDER CHECK --count 2000 --seed 9 --left-out
    python -m tests.training.letters.detector network DATA --out grader/scan/handwriting/detector.onnx
    python -m tests.training.letters.detector signs DATA --out grader/scan/handwriting/signs.onnx
    python -m tests.training.letters.detector check CHECK

FOLDER holds the packages that `train.py` names. The detector says for each cell of four pixels whether a
sign's middle lies there, and the distances of its borders. The other network names the sign in the box.
"""

import argparse
import time
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np

from grader.scan.handwriting import letters
from grader.scan.handwriting.letters import CELL_PX, DETECTED, UNIT_PX
from tests.training.letters.drawings import SIDE_PX, Alphabet, backgrounds, own_window, sheet_window
from tests.training.letters.glyphs import LEFT_OUT, TRAINED_ON, digits, glyphs_of

CELLS = SIDE_PX // CELL_PX
BATCH, SIGNS_BATCH = 24, 64
STEM, HIDDEN = (10, 28), 56
SHIFT_PX = 8
"""Windows are moved by up to so much, that places within a cell are learnt alike."""
SHEETS = 60
DIGITS = 3000


def windows(folder: Path, data: Path, count: int, seed: int, names: tuple[str, ...]) -> None:
    """Draw windows and store them."""
    rng = np.random.default_rng([seed, 77])
    fonts = [list(glyphs_of(folder / name)) for name in names]
    real = list(digits(folder / "mnist"))
    np.random.default_rng(20).shuffle(real)
    alphabet = Alphabet(fonts, real[:DIGITS] if names == TRAINED_ON else real[DIGITS : 2 * DIGITS])
    sheets = list(backgrounds(range(1000 * seed, 1000 * seed + SHEETS)))
    pictures, labels, owner = [], [], []
    while len(pictures) < count:
        made = (
            sheet_window(sheets[rng.integers(len(sheets))], alphabet, rng)
            if sheets and rng.random() < 0.4
            else own_window(alphabet, rng)
        )
        if made is not None:
            owner.append(np.full(len(made[1]), len(pictures)))
            pictures.append(made[0])
            labels.append(made[1])
    np.savez(data, pictures=np.array(pictures), labels=np.concatenate(labels), owner=np.concatenate(owner))


def train(paths: list[Path], steps: int, out: Path, start: Path | None) -> None:
    """Fit the network and store it for `cv2.dnn`."""
    import torch  # noqa: PLC0415 - not needed for drawing windows
    from torch import nn  # noqa: PLC0415
    from torch.nn import functional  # noqa: PLC0415

    torch.set_num_threads(1)
    torch.manual_seed(0)
    stored = [np.load(path) for path in paths]
    pictures = np.concatenate([one["pictures"] for one in stored])
    before = np.cumsum([0, *(len(one["pictures"]) for one in stored)])
    owner = np.concatenate([one["owner"] + first for one, first in zip(stored, before[:-1], strict=True)])
    labels = np.concatenate([one["labels"] for one in stored])
    first = np.searchsorted(owner, np.arange(len(pictures) + 1))

    network = network_of(nn)
    if start is not None:
        network.load_state_dict(torch.load(start))
    optimiser = torch.optim.AdamW(network.parameters(), 2e-3, weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, 3e-3, total_steps=steps, pct_start=0.1)
    rng = np.random.default_rng(1)
    began, means = time.process_time(), []
    for step in range(steps):
        rows = rng.integers(0, len(pictures), BATCH)
        gain = rng.uniform(0.75, 1.25, (BATCH, 1, 1, 1)).astype(np.float32)
        shift = rng.integers(0, SHIFT_PX, 2)
        batch = np.zeros((BATCH, 1, SIDE_PX, SIDE_PX), np.float32)
        part = pictures[rows, shift[1] :, shift[0] :] / np.float32(255.0)
        batch[:, 0, : part.shape[1], : part.shape[2]] = part
        ink = torch.from_numpy(np.clip(batch * gain, 0.0, 1.0))
        moved = [labels[first[row] : first[row + 1]] - [0.0, *shift, *shift] for row in rows]
        near, at, border, weight = map(torch.from_numpy, targets(moved))
        told = functional.pixel_shuffle(network(ink), 2)
        odds = told[:, 0]
        sure = torch.sigmoid(odds)
        seen = -(functional.logsigmoid(odds) * (1.0 - sure) ** 2 * at).sum()
        empty = -(functional.logsigmoid(-odds) * sure**2 * (1.0 - near) ** 4 * (1.0 - at)).sum()
        borders = (torch.abs(told[:, 1:5] - border).sum(dim=1) * weight).sum()
        loss = (seen + empty) / (at.sum() + 1.0) + 0.5 * borders / (weight.sum() + 1.0)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
        sums = (seen / at.sum(), empty / at.sum(), borders / weight.sum())
        means.append([each.item() for each in sums])
        if step % 200 == 199:
            told_so_far = " ".join(f"{mean:.3f}" for mean in np.mean(means, axis=0))
            print(step + 1, told_so_far, f"{time.process_time() - began:.0f} s", flush=True)
            means = []
            torch.save(network.state_dict(), out.with_suffix(".pt"))
            stored_as(network, out, SIDE_PX)
    stored_as(network, out, SIDE_PX)


def stored_as(network, out: Path, side: int) -> None:
    """Write the network as ONNX, for any number of pictures of this side."""
    import torch  # noqa: PLC0415

    network.eval()
    example = torch.zeros(8, 1, side, side)
    axes = {"ink": {0: "n"}, "told": {0: "n"}}
    torch.onnx.export(
        network, (example,), str(out), opset_version=13, dynamo=False,
        input_names=["ink"], output_names=["told"], dynamic_axes=axes,
    )  # fmt: skip
    network.train()


def network_of(nn):
    """The network: three strides, then residual layers; their field is 11 mm wide, four outputs a cell."""
    import torch  # noqa: PLC0415

    class Network(nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.stem = nn.Sequential(
                nn.Conv2d(1, STEM[0], 5, stride=2, padding=2), nn.ReLU(),
                nn.Conv2d(STEM[0], STEM[1], 3, stride=2, padding=1), nn.ReLU(),
                nn.Conv2d(STEM[1], HIDDEN, 3, stride=2, padding=1), nn.ReLU(),
            )  # fmt: skip
            self.layers = nn.ModuleList(nn.Conv2d(HIDDEN, HIDDEN, 3, padding=1) for _ in range(3))
            self.told = nn.Conv2d(HIDDEN, 4 * 5, 1)
            with torch.no_grad():
                self.told.bias.zero_()
                self.told.bias[:4] = -4.0
                self.told.bias[4:20] = 1.0

        def forward(self, ink):
            x = self.stem(ink)
            for layer in self.layers:
                x = x + torch.relu(layer(x))
            return self.told(x)

    return Network()


def targets(labels: list[np.ndarray]) -> list[np.ndarray]:
    """The targets of each cell: nearness to a middle, whether it is one, its borders, and their weight."""
    near, at, weight = np.zeros((3, len(labels), CELLS, CELLS), np.float32)
    border = np.zeros((len(labels), 4, CELLS, CELLS), np.float32)
    middle = CELL_PX * np.arange(CELLS) + (CELL_PX - 1) / 2.0
    y, x = np.meshgrid(middle, middle, indexing="ij")
    for row, boxes in enumerate(labels):
        for _, left, top, right, bottom in boxes:
            mx, my = (left + right) / 2.0, (top + bottom) / 2.0
            spread = max(2.2, 0.14 * min(right - left, bottom - top) + 1.2)
            close = np.exp(-0.5 * ((x - mx) ** 2 + (y - my) ** 2) / spread**2)
            inside = -2 <= mx < SIDE_PX + 2 and -2 <= my < SIDE_PX + 2
            own = (close > near[row]) & (close > 0.2)
            near[row] = np.maximum(near[row], close)
            if inside:
                at[row][np.unravel_index(close.argmax(), close.shape)] = 1.0
            weight[row][own] = np.where(close[own] > 0.7, 1.0, 0.4)
            for index, distance in enumerate((x - left, y - top, right - x, bottom - y)):
                border[row, index][own] = distance[own] / UNIT_PX
    return [near, at, border, weight]


def found_in(data: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Crops found by the detector in windows, their log odds, the true signs, the number missed.

    A true sign is given by its number, `len(DETECTED)` if there is none.
    """
    stored = np.load(data)
    first = np.searchsorted(stored["owner"], np.arange(len(stored["pictures"]) + 1))
    pictures, odds, signs, missed = [], [], [], 0
    for start in range(0, len(stored["pictures"]), 64):
        part = stored["pictures"][start : start + 64]
        peaks = letters.peaks(letters.spread(letters.answers("detector", part)), margin=2)
        for row, picture in enumerate(part):
            labels = stored["labels"][first[start + row] : first[start + row + 1]]
            box, here = peaks.box[peaks.tile == row], peaks.odds[peaks.tile == row]
            at = box[:, :2] + box[:, 2:] / 2.0
            middle = (labels[:, 1:3] + labels[:, 3:5]) / 2.0
            over = (at[:, None] > labels[:, 1:3] - 2.0).all(axis=2) & (
                at[:, None] < labels[:, 3:5] + 2.0
            ).all(axis=2)
            away = np.where(over, np.linalg.norm(at[:, None] - middle, axis=2), np.inf)
            nearest = away.argmin(axis=1) if len(labels) else np.zeros(len(at), int)
            own = np.where(over.any(axis=1), labels[nearest, 0] if len(labels) else 0, len(DETECTED)).astype(
                int
            )
            inner = (middle > 12.0).all(axis=1) & (middle < SIDE_PX - 12.0).all(axis=1)
            missed += int((inner & ~over.any(axis=0)).sum()) if len(at) else int(inner.sum())
            pictures.append(letters.crops(picture, box))
            odds.append(here)
            signs.append(own)
    return np.concatenate(pictures), np.concatenate(odds), np.concatenate(signs), missed


def train_signs(paths: list[Path], steps: int, out: Path, start: Path | None) -> None:
    """Fit the network that names the detector's crops, and store it."""
    import torch  # noqa: PLC0415 - not needed for drawing windows
    from torch import nn  # noqa: PLC0415
    from torch.nn import functional  # noqa: PLC0415

    torch.set_num_threads(1)
    torch.manual_seed(0)
    found = [found_in(path) for path in paths]
    pictures = np.concatenate([one[0] for one in found])
    signs = np.concatenate([one[2] for one in found])
    print(len(signs), "places,", (signs < len(DETECTED)).sum(), "signs", flush=True)
    # "No sign" is frequent; rare signs are drawn more often than they are written.
    weight = np.bincount(signs, minlength=len(DETECTED) + 1)[signs] ** -0.5
    cumulated = np.cumsum(weight) / weight.sum()
    network = signs_network_of(nn)
    if start is not None:
        network.load_state_dict(torch.load(start))
    optimiser = torch.optim.AdamW(network.parameters(), 2e-3, weight_decay=3e-3)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, 4e-3, total_steps=steps, pct_start=0.15)
    rng = np.random.default_rng(2)
    began, losses = time.process_time(), []
    for step in range(steps):
        rows = np.searchsorted(cumulated, rng.random(SIGNS_BATCH))
        ink = torch.from_numpy(_varied(pictures[rows], rng))
        loss = functional.cross_entropy(network(ink), torch.from_numpy(signs[rows]), label_smoothing=0.02)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
        losses.append(loss.item())
        if step % 250 == 249:
            print(step + 1, f"{np.mean(losses):.3f}", f"{time.process_time() - began:.0f} s", flush=True)
            losses = []
            torch.save(network.state_dict(), out.with_suffix(".pt"))
    stored_as(network, out, letters.CROP_PX)
    torch.save(network.state_dict(), out.with_suffix(".pt"))


def _varied(pictures: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(n, 1, 32, 32) the pictures slightly moved, scaled, turned, and paler or darker."""
    count = len(pictures)
    result = np.empty((count, 1, letters.CROP_PX, letters.CROP_PX), np.float32)
    middle = (letters.CROP_PX - 1) / 2.0
    for row, picture in enumerate(pictures):
        turn, scale = rng.normal(0.0, 0.05), np.exp(rng.normal(0.0, 0.08))
        cosine, sine = scale * np.cos(turn), scale * np.sin(turn)
        shift = rng.normal(0.0, 1.3, 2) + middle - middle * np.array([cosine - sine, cosine + sine])
        to = np.array([[cosine, -sine, shift[0]], [sine, cosine, shift[1]]])
        result[row, 0] = cv2.warpAffine(picture, to, picture.shape, flags=cv2.INTER_LINEAR)
    return np.clip(result / np.float32(255.0) * rng.uniform(0.6, 1.4, (count, 1, 1, 1)), 0.0, 1.0).astype(
        np.float32
    )


def signs_network_of(nn):
    """The network that names a crop: convolutions, and a layer over all of them."""
    layers = []
    for before, after, stride in ((1, 16, 1), (16, 32, 2), (32, 48, 2), (48, 64, 2)):
        convolution = nn.Conv2d(before, after, 3, stride=stride, padding=1, bias=False)
        layers += [convolution, nn.BatchNorm2d(after), nn.ReLU()]
    return nn.Sequential(*layers, nn.Flatten(), nn.Dropout(0.2), nn.Linear(64 * 16, len(DETECTED) + 1))


def calibrated(data: Path) -> None:
    """Print the confidence that both networks should have in fonts left out, and their accuracy then."""
    pictures, odds, truth, missed = found_in(data)
    scores = letters.answers("signs", pictures).astype(np.float64)
    is_sign = truth < len(DETECTED)
    against = np.logaddexp.reduce(scores[:, :-1], axis=1) - scores[:, -1]
    terms = np.column_stack([odds, against, np.ones(len(odds))])
    weights = np.zeros(3)
    for _ in range(30):
        sure = 1.0 / (1.0 + np.exp(-terms @ weights))
        curvature = (terms.T * (sure * (1.0 - sure))) @ terms + 1e-6 * np.eye(3)
        weights += np.linalg.solve(curvature, terms.T @ (is_sign - sure))
    named = {}
    for warm in np.linspace(0.3, 1.5, 49):
        log = warm * scores[is_sign, :-1]
        log -= np.logaddexp.reduce(log, axis=1, keepdims=True)
        named[float(warm)] = -log[np.arange(len(log)), truth[is_sign]].mean()
    print(f"weights {np.round(weights, 3)}, signs x {min(named, key=named.__getitem__):.3f}")
    said = letters.probabilities(odds, scores.astype(np.float32))
    column = np.array([letters.COLUMN[name] for name in (*DETECTED, "")])
    best, right = said.max(axis=1), said.argmax(axis=1) == column[truth]
    signs, read = is_sign.sum() + missed, right & is_sign
    shares = f"found {is_sign.sum() / signs:.3f}, read {read.sum() / signs:.3f}"
    print(f"{signs} signs, {shares}; {(~is_sign).sum()} others")
    signed = said.argmax(axis=1) != letters.COLUMN[""]
    for low, high in pairwise((0.0, 0.5, 0.8, 0.9, 0.95, 0.98, 1.01)):
        here = (best >= low) & (best < high) & signed
        if here.any():
            cells = (f"{low:.2f} - {min(high, 1.0):.2f}", f"{here.sum()}", f"{best[here].mean():.3f}")
            print("| " + " | ".join((*cells, f"{right[here].mean():.3f}")) + " |")


def main() -> None:
    """Draw windows, train a network, or check both."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    acts = parser.add_subparsers(dest="act", required=True)
    drawing = acts.add_parser("windows")
    drawing.add_argument("folder", type=Path)
    drawing.add_argument("data", type=Path)
    drawing.add_argument("--count", type=int, default=20000)
    drawing.add_argument("--seed", type=int, default=1)
    drawing.add_argument("--left-out", action="store_true")
    learning = acts.add_parser("network")
    learning.add_argument("data", type=Path, nargs="+")
    learning.add_argument("--steps", type=int, default=5000)
    learning.add_argument("--out", type=Path, required=True)
    learning.add_argument("--start", type=Path)
    naming = acts.add_parser("signs")
    naming.add_argument("data", type=Path, nargs="+")
    naming.add_argument("--steps", type=int, default=5000)
    naming.add_argument("--out", type=Path, required=True)
    naming.add_argument("--start", type=Path)
    checking = acts.add_parser("check")
    checking.add_argument("data", type=Path)
    asked = parser.parse_args()
    if asked.act == "windows":
        windows(asked.folder, asked.data, asked.count, asked.seed, LEFT_OUT if asked.left_out else TRAINED_ON)
    elif asked.act == "signs":
        train_signs(asked.data, asked.steps, asked.out, asked.start)
    elif asked.act == "check":
        calibrated(asked.data)
    else:
        train(asked.data, asked.steps, asked.out, asked.start)


if __name__ == "__main__":
    main()
