#include "src/identify/slides.h"

#include <algorithm>
#include <cmath>

#include "src/core/statistics.h"
#include "src/identify/filter.h"
#include "src/identify/torque.h"

namespace gapscope {

bool Slides::MayPull() const {
  double lowest = kInfinity, highest = -kInfinity;
  for (const auto& s : rows) lowest = std::min(lowest, s.angle), highest = std::max(highest, s.angle);
  return highest - lowest < 12.6;
}

Result<Slides> LoadSlides(const IdentifyInput& input, int joint, const IdentifyOptions& options) {
  Slides slides;
  std::vector<Motion> motions;
  std::vector<std::size_t> reaches;
  std::vector<std::vector<double>>
      quick;  // speeds behind the usual low pass: a motion faster than a lower one reverses unseen
  double resolution = 0;
  for (std::size_t log = 0; log < input.recordings.size(); ++log) {
    GS_ASSIGN(Motion motion, MotionOf(input, log, joint, options));
    const SmoothLog smooth(input.recordings[log], options);
    slides.dt_s = smooth.dt_s();
    reaches.push_back(smooth.reach());
    IdentifyOptions usual = options;
    usual.cutoff_hz = 0;
    const auto* logged = FindSignal(input.model, input.recordings[log], SignalKind::kPosition, joint);
    quick.push_back(SmoothLog(input.recordings[log], usual).Sampled(logged->values, 1));
    for (const double v : motion.speed_rad_per_s) {
      if (std::isfinite(v)) slides.fastest = std::max(slides.fastest, std::abs(v));
    }
    // One count over the filter's width.
    if (const auto* angle = FindSignal(input.model, input.recordings[log], SignalKind::kPosition, joint))
      resolution = std::max(resolution, angle->spec.resolution * smooth.cutoff_hz());
    slides.torque_logged = motion.torque_logged;
    motions.push_back(std::move(motion));
  }
  slides.least = std::max(0.02 * slides.fastest, 2 * resolution);
  for (std::size_t log = 0; log < motions.size(); ++log) {
    const Motion& m = motions[log];
    const std::vector<char> sliding = Sliding(m.speed_rad_per_s, quick[log], slides.least, reaches[log] / 2);
    for (std::size_t i = 0; i < sliding.size(); ++i) {
      if (!sliding[i] || !std::isfinite(m.drive_n_m[i]) || !std::isfinite(m.demand_n_m[i])) continue;
      slides.rows.push_back({static_cast<int>(log), m.time_s[i], m.angle_rad[i], m.speed_rad_per_s[i],
                             m.acceleration_rad_per_s2[i], m.drive_n_m[i], m.demand_n_m[i], m.others_n_m[i]});
    }
  }
  std::size_t forward = 0;
  for (const auto& row : slides.rows) forward += row.speed > 0 ? 1 : 0;
  if (slides.rows.size() < 50 || forward < 10 || slides.rows.size() - forward < 10) {
    return Error{.what = "the joint hardly slides in both directions",
                 .where = input.recordings.front().log_path,
                 .actual = std::to_string(forward) + " rows forward, " + std::to_string(slides.rows.size() - forward) +
                           " backward",
                 .allowed = "at least 10 each and 50 in all",
                 .cure = "a ladder of the command or a slow triangle"};
  }
  return slides;
}

IdentifyOptions ForFreeInertia(const IdentifyInput& input, int joint, IdentifyOptions options) {
  if (options.free_inertia) options.cutoff_hz = QuietCutoff(input, joint, 2, 0.003, options);
  return options;
}

void RemarkUnloggedTorque(const Slides& slides, Identification* result) {
  if (!slides.torque_logged)
    result->remarks.push_back(
        "the drive's torque is the model's, from command and speed: errors of its torque and back-EMF constants show "
        "as friction");
}

}  // namespace gapscope
