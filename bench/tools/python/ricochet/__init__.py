"""Ricochet from Python: runs as numpy arrays, results files as pandas frames.

A thin module over the program `ricochet`, which it finds in RICOCHET_PROGRAM or on the PATH. Units are those of the SI.

    import ricochet
    run = ricochet.run("two_balls_spring", "fesd:gauss:4", steps=50)
    run.t, run.q, run.error, [event.t for event in run.events]
    frame = ricochet.results("out/results/two_balls_order.jsonl")
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

__all__ = ["Event", "Run", "RicochetError", "motion", "program", "results", "run"]


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


def _words(scene: str | Path | Mapping[str, Any], method: str, steps: int | None, tolerance: float | None,
           parameters: Mapping[str, float] | None, folder: str) -> list[str]:
    words = ["--method", method]
    if isinstance(scene, Mapping):
        path = Path(folder) / "scene.json"
        path.write_text(json.dumps(scene))
        words += ["--scene", str(path)]
    else:
        text = str(scene)
        words += ["--scene" if isinstance(scene, Path) or ".json" in text else "--problem", text]
    if steps is not None:
        words += ["--steps", str(steps)]
    if tolerance is not None:
        words += ["--tolerance", repr(tolerance)]
    for name, value in (parameters or {}).items():
        words += ["--set", f"{name}={value!r}"]
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
