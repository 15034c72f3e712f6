"""Scenes as polynomial differential equations over Taylor series of intervals, for check_certificate.py.

A function becomes a variable of its own, s = sin(u): s' = c u', so that all equations are polynomial. Remainders r of

    f(t) = sum_{k<=N} c_k t^k + r(t),  |r| <= rho (t/h)^(N+1)

follow from Picard's operator: h (|c_N(f')| h^N / (N+1) + rho(f') / (N+2)) <= rho(f) for every variable. Intervals are
those of mpmath; bounds rho are floats, rounded up by factors."""
import ast, fractions, json

import numpy as np
from mpmath import iv
from mpmath.libmp import mpi_add, mpi_mul

Raw, Wrap = lambda x: iv.convert(x)._mpi_, iv.make_mpf
FUNCTIONS = {"sin": iv.sin, "cos": iv.cos, "exp": iv.exp, "sqrt": iv.sqrt, "log": iv.log, "inv": lambda x: 1 / x}


class Refused(Exception):
    """A statement that is not verified."""


def require(condition, text):
    if not condition:
        raise Refused(text)


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
                      ast.Div: lambda x, y: self.mul(x, self.call("inv", y)),
                      ast.Pow: lambda x, y: self.power(x, self.value(y))}
        return operations[type(e.op)](a, b)

    def contact(self, i, c):
        gap, v = self.formula(c["gap"]), self.v
        J = [self.diff(gap, {q: self.one}, {}) for q in self.q]
        mu, e = self.value(self.formula(c.get("mu", 0))), self.value(self.formula(c.get("e", c.get("eps_r", 0))))
        Jt = [[self.formula(x) for x in row] for row in c.get("Jt", [])] if mu != 0 else []
        drives = [self.formula(x) for x in c.get("vt_drive", ["0"] * len(Jt))]
        v_n = self.add(self.dot(J, v), self.diff(gap, {self.t: self.one}, {}))
        v_t = [self.add(self.dot(row, v), drive) for row, drive in zip(Jt, drives)]
        return dict(name=c.get("name", f"contact {i}"), gap=gap, J=J, Jt=Jt, mu=mu, e=e, v_n=v_n, v_t=v_t,
                    both=c.get("bilateral"))

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
        A = [self.M[r] + [self.neg(c[r]) for c in columns] for r in range(n)]
        A += [row + [self.zero] * len(rows) for row in rows]
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
                if len(t) == 1:
                    events += [("slip-", i, self.sub(bound, t[0])), ("slip+", i, self.add(bound, t[0]))]
                else:
                    events.append(("slip", i, self.sub(self.mul(bound, bound), self.dot(t, t))))
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
        self.seeds = [({x: row[j] for x, row in zip(self.x, self.d)}, {}) for j in range(m)]
        for j in range(m):
            for i in range(2 * n):
                self.varied[self.d[i][j]] = self.d[n + i][j] if i < n else scene.diff(self.a[i - n], *self.seeds[j])
        outputs = self.x + [f for _, _, f in self.events]
        self.plain = self.closure(outputs, self.rate)
        self.outputs = outputs + [d for row in self.d for d in row]
        self.full = self.closure(self.outputs, self.varied)

    def gradient(self, f):
        """Derivatives of a node with respect to the initial state."""
        return [self.s.diff(f, *seed) for seed in self.seeds]

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
        products = {a: up * np.dot(alpha[nodes[a][1]][1:], tails[nodes[a][2]][N:0:-1])
                    for a in schedule if nodes[a][0] == "*"}
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


def dot(a, b):
    return sum((x * y for x, y in zip(a, b)), iv.mpf(0))


def slope(c):
    return [Raw(k * Wrap(x)) for k, x in enumerate(c)][1:]


def hull(a, b):
    return iv.mpf([a.a, b.b])
