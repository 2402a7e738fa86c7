"""Writes the embedded geoid: crates/core/src/geodesy/geoid/{egm2008_2deg,egm2008_30min,egm96_90min}.bin.

    python3 docs/geoid/make_geoid.py --egm2008 geoid_model_15_minute.inc --egm96 egm96_15.gtx [--survey]

Sources, both point values every 15 minutes of arc. The models are public domain, by the US National
Geospatial-Intelligence Agency (NGA); only their numbers are used here.
  EGM2008: src/libswiftnav/src/geoid_model_15_minute.inc of the crate swiftnav-sys 0.10.0, thinned there from the NGA
           grid of 2.5 minutes (egm08_25.gtx).
  EGM96:   /usr/share/proj/egm96_15.gtx of the Debian package proj-data 9.1.1-1, the NGA grid of 15 minutes.

Each layer holds the coefficients of a uniform bicubic B-spline, fitted by least squares to all points of the source.
One byte each, two's complement; rows from south to north, columns from longitude -180 to the east. Past a pole the
surface goes on along the opposite meridian, so the fit is one on a torus. Layers add up:
  EGM2008 = egm2008_2deg + egm2008_30min,   EGM96 = EGM2008 + egm96_90min.

Prints bytes, rms (weighted by area) and maximum error against the sources; with --survey also those of other spacings.
Needs numpy; written with 2.x, and the result does not depend on its version.
"""

import argparse
import hashlib
import pathlib
import re

import numpy as np

SAMPLES = 1440  # around the equator, and around a meridian
HERE = pathlib.Path(__file__).resolve().parent
TARGET = HERE.parents[1] / "crates/core/src/geodesy/geoid"


def read_inc(path):
    """EGM2008 as [latitude from -90][longitude from -180], metres. The file has [longitude from 0][latitude]."""
    text = pathlib.Path(path).read_text()
    values = np.array([float(v) for v in re.findall(r"-?\d+\.\d+(?=f)", text[text.index("= {") :])])
    grid = values.reshape(SAMPLES + 1, SAMPLES // 2 + 1)
    assert np.abs(grid[0] - grid[-1]).max() < 1e-6, "longitude 0 and 360 differ"
    return np.roll(grid[:-1].T, SAMPLES // 2, axis=1)


def read_gtx(path):
    """EGM96 as [latitude from -90][longitude from -180], metres."""
    data = pathlib.Path(path).read_bytes()
    assert list(np.frombuffer(data[:32], ">f8")) == [-90.0, -180.0, 0.25, 0.25]
    assert list(np.frombuffer(data[32:40], ">i4")) == [SAMPLES // 2 + 1, SAMPLES]
    return np.frombuffer(data[40:], ">f4").astype(float).reshape(SAMPLES // 2 + 1, SAMPLES)


def on_torus(grid):
    """Appends the rows past the north pole: the opposite meridian, southward."""
    return np.vstack([grid, np.roll(grid, SAMPLES // 2, axis=1)[-2:0:-1]])


def basis(step):
    """The cubic B-splines of a knot every `step` samples, at all samples of a circle: [sample][knot]."""
    knots = SAMPLES // step
    distance = np.arange(SAMPLES)[:, None] / step - np.arange(knots)[None, :]
    distance = np.abs((distance + knots / 2) % knots - knots / 2)
    inner = 2 / 3 - distance**2 + distance**3 / 2
    outer = (2 - distance) ** 3 / 6
    return np.where(distance < 1, inner, np.where(distance < 2, outer, 0.0))


def fit_layer(grid, step, unit_m):
    """The quantised coefficients [row][column] of the layer, and the surface they make at the samples."""
    spline = basis(step)
    inverse = np.linalg.inv(spline.T @ spline) @ spline.T
    coefficients = inverse @ on_torus(grid) @ inverse.T
    last = SAMPLES // 2 // step
    for row, pole in ((0, grid[0]), (last, grid[-1])):
        # The row at a pole follows from its neighbours, so that the pole has one value (up to the quantisation).
        coefficients[row] = (6 * (inverse @ pole) - coefficients[row + 1] - coefficients[row - 1]) / 4
    quantised = np.round(coefficients / unit_m)
    assert np.abs(quantised).max() <= 127, f"unit of {unit_m} m overflows: {np.abs(quantised).max()}"
    surface = spline @ (quantised * unit_m) @ spline.T
    return quantised[: last + 1].astype(np.int8), surface[: SAMPLES // 2 + 1]


def error(residual):
    """Rms weighted by area, and maximum."""
    weight = np.cos(np.radians(np.linspace(-90, 90, SAMPLES // 2 + 1)))[:, None]
    return np.sqrt((weight * residual**2).sum() / (weight.sum() * SAMPLES)), np.abs(residual).max()


def smallest_unit(grid, step):
    """The smallest unit, a multiple of 0.01 m, whose coefficients fit a byte."""
    inverse = np.linalg.pinv(basis(step))
    return np.ceil(np.abs(inverse @ on_torus(grid) @ inverse.T).max() / 125 * 100) / 100


def survey(egm2008, egm96):
    """Prints the table in the documentation of geoid.rs."""
    coarse, base = fit_layer(egm2008, 8, 1.0)
    for step in (2, 4):
        fine, surface = fit_layer(egm2008 - base, step, smallest_unit(egm2008 - base, step))
        print("EGM2008 %.2f deg: %6d bytes, rms %.3f m, max %.2f m"
              % (step / 4, coarse.size + fine.size, *error(base + surface - egm2008)))
        if step == 2:
            rest = egm96 - base - surface
    coarse, base = fit_layer(egm2008, 12, 1.0)
    fine, surface = fit_layer(egm2008 - base, 3, smallest_unit(egm2008 - base, 3))
    print("EGM2008 0.75 deg: %6d bytes, rms %.3f m, max %.2f m"
          % (coarse.size + fine.size, *error(base + surface - egm2008)))
    for step in (3, 4, 6, 8, 12):
        layer, surface = fit_layer(rest, step, smallest_unit(rest, step))
        print("EGM96 - EGM2008 %.2f deg: %6d bytes, rms %.3f m, max %.2f m"
              % (step / 4, layer.size, *error(surface - rest)))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--egm2008", required=True)
    parser.add_argument("--egm96", required=True)
    parser.add_argument("--survey", action="store_true", help="print the errors of other spacings")
    arguments = parser.parse_args()
    egm2008, egm96 = read_inc(arguments.egm2008), read_gtx(arguments.egm96)
    TARGET.mkdir(parents=True, exist_ok=True)
    surface = np.zeros_like(egm2008)
    layers = (("egm2008_2deg", egm2008, 8, 1.0), ("egm2008_30min", egm2008, 2, 0.2), ("egm96_90min", egm96, 6, 0.2))
    for name, truth, step, unit_m in layers:
        layer, part = fit_layer(truth - surface, step, unit_m)
        surface = surface + part
        data = layer.tobytes()
        (TARGET / f"{name}.bin").write_bytes(data)
        poles = [np.ptp(surface[row]) for row in (0, -1)]
        print("%-14s %6d bytes, up to here rms %.3f m, max %.2f m, spread at the poles %.2f and %.2f m, sha256 %s"
              % (name, len(data), *error(surface - truth), *poles, hashlib.sha256(data).hexdigest()[:16]))
    if arguments.survey:
        survey(egm2008, egm96)


if __name__ == "__main__":
    main()
