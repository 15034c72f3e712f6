#!/usr/bin/env python3
"""Ground truth of scenes that move by themselves: reference/data/moving_scenes.json.

Between events every motion here has a closed form: fall with drag, rest on a table y = A sin(omega t), slip of a damped
oscillator with constant friction, stick on a belt whose velocity is v_belt + v_swing sin(Omega t). Events are roots of
closed forms, found by a scan for the first change of sign and by a bracketed iteration in 60 digits. Derivatives are
central differences of the whole solution. Nothing of Ricochet is used. Every phase is integrated a second time as an
ordinary differential equation, by mpmath's Taylor series, which knows no closed form.

    python3 tests/tools/moving_scenes.py > reference/data/moving_scenes.json        (Debian: python3-mpmath; a minute)
"""

import json
import sys

from mpmath import mp, mpf, cos, exp, findroot, nstr, odefun, sin, sqrt

mp.dps = 60
SCAN = 400  # samples per period of the fastest oscillation
CLEAR = mpf("1e-4")  # an event function that turns around nearer to zero than this leaves the order of events in doubt


def first_root(f, begin, end, step, skip):
    """The first t in (begin, end] where f falls through zero; f(begin) may be zero itself, and `skip` is left out."""
    t, before, slope_before = begin + skip, f(begin + skip), None
    if before <= 0:
        raise RuntimeError("no clear begin of a phase at t = " + nstr(begin, 10))
    while t < end:
        after = min(t + step, end)
        value = f(after)
        if value <= 0:
            return findroot(f, (t, after), solver="anderson", tol=mpf(10) ** (-2 * mp.dps + 20), maxsteps=400)
        slope = value - before
        if slope_before is not None and slope_before < 0 < slope and before < CLEAR:
            raise RuntimeError("grazing at t = " + nstr(t, 10))
        slope_before = slope
        t, before = after, value
    return None


class Trajectory:
    """Events, phases and the final state of a run."""

    def __init__(self):
        self.events, self.phases = [], []

    def event(self, t, kind, contact, q, v_before, v_after, before, after, impulse=None):
        entry = {"t": t, "contact": contact, "q": q, "v_before": v_before, "kind": kind, "v_after": v_after,
                 "modes_before": [before], "modes_after": [after]}
        if impulse is not None:
            entry.update({"Ln": {contact: impulse}, "Lt": {}})
        self.events.append(entry)

    def phase(self, begin, end, state, right_hand_side, at_end):
        self.phases.append((begin, end, state, right_hand_side, at_end))


def table(p):
    """A ball with linear drag on a table y = A sin(omega t): q = y of the ball."""
    m, g, c, e, A, w, T = (p[k] for k in ("m", "g", "c", "e", "A", "omega", "T"))
    surface, speed = lambda t: A * sin(w * t), lambda t: A * w * cos(w * t)
    push = lambda t: m * (g - A * w * w * sin(w * t)) + c * speed(t)
    drag, sink = c / m, m * g / c
    step = 2 * mp.pi / w / SCAN
    run, t, y, v = Trajectory(), mpf(0), p["y0"], p["v0"]
    rests = p["rests"]
    run.initial_modes = ["free" if rests else "open"]
    while t < T:
        if rests:
            end = first_root(push, t, T, step, mpf(0))
            y_end, v_end = surface(end or T), speed(end or T)
            run.phase(t, end or T, [y, v], lambda s, x: [x[1], -A * w * w * sin(w * s)], [y_end, v_end])
            t, y, v = end or T, y_end, v_end
            if end is None:
                break
            run.event(t, "detach", "table", [y], [v], [v], "free", "open")
            rests = False
            continue
        t0, y0, v0 = t, y, v
        flight = lambda s: y0 + (v0 + sink) * (1 - exp(-drag * (s - t0))) / drag - sink * (s - t0)
        # Behind a detachment the gap grows like the cube of time: its first thousandth of a period is no event.
        end = first_root(lambda s: flight(s) - surface(s), t0, T, step, 0 if y0 > surface(t0) + CLEAR else 10 * step)
        stop = end or T
        y, v, t = flight(stop), (v0 + sink) * exp(-drag * (stop - t0)) - sink, stop
        run.phase(t0, stop, [y0, v0], lambda s, x: [x[1], -g - drag * x[1]], [y, v])
        if end is None:
            break
        u = speed(t)
        after = u - e * (v - u)
        rests = e == 0 and push(t) > 0
        if e == 0 and not rests:
            raise RuntimeError("a landing without rest")
        run.event(t, "impact", "table", [y], [v], [after], "open", "free" if rests else "open", m * (after - v))
        v = after
    run.final = ([y], [v], ["free" if rests else "open"])
    return run


def belt(p):
    """A block on a spring and a damper, on a belt: q = (x, y), y = 0."""
    m, g, k, c, mu, T = (p[n] for n in ("m", "g", "k", "c", "mu", "T"))
    v_b, v_s, w = p["v_belt"], p["v_swing"], p["Omega"]
    belt_v, belt_a = lambda t: v_b + v_s * sin(w * t), lambda t: v_s * w * cos(w * t)
    belt_x = lambda t: v_b * t - v_s / w * cos(w * t)
    damping, cone = c / (2 * m), mu * m * g
    omega = sqrt(k / m - damping ** 2)
    step = 2 * mp.pi / max(w, omega) / SCAN
    run, t, x, v = Trajectory(), mpf(0), p["x0"], p["u0"]
    mode = "slip+" if v > belt_v(t) else "slip-"
    run.initial_modes = [mode]
    wanted = lambda s, at: m * belt_a(s) + c * belt_v(s) + k * at  # friction that keeps the block on the belt
    while t < T:
        t0, x0, v0 = t, x, v
        before = mode
        if mode == "stick":
            at = lambda s: x0 + belt_x(s) - belt_x(t0)
            end = first_root(lambda s: cone - abs(wanted(s, at(s))), t0, T, step, mpf(0))
            stop = end or T
            x, v, t = at(stop), belt_v(stop), stop
            run.phase(t0, stop, [x0, v0], lambda s, y: [y[1], belt_a(s)], [x, v])
            if end is None:
                break
            # A force that holds back is exceeded: the block stays behind the belt.
            mode, kind = ("slip-" if wanted(t, x) > 0 else "slip+"), "stick_to_slip"
        else:
            sign = 1 if mode == "slip+" else -1
            center = -sign * cone / k
            a, b = x0 - center, (v0 + damping * (x0 - center)) / omega
            at = lambda s: center + exp(-damping * (s - t0)) * (a * cos(omega * (s - t0)) + b * sin(omega * (s - t0)))
            rate = lambda s: exp(-damping * (s - t0)) * ((b * omega - damping * a) * cos(omega * (s - t0))
                                                         - (a * omega + damping * b) * sin(omega * (s - t0)))
            # Slip begins with zero acceleration behind stick, with some behind a reversal.
            skip = mpf(0) if abs(v0 - belt_v(t0)) > CLEAR else 10 * step
            end = first_root(lambda s: sign * (rate(s) - belt_v(s)), t0, T, step, skip)
            stop = end or T
            x, v, t = at(stop), rate(stop), stop
            run.phase(t0, stop, [x0, v0],
                      lambda s, y, sign=sign: [y[1], (-k * y[0] - c * y[1] - sign * cone) / m], [x, v])
            if end is None:
                break
            needed = wanted(t, x)
            if abs(abs(needed) - cone) < CLEAR:
                raise RuntimeError("stick or slip is doubtful at t = " + nstr(t, 10))
            if abs(needed) < cone:
                mode, kind = "stick", "slip_to_stick"
            else:
                mode, kind = ("slip-" if needed > 0 else "slip+"), "slip_reversal"
        run.event(t, kind, "belt", [x, mpf(0)], [v, mpf(0)], [v, mpf(0)], before, mode)
    run.final = ([x, mpf(0)], [v, mpf(0)], [mode])
    return run


TABLE = {"contacts": [{"name": "table", "gap": "q[0]-A*sin(omega*t)", "e": "e"}], "M": [["m"]], "f": ["-m*g-c*v[0]"],
         "T": "T"}
BELT = {"q0": ["x0", "0"], "v0": ["u0", "0"], "T": "T", "M": [["m", "0"], ["0", "m"]],
        "f": ["-k*q[0]-c*v[0]", "-m*g"],
        "contacts": [{"name": "belt", "gap": "q[1]", "mu": "mu", "Jt": [["1", "0"]],
                      "vt_drive": ["-v_belt-v_swing*sin(Omega*t)"]}]}

CASES = [
    {"id": "shaken_table_bounces", "title": "ball that bounces on a shaken table, e = 0.8", "solve": table,
     "params": {"m": "1", "g": "9.81", "c": "0.5", "e": "0.8", "A": "0.02", "omega": "25", "y0": "0.2", "v0": "0",
                "T": "1.9"},
     "scene": dict(TABLE, q0=["y0"], v0=["v0"]), "rests": False,
     "wrt": ["q0:0", "v0:0", "param:e", "param:A", "param:omega", "param:g", "param:c"]},
    {"id": "shaken_table_throws", "title": "ball that a shaken table throws off and catches, e = 0", "solve": table,
     "params": {"m": "1", "g": "9.81", "c": "0.5", "e": "0", "A": "0.03", "omega": "25", "T": "0.7"},
     "scene": dict(TABLE, q0=["0"], v0=["A*omega"]), "rests": True,
     "wrt": ["param:A", "param:omega", "param:g", "param:c"]},
    {"id": "belt_of_varying_speed", "title": "block on a spring, on a belt whose speed varies: stick, slip, reversal",
     "solve": belt,
     "params": {"m": "1", "g": "9.81", "k": "20", "c": "0.5", "mu": "0.3", "v_belt": "0.2", "v_swing": "0.8",
                "Omega": "8", "x0": "0", "u0": "0", "T": "1.8"},
     "scene": BELT, "rests": False,
     "wrt": ["q0:0", "v0:0", "param:mu", "param:k", "param:c", "param:v_belt", "param:v_swing", "param:Omega"]},
]


def numbers(case, changes=None):
    p = {name: mpf(value) for name, value in case["params"].items()}
    p["rests"] = case["rests"]
    for name, change in (changes or {}).items():
        p[name] += change
    if case["rests"]:
        p["y0"], p["v0"] = mpf(0), p["A"] * p["omega"]
    return p


def parameter(case, wrt):
    """The parameter that a variable q0:0, v0:0 or param:NAME is."""
    kind, name = wrt.split(":")
    return name if kind == "param" else case["scene"][kind][int(name)]


def sensitivity(case, wrt, here):
    name = parameter(case, wrt)
    columns = []
    for h in (mpf("1e-16"), mpf("3e-16")):
        ahead, behind = (case["solve"](numbers(case, {name: s * h})) for s in (1, -1))
        assert len(ahead.events) == len(behind.events) == len(here.events)
        slope = lambda f: [(a - b) / (2 * h) for a, b in zip(f(ahead), f(behind))]
        columns.append((slope(lambda r: r.final[0]), slope(lambda r: r.final[1]),
                        slope(lambda r: [e["t"] for e in r.events])))
    largest = max(abs(a - b) / (1 + abs(a)) for one, two in zip(*columns) for a, b in zip(one, two))
    digits = int(-mp.log10(largest)) - 1
    texts = lambda values: [nstr(x, digits) for x in values]
    return {"wrt": wrt, "dq": texts(columns[0][0]), "dv": texts(columns[0][1]), "dt_events": texts(columns[0][2]),
            "certified_decimals": digits, "how": "central differences, steps 1e-16 and 3e-16"}


def text(value):
    if isinstance(value, mpf):
        return nstr(value, 45)
    if isinstance(value, list):
        return [text(x) for x in value]
    if isinstance(value, dict):
        return {key: text(x) for key, x in value.items()}
    return value


def difference(one, two):
    pairs = list(zip(one.final[0] + one.final[1] + [e["t"] for e in one.events],
                     two.final[0] + two.final[1] + [e["t"] for e in two.events]))
    return max(abs(a - b) for a, b in pairs)


def certify(case, run):
    """Digits that a run in 90 digits leaves, and the phases integrated by Taylor series in 34 digits."""
    mp.dps = 90
    finer = case["solve"](numbers(case))
    mp.dps = 60
    assert len(finer.events) == len(run.events)
    by_precision, by_series = difference(run, finer), mpf(0)
    mp.dps = 34
    for begin, end, state, right_hand_side, at_end in run.phases:
        reached = odefun(right_hand_side, begin, state)(end)
        by_series = max([by_series] + [abs(a - b) for a, b in zip(reached, at_end)])
    mp.dps = 60
    print(case["id"], "events", len(run.events), "digits", nstr(by_precision, 3), nstr(by_series, 3), file=sys.stderr)
    for event in run.events:
        print("  ", nstr(event["t"], 12), event["kind"], event["modes_after"], file=sys.stderr)
    return by_precision, by_series


def solve(case):
    run = case["solve"](numbers(case))
    by_precision, by_series = certify(case, run)
    assert by_precision < mpf("1e-48") and by_series < mpf("1e-26")
    q, v, modes = run.final
    return {
        "id": case["id"], "title": case["title"],
        "problem": dict({"params": case["params"]}, **case["scene"]),
        "initial_modes": run.initial_modes, "n_events": len(run.events), "events": text(run.events),
        "final": {"t": case["params"]["T"], "q": text(q), "v": text(v), "modes": modes},
        "sensitivities": [sensitivity(case, wrt, run) for wrt in case["wrt"]],
        "certified_decimals": 42,
        "method": "closed forms between events, event times by bracketed root finding in 60 digits",
        "verification": [{"method": "the same in 90 digits", "d_final": nstr(by_precision, 3)},
                         {"method": "every phase by mpmath's Taylor series, 34 digits", "d_final": nstr(by_series, 3)}],
    }


print(json.dumps({
    "set": "scenes that move by themselves, made by tests/tools/moving_scenes.py", "format": 1,
    "conventions": ["as in ground_truth.json; t is the time, and vt_drive is added to Jt v",
                    "states are those of the bodies, without the clock"],
    "cases": [solve(case) for case in CASES]}, indent=1))
