"""Scenes as polynomial differential equations over Taylor series of intervals, for check_certificate.py.

A function becomes a variable of its own, s = sin(u): s' = c u', so that all equations are polynomial. Remainders r of

    f(t) = sum_{k<=N} c_k t^k + r(t),  |r| <= rho (t/h)^(N+1)                                                      (1)

follow from Picard's operator: h (|c_N(f')| h^N / (N+1) + rho(f') / (N+2)) <= rho(f) for every variable (2). Intervals
are those of mpmath; bounds rho are floats, rounded up by factors, and by 1e-300 against underflow."""
import ast, fractions, itertools, json, math, operator, types

from mpmath import iv
from mpmath.libmp import mpi_add, mpi_mul

Raw, Wrap = lambda x: iv.convert(x)._mpi_, iv.make_mpf
UP, TINY = 1 + 1e-10, 1e-300
FUNCTIONS = {"sin": iv.sin, "cos": iv.cos, "exp": iv.exp, "sqrt": iv.sqrt, "log": iv.log, "inv": lambda x: 1 / x}


class Refused(Exception):
    """A statement that is not verified."""


def require(condition, text):
    if not condition:
        raise Refused(text)


def size(x):
    """Upper bound of |x| as a float."""
    return max(abs(float(x.a)), abs(float(x.b))) * UP + TINY if not x == 0 else 0.0


def times(x, y):
    """Upper bound of a product of bounds."""
    return x * y * UP + TINY if x and y else 0.0


def dot(a, b):
    return sum((x * y for x, y in zip(a, b)), iv.mpf(0) if a and isinstance(a[0], iv.mpf) else ZERO)


class Node:
    """A formula: ("c", interval), ("+", a, b), ("*", a, b), (function, a), or a variable (kind, index). Equal ones are
    one object, and operands have a smaller index."""
    known = {}

    def __new__(cls, *key):
        if key not in cls.known:
            node = cls.known[key] = super().__new__(cls)
            node.key, node.op, node.index = key, key[0], len(cls.known)
        return cls.known[key]

    def value(self): return Wrap(self.key[1]) if self.op == "c" else None
    def __neg__(self): return const(-1) * self
    def __sub__(self, b): return self + -b
    def __truediv__(self, b): return self * call("inv", b)
    def __add__(self, b): return b if self is ZERO else self if b is ZERO else combine(operator.add, "+", self, b)

    def __mul__(self, b):
        if ZERO in (self, b):
            return ZERO
        return b if self is ONE else self if b is ONE else combine(operator.mul, "*", self, b)


def const(x): return Node("c", Raw(x))


def combine(operation, op, *terms):
    """A sum or product, of which a constant stands first."""
    if all(a.op == "c" for a in terms):
        return const(operation(*[a.value() for a in terms]))
    return Node(op, *sorted(terms, key=lambda a: (a.op != "c", a.index)))


def call(name, a):
    if name == "tan":
        return call("sin", a) / call("cos", a)
    require(name in FUNCTIONS, f"{name} is not supported")
    return Node(name, a) if a.op != "c" else const(FUNCTIONS[name](a.value()))


def power(base, exponent):
    n = int(2 * float(exponent.value().a)) if exponent.op == "c" else 0
    require(exponent is const(n / 2), "not covered: a power")
    result = math.prod([base] * (abs(n) // 2), start=call("sqrt", base) if n % 2 else ONE)
    return ONE / result if n < 0 else result


ZERO, ONE = const(0), const(1)
SLOPES = {"sin": lambda u, f: call("cos", u), "cos": lambda u, f: -call("sin", u), "exp": lambda u, f: f,
          "inv": lambda u, f: -(f * f), "log": lambda u, f: call("inv", u), "sqrt": lambda u, f: const(0.5) / f}
OPERATIONS = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
              ast.Pow: power}


def diff(a, seed, known):
    """Derivative along `seed`, a dictionary from variables to their derivatives; `known` are those of this seed."""
    if a not in known:
        d = lambda z: diff(z, seed, known)
        op, x, y = (*a.key, None)[:3]
        known[a] = (d(x) + d(y) if op == "+" else d(x) * y + x * d(y) if op == "*" else
                    SLOPES[op](x, a) * d(x) if op in FUNCTIONS else seed.get(a, ZERO))
    return known[a]


def solve(A, b):
    """Gauss's elimination without pivoting."""
    A, x = [row + [y] for row, y in zip(A, b)], []
    for i, pivot in enumerate(A):
        for r in range(i + 1, len(A)):
            factor = A[r][i] / pivot[i]
            A[r] = [y - factor * z for y, z in zip(A[r], pivot)]
    for i in reversed(range(len(A))):
        x.insert(0, (A[i][-1] - dot(A[i][i + 1:], x)) / A[i][i])
    return x


def formula(text, names):
    """A formula in Python's syntax. Decimal numbers are exact."""
    def go(e):
        match e:
            case ast.Constant():
                number = fractions.Fraction(ast.get_source_segment(text, e))
                return const(iv.mpf(number.numerator) / number.denominator)
            case ast.Name(id):
                return names[id]
            case ast.Subscript(ast.Name(id), ast.Constant(k)):
                return names[id][k]
            case ast.UnaryOp(ast.USub(), x):
                return -go(x)
            case ast.Call(ast.Name(id), args):
                return call(id, *map(go, args))
            case ast.BinOp(x, op, y):
                return OPERATIONS[type(op)](go(x), go(y))
        raise Refused(f"not covered: {text}")
    return go(ast.parse(text, mode="eval").body)


def with_elements(scene):
    """Friction elements as contacts of one more coordinate each, which their bound presses on a support."""
    elements = scene.get("friction", [])
    n, m = len(scene["q0"]), len(elements)
    wide = lambda rows: [row + [0] * m for row in rows]
    unit = [[0] * (n + k) + [1] + [0] * (m - k - 1) for k in range(m)]
    contacts = [{**c, "Jt": wide(c.get("Jt", []))} for c in scene.get("contacts", [])]
    for k, e in enumerate(elements):
        contacts.append({"name": e.get("name", f"friction {k}"), "gap": f"q[{n + k}]", "mu": 1, "Jt": wide(e["Jt"]),
                         "vt_drive": e.get("vt_drive", [0] * len(e["Jt"])), "stays_closed": True})
    u = len(scene.get("u", []))
    return {**scene, "q0": scene["q0"] + [0] * m, "v0": scene["v0"] + [0] * m, "M": wide(scene["M"]) + unit,
            "f": scene["f"] + [f"-({e['bound']})" for e in elements], "contacts": contacts,
            "Bu": scene.get("Bu", [[]] * n) + [[0] * u] * m}


class Scene:
    def __init__(self, text):
        scene, names = json.loads(text), {}
        scene = with_elements(scene.get("problem", scene))
        read = lambda x: [read(y) for y in x] if isinstance(x, list) else formula(str(x), names)
        self.n = n = len(scene["q0"])
        self.q, self.v, self.t = [Node("q", k) for k in range(n)], [Node("v", k) for k in range(n)], Node("t", 0)
        self.x = self.q + self.v + [self.t]
        names.update({key: read(value) for key, value in scene.get("params", {}).items()})
        self.start = [x.value() for x in read(scene["q0"] + scene["v0"] + [0])]
        self.T = read(scene["T"]).value()
        names.update(q=self.q, v=self.v, t=self.t, pi=const(iv.pi))
        names["u"], self.M = read(scene.get("u", [])), read(scene["M"])
        self.f = [f + dot(row, names["u"]) for f, row in zip(read(scene["f"]), read(scene["Bu"]))]
        self.contacts = [self.contact(i, c, read) for i, c in enumerate(scene["contacts"])]

    def contact(self, i, c, read):
        """Of v_n and v_t, the part that does not depend on v is `drift`; `modes` are the possible ones."""
        gap, mu, both = read(c["gap"]), read(c.get("mu", 0)), c.get("bilateral")
        J, Jt = [diff(gap, {q: ONE}, {}) for q in self.q], read(c.get("Jt", [])) if mu is not ZERO else []
        drift = [diff(gap, {self.t: ONE}, {})] + read(c.get("vt_drive", [0] * len(Jt)))
        rates = [dot(row, self.v) + d for row, d in zip([J] + Jt, drift)]
        return types.SimpleNamespace(
            name=c.get("name", f"contact {i}"), gap=gap, J=J, Jt=Jt, drift=drift, v_n=rates[0], v_t=rates[1:], mu=mu,
            both=both, e=ZERO if both else read(c.get("e", c.get("eps_r", 0))),
            modes=[[], ["open"]][not both and not c.get("stays_closed")] + [["closed"], ["stick", "slip+", "slip-"], ["stick", "slip"]][len(Jt)])

    def rows(self, modes):
        """(contact, 0 or 1 + the tangential direction), row, column of the force, drift of all constraints."""
        for i, (c, mode) in enumerate(zip(self.contacts, modes)):
            if mode == "open":
                continue
            along = [ZERO] * self.n
            if mode.startswith("slip"):
                speed = call("sqrt", dot(c.v_t, c.v_t)) if mode == "slip" else None
                to = [x / speed for x in c.v_t] if speed else [const(1 if mode == "slip+" else -1)]
                along = [c.mu * dot(to, column) for column in zip(*c.Jt)]
            yield (i, 0), c.J, [x - y for x, y in zip(c.J, along)], c.drift[0]
            if mode == "stick":
                yield from (((i, 1 + d), row, row, c.drift[1 + d]) for d, row in enumerate(c.Jt))

    def eliminate(self, rows, f, rates):
        """a and lambda of M a = f + sum_k column_k lambda_k, row_k a = rate_k."""
        A = [self.M[r] + [-column[r] for _, _, column, _ in rows] for r in range(self.n)]
        x = solve(A + [row + [ZERO] * len(rows) for _, row, _, _ in rows], f + rates)
        return x[:self.n], dict(zip([label for label, _, _, _ in rows], x[self.n:]))

    def inequalities(self, modes, force, gap, v_t):
        """(kind, contact, node) of everything that is positive in these modes."""
        for i, (c, mode) in enumerate(zip(self.contacts, modes)):
            if mode == "open":
                yield "impact", i, gap[i]
                continue
            if not c.both or c.Jt:
                yield "detach", i, force[i, 0]
            if mode.startswith("slip"):
                yield "slip_end", i, {"slip+": v_t[i][0], "slip-": -v_t[i][0]}.get(mode) or dot(v_t[i], v_t[i])
            if mode == "stick":
                bound, t = c.mu * force[i, 0], [force[i, 1 + d] for d in range(len(c.Jt))]
                yield from ((("slip-", i, bound - t[0]), ("slip+", i, bound + t[0])) if len(t) == 1 else
                            (("slip", i, bound * bound - dot(t, t)),))

    def impact(self, hit, modes):
        """Velocities after an impact of contact `hit`, impulses, and what is positive."""
        rows, contacts = list(self.rows(modes)), self.contacts
        rates = [-d - (contacts[i].e * contacts[i].v_n if (i, k) == (hit, 0) else ZERO) for (i, k), _, _, d in rows]
        v, impulse = self.eliminate(rows, [dot(row, self.v) for row in self.M], rates)
        jump = [x - y for x, y in zip(v, self.v)]
        gap = [dot(c.J, jump) + ((ONE + c.e) * c.v_n if i == hit else ZERO) for i, c in enumerate(contacts)]
        v_t = [[dot(row, v) + d for row, d in zip(c.Jt, c.drift[1:])] for c in contacts]
        return v, impulse, self.inequalities(modes, impulse, gap, v_t)

    def enclose(self, nodes, x):
        """Nodes at a state and time: f(c) + f'([x]) (x - c)."""
        center, known = [y.mid for y in x], [{} for _ in x]
        slopes = [diff(a, {y: ONE}, k) for a in nodes for y, k in zip(self.x, known)]
        at = lambda nodes, x: series(closure(nodes), {}, dict(zip(self.x, map(Raw, x))), 0)
        value, slope, rest = at(nodes, center), at(slopes, x), [y - c for y, c in zip(x, center)]
        return [Wrap(value[a][0]) + dot([Wrap(slope[d][0]) for d in slopes[k * len(x):(k + 1) * len(x)]], rest)
                for k, a in enumerate(nodes)]


class Motion:
    """The motion in some modes, and derivatives d_ij of x_i with respect to the initial x_j; the last x is the time."""
    def __init__(self, s, modes):
        rows, drift = list(s.rows(modes)), dict(zip(s.q + [s.t], s.v + [ONE]))
        rates = [-diff(dot(row, s.v) + d, drift, {}) for _, row, _, d in rows]
        a, force = s.eliminate(rows, s.f, rates)
        gaps, slips = [c.gap for c in s.contacts], [c.v_t for c in s.contacts]
        self.events = list(s.inequalities(modes, force, gaps, slips))
        self.rate, m = dict(zip(s.x, s.v + a + [ONE])), range(len(s.x))
        self.d = [[Node("d", i, j) for j in m] for i in m]
        self.seeds = [({x: row[j] for x, row in zip(s.x, self.d)}, {}) for j in m]
        self.varied = self.rate | {d: diff(self.rate[x], *seed)
                                   for x, row in zip(s.x, self.d) for d, seed in zip(row, self.seeds)}
        outputs = s.x + [f for _, _, f in self.events]
        self.plain = closure(outputs, self.rate)
        self.full = closure(outputs + sum(self.d, []), self.varied)

    def gradient(self, f):
        """Derivatives of a node with respect to the time and the initial state, and a schedule that has them."""
        nodes = [diff(f, self.rate, {})] + [diff(f, *seed) for seed in self.seeds]
        return nodes, closure(self.full + nodes, self.varied)


def closure(outputs, rate=None):
    """Everything that `outputs` depend on, in order; with `rate`, which is completed, also what their rates need."""
    found, todo, known = set(), list(outputs), {}
    while todo:
        a = todo.pop()
        if a in found:
            continue
        found.add(a)
        todo += [b for b in a.key[1:] if isinstance(b, Node)]
        if rate is not None and a.op not in "+*c":
            rate[a] = rate[a] if a in rate else diff(a, rate, known)
            todo.append(rate[a])
    return sorted(found, key=lambda a: a.index)


def series(schedule, rate, start, N):
    """Taylor coefficients 0 to N of the nodes."""
    nil, p = Raw(0), iv.prec
    c = {a: [nil] * (N + 1) for a in schedule}
    for k in range(N + 1):
        for a in schedule:
            op, x, y = (*a.key, None)[:3]
            if op == "c":
                c[a][k] = x if k == 0 else nil
            elif op == "+":
                c[a][k] = mpi_add(c[x][k], c[y][k], p)
            elif op == "*":
                u, w = c[x], c[y]
                total = mpi_mul(u[0], w[k], p)
                for i in range(1, k + 1 if x.op != "c" else 1):
                    total = mpi_add(total, mpi_mul(u[i], w[k - i]), p)
                c[a][k] = total
            elif k > 0:
                c[a][k] = Raw(Wrap(c[rate[a]][k - 1]) / k)
            else:
                c[a][0] = start[a] if a in start else Raw(FUNCTIONS[op](Wrap(c[x][0])))
    return c


def remainders(schedule, rate, c, h, N):
    """Bounds rho of (1) by (2)."""
    powers = [iv.mpf(h) ** k for k in range(N + 1)]
    alpha = {a: [size(Wrap(x) * y) for x, y in zip(c[a], powers)] for a in schedule}
    tails = {a: list(itertools.accumulate(reversed(alpha[a]))) for a in schedule}  # sums of the last coefficients
    products = {a: sum(map(times, alpha[a.key[1]][1:], tails[a.key[2]])) for a in schedule if a.op == "*"}
    first = {a: times(h / (N + 1), alpha[rate[a]][N]) for a in schedule if a.op not in "+*c"}
    rho = {a: 2 * first.get(a, 0.0) for a in schedule}
    for _ in range(30):
        for a in schedule:
            if a.op in "+*":
                x, y = a.key[1:]
                rho[a] = UP * (rho[x] + rho[y] if a.op == "+" else products[a] + times(tails[x][N], rho[y]) +
                               times(tails[y][N] + rho[y], rho[x]))
        mapped = {a: UP * (y + times(h / (N + 2), rho[rate[a]])) for a, y in first.items()}
        if all(y <= rho[a] for a, y in mapped.items()):
            return rho
        rho.update({a: max(rho[a], 2 * y) for a, y in mapped.items()})
    raise Refused("Picard's operator does not contract")
