#!/usr/bin/env python3
"""The Python checker accepts certificates and refuses changed ones: check_certificate_test.py FOLDER, with certificates
in it that `certificate_tests` wrote. Exit code 77: mpmath is not installed."""
import copy, json, os, sys, tempfile, unittest

try:
    from check_certificate import Checker, Refused
except ImportError:
    sys.exit(77)

VALID = ["bouncing_ball", "two_balls_spring", "pendulum_wall", "oblique_impact", "belt_oscillator", "stacked_blocks",
         "sliding_block", "ball_row", "shaken_table", "kane_pendulum"]
CHANGED = ["oblique_impact", "sliding_block"]


def move(text, digits):
    """Adds a multiple of the radius to the midpoint of a ball."""
    m, e, r, s = (int(word, 16) for word in text.split())
    low = min(e, s)
    m = m * 2 ** (e - low) + digits * r * 2 ** (s - low)
    return " ".join(f"{x:x}" if x >= 0 else f"-{-x:x}" for x in (m, low, r, s))


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


class CheckCertificate(unittest.TestCase):
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
                with self.subTest(f"{name}: {what}"), tempfile.NamedTemporaryFile("w", suffix=".json") as file:
                    json.dump(changed, file)
                    file.flush()
                    with self.assertRaises((Refused, KeyError, IndexError)):
                        Checker(file.name).run()
        print(f"{count} changes")


if __name__ == "__main__":
    FOLDER = sys.argv.pop(1)
    unittest.main()
