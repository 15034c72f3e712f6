#!/usr/bin/env python3
"""Checks certificates of proven motions without the program that wrote them: check_certificate.py FILE...

It shares nothing with that program but the format (reference/certified/CERTIFICATES.md). Functions become variables of
their own, s = sin(u): s' = c u', so that all equations are polynomial; sets are moved in mean value form, phi(c) +
DPhi([x]) (x - c); remainders r of f = sum_k c_k t^k + r, |r| <= rho (t/h)^(N+1), follow from Picard's operator. Steps
are divided until it contracts. Checked: scene and hash, start, every step (inclusion, time, no event before its end),
the root of the event function, impacts (every combination of modes), the final state and its decimal numbers. Not
checked: that modes after an event are the only consistent ones. Exit code 1 if a certificate is refused."""
import ast, fractions, hashlib, itertools, json, sys, time
import numpy as np
from mpmath import iv
from mpmath.libmp import from_man_exp, mpf_add, mpf_sub, mpi_add, mpi_mul

sys.setrecursionlimit(100000)
Raw, Wrap = lambda x: iv.convert(x)._mpi_, iv.make_mpf
FUNCTIONS = {"sin": iv.sin, "cos": iv.cos, "exp": iv.exp, "sqrt": iv.sqrt, "log": iv.log, "inv": lambda x: 1 / x}


class Refused(Exception):
    """A statement that is not verified."""


def require(condition, text):
    if not condition:
        raise Refused(text)


def ball(text):
    """Midpoint and radius, two mantissas and exponents of 2, hexadecimal: the exact interval."""
    m, e, r, s = (int(word, 16) for word in text.split())
    middle, radius = from_man_exp(m, e), from_man_exp(r, s)
    return Wrap((mpf_sub(middle, radius), mpf_add(middle, radius)))


def size(x):
    """Upper bound of |x| as a float."""
    return max(abs(float(x.a)), abs(float(x.b))) * (1 + 1e-14) + 1e-300


class System:
    """Nodes: ("c", interval, 0), ("y", kind, argument) for variables, ("+", a, b), ("*", a, b)."""
    def __init__(self):
        self.nodes, self.known = [], {}
        self.zero, self.one = self.const(0), self.const(1)

    def node(self, *key):
        if key not in self.known:
            self.known[key] = len(self.nodes)
            self.nodes.append(key)
        return self.known[key]

    def const(self, x): return self.node("c", Raw(x), 0)
    def value(self, a): return Wrap(self.nodes[a][1]) if self.nodes[a][0] == "c" else None
    def var(self, kind, k): return self.node("y", kind, k)
    def neg(self, a): return self.mul(self.const(-1), a)
    def sub(self, a, b): return self.add(a, self.neg(b))
    def dot(self, a, b): return self.sum(self.mul(x, y) for x, y in zip(a, b))

    def sum(self, terms):
        total = self.zero
        for term in terms:
            total = self.add(total, term)
        return total

    def add(self, a, b):
        if self.zero in (a, b):
            return a + b - self.zero
        x, y = self.value(a), self.value(b)
        return self.const(x + y) if x is not None and y is not None else self.node("+", min(a, b), max(a, b))

    def mul(self, a, b):
        if self.zero in (a, b):
            return self.zero
        if self.one in (a, b):
            return a if b == self.one else b
        x, y = self.value(a), self.value(b)
        if x is not None and y is not None:
            return self.const(x * y)
        return self.node("*", *(sorted((a, b)) if y is None else (b, a)))  # a constant stands first

    def call(self, name, a):
        if name == "tan":
            return self.mul(self.call("sin", a), self.call("inv", self.call("cos", a)))
        require(name in FUNCTIONS, f"{name} is not supported")
        x = self.value(a)
        return self.var(name, a) if x is None else self.const(FUNCTIONS[name](x))

    def slope(self, kind, u):
        """Derivative of a function with respect to its argument."""
        f = self.var(kind, u)
        return {"sin": lambda: self.call("cos", u), "cos": lambda: self.neg(self.call("sin", u)), "exp": lambda: f,
                "inv": lambda: self.neg(self.mul(f, f)), "log": lambda: self.call("inv", u),
                "sqrt": lambda: self.mul(self.const(0.5), self.call("inv", f))}[kind]()

    def diff(self, a, seed, known):
        """Derivative along `seed`, a dictionary from variables to their derivatives."""
        if a not in known:
            op, x, y = self.nodes[a]
            d = lambda z: self.diff(z, seed, known)
            known[a] = (self.zero if op == "c" else self.add(d(x), d(y)) if op == "+" else
                        self.add(self.mul(d(x), y), self.mul(x, d(y))) if op == "*" else
                        self.mul(self.slope(x, y), d(y)) if x in FUNCTIONS else seed.get(a, self.zero))
        return known[a]

    def power(self, base, exponent):
        require(exponent is not None and 2 * exponent.a == int(2 * exponent.a), "a power that is not supported")
        n = int(2 * exponent.a)
        result = self.call("sqrt", base) if n % 2 else self.one
        for _ in range(abs(n) // 2):
            result = self.mul(result, base)
        return self.call("inv", result) if n < 0 else result

    def solve(self, A, b):
        """Gauss's elimination without pivoting."""
        n, A = len(A), [row + [x] for row, x in zip(A, b)]
        inverse = [None] * n
        for i in range(n):
            inverse[i] = self.call("inv", A[i][i])
            for r in range(i + 1, n):
                factor = self.mul(A[r][i], inverse[i])
                A[r] = [self.sub(x, self.mul(factor, y)) for x, y in zip(A[r], A[i])]
        x = [self.zero] * n
        for i in reversed(range(n)):
            x[i] = self.mul(inverse[i], self.sub(A[i][n], self.dot(A[i][i + 1:n], x[i + 1:])))
        return x


class Scene(System):
    """The formulas of a scene file, in Python's syntax. Decimal numbers are exact."""
    def __init__(self, text):
        super().__init__()
        scene = json.loads(text)
        self.scene = scene = scene.get("problem", scene)
        self.n = len(scene["q0"])
        self.names = {key: self.formula(value) for key, value in scene.get("params", {}).items()}
        self.q, self.v = [self.var("q", k) for k in range(self.n)], [self.var("v", k) for k in range(self.n)]
        self.t = self.var("t", 0)
        self.names.update({"q": self.q, "v": self.v, "t": self.t, "pi": self.const(iv.pi)})
        self.names["u"] = [self.formula(x) for x in scene.get("u", [])]
        self.start = [self.value(self.formula(x)) for x in scene["q0"] + scene["v0"]]
        self.T = self.value(self.formula(scene["T"]))
        self.M = [[self.formula(x) for x in row] for row in scene["M"]]
        self.f = [self.formula(x) for x in scene["f"]]
        for k, row in enumerate(scene.get("Bu", [])):
            self.f[k] = self.add(self.f[k], self.dot([self.formula(x) for x in row], self.names["u"]))
        self.contacts = [self.contact(i, c) for i, c in enumerate(scene.get("contacts", []))]

    def formula(self, text):
        tree = ast.parse(str(text), mode="eval").body
        return self.translate(tree, str(text))

    def translate(self, e, text):
        go = lambda x: self.translate(x, text)
        if isinstance(e, ast.Constant):
            number = fractions.Fraction(ast.get_source_segment(text, e))
            return self.const(iv.mpf(number.numerator) / number.denominator)
        if isinstance(e, ast.Name):
            return self.names[e.id]
        if isinstance(e, ast.Subscript):
            return self.names[e.value.id][e.slice.value]
        if isinstance(e, ast.UnaryOp):
            return self.neg(go(e.operand)) if isinstance(e.op, ast.USub) else go(e.operand)
        if isinstance(e, ast.Call):
            return self.call(e.func.id, *map(go, e.args))
        a, b = go(e.left), go(e.right)
        operations = {ast.Add: self.add, ast.Sub: self.sub, ast.Mult: self.mul,
                      ast.Div: lambda x, y: self.mul(x, self.call("inv", y)), ast.Pow: lambda x, y: self.power(x, self.value(y))}
        return operations[type(e.op)](a, b)

    def contact(self, i, c):
        gap, v = self.formula(c["gap"]), self.v
        J = [self.diff(gap, {q: self.one}, {}) for q in self.q]
        mu, e = self.value(self.formula(c.get("mu", 0))), self.value(self.formula(c.get("e", c.get("eps_r", 0))))
        Jt = [[self.formula(x) for x in row] for row in c.get("Jt", [])] if mu != 0 else []
        drives = [self.formula(x) for x in c.get("vt_drive", ["0"] * len(Jt))]
        v_n = self.add(self.dot(J, v), self.diff(gap, {self.t: self.one}, {}))
        return dict(name=c.get("name", f"contact {i}"), gap=gap, J=J, Jt=Jt, mu=mu, e=e, v_n=v_n, both=c.get("bilateral"),
                    v_t=[self.add(self.dot(row, v), drive) for row, drive in zip(Jt, drives)])

    def motion(self, modes):
        """Accelerations and event functions (kind, contact, node); all of them stay positive."""
        n, rows, columns, rates, labels = self.n, [], [], [], []
        for i, (c, mode) in enumerate(zip(self.contacts, modes)):
            if mode == "open":
                continue
            along = [self.zero] * n
            if mode.startswith("slip"):
                speed = self.call("sqrt", self.dot(c["v_t"], c["v_t"])) if mode == "slip" else None
                to = ([self.mul(x, self.call("inv", speed)) for x in c["v_t"]] if speed is not None else
                      [self.const(1 if mode == "slip+" else -1)])
                along = [self.mul(self.const(c["mu"]), self.dot(to, column)) for column in zip(*c["Jt"])]
            parts = [(c["J"], [self.sub(x, y) for x, y in zip(c["J"], along)], c["v_n"], -1)]
            parts += [(row, row, c["v_t"][d], d) for d, row in enumerate(c["Jt"]) if mode == "stick"]
            for row, column, rate, d in parts:
                rows.append(row), columns.append(column), rates.append(rate), labels.append((i, d))
        drift = dict(zip(self.q + [self.t], self.v + [self.one]))
        A = [self.M[r] + [self.neg(c[r]) for c in columns] for r in range(n)] + [row + [self.zero] * len(rows) for row in rows]
        x = self.solve(A, self.f + [self.neg(self.diff(rate, drift, {})) for rate in rates])
        force, events = dict(zip(labels, x[n:])), []
        for i, (c, mode) in enumerate(zip(self.contacts, modes)):
            if mode == "open":
                events.append(("impact", i, c["gap"]))
                continue
            if not c["both"]:
                events.append(("detach", i, force[i, -1]))
            if mode in ("slip+", "slip-"):
                events.append(("slip_end", i, c["v_t"][0] if mode == "slip+" else self.neg(c["v_t"][0])))
            if mode == "slip":
                events.append(("slip_end", i, self.dot(c["v_t"], c["v_t"])))
            if mode == "stick":
                bound, t = self.mul(self.const(c["mu"]), force[i, -1]), [force[i, d] for d in range(len(c["Jt"]))]
                events += ([("slip-", i, self.sub(bound, t[0])), ("slip+", i, self.add(bound, t[0]))] if len(t) == 1 else
                           [("slip", i, self.sub(self.mul(bound, bound), self.dot(t, t)))])
        return x[:n], events


class Motion:
    """The motion in some modes, with its derivatives with respect to the initial state (and time, which comes last)."""
    def __init__(self, scene, modes):
        self.s, n = scene, scene.n
        self.a, self.events = scene.motion(modes)
        self.x, m = scene.q + scene.v + [scene.t], 2 * n + 1
        self.rate = dict(zip(self.x, scene.v + self.a + [scene.one]))
        self.d = [[scene.var("d", (i, j)) for j in range(m)] for i in range(2 * n)]
        self.d.append([scene.one if j == 2 * n else scene.zero for j in range(m)])
        self.varied = dict(self.rate)
        for j in range(m):
            seed, known = {x: self.d[i][j] for i, x in enumerate(self.x)}, {}
            for i in range(2 * n):
                self.varied[self.d[i][j]] = self.d[n + i][j] if i < n else scene.diff(self.a[i - n], seed, known)
        outputs = self.x + [f for _, _, f in self.events]
        self.plain = self.closure(outputs, self.rate)
        self.full = self.closure(outputs + [d for row in self.d for d in row], self.varied)

    def closure(self, outputs, rate):
        """Everything that `outputs` and their rates depend on, ascending."""
        found, todo, known, s = set(), list(outputs), {}, self.s
        flow = {x: self.rate[x] for x in self.x}
        while todo:
            a = todo.pop()
            if a in found:
                continue
            found.add(a)
            op, x, y = s.nodes[a]
            if op in "+*":
                todo += [x, y]
            elif op == "y":
                if a not in rate:
                    rate[a] = s.diff(a, flow, known)
                todo += [rate[a]] + ([y] if x in FUNCTIONS else [])
        return sorted(found)

    def series(self, schedule, rate, start, N):
        """Taylor coefficients 0 to N of the nodes."""
        c, nodes, nil, p = {}, self.s.nodes, Raw(0), iv.prec
        for a in schedule:
            c[a] = [nil] * (N + 2)
        for k in range(N + 1):
            for a in schedule:
                op, x, y = nodes[a]
                if op == "c":
                    c[a][k] = x if k == 0 else nil
                elif op == "y" and k == 0:
                    c[a][0] = start[a] if a in start else Raw(FUNCTIONS[x](Wrap(c[y][0])))
                elif op == "+":
                    c[a][k] = mpi_add(c[x][k], c[y][k], p)
                elif op == "*":
                    u, w = c[x], c[y]
                    total = mpi_mul(u[0], w[k], p)
                    for i in range(1, k + 1 if nodes[x][0] != "c" else 1):
                        total = mpi_add(total, mpi_mul(u[i], w[k - i], p), p)
                    c[a][k] = total
            for a in schedule:
                if nodes[a][0] == "y":
                    c[a][k + 1] = Raw(Wrap(c[rate[a]][k]) / (k + 1))
        return c

    def remainders(self, schedule, rate, c, h, N):
        """Bounds rho of |r| in f = sum c_k t^k + r (t/h)^(N+1), by Picard's operator; None if it does not contract."""
        up, nodes = 1 + 1e-10, self.s.nodes
        alpha = {a: np.array([size(Wrap(x)) * h ** k for k, x in enumerate(c[a][:N + 1])]) for a in schedule}
        tails = {a: np.append(np.cumsum(alpha[a][::-1])[::-1], 0.0) for a in schedule}
        products = {a: up * np.dot(alpha[nodes[a][1]][1:], tails[nodes[a][2]][N:0:-1]) for a in schedule if nodes[a][0] == "*"}
        variables = [a for a in schedule if nodes[a][0] == "y"]
        first = {a: up * h * alpha[rate[a]][N] / (N + 1) for a in variables}
        rho = {a: 2 * first.get(a, 0.0) for a in schedule}
        for _ in range(30):
            for a in schedule:
                op, x, y = nodes[a]
                if op == "+":
                    rho[a] = up * (rho[x] + rho[y])
                elif op == "*":
                    rho[a] = up * (products[a] + tails[x][0] * rho[y] + tails[y][0] * rho[x] + rho[x] * rho[y])
            mapped = {a: up * (first[a] + h * rho[rate[a]] / (N + 2)) for a in variables}
            if all(mapped[a] <= rho[a] for a in variables):
                return rho
            for a in variables:
                rho[a] = max(rho[a], 2 * mapped[a])
            if not max(rho.values()) < 1:
                return None
        return None


def horner(c, t):
    total = Raw(0)
    for x in reversed(c):
        total = mpi_add(mpi_mul(total, t._mpi_, iv.prec), x, iv.prec)
    return Wrap(total)


def slope(c):
    return [Raw(k * Wrap(x)) for k, x in enumerate(c)][1:]


def hull(a, b):
    return iv.mpf([a.a, b.b])


def positive(f, d, rho, begin, end, depth=60):
    """Whether polynomial f, with derivative d and remainder rho, is positive on [begin, end]."""
    I, middle = hull(begin, end), iv.mpf((begin.a + end.b) / 2).mid
    rise = horner(d, I)
    if rise < 0 or rise > 0:
        return bool(horner(f, iv.mpf(end.b) if rise < 0 else iv.mpf(begin.a)) - rho > 0)
    if horner(f, I) - rho > 0 or horner(f, middle) + (I - middle) * rise - rho > 0:
        return True
    return depth > 0 and positive(f, d, rho, begin, middle, depth - 1) and positive(f, d, rho, middle, end, depth - 1)


def first_root(f, d, rho, root):
    """Whether the first root lies in `root`."""
    middle = root.mid
    for k in range(6, 80, 6):
        w = iv.mpf(root.delta.b) * 2 ** k
        begin, end = (middle - w).mid, (middle + w).mid
        fall = horner(d, hull(begin, end))
        if not fall < 0:
            return False
        if horner(f, begin) - rho > 0 and horner(f, end) + rho < 0:
            newton = middle - (horner(f, middle) + iv.mpf([-rho, rho])) / fall
            return newton in root and positive(f, d, rho, iv.mpf(0), begin)
    return False


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
        """The state and time at the end of a step. Steps are divided until Picard's operator contracts."""
        h, end, event = iv.mpf(float.fromhex(step["h"])), ball(step["end"]), self.events.get(k)
        require(end > 0 and end <= 1, "the end of the step")
        duration = h * end
        if k == len(self.c["steps"]) - 1:
            require(event is None, "an event at the end time")
            require((self.s.T - t) / h in end, "the end time")
        else:
            require(event or end.delta == 0, "an end with a radius")
        for parts in (1, 2, 4, 8, 16, 32):
            bounds = [float.fromhex(r) / parts for r in step["rho"]]
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
            box = [c + sum((a * b for a, b in zip(row, rest)), iv.mpf(0)) for c, row in zip(center, D)]
            start = {a: Raw(x) for a, x in zip(motion.x, box)}
            point = motion.series(motion.plain, motion.rate, {a: Raw(x) for a, x in zip(motion.x, center)}, N)
            start.update({motion.d[i][j]: Raw(D[i][j]) for i in range(2 * n) for j in range(2 * n + 1)})
            wide = motion.series(motion.full, motion.varied, start, N)
            rho = motion.remainders(motion.full, motion.varied, wide, h, N)
            small = motion.remainders(motion.plain, motion.rate, point, h, N)
            if not rho or not small or any(small[a] > r for a, r in zip(motion.x, bounds)):
                return None
            for kind, i, f in motion.events:
                self.check_function(kind, i, wide[f], rho[f], h, tau, event if is_last else None, part == 0)
            at = lambda c, r, a: horner(c[a], tau.mid) + iv.mpf([-r[a], r[a]])
            D = [[at(wide, rho, d) if d in wide else s.value(d) for d in row] for row in motion.d]
            center = [at(point, small, a) for a in motion.x]
        moved = [c + sum((a * b for a, b in zip(row, rest)), iv.mpf(0)) for c, row in zip(center, D)]
        rate = [horner(wide[motion.rate[a]], tau) + iv.mpf([-1, 1]) * rho[motion.rate[a]] for a in motion.x]
        return [x + (tau - tau.mid) * r for x, r in zip(moved, rate)][:2 * n]

    def check_function(self, kind, i, c, rho, h, tau, event, is_first):
        """An event function is positive up to the end, or up to its first root, which is that of `event`."""
        skip, name = 0, self.s.contacts[i]["name"]
        if is_first and i in self.touched and 0 in Wrap(c[0]):  # exactly zero for a reason
            if kind == "impact":
                skip = 3 if self.last == ("detach", i) else 1 if Wrap(c[1]) > 0 else 2
            elif kind == "slip_end":
                skip = 2 if self.last == ("stick_to_slip", i) else 1
        f, rho = c[skip:self.N + 1], rho / h ** skip * (1 + 1e-10)
        ends = {"impact": "impact", "detach": "detach", "slip_end": "slip_", "slip+": "stick", "slip-": "stick", "slip": "stick"}
        if event and event["contact"] == name and event["kind"].startswith(ends[kind]) and (
                not kind in ("slip+", "slip-") or event["modes"][i] == kind):
            require(first_root(f, slope(f), rho, tau), f"the root of {kind} of {name}")
        else:
            require(positive(f, slope(f), rho, iv.mpf(0), iv.mpf(tau.b)), f"{kind} of {name} before the end of the step")

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
        """Newton's and Coulomb's law: one combination of modes holds, strictly, and every regular other one is violated."""
        s, contacts, proven = self.s, self.coupled(i), []
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
        product = lambda a, b: sum((p * q for p, q in zip(a, b)), iv.mpf(0))
        M = [[s.const(y) for y in value(row)] for row in s.M]
        solve = lambda A, b: [s.value(y) for y in s.solve(A, [s.const(z) for z in b])]
        Z = [solve(M, column) for column in columns]
        W = [[s.const(product(row, z)) for z in Z] for row in rows]
        unit = lambda k: [-factors[k] if k == r else iv.mpf(0) for r in range(len(rows))]
        K = [solve(W, unit(k)) for k in range(len(rows))]  # impulses = sum_k K[k] rate_k
        impulses = [product([K[k][r] for k in range(len(rows))], rates) for r in range(len(rows))]
        v, L = x[n:], [[product([z[r] for z in Z], K[k]) for k in range(len(rows))] for r in range(n)]
        drift = [rate - product(row, v) for rate, row in zip(rates, rows)]
        P = [[iv.mpf(r == k) + product(L[r], [row[k] for row in rows]) for k in range(n)] for r in range(n)]
        constant = {label: value([self.s.diff(s.contacts[label[0]]["gap"], {s.t: s.one}, {})])[0] if label[1] == 0 else
                    value([s.sub(s.contacts[label[0]]["v_t"][0], s.dot(s.contacts[label[0]]["Jt"][0], s.v))])[0] for label in labels}
        after = [product(P[r], v) + product(L[r], [constant[label] for label in labels]) for r in range(n)]
        jump, force, signs = [product(L[r], rates) for r in range(n)], dict(zip(labels, impulses)), []
        for j, mode in zip(contacts, modes):
            c = s.contacts[j]
            if mode == "open":
                change = product(value(c["J"]), jump)
                signs.append(change + (1 + c["e"]) * value([c["v_n"]])[0] if j == i else change)
                continue
            if not c["both"]:
                signs.append(force[j, 0])
            if mode in ("slip+", "slip-"):
                slip = value([c["v_t"][0]])[0] + product(value(c["Jt"][0]), jump)
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
    failed = False
    for path in sys.argv[1:]:
        begin, checker = time.time(), None
        try:
            checker = Checker(path)
            checker.run()
            print(f"{path}: valid, {checker.step + 1} steps, {len(checker.events)} events, {time.time() - begin:.1f} s")
        except Refused as reason:
            failed = True
            print(f"{path}: refused at step {checker.step if checker else -1}: {reason}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
