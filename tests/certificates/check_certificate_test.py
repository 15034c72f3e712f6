#!/usr/bin/env python3
"""The Python checker accepts certificates and refuses changed ones: check_certificate_test.py FOLDER, with certificates
in it that `certificate_tests` wrote. Exit code 77: mpmath is not installed."""
import copy, hashlib, json, os, sys, tempfile, unittest

try:
    from check_certificate import Checker, Refused
except ImportError:
    sys.exit(77)

VALID = ["bouncing_ball", "two_balls_spring", "pendulum_wall", "oblique_impact", "belt_oscillator", "stacked_blocks",
         "sliding_block", "ball_row", "shaken_table", "kane_pendulum", "ball_in_box", "block_on_ramp", "woodpecker_toy",
         "clutch"]
CHANGED = ["oblique_impact", "sliding_block"]


def move(text, digits):
    """Adds a multiple of the radius to the midpoint of a ball."""
    m, e, r, s = (int(word, 16) for word in text.split())
    low = min(e, s)
    m = m * 2 ** (e - low) + digits * r * 2 ** (s - low)
    return " ".join(f"{x:x}" if x >= 0 else f"-{-x:x}" for x in (m, low, r, s))


def set_mode(c, k, mode):
    """Gives the first contact another mode from step k to the next event."""
    for event in c["events"]:
        if event["step"] == k - 1:
            event["modes"][0] = mode
    last = min([e["step"] for e in c["events"] if e["step"] >= k], default=len(c["steps"]) - 1)
    for step in c["steps"][k:last + 1]:
        step["modes"][0] = mode
    if last == len(c["steps"]) - 1:
        c["final"]["modes"][0] = mode


def changes(c):
    """Changed certificates with a name."""
    def change(name, function):
        changed = copy.deepcopy(c)
        function(changed)
        return name, changed
    for k, step in enumerate(c["steps"]):
        yield change(f"step {k} left out", lambda c: c["steps"].pop(k))
        yield change(f"h of step {k}", lambda c: c["steps"][k].update(h=(float.fromhex(step["h"]) * 1.001).hex()))
        yield change(f"modes of step {k}", lambda c: c["steps"][k]["modes"].__setitem__(0, "bent"))
        for i, x in enumerate(step["x"]):
            if k > 0 and x.split()[2] != "0":
                yield change(f"x[{i}] of step {k}", lambda c: c["steps"][k]["x"].__setitem__(i, move(x, 2 ** 12)))
        if len(step["end"].split()[2]) > 1:
            yield change(f"end of step {k}", lambda c: c["steps"][k].update(end=move(step["end"], 2 ** 12)))
    for mode in ["open", "closed", "stick", "slip+", "slip-"]:
        for k in [0] + [event["step"] + 1 for event in c["events"]]:
            yield change(f"{mode} from step {k} on", lambda c: set_mode(c, k, mode))
    yield change("an end that is an interval", lambda c: c["steps"][-1].update(end="81 -8 7f -8"))
    for k, event in enumerate(c["events"]):
        yield change(f"event {k} left out", lambda c: c["events"].pop(k))
        yield change(f"kind of event {k}", lambda c: c["events"][k].update(kind="detach"))
        yield change(f"time of event {k}", lambda c: c["events"][k]["time"].update(value="0.1"))
        for impulse in range(len(event["Lambda_n"])):
            yield change(f"impulse of event {k}", lambda c: c["events"][k]["Lambda_n"][impulse].update(radius=1e-60))
    yield change("scene", lambda c: c.update(scene=c["scene"].replace("9.81", "9.82")))
    for i, x in enumerate(c["final"]["x"]):
        yield change(f"final x[{i}]", lambda c: c["final"]["x"].__setitem__(i, move(x, 2 ** 12)))
    yield change("result", lambda c: c["final"]["q"][0].update(value="0.1"))


def body_at_rest(height, v_x, mode):
    """A certificate, by hand, that a body keeps its height and its horizontal velocity while it touches the floor."""
    scene = json.dumps({"q0": ["0", str(height)], "v0": [str(v_x), "0"], "T": "1", "M": [["1", "0"], ["0", "1"]],
                        "f": ["0", "-1"], "contacts": [{"name": "floor", "gap": "q[1]", "mu": "0.5" if mode else "0",
                                                        "Jt": [["1", "0"]]}]})
    exact = lambda numbers: [f"{number:x} 0 0 0" for number in numbers]
    decimal = lambda numbers: [{"value": str(number), "radius": 0.0, "decimals": 30} for number in numbers]
    return {"format": "ricochet certificate 1", "scene": scene, "reading": "decimal", "bits": 100, "order": 10,
            "scene_sha256": hashlib.sha256(scene.encode()).hexdigest(), "events": [],
            "steps": [{"t": "0 0 0 0", "h": "0x1p+0", "end": "1 0 0 0", "modes": [mode or "closed"],
                       "x": exact([0, height, v_x, 0]), "rho": ["0x0p+0"] * 4}],
            "final": {"x": exact([v_x, height, v_x, 0]), "modes": [mode or "closed"], "q": decimal([v_x, height]),
                      "v": decimal([v_x, 0])}}


class CheckCertificate(unittest.TestCase):
    def check(self, certificate):
        with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
            json.dump(certificate, file)
            file.flush()
            Checker(file.name).run()

    def test_knows_what_can_be_closed_or_stick(self):
        self.check(body_at_rest(0, 0, "stick"))
        self.check(body_at_rest(0, 1, ""))
        for height, v_x, mode in [(1, 0, "stick"), (1, 0, ""), (0, 1, "stick"), (0, 0, "closed"), (0, 0, "slip+")]:
            with self.subTest(f"{height}, {v_x}, {mode}"), self.assertRaises(Refused):
                self.check(body_at_rest(height, v_x, mode))

    def test_accepts(self):
        for name in VALID:
            with self.subTest(name):
                Checker(os.path.join(FOLDER, name + ".json")).run()

    def test_refuses_changes(self):
        count = 0
        for name in CHANGED:
            with open(os.path.join(FOLDER, name + ".json")) as file:
                certificate = json.load(file)
            for what, changed in changes(certificate):
                if changed == certificate:
                    continue
                count += 1
                with self.subTest(f"{name}: {what}"), self.assertRaises((Refused, KeyError, IndexError)):
                    self.check(changed)
        print(f"{count} changes")


if __name__ == "__main__":
    FOLDER = sys.argv.pop(1)
    unittest.main()
