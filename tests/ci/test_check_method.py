"""examples/ci as the services run it: the script with their environment variables, a stub of apt-get on the PATH.

test_check_method.py PROGRAM SOURCE_FOLDER [TEST...]
"""

import hashlib
import json
import os
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree
from pathlib import Path

PROGRAM, SOURCE = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
SCRIPT = SOURCE / "examples/ci/check_method"
GOOD = "fesd_adaptive:radau-iia:4"
EXPERIMENT = """{"id": "mine", "problem": "bouncing_ball", "times": false,
  "methods": [{"method": "fesd:gauss:1", "steps": [20, 40]}, {"method": "moreau_jean", "steps": [100, 200]}]}"""


class CheckMethod(unittest.TestCase):
    def setUp(self):
        self.folder_ = tempfile.TemporaryDirectory(prefix="ricochet ci ")  # with a blank, as paths may have
        self.folder = Path(self.folder_.name)
        self.bin = self.folder / "bin"
        self.bin.mkdir()
        (self.bin / "ricochet").symlink_to(PROGRAM)
        self.stub("apt-get", 'echo "$@" >>"$APT_LOG"')
        self.stub("sudo", '"$@"')

    def tearDown(self):
        self.folder_.cleanup()

    def stub(self, name, body):
        path = self.bin / name
        path.write_text(f"#!/bin/sh\n{body}\n")
        path.chmod(0o755)

    def run_script(self, with_program=True, **inputs):
        """The exit code and what was printed. Inputs are those of the action, without RICOCHET_."""
        environment = {
            "HOME": str(self.folder),
            "PATH": f"{self.bin}:/usr/bin:/bin" if with_program else "/usr/bin:/bin",
            "RICOCHET_DATA": str(SOURCE),
            "APT_LOG": str(self.folder / "apt.log"),
        }
        for name in ("GITHUB_STEP_SUMMARY", "GITHUB_OUTPUT"):
            environment[name] = str(self.folder / name.lower())
        for name in set(re.findall(r"RICOCHET_[A-Z_0-9]+", (SOURCE / "examples/ci/action.yml").read_text())):
            environment[name] = "false" if name == "RICOCHET_QUICK" else ""  # as the action sets them
        environment["RICOCHET_OUT"] = "out"
        environment.update({f"RICOCHET_{name.upper()}": value for name, value in inputs.items()})
        done = subprocess.run([SCRIPT], cwd=self.folder, env=environment, capture_output=True, text=True, timeout=300)
        return done.returncode, done.stdout + done.stderr

    def test_a_right_method_passes(self):
        code, text = self.run_script(methods=f"  {GOOD}  \n\n", quick="true")
        self.assertEqual(code, 0, text)
        suite = ElementTree.parse(self.folder / "out/scorecard-1.xml").getroot()[0]
        self.assertEqual(suite.get("failures"), "0")
        self.assertGreater(int(suite.get("tests")), 10)
        self.assertTrue(json.loads((self.folder / "out/scorecard-1.json").read_text())["holds"])
        self.assertIn("<svg", (self.folder / "out/scorecard-1.svg").read_text())
        summary = (self.folder / "out/summary.md").read_text()
        self.assertIn("0 failed", summary)
        self.assertEqual((self.folder / "github_step_summary").read_text(), summary)
        self.assertEqual((self.folder / "github_output").read_text(), "folder=out\n")
        self.assertFalse((self.folder / "apt.log").exists(), "nothing is installed where no package is named")

    def test_a_failure_is_exit_code_one_behind_all_methods(self):
        gauss = "fesd:gauss:4,elements=as_needed"  # which cannot come to rest in space
        code, text = self.run_script(methods=f"{gauss}\n{GOOD}", quick="true")
        self.assertEqual(code, 1, text)
        self.assertTrue(json.loads((self.folder / "out/scorecard-2.json").read_text())["holds"])
        self.assertIn("truth/P7a", (self.folder / "out/summary.md").read_text())
        code, text = self.run_script(methods=gauss, quick="true", known="truth/P7a*\n promises/* \n")
        self.assertEqual(code, 0, text)
        self.assertFalse((self.folder / "out/scorecard-2.json").exists(), "of the run before")

    def test_a_command_with_blanks(self):
        client = f"external:{sys.executable} '{SOURCE}/examples/external/euler.py'"
        code, text = self.run_script(methods=client, quick="true", known="*")
        self.assertEqual(code, 0, text)
        self.assertGreater(json.loads((self.folder / "out/scorecard-1.json").read_text())["passed"], 5, text)

    def test_the_method_is_built_first(self):
        code, text = self.run_script(methods=GOOD, quick="true", build="echo built >made && test -f made")
        self.assertEqual(code, 0, text)
        self.assertEqual((self.folder / "made").read_text(), "built\n")
        code, text = self.run_script(methods=GOOD, build="false; true")
        self.assertEqual(code, 2, "a command in the middle fails")
        self.assertIn("RICOCHET_BUILD", text)

    def test_the_package_is_installed(self):
        deb = self.folder / "a package.deb"
        deb.write_bytes(b"deb")
        right = hashlib.sha256(b"deb").hexdigest()
        code, text = self.run_script(methods=GOOD, quick="true", deb=str(deb), deb_sha256=right)
        self.assertEqual(code, 0, text)
        self.assertIn(f"install -y -qq --no-install-recommends {deb}", (self.folder / "apt.log").read_text())
        code, text = self.run_script(methods=GOOD, deb=str(deb), deb_sha256="0" * 64)
        self.assertEqual(code, 2)
        self.assertIn(f"the package has {right}", text)
        self.stub("curl", 'while [ "$1" != --output ]; do shift; done; printf deb >"$2"')
        code, text = self.run_script(methods=GOOD, quick="true", deb="https://example.org/x.deb", deb_sha256=right)
        self.assertEqual(code, 0, text)
        self.stub("curl", "exit 22")
        code, text = self.run_script(methods=GOOD, deb="https://example.org/x.deb")
        self.assertEqual((code, "it cannot be fetched" in text), (2, True), text)
        self.stub("apt-get", "exit 100")
        code, text = self.run_script(methods=GOOD, deb=str(deb))
        self.assertEqual((code, "apt-get update failed" in text), (2, True), text)

    def test_experiments_are_held_against_baselines(self):
        (self.folder / "mine.json").write_text(EXPERIMENT)
        run = [PROGRAM, "run-experiment", "mine.json", "--no-times", "-o", "first"]
        environment = {**os.environ, "RICOCHET_DATA": str(SOURCE)}
        subprocess.run(run, cwd=self.folder, env=environment, check=True, capture_output=True)
        subprocess.run([PROGRAM, "check", "first/mine.jsonl", "--replace", "baselines"], cwd=self.folder,
                       env=environment, check=True, capture_output=True)
        inputs = {"methods": GOOD, "quick": "true", "experiments": "mine.json", "baselines": "baselines"}
        code, text = self.run_script(**inputs)
        self.assertEqual(code, 0, text)
        self.assertTrue((self.folder / "out/gate.xml").exists())
        # A baseline that is better than the method is.
        baseline = self.folder / "baselines/mine.jsonl"
        lines = [json.loads(line) for line in baseline.read_text().splitlines()]
        for line in lines:
            if line.get("method") == "moreau_jean" and "error" in line:
                line["error"] *= 0.01
        baseline.write_text("".join(json.dumps(line) + "\n" for line in lines))
        code, text = self.run_script(**inputs)
        self.assertEqual(code, 1, text)
        self.assertIn("moreau", (self.folder / "out/summary.md").read_text())

    def test_wrong_inputs_are_named(self):
        for inputs, word in [
            ({"methods": " \n"}, "RICOCHET_METHODS"),
            ({"methods": "no_such_method"}, "no_such_method"),
            ({"methods": GOOD, "quick": "yes"}, "RICOCHET_QUICK = yes"),
            ({"methods": GOOD, "deb": "none.deb"}, "RICOCHET_DEB = none.deb"),
            ({"methods": GOOD, "deb": "http://example.org/x.deb"}, "https://"),
            ({"methods": GOOD, "experiments": "none.json", "baselines": "."}, "none.json"),
            ({"methods": GOOD, "baselines": "."}, "RICOCHET_EXPERIMENTS"),
            ({"methods": GOOD, "plugins": "none.so"}, "none.so"),
        ]:
            with self.subTest(word):
                code, text = self.run_script(**inputs)
                self.assertEqual(code, 2, text)
                self.assertIn(word, text)
        code, text = self.run_script(with_program=False, methods=GOOD)
        self.assertEqual((code, "there is no program ricochet" in text), (2, True), text)


class Templates(unittest.TestCase):
    """What the YAML files pass on is what the script reads."""

    def setUp(self):
        folder = SOURCE / "examples/ci"
        self.read_by_script = set(re.findall(r"^#   (RICOCHET_[A-Z_0-9]+)", SCRIPT.read_text(), re.MULTILINE))
        self.action, self.gitlab = (folder / "action.yml").read_text(), (folder / "gitlab.yml").read_text()

    def test_inputs_are_those_of_the_script(self):
        inputs = re.search(r"\ninputs:\n(.*?)\noutputs:", self.action, re.DOTALL).group(1)
        names = set(re.findall(r"^  (\w+):$", inputs, re.MULTILINE))
        self.assertEqual({f"RICOCHET_{name.upper()}" for name in names}, self.read_by_script)
        passed = dict(re.findall(r"^ +(RICOCHET_\w+): \$\{\{ inputs\.(\w+) \}\}$", self.action, re.MULTILINE))
        self.assertEqual(passed, {f"RICOCHET_{name.upper()}": name for name in names})
        self.assertEqual(len(re.findall(r"^    description: \S", inputs, re.MULTILINE)), len(names))
        variables = re.search(r"  variables:\n(.*?)\n  before_script:", self.gitlab, re.DOTALL).group(1)
        self.assertEqual(set(re.findall(r"RICOCHET_\w+", variables)), self.read_by_script)

    def test_they_call_the_script(self):
        self.assertIn("$GITHUB_ACTION_PATH/check_method", self.action)
        self.assertIn("/usr/share/ricochet/examples/ci/check_method", self.gitlab)
        for text in (self.action, self.gitlab):
            self.assertNotIn("\t", text)

    def test_yaml(self):
        try:
            import yaml
        except ImportError:
            self.skipTest("python3-yaml is not installed")
        self.assertEqual(yaml.safe_load(self.action)["runs"]["using"], "composite")
        self.assertIn("script", yaml.safe_load(self.gitlab)[".ricochet"])

    def test_shellcheck(self):
        try:
            done = subprocess.run(["shellcheck", SCRIPT], capture_output=True, text=True, check=False)
        except FileNotFoundError:
            self.skipTest("shellcheck is not installed")
        self.assertEqual(done.returncode, 0, done.stdout)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
