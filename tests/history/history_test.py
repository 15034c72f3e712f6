"""The history of the baselines: python3 history_test.py, with RICOCHET_PROGRAM set. Exit code 77, skipped, without git."""
import html
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
PROGRAM = os.environ["RICOCHET_PROGRAM"]
SCRIPT = SOURCE / "bench/tools/history/make_history"
# A hook of git, which may run this, names its own repository; identity and date of a commit are those of no user.
ENVIRONMENT = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")} | {
    "GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_NOSYSTEM": "1", "GIT_AUTHOR_NAME": "a", "GIT_AUTHOR_EMAIL": "a@b",
    "GIT_COMMITTER_NAME": "a", "GIT_COMMITTER_EMAIL": "a@b"}
STEPS = (100, 150, 220, 330, 500, 750, 1100, 1600)


def line(method, steps, error, **counters):
    return {"kind": "row", "method": method, "steps": steps, "h_bar": 1 / steps, "error": error, "reference_error": 1e-14,
            "solution_size": 1, "status": "success", "counters": {"steps": steps} | counters}


def power(method, order, first, **counters):
    """Errors of an order, `first` at the longest step."""
    return [line(method, n, first * (STEPS[0] / n) ** order, **counters) for n in STEPS]


# Of "coarse" all errors are above 0.3 % of the solution. Of "few" five are not, and the rule requires six. That of "lost" grow
# above 0.3 % with the last commit. "turning" goes through order 0 to a negative one.
COMMITS = [
    power("steady", 2, 1e-3) + power("turning", 1, 1e-5, elements=4) + power("coarse", 1, 2) + power("few", 2, 3e-2)
    + power("lost", 2, 1e-3),
    power("steady", 2, 1e-3) + power("turning", 0, 1e-5, elements=0) + power("coarse", 1, 1) + power("few", 2, 3e-2)
    + power("lost", 2, 1e-3) + [line("steady", 3200, 1e-6)],
    power("steady", 2, 5e-4) + power("turning", -1, 1e-6, elements=4) + power("coarse", 2, 2) + power("few", 2, 3e-2)
    + power("lost", 2, 1) + [line("steady", 3200, 5e-7)],
]


def git(folder, *arguments):
    subprocess.run(["git", *arguments], cwd=folder, check=True, capture_output=True, env=ENVIRONMENT)


def make_history(folder, *arguments, script=SCRIPT):
    return subprocess.run([sys.executable, str(script), *map(str, arguments)], cwd=folder, text=True, capture_output=True,
                          env=ENVIRONMENT)


class History(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        kept = tempfile.TemporaryDirectory()
        cls.addClassCleanup(kept.cleanup)
        cls.repository = Path(kept.name)
        git(cls.repository, "init", "-q")
        baselines = cls.repository / "reports/baselines"
        baselines.mkdir(parents=True)
        header = {"kind": "header", "schema": 1, "study": "method_grid", "experiment": "grid", "title": "Grid"}
        counted = [{"kind": "header", "schema": 1, "study": "google_benchmark", "experiment": "counted", "title": "Counted"},
                   {"kind": "benchmark", "name": "a/b", "counters": {"steps": 3}}, {"kind": "end"}]
        (baselines / "counted.jsonl").write_text("".join(json.dumps(row) + "\n" for row in counted))
        for n, rows in enumerate(COMMITS):
            (baselines / "grid.jsonl").write_text("".join(json.dumps(row) + "\n" for row in [header, *rows, {"kind": "end"}]))
            git(cls.repository, "add", ".")
            git(cls.repository, "commit", "-q", "-m", f"number {n} <b>")
        cls.folder = cls.repository / "out"
        cls.made = make_history(cls.repository, cls.folder, "--program", PROGRAM)
        cls.history = json.loads((cls.folder / "history.json").read_text())

    def order(self, n, method):
        numbers = self.history[n]["methods"][f"grid: {method}"]
        return numbers.get("order"), numbers.get("no_order", "").split(":")[0]

    def changes(self, n):
        return [change["text"] for change in self.history[n]["changes"]]

    def test_is_made_without_a_word_of_trouble(self):
        self.assertEqual((self.made.returncode, self.made.stderr), (0, ""))
        self.assertEqual([entry["subject"] for entry in self.history], [f"number {n} <b>" for n in range(3)])

    def test_orders_are_those_of_the_program(self):
        self.assertEqual([self.order(n, "steady") for n in range(3)], [(2, "")] * 3)
        self.assertEqual([self.order(n, "turning") for n in range(3)], [(1, ""), (0, ""), (-1, "")])
        self.assertEqual(self.order(0, "coarse"), (None, "too coarse"))
        self.assertEqual(self.order(0, "few"), (None, "too few points"))
        self.assertNotIn("order", self.history[0]["methods"]["counted: a/b"])

    def test_tells_how_an_order_changed_and_that_it_is_lost(self):
        self.assertIn("grid: turning: order 0.00 (0.00 .. 0.00) to -1.00 (-1.00 .. -1.00)", self.changes(2))
        self.assertIn("grid: lost: order 2.00 (2.00 .. 2.00) to not asymptotic", self.changes(2))
        self.assertFalse([text for n in (1, 2) for text in self.changes(n) if "coarse: order" in text or "few: order" in text])
        lost = next(change for change in self.history[2]["changes"] if change["text"].startswith("grid: lost: order"))
        self.assertEqual((lost["before"], lost["after"]), (2, None))

    def test_a_row_that_was_added_is_no_change(self):
        self.assertFalse([text for text in self.changes(1) if text.startswith("grid: steady")])
        self.assertIn("grid: steady: mean error", "\n".join(self.changes(2)))

    def test_writes_the_curves_for_the_site(self):
        ratios, orders = json.loads((self.folder / "curves.json").read_text())
        self.assertEqual((ratios["is_log"], orders["is_log"]), (True, False))
        points = {curve["label"]: curve["points"] for curve in ratios["curves"] + orders["curves"]}
        self.assertEqual([at for at, _ in points["grid: steady, mean error"]], [0, 1, 2])
        self.assertAlmostEqual(points["grid: steady, mean error"][2][1], 0.5)
        self.assertEqual(points["grid: turning, order"], [[0, 1], [1, 0], [2, -1]])
        self.assertEqual(points["grid: lost, order"], [[0, 2], [1, 2]])
        self.assertNotIn("grid: turning, elements", points)  # which went to 0

    def test_has_no_curve_where_nothing_changed(self):
        self.assertEqual(make_history(self.repository, "one", 1, "--program", PROGRAM).returncode, 0)
        self.assertEqual(json.loads((self.repository / "one/curves.json").read_text()), [])

    def test_names_every_file(self):
        for entry in self.history:
            self.assertTrue((self.folder / entry["file"]).exists())

    def test_the_command_writes_a_page(self):
        made = subprocess.run([PROGRAM, "history", "-o", "alone"], cwd=self.repository, text=True, capture_output=True,
                              env=ENVIRONMENT)
        self.assertEqual(made.returncode, 0, made.stderr)
        page = (self.repository / "alone/history.html").read_text()
        self.assertIn("number 2 &lt;b&gt;", page)
        for entry in self.history:
            for change in entry["changes"]:
                self.assertIn(html.escape(change["text"], quote=False), page)

    def test_the_program_makes_a_page_of_it(self):
        made = subprocess.run([PROGRAM, "report", "reports/baselines/grid.jsonl", "-o", "page", "--history", str(self.folder)],
                              cwd=self.repository, text=True, capture_output=True)
        self.assertEqual(made.returncode, 0, made.stderr)
        page = html.unescape((self.repository / "page/history.html").read_text())
        self.assertIn("grid: lost: order 2.00 (2.00 .. 2.00) to not asymptotic", page)
        self.assertIn("grid: turning, order", page)

    def test_without_the_program_there_are_no_orders(self):
        script = self.repository / "elsewhere/bench/tools/history/make_history"  # beside which nothing is built
        script.parent.mkdir(parents=True)
        shutil.copy(SCRIPT, script)
        made = make_history(self.repository, "bare", script=script)
        self.assertEqual(made.returncode, 0)
        self.assertIn("no orders", made.stderr)
        numbers = json.loads((self.repository / "bare/history.json").read_text())[2]["methods"]["grid: steady"]
        self.assertNotIn("order", numbers)
        self.assertEqual(numbers["steps"], sum(STEPS) + 3200)

    def test_baselines_that_the_program_cannot_read_have_no_orders(self):
        made = make_history(self.repository, "unread", "--program", shutil.which("false"))
        self.assertEqual(made.returncode, 0)
        self.assertIn("no orders", made.stderr)
        self.assertIn("grid: turning: elements 32 to 0", (self.repository / "unread/history.json").read_text())

    def test_says_what_it_cannot_use(self):
        made = make_history(self.repository, "none", "--program", "nowhere")
        self.assertEqual(made.returncode, 2)
        self.assertIn("no program nowhere", made.stderr)
        with tempfile.TemporaryDirectory() as folder:
            self.assertEqual(make_history(folder, "none", "--program", PROGRAM).returncode, 77)  # no repository
            git(folder, "init", "-q")
            git(folder, "commit", "-q", "--allow-empty", "-m", "nothing")
            self.assertEqual(make_history(folder, "none", "--program", PROGRAM).returncode, 77)  # no baselines

    @unittest.skipUnless((SOURCE / ".git").exists(), "a copy without git has no history")
    def test_of_this_repository(self):
        made = make_history(SOURCE, self.repository / "ours", 2, "--program", PROGRAM)
        self.assertEqual((made.returncode, made.stderr), (0, ""))
        methods = json.loads((self.repository / "ours/history.json").read_text())[-1]["methods"]
        self.assertGreater(sum("order" in numbers for numbers in methods.values()), 50)


if __name__ == "__main__":
    if not shutil.which("git"):
        sys.exit(77)
    unittest.main()
