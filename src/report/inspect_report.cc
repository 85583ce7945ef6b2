#include "src/report/inspect_report.h"

#include <fmt/core.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "src/log/inspect_json.h"
#include "src/report/json.h"

namespace gapscope {
namespace {

std::string Percent(double share) { return std::isfinite(share) ? fmt::format("{:.3g} %", 100 * share) : "-"; }

std::string LogTable(const InspectReport& r, const std::string& log_path) {
  std::string text = fmt::format("{}\n  {}\n", log_path, r.fit ? "fit for use" : "NOT fit for use");
  for (const auto& reason : r.unfit_because) text += "  because " + reason + "\n";
  text += fmt::format(
      "  {} rows of {}, {:.3f} s, {:.1f} Hz; step median {:.3f} ms, {:.3f} .. {:.3f} ms, jitter {:.3f} ms; {} gap{}; "
      "time from '{}' in {}\n",
      r.rows, r.rows_in_log, r.duration_s, r.rate_hz, 1e3 * r.median_step_s, 1e3 * r.shortest_step_s,
      1e3 * r.longest_step_s, 1e3 * r.jitter_s, r.gaps, r.gaps == 1 ? "" : "s", r.time_column, r.time_unit);
  text += fmt::format("\n  {:<22} {:<9} {:>10} {:>10} {:>10} {:>10} {:>9} {:>8}\n", "channel", "role", "min", "max",
                      "count", "noise", "saturated", "missing");
  for (const auto& c : r.channels) {
    text += fmt::format("  {:<22} {:<9} {:>10.4g} {:>10.4g} {:>10.3g} {:>10.2g} {:>9} {:>8}\n", c.name,
                        c.role == ChannelRole::kCommand ? "command" : "measured", c.minimum, c.maximum,
                        c.quantisation_step, c.noise, Percent(c.saturation_share), Percent(c.missing_share));
  }
  for (const auto& d : r.delays) {
    text += fmt::format("  {} follows {} by {:.2f} ms (correlation {:.2f}){}\n", d.measured, d.command, 1e3 * d.delay_s,
                        d.correlation, d.reliable ? "" : ", not reliable");
  }
  for (const auto& e : r.excitation) {
    text += fmt::format("  {}: 95 % of its power below {:.3g} Hz, peak at {:.3g} Hz, range {:.4g}, {} half cycles\n",
                        e.name, e.bandwidth_95_hz, e.peak_hz, e.range, e.half_cycles);
  }
  for (const auto& m : r.coverage) {
    text += fmt::format("  {}: range {:.4g}, speed to {:.4g}, {} reversals, moving {} of the time, slowly {}\n", m.name,
                        m.range, m.speed_max, m.reversals, Percent(m.moving_share), Percent(m.slow_share));
  }
  for (const auto& finding : r.findings) text += "  found: " + finding.text + "\n";
  for (const auto& line : r.verdict) text += "  - " + line + "\n";
  return text;
}

}  // namespace

nlohmann::ordered_json ToJson(const InspectRun& run) {
  nlohmann::ordered_json json = {{"schema", "gapscope.inspect/1"}, {"logs", nlohmann::ordered_json::array()}};
  for (const auto& [log, report] : run.logs) json["logs"].push_back(ToJson(report, log));
  json["versions"] = JsonVersions(run.info);
  return json;
}

std::string ToTable(const InspectRun& run) {
  std::string text;
  for (const auto& [log, report] : run.logs) {
    if (!text.empty()) text += '\n';
    text += LogTable(report, log);
  }
  return text;
}

}  // namespace gapscope
