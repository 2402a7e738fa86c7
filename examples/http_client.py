#!/usr/bin/env python3
"""Asks a running service which tiles to search and where a frame was taken. Standard library only.

    overfly serve --db walk.gpkg --listen 127.0.0.1:8787 &
    python3 examples/http_client.py http://127.0.0.1:8787 tiles/flight/frames/019.jpg
"""

import json
import sys
import urllib.error
import urllib.parse
import urllib.request
import uuid


def ask(request):
    """The JSON answer; an error of the service ends the program with its code word."""
    try:
        with urllib.request.urlopen(request, timeout=60) as response:
            return json.load(response)
    except urllib.error.HTTPError as error:
        sys.exit(f"{error.code}: {error.read().decode()}")


def candidates(service):
    """Tiles to search: the last fix was good to 20 m, and up to 250 m of drift may have come since."""
    query = urllib.parse.urlencode(
        dict(latitude_deg=48.4915, longitude_deg=15.616, heading_deg=270, across_m=400, along_m=300,
             inaccuracy_m=20, drift_m=250))
    return ask(f"{service}/v1/candidates?{query}")


def fix(service, frame):
    """Where the frame was taken. The form has two fields: `image` (a file) and `request` (JSON)."""
    request = dict(latitude_deg=48.4915, longitude_deg=15.616, sigma_m=200, heading_deg=271.6, gsd_m_per_px=1.25)
    boundary = uuid.uuid4().hex
    head = f'--{boundary}\r\nContent-Disposition: form-data; name="'
    body = b"".join([
        f'{head}request"\r\n\r\n{json.dumps(request)}\r\n'.encode(),
        f'{head}image"; filename="frame"\r\n\r\n'.encode(), frame, f"\r\n--{boundary}--\r\n".encode(),
    ])
    headers = {"Content-Type": f"multipart/form-data; boundary={boundary}"}
    return ask(urllib.request.Request(f"{service}/v1/fixes", data=body, headers=headers))


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    service, path = sys.argv[1:]
    found = candidates(service)
    print(f"{len(found['tiles'])} tiles to search, best first: {found['tiles'][0]['id']}")
    with open(path, "rb") as file:
        answer = fix(service, file.read())
    if answer["status"] == "fix":
        print(f"fix {answer['latitude_deg']:.7f} {answer['longitude_deg']:.7f}, heading {answer['heading_deg']:.2f}")
    else:
        print(f"no fix: {answer['reason']}: {answer['detail']}")


if __name__ == "__main__":
    main()
