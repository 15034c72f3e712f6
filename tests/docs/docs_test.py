"""The docs site: `/usr/bin/python3 docs_test.py [TEST...]`. Exit code 77, which ctest takes for skipped, without doxygen,
which the tests of `Library` do not need."""
import html
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
HEADERS = [line for line in (SOURCE / "bench/tools/package/headers.txt").read_text().splitlines() if not line.startswith("#")]


def make_site(folder, source=SOURCE, **environment):
    return subprocess.run([sys.executable, str(source / "bench/tools/docs/make_site"), str(folder), str(source)],
                          text=True, capture_output=True, env=os.environ | environment)


class Site(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.kept = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.kept.cleanup)
        cls.made = make_site(cls.kept.name)
        cls.html = Path(cls.kept.name) / "html"

    def page(self, name):
        return (self.html / name).read_text()

    def test_has_no_warning_and_no_dead_link(self):
        self.assertEqual(self.made.stderr, "")
        self.assertEqual(self.made.returncode, 0)
        links, mistakes = map(int, re.search(r"(\d+) links, (\d+) mistakes", self.made.stdout).groups())
        self.assertEqual(mistakes, 0)
        self.assertGreater(links, 5000)

    def test_has_every_markdown_page_and_every_installed_header(self):
        titles = {html.unescape(re.search(r'<div class="title">(.*?) ?</div>', file.read_text(), re.S)[1])
                  for file in self.html.glob("*.html") if 'class="title"' in file.read_text()}
        for path in SOURCE.rglob("*.md"):
            inside = path.relative_to(SOURCE)
            if inside.parts[0] == "out" or "node_modules" in inside.parts or str(inside).startswith("."):
                continue
            title = path.read_text().split("\n", 1)[0].removeprefix("# ").replace("`", "")
            self.assertIn(title, titles, inside)
        files = self.page("files.html")
        for header in HEADERS:
            self.assertIn(f">{Path(header).name}</a>", files, header)

    def test_shows_figures_code_and_equations(self):
        figures = re.findall(r'<img [^>]*src="(files/[^"]*\.svg)"', self.page("page_results.html"))
        self.assertGreater(len(figures), 10)
        for figure in figures:
            self.assertIn("<svg", (self.html / figure).read_text()[:2000])
        self.assertIn("symplectic Euler", self.page("page_examples_plugin_mine_cpp.html"))
        # Lines of equations stay lines, and the text of a class stands before the list of its members.
        problem = self.page("classricochet_1_1Problem.html")
        self.assertTrue(re.search(r"<pre[^>]*>q' = v +\(1\)\nM\(q\) v' = ", problem))
        self.assertLess(problem.index("(7)"), problem.index("Public Member Functions</h2>"))
        self.assertTrue("Comments // and /* */ are allowed" in html.unescape(self.page("page_problems_scene_file.html")))


class Mistakes(unittest.TestCase):
    """Planted in a copy: each is found, and named with its place."""

    def test_are_found(self):
        with tempfile.TemporaryDirectory() as folder:
            copy = Path(folder) / "copy"
            shutil.copytree(SOURCE, copy, ignore=shutil.ignore_patterns("out", ".git", "baselines", "__pycache__"))

            def plant(path, old, new):
                text = (copy / path).read_text()
                self.assertIn(old, text)
                (copy / path).write_text(text.replace(old, new, 1))

            plant("problems/names.h", "\n}  // namespace ricochet", "\nint undocumented_function();\n}  // namespace ricochet")
            plant("problems/names.h", "\n}  // namespace ricochet",
                  "\n/// It has a comment.\nint half_documented(int unnamed);\n}  // namespace ricochet")
            plant("problems/solution.h", "  impact,         ///< it gets an impulse: v jumps\n", "  impact,\n")
            plant("problems/motion.h", "/// @file\n", "/// @file\n/// @nosuchcommand\n")
            plant("CONTRIBUTING.md", "# Contributing\n", "# Contributing\n\n[gone](no/such/file.md) [where](README.md#no-such-heading) "
                  "<img src=\"https://example.org/far.svg\">\n")
            made = make_site(Path(folder) / "site", copy)
        self.assertEqual(made.returncode, 1, made.stdout)
        for line in (r"problems/names.h:\d+: .*undocumented_function.* is not documented",
                     r"problems/names.h:\d+: .*half_documented does not name unnamed",
                     r"problems/solution.h:\d+: .*enumerator impact is not documented",
                     r"problems/motion.h:\d+: .*nosuchcommand",
                     r"CONTRIBUTING.md: the link no/such/file.md leads nowhere",
                     r"page_contributing.html: the link index.html#index--no-such-heading leads to no place",
                     r"page_contributing.html: https://example.org/far.svg is loaded from the network"):
            self.assertRegex(made.stderr, line)
        self.assertIn(f"{len(made.stderr.splitlines())} mistakes", made.stdout)

    def test_a_missing_program_is_a_message(self):
        with tempfile.TemporaryDirectory() as folder:
            made = make_site(folder, PATH="/nonexistent")
        self.assertEqual(made.returncode, 2)
        self.assertIn("doxygen is missing", made.stderr)


class Library(unittest.TestCase):
    """bench/tools/package/README.md says what is there."""

    TEXT = (SOURCE / "bench/tools/package/README.md").read_text()

    def test_lists_the_installed_headers(self):
        linked = re.findall(r"\]\(([^)]*\.h)\)", self.TEXT)
        self.assertEqual(sorted(os.path.normpath(os.path.join("bench/tools/package", path)) for path in linked), sorted(HEADERS))

    def test_installed_headers_include_no_other(self):
        installed = {header.removeprefix("bench/tools/package/").removeprefix("bench/plugin/") for header in HEADERS}
        for header in HEADERS:
            for included in re.findall(r'^#include "(.*)"', (SOURCE / header).read_text(), re.M):
                self.assertIn(included, installed, header)

    def test_shows_the_example(self):
        code, = re.findall(r"```cpp\n(.*?)```", self.TEXT, re.S)
        self.assertIn(code, (SOURCE / "examples/cpp/simulate.cpp").read_text())


if __name__ == "__main__":
    for missing, there in (("doxygen", shutil.which("doxygen")), ("python3-markdown", importlib.util.find_spec("markdown"))):
        if not there and sys.argv[1:] != ["Library"]:
            print(f"skipped: {missing} is not installed")
            sys.exit(77)
    unittest.main()
