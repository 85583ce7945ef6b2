"""Completion in zsh and fish offers what it offers in bash, which tests/cli/help_everywhere_test.cc holds against the
program's own tables. Looked at are all commands that have others below them, every third of those that have none, and
every option that takes one of a set. A shell that is not installed is passed over. Usage: completion_test.py PROGRAM"""

import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PROGRAM = pathlib.Path(sys.argv.pop() if len(sys.argv) > 1 else ROOT / "build/bin/gapscope").resolve()
BASH = f"""
. {ROOT}/cmake/gapscope.bash
compopt() {{ :; }}
ask() {{ COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMPREPLY=(); _gapscope; echo "${{COMPREPLY[*]}}"; }}
"""
ZSH = f"""
zmodload zsh/parameter  # as completion has it: names of its own that a function must not take
. {ROOT}/cmake/_gapscope
ask() {{ local -a reply told; _gapscope_words "$@"; print -r -- "${{(@M)reply:#${{@[-1]}}*}}" }}
"""
FISH = f"""
. {ROOT}/cmake/gapscope.fish
function ask; echo (complete -C (string join ' ' -- $argv) | string replace -r '\\t.*' ''); end
"""


def help_of(path):
    return subprocess.run([PROGRAM, *path, "--help"], capture_output=True, text=True, check=True).stdout


def lines():
    """What is written when completion is asked for: the words behind the program's, the last of which is begun."""
    todo, found, known, leaves = [[]], [], set(), 0
    while todo:
        path = todo.pop()
        text = help_of(path)
        listed = re.search(r"^Subcommands:\n(.*?)^$", text + "\n", re.M | re.S)
        below = re.findall(r"^  ([a-z][a-z-]*) ", listed[1], re.M) if listed else []
        todo += [[*path, name] for name in below]
        leaves += not below
        found += [[*path, ""], [*path, below[0][:2]]] if below else [[*path, "--"]] if leaves % 3 == 1 else []
        choices = set(re.findall(r"^  (--[a-z-]+) \{", text, re.M)) - known
        known |= choices
        found += [[*path, flag, ""] for flag in sorted(choices)]
    return found


LINES = lines()


def offered(shell, script, *options):
    """Of each line the words that a shell offers."""
    if not shutil.which(shell):
        raise unittest.SkipTest(f"no {shell}")
    asked = "".join(f"ask {shlex.join([PROGRAM.name, *words])}\n" for words in LINES)
    with tempfile.TemporaryDirectory() as home:
        env = {"HOME": home, "PATH": f"{PROGRAM.parent}:/usr/bin:/bin", "LC_ALL": "C.UTF-8"}
        command = [shell, *options, "-c", script + asked]
        done = subprocess.run(command, env=env, cwd=home, capture_output=True, text=True, check=True)
    if done.stderr:
        raise AssertionError(done.stderr)
    return [set(line.split()) for line in done.stdout.splitlines()]


class Completion(unittest.TestCase):
    maxDiff = None

    @classmethod
    def setUpClass(cls):
        cls.bash = offered("bash", BASH)

    def test_bash_offers_something(self):
        self.assertEqual(len(self.bash), len(LINES))
        self.assertGreater(len(LINES), 25)
        self.assertEqual([words for words, found in zip(LINES, self.bash) if not found], [])

    def test_zsh_offers_the_same(self):
        for words, found, wanted in zip(LINES, offered("zsh", ZSH, "-f"), self.bash, strict=True):
            self.assertEqual(found, wanted, words)

    def test_fish_offers_the_same(self):
        for words, found, wanted in zip(LINES, offered("fish", FISH, "--no-config"), self.bash, strict=True):
            self.assertEqual(found, wanted, words)


if __name__ == "__main__":
    unittest.main()
