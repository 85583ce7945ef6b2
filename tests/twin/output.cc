#include "tests/twin/output.h"

#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

namespace gapscope::twin {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

// Nine digits: far below any sensor's noise, and the same on every platform.
void Append(double value, std::string* text) {
  char buffer[32];
  const auto [end, code] = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::general, 9);
  text->append(buffer, code == std::errc() ? end : buffer);
}

Json ToJson(const Values& values) {
  Json json = Json::object();
  for (const auto& [name, value] : values) json[name] = value;
  return json;
}

Json SensorJson(const Sensor& sensor) {
  return {
      {"floor_rad", sensor.Floor()},   {"offset_rad", sensor.offset_rad},     {"resolution_rad", sensor.resolution_rad},
      {"white_rad", sensor.white_rad}, {"coloured_rad", sensor.coloured_rad}, {"colour_time_s", sensor.colour_time_s}};
}

std::vector<std::string> ExpectedVerdicts(const Label& c) {
  switch (c.kind) {
    case Kind::kNone:
      return c.nominal_base ? std::vector<std::string>{"none"} : std::vector<std::string>{"none", "parameters"};
    case Kind::kUnknown:
      return {"unknown"};
    case Kind::kAmbiguous:
      return {"ambiguous"};
    case Kind::kRough:  // nothing to name: much is missing, or (where the roughness is weak) nothing is
      if (!c.effects.empty()) return {"effects"};
      if (!c.outside.empty()) return {"unknown"};
      return {"unknown", "none", "parameters"};
    default:
      return {"effects"};
  }
}

Json RoughTermJson(const RoughTerm& t) {
  Json json = {{"amplitude", t.amplitude}, {"angle", t.angle}, {"speed", t.speed}, {"phase_rad", t.phase_rad}};
  if (t.drift_hz > 0) {
    json.update({{"drift_hz", t.drift_hz},
                 {"swing", t.swing},
                 {"swing_phase_rad", t.swing_phase_rad},
                 {"wander_rad", t.wander_rad},
                 {"wander_phase_rad", t.wander_phase_rad}});
  }
  return json;
}

Json RoughJson(const std::vector<Label::Roughness>& roughness) {
  Json list = Json::array();
  for (const Label::Roughness& label : roughness) {
    const Rough& rough = label.rough;
    Json terms = Json::array();
    for (const RoughTerm& t : rough.terms) terms.push_back(RoughTermJson(t));
    list.push_back({{"on", label.on},
                    {"of", RoughKindName(KindOf(rough))},
                    {"hysteretic", rough.memory_rad > 0},
                    {"drifting", rough.terms.at(0).drift_hz > 0},
                    {"rms_n_m", label.rms_n_m},
                    {"alone_to_floor_refit", label.alone},
                    {"to_floor_refit", label.refit},
                    {"most_held", label.held.share},
                    {"most_held_by", label.held.law},
                    {"scale_n_m", rough.scale_n_m},
                    {"middle_rad", rough.middle_rad},
                    {"deviation_rad", rough.angle_rad},
                    {"deviation_rad_per_s", rough.speed_rad_per_s},
                    {"memory_rad", rough.memory_rad},
                    {"terms", terms},
                    {"laws_taken_out", rough.laws}});
  }
  return list;
}

}  // namespace

std::string CsvText(const std::vector<std::string>& names, const std::vector<std::vector<double>>& rows) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) text += (i ? "," : "") + names[i];
  text += '\n';
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (i) text += ',';
      Append(row[i], &text);
    }
    text += '\n';
  }
  return text;
}

Label LabelOf(const Case& c) {
  const RigNames& names = Names(c.rig);
  Label label{.rig = RigName(c.rig),
              .kind = c.kind,
              .seed = c.seed,
              .index = c.index,
              .nominal_base = c.nominal_base,
              .gap = c.gap,
              .rough_refit = c.rough_refit,
              .group = c.group,
              .outside = c.outside,
              .outside_parameters = c.outside_parameters,
              .outside_severity = c.outside_severity};
  for (const EffectLabel& e : c.effects) {
    label.effects.push_back({e.choice.name, PlaceName(c.rig, e.choice.place), e.parameters, e.extra, e.choice.severity,
                             e.gap, e.clear, e.beside_torques});
  }
  for (const RoughLabel& r : c.roughness) {
    const Rough& rough = c.truth.rough[r.place == Place::kSecond ? 1 : 0];
    label.roughness.push_back({PlaceName(c.rig, r.place), rough, r.rms_n_m, r.alone, r.refit, r.held});
  }
  const Base nominal = NominalBase(c.rig);
  for (const BaseParameter& p : BaseParameters(c.rig)) {
    label.base.push_back({p.name, p.unit, c.truth.base.*p.field, nominal.*p.field});
  }
  for (int s = 0; s < SignalCount(c.rig); ++s) {
    label.sensors.emplace_back(s == 0 ? names.first_signal : names.second_signal,
                               c.sensors.angle[static_cast<std::size_t>(s)]);
  }
  for (const LogSpec& log : c.logs) {
    label.logs.push_back({ShapeName(log.excitation.shape), log.amplitude, log.as_reference, log.loop.On(), log.rate_hz,
                          log.excitation.duration_s});
  }
  return label;
}

std::string LabelText(const Label& c, const std::vector<std::string>& files) {
  Json json;
  json["schema"] = "gapscope.twin.label/1";
  json["rig"] = c.rig;
  json["kind"] = KindName(c.kind);
  json["expected_verdicts"] = ExpectedVerdicts(c);
  json["seed"] = c.seed;
  json["index"] = c.index;
  json["effect_to_floor"] = c.gap.raw;
  json["effect_to_floor_refit"] = c.gap.refit;
  json["effects"] = Json::array();
  for (const Label::Effect& e : c.effects) {
    json["effects"].push_back({{"name", e.name},
                               {"on", e.on},
                               {"parameters", ToJson(e.parameters)},
                               {"twin_parameters", ToJson(e.extra)},
                               {"severity", e.severity},
                               {"effect_to_floor", e.gap.raw},
                               {"effect_to_floor_refit", e.gap.refit},
                               {"effect_to_floor_logs", e.gap.logs}});
    if (c.kind == Kind::kRough) {
      json["effects"].back().update({{"stands_clear", e.clear}, {"beside_torques_to_floor", e.beside_torques}});
    }
  }
  if (c.kind == Kind::kRough) {
    json["roughness"] = RoughJson(c.roughness);
    json["roughness_to_floor_refit"] = c.rough_refit;
  }
  json["ambiguous"] = Json::array();
  if (!c.group.empty()) {
    Json group = Json::array();
    for (const Case::Member& m : c.group) {
      group.push_back({{"name", m.name}, {"on", m.on}, {"distance_to_floor", m.distance_to_floor}});
    }
    json["ambiguous"].push_back(group);
  }
  if (!c.outside.empty()) {
    json["outside"] = {
        {"name", c.outside}, {"parameters", ToJson(c.outside_parameters)}, {"severity", c.outside_severity}};
  }
  for (const Label::BaseValue& p : c.base) {
    json["base"][p.name] = {{"unit", p.unit}, {"true", p.truth}, {"nominal", p.nominal}};
  }
  for (const auto& [signal, sensor] : c.sensors) json["sensors"][signal] = SensorJson(sensor);
  for (std::size_t i = 0; i < c.logs.size(); ++i) {
    const Label::LogLine& log = c.logs[i];
    json["logs"].push_back({{"file", i < files.size() ? files[i] : ""},
                            {"excitation", log.excitation},
                            {"amplitude", log.amplitude},
                            {"reference_of_loop", log.as_reference},
                            {"weak_loop", log.weak_loop},
                            {"rate_hz", log.rate_hz},
                            {"duration_s", log.duration_s}});
  }
  return json.dump(2) + "\n";
}

bool WriteText(const std::string& path, const std::string& text, std::string* problem) {
  std::error_code error;
  const fs::path target(path);
  if (target.has_parent_path()) fs::create_directories(target.parent_path(), error);
  const fs::path temporary = path + ".partial";
  std::ofstream file(temporary, std::ios::binary | std::ios::trunc);
  file << text;
  file.close();
  if (file) fs::rename(temporary, target, error);
  if (!file || error) {
    *problem = path + ": cannot be written" + (error ? ": " + error.message() : "");
    return false;
  }
  return true;
}

}  // namespace gapscope::twin
