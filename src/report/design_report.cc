#include "src/report/design_report.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "src/report/json.h"

namespace gapscope {
namespace {

using nlohmann::ordered_json;
constexpr double kDegrees = 180 / std::numbers::pi;

std::string BandText(const Waveform& wave) {
  const char* mirrored = wave.mirrored ? ", mirrored" : "";
  switch (wave.shape) {
    case WaveShape::kChirp:
    case WaveShape::kMultisine:
      return fmt::format("{} {:.3g} to {:.3g} Hz{}", NameOf(wave.shape), wave.low_hz, wave.high_hz, mirrored);
    case WaveShape::kSteps:
      return fmt::format("steps held for about {:.3g} s{}", 1 / (2 * wave.low_hz), mirrored);
    default:
      return fmt::format("{}, period {:.3g} s{}", NameOf(wave.shape), 1 / wave.low_hz, mirrored);
  }
}

ordered_json WaveJson(const Waveform& wave, double amplitude, const std::string& unit) {
  return {
      {"shape", NameOf(wave.shape)}, {"amplitude", amplitude},  {"unit", unit},      {"duration_s", wave.duration_s},
      {"low_hz", wave.low_hz},       {"high_hz", wave.high_hz}, {"seed", wave.seed}, {"mirrored", wave.mirrored}};
}

ordered_json ExtremesJson(const Rehearsal& rehearsal) {
  ordered_json list = ordered_json::array();
  for (const auto& e : rehearsal.extremes)
    list.push_back({{"name", e.name}, {"unit", e.unit}, {"reached", JsonNumber(e.reached)}, {"limit", e.limit}});
  return list;
}

std::string RehearsalTable(const Waveform& wave, double amplitude, const std::string& unit,
                           const Rehearsal& rehearsal) {
  std::string text = fmt::format("{}, {:.4g} s, amplitude {:.4g} {}\n\n{:<28} {:>11} {:>11}\n", BandText(wave),
                                 wave.duration_s, amplitude, unit, "on the nominal model", "reached", "limit");
  for (const auto& e : rehearsal.extremes)
    text += fmt::format("{:<28} {:>11.4g} {:>11.4g} {}\n", e.name, e.reached, e.limit, e.unit);
  if (rehearsal.extremes.empty()) text += "no limits are stated in the experiment file\n";
  return text;
}

}  // namespace

std::string TrimmedNumber(double value, int decimals) {
  std::string text = fmt::format("{:.{}f}", value, decimals);
  const std::size_t dot = text.find('.');
  if (dot == std::string::npos) return text;
  while (text.size() > dot + 2 && text.back() == '0') text.pop_back();
  return text;
}

std::string ToTable(const ChirpRun& run) {
  const std::vector<ChirpRow>& rows = run.rows;
  std::string text = fmt::format("{:<34}", "damping ratio");
  const auto line = [&](const std::string& name, const auto& cell) {
    text += fmt::format("\n{:<34}", name);
    for (const auto& row : rows) text += fmt::format(" {:>12}", cell(row));
  };
  for (const auto& row : rows) text += fmt::format(" {:>12}", TrimmedNumber(row.damping_ratio, 6));
  line("Kp, N m/rad", [](const ChirpRow& r) { return TrimmedNumber(r.kp_n_m_per_rad, 4); });
  line("Kd, N m s/rad", [](const ChirpRow& r) { return TrimmedNumber(r.kd_n_m_s_per_rad, 4); });
  // The document divides the gains as it prints them.
  const auto printed = [](double gain) { return std::round(gain * 1e4) / 1e4; };
  line("Kp / Kd, 1/s", [&](const ChirpRow& r) {
    return fmt::format("{:.4f}", printed(r.kp_n_m_per_rad) / printed(r.kd_n_m_s_per_rad));
  });
  line("settling time, s", [](const ChirpRow& r) { return TrimmedNumber(r.settling_time_s, 4); });
  line("bandwidth, Hz", [](const ChirpRow& r) { return TrimmedNumber(r.bandwidth_hz, 2); });
  for (std::size_t i = 0; i < rows.front().chirps.size(); ++i) {
    const std::string times = TrimmedNumber(rows.front().chirps[i].end_over_bandwidth, 6);
    line("end at " + times + " x bandwidth, Hz",
         [i](const ChirpRow& r) { return TrimmedNumber(r.chirps[i].end_frequency_hz, 2); });
    line("  amplitude, deg", [i](const ChirpRow& r) { return TrimmedNumber(r.chirps[i].amplitude_rad * kDegrees, 6); });
  }
  return text + "\n";
}

ordered_json ToJson(const ChirpRun& run) {
  ordered_json json = {{"schema", "gapscope.design.chirp/1"}, {"rows", ordered_json::array()}};
  for (const auto& row : run.rows) {
    ordered_json chirps = ordered_json::array();
    for (const auto& c : row.chirps)
      chirps.push_back({{"end_over_bandwidth", c.end_over_bandwidth},
                        {"end_frequency_hz", c.end_frequency_hz},
                        {"amplitude_deg", c.amplitude_rad * kDegrees}});
    json["rows"].push_back({{"damping_ratio", row.damping_ratio},
                            {"kp_n_m_per_rad", row.kp_n_m_per_rad},
                            {"kd_n_m_s_per_rad", row.kd_n_m_s_per_rad},
                            {"settling_time_s", row.settling_time_s},
                            {"bandwidth_hz", row.bandwidth_hz},
                            {"chirps", chirps}});
  }
  json["versions"] = JsonVersions(run.info);
  return json;
}

Result<std::string> ChirpCsv(const std::vector<ChirpRow>& rows, const ChirpRequest& request, double start_hz,
                             double duration_s, double rate_hz) {
  constexpr double kRest_s = 1;
  std::string text =
      "time_s,target_rad,target_rad_per_s,target_limit_rad,speed_limit_rad_per_s,kp_n_m_per_rad,kd_n_m_s_per_rad,"
      "damping_ratio,end_over_bandwidth\n";
  double begin_s = 0;
  for (const auto& row : rows) {
    for (const auto& chirp : row.chirps) {
      const Waveform wave{
          .shape = WaveShape::kChirp, .duration_s = duration_s, .low_hz = start_hz, .high_hz = chirp.end_frequency_hz};
      GS_ASSIGN(const std::vector<double> values, SampleWaveform(wave, rate_hz));
      const std::size_t rest =
          &row == &rows.back() && &chirp == &row.chirps.back() ? 0 : static_cast<std::size_t>(kRest_s * rate_hz);
      for (std::size_t k = 0; k < values.size() + rest; ++k) {
        const double t = static_cast<double>(k) / rate_hz;
        const double phase_rate =
            2 * std::numbers::pi * (start_hz + (chirp.end_frequency_hz - start_hz) * t / duration_s);
        const double phase =
            2 * std::numbers::pi * (start_hz * t + (chirp.end_frequency_hz - start_hz) / (2 * duration_s) * t * t);
        const bool moving = k < values.size();
        fmt::format_to(std::back_inserter(text),
                       "{:.10g},{:.10g},{:.10g},{:.10g},{:.10g},{:.10g},{:.10g},{:.10g},{:.10g}\n", begin_s + t,
                       moving ? chirp.amplitude_rad * values[k] : 0.0,
                       moving ? chirp.amplitude_rad * std::cos(phase) * phase_rate : 0.0, chirp.amplitude_rad,
                       request.speed_limit_rad_per_s, row.kp_n_m_per_rad, row.kd_n_m_s_per_rad, row.damping_ratio,
                       chirp.end_over_bandwidth);
      }
      begin_s += static_cast<double>(values.size() + rest) / rate_hz;
    }
  }
  return text;
}

std::string ToTable(const InputRun& run) { return RehearsalTable(run.wave, run.amplitude, run.unit, run.rehearsal); }

ordered_json ToJson(const InputRun& run) {
  ordered_json json = {{"schema", "gapscope.design.input/1"}};
  json.update(WaveJson(run.wave, run.amplitude, run.unit));
  json["offset"] = run.offset;
  json["limits"] = ExtremesJson(run.rehearsal);
  json["versions"] = JsonVersions(run.info);
  return json;
}

std::string ToTable(const OptimalRun& run) {
  const OptimalDesign& design = run.design;
  const bool of_effects = run.purpose == OptimalRun::Purpose::kEffects;
  std::string text;
  for (std::size_t i = 0; i < design.targets.size(); ++i) text += fmt::format("[{}] {}\n", i + 1, design.targets[i]);
  text += of_effects ? "what is left when the second is fitted to the first, in sensor floors (root mean square)\n\n"
                     : "standard deviation over the value, one such log\n\n";
  text += fmt::format("{:<40} {:>10}", "input", "amplitude");
  for (std::size_t i = 0; i < design.targets.size(); ++i) text += fmt::format(" {:>10}", fmt::format("[{}]", i + 1));
  text += "\n";
  for (const auto& input : design.inputs) {
    text += fmt::format("{:<40} {:>10}", BandText(input.wave), fmt::format("{:.3g} {}", input.amplitude, run.unit));
    for (const double value : input.per_target)
      text += fmt::format(" {:>10}", of_effects ? fmt::format("{:.3g}", value) : fmt::format("{:.3g} %", 100 * value));
    text += input.refined ? "\n" : "   (fitted roughly)\n";
  }
  for (const auto& value : design.values) text += "assumed " + value + "\n";
  if (!design.inputs.empty()) {
    text += "\n" + RehearsalTable(design.inputs.front().wave, design.inputs.front().amplitude, run.unit,
                                  design.inputs.front().rehearsal);
    if (of_effects && design.inputs.front().score < 1)
      text +=
          "even the best input leaves a pair below one sensor floor: these effects are hard to tell apart on this "
          "rig\n";
  }
  text += fmt::format("\n{}\n", run.command);
  return text;
}

ordered_json ToJson(const OptimalRun& run) {
  const OptimalDesign& design = run.design;
  const bool of_effects = run.purpose == OptimalRun::Purpose::kEffects;
  ordered_json json = {{"schema", "gapscope.design.optimal/1"},
                       {"measure", of_effects ? "floors_left_after_imitation" : "standard_deviation_over_value"},
                       {"targets", design.targets},
                       {"inputs", ordered_json::array()}};
  for (const auto& input : design.inputs) {
    ordered_json entry = WaveJson(input.wave, input.amplitude, run.unit);
    ordered_json values = ordered_json::array();
    for (const double value : input.per_target) values.push_back(JsonNumber(value));
    entry["per_target"] = values;
    entry["score"] = JsonNumber(input.score);
    entry["fitted_in_full"] = input.refined;
    entry["limits"] = ExtremesJson(input.rehearsal);
    json["inputs"].push_back(std::move(entry));
  }
  json["assumed"] = design.values;
  json["command"] = run.command;
  json["versions"] = JsonVersions(run.info);
  return json;
}

}  // namespace gapscope
