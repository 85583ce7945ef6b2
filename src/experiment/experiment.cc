#include "src/experiment/experiment.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <stdexcept>

#include "src/core/units.h"
#include "src/experiment/added_actuators.h"
#include "src/experiment/orientation.h"
#include "src/experiment/own_effects.h"
#include "src/experiment/yaml_reader.h"

namespace gapscope {
namespace {

// Reads `unit`, `scale` and `add` of a column: SI = unit * scale * raw + add.
// Returns the SI unit.
std::string ReadScaling(YamlMap& map, const YAML::Node& node, double* factor, double* offset, const char* add = "add") {
  const auto parsed = ParseUnit(map.Text("unit", "1"));
  if (!parsed.ok()) map.Fail(node, parsed.error());
  *factor = (parsed.ok() ? parsed.value().factor : 1) * map.Number("scale", 1);
  *offset = map.Number(add, 0);
  if (!std::isfinite(*factor) || *factor == 0)
    map.Fail(node, {.what = "'scale' makes every value zero or infinite", .allowed = "a finite number other than 0"});
  return parsed.ok() ? parsed.value().si : "1";
}

// Its keys are for the reader of a foreign format, which checks them; all of their values are texts.
nlohmann::json TextsOf(const YAML::Node& node) {
  if (node.IsScalar()) return node.Scalar();
  nlohmann::json json = node.IsMap() ? nlohmann::json::object() : nlohmann::json::array();
  for (const auto& item : node) {
    if (node.IsMap()) {
      json[item.first.IsScalar() ? item.first.Scalar() : ""] = TextsOf(item.second);
    } else {
      json.push_back(TextsOf(item));
    }
  }
  return json;
}

Status ReadLogSection(const YAML::Node& node, const std::string& path, Experiment* experiment) {
  if (!node.IsDefined()) return Ok();
  YamlMap map(node, path, "'log'");
  std::vector<std::string> formats = {"auto"};
  for (const LogReader& reader : LogReaders()) formats.emplace_back(reader.name);
  if (const std::size_t chosen = map.Choice("format", formats, 0); chosen > 0)
    experiment->read.format = &LogReaders()[chosen - 1];
  if (const YAML::Node time = map.Child("time"); time.IsDefined()) {
    YamlMap time_map(time, path, "'time'");
    experiment->timeline.time_column = time_map.Text("column", "");
    const char* kUnits[] = {"", "s", "ms", "us", "ns"};
    experiment->timeline.time_unit = kUnits[time_map.Choice("unit", {"auto", "s", "ms", "us", "ns"}, 0)];
    GS_RETURN_IF_ERROR(time_map.Finish());
  }
  for (const YAML::Node& item : map.List("companions")) {
    YamlMap companion(item, path, "a companion");
    experiment->read.companions.push_back(
        {companion.Text("find"), companion.Text("replace"), companion.Text("prefix", "")});
    if (experiment->read.companions.back().find.empty()) {
      companion.Fail(item, {.what = "'find' of a companion is empty"});
    }
    GS_RETURN_IF_ERROR(companion.Finish());
  }
  if (const YAML::Node source = map.Child("source"); source.IsDefined()) {
    if (!source.IsMap())
      map.Fail(source, {.what = "'source' is no mapping", .cure = "source: {topics: [/joint_states]}"});
    experiment->read.source = TextsOf(source).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  }
  if (const YAML::Node repair = map.Child("repair"); repair.IsDefined()) {
    YamlMap policy(repair, path, "'repair'");
    constexpr TimeRepair kTime[] = {TimeRepair::kDropRows, TimeRepair::kError};
    constexpr MissingRepair kMissing[] = {MissingRepair::kHold, MissingRepair::kKeep, MissingRepair::kDropRows,
                                          MissingRepair::kError};
    experiment->timeline.repeated = kTime[policy.Choice("repeated", {"drop_rows", "error"}, 0)];
    experiment->timeline.reversed = kTime[policy.Choice("reversed", {"drop_rows", "error"}, 0)];
    experiment->timeline.missing = kMissing[policy.Choice("missing", {"hold", "keep", "drop_rows", "error"}, 0)];
    experiment->timeline.missing_stated = policy.Has("missing");
    experiment->timeline.gap_factor = policy.Number("gap_factor", experiment->timeline.gap_factor);
    if (!(experiment->timeline.gap_factor > 1))
      policy.Fail(repair, {.what = "'gap_factor' is in median steps", .allowed = "> 1"});
    GS_RETURN_IF_ERROR(policy.Finish());
  }
  return map.Finish();
}

Status ReadValues(const YAML::Node& node, const std::string& path, Experiment* experiment) {
  if (!node.IsDefined()) return Ok();
  YamlMap names(node, path, "'values'");
  for (const auto& pair : node) {
    if (!pair.first.IsScalar()) break;
    const std::string name = names.Name(pair.first);
    if (names.failed()) break;
    YamlMap map(names.Child(name.c_str()), path, "the log value '" + name + "'");
    LogValue value{.name = name, .header = map.Text("header", ""), .column = map.Text("column", ""), .factor = 1};
    double offset = 0;
    ReadScaling(map, pair.second, &value.factor, &offset);
    if (map.Has("default")) value.fallback = map.Number("default");
    if (value.header.empty() == value.column.empty()) {
      map.Fail(pair.second, {.what = "the log value '" + name + "' needs either 'header' or 'column'"});
    }
    GS_RETURN_IF_ERROR(map.Finish());
    experiment->values.push_back(std::move(value));
  }
  return names.Finish();
}

std::vector<std::string> ReadColumns(YamlMap& map, const YAML::Node& node, bool required) {
  std::vector<std::string> columns = map.TextList("column");
  for (auto& more : map.TextList("columns")) columns.push_back(std::move(more));
  if (columns.empty() && required) {
    map.Fail(node, {.what = "no 'column' is named", .cure = "add 'column: NAME'"});
  }
  return columns;
}

CommandKind KindOfUnit(const std::string& si) {
  return si == "V"     ? CommandKind::kVoltage
         : si == "A"   ? CommandKind::kCurrent
         : si == "N m" ? CommandKind::kTorque
         : si == "rad" ? CommandKind::kAngle
                       : CommandKind::kOther;
}

Status ReadCommands(const std::vector<YAML::Node>& items, const std::string& path, Experiment* experiment) {
  for (const YAML::Node& item : items) {
    YamlMap map(item, path, "a command");
    CommandSpec command;
    command.actuator = map.Text("actuator");
    command.optional = map.Flag("optional", false);
    command.fallback = map.Text("default", "0");
    command.columns = ReadColumns(map, item, !map.Has("default"));
    if (command.columns.empty()) command.optional = true;
    command.where = YamlPlace(path, item);
    if (map.Has("offset") && map.Has("add"))
      map.Fail(item, {.what = "'offset' and 'add' of a command are the same", .cure = "delete one"});
    command.unit = ReadScaling(map, item, &command.factor, &command.offset, map.Has("offset") ? "offset" : "add");
    command.unit_stated = map.Has("unit") || map.Has("scale");
    command.kind = KindOfUnit(command.unit);
    for (const auto& other : experiment->commands) {
      if (other.actuator == command.actuator)
        map.Fail(item, {.what = "two commands drive the actuator '" + command.actuator + "'", .cure = "delete one"});
    }
    GS_RETURN_IF_ERROR(map.Finish());
    experiment->commands.push_back(std::move(command));
  }
  return Ok();
}

// Of a sensor whose numbers have a column each: a signal a column, "gyro[0]" ...
std::vector<MeasuredSpec> EachElement(const MeasuredSpec& spec, const std::vector<std::string>& columns) {
  if (columns.empty()) return {spec};
  std::vector<MeasuredSpec> each(columns.size(), spec);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    each[i].signal += "[" + std::to_string(i) + "]";
    each[i].columns = {columns[i]};
    each[i].element = static_cast<int>(i);
    each[i].elements = static_cast<int>(columns.size());
  }
  return each;
}

// An orientation's four columns, in their order, become the signals of its rotation vector. `mount`: a parameter for
// each, the turn from the model's frame to the sensor's.
std::vector<MeasuredSpec> ReadOrientation(YamlMap& map, const YAML::Node& item, const MeasuredSpec& spec,
                                          std::vector<std::string> columns) {
  const bool scalar_last = map.Choice("order", {"wxyz", "xyzw"}, 0) == 1;
  const std::vector<std::string> mount = map.TextList("mount");
  if (columns.size() != kQuaternion)
    map.Fail(item, {.what = "the orientation '" + spec.signal + "' needs four columns, those of a quaternion",
                    .actual = std::to_string(columns.size()),
                    .allowed = "columns_of_elements: [W, X, Y, Z]"});
  for (const char* key : {"filter", "wrap", "offset", "scale", "add"}) {
    if (map.Has(key))
      map.Fail(item, {.what = std::string("'") + key + "' means nothing of an orientation",
                      .cure = "drop it; 'mount' turns the sensor's frame"});
  }
  if (!mount.empty() && mount.size() != kTurns)
    map.Fail(item, {.what = "'mount' names a parameter for each number of a rotation vector",
                    .actual = std::to_string(mount.size()),
                    .allowed = "3"});
  if (scalar_last && !columns.empty()) std::rotate(columns.begin(), columns.end() - 1, columns.end());
  std::vector<MeasuredSpec> each(kTurns, spec);
  for (std::size_t i = 0; i < kTurns; ++i) {
    each[i].signal += "[" + std::to_string(i) + "]";
    each[i].columns = columns;
    each[i].element = static_cast<int>(i);
    each[i].elements = static_cast<int>(columns.size());
    each[i].unit = "rad";
    if (mount.size() == kTurns) each[i].offset_parameter = mount[i];
  }
  return each;
}

// The sensor of a body's or a site's pose, which need not be in the MJCF; empty: neither is named.
std::string ReadPosed(YamlMap& map, bool orients, MeasuredSpec* spec) {
  spec->body = map.Text("body", "");
  spec->site = map.Text("site", "");
  if (spec->body.empty() == spec->site.empty()) return "";
  const std::string of = orients ? "orientation of " : "position of ";
  return of + (spec->site.empty() ? "body " + spec->body : "site " + spec->site);
}

// What of the model the signal is, and its unit. `elements`: how many columns `columns_of_elements` names; four are an
// orientation unless the kind is said.
void ReadSource(YamlMap& map, const YAML::Node& item, std::size_t elements, MeasuredSpec* spec) {
  std::vector<std::string> kinds;
  for (const auto& row : AllSignalTraits()) kinds.emplace_back(row.name);
  const bool of_sensor = map.Has("sensor") || map.Has("body") || map.Has("site");
  const SignalKind of_columns = elements == kQuaternion ? SignalKind::kOrientation : SignalKind::kSensor;
  const SignalTraits& traits =
      of_sensor && !map.Has("kind") ? TraitsOf(of_columns) : AllSignalTraits()[map.Choice("kind", kinds, 0)];
  spec->kind = traits.kind;
  const std::string named[] = {map.Text("joint", ""), map.Text("actuator", ""), map.Text("sensor", ""),
                               ReadPosed(map, traits.kind == SignalKind::kOrientation, spec)};
  spec->on = named[static_cast<int>(traits.site)];
  if (spec->on.empty() && traits.site == SignalSite::kSensor) spec->on = named[3];
  if (spec->on.empty() || std::ranges::count(named, "") != 3 || (!spec->body.empty() && !spec->site.empty())) {
    map.Fail(item, {.what = "the signal '" + spec->signal +
                            "' needs exactly one of 'joint' (position, velocity), 'actuator' (torque), 'sensor', or "
                            "'body' or 'site' (a pose)"});
  }
  if (map.Has("element")) {
    const double element = map.Number("element");
    if (!(element >= 0 && element < 1000 && std::floor(element) == element && of_sensor))
      map.Fail(item, {.what = "'element' counts a sensor's numbers", .allowed = "0, 1, 2 ..., beside 'sensor'"});
    spec->element = static_cast<int>(std::clamp(element, 0.0, 999.0));
  }
  spec->unit_stated = map.Has("unit") || map.Has("scale");
  spec->unit = ReadScaling(map, item, &spec->factor, &spec->offset);
  // "1": the column is in SI already. A sensor's unit is checked where the model is known.
  const auto& units = traits.units;
  if (spec->unit != "1" && !of_sensor && std::ranges::find(units, spec->unit) == std::end(units)) {
    map.Fail(item, {.what = "the unit of the signal '" + spec->signal + "' does not fit its kind",
                    .actual = "'" + map.Text("unit", "1") + "'",
                    .allowed = std::string("units of ") + units[0] + " or " + units[1]});
  }
}

Status ReadMeasured(const YAML::Node& node, const std::string& path, Experiment* experiment) {
  if (!node.IsDefined() || !node.IsSequence() || node.size() == 0) {
    return Error{.what = "nothing is measured",
                 .where = YamlPlace(path, node),
                 .allowed = "a list under 'measured:'",
                 .cure = "add '- {signal: NAME, column: NAME, joint: NAME}'"};
  }
  for (const auto& item : node) {
    YamlMap map(item, path, "a measured signal");
    MeasuredSpec spec;
    spec.signal = map.Text("signal");
    spec.where = YamlPlace(path, item);
    spec.columns = ReadColumns(map, item, false);
    if (spec.columns.empty()) spec.columns = {spec.signal};
    const std::vector<std::string> elements = map.TextList("columns_of_elements");
    ReadSource(map, item, elements.size(), &spec);
    if (map.Has("start")) spec.starts = map.Flag("start", false);
    if (spec.starts && TraitsOf(spec.kind).site != SignalSite::kSensor)
      map.Fail(item, {.what = "'start' is of a sensor that measures a body's pose",
                      .cure = "drop it: a measured joint starts where its column says"});
    spec.resolution = map.Number("resolution", 0);
    if (map.Has("filter")) {
      YamlMap filter(item["filter"], path, "'filter'");
      spec.filter = {.cutoff = filter.Text("cutoff_rad_per_s"), .damping_ratio = filter.Text("damping_ratio")};
      GS_RETURN_IF_ERROR(filter.Finish());
    }
    spec.optional = map.Flag("optional", false);
    spec.scored = map.Flag("score", true);
    spec.offset_parameter = map.Text("offset", "");
    if (map.Has("wrap")) {
      spec.wrap = WrapRepair::kUnwrap;
      spec.wrap_period = map.Number("wrap");
      if (!(spec.wrap_period > 0)) map.Fail(item, {.what = "'wrap' is the period to remove, in SI", .allowed = "> 0"});
    }
    if (spec.resolution < 0) map.Fail(item, {.what = "'resolution' is negative", .allowed = ">= 0"});
    const bool orients = spec.kind == SignalKind::kOrientation;
    if (!elements.empty() && (TraitsOf(spec.kind).site != SignalSite::kSensor || map.Has("element") ||
                              map.Has("column") || map.Has("columns")))
      map.Fail(item, {.what = "'columns_of_elements' names a sensor's columns, one for each of its numbers",
                      .cure = "name the 'sensor', and drop 'element' and 'column'"});
    for (const MeasuredSpec& one : orients ? ReadOrientation(map, item, spec, elements) : EachElement(spec, elements)) {
      for (const auto& other : experiment->measured) {
        if (other.signal == one.signal)
          map.Fail(item, {.what = "the signal '" + one.signal + "' stands twice", .cure = "rename one"});
      }
      experiment->measured.push_back(one);
    }
    GS_RETURN_IF_ERROR(map.Finish());
  }
  return Ok();
}

Status ReadParameters(const YAML::Node& node, const std::string& path, Experiment* experiment) {
  if (!node.IsDefined()) return Ok();
  YamlMap names(node, path, "'parameters'");
  for (const auto& pair : node) {
    if (!pair.first.IsScalar()) break;
    const std::string name = names.Name(pair.first);
    if (names.failed()) break;
    YamlMap map(names.Child(name.c_str()), path, "the parameter '" + name + "'");
    for (const auto& value : experiment->values) {
      if (value.name == name)
        map.Fail(pair.first,
                 {.what = "the name '" + name + "' stands twice: a log value and a parameter", .cure = "rename one"});
    }
    Parameter parameter{.name = name,
                        .unit = map.Text("unit"),
                        .doc = map.Text("doc", ""),
                        .nominal = map.Number("nominal"),
                        .low = 0,
                        .high = 0,
                        .frozen = map.Flag("frozen", false)};
    const std::vector<double> bounds = map.NumberList("bounds", 2);
    parameter.low = bounds.size() == 2 ? bounds[0] : parameter.nominal;
    parameter.high = bounds.size() == 2 ? bounds[1] : parameter.nominal;
    if (bounds.empty() && !parameter.frozen) {
      map.Fail(pair.second, {.what = "the parameter '" + name + "' has no bounds",
                             .cure = "add 'bounds: [low, high]' or 'frozen: true'"});
    } else if (!(parameter.low <= parameter.nominal && parameter.nominal <= parameter.high)) {
      map.Fail(pair.second, {.what = "the nominal value of '" + name + "' is outside its bounds",
                             .actual = std::to_string(parameter.nominal),
                             .allowed = std::to_string(parameter.low) + " to " + std::to_string(parameter.high)});
    }
    GS_RETURN_IF_ERROR(map.Finish());
    experiment->parameters.push_back(std::move(parameter));
  }
  return names.Finish();
}

Status ReadLimits(const std::vector<YAML::Node>& items, const std::string& path, Experiment* experiment) {
  for (const YAML::Node& item : items) {
    YamlMap map(item, path, "a limit");
    Limit limit{.joint = map.Text("joint", ""),
                .actuator = map.Text("actuator", ""),
                .position = map.Number("angle_rad", 0),
                .speed = map.Number("speed_rad_per_s", 0),
                .command = map.Number("command", 0),
                .torque = map.Number("torque_n_m", 0),
                .where = YamlPlace(path, item)};
    const bool of_joint = !limit.joint.empty();
    if (of_joint != limit.actuator.empty())
      map.Fail(item, {.what = "a limit needs exactly one of 'joint' or 'actuator'"});
    if (of_joint ? limit.command != 0 || limit.torque != 0 : limit.position != 0 || limit.speed != 0) {
      map.Fail(
          item,
          {.what =
               "a joint is limited by 'angle_rad' and 'speed_rad_per_s', an actuator by 'command' and 'torque_n_m'"});
    }
    for (const double value : {limit.position, limit.speed, limit.command, limit.torque}) {
      if (!(value >= 0)) map.Fail(item, {.what = "a limit is a magnitude about zero", .allowed = "> 0"});
    }
    GS_RETURN_IF_ERROR(map.Finish());
    experiment->limits.push_back(std::move(limit));
  }
  return Ok();
}

Status ReadReplay(const YAML::Node& node, const std::string& path, Experiment* experiment) {
  if (!node.IsDefined()) return Ok();
  YamlMap map(node, path, "'replay'");
  constexpr ReplayMode kModes[] = {ReplayMode::kFreeRun, ReplayMode::kWindows};
  experiment->replay.mode = kModes[map.Choice("mode", {NameOf(kModes[0]), NameOf(kModes[1])}, 0)];
  experiment->replay.window_s = map.Number("window_s", experiment->replay.window_s);
  experiment->replay.start_s = map.Number("start_s", 0);
  experiment->replay.while_column = map.Text("while", "");
  if (!(experiment->replay.window_s > 0) || experiment->replay.start_s < 0) {
    map.Fail(node, {.what = "'window_s' must be above and 'start_s' not below zero"});
  }
  return map.Finish();
}

}  // namespace

std::span<const SignalTraits> AllSignalTraits() {
  using enum SignalKind;
  static constexpr SignalTraits kTraits[] = {{.kind = kPosition,
                                              .name = "position",
                                              .units = {"rad", "m"},
                                              .site = SignalSite::kJoint,
                                              .has_zero = true,
                                              .gives_angle = true,
                                              .gives_speed = false,
                                              .stage = SignalStage::kState},
                                             {.kind = kVelocity,
                                              .name = "velocity",
                                              .units = {"rad/s", "m/s"},
                                              .site = SignalSite::kJoint,
                                              .has_zero = false,
                                              .gives_angle = false,
                                              .gives_speed = true,
                                              .stage = SignalStage::kState},
                                             {.kind = kTorque,
                                              .name = "torque",
                                              .units = {"N m", "N"},
                                              .site = SignalSite::kActuator,
                                              .has_zero = false,
                                              .gives_angle = false,
                                              .gives_speed = false,
                                              .stage = SignalStage::kForces},
                                             {.kind = kSensor,
                                              .name = "sensor",
                                              .units = {"", ""},
                                              .site = SignalSite::kSensor,
                                              .has_zero = false,
                                              .gives_angle = false,
                                              .gives_speed = false,
                                              .stage = SignalStage::kSensors},
                                             {.kind = kOrientation,
                                              .name = "orientation",
                                              .units = {"rad", "rad"},
                                              .site = SignalSite::kSensor,
                                              .has_zero = true,
                                              .gives_angle = false,
                                              .gives_speed = false,
                                              .stage = SignalStage::kSensors}};
  return kTraits;
}

const SignalTraits& TraitsOf(SignalKind kind) {
  for (const SignalTraits& traits : AllSignalTraits()) {
    if (traits.kind == kind) return traits;
  }
  throw std::logic_error("a kind of signal without traits");
}

template <>
std::span<const EnumName<ReplayMode>> EnumNames<ReplayMode>() {
  static constexpr EnumName<ReplayMode> kNames[] = {
      {ReplayMode::kFreeRun, "free_run"}, {ReplayMode::kWindows, "windows"}, {ReplayMode::kClosedLoop, "closed_loop"}};
  return kNames;
}

Result<Experiment> LoadExperiment(const std::string& path) {
  GS_ASSIGN(const YAML::Node root, ReadYaml(path));
  Experiment experiment;
  experiment.path = path;
  YamlMap map(root, path, "the experiment");
  const std::string schema = map.Text("schema", "gapscope.experiment/1");
  if (schema != "gapscope.experiment/1") {
    map.Fail(root, {.what = "unknown schema", .actual = "'" + schema + "'", .allowed = "gapscope.experiment/1"});
  }
  map.Text("doc", "");
  const std::string model = map.Text("model");
  if (model.empty()) map.Fail(root, {.what = "'model' is empty", .allowed = "the path of an MJCF file"});
  const std::vector<YAML::Node> commands = map.List("commands"), candidates = map.List("candidates"),
                                limits = map.List("limits"), actuators = map.List("actuators");
  const YAML::Node log = map.Child("log"), values = map.Child("values"), measured = map.Child("measured"),
                   parameters = map.Child("parameters"), set = map.Child("set"), without = map.Child("without"),
                   replay = map.Child("replay"), hold = map.Child("hold"), inertia = map.Child("inertia");
  map.Child("controller");  // LoadController of replay/controller.h reads it
  GS_RETURN_IF_ERROR(map.Finish());
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  experiment.model_path = (folder / model).lexically_normal().string();

  GS_RETURN_IF_ERROR(ReadLogSection(log, path, &experiment));
  GS_RETURN_IF_ERROR(ReadValues(values, path, &experiment));
  GS_RETURN_IF_ERROR(ReadCommands(commands, path, &experiment));
  GS_RETURN_IF_ERROR(ReadMeasured(measured, path, &experiment));
  GS_RETURN_IF_ERROR(ReadParameters(parameters, path, &experiment));
  if (set.IsDefined()) GS_RETURN_IF_ERROR(ReadFieldSettings(set, path, &experiment.settings));
  GS_RETURN_IF_ERROR(ReadAddedActuators(actuators, path, &experiment));
  GS_RETURN_IF_ERROR(ReadBodies(hold, path, "hold", &experiment.hold));
  GS_RETURN_IF_ERROR(ReadBodies(inertia, path, "inertia", &experiment.inertia));
  GS_RETURN_IF_ERROR(ReadOwnEffects(candidates, path, &experiment));
  GS_RETURN_IF_ERROR(ReadSwitchedOff(without, path, &experiment));
  GS_RETURN_IF_ERROR(ReadLimits(limits, path, &experiment));
  GS_RETURN_IF_ERROR(ReadReplay(replay, path, &experiment));
  return experiment;
}

Result<std::map<std::string, double>> LoadParameterValues(const std::string& path) {
  GS_ASSIGN(const YAML::Node root, ReadYaml(path));
  YamlMap map(root, path, "the parameter file");
  map.Text("doc", "");
  std::map<std::string, double> values;
  for (const auto& pair : root) {
    if (pair.first.IsScalar() && pair.first.Scalar() != "doc") {
      values[pair.first.Scalar()] = map.Number(pair.first.Scalar().c_str());
    }
  }
  GS_RETURN_IF_ERROR(map.Finish());
  return values;
}

}  // namespace gapscope
