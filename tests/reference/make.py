#!/usr/bin/env python3
"""Writes the reference numbers that tests/it/reference.rs compares with. Needs pyproj (with PROJ 9).

    python3 tests/reference/make.py
"""
import os
import random

import pyproj
from pyproj import CRS, Geod, Transformer

HERE = os.path.dirname(os.path.abspath(__file__))
SOURCE = f"pyproj {pyproj.__version__}, PROJ {pyproj.proj_version_str}; tests/reference/make.py"
random.seed(20261122)

# Code, and latitude and longitude ranges that lie in its area of use.
CODES = [
    (32601, 5, 70, -179.9, -174.1), (32614, 20, 60, -101.9, -96.1), (32633, 1, 80, 12.1, 17.9),
    (32660, 1, 60, 174.1, 179.9), (32701, -60, -1, -179.9, -174.1), (32733, -34, -5, 12.1, 17.9),
    (32756, -43, -10, 150.1, 155.9), (32760, -47, -34, 174.1, 179.9),
    (26914, 26, 49, -101.9, -96.1), (25832, 40, 80, 6.1, 11.9), (3006, 55, 69, 10.6, 24.1),
    (3857, -84, 84, -179, 179), (4326, -89, 89, -179, 179), (3395, -79, 83, -179, 179),
    (2154, 42, 51, -5, 9), (3035, 35, 70, -10, 40), (5070, 25, 49, -124, -67), (3338, 52, 71, -170, -132),
    (2263, 40.5, 41.3, -74.2, -71.9), (6501, 45.5, 47.3, -97, -91), (3978, 42, 80, -130, -55),
    (2180, 49, 54.8, 14.2, 24.1), (2193, -46, -35, 167, 178), (3577, -43, -10, 113, 153),
    (3031, -88, -61, -179, 179), (3413, 61, 88, -179, 179), (3301, 57.6, 59.6, 21.9, 28.1),
]
# Systems with a Helmert shift: the same parameters in PROJ's words, so that the arithmetic is compared, not the choice
# of a shift.
SHIFTED = [
    (27700, 50, 58.5, -6, 1.5, "+proj=tmerc +lat_0=49 +lon_0=-2 +k=0.9996012717 +x_0=400000 +y_0=-100000 +ellps=airy +towgs84=446.448,-125.157,542.06,0.15,0.247,0.842,-20.489 +units=m"),
    (31467, 47.5, 54.9, 7.6, 10.4, "+proj=tmerc +lat_0=0 +lon_0=9 +k=1 +x_0=3500000 +y_0=0 +ellps=bessel +towgs84=598.1,73.7,418.2,0.202,0.045,-2.455,6.7 +units=m"),
    (2056, 45.9, 47.7, 6, 10.4, "+proj=somerc +lat_0=46.9524055555556 +lon_0=7.43958333333333 +k_0=1 +x_0=2600000 +y_0=1200000 +ellps=bessel +towgs84=674.374,15.056,405.346,0,0,0,0 +units=m"),
    (28992, 50.8, 53.5, 3.4, 7.2, "+proj=sterea +lat_0=52.1561605555556 +lon_0=5.38763888888889 +k=0.9999079 +x_0=155000 +y_0=463000 +ellps=bessel +towgs84=565.2369,50.0087,465.658,-0.406857,0.350733,-1.87035,4.0812 +units=m"),
]
USER = [
    ("tm", 46, 48, -101, -98, "+proj=tmerc +lat_0=47 +lon_0=-99.3 +k=0.99995 +x_0=10000 +y_0=20000 +ellps=GRS80 +units=m"),
    ("tm_us_feet", 46, 48, -101, -98, "+proj=tmerc +lat_0=47 +lon_0=-99.3 +k=1 +x_0=10000 +y_0=20000 +ellps=GRS80 +units=us-ft"),
    ("lcc_2sp", 45, 49, -104, -96, "+proj=lcc +lat_1=46 +lat_2=48.5 +lat_0=47 +lon_0=-99.3 +x_0=600000 +y_0=210000 +ellps=WGS84 +units=m"),
    ("lcc_1sp", 45, 49, -104, -96, "+proj=lcc +lat_1=47 +lat_0=47 +lon_0=-99.3 +k_0=0.9998 +x_0=600000 +y_0=210000 +ellps=WGS84 +units=m"),
    ("albers", 30, 55, -120, -80, "+proj=aea +lat_1=29.5 +lat_2=45.5 +lat_0=37.5 +lon_0=-96 +x_0=0 +y_0=0 +ellps=GRS80 +units=m"),
    ("laea", 40, 60, 0, 20, "+proj=laea +lat_0=50 +lon_0=10 +x_0=1000 +y_0=2000 +ellps=GRS80 +units=m"),
    ("mercator", -60, 60, -120, 60, "+proj=merc +lon_0=-30 +k_0=0.997 +x_0=3900000 +y_0=900000 +ellps=WGS84 +units=m"),
    ("polar", 70, 89, -179, 179, "+proj=stere +lat_0=90 +lon_0=-45 +k_0=0.994 +x_0=2000000 +y_0=2000000 +ellps=WGS84 +units=m"),
]


def points(lat0, lat1, lon0, lon1, count):
    for _ in range(count):
        yield round(random.uniform(lat0, lat1), 7), round(random.uniform(lon0, lon1), 7)


with open(os.path.join(HERE, "projections.csv"), "w") as f:
    f.write(f"# {SOURCE}\ncrs,latitude_deg,longitude_deg,x,y\n")
    for code, *box in CODES:
        crs = CRS.from_epsg(code)
        # From the CRS's own latitudes and longitudes: the projection alone, without a choice of datum shift.
        t = Transformer.from_crs(crs.geodetic_crs, crs, always_xy=True)
        for lat, lon in points(*box, 6):
            x, y = t.transform(lon, lat)
            f.write(f"{code},{lat},{lon},{x:.9f},{y:.9f}\n")
    for code, *box, text in SHIFTED:
        t = Transformer.from_crs("+proj=longlat +datum=WGS84 +no_defs +type=crs", text + " +no_defs +type=crs", always_xy=True)
        for lat, lon in points(*box, 6):
            x, y = t.transform(lon, lat)
            f.write(f"{code},{lat},{lon},{x:.9f},{y:.9f}\n")
    for name, *box, text in USER:
        p = pyproj.Proj(text + " +no_defs")
        for lat, lon in points(*box, 6):
            x, y = p(lon, lat)
            f.write(f"{name},{lat},{lon},{x:.9f},{y:.9f}\n")

geod = Geod(ellps="WGS84")
with open(os.path.join(HERE, "geodesics.csv"), "w") as f:
    f.write(f"# {SOURCE} (GeographicLib's algorithm)\nlatitude_1_deg,longitude_1_deg,latitude_2_deg,longitude_2_deg,distance_m,azimuth_deg\n")
    pairs = [((90, 0), (-90, 0)), ((0, 0), (0, 179)), ((0.5, -179.9), (-0.5, 179.9)), ((40.6, -73.8), (51.6, -0.5))]
    pairs += list(zip(points(-89, 89, -180, 180, 20), points(-89, 89, -180, 180, 20)))
    for lat, lon in points(-85, 85, -180, 180, 20):
        pairs.append(((lat, lon), (round(lat + random.uniform(-0.05, 0.05), 7), round(lon + random.uniform(-0.05, 0.05), 7))))
    for (lat1, lon1), (lat2, lon2) in pairs:
        azimuth, _, distance = geod.inv(lon1, lat1, lon2, lat2)
        f.write(f"{lat1},{lon1},{lat2},{lon2},{distance:.9f},{azimuth:.9f}\n")
