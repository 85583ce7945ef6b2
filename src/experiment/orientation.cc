#include "src/experiment/orientation.h"

#include <cmath>

#include "src/core/collect.h"
#include "src/core/names.h"

namespace gapscope {
namespace {

constexpr double kUnit = 0.01;  // of the length: a log of two decimals is as far off

Error NoUnitQuaternion(const Log& log, std::size_t row, const std::array<const Column*, kQuaternion>& columns,
                       const std::string& signal, double length) {
  const std::vector<std::string> names = Collect(columns, [](const Column* column) { return column->name; });
  return Error{.what = "the columns of the orientation '" + signal + "' are no unit quaternion",
               .where = log.Where(row) + ", columns " + Join(names),
               .actual = "length " + std::to_string(length),
               .allowed = "1, to 0.01",
               .cure =
                   "name the four columns in the order w, x, y, z, or say 'order: xyzw'; rows without an orientation "
                   "are left empty"};
}

}  // namespace

Result<std::array<Recording::Measured, kTurns>> BindOrientation(const Experiment& experiment, std::size_t index,
                                                                const Log& log, const Timeline& timeline,
                                                                const std::array<const Column*, kQuaternion>& columns,
                                                                std::vector<Finding>* findings) {
  std::array<std::vector<double>, kQuaternion> numbers;
  for (std::size_t i = 0; i < kQuaternion; ++i) {
    GS_ASSIGN(numbers[i],
              ExtractColumn(log, timeline, *columns[i], {.missing = experiment.timeline.missing}, findings));
  }
  const MeasuredSpec* specs = experiment.measured.data() + index;
  const std::size_t rows = timeline.time_s.size();
  std::array<Recording::Measured, kTurns> turns;
  for (std::size_t e = 0; e < kTurns; ++e) {
    turns[e] = {.spec = specs[e], .index = index + e, .column = columns[e + 1]->name, .values = {}};
    turns[e].values.assign(rows, std::nan(""));
  }
  Vector3 last = {};
  bool begun = false;
  for (std::size_t row = 0; row < rows; ++row) {
    const Quaternion q = {numbers[0][row], numbers[1][row], numbers[2][row], numbers[3][row]};
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (std::isnan(length)) continue;
    if (!(std::abs(length - 1) <= kUnit))
      return NoUnitQuaternion(log, timeline.rows[row], columns, specs->signal.substr(0, specs->signal.rfind('[')),
                              length);
    const Quaternion unit = Normalised(q);
    if (!begun) {
      for (auto& turn : turns) turn.reference = unit;
    }
    begun = true;
    last = NearestTurn(LogRotation(Conjugate(turns[0].reference) * unit), last);
    for (std::size_t e = 0; e < kTurns; ++e) turns[e].values[row] = last[e];
  }
  return turns;
}

}  // namespace gapscope
