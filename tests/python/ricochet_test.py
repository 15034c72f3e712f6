"""The Python module over the program: python3 ricochet_test.py, with RICOCHET_PROGRAM and PYTHONPATH set."""
import json
import os
import subprocess
import tempfile
import unittest
from decimal import Decimal, getcontext
from pathlib import Path

import numpy as np

import ricochet

FALLING = {"q0": ["1"], "v0": ["0"], "T": "0.4", "M": [["m"]], "f": ["-m*g"], "params": {"m": "2", "g": "9.81"},
           "contacts": [{"name": "floor", "gap": "q[0]", "e": "0.5"}]}


class Runs(unittest.TestCase):
    def test_a_scene_of_the_program(self):
        run = ricochet.run("bouncing_ball", "fesd:radau-iia:2", steps=10)
        self.assertTrue(run.succeeded)
        self.assertEqual(run.q.shape, (1,))
        self.assertEqual([event.kind for event in run.events], ["impact"] * 3)
        first = run.events[0]
        self.assertAlmostEqual(first.t, np.sqrt(2 * 0.9 / 9.81), places=12)  # from 1 m with a radius of 0.1 m
        np.testing.assert_allclose(first.v_plus, -0.9 * first.v_minus, rtol=1e-12)  # Newton's law
        self.assertLess(run.error, 1e-9)
        self.assertGreater(run.seconds, 0)
        self.assertEqual(run.counters["steps"], 10)

    def test_a_scene_of_ones_own(self):
        run = ricochet.run(FALLING, "event_driven", tolerance=1e-9, parameters={"g": 5.0}, reference=False)
        self.assertIsNone(run.error)
        np.testing.assert_allclose(run.q, [1 - 0.5 * 5 * 0.4**2], rtol=1e-12)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "falling.json"
            path.write_text(json.dumps(FALLING))
            again = ricochet.run(path, "event_driven", tolerance=1e-9, parameters={"g": 5.0}, reference=False)
        np.testing.assert_array_equal(again.q, run.q)

    def test_sensitivities(self):
        run = ricochet.run(FALLING, "fesd:gauss:2", steps=3, sensitivities=["q0:0", "param:g"], reference=False)
        np.testing.assert_allclose(run.dq, [[1, -0.08]], rtol=1e-9)  # dq = (dq0, -T^2/2 dg)
        np.testing.assert_allclose(run.dv, [[0, -0.4]], atol=1e-9)

    def test_a_failed_run_has_a_reason(self):
        run = ricochet.run("two_balls_spring", "fesd:gauss:4", steps=20, reference=False)
        self.assertFalse(run.succeeded)
        self.assertIn("as_needed", run.message)

    def test_what_the_program_refuses_is_an_exception(self):
        with self.assertRaisesRegex(ricochet.RicochetError, "bouncing_ball"):
            ricochet.run("bouncing_bal", "event_driven", tolerance=1e-6)
        with self.assertRaisesRegex(ricochet.RicochetError, "RICOCHET_PROGRAM"):
            before = {name: os.environ.pop(name, None) for name in ("RICOCHET_PROGRAM", "PATH")}
            try:
                ricochet.program()
            finally:
                os.environ.update({name: value for name, value in before.items() if value is not None})

    def test_the_motion_between_steps(self):
        motion = ricochet.motion(FALLING, "fesd:gauss:2", steps=2, points=5)
        np.testing.assert_allclose(motion["q[0]"], 1 - 0.5 * 9.81 * motion["t"] ** 2, atol=1e-12)
        self.assertGreaterEqual(len(motion["t"]), 5)


class Controls(unittest.TestCase):
    PUSHED = {"q0": ["0"], "v0": ["0"], "T": "2", "M": [["m"]], "f": ["0"], "Bu": [["1"]], "u": ["0"], "params": {"m": "2"},
              "contacts": [{"gap": "q[0] + 100"}],
              "control": {"N": 4, "running_cost": "u[0]**2", "terminal": [{"value": "q[0] - 3"}, {"value": "v[0]"}]}}

    def test_a_problem_of_ones_own(self):
        plan = ricochet.control(self.PUSHED, method="shooting", parameters={"m": 1.0})
        self.assertTrue(plan.succeeded, plan.message)
        # The least squares with sum u = 0 and sum u (3.5 - k) H^2 = 3: u = c (1.5 - k), c = 3 / (5 H^2).
        np.testing.assert_allclose(plan.u[:, 0], 2.4 * (1.5 - np.arange(4)), atol=1e-8)
        self.assertAlmostEqual(plan.cost, 0.5 * 2.4**2 * 5, places=8)
        self.assertAlmostEqual(plan.true_cost, plan.cost, places=8)
        self.assertLess(plan.replay_error, 1e-9)
        self.assertTrue(plan.stationarity.startswith("B"), plan.stationarity)
        np.testing.assert_allclose(plan.q[-1], [3], atol=1e-9)
        self.assertEqual(plan.v.shape, plan.q.shape)

    def test_options_and_mistakes(self):
        plan = ricochet.control(self.PUSHED, method="shooting", max_iterations=1, replay=False)
        self.assertEqual((plan.status, plan.u.size), ("step_limit", 0))
        with self.assertRaisesRegex(ricochet.RicochetError, "sigma"):
            ricochet.control(self.PUSHED, method="shooting", sigma_0=0.01)


class Truths(unittest.TestCase):
    def truth(self, *arguments, **options):
        try:
            return ricochet.truth(*arguments, **options)
        except ricochet.RicochetError as error:
            if "built without Arb" in str(error):
                self.skipTest(str(error))
            raise

    def test_a_scene_of_ones_own(self):
        truth = self.truth(FALLING, parameters={"m": 3.0}, digits=40)
        self.assertEqual(truth.grade, "proven")
        self.assertFalse(truth.is_open)
        self.assertGreaterEqual(truth.decimals, 40)
        self.assertEqual(Decimal(truth.q_text[0]), Decimal("0.2152"))  # 1 - 9.81 / 2 * 0.4^2, exactly
        self.assertEqual(Decimal(truth.v_text[0]), Decimal("-3.924"))
        np.testing.assert_array_equal(truth.q, [0.2152])
        self.assertLessEqual(truth.q_radius[0], 1e-40)
        self.assertEqual((truth.t, list(truth.events), list(truth.assumptions)), (0.4, [], []))

    def test_events(self):
        truth = self.truth("bouncing_ball", digits=50)
        run = ricochet.run("bouncing_ball", "event_driven", tolerance=1e-12, reference=False)
        self.assertEqual([event.kind for event in truth.events], ["impact"] * 3)
        np.testing.assert_allclose([event.t for event in truth.events], [event.t for event in run.events], rtol=1e-12)
        np.testing.assert_allclose(truth.events[0].Lambda_n, run.events[0].Lambda_n, rtol=1e-12)
        np.testing.assert_allclose(truth.q, run.q, rtol=1e-12)
        first = truth.events[0]
        getcontext().prec = 100
        exact = (Decimal("1.8") / Decimal("9.81")).sqrt()  # from 1 m with a radius of 0.1 m
        self.assertLessEqual(abs(Decimal(first.t_text) - exact), Decimal(first.t_radius))
        self.assertLessEqual(first.t_radius, 1e-50)
        self.assertEqual((first.modes, first.grade), (["open"], "proven"))

    def test_rounded_numbers_are_another_scene(self):
        scene = {**FALLING, "q0": ["0.3"], "T": "0.1"}
        self.assertNotEqual(self.truth(scene).q_text, self.truth(scene, rounded=True).q_text)

    def test_an_open_motion_has_a_reason(self):
        truth = self.truth({**FALLING, "f": ["-abs(v[0])"]})  # nothing decides on which side of v = 0 it rests
        self.assertTrue(truth.is_open)
        self.assertIn("how the motion leaves v[0] = 0", truth.reason)
        self.assertIsNone(truth.decimals)
        self.assertEqual(truth.q.size, 0)

    def test_what_the_program_refuses_is_an_exception(self):
        with self.assertRaisesRegex(ricochet.RicochetError, "bouncing_ball"):
            ricochet.truth("bouncing_bal")


class Results(unittest.TestCase):
    def test_rows_are_a_frame(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([ricochet.program(), "run-experiment", "--problem", "bouncing_ball", "--method", "moreau_jean",
                            "--method", "fesd:radau-iia:2", "--steps", "10..40", "--no-times", "-o", folder],
                           check=True, capture_output=True)
            path, = Path(folder).glob("*.jsonl")
            frame = ricochet.results(path)
            self.assertEqual(set(frame["kind"]), {"row"})
            self.assertEqual(len(ricochet.results(path, "timing")), 0)
            with path.open("a") as file:
                file.write('{"kind": "other"}\n')
            with self.assertRaisesRegex(ricochet.RicochetError, "other, row"):
                ricochet.results(path)
        self.assertEqual(set(frame["method"]), {"moreau_jean", "fesd:radau-iia:2"})
        self.assertTrue((frame[frame["method"] == "moreau_jean"]["error"] > 1e-3).all())
        self.assertIn("counters.steps", frame.columns)


if __name__ == "__main__":
    unittest.main()
