"""scripts/references: what it makes of a schema and of docstrings, and that the pages are as it makes them."""

import ast
import importlib.machinery
import importlib.util
import pathlib
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
loader = importlib.machinery.SourceFileLoader("references", str(ROOT / "scripts/references"))
references = importlib.util.module_from_spec(importlib.util.spec_from_loader("references", loader))
loader.exec_module(references)

SCHEMA = {
    "properties": {
        "mode": {"enum": ["a", "b"], "default": "a", "description": "a|b."},
        "limit": {"type": "number", "exclusiveMinimum": 0},
        "time": {"type": "object", "properties": {"unit": {"$ref": "#/$defs/text"}}, "required": ["unit"]},
        "names": {"type": "array", "items": {"$ref": "#/$defs/text"}},
        "values": {"type": "object", "additionalProperties": {"$ref": "#/$defs/value"}},
    },
    "$defs": {"text": {"type": "string"}, "value": {"properties": {"on": {"type": "boolean"}}}, "terms": {}},
}


def function(text):
    return ast.parse(text).body[0]


class Keys(unittest.TestCase):
    def test_a_row_for_each_key_and_each_below(self):
        self.assertEqual(references.table(SCHEMA, SCHEMA["$defs"]).splitlines()[2:], [
            "| `mode` | `a`, `b` | `a` | a\\|b. |",
            "| `limit` | number > 0 | | |",
            "| `time` | map | | |",
            "| `time.` `unit` | text | required | |",
            "| `names` | list of texts | | |",
            "| `values` | by NAME: [value](#values) | | |",
        ])

    def test_a_definition_without_a_table_ends_it(self):
        begin, end = f"<!-- made from {references.SCHEMA}: ", "<!-- end -->"
        both = f"{begin}experiment -->\nold\n{end}\n{begin}value -->\n{end}\n"
        self.assertIn("| `on` | `true`, `false` | | |", references.experiment_page(both, SCHEMA))
        self.assertNotIn("old", references.experiment_page(both, SCHEMA))
        with self.assertRaises(SystemExit):
            references.experiment_page(both.replace("value", "values"), SCHEMA)


class Names(unittest.TestCase):
    def test_a_signature(self):
        short = function("def f(self, a: int, *, b: 'pd.Frame | None'=None) -> 'C': 0")
        self.assertEqual(references.signature(short, "f"), "f(a: int, *, b: pd.Frame | None = None) -> C")
        self.assertEqual(references.signature(function("def __getitem__(self, name: str) -> float: 0"), "log"),
                         "log[name: str] -> float")
        long = f"def f({', '.join(f'argument_{k}: dict[str, int]' for k in range(5))}) -> None: 0"
        self.assertEqual(len(references.signature(function(long), "f").splitlines()), 7)

    def test_a_docstring(self):
        self.assertEqual(references.prose("One ``a``.\n\n    Two\n    lines.\n\n    >>> f()\n    1\n    "),
                         "One `a`.\n\nTwo lines.\n\n```pycon\n>>> f()\n1\n```")

    def test_every_public_name_is_told(self):
        package = references.Package(ROOT / "python/gapscope")
        page = references.api_page(package)
        public = ast.literal_eval(next(node.value for node in package.modules["__init__"].body
                                       if isinstance(node, ast.Assign)))
        self.assertEqual([name for name in public if f"\n### {name}\n" not in page], [])


class Pages(unittest.TestCase):
    def test_they_are_as_it_makes_them(self):
        for path, made in references.pages():
            self.assertEqual(path.read_text(encoding="utf-8"), made, f"{path}: run scripts/references")


if __name__ == "__main__":
    unittest.main()
