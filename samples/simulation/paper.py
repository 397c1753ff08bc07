"""Soft faults of paper and light: shadows, smudges, stains; brightness about 1 on a coarse grid."""

import numpy as np
from numpy.typing import NDArray

from samples.simulation.strokes import Rng

Float32Array = NDArray[np.float32]


def hand_shadow(u: Float32Array, v: Float32Array, depth: float, rng: Rng) -> Float32Array:
    """The soft-edged shadow of a phone and an arm over part of the sheet."""
    angle, at = rng.uniform(0, 2 * np.pi), rng.uniform(-0.15, 0.35)
    distance = u * np.cos(angle) + v * np.sin(angle) - at + 0.08 * np.sin(5 * (u - v) + rng.uniform(0, 6))
    return np.asarray(1.0 - depth / (1.0 + np.exp(-distance / rng.uniform(0.01, 0.06))), dtype=np.float32)


def stain(mx: Float32Array, my: Float32Array, rng: Rng) -> Float32Array:
    """A ring where a cup stood, or a drop: brown with a darker rim."""
    x, y = rng.uniform(30, 390), rng.uniform(20, 277)
    ring = rng.random() < 0.5
    radius = rng.uniform(32.0, 42.0) if ring else rng.uniform(3.0, 12.0)
    uneven = 1.0 + 0.03 * np.sin(3 * np.arctan2(my - y, mx - x) + rng.uniform(0, 6))
    distance = np.hypot(mx - x, my - y) * uneven
    rim = np.exp(-0.5 * ((distance - radius) / rng.uniform(0.6, 1.5)) ** 2)
    inside = 0.0 if ring else 1.0 / (1.0 + np.exp(np.clip((distance - radius) / 0.4, -30.0, 30.0)))
    depth = rng.uniform(0.05, 0.16)
    return np.asarray(1.0 - depth * np.maximum(rim, 0.6 * inside), dtype=np.float32)


def smudge(mx: Float32Array, my: Float32Array, rng: Rng) -> Float32Array:
    """A long soft spot where a hand rubbed."""
    x, y, angle = rng.uniform(40, 380), rng.uniform(30, 260), rng.uniform(0, np.pi)
    along = (mx - x) * np.cos(angle) + (my - y) * np.sin(angle)
    across = -(mx - x) * np.sin(angle) + (my - y) * np.cos(angle)
    blob = np.exp(-0.5 * ((along / rng.uniform(6, 25)) ** 2 + (across / rng.uniform(2, 7)) ** 2))
    return np.asarray(1.0 - rng.uniform(0.01, 0.06) * blob, dtype=np.float32)
