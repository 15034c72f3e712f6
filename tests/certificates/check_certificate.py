#!/usr/bin/env python3
"""Checks certificates of proven motions without the program that wrote them: check_certificate.py FILE...

It shares nothing with that program but the format (reference/certified/CERTIFICATES.md). Functions become variables of
their own, s = sin(u): s' = c u', so that all equations are polynomial; sets are moved in mean value form, phi(c) +
DPhi([x]) (x - c); remainders r of f = sum_k c_k t^k + r, |r| <= rho (t/h)^(N+1), follow from Picard's operator. Steps
are divided until it contracts. Checked: scene and hash, start, every step (inclusion, time, no event before its end),
the root of the event function, impacts (every combination of modes), the final state and its decimal numbers. Not
checked: that modes after an event are the only consistent ones. Exit code 1 if a certificate is refused."""
import ast, fractions, hashlib, itertools, json, sys, time
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
