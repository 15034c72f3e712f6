#!/usr/bin/env python3
"""Checks certificates of proven motions without the program that wrote them: check_certificate.py FILE...

It shares nothing with that program but the format, see reference/certified/CERTIFICATES.md. Formulas and series are
those of interval_motion.py; sets are moved in mean value form, phi(c) + DPhi([x]) (x - c). Steps are divided until
Picard's operator contracts with remainders as small as those stated. Checked: the scene and its hash, the start, every
step (inclusion, time, no event before its end), the root of the event function, impacts (every combination of modes),
the final state and its decimal numbers. Not checked: that the modes after an event are the only consistent ones, the
hash of the certificate, and readings other than decimal. Exit code 1 if a certificate is refused, 2 if one cannot be
read."""
import hashlib, itertools, json, sys, time

from mpmath import iv
from mpmath.libmp import from_man_exp, mpf_add, mpf_sub

from interval_motion import Motion, Raw, Refused, Scene, Wrap, dot, horner, hull, require, size, slope

sys.setrecursionlimit(100000)


def ball(text):
    """Midpoint and radius, two mantissas and exponents of 2, hexadecimal: the exact interval."""
    m, e, r, s = (int(word, 16) for word in text.split())
    middle, radius = from_man_exp(m, e), from_man_exp(r, s)
    return Wrap((mpf_sub(middle, radius), mpf_add(middle, radius)))


def positive(f, d, rho, begin, end, depth=60):
    """Whether polynomial f, with derivative d and remainder rho, is positive on [begin, end]."""
    I, middle = hull(begin, end), iv.mpf((begin.a + end.b) / 2).mid
    rise = horner(d, I)
    if rise < 0 or rise > 0:
        return bool(horner(f, iv.mpf(end.b) if rise < 0 else iv.mpf(begin.a)) - rho > 0)
    if horner(f, I) - rho > 0 or horner(f, middle) + (I - middle) * rise - rho > 0:
        return True
    return depth > 0 and positive(f, d, rho, begin, middle, depth - 1) and positive(f, d, rho, middle, end, depth - 1)


def first_root(at, f, rho, root, h):
    """Where an interval without root ends, if the first root lies in `root`. at(t) encloses f +- rho more tightly."""
    d = slope(f)
    middle = root.mid
    for k in range(6, 80, 6):
        w = iv.mpf(root.delta.b) * 2 ** k
        begin, end = (middle - w).mid, (middle + w).mid
        fall = horner(d, hull(begin, end))
        if not (begin > 0 and end <= h and fall < 0):
            return None
        if horner(f, begin) - rho > 0 and at(end) < 0:
            return begin if middle - at(middle) / fall in root else None
    return None


class Checker:
    def __init__(self, path):
        with open(path) as file:
            self.c = c = json.load(file)
        require(c["format"] == "ricochet certificate 1" and c["reading"] == "decimal", "format or reading")
        require(hashlib.sha256(c["scene"].encode()).hexdigest() == c["scene_sha256"], "the hash of the scene")
        iv.prec, self.N = c["bits"] + 40, c["order"]
        self.s = Scene(c["scene"])
        self.events = {e["step"]: e for e in c["events"]}
        require(len(self.events) == len(c["events"]), "two events of one step")
        self.last, self.modes = None, None  # event that began the motion, modes of it
        self.step = -1

    def run(self):
        s, c = self.s, self.c
        x, t = list(s.start), iv.mpf(0)
        v = self.values([k["gap"] for k in s.contacts], x, t)
        self.touched = {i for i, gap in enumerate(v) if 0 in gap}
        self.modes = ["closed" if k["both"] else "open" for k in s.contacts]
        if -1 in self.events:
            x = self.jump(self.events[-1], x, t)
        for k, step in enumerate(c["steps"]):
            X, start = [ball(text) for text in step["x"]], ball(step["t"])
            require(t in start, "the time of the next step")
            for i in range(2 * s.n):
                require(x[i] in X[i], f"x[{i}] of the next step")
            self.step = k
            if k == 0 or k - 1 in self.events:
                self.modes = step["modes"]
                motion = Motion(s, self.modes)
            require(step["modes"] == self.modes, "the modes")
            x, t = self.take(motion, step, X, start, k)
        self.finish(x)

    def values(self, nodes, x, t):
        """Nodes at a state."""
        s = self.s
        motion = Motion.__new__(Motion)
        motion.s, motion.x, motion.rate = s, [], {}
        schedule = motion.closure(nodes, dict.fromkeys(range(len(s.nodes)), s.zero))
        start = {a: Raw(y) for a, y in zip(s.q + s.v + [s.t], list(x) + [t])}
        found = motion.series(schedule, dict.fromkeys(schedule, s.zero), start, 0) if schedule else {}
        return [Wrap(found[a][0]) for a in nodes]

    def take(self, motion, step, X, t, k):
        """The state and time at the end of a step, divided until remainders are about as small as those stated."""
        h, end, event = iv.mpf(float.fromhex(step["h"])), ball(step["end"]), self.events.get(k)
        require(end > 0 and end <= 1, "the end of the step")
        duration = h * end
        if k == len(self.c["steps"]) - 1:
            require(event is None, "an event at the end time")
            require((self.s.T - t) / h in end, "the end time")
        else:
            require(event or end.delta == 0, "an end with a radius")
        for parts in (1, 2, 4, 8, 16, 32):
            stated = [float.fromhex(r) for r in step["rho"]]
            bounds = [max(r, 1e-4 * size(x.delta), 1e-6 * max(stated), 1e-250) / parts for r, x in zip(stated, X)]
            result = self.try_parts(motion, X, t, duration, event, parts, bounds)
            if result:
                break
        require(result, "no remainders by Picard's operator")
        self.touched, self.last = set(), None
        x, t = result, t + duration
        if event:
            x = self.jump(event, x, t)
            require(abs(iv.mpf(event["time"]["value"]) - t) <= event["time"]["radius"], "the time of the event")
        return x, t

    def try_parts(self, motion, X, t, duration, event, parts, bounds):
        s, N, n = self.s, self.N, self.s.n
        h = float(duration.mid.a) * (1 + 1e-6) / parts
        whole = X + [t]
        center = [x.mid for x in whole]
        rest = [x - y for x, y in zip(whole, center)]
        D = [[iv.mpf(i == j) for j in range(2 * n + 1)] for i in range(2 * n + 1)]
        for part in range(parts):
            is_last = part == parts - 1
            tau = duration - iv.mpf(h) * part if is_last else iv.mpf(h)
            box = [c + dot(row, rest) for c, row in zip(center, D)]
            start = {a: Raw(x) for a, x in zip(motion.x, box)}
            point = motion.series(motion.plain, motion.rate, {a: Raw(x) for a, x in zip(motion.x, center)}, N)
            start.update({motion.d[i][j]: Raw(D[i][j]) for i in range(2 * n) for j in range(2 * n + 1)})
            ends = [f for kind, i, f in motion.events if is_last and event and self.is_function_of(event, kind, i)]
            gradient = motion.gradient(ends[0]) if ends else []
            full = motion.closure(motion.outputs + gradient, motion.varied) if ends else motion.full
            wide = motion.series(full, motion.varied, start, N)
            rho = motion.remainders(full, motion.varied, wide, h, N)
            small = motion.remainders(motion.plain, motion.rate, point, h, N)
            if not rho or not small or any(small[a] > r for a, r in zip(motion.x, bounds)):
                return None
            require(not (is_last and event) or ends, "the event cannot happen in these modes")
            for kind, i, f in motion.events:
                name, last = f"{kind} of {s.contacts[i]['name']}", iv.mpf(tau.b)
                skip = self.vanishing(kind, i, wide[f]) if part == 0 else 0
                scale = (1 + 1e-10) / h ** skip  # of remainders
                p = wide[f][skip:N + 1]
                if f in ends:
                    bound = scale * (2 * rho[f] + small[f] + sum(rho[g] * size(x) for g, x in zip(gradient, rest)))
                    value = lambda t: (horner(point[f][skip:N + 1], t) + bound * iv.mpf([-1, 1]) +  # mean value form
                                       dot([horner(wide[g][skip:N + 1], t) for g in gradient], rest))
                    last = first_root(value, p, scale * rho[f], tau, h)
                    require(last is not None, f"the root of {name}")
                require(positive(p, slope(p), scale * rho[f], iv.mpf(0), last), f"{name} before the end of the step")
            at = lambda c, r, a: horner(c[a], tau.mid) + iv.mpf([-r[a], r[a]])
            D = [[at(wide, rho, d) if d in wide else s.value(d) for d in row] for row in motion.d]
            center = [at(point, small, a) for a in motion.x]
        moved = [c + dot(row, rest) for c, row in zip(center, D)]
        rate = [horner(wide[motion.rate[a]], tau) + iv.mpf([-1, 1]) * rho[motion.rate[a]] for a in motion.x]
        return [x + (tau - tau.mid) * r for x, r in zip(moved, rate)][:2 * n]

    def is_function_of(self, event, kind, i):
        """Whether an event function ends a step by `event`."""
        kinds = {"impact": "impact", "detach": "detach", "slip_end": "slip_"}
        is_kind = event["kind"].startswith(kinds.get(kind, "stick")) and (kind in kinds or event["modes"][i] == kind)
        return is_kind and event["contact"] == self.s.contacts[i]["name"]

    def vanishing(self, kind, i, c):
        """Leading coefficients of an event function that are exactly zero, of a contact that touches."""
        if i not in self.touched or 0 not in Wrap(c[0]):
            return 0
        if kind == "impact":
            return 3 if self.last == ("detach", i) else 1 if Wrap(c[1]) > 0 else 2
        return (2 if self.last == ("stick_to_slip", i) else 1) if kind == "slip_end" else 0

    def jump(self, event, x, t):
        """The state after an event, and which contacts touch."""
        s = self.s
        i = [c["name"] for c in s.contacts].index(event["contact"])
        self.touched = {j for j, mode in enumerate(self.modes) if mode != "open"} | {i} | self.touched
        self.last = (event["kind"], i)
        if event["kind"] == "impact":
            return self.impact(i, event, x, t)
        require(event["modes"][i] in {"detach": ["open"], "slip_to_stick": ["stick"], "slip_end": ["open"]}.get(
            event["kind"], ["slip+", "slip-"]), "the modes after " + event["kind"])
        return x

    def coupled(self, i):
        """Closed contacts that exchange momentum with contact i, and itself."""
        s, found = self.s, [i]
        pushed = lambda c: {k for row in [c["J"]] + c["Jt"] for k, a in enumerate(row) if a != s.zero}
        reached, before = pushed(s.contacts[i]), None
        while before != (len(reached), len(found)):
            before = (len(reached), len(found))
            reached |= {k for r in reached for k in range(s.n) if s.M[r][k] != s.zero}
            for j, c in enumerate(s.contacts):
                if j not in found and self.modes[j] != "open" and pushed(c) & reached:
                    found.append(j)
                    reached |= pushed(c)
        return found

    def impact(self, i, event, x, t):
        """Newton's and Coulomb's law: one combination of modes holds strictly, every other regular one is violated."""
        s, contacts, proven = self.s, self.coupled(i), []
        require(self.values([s.contacts[i]["v_n"]], x, t)[0] < 0, "the normal velocity before an impact")
        require(all(len(s.contacts[j]["Jt"]) < 2 for j in contacts), "not covered: an impact with friction in space")
        options = [([] if c["both"] else ["open"]) + (["stick", "slip+", "slip-"] if c["Jt"] else ["closed"])
                   for c in (s.contacts[j] for j in contacts)]
        for modes in itertools.product(*options):
            sign, v, impulses = self.combination(i, contacts, modes, x, t)
            require(sign is not None or not all(y.delta < iv.inf for y in v), f"undecided: impact with {modes}")
            if sign:
                proven.append((modes, v, impulses))
        require(len(proven) == 1, f"{len(proven)} combinations of modes at an impact")
        modes, v, impulses = proven[0]
        for j, y in impulses.items():
            stated = event["Lambda_n"][j]
            require(abs(y - iv.mpf(stated["value"])) <= stated["radius"] * (1 + 1e-6), "the impulse")
        for j, mode in zip(contacts, modes):
            leaves = mode == "open" or (j == i and s.contacts[j]["e"] > 0 and not s.contacts[j]["both"])
            require(not leaves or event["modes"][j] == "open", "the modes after an impact")
        return x[:s.n] + v

    def combination(self, i, contacts, modes, x, t):
        """Whether the inequalities of a combination hold (None: undecided), v+ and the impulses."""
        s, n, value = self.s, self.s.n, lambda nodes: self.values(nodes, x, t)
        rows, columns, factors, labels = [], [], [], []
        for j, mode in zip(contacts, modes):
            c = s.contacts[j]
            if mode == "open":
                continue
            J, Jt = value(c["J"]), value(c["Jt"][0]) if c["Jt"] else None
            side = {"slip+": -1, "slip-": 1}.get(mode, 0)
            rows.append(J), labels.append((j, 0)), factors.append(1 + c["e"] if j == i and not c["both"] else iv.mpf(1))
            columns.append([a + side * c["mu"] * b for a, b in zip(J, Jt)] if side else J)
            if mode == "stick":
                rows.append(Jt), columns.append(Jt), labels.append((j, 1)), factors.append(iv.mpf(1))
        rates = [value([s.contacts[j]["v_t"][0] if d else s.contacts[j]["v_n"]])[0] for j, d in labels]
        M = [[s.const(y) for y in value(row)] for row in s.M]
        solve = lambda A, b: [s.value(y) for y in s.solve(A, [s.const(z) for z in b])]
        Z = [solve(M, column) for column in columns]
        W = [[s.const(dot(row, z)) for z in Z] for row in rows]
        unit = lambda k: [-factors[k] if k == r else iv.mpf(0) for r in range(len(rows))]
        K = [solve(W, unit(k)) for k in range(len(rows))]  # impulses = sum_k K[k] rate_k
        impulses = [dot([K[k][r] for k in range(len(rows))], rates) for r in range(len(rows))]
        v, L = x[n:], [[dot([z[r] for z in Z], K[k]) for k in range(len(rows))] for r in range(n)]
        P = [[iv.mpf(r == k) + dot(L[r], [row[k] for row in rows]) for k in range(n)] for r in range(n)]
        drifts = value([s.sub(c["v_t"][0], s.dot(c["Jt"][0], s.v)) if d else s.diff(c["gap"], {s.t: s.one}, {})
                        for c, d in ((s.contacts[j], d) for j, d in labels)])  # rates without J v
        after = [dot(P[r], v) + dot(L[r], drifts) for r in range(n)]
        jump, force, signs = [dot(L[r], rates) for r in range(n)], dict(zip(labels, impulses)), []
        for j, mode in zip(contacts, modes):
            c = s.contacts[j]
            if mode == "open":
                change = dot(value(c["J"]), jump)
                signs.append(change + (1 + c["e"]) * value([c["v_n"]])[0] if j == i else change)
                continue
            if not c["both"]:
                signs.append(force[j, 0])
            if mode in ("slip+", "slip-"):
                slip = value([c["v_t"][0]])[0] + dot(value(c["Jt"][0]), jump)
                signs.append(slip if mode == "slip+" else -slip)
            if mode == "stick":
                signs += [c["mu"] * force[j, 0] - force[j, 1], c["mu"] * force[j, 0] + force[j, 1]]
        sign = False if any(y < 0 for y in signs) else True if all(y > 0 for y in signs) else None
        return sign, after, {j: y for (j, d), y in force.items() if d == 0}

    def finish(self, x):
        end, n = self.c["final"], self.s.n
        require(end["modes"] == self.modes, "the final modes")
        require(max(self.events, default=-1) < len(self.c["steps"]) - 1, "an event after the end")
        for i, text in enumerate(end["x"]):
            X, stated = ball(text), (end["q"] + end["v"])[i]
            require(x[i] in X, f"the final x[{i}]")
            require(abs(X - iv.mpf(stated["value"])) <= stated["radius"] * (1 + 1e-6), f"the decimal number of x[{i}]")


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
        except (OSError, KeyError, IndexError, TypeError, ValueError) as reason:
            code = 2
            print(f"{path}: cannot be read: {reason!r}")
    return code


if __name__ == "__main__":
    sys.exit(main())
