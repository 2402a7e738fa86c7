#!/usr/bin/env python3
"""Writes the areas that src/region/reachable/tests.rs compares with: all ground that an image can show after a flight of
stated length with turn radius at least 1, drawn on a grid by random and by bounding flights. Needs numpy and scipy; ten
minutes. Right to about 0.3 %.

    python3 tests/reference/reachable.py
"""
import os

import numpy as np
import scipy
from scipy.ndimage import binary_fill_holes
from scipy.signal import fftconvolve

HERE = os.path.dirname(os.path.abspath(__file__))
LENGTHS = [0.3, 1, 1.57, 3.14, 4.8, 5.7, 6.2, 9]
IMAGES = [(0.1, 0.1), (0.6, 0.4), (1.5, 1.0), (6, 4)]
CELLS, HEADINGS = 700, 360
TURNS = [(1, 0, 1), (-1, 0, 1), (1, 0, -1), (-1, 0, -1), (1, -1, 1), (-1, 1, -1)]


def fly(pose, turn, length):
    """A pose (x right, y ahead, heading clockwise) after a length at constant curvature in {-1, 0, 1}."""
    x, y, heading = pose
    turned = heading + turn * length
    safe = np.where(turn == 0, 1, turn)
    dx = np.where(turn == 0, length * np.sin(heading), (np.cos(heading) - np.cos(turned)) / safe)
    dy = np.where(turn == 0, length * np.cos(heading), (np.sin(turned) - np.sin(heading)) / safe)
    return x + dx, y + dy, turned


def poses(length, random):
    ends = []
    first, last = np.meshgrid(*[np.linspace(0, length, 700)] * 2)
    inside = first + last <= length + 1e-12
    first, last = first[inside], last[inside]
    for turns in TURNS:
        pose = (np.zeros_like(first),) * 3
        for turn, part in zip(turns, (first, np.maximum(length - first - last, 0), last)):
            pose = fly(pose, float(turn), part)
        ends.append(pose)
    for count in (4, 5, 6, 9):
        parts = random.dirichlet(np.ones(count) * 0.7, 400_000) * length
        pose = (np.zeros(len(parts)),) * 3
        for part in parts.T:
            pose = fly(pose, random.choice([-1.0, 0.0, 1.0], len(parts)), part)
        ends.append(pose)
    return [np.concatenate(values) for values in zip(*ends)]


def area(length, across, along):
    """Of the ground shown, and with what it encloses."""
    x, y, heading = poses(length, np.random.default_rng(0))
    border = np.hypot(across, along) / 2 + 0.02 * max(np.ptp(x), np.ptp(y))
    left, low = x.min() - border, y.min() - border
    cell = (max(np.ptp(x), np.ptp(y)) + 2 * border) / CELLS
    shown = np.zeros((CELLS, CELLS), bool)
    right, ahead = np.meshgrid(*[(np.arange(CELLS) - CELLS // 2) * cell] * 2)
    turned = np.round(heading / (2 * np.pi) * HEADINGS).astype(int) % HEADINGS
    for k in np.unique(turned):
        middles = np.zeros((CELLS, CELLS), np.float32)
        of = turned == k
        middles[((y[of] - low) / cell).astype(int), ((x[of] - left) / cell).astype(int)] = 1
        sin, cos = np.sin(2 * np.pi * k / HEADINGS), np.cos(2 * np.pi * k / HEADINGS)
        image = (abs(right * cos - ahead * sin) <= across / 2) & (abs(right * sin + ahead * cos) <= along / 2)
        shown |= fftconvolve(middles, image.astype(np.float32), mode="same") > 0.5
    return shown.sum() * cell**2, binary_fill_holes(shown).sum() * cell**2


with open(os.path.join(HERE, "reachable.csv"), "w") as out:
    out.write(f"# numpy {np.__version__}, scipy {scipy.__version__}; tests/reference/reachable.py\n")
    out.write("# length, across, along (turn radius 1); area shown; area with what it encloses\n")
    for across, along in IMAGES:
        for length in LENGTHS:
            shown, filled = area(length, across, along)
            out.write(f"{length},{across},{along},{shown:.5f},{filled:.5f}\n")
