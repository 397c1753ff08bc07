"""The recogniser's network: two layers and a softmax, tempered so that its probabilities hold."""

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from grader.letters.alphabet import SIGNS
from grader.letters.features import features
from grader.pixels import Float32Array
from grader.records import FloatArray, GreyImage

COOLING, STRANGE = 0.43, 0.02
"""On a drawing, in hands that nobody has seen: what scores are multiplied by, and the share of signs of
which nothing is known. Fitted to eight handwriting fonts that the network does not know."""
MODEL = Path(__file__).resolve().parents[1] / "data" / "letters.npz"


@dataclass(frozen=True, slots=True)
class Model:
    """Layers from features to scores of the signs.

    Attributes
    ----------
    weights, biases : a matrix (inputs, outputs) and a row for each layer
    cooling : what scores are multiplied by before they become probabilities
    """

    weights: tuple[Float32Array, ...]
    biases: tuple[Float32Array, ...]
    cooling: float

    def scores(self, inputs: Float32Array) -> FloatArray:
        """(n, signs) scores of features (n, m)."""
        layer = inputs
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            layer = np.maximum(layer @ weight + bias, np.float32(0.0))
        return np.asarray(layer @ self.weights[-1] + self.biases[-1], dtype=np.float64)

    def probability(self, inputs: Float32Array) -> FloatArray:
        """(n, signs) probabilities, each row's sum 1."""
        scores = self.cooling * self.scores(inputs)
        grown = np.exp(scores - scores.max(axis=1, keepdims=True))
        return np.asarray(grown / grown.sum(axis=1, keepdims=True))

    def save(self, path: Path) -> None:
        """Write the layers, at half precision."""
        layers = {f"weight_{n}": layer.astype(np.float16) for n, layer in enumerate(self.weights)}
        layers |= {f"bias_{n}": layer.astype(np.float16) for n, layer in enumerate(self.biases)}
        np.savez_compressed(path, cooling=np.float64(self.cooling), signs=np.array(SIGNS), **layers)  # type: ignore[arg-type]

    @classmethod
    def load(cls, path: Path) -> "Model":
        """Read the layers. Raises ValueError where they were trained for other signs."""
        with np.load(path) as stored:
            if tuple(str(sign) for sign in stored["signs"]) != SIGNS:
                raise ValueError(f"{path} was trained for other signs than {''.join(SIGNS)}")
            count = sum(name.startswith("weight_") for name in stored.files)
            weights = tuple(stored[f"weight_{n}"].astype(np.float32) for n in range(count))
            biases = tuple(stored[f"bias_{n}"].astype(np.float32) for n in range(count))
            return cls(weights, biases, float(stored["cooling"]))


@cache
def shipped() -> Model:
    """The model that comes with the program, read once."""
    return Model.load(MODEL)


def recognise(
    pictures: NDArray[np.uint8] | list[GreyImage],
    sizes_px: FloatArray,
    cooling: float | None = None,
    strange: float = 0.0,
) -> FloatArray:
    """(n, signs) probability of each sign of `SIGNS` for (n, 28, 28) normalised pictures.

    Arguments
    ---------
    sizes_px : (n, 2) width and height of what was cut out
    cooling : what scores are multiplied by, as the model has it by default
    strange : share of signs of which nothing is known: any may be meant
    """
    if len(pictures) == 0:
        return np.zeros((0, len(SIGNS)))
    model = shipped() if cooling is None else replace(shipped(), cooling=cooling)
    known = model.probability(features(pictures, sizes_px))
    return (1.0 - strange) * known + strange / len(SIGNS)
