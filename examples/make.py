#!/usr/bin/env python3
"""Makes the floor plan, the logs and the recorded tracks of this folder: `python3 examples/make.py`.

Needs nothing but Python. Everything is drawn from fixed seeds, so that the files come out the same.
"""

import gzip
import math
import random
import struct
import zlib
from pathlib import Path

HERE = Path(__file__).parent
WALL, FREE = 0, 254


# --- The floor plan: 14 x 9 m, 5 cm a pixel ---------------------------------------------------


def floor_plan():
    """Draws four rooms and a corridor, and writes building.png and building.yaml."""
    width, height, resolution_m = 280, 180, 0.05
    image = [[FREE] * width for _ in range(height)]

    def fill(x0_m, y0_m, x1_m, y1_m, value=WALL):
        """Fills a rectangle; meters from the lower-left corner."""
        for row in range(round(y0_m / resolution_m), round(y1_m / resolution_m)):
            for column in range(round(x0_m / resolution_m), round(x1_m / resolution_m)):
                image[height - 1 - row][column] = value

    wall_m, door_m = 0.2, 1.25
    fill(0, 0, 14, wall_m)
    fill(0, 9 - wall_m, 14, 9)
    fill(0, 0, wall_m, 9)
    fill(14 - wall_m, 0, 14, 9)
    fill(0, 3.4, 14, 3.4 + wall_m)  # the corridor's two sides
    fill(0, 5.6, 14, 5.6 + wall_m)
    fill(6.8, 0, 6.8 + wall_m, 3.4)  # between the rooms
    fill(8.6, 5.6, 8.6 + wall_m, 9)
    for middle_m in (3.4, 10.4):
        fill(middle_m - door_m / 2, 3.4, middle_m + door_m / 2, 3.4 + wall_m, FREE)
    for middle_m in (4.4, 11.3):
        fill(middle_m - door_m / 2, 5.6, middle_m + door_m / 2, 5.6 + wall_m, FREE)
    fill(9.5, 1.0, 11.3, 1.8)  # a table
    (HERE / "building.png").write_bytes(png(image))
    (HERE / "building.yaml").write_text(
        "image: building.png\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )


def png(image):
    """Packs rows of gray values as PNG."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", len(image[0]), len(image), 8, 0, 0, 0, 0)
    rows = b"".join(b"\0" + bytes(row) for row in image)
    body = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + body


# --- Logs of a robot that slips: it drives between random places of a room of 8 x 6 m ------------

STEP_S = 0.05
LANDMARKS = {6: (0, 0), 7: (8, 0), 8: (8, 6), 9: (0, 6), 10: (4, 6), 11: (4, 0)}
BARCODES = {1: 5, 6: 72, 7: 27, 8: 54, 9: 70, 10: 36, 11: 18}


def wrap(angle):
    return (angle + math.pi) % (2 * math.pi) - math.pi


def drive(random, duration_s):
    """Yields time, true pose, and the commands v and w, step by step.

    The wheels run 3 % short, one straight piece with another, and pull to one side now and then.
    """
    x, y, heading = 4.0, 3.0, 0.0
    goal, time_s = (6.0, 4.0), 0.0
    slip, pull = 0.97, 0.0
    while time_s < duration_s:
        to_goal = math.atan2(goal[1] - y, goal[0] - x)
        error = wrap(to_goal - heading)
        if math.hypot(goal[0] - x, goal[1] - y) < 0.3:
            goal = (random.uniform(1, 7), random.uniform(1, 5))
            slip, pull = random.gauss(0.97, 0.05), random.gauss(0.0, 0.06)
        v, w = (0.0, math.copysign(0.5, error)) if abs(error) > 0.3 else (0.25, 0.0)
        yield time_s, (x, y, heading), v, w
        heading = wrap(heading + (w * 0.98 + (pull if v else 0.0)) * STEP_S)
        x += v * slip * math.cos(heading) * STEP_S
        y += v * slip * math.sin(heading) * STEP_S
        time_s += STEP_S


def arena(random):
    """Writes a folder as of the MRCLAM data: motion capture, commands, and readings of a camera."""
    truth, commands, sightings, last = [], [], [], None
    for step, (t, pose, v, w) in enumerate(drive(random, 600)):
        if step % 5 == 0:
            truth.append(f"{t:.2f} {pose[0]:.4f} {pose[1]:.4f} {pose[2]:.4f}")
        if (v, w) != last or step % 2 == 0:
            commands.append(f"{t:.2f} {v:.2f} {w:.2f}")
            last = (v, w)
        if step % 10 == 0:
            sightings += sight(random, t, pose)
    folder = HERE / "logs/arena"
    folder.mkdir(parents=True, exist_ok=True)
    barcodes = [f"{subject} {code}" for subject, code in BARCODES.items()]
    landmarks = [f"{subject} {x} {y} 0.001 0.001" for subject, (x, y) in LANDMARKS.items()]
    write(folder / "Barcodes.dat", "# subject, barcode", barcodes)
    write(folder / "Landmark_Groundtruth.dat", "# subject, x, y (m), deviations", landmarks)
    write(folder / "Robot1_Groundtruth.dat.gz", "# time (s), x, y (m), heading (rad)", truth)
    write(folder / "Robot1_Odometry.dat.gz", "# time (s), forward (m/s), turn (rad/s)", commands)
    write(folder / "Robot1_Measurement.dat.gz", "# time (s), barcode, range (m), bearing (rad)", sightings)


def sight(random, t, pose):
    """Yields the landmarks in view: one in ten is missed, some are misread."""
    for subject, (x, y) in LANDMARKS.items():
        distance_m = math.hypot(x - pose[0], y - pose[1])
        bearing = wrap(math.atan2(y - pose[1], x - pose[0]) - pose[2])
        if abs(bearing) > 0.5 or distance_m > 5.5 or random.random() < 0.1:
            continue
        code, draw = BARCODES[subject], random.random()
        if draw < 0.01:
            code = 99  # no such barcode
        elif draw < 0.04:
            code = BARCODES[random.choice([other for other in LANDMARKS if other != subject])]
        measured_m = distance_m * random.gauss(0.99, 0.06)
        yield f"{t:.2f} {code} {measured_m:.3f} {bearing + random.gauss(0, 0.02):.3f}"


def corridor_log(random):
    """Writes a corrected CARMEN log: odometry between two scans, and the true motion."""
    lines, last, odometry = ["# made by examples/make.py"], None, None
    for t, (x, y, heading), v, w in drive(random, 900):
        if last is None or math.hypot(x - last[0], y - last[1]) > 0.5 or abs(wrap(heading - last[2])) > 0.5:
            if odometry:
                lines.append(odom(odometry, t))
            last = (x, y, heading)
            pose = f"{x:.4f} {y:.4f} {heading:.4f}"
            lines.append(f"FLASER 1 3.0 {pose} {pose} {t:.2f} example {t:.2f}")
            lines.append(odom(last, 0))
            odometry = last
        at = wrap(odometry[2] + w * STEP_S)
        odometry = (odometry[0] + v * math.cos(at) * STEP_S, odometry[1] + v * math.sin(at) * STEP_S, at)
    (HERE / "logs/hall.log.gz").write_bytes(gzip.compress(text(lines), 9, mtime=0))


def odom(pose, t):
    return f"ODOM {pose[0]:.4f} {pose[1]:.4f} {pose[2]:.4f} 0 0 0 {t:.2f} example {t:.2f}"


def sonar(random):
    """Writes readings of a sonar whose truth was measured with a tape."""
    lines = ["true,reported,true_distance_m,reported_distance_m"]
    for _ in range(1500):
        kind = random.choice(["wall", "wall", "robot", "person", "nothing"])
        distance_m = random.uniform(0.1, 3.5)
        if kind == "nothing":
            is_ghost = random.random() < 0.02
            lines.append(f"nothing,wall,,{distance_m:.2f}" if is_ghost else "nothing,nothing,,")
            continue
        draw, measured_m = random.random(), max(0.05, distance_m + random.gauss(0.02, 0.04 + 0.03 * distance_m))
        missed = 0.03 if kind == "wall" else 0.12
        if draw < missed:
            lines.append(f"{kind},nothing,{distance_m:.2f},")
        else:
            told = {"wall": "robot", "robot": "wall", "person": "robot"}[kind] if draw > 0.95 else kind
            lines.append(f"{kind},{told},{distance_m:.2f},{measured_m:.2f}")
    (HERE / "logs/sonar.csv").write_bytes(text(lines))


def wheels(random):
    """Writes displacements after one action each, as read off the boxes of a floor."""
    lines = ["action,ahead_boxes,left_boxes,turn_deg"]
    for _ in range(400):
        ahead, left = random.gauss(0.97, 0.12), random.gauss(0.02, 0.10)
        lines.append(f"forward,{ahead:.3f},{left:.3f},0")
    for _ in range(150):
        for action, turn_deg in (("left", 90), ("right", -90)):
            turned = 0 if random.random() < 0.04 else turn_deg
            lines.append(f"{action},0,0,{turned}")
    (HERE / "logs/wheels.csv").write_bytes(text(lines))


# --- Recorded air traffic: five flights that cross over one point of a plane ---------------------


def tracks():
    """Writes tracks.csv: two of the five come too near each other."""
    lines = ["time_s,icao24,callsign,lat_deg,lon_deg,alt_ft,gs_kt,track_deg,vs_fpm"]
    middle, start_s = (46.9, 8.2), 1_700_000_000
    flights = [  # callsign, track, speed in kt, seconds late at the middle, kilometers to its left, level
        ("ONE11", 75, 440, 0, 0.0, 35000),
        ("TWO22", 310, 450, 25, 2.0, 35000),
        ("TRE33", 190, 430, 140, -15.0, 35000),
        ("FOR44", 100, 460, -60, 30.0, 37000),
        ("FIV55", 255, 445, -150, -6.0, 35000),
    ]
    for k, (callsign, track_deg, speed_kt, late_s, left_km, level_ft) in enumerate(flights):
        east, north = math.sin(math.radians(track_deg)), math.cos(math.radians(track_deg))
        for t in range(0, 901, 10):
            ahead_km = (t - 450 - late_s) * speed_kt * 1.852 / 3600
            x_km, y_km = ahead_km * east - left_km * north, ahead_km * north + left_km * east
            lat = middle[0] + y_km / 111.2
            lon = middle[1] + x_km / (111.2 * math.cos(math.radians(middle[0])))
            where = f"{lat:.5f},{lon:.5f},{level_ft},{speed_kt},{track_deg},0"
            lines.append(f"{start_s + t},0000{k + 1:02x},{callsign},{where}")
    (HERE / "tracks.csv").write_bytes(text(lines))


def text(lines):
    return ("\n".join(lines) + "\n").encode()


def write(path, header, lines):
    content = text([header, *lines])
    path.write_bytes(gzip.compress(content, 9, mtime=0) if path.suffix == ".gz" else content)


floor_plan()
arena(random.Random(1))
corridor_log(random.Random(2))
sonar(random.Random(3))
wheels(random.Random(4))
tracks()
