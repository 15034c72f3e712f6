"""Semi-implicit Euler steps with Newton's impact law and Coulomb friction: a method of its own process.

ricochet run --problem bouncing_ball --method "external:python3 examples/external/euler.py" --steps 1000
The protocol is methods/external/README.md. A step of length h, with all contacts that touch:

    M v+ = M v + h (f + Bu u) + J_n L_n + J_t L_t,   q+ = q + h v+                   (1)
    0 <= L_n _|_ J_n' v+ + e J_n' v >= 0,   |L_t| <= mu L_n against J_t' v+           (2)

solved by projected Gauss-Seidel sweeps (Moreau 1988). Bilateral constraints B v+ = 0 (without time) are eliminated,

    v <- v - W_B B v,   M^-1 <- (I - W_B B) M^-1,   W_B = M^-1 B' (B M^-1 B')^-1      (3)
"""
import json
import math
import os
import re
import sys
import time

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # threads cost more than matrices of this size
import numpy as np  # noqa: E402

SWEEPS, ROUNDING = 10000, 1e-13
NAMES = {name: getattr(math, name) for name in "sin cos tan asin acos atan atan2 sinh cosh tanh exp log sqrt pi".split()}
NAMES.update(abs=abs, min=min, max=max, sign=lambda x: (x > 0) - (x < 0), choose=lambda c, a, b: a if c else b)


class Formulas:
    """A list of formulas, or of lists of them, as a function of (q, v, t); formulas are Python's but for if()."""

    def __init__(self, formulas, constants):
        text = json.dumps(formulas).replace('"', "")
        self.code = compile(re.sub(r"\bif\(", "choose(", text), "scene", "eval")
        self.names = {**NAMES, **constants}

    def __call__(self, q=(), v=(), t=0.0):
        return np.array(eval(self.code, {**self.names, "q": q, "v": v, "t": t}), dtype=float)


class Scene:
    def __init__(self, document):
        scene = document["problem"]
        constants = {name: float(value) for name, value in scene.get("params", {}).items()}
        read = lambda formulas: Formulas(formulas, constants)
        self.n = n = len(scene["q0"])
        self.M, self.f = read(scene["M"]), read(scene["f"])
        self.Bu, self.u = read(scene.get("Bu", [[0]] * n)), read(scene.get("u", [0]))
        self.contacts = contacts = scene.get("contacts", [])
        self.bilateral = [contact.get("bilateral", False) for contact in contacts]
        self.gap, self.normal = read([c["gap"] for c in contacts]), read([c["Jn"] for c in contacts])
        self.e, self.mu = read([c.get("e", 0) for c in contacts])(), read([c.get("mu", 0) for c in contacts])()
        self.tangents = [read(c["Jt"]) if "Jt" in c else None for c in contacts]
        self.drives = [read(c.get("vt_drive", [0] * len(c.get("Jt", [])))) for c in contacts]

    def rows(self, i, q, t):
        """J_n' and J_t' of a contact, and the part of their rates that is of time alone."""
        step = 1e-6
        rate = (self.gap(q, t=t + step)[i] - self.gap(q, t=t - step)[i]) / (2 * step)
        normal = self.normal(q, t=t)[i]
        if self.tangents[i] is None:
            return normal[None, :], np.array([rate])
        return np.vstack([normal, self.tangents[i](q, t=t)]), np.append(rate, self.drives[i](q, t=t))


def strike(scene, inverse, touching, rows, drives, v, v_free):
    """(1), (2): v+ and the impulses, with (3) as M^-1."""
    Lambda = {i: np.zeros(len(rows[i])) for i in touching}
    W = {i: inverse @ rows[i].T for i in touching}
    v_plus = v_free.copy()
    for _ in range(SWEEPS):
        change = 0.0
        for i in touching:
            G, old = rows[i] @ W[i], Lambda[i]
            new, u = old.copy(), rows[i] @ v_plus + drives[i]
            approach = min(0.0, (rows[i] @ v + drives[i])[0])
            new[0] = max(0.0, old[0] - (u[0] + scene.e[i] * approach) / G[0, 0])
            if len(new) > 1:
                new[1:] -= (u[1:] + G[1:, 0] * (new[0] - old[0])) / max(np.diag(G)[1:])
                size, most = np.linalg.norm(new[1:]), scene.mu[i] * new[0]
                if size > most:
                    new[1:] *= most / size
            dv = W[i] @ (new - old)
            v_plus += dv
            Lambda[i] = new
            change = max(change, np.abs(dv).max())
        if change <= ROUNDING * (1 + np.abs(v_plus).max()):
            break
    return v_plus, Lambda


def solve(scene, question):
    q, v = np.array(question["q0"]), np.array(question["v0"])
    N, T = question["steps"], question["T"]
    h, begin, events, samples = T / N, time.process_time(), [], []
    for k in range(N):
        t = k * h
        M = scene.M(q, t=t)
        force = scene.f(q, v, t) + scene.Bu(q, t=t) @ scene.u(t=t)
        inverse = np.linalg.inv(M)
        v_free = v + h * inverse @ force
        gaps = scene.gap(q + 0.5 * h * v, t=t + 0.5 * h) if scene.contacts else ()
        rows, drives, touching = {}, {}, []
        for i, gap in enumerate(gaps):
            if scene.bilateral[i] or gap <= ROUNDING:
                rows[i], drives[i] = scene.rows(i, q, t)
            if not scene.bilateral[i] and gap <= ROUNDING:
                touching.append(i)
        if any(scene.bilateral):
            B = np.vstack([rows[i] for i, is_bilateral in enumerate(scene.bilateral) if is_bilateral])
            W_B = inverse @ B.T @ np.linalg.inv(B @ inverse @ B.T)
            v_free, inverse = v_free - W_B @ (B @ v_free), inverse - W_B @ (B @ inverse)
        v_plus, Lambda = strike(scene, inverse, touching, rows, drives, v, v_free)
        for i in touching:
            if Lambda[i][0] > 0 and (rows[i] @ v + drives[i])[0] < -2 * h * np.abs(force).max():
                impulses = [Lambda[j][0] if j in Lambda else 0.0 for j in range(len(scene.contacts))]
                events.append({"t": t, "kind": "impact", "contact": i, "q": list(q), "v_minus": list(v),
                               "v_plus": list(v_plus), "Lambda_n": impulses})
        q, v = q + h * v_plus, v_plus
        if question["record"] == "grid":
            samples.append({"t": (k + 1) * h, "q": list(q), "v_minus": list(v), "v_plus": list(v)})
    return {"status": "success", "t": T, "q": list(q), "v": list(v), "seconds": time.process_time() - begin,
            "counters": {"steps": N, "force_evaluations": N}, "events": events, "samples": samples}


scene = None
for line in sys.stdin:
    question = json.loads(line)
    answer = {}
    if question["ask"] == "hello":
        answer = {"ricochet": 1, "title": "semi-implicit Euler with Newton's law, in Python", "source": "Moreau 1988",
                  "order_smooth": 1, "order_impacts": 1,
                  "features": ["friction_2d", "friction_3d", "bilateral", "time"]}
    elif question["ask"] == "scene":
        scene, answer = Scene(question["scene"]), {"ok": True}
    elif question["ask"] == "solve":
        answer = solve(scene, question)
    print(json.dumps({"id": question["id"], **answer}), flush=True)
