// The language of experiment files, and the units of its formulas.
#include "src/experiment/expression.h"

#include "src/experiment/formula_units.h"
#include "tests/fuzz/fuzz.h"

FUZZ_TARGET(expression) {
  using namespace gapscope;
  static const std::map<std::string, std::string> units = {
      {"angle", "rad"}, {"speed", "rad/s"}, {"command", "V"}, {"log.kp", ""}, {"gear@the arm.gain", "N m/V"}};
  static double numbers[] = {0.5, -2, 3, 0, 1e-3};
  std::vector<std::string> names;
  for (const auto& [name, unit] : units) names.push_back(name);
  const std::string text(fuzz::Text(data, size));
  const auto parsed = Expression::Parse(text, names, numbers, "file.yaml:1:1");
  if (!parsed.ok()) {
    fuzz::CheckRefusal(parsed.error(), "file.yaml:1:1");
  } else {
    for (const double angle : {0.5, 0.0, -1e300}) {
      numbers[0] = angle;
      parsed.value().Evaluate();
    }
    if (WithNames(text, {{"speed", "speed"}}) != text) fuzz::Complain("the same names make another text");
  }
  if (const Status agree = CheckFormulaUnits(text, units, "N m", "file.yaml:1:1"); !agree.ok())
    fuzz::CheckRefusal(agree.error(), "file.yaml:1:1");
  fuzz::whole = parsed.ok();
  return 0;
}
