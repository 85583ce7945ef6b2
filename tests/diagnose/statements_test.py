"""scripts/blind/statements.py on cases small enough to be counted by hand."""
import sys, unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts" / "blind"))
import calibrate, score, statements  # noqa: E401, E402


def label(*effects, outside=""):
    made = [{"name": n, "on": on, "parameters": p, "effect_to_floor_refit": 20.0, "stands_clear": clear}
            for n, on, p, clear in effects]
    told = {"kind": "rough", "rig": "qube", "effects": made, "ambiguous": [], "effect_to_floor_refit": 9.0,
            "logs": [{"rate_hz": 500}] * 4,
            "expected_verdicts": ["effects"] if made else ["unknown"] if outside else ["unknown", "none", "parameters"]}
    return {**told, "outside": {"name": outside}} if outside else told


def statement(name, on, probability, answer="present", group=None, **rest):
    return {"name": name, "on": on, "answer": answer, "probability": probability, "group": group, **rest}


def case(label_, *told, verdict="effects"):
    sure = [{"name": s["name"], "on": s["on"]} for s in told if s["answer"] == "present" and s["probability"] >= 0.5]
    return score.Case(0, label_, {"verdict": verdict, "probability": 0.8, "effects": sure, "ambiguous": [],
                                  "statements": list(told), "gap": {"refit": 1.0, "final": 0.5}, "candidates": []})


FRICTION = ("coulomb_friction", "arm", {"friction_n_m": 0.1}, True)
LATE = ("command_delay", "motor", {"delay_s": 0.008}, True)
WEAK = ("dead_zone", "motor", {"half_width_v": 0.1}, False)


class Statements(unittest.TestCase):
    def rows(self, *cases):
        return {r["name"]: r for r in statements.figures(list(cases), 1)["rows"]}

    def share(self, row):
        return row["hits"], row["cases"]

    def test_counts(self):
        size = {"friction_n_m": {"value": 0.11, "low": 0.09, "high": 0.12}}
        rows = self.rows(
            case(label(FRICTION, LATE), statement("coulomb_friction", "arm", 0.9, parameters=size),
                 statement("actuator_lag", "motor", 0.6, group=1, parameters={}),
                 statement("command_delay", "motor", 0.4, group=1, parameters={}), verdict="ambiguous"),
            case(label(FRICTION), statement("coulomb_friction", "pendulum", 0.7)),  # another place: false
            case(label(WEAK), statement("dead_zone", "motor", 0.1), verdict="unknown"),
            case(label(), statement("torque_bias", "arm", 0.2), verdict="unknown"),
            case(label(outside="gain_drift"), statement("torque_bias", "arm", 0.55)))
        self.assertEqual(self.share(rows["named where only roughness is"]), (0, 1))
        self.assertEqual(self.share(rows["named where the cause is outside the list"]), (1, 1))
        self.assertEqual(self.share(rows["statements with P >= 0.5 that are true"]), (2, 4))
        self.assertEqual(self.share(rows["effects that stand clear, named"]), (2, 3))
        self.assertEqual(self.share(rows["all effects, named"]), (2, 4))
        self.assertEqual(self.share(rows["95 % intervals that hold the truth (88 to 98)"]), (1, 1))
        self.assertAlmostEqual(rows["effect parameter, median error"]["value"], 0.1)
        self.assertEqual(self.share(rows["two effects that stand clear: exact set"]), (1, 1))
        self.assertEqual(self.share(rows["verdict right"]), (3, 5))
        self.assertEqual(rows["calibration error of statements"]["cases"], 6)

    def test_absent_is_true_below_its_bound(self):
        low = statement("coulomb_friction", "arm", 0.9, "absent", bound={"friction_n_m": 0.01})
        high = statement("coulomb_friction", "arm", 0.9, "absent", bound={"friction_n_m": 0.2})
        none = statement("backlash", "arm", 0.9, "absent", bound={"gap_rad": 0.01})
        row = self.rows(case(label(FRICTION), low, high, none))["absent statements that are true"]
        self.assertEqual(self.share(row), (2, 3))

    def test_a_droop_is_told_at_another_peak_than_the_twins(self):
        truth = label(("torque_constant_droop", "motor", {"loss_at_peak": 0.6}, True))
        truth["effects"][0]["twin_parameters"] = {"exponent": 2.0, "peak_n_m": 10.0}
        told = statement("torque_constant_droop", "motor", 0.9, parameters={
            "loss_at_peak": {"value": 0.14, "low": 0.12, "high": 0.16}}, **{
                "with": {"values": {"scale@motor.torque_n_m": 5.0}}})
        rows = self.rows(case(truth, told))
        self.assertEqual(self.share(rows["95 % intervals that hold the truth (88 to 98)"]), (1, 1))
        self.assertAlmostEqual(rows["effect parameter, median error"]["value"], abs(0.14 / 0.15 - 1))

    def test_a_verdict_without_statements_is_read(self):
        verdict = {"verdict": "ambiguous", "probability": 0.7, "ambiguous": [["command_delay", "actuator_lag"]],
                   "effects": [{"name": "actuator_lag", "on": "motor", "probability": 0.4, "parameters": {}}],
                   "candidates": [{"name": "command_delay", "on": "motor", "probability": 0.3}]}
        found = statements.findings(score.Case(0, label(LATE), verdict))
        self.assertEqual([(f.probability, f.true, len(f.names)) for f in found], [(0.7, True, 2)])

    def test_calibration(self):
        error, bins = statements.calibration([(0.9, True), (0.9, False), (0.1, False), (0.1, False)], bins=2)
        self.assertAlmostEqual(error, 0.25)
        self.assertAlmostEqual(calibrate.auc([3.0, 2.0, 2.0, 1.0], [1.0, 1.0, 0.0, 0.0]), 0.875)
        weights = calibrate.logistic([[v] for v in (-2.0, -1.0, 1.0, 2.0)] * 20, [0.0, 0.0, 1.0, 1.0] * 20)
        self.assertGreater(calibrate.probability(weights, [1.0]), 0.9)


if __name__ == "__main__":
    unittest.main()
