"""Train the letter recogniser and measure it on fonts that it has not seen.

    python -m tests.training.letters.train FOLDER

FOLDER holds the packages `@fontsource/NAME` of the families below and `mnist`, unpacked, each in a
folder of its name; `npm pack @fontsource/NAME` gives them. scikit-learn, scikit-image and fonttools
are needed. Writes `grader/scan/handwriting/letters.npz` and prints how well it does.
"""

import sys
from pathlib import Path

import numpy as np
from sklearn.neural_network import MLPClassifier

from grader.scan.handwriting.model import JUNK, MODEL, SIGNS, Model, features
from tests.training.letters.glyphs import LEFT_OUT, TRAINED_ON, Glyph, digits, glyphs_of
from tests.training.letters.junk import junk
from tests.training.letters.scans import CLEAR, HARD, Trouble, scanned
from tests.training.letters.tables import print_tables

CALIBRATED_ON = ("architects-daughter", "handlee", "mansalva", "patrick-hand", "shadows-into-light", "caveat")
PER_SIGN, JUNK_SHARE, DIGITS = 1500, 0.12, 6000
HIDDEN = (224, 96)
SEED = 20


def pictures(
    glyphs: list[Glyph],
    per_sign: int,
    rng: np.random.Generator,
    troubles: tuple[Trouble, ...] = (CLEAR, HARD),
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n, 28, 28) pictures, (n, 2) sizes of their crops, (n,) classes: signs equally often, then junk."""
    by_sign: dict[str, list[Glyph]] = {}
    for glyph in glyphs:
        by_sign.setdefault(glyph.sign, []).append(glyph)
    found, sizes, labels = [], [], []

    def add(made: tuple | None, label: int) -> None:
        if made is not None:
            found.append(made[0])
            sizes.append(made[1])
            labels.append(label)

    for sign, ways in by_sign.items():
        for index in range(per_sign):
            trouble = troubles[int(rng.integers(len(troubles)))]
            add(scanned(ways[index % len(ways)], rng, trouble), SIGNS.index(sign))
    for _ in range(int(JUNK_SHARE * len(found))):
        add(junk(glyphs, rng), SIGNS.index(JUNK))
    return np.stack(found), np.array(sizes, dtype=np.float64), np.array(labels)


def fitted(x: np.ndarray, y: np.ndarray, rounds: int) -> MLPClassifier:
    """Train the network."""
    network = MLPClassifier(
        HIDDEN, alpha=3e-4, batch_size=256, learning_rate_init=1.5e-3, max_iter=rounds, random_state=SEED,
        early_stopping=False, n_iter_no_change=rounds, verbose=True,
    )  # fmt: skip
    return network.fit(x, y)


def model_of(network: MLPClassifier, mean: np.ndarray, spread: np.ndarray, cooling: float) -> Model:
    """The network as arrays, with the features' scaling included in its first layer."""
    weights = [layer.astype(np.float64) for layer in network.coefs_]
    biases = [layer.astype(np.float64) for layer in network.intercepts_]
    biases[0] = biases[0] - (mean / spread) @ weights[0]
    weights[0] = weights[0] / spread[:, None]
    return Model(
        tuple(layer.astype(np.float32) for layer in weights),
        tuple(layer.astype(np.float32) for layer in biases),
        cooling,
    )


def trained(data: tuple[np.ndarray, np.ndarray, np.ndarray], rounds: int, cooling: float = 1.0) -> Model:
    """Train a model from pictures, sizes and classes."""
    x, y = features(data[0], data[1]).astype(np.float64), data[2]
    mean, spread = x.mean(axis=0), np.maximum(x.std(axis=0), 0.02)
    return model_of(fitted(((x - mean) / spread).astype(np.float32), y, rounds), mean, spread, cooling)


def best_cooling(model: Model, data: tuple[np.ndarray, np.ndarray, np.ndarray]) -> float:
    """The factor on the network's scores for which the fonts left out are likeliest."""
    scores = model.scores(features(data[0], data[1]))
    losses = {}
    for cooling in np.linspace(0.2, 1.5, 66):
        tempered = cooling * scores
        tempered -= tempered.max(axis=1, keepdims=True)
        log = tempered - np.log(np.exp(tempered).sum(axis=1, keepdims=True))
        losses[float(cooling)] = -log[np.arange(len(log)), data[2]].mean()
    return min(losses, key=losses.__getitem__)


def _joined(*parts: tuple[np.ndarray, np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return tuple(np.concatenate(columns) for columns in zip(*parts, strict=True))


def main(folder: Path) -> None:
    """Train, calibrate, write the model, measure."""
    rng = np.random.default_rng(SEED)
    fonts = {name: list(glyphs_of(folder / name)) for name in (*TRAINED_ON, *LEFT_OUT)}
    real = list(digits(folder / "mnist"))
    rng.shuffle(real)
    held, seen = real[:2000], real[2000 : 2000 + DIGITS]

    def digit_data(glyphs: list[Glyph], trouble: Trouble) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        made = [(scanned(glyph, rng, trouble), SIGNS.index(glyph.sign)) for glyph in glyphs]
        kept = [(one[0], one[1], label) for one, label in made if one is not None]
        return tuple(np.array(column) for column in zip(*kept, strict=True))

    digit = _joined(digit_data(seen[::2], CLEAR), digit_data(seen[1::2], HARD))
    part = [g for name in TRAINED_ON if name not in CALIBRATED_ON for g in fonts[name]]
    aside = [g for name in CALIBRATED_ON for g in fonts[name]]
    first = trained(_joined(pictures(part, PER_SIGN // 3, rng), digit), 12)
    cooling = best_cooling(first, pictures(aside, 100, rng))
    everything = [g for name in TRAINED_ON for g in fonts[name]]
    model = trained(_joined(pictures(everything, PER_SIGN, rng), digit), 24, cooling)
    model.save(MODEL)
    tests = {}
    for how, trouble in (("clear", CLEAR), ("hard", HARD)):
        made = {name: pictures(fonts[name], 60, rng, (trouble,)) for name in LEFT_OUT}
        tests[how] = made | {"real digits": digit_data(held, trouble)}
    print_tables(Model.load(MODEL), tests, f"{len(TRAINED_ON)} handwriting fonts and {DIGITS} real digits")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
