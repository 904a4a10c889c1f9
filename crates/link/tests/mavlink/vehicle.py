"""Aircraft that speak MAVLink 2, without any code of Sidestep: `pymavlink` for the messages, and a few lines of physics.

    vehicle.py CONFIG

CONFIG is a JSON object with `origin`, a latitude and a longitude in degrees, and `vehicles`, a list of objects:

    kind        "copter" or "plane"
    autopilot   "ardupilot" or "px4"
    system      its number
    start       meters east, north and above the home, and a direction of flight in degrees clockwise from the north
    speed       of flight at the start in m/s; 0 if it is not given
    connect     the port to which it sends its datagrams; without it, it listens at a port that is told
    tcp         whether it listens for a stream in place of datagrams
    key         the key of signed frames, as 64 hexadecimal digits; without it nothing is signed
    mode        its custom mode at the start; that in which it follows setpoints if it is not given
    ground      whether it stands on the ground, not armed
    wind        in m/s to the east and to the north
    noise       standard deviation of its positions in meters

The first line on standard output is the list of ports. Each line on standard input is a JSON object with `do` and `vehicle`,
each answer is a line:

    report      what has happened so far: where it is truly, what it was told
    set         change fields of a vehicle: `lag` in seconds of all that it sends, `silent`, `deny` (a result for each command
                that is refused), `deaf` (commands that are not heard), `mode`, `frozen` (its clock)
    reboot      its clock begins anew, it is silent for `seconds`, and has forgotten mode, rates and what it was told
    adsb        send the report of another aircraft: `fields`
    foreign     send a heartbeat of another system, one of version 1, bytes that are nothing, and one that is not signed
    hang up     close the stream
    separation  the smallest true distance so far of any two that are not among `without`, in meters
"""

import json
import math
import random
import select
import socket
import sys
import threading
import time

from pymavlink.dialects.v20 import ardupilotmega as mavlink

CONFIG = json.loads(sys.argv[1])
ORIGIN = CONFIG["origin"]
HOME_M = 488.0
STEP_S = 0.02
G = 9.81
# Seconds after which a multirotor without setpoints stands, as ArduCopter has it.
SETPOINT_TIMEOUT_S = 3.0
# Seconds after which PX4 counts setpoints as lost.
OFFBOARD_TIMEOUT_S = 0.5

GUIDED = {("copter", "ardupilot"): 4, ("plane", "ardupilot"): 15}
OFFBOARD = 6 << 16
AUTO_LOITER = 4 << 16 | 3 << 24
LOITER = {"copter": 5, "plane": 12}
BRAKE = 17

SET_MODE = 176
CHANGE_HEADING = 43002
CHANGE_ALTITUDE = 43001
CHANGE_SPEED = 178
REPOSITION = 192
LOITER_UNLIM = 17
SET_INTERVAL = 511
ACCEPTED, DENIED, UNSUPPORTED, INT_ONLY = 0, 2, 3, 8

# WGS84.
EQUATOR_M = 6378137.0
ECCENTRICITY2 = 0.00669437999014
SIN = math.sin(math.radians(ORIGIN[0]))
ACROSS_M = EQUATOR_M / math.sqrt(1 - ECCENTRICITY2 * SIN * SIN)
ALONG_M = ACROSS_M * (1 - ECCENTRICITY2) / (1 - ECCENTRICITY2 * SIN * SIN)


def to_units(east, north):
    """Latitude and longitude in 1e-7 degrees of a place."""
    latitude = math.radians(ORIGIN[0]) + north / ALONG_M
    longitude = math.radians(ORIGIN[1]) + east / (ACROSS_M * math.cos(math.radians(ORIGIN[0])))
    return round(math.degrees(latitude) * 1e7), round(math.degrees(longitude) * 1e7)


def to_meters(latitude, longitude):
    north = math.radians(latitude * 1e-7 - ORIGIN[0]) * ALONG_M
    east = math.radians(longitude * 1e-7 - ORIGIN[1]) * ACROSS_M * math.cos(math.radians(ORIGIN[0]))
    return east, north


def clamp(x, y, most):
    """A vector, shortened to a length."""
    length = math.hypot(x, y)
    return (x, y) if length <= most else (x * most / length, y * most / length)


def wrapped(angle):
    return (angle + math.pi) % (2 * math.pi) - math.pi


class Copter:
    """A multirotor with a bounded acceleration that comes late, and wind."""

    MAX_SPEED, MAX_ACCELERATION, LAG_S = 20.0, 6.0, 0.15

    def __init__(self, config):
        east, north, self.up, degrees = config["start"]
        speed = config.get("speed", 0.0)
        self.at = [east, north]
        self.velocity = [speed * math.sin(math.radians(degrees)), speed * math.cos(math.radians(degrees))]
        self.acceleration = [0.0, 0.0]
        self.yaw = math.radians(degrees)
        self.wind = config.get("wind", [0.0, 0.0])
        self.target = None

    def on_target(self, message):
        """A setpoint: whatever its mask leaves out is zero or as it is."""
        mask = message.type_mask
        place = to_meters(message.lat_int, message.lon_int)
        self.target = {
            "at": None if mask & 3 else place,
            "velocity": (0.0, 0.0) if mask & 24 else (message.vy, message.vx),
            "acceleration": (0.0, 0.0) if mask & 192 else (message.afy, message.afx),
            "yaw": None if mask & 1024 else message.yaw,
            "since": time.monotonic(),
        }

    def advance(self, step, is_led, estimate):
        wanted = (0.0, 0.0)
        forward = (0.0, 0.0)
        target = self.target if is_led else None
        if target and time.monotonic() - target["since"] < SETPOINT_TIMEOUT_S:
            forward = target["acceleration"]
            wanted = target["velocity"]
            if target["at"]:
                late = time.monotonic() - target["since"]
                off = [target["at"][k] + wanted[k] * late - estimate[k] for k in (0, 1)]
                wanted = [wanted[k] + 1.0 * off[k] for k in (0, 1)]
            if target["yaw"] is not None:
                self.yaw += max(-1.5 * step, min(1.5 * step, wrapped(target["yaw"] - self.yaw)))
        wanted = clamp(*wanted, self.MAX_SPEED)
        # The wind pushes by its drag.
        push = [0.15 * (self.wind[k] - self.velocity[k]) for k in (0, 1)]
        asked = [forward[k] + 3.0 * (wanted[k] - self.velocity[k]) for k in (0, 1)]
        asked = clamp(*asked, self.MAX_ACCELERATION)
        for k in (0, 1):
            self.acceleration[k] += (asked[k] - self.acceleration[k]) * min(1.0, step / self.LAG_S)
            self.velocity[k] += (self.acceleration[k] + push[k]) * step
            self.at[k] += self.velocity[k] * step


class Plane:
    """A fixed wing with a bounded bank that comes late, an airspeed that comes later, and wind."""

    MAX_BANK, BANK_LAG_S, SPEED_LAG_S, LOITER_M = math.radians(45), 0.4, 1.5, 80.0

    def __init__(self, config):
        east, north, self.up, degrees = config["start"]
        self.at = [east, north]
        self.wind = config.get("wind", [0.0, 0.0])
        self.airspeed = config.get("speed", 15.0)
        self.wanted_airspeed = self.airspeed
        self.yaw = math.radians(degrees)
        self.bank = 0.0
        self.course = None
        self.most = 3.0
        self.velocity = [0.0, 0.0]
        self.advance(0.0, False, self.at)

    def advance(self, step, is_led, _estimate):
        bank = math.atan(self.airspeed**2 / (self.LOITER_M * G))
        if is_led and self.course is not None:
            course = math.atan2(*self.velocity)
            rate = 0.8 * wrapped(self.course - course)
            most = math.atan(self.most / G)
            bank = max(-most, min(most, math.atan(rate * self.airspeed / G)))
        elif is_led:
            bank = 0.0
        bank = max(-self.MAX_BANK, min(self.MAX_BANK, bank))
        self.bank += (bank - self.bank) * min(1.0, step / self.BANK_LAG_S)
        self.airspeed += (self.wanted_airspeed - self.airspeed) * min(1.0, step / self.SPEED_LAG_S)
        self.yaw = wrapped(self.yaw + G * math.tan(self.bank) / self.airspeed * step)
        air = (math.sin(self.yaw), math.cos(self.yaw))
        for k in (0, 1):
            self.velocity[k] = self.airspeed * air[k] + self.wind[k]
            self.at[k] += self.velocity[k] * step


class UdpWire:
    """Datagrams to the one who was heard last."""

    def __init__(self, config):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setblocking(False)
        self.peer = ("127.0.0.1", config["connect"]) if "connect" in config else None
        self.connections = 0

    def port(self):
        return self.socket.getsockname()[1]

    def receive(self):
        try:
            data, self.peer = self.socket.recvfrom(65536)
        except BlockingIOError:
            return None
        return data

    def send(self, data):
        if self.peer:
            self.socket.sendto(data, self.peer)

    def hang_up(self):
        pass


class TcpWire:
    """A stream to the one who has connected last, in which frames are cut anywhere."""

    def __init__(self):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.listen()
        self.socket.setblocking(False)
        self.stream = None
        self.connections = 0

    def port(self):
        return self.socket.getsockname()[1]

    def receive(self):
        try:
            self.stream, _ = self.socket.accept()
            self.stream.setblocking(False)
            self.connections += 1
        except BlockingIOError:
            pass
        if not self.stream:
            return None
        try:
            return self.stream.recv(17) or None
        except BlockingIOError:
            return None
        except ConnectionError:
            self.stream = None
            return None

    def send(self, data):
        if not self.stream:
            return
        try:
            self.stream.sendall(data[:9])
            self.stream.sendall(data[9:])
        except OSError:
            self.stream = None

    def hang_up(self):
        if self.stream:
            self.stream.close()
        self.stream = None


class Vehicle:
    """An autopilot: its modes, its messages, and the body that it flies."""

    def __init__(self, number, config):
        self.config = config
        self.random = random.Random(number)
        self.kind = config["kind"]
        self.autopilot = config["autopilot"]
        self.body = (Copter if self.kind == "copter" else Plane)(config)
        self.guided = GUIDED.get((self.kind, self.autopilot), OFFBOARD)
        self.mode = config.get("mode", self.guided)
        self.is_armed = not config.get("ground", False)
        self.wire = TcpWire() if config.get("tcp") else UdpWire(config)
        self.link = mavlink.MAVLink(None, srcSystem=config["system"], srcComponent=1)
        self.link.robust_parsing = True
        if "key" in config:
            signing = self.link.signing
            signing.secret_key = bytes.fromhex(config["key"])
            signing.link_id = 3
            signing.timestamp = int((time.time() - 1420070400) * 1e5)
            signing.sign_outgoing = True
        self.booted = time.monotonic()
        self.speaks_at = 0.0
        self.rates = {}
        self.sent = {}
        self.queue = []
        self.lag = 0.0
        self.silent = False
        self.frozen = None
        self.deny = {}
        self.deaf = []
        self.error = [0.0, 0.0]
        self.told = {"setpoints": 0, "heartbeats": 0, "courses": 0, "bad": 0, "commands": {}}
        self.modes = [self.mode]
        self.traffic = []
        self.last_setpoint = {}
        self.setpoint_at = -1e9
        self.fastest = 0.0

    def boot_ms(self):
        if self.frozen is not None:
            return self.frozen
        return int((time.monotonic() - self.booted) * 1000)

    def estimate(self):
        return [self.body.at[k] + self.error[k] for k in (0, 1)]

    def advance(self, step):
        noise = self.config.get("noise", 0.0)
        for k in (0, 1):
            # The error of a receiver stays for seconds.
            self.error[k] += -self.error[k] * step / 5.0
            self.error[k] += self.random.gauss(0.0, noise) * math.sqrt(2 * step / 5.0)
        if not self.is_armed:
            return
        is_led = self.mode == self.guided
        if self.mode == OFFBOARD and time.monotonic() - self.setpoint_at > OFFBOARD_TIMEOUT_S:
            self.set_mode(AUTO_LOITER)
        self.body.advance(step, is_led, self.estimate())
        self.fastest = max(self.fastest, math.hypot(*self.body.velocity))

    def set_mode(self, mode):
        self.mode = mode
        self.modes.append(mode)

    # What it says.

    def send(self, message):
        if self.silent or time.monotonic() < self.speaks_at:
            return
        self.send_bytes(message.pack(self.link))
        self.link.seq = (self.link.seq + 1) % 256

    def send_bytes(self, data):
        self.queue.append((time.monotonic() + self.lag, data))

    def flush(self):
        now = time.monotonic()
        while self.queue and self.queue[0][0] <= now:
            self.wire.send(self.queue.pop(0)[1])

    def speak(self):
        now = time.monotonic()
        if now - self.sent.get(0, -9.0) >= 1.0:
            self.sent[0] = now
            self.send(self.heartbeat())
        for number, interval in list(self.rates.items()):
            if now - self.sent.get(number, -9.0) >= interval:
                self.sent[number] = now
                self.send(self.message(number))

    def heartbeat(self):
        kind = {"copter": mavlink.MAV_TYPE_QUADROTOR, "plane": mavlink.MAV_TYPE_FIXED_WING}[self.kind]
        pilot = {"ardupilot": mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, "px4": mavlink.MAV_AUTOPILOT_PX4}[self.autopilot]
        armed = mavlink.MAV_MODE_FLAG_SAFETY_ARMED if self.is_armed else 0
        status = mavlink.MAV_STATE_ACTIVE if self.is_armed else mavlink.MAV_STATE_STANDBY
        return mavlink.MAVLink_heartbeat_message(kind, pilot, armed | 1, self.mode, status, 3)

    def message(self, number):
        body = self.body
        if number == mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT:
            latitude, longitude = to_units(*self.estimate())
            altitude = round((body.up + HOME_M) * 1000)
            speed = [round(v * 100) for v in (body.velocity[1], body.velocity[0])]
            nose = round(math.degrees(body.yaw) % 360 * 100) % 36000
            return mavlink.MAVLink_global_position_int_message(
                self.boot_ms(), latitude, longitude, altitude, round(body.up * 1000), *speed, 0, nose
            )
        if number == mavlink.MAVLINK_MSG_ID_ATTITUDE:
            return mavlink.MAVLink_attitude_message(self.boot_ms(), 0.0, 0.0, wrapped(body.yaw), 0.0, 0.0, 0.0)
        landed = mavlink.MAV_LANDED_STATE_IN_AIR if self.is_armed else mavlink.MAV_LANDED_STATE_ON_GROUND
        return mavlink.MAVLink_extended_sys_state_message(0, landed)

    # What it hears.

    def hear(self):
        while data := self.wire.receive():
            if time.monotonic() < self.speaks_at:
                continue
            for message in self.link.parse_buffer(data) or []:
                if message.get_type() == "BAD_DATA":
                    self.told["bad"] += 1
                    continue
                self.on_message(message)

    def on_message(self, message):
        kind = message.get_type()
        if kind == "HEARTBEAT":
            self.told["heartbeats"] += 1
        elif kind == "TIMESYNC" and message.tc1 == 0:
            now = int((time.monotonic() - self.booted) * 1e9)
            self.send(mavlink.MAVLink_timesync_message(now, message.ts1))
        elif kind == "SET_POSITION_TARGET_GLOBAL_INT":
            self.told["setpoints"] += 1
            self.setpoint_at = time.monotonic()
            self.last_setpoint = message.to_dict()
            if self.kind == "copter":
                self.body.on_target(message)
        elif kind in ("COMMAND_LONG", "COMMAND_INT"):
            self.on_command(message, kind)
        elif kind == "ADSB_VEHICLE":
            self.traffic.append(message.to_dict())
            # As ArduPilot does, it tells what it knows.
            self.send(message)

    def on_command(self, message, kind):
        number = message.command
        counts = self.told["commands"]
        counts[str(number)] = counts.get(str(number), 0) + 1
        if number in self.deaf:
            return
        result = self.deny.get(str(number))
        if result is None:
            result = self.obey(message, kind)
        ack = mavlink.MAVLink_command_ack_message(
            number, result, 0, 0, message.get_srcSystem(), message.get_srcComponent()
        )
        self.send(ack)

    def obey(self, message, kind):
        number = message.command
        if number == SET_INTERVAL:
            self.rates[int(message.param1)] = message.param2 / 1e6
        elif number == SET_MODE:
            return self.on_set_mode(message)
        elif number == LOITER_UNLIM:
            self.set_mode(LOITER[self.kind] if self.autopilot == "ardupilot" else AUTO_LOITER)
        elif number == REPOSITION:
            self.set_mode(AUTO_LOITER)
        elif number == CHANGE_SPEED and self.kind == "plane":
            self.body.wanted_airspeed = max(10.0, min(25.0, message.param2))
        elif number == CHANGE_ALTITUDE and self.kind == "plane":
            self.body.up = message.z if message.frame == 3 else message.z - HOME_M
        elif number == CHANGE_HEADING and self.kind == "plane":
            if kind != "COMMAND_INT":
                return INT_ONLY
            if self.mode != self.guided:
                return DENIED
            self.told["courses"] += 1
            self.body.course = math.radians(message.param2)
            self.body.most = message.param3
        else:
            return UNSUPPORTED
        return ACCEPTED

    def on_set_mode(self, message):
        main, sub = int(message.param2), int(message.param3)
        if self.autopilot == "px4":
            mode = main << 16 | sub << 24
            if mode == OFFBOARD and time.monotonic() - self.setpoint_at > OFFBOARD_TIMEOUT_S:
                return DENIED
            self.set_mode(mode)
        else:
            self.set_mode(main)
        return ACCEPTED

    # What the test asks for.

    def reboot(self, seconds):
        self.speaks_at = time.monotonic() + seconds
        self.booted = self.speaks_at - 0.2
        self.rates = {}
        self.queue = []
        self.set_mode(0)
        if self.kind == "copter":
            self.body.target = None
        else:
            self.body.course = None

    def foreign(self):
        other = mavlink.MAVLink(None, srcSystem=99, srcComponent=1)
        self.send_bytes(self.heartbeat().pack(other))
        self.send_bytes(self.heartbeat().pack(other, force_mavlink1=True))
        self.send_bytes(bytes(range(40)))
        bare = mavlink.MAVLink(None, srcSystem=self.config["system"], srcComponent=1)
        self.send_bytes(self.heartbeat().pack(bare))

    def report(self):
        return {
            "at": list(self.body.at),
            "up": self.body.up,
            "velocity": list(self.body.velocity),
            "fastest": self.fastest,
            "mode": self.mode,
            "modes": self.modes,
            "told": self.told,
            "setpoint": self.last_setpoint,
            "traffic": self.traffic,
            "rates": self.rates,
            "connections": self.wire.connections,
        }


class Airspace:
    """All vehicles, and their time."""

    def __init__(self):
        self.vehicles = [Vehicle(n, config) for n, config in enumerate(CONFIG["vehicles"])]
        self.lock = threading.Lock()
        self.has_ended = False
        self.nearest = {}

    def run(self):
        before = time.monotonic()
        sockets = [vehicle.wire.socket for vehicle in self.vehicles]
        while not self.has_ended:
            select.select(sockets, [], [], STEP_S / 2)
            with self.lock:
                now = time.monotonic()
                for vehicle in self.vehicles:
                    vehicle.hear()
                while before + STEP_S <= now:
                    before += STEP_S
                    self.advance()
                for vehicle in self.vehicles:
                    vehicle.speak()
                    vehicle.flush()

    def advance(self):
        for vehicle in self.vehicles:
            vehicle.advance(STEP_S)
        places = [vehicle.body.at for vehicle in self.vehicles]
        for n, a in enumerate(places):
            for m in range(n):
                apart = math.dist(a, places[m])
                self.nearest[n, m] = min(self.nearest.get((n, m), apart), apart)

    def obey(self, request):
        what = request["do"]
        if what == "separation":
            without = request["without"]
            pairs = [apart for pair, apart in self.nearest.items() if not set(pair) & set(without)]
            return min(pairs)
        vehicle = self.vehicles[request.get("vehicle", 0)]
        if what == "report":
            return vehicle.report()
        if what == "reboot":
            vehicle.reboot(request["seconds"])
        elif what == "adsb":
            fields = request["fields"]
            vehicle.send(mavlink.MAVLink_adsb_vehicle_message(*fields[:8], b"TEST", *fields[8:]))
        elif what == "foreign":
            vehicle.foreign()
        elif what == "hang up":
            vehicle.wire.hang_up()
        elif what == "set":
            self.set(vehicle, request)
        return "done"

    def set(self, vehicle, request):
        for name in ("lag", "silent", "deny", "deaf"):
            if name in request:
                setattr(vehicle, name, request[name])
        if "mode" in request:
            vehicle.set_mode(request["mode"])
        if "frozen" in request:
            vehicle.frozen = vehicle.boot_ms() if request["frozen"] else None


def main():
    airspace = Airspace()
    thread = threading.Thread(target=airspace.run, daemon=True)
    thread.start()
    print(json.dumps([vehicle.wire.port() for vehicle in airspace.vehicles]), flush=True)
    for line in sys.stdin:
        with airspace.lock:
            answer = airspace.obey(json.loads(line))
        print(json.dumps(answer), flush=True)
    airspace.has_ended = True
    thread.join()


if __name__ == "__main__":
    main()
