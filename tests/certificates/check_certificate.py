#!/usr/bin/env python3
"""Checks certificates of proven motions without the program that wrote them: check_certificate.py FILE...

It shares nothing with that program but the format, see reference/certified/CERTIFICATES.md. Formulas and series are
those of interval_motion.py; sets are moved in mean value form, phi(c) + Dphi([x]) (x - c). Checked: the scene and its
hash, the start, every step (inclusion, time, no event before its end), the root of the event function, impacts (every
combination of modes), which contacts can be closed and stick, the final state and its decimal numbers. Not checked:
that the modes after an event are the only consistent ones, the stated remainders (it finds its own), the hash of the
certificate, and readings other than decimal. Exit code 1 if a certificate is refused, 2 if one cannot be read."""
import hashlib, itertools, json, sys, time

from mpmath import iv
from mpmath.libmp import from_man_exp, mpf_add, mpf_sub, mpi_add, mpi_mul

from interval_motion import ZERO, Motion, Raw, Refused, Scene, Wrap, dot, remainders, require, series

sys.setrecursionlimit(100000)

# By kind: the function that vanishes, the modes of its contact after it, and how many leading coefficients of which
# function are then zero: of a gap whose force vanished, of a slip velocity after a reversal or sticking.
EVENTS = {"impact": ("impact",), "detach": ("detach", ["open"], "impact", 3),
          "slip_to_stick": ("slip_end", ["stick"], "slip_end", 1), "slip_end": ("slip_end", ["open"], "slip_end", 1),
          "slip_reversal": ("slip_end", ["slip+", "slip-"], "slip_end", 1),
          "stick_to_slip": (None, ["slip+", "slip-", "slip"], "slip_end", 2)}


def ball(text):
    """Midpoint and radius, two mantissas and exponents of 2, hexadecimal: the exact interval."""
    m, e, r, s = (int(word, 16) for word in text.split())
    middle, radius = from_man_exp(m, e), from_man_exp(r, s)
    return Wrap((mpf_sub(middle, radius), mpf_add(middle, radius)))


def is_stated(x, number):
    """Whether x is within the radius of a decimal number."""
    return abs(x - iv.mpf(number["value"])) <= number["radius"] * (1 + 1e-6)


def horner(c, t):
    total = Raw(0)
    for x in reversed(c):
        total = mpi_add(mpi_mul(total, t._mpi_, iv.prec), x, iv.prec)
    return Wrap(total)


def slope(c):
    return [Raw(k * Wrap(x)) for k, x in enumerate(c)][1:]


def positive(f, d, rho, begin, end, depth=60):
    """Whether polynomial f, with derivative d and remainder rho, is positive on [begin, end]."""
    I, middle = iv.mpf([begin.a, end.b]), iv.mpf((begin.a + end.b) / 2).mid
    rise = horner(d, I)
    if rise < 0 or rise > 0:
        return bool(horner(f, iv.mpf(end.b) if rise < 0 else iv.mpf(begin.a)) - rho > 0)
    if horner(f, middle) + (I - middle) * rise - rho > 0:
        return True
    return depth > 0 and positive(f, d, rho, begin, middle, depth - 1) and positive(f, d, rho, middle, end, depth - 1)


def first_root(f, rho, value, rate, root, h):
    """Where an interval without root ends, if the first root lies in `root`, by Newton's operator. The function is
    f +- rho; value(t) encloses it more tightly, and rate(I) its derivative."""
    for k in range(6, iv.prec, 12):
        w = iv.mpf(root.delta.b) * 2 ** k
        begin, end = (root.mid - w).mid, (root.mid + w).mid
        fall = rate(iv.mpf([begin.a, end.b]))
        if not (begin > 0 and end <= h and fall < 0):
            return None
        if horner(f, begin) - rho > 0 and value(end) < 0:
            return begin if root.mid - value(root.mid) / fall in root else None
    return None


class Checker:
    def __init__(self, path):
        with open(path) as file:
            self.c = c = json.load(file)
        require(c["format"] == "ricochet certificate 1" and c["reading"] == "decimal", "format or reading")
        require(hashlib.sha256(c["scene"].encode()).hexdigest() == c["scene_sha256"], "the hash of the scene")
        # More than stated: with functions as variables, series lose more digits and converge more slowly.
        iv.prec, self.N, self.step = c["bits"] + 160, c["order"] * 9 // 8 + 4, -1
        self.s, self.events = Scene(c["scene"]), {e["step"]: e for e in c["events"]}
        require(len(self.events) == len(c["events"]), "two events of one step")
        require(max(self.events, default=-1) < len(c["steps"]) - 1, "an event after the end")

    def run(self):
        s, steps, x = self.s, self.c["steps"], self.s.start
        at = lambda nodes: s.enclose(nodes, x)
        gaps = [(g, v) for c in s.contacts for g, v in [at([c.gap, c.v_n])]]
        self.modes = ["open" if not (0 in g and 0 in v) else "stick" if all(0 in y for y in at(c.v_t)) else "closed"
                      for c, (g, v) in zip(s.contacts, gaps)]
        self.rest()
        self.zeros.update({("impact", i): 1 for i, (g, v) in enumerate(gaps) if 0 in g and v > 0})
        if -1 in self.events:
            x = self.jump(self.events[-1], x)
        for self.step, step in enumerate(steps):
            X = [ball(text) for text in step["x"] + [step["t"]]]
            for i, (y, Y) in enumerate(zip(x, X, strict=True)):
                require(y in Y, f"x[{i}] of the next step")
            if self.step == 0 or self.step - 1 in self.events:
                self.enter(step["modes"])
                motion = Motion(s, self.modes)
            require(step["modes"] == self.modes, "the modes")
            x = self.take(motion, step, X, self.events.get(self.step))
        end = self.c["final"]
        require(end["modes"] == self.modes, "the final modes")
        for i, (text, stated) in enumerate(zip(end["x"], end["q"] + end["v"], strict=True)):
            require(x[i] in ball(text), f"the final x[{i}]")
            require(is_stated(ball(text), stated), f"the decimal number of x[{i}]")

    def rest(self):
        """How many leading coefficients of a gap (closed contacts) and of a slip velocity (sticking ones) are zero."""
        closed = [(i, mode) for i, mode in enumerate(self.modes) if mode != "open"]
        self.zeros = {("impact", i): 2 for i, _ in closed} | {("slip_end", i): 1 for i, m in closed if m == "stick"}

    def enter(self, modes):
        """A contact can only be closed without gap and normal velocity, and can only stick without slip velocity."""
        for i, (mode, c) in enumerate(zip(modes, self.s.contacts, strict=True)):
            require(mode in c.modes and (mode == "open" or self.zeros.get(("impact", i), 0) > 1) and
                    (mode != "stick" or ("slip_end", i) in self.zeros), f"the mode of {c.name}")
        self.modes = modes

    def take(self, motion, step, X, event):
        """The state and time at the end of a step: phi(c) + Dphi(X) (X - c), and the ball of the end times the rate."""
        s, N, end, names = self.s, self.N, ball(step["end"]), [c.name for c in self.s.contacts]
        is_final, length = self.step == len(self.c["steps"]) - 1, iv.mpf(float.fromhex(step["h"]))
        tau = length * end
        h = float(tau.mid.a) * (1 + 1e-6)
        require(end > 0 and end <= 1 and tau <= h, "the end of the step")
        require((s.T - X[-1]) / length in end if is_final else event or end.delta == 0, "the end time")
        ends = [(i, f) for kind, i, f in motion.events if event and names[i] == event["contact"] and
                kind == (EVENTS[event["kind"]][0] or event["modes"][i])]
        require(ends or not event, "the event cannot happen in these modes")
        (fall, *gradient), full = motion.gradient(ends[0][1]) if ends else ([None], motion.full)
        center = [x.mid for x in X]
        rest = [x - c for x, c in zip(X, center)]
        start = {d: Raw(iv.mpf(i == j)) for i, row in enumerate(motion.d) for j, d in enumerate(row)}
        point = series(motion.plain, motion.rate, dict(zip(s.x, map(Raw, center))), N)
        wide = series(full, motion.varied, start | dict(zip(s.x, map(Raw, X))), N)
        small, rho = remainders(motion.plain, motion.rate, point, h, N), remainders(full, motion.varied, wide, h, N)
        at = lambda c, r, a, t, skip=0: horner(c[a][skip:], t) * t ** skip + iv.mpf([-r[a], r[a]])
        mean = lambda f, gradient, t, skip=0: at(point, small, f, t, skip) + dot(
            [at(wide, rho, g, t, skip) for g in gradient], rest)
        for kind, i, f in motion.events:
            skip = self.zeros.get((kind, i), 0) if 0 in Wrap(wide[f][0]) else 0
            p, r, last = wide[f][skip:], rho[f] * (1 + 1e-10) / h ** skip, iv.mpf(tau.b)
            if [(i, f)] == ends[:1]:
                last = first_root(p, r, lambda t: mean(f, gradient, t, skip), lambda t: at(wide, rho, fall, t), tau, h)
                require(last is not None, f"the root of {kind} of {names[i]}")
            require(positive(p, slope(p), r, iv.mpf(0), last), f"{kind} of {names[i]} before the end of the step")
        # Rates at the enclosure of the end: series of the wide set lose half of all digits.
        inside = [mean(y, row, tau) for y, row in zip(s.x, motion.d)]
        rates = s.enclose([motion.rate[y] for y in s.x], inside)
        x = [mean(y, row, tau.mid) + (tau - tau.mid) * rate for y, row, rate in zip(s.x, motion.d, rates)]
        self.zeros = {}
        if event:
            x = self.jump(event, x)
            require(is_stated(x[-1], event["time"]), "the time of the event")
        return x

    def jump(self, event, x):
        """The state after an event."""
        i = [c.name for c in self.s.contacts].index(event["contact"])
        require(event["modes"] == self.c["steps"][self.step + 1]["modes"], "the modes after an event")
        if self.step >= 0:
            self.rest()
        if event["kind"] == "impact":
            return self.impact(i, event, x)
        _, modes, function, n = EVENTS[event["kind"]]
        require(event["modes"][i] in modes, "the modes after " + event["kind"])
        self.zeros[function, i] = n
        return x

    def coupled(self, i):
        """Contact i and closed contacts that exchange momentum with it."""
        s, found, reached, before = self.s, {i}, set(), None
        pushed = lambda c: {k for row in [c.J] + c.Jt for k, a in enumerate(row) if a is not ZERO}
        while before != (len(found), len(reached)):
            before = len(found), len(reached)
            reached |= {k for j in found for k in pushed(s.contacts[j])}
            reached |= {k for r in reached for k in range(s.n) if s.M[r][k] is not ZERO}
            found |= {j for j, c in enumerate(s.contacts) if self.modes[j] != "open" and pushed(c) & reached}
        return sorted(found)

    def impact(self, hit, event, x):
        """Newton's and Coulomb's law: one combination of modes holds strictly, every other regular one is violated."""
        s, coupled, proven = self.s, self.coupled(hit), []
        require(s.enclose([s.contacts[hit].v_n], x)[0] < 0, "the normal velocity before an impact")
        require(all(len(s.contacts[j].Jt) < 2 for j in coupled), "not covered: an impact with friction in space")
        options = [c.modes if j in coupled else ["open"] for j, c in enumerate(s.contacts)]
        for modes in itertools.product(*options):
            v, impulse, signs = s.impact(hit, modes)
            nodes = [f for _, j, f in signs if j in coupled]
            values = s.enclose(v + list(impulse.values()) + nodes, x)
            signs = values[len(values) - len(nodes):]
            holds = all(y > 0 for y in signs)
            require(holds or any(y < 0 for y in signs) or not all(y.delta < iv.inf for y in values),
                    f"undecided: impact with {modes}")
            if holds:
                proven.append((modes, values[:s.n], dict(zip(impulse, values[s.n:]))))
        require(len(proven) == 1, f"{len(proven)} combinations of modes at an impact")
        modes, v, impulse = proven[0]
        for j, stated in zip(range(len(options)), event["Lambda_n"], strict=True):
            require(is_stated(impulse.get((j, 0), iv.mpf(0)), stated), "the impulse")
        for j in coupled:  # a contact that was hit leaves, if it can
            leaves = modes[j] == "open" or j == hit and s.contacts[j].e is not ZERO
            self.zeros["impact", j] = 1 if leaves else 2
            self.zeros.pop(("slip_end", j), None)
            if modes[j] == "stick":
                self.zeros["slip_end", j] = 1
        return x[:s.n] + v + x[-1:]


def main():
    code = 0
    for path in sys.argv[1:]:
        begin, checker = time.time(), None
        try:
            checker = Checker(path)
            checker.run()
            print(f"{path}: valid, {checker.step + 1} steps, {len(checker.events)} events, {time.time() - begin:.1f} s")
        except Refused as reason:
            code = code or 1
            print(f"{path}: refused at step {checker.step if checker else -1}: {reason}")
        except (ArithmeticError, LookupError, OSError, TypeError, ValueError) as reason:
            code = 2
            print(f"{path}: cannot be read: {reason!r}")
    return code


if __name__ == "__main__":
    sys.exit(main())
