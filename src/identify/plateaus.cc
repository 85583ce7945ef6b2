#include "src/identify/plateaus.h"

#include <cmath>

#include "src/core/statistics.h"

namespace gapscope {
namespace {

double Slope(const std::vector<double>& t, const std::vector<double>& y, std::size_t from, std::size_t to) {
  double st = 0, sy = 0, n = 0;
  for (std::size_t k = from; k < to; ++k) {
    if (std::isfinite(y[k])) st += t[k], sy += y[k], n += 1;
  }
  double tt = 0, ty = 0;
  for (std::size_t k = from; k < to; ++k) {
    if (std::isfinite(y[k])) tt += (t[k] - st / n) * (t[k] - st / n), ty += (t[k] - st / n) * (y[k] - sy / n);
  }
  return tt > 0 ? ty / tt : kNaN;
}

double Mean(const std::vector<double>& y, std::size_t from, std::size_t to) {
  double sum = 0, n = 0;
  for (std::size_t k = from; k < to; ++k) {
    if (std::isfinite(y[k])) sum += y[k], n += 1;
  }
  return n > 0 ? sum / n : kNaN;
}

}  // namespace

std::vector<Plateau> FindPlateaus(const IdentifyInput& input, int joint,
                                  const std::vector<std::vector<double>>& current, const IdentifyOptions& options,
                                  double least_s) {
  std::vector<Plateau> plateaus;
  for (std::size_t log = 0; log < input.recordings.size(); ++log) {
    const Recording& recording = input.recordings[log];
    const auto& t = recording.time_s;
    const auto& command = recording.commands.front().values;
    const auto* angle = FindSignal(input.model, recording, SignalKind::kPosition, joint);
    const auto* torque = FindSignal(input.model, recording, SignalKind::kTorque, joint);
    std::size_t begin = 0;
    for (std::size_t k = 1; k <= t.size(); ++k) {
      if (k < t.size() && std::abs(command[k] - command[begin]) <= 1e-9 * (1 + std::abs(command[begin]))) continue;
      const std::size_t last = k - 1, middle = begin + (last - begin) / 2, quarter = middle + (last - middle) / 2;
      const bool inside = t[begin] >= options.from_s && (options.to_s <= 0 || t[last] <= options.to_s);
      if (inside && t[last] - t[begin] >= least_s && last - middle >= 8) {
        Plateau p{.log = static_cast<int>(log),
                  .from_s = t[middle],
                  .to_s = t[last],
                  .command = command[begin],
                  .rows = last - middle};
        p.speed = angle ? Slope(t, angle->values, middle, last) : kNaN;
        p.acceleration = angle ? (Slope(t, angle->values, quarter, last) - Slope(t, angle->values, middle, quarter)) /
                                     (t[quarter] - t[middle])
                               : kNaN;
        p.current = current.empty() || current[log].empty() ? kNaN : Mean(current[log], middle, last);
        p.torque = torque ? Mean(torque->values, middle, last) : kNaN;
        plateaus.push_back(p);
      }
      begin = k;
    }
  }
  return plateaus;
}

}  // namespace gapscope
