#include "src/design/chirp.h"

#include <cmath>
#include <numbers>
#include <string>

namespace gapscope {
namespace {

Status CheckPositive(double value, const char* flag) {
  if (std::isfinite(value) && value > 0) return Ok();
  return Error{.what = "not a finite number above zero", .where = flag, .actual = std::to_string(value)};
}

}  // namespace

double BandwidthRatio(double z) {
  const double z2 = z * z;
  const double inner = 1 - 2 * z2, root = std::sqrt(4 * z2 * z2 - 4 * z2 + 2);
  // Far above critical damping the two nearly cancel: 1 / (root - inner) is the same number without that.
  return std::sqrt(inner > 0 ? inner + root : 1 / (root - inner));
}

Result<std::vector<ChirpRow>> DesignChirps(const ChirpRequest& request) {
  GS_RETURN_IF_ERROR(CheckPositive(request.inertia_kg_m2, "--inertia-kg-m2"));
  GS_RETURN_IF_ERROR(CheckPositive(request.natural_frequency_hz, "--natural-frequency-hz"));
  GS_RETURN_IF_ERROR(CheckPositive(request.speed_limit_rad_per_s, "--speed-limit-rpm"));
  GS_RETURN_IF_ERROR(CheckPositive(request.amplitude_factor, "--amplitude-factor"));
  if (request.amplitude_factor > 1) {
    return Error{.what = "the amplitude would pass the speed limit",
                 .where = "--amplitude-factor",
                 .actual = std::to_string(request.amplitude_factor),
                 .allowed = "above 0, at most 1"};
  }
  if (request.damping_ratios.empty() || request.end_over_bandwidth.empty())
    return Error{.what = "no damping ratio or no end of the chirp is given",
                 .where = "--damping-ratio, --end-over-bandwidth"};
  for (const double n : request.end_over_bandwidth) GS_RETURN_IF_ERROR(CheckPositive(n, "--end-over-bandwidth"));
  const double w = 2 * std::numbers::pi * request.natural_frequency_hz;
  std::vector<ChirpRow> rows;
  for (const double z : request.damping_ratios) {
    GS_RETURN_IF_ERROR(CheckPositive(z, "--damping-ratio"));
    ChirpRow row{.damping_ratio = z,
                 .kp_n_m_per_rad = request.inertia_kg_m2 * w * w,
                 .kd_n_m_s_per_rad = 2 * z * request.inertia_kg_m2 * w,
                 .settling_time_s = 4 / (z * w),
                 .bandwidth_hz = request.natural_frequency_hz * BandwidthRatio(z)};
    for (const double n : request.end_over_bandwidth) {
      const double end_hz = n * row.bandwidth_hz;
      row.chirps.push_back({.end_over_bandwidth = n,
                            .end_frequency_hz = end_hz,
                            .amplitude_rad = request.amplitude_factor * request.speed_limit_rad_per_s /
                                             (2 * std::numbers::pi * end_hz)});
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace gapscope
