#include "src/log/inspect_json.h"

#include <nlohmann/json.hpp>

namespace gapscope {
namespace {

using OrderedJson = nlohmann::ordered_json;

const char* Name(ChannelRole role) { return role == ChannelRole::kCommand ? "command" : "measured"; }

// Names may come from files that are not UTF-8 through and through; the writer would throw.
std::string Clean(const std::string& text) {
  return OrderedJson::parse(OrderedJson(text).dump(-1, ' ', false, OrderedJson::error_handler_t::replace))
      .get<std::string>();
}

OrderedJson ToJson(const Finding& finding) {
  return {{"kind", finding.kind},
          {"column", Clean(finding.column)},
          {"count", finding.count},
          {"first_row", finding.first_row},
          {"text", Clean(finding.text)}};
}

OrderedJson ToJson(const ChannelReport& channel) {
  return {{"name", Clean(channel.name)},
          {"unit", Clean(channel.unit)},
          {"role", Name(channel.role)},
          {"minimum", channel.minimum},
          {"maximum", channel.maximum},
          {"mean", channel.mean},
          {"deviation", channel.deviation},
          {"quantisation_step", channel.quantisation_step},
          {"noise", channel.noise},
          {"saturation_share", channel.saturation_share},
          {"missing_share", channel.missing_share}};
}

OrderedJson ToJson(const DelayReport& delay) {
  return {{"command", Clean(delay.command)},
          {"measured", Clean(delay.measured)},
          {"delay_s", delay.delay_s},
          {"correlation", delay.correlation},
          {"reliable", delay.reliable}};
}

OrderedJson ToJson(const CommandExcitation& command) {
  OrderedJson bands = OrderedJson::array();
  for (const auto& band : command.bands)
    bands.push_back({{"low_hz", band.low_hz}, {"high_hz", band.high_hz}, {"share", band.share}});
  return {{"command", Clean(command.name)},
          {"range", command.range},
          {"bandwidth_95_hz", command.bandwidth_95_hz},
          {"peak_hz", command.peak_hz},
          {"half_cycles", command.half_cycles},
          {"amplitude_ratio", command.amplitude_ratio},
          {"bands", std::move(bands)}};
}

OrderedJson ToJson(const MotionCoverage& motion) {
  return {{"signal", Clean(motion.name)},        {"range", motion.range},
          {"speed_max", motion.speed_max},       {"reversals", motion.reversals},
          {"moving_share", motion.moving_share}, {"rest_share", motion.rest_share},
          {"slow_share", motion.slow_share},     {"positive_share", motion.positive_share}};
}

template <class T>
OrderedJson ListToJson(const std::vector<T>& items) {
  OrderedJson list = OrderedJson::array();
  for (const auto& item : items) list.push_back(ToJson(item));
  return list;
}

OrderedJson TextsToJson(const std::vector<std::string>& texts) {
  OrderedJson list = OrderedJson::array();
  for (const auto& text : texts) list.push_back(Clean(text));
  return list;
}

}  // namespace

nlohmann::ordered_json ToJson(const InspectReport& report, const std::string& log_path) {
  return {{"log", Clean(log_path)},
          {"fit", report.fit},
          {"unfit_because", TextsToJson(report.unfit_because)},
          {"verdict", TextsToJson(report.verdict)},
          {"time",
           {{"column", Clean(report.time_column)},
            {"unit", report.time_unit},
            {"rows", report.rows},
            {"rows_in_log", report.rows_in_log},
            {"duration_s", report.duration_s},
            {"rate_hz", report.rate_hz},
            {"median_step_s", report.median_step_s},
            {"shortest_step_s", report.shortest_step_s},
            {"longest_step_s", report.longest_step_s},
            {"jitter_s", report.jitter_s},
            {"gaps", report.gaps}}},
          {"findings", ListToJson(report.findings)},
          {"channels", ListToJson(report.channels)},
          {"delays", ListToJson(report.delays)},
          {"excitation", ListToJson(report.excitation)},
          {"coverage", ListToJson(report.coverage)}};
}

}  // namespace gapscope
