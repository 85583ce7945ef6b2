"""What the rules of scripts/check_docs are worth: each fails where it should, and only there."""

import importlib.machinery
import importlib.util
import pathlib
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
loader = importlib.machinery.SourceFileLoader("check_docs", str(ROOT / "scripts/check_docs"))
check = importlib.util.module_from_spec(importlib.util.spec_from_loader("check_docs", loader))
loader.exec_module(check)

OPTIONS = """## Options of several commands

- **`--json`**. Of all.

## replay

- **`--window NUMBER`** (s). As `design --rate` says.
- As above: `--json`.

## design chirp

- **`--rate NUMBER`**.
"""


def sentence(words):
    return "One" + "".join("\n[word](page.md)" if i % 7 == 0 else " word" for i in range(1, words)) + "."


class Sentences(unittest.TestCase):
    def test_thirty_words_are_the_most(self):
        self.assertEqual(check.long_sentences(f"Short. {sentence(30)} {sentence(30)}"), [])
        self.assertEqual(check.long_sentences(f"Short. {sentence(31)}"), ["31 words, allowed 30: One word word ..."])

    def test_items_and_cells_stand_alone(self):
        self.assertEqual(len(check.long_sentences("- " + sentence(31))), 1)
        self.assertEqual(check.long_sentences(f"- {sentence(20)[:-1]}\n- {sentence(20)}"), [])
        self.assertEqual(check.long_sentences("| " + "word " * 20 + "| " + "word " * 20 + "|"), [])

    def test_an_example_is_no_sentence(self):
        for example in ("```\n{}\n```", "\n    {}", "Text.\n\n```text\n```\n"):
            self.assertEqual(check.long_sentences(example.format("word " * 40)), [])


class Terms(unittest.TestCase):
    TERMS = check.glossary("| word | means |\n|---|---|\n| **free, frozen** | x |\n| **gap** | y |\n")

    def test_a_word_in_bold_is_one_of_the_glossary(self):
        good = "The **gap** of **Gaps**,\n**frozen**.\n\n**Heading.** Text.\n\n- **Item**: text\n1. **One**.\n"
        self.assertEqual(check.unknown_terms(good + "\n| **cell** | a |\n", self.TERMS), [])
        self.assertEqual(check.unknown_terms("A **hole**.", self.TERMS),
                         ["in bold, not in docs/reference/glossary.md: hole"])


class Links(unittest.TestCase):
    AT = ROOT / "docs/reference/page.md"

    def test_they_lead_to_files_and_headings(self):
        page = "## 5. What `it` leaves\n\n[a](#5-what-it-leaves) [b](glossary.md) [c](https://example.com) `[d](e)`\n"
        self.assertEqual(check.dead_links(page, self.AT), [])
        self.assertEqual(check.dead_links("[d](#6-nothing)", self.AT), ["no such heading: #6-nothing"])
        self.assertEqual(check.dead_links("[d](glossary.md#none)", self.AT), ["no such heading: glossary.md#none"])
        self.assertEqual(check.dead_links("![e](nothing.png)", self.AT), ["no such file: nothing.png"])
        self.assertEqual(check.dead_links('<img src="nothing.png">', self.AT), ["no such file: nothing.png"])

    def test_a_page_that_no_link_leads_to(self):
        start, a, b = ROOT / "README.md", ROOT / "docs/a.md", ROOT / "docs/b.md"
        self.assertEqual(check.unreachable({start: "[a](docs/a.md)", a: "[b](b.md)", b: ""}), [])
        self.assertEqual(check.unreachable({start: "[a](docs/a.md)", a: "", b: "[a](a.md)"}), [b])


class Options(unittest.TestCase):
    def found(self, page, others=None):
        return check.unknown_options(page, OPTIONS, others or {})

    def test_of_a_command(self):
        good = "`gapscope replay a.yaml --window 1 --json`, `replay --window`\n\n    gapscope design chirp --rate 5\n"
        self.assertEqual(self.found(good), [])
        wrong = "gapscope replay --rate 1"
        self.assertEqual(self.found(f"`{wrong}`"), [f"no option of replay: --rate in {wrong}"])
        self.assertEqual(len(self.found("```console\n$ build/bin/gapscope replay a \\\n    --guess 1\n```")), 1)
        self.assertEqual(self.found("`gapscope divine`"), ["no command: gapscope divine"])

    def test_alone(self):
        self.assertEqual(self.found("`--window 1`, `-DX=y`, `cmake --build x`"), [])
        self.assertEqual(self.found("`--guess`"), ["no option: --guess in --guess"])

    def test_of_a_program_that_the_page_names(self):
        self.assertEqual(self.found("`scripts/test` has `--sanitize`", {"scripts/test": "--sanitize"}), [])
        self.assertEqual(len(self.found("`--sanitize`", {"scripts/test": "--sanitize"})), 1)


class Examples(unittest.TestCase):
    def test_indented_commands_run(self):
        page = "Text.\n\n    gapscope replay a.yaml b.csv\n"
        self.assertEqual(len(check.not_run(page, "docs/page.md")), 1)
        self.assertEqual(check.not_run("<!-- the indented commands run -->\n\n" + page, "docs/page.md"), [])
        excepted = next(iter(check.NOT_RUN))
        self.assertEqual(check.not_run(page, excepted), [])
        self.assertEqual(len(check.not_run("Text.\n", excepted)), 1)


if __name__ == "__main__":
    unittest.main()
