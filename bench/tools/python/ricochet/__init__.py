"""Ricochet from Python: runs as numpy arrays, results files as pandas frames.

A thin module over the program `ricochet`, which it finds in RICOCHET_PROGRAM or on the PATH. Units are those of the SI.

    import ricochet
    run = ricochet.run("two_balls_spring", "fesd:gauss:4", steps=50)
    run.t, run.q, run.error, [event.t for event in run.events]
    frame = ricochet.results("out/results/two_balls_order.jsonl")
    truth = ricochet.truth("rocking_block", digits=40)
    truth.grade, truth.q_text, truth.events[0].t_text
    plan = ricochet.control("two_carts", method="shooting", explore=12)
    plan.u, plan.cost, plan.stationarity
"""
from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Mapping, Sequence

import numpy as np

if TYPE_CHECKING:
    import pandas

__all__ = ["Control", "Event", "Run", "RicochetError", "Truth", "TruthEvent", "control", "motion", "program", "results", "run",
           "truth"]


class RicochetError(RuntimeError):
    """The program refused its input: its message. A run that failed is a Run with a status and a message instead."""


@dataclass(frozen=True)
class Event:
    """A change of the active set. Left and right velocities differ at an impact only."""

    t: float
    kind: str
    contact: int
    name: str
    q: np.ndarray
    v_minus: np.ndarray
    v_plus: np.ndarray
    Lambda_n: np.ndarray
    Lambda_t: np.ndarray


@dataclass(frozen=True)
class Run:
    """A run, as `ricochet run --json` prints it (`ricochet schema run`); `document` has all of it."""

    status: str
    message: str
    t: float
    q: np.ndarray
    v: np.ndarray
    error: float | None  #: of the final state, max-norm, where there is a reference
    seconds: float
    counters: Mapping[str, int]
    events: Sequence[Event]
    dq: np.ndarray  #: n_q x sensitivities
    dv: np.ndarray
    document: Mapping[str, Any] = field(repr=False)

    @property
    def succeeded(self) -> bool:
        return self.status == "success"


@dataclass(frozen=True)
class TruthEvent:
    """A proven event, within `t_radius` [s] of the decimal number `t_text`; `t` is the float next to it."""

    t: float
    t_text: str
    t_radius: float
    kind: str  #: impact, detach, slip_to_stick, stick_to_slip, slip_reversal, slip_end, zeno_end or border
    name: str  #: of the contact; of a border its formula
    modes: Sequence[str]  #: of all contacts after it
    Lambda_n: np.ndarray  #: impulses of all contacts of an impact [N s], as floats; else empty
    grade: str  #: of the motion up to here


@dataclass(frozen=True)
class Truth:
    """A motion with proven digits, as `ricochet truth --json` prints it; `document` has all of it.

    Every component is within its radius of its decimal number: |q[k] - q_text[k]| <= q_radius[k]. `q` and `v` are the
    floats next to these numbers, with n entries each; none if the motion is open.
    """

    grade: str  #: proven, assumed (relies on `assumptions`) or open (undecided, for the `reason`)
    reason: str
    assumptions: Sequence[str]
    decimals: int | None  #: proven decimal places of the worst number; None if open
    t: float  #: end time, or where an open motion stopped
    q: np.ndarray
    v: np.ndarray
    q_text: Sequence[str]
    v_text: Sequence[str]
    q_radius: np.ndarray
    v_radius: np.ndarray
    events: Sequence[TruthEvent]  #: if the motion is open, those before it stopped
    seconds: float
    document: Mapping[str, Any] = field(repr=False)

    @property
    def is_open(self) -> bool:
        return self.grade == "open"


@dataclass(frozen=True)
class Control:
    """A solution of an optimal control problem, as `ricochet control --json` prints it; `document` has all of it.

    Its arrays are empty unless it succeeded. Solutions are local.
    """

    status: str
    message: str
    cost: float
    stationarity: str  #: the certificate: "B, 2 active guards, LPEC 3e-12"
    T: float
    u: np.ndarray  #: N x n_u, of intervals of the length T / N
    t: np.ndarray  #: instants of the planned motion, twice where a velocity jumps
    q: np.ndarray  #: instants x n_q
    v: np.ndarray
    true_cost: float  #: of the plant under u; NaN without a replay
    replay_error: float  #: largest difference of (q, v) at T between plan and plant; NaN without a replay
    iterations: int
    seconds: float
    document: Mapping[str, Any] = field(repr=False)

    @property
    def succeeded(self) -> bool:
        return self.status == "success"


def program() -> str:
    """The program's path. Raises RicochetError where there is none."""
    found = os.environ.get("RICOCHET_PROGRAM") or shutil.which("ricochet")
    if not found:
        raise RicochetError("the program ricochet is not on the PATH; RICOCHET_PROGRAM may name it")
    return found


def _call(words: Sequence[str]) -> str:
    done = subprocess.run([program(), *words], capture_output=True, text=True, check=False)
    if done.returncode == 2 or (done.returncode != 0 and not done.stdout):
        raise RicochetError(done.stderr.strip())
    return done.stdout


def _scene_words(scene: str | Path | Mapping[str, Any], parameters: Mapping[str, float] | None,
                 folder: str) -> list[str]:
    words = []
    if isinstance(scene, Mapping):
        path = Path(folder) / "scene.json"
        path.write_text(json.dumps(scene))
        words += ["--scene", str(path)]
    else:
        text = str(scene)
        words += ["--scene" if isinstance(scene, Path) or ".json" in text else "--problem", text]
    for name, value in (parameters or {}).items():
        words += ["--set", f"{name}={value!r}"]
    return words


def _words(scene: str | Path | Mapping[str, Any], method: str, steps: int | None, tolerance: float | None,
           parameters: Mapping[str, float] | None, folder: str) -> list[str]:
    words = ["--method", method, *_scene_words(scene, parameters, folder)]
    if steps is not None:
        words += ["--steps", str(steps)]
    if tolerance is not None:
        words += ["--tolerance", repr(tolerance)]
    return words


def _array(values: Sequence[Any] | None) -> np.ndarray:
    return np.array([np.nan if x is None else x for x in values or []], dtype=float)


def run(scene: str | Path | Mapping[str, Any], method: str, steps: int | None = None, tolerance: float | None = None, *,
        parameters: Mapping[str, float] | None = None, sensitivities: Sequence[str] = (), time_limit: float | None = None,
        reference: bool = True) -> Run:
    """One method on one scene: the id of a problem, a scene file, or a scene as a dictionary.

    `steps` of a fixed-step method, or the relative `tolerance` of an error-controlled one; `sensitivities` are derivatives
    by "q0:0", "v0:0" or "param:NAME"; without `reference` there is no error.
    Raises RicochetError for input that the program refuses.
    """
    with tempfile.TemporaryDirectory() as folder:
        words = ["run", "--json", *_words(scene, method, steps, tolerance, parameters, folder)]
        for name in sensitivities:
            words += ["--sensitivity", name]
        if time_limit is not None:
            words += ["--time-limit", repr(time_limit)]
        if not reference:
            words.append("--no-reference")
        document = json.loads(_call(words))
    events = [Event(e["t"], e["kind"], e["contact"], e["name"], *(_array(e.get(name)) for name in
              ("q", "v_minus", "v_plus", "Lambda_n", "Lambda_t"))) for e in document["events"]]
    columns = document.get("sensitivities", [])
    matrix = lambda name: np.array([_array(column[name]) for column in columns]).T  # noqa: E731
    return Run(document["status"], document["message"], document["t"], _array(document["q"]), _array(document["v"]),
               document.get("error"), document["seconds"], document["counters"], events, matrix("dq"), matrix("dv"),
               document)


def motion(scene: str | Path | Mapping[str, Any], method: str, steps: int | None = None, tolerance: float | None = None, *,
           parameters: Mapping[str, float] | None = None, points: int = 1000) -> dict[str, np.ndarray]:
    """The motion between the steps, at equally spaced times and on both sides of every impact: columns by name."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "motion.csv"
        _call(["run", "--no-reference", *_words(scene, method, steps, tolerance, parameters, folder), "--csv", str(path),
               "--points", str(points)])
        with path.open(newline="") as file:
            rows = list(csv.reader(line for line in file if not line.startswith("#")))
    return {name: np.array([float(row[k]) for row in rows[1:]]) for k, name in enumerate(rows[0])}


def truth(scene: str | Path | Mapping[str, Any], *, parameters: Mapping[str, float] | None = None, digits: int = 30,
          rounded: bool = False, time_limit: float | None = None) -> Truth:
    """Proven digits of the motion and its events: of the id of a problem, a scene file, or a scene as a dictionary.

    `digits` is the number of decimal places to prove. Numbers of the scene are decimals, 0.3 is three tenths; with
    `rounded` each is the double next to it, as methods integrate the scene. `time_limit` is the wall time [s] after which
    the motion is left open, 10 by default. An open motion is a Truth, too, with a reason.
    Raises RicochetError for input that the program refuses, and if the program was built without Arb.
    """
    with tempfile.TemporaryDirectory() as folder:
        words = ["truth", "--json", *_scene_words(scene, parameters, folder), "--digits", str(digits)]
        if rounded:
            words.append("--rounded")
        if time_limit is not None:
            words += ["--time-limit", repr(time_limit)]
        document = json.loads(_call(words))
    texts = lambda numbers: [number["value"] for number in numbers]  # noqa: E731
    radii = lambda numbers: _array([number["radius"] for number in numbers])  # noqa: E731
    q, v = document["q"], document["v"]
    events = [TruthEvent(float(e["t"]), e["t"], e["radius"], e["kind"], e["contact"], e["modes"],
                         _array(texts(e["Lambda_n"])), e["grade"]) for e in document["events"]]
    return Truth(document["grade"], document["reason"], document["assumptions"], document["decimals"],
                 float(document["t"] or 0), _array(texts(q)), _array(texts(v)), texts(q), texts(v), radii(q), radii(v), events,
                 document["seconds"], document)


def control(problem: str | Path | Mapping[str, Any], *, method: str = "homotopy", parameters: Mapping[str, float] | None = None,
            replay: bool = True, **options: Any) -> Control:
    """Solves an optimal control problem: the id of a problem, a scene file with a block `control`, or such a scene.

    `method` is "homotopy" or "shooting". `options` are those of `ricochet control`, with _ for -: explore=12, sigma_0=0.01,
    intervals=20, simulate=True. `replay` runs the plant under the controls found, by the event-located reference.
    Raises RicochetError for input that the program refuses.
    """
    with tempfile.TemporaryDirectory() as folder:
        words = ["control"]
        if isinstance(problem, Mapping):
            path = Path(folder) / "problem.json"
            path.write_text(json.dumps(problem))
            words.append(str(path))
        else:
            words.append(str(problem))
        words += ["--json", "--method", method]
        for name, value in (parameters or {}).items():
            words += ["--set", f"{name}={value!r}"]
        if not replay:
            words.append("--no-replay")
        for name, value in options.items():
            if value is not False:
                words += ["--" + name.replace("_", "-"), *([] if value is True else [str(value)])]
        document = json.loads(_call(words))
    matrix = lambda rows: np.array(rows, dtype=float)  # noqa: E731
    claimed, is_replayed = document["claimed"], document["replay_status"] == "success"
    return Control(document["status"], document["message"], document["claimed_cost"], document["stationarity"], document["T"],
                   matrix(document["u"]), matrix(claimed["t"]), matrix(claimed["q"]), matrix(claimed["v"]),
                   document["true_cost"] if is_replayed else np.nan, document["terminal"] if is_replayed else np.nan,
                   document["iterations"], document["seconds"], document)


def results(path: str | Path, kind: str | None = None) -> pandas.DataFrame:
    """The rows of a results file as a frame, a column per field; nested objects are columns "counters.steps".

    `kind` picks one kind of rows where there are several; without it the file may have only one.
    """
    import pandas

    rows = [json.loads(line) for line in Path(path).read_text().splitlines() if line]
    rows = [row for row in rows if row.get("kind") not in ("header", "end")]
    kinds = sorted({row["kind"] for row in rows})
    if kind is None and len(kinds) > 1:
        raise RicochetError(f"{path} has rows of the kinds {', '.join(kinds)}: choose one")
    return pandas.json_normalize([row for row in rows if kind is None or row["kind"] == kind])
