#include "src/cli/joint_states.h"

#include <mujoco/mujoco.h>

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "src/cli/result_model.h"
#include "src/cli/session.h"
#include "src/core/names.h"
#include "src/model/element_names.h"
#include "src/report/read_run.h"
#include "src/report/write_run.h"
#include "src/tune/tune.h"

namespace gapscope::cli {
namespace {

namespace fs = std::filesystem;

// "arm/position"; none: no joint's, as a sensor of the scene's.
std::optional<std::string> PlaceOf(const MeasuredSpec& measured, const mjModel& model) {
  switch (measured.kind) {
    case SignalKind::kPosition:
      return measured.on + "/position";
    case SignalKind::kVelocity:
      return measured.on + "/velocity";
    case SignalKind::kTorque: {
      const int actuator = mj_name2id(&model, mjOBJ_ACTUATOR, measured.on.c_str());
      if (actuator < 0 || model.actuator_trntype[actuator] != mjTRN_JOINT) return std::nullopt;
      return NameOf(model, mjOBJ_JOINT, model.actuator_trnid[2 * actuator]) + "/effort";
    }
    case SignalKind::kSensor:
    case SignalKind::kOrientation:
      return std::nullopt;
  }
  return std::nullopt;
}

// Another name for each of a trace's columns that has one. Error: none has.
Result<Log> AsJointStates(const Log& trace, const std::map<std::string, std::string>& places) {
  Log states{.path = fs::path(trace.path).stem().string()};
  std::vector<std::string> others;
  for (const Column& column : trace.columns) {
    const std::size_t slash = column.name.find('/');
    const std::string head = column.name.substr(0, slash);
    if (head == "__time") states.columns.push_back({.name = column.name, .unit = "s", .values = column.values});
    if (head != "measured" && head != "predicted") continue;
    const std::string signal = column.name.substr(slash + 1);
    const auto place = places.find(signal);
    if (place == places.end()) {
      if (head == "measured") others.push_back(signal);
      continue;
    }
    const std::string topic = head == "measured" ? "/real/joint_states/" : "/sim/joint_states/";
    states.columns.push_back({.name = topic + place->second, .values = column.values});
  }
  if (states.columns.size() < 2)
    return Error{.what = "no signal is a joint's",
                 .where = trace.path,
                 .actual = Join(others),
                 .allowed = "positions, velocities and torques of joints",
                 .cure = "open the trace itself: PlotJuggler reads it"};
  states.time_column = states.columns.front().name;
  if (!others.empty())
    states.findings.push_back(
        {.kind = "left_out", .count = others.size(), .text = "left out, being of no joint: " + Join(others)});
  return states;
}

// The traces that the command wrote of these logs; of an earlier run there may be others beside them. None: it wrote
// none.
Result<std::vector<Log>> ReadTraces(const std::string& result, const std::vector<std::string>& logs) {
  std::vector<Log> traces;
  std::error_code failed;
  const fs::path folder = fs::is_directory(result, failed) ? fs::path(result) : fs::path(result).parent_path();
  for (const std::string& name : CsvNames(logs)) {
    const fs::path file = folder / "traces" / name;
    if (!fs::exists(file, failed)) return std::vector<Log>();
    GS_ASSIGN(traces.emplace_back(), ReadLog(file.string(), {}));
  }
  return traces;
}

// The logs replayed as the result's model moves.
Result<std::vector<Log>> MakeTraces(const ResultModel& result, const std::vector<std::string>& logs, ThreadPool& pool) {
  const Experiment& experiment = result.model->experiment();
  GS_ASSIGN(const std::vector<Recording> recordings, LoadRecordings(experiment, logs, pool));
  const FixedParameters fixed{result.values, std::nullopt};
  const TuneOptions fit{.window_s = experiment.replay.window_s};
  const auto replays = Evaluate(*result.model, recordings, fixed, experiment.replay.mode, fit, pool);
  std::vector<Log> traces;
  for (const RunTable& table : TraceTables(replays, recordings)) {
    Log& trace = traces.emplace_back(Log{.path = table.path});
    for (const CsvColumn& column : table.columns)
      trace.columns.push_back({.name = column.head, .values = {column.values.begin(), column.values.end()}});
  }
  return traces;
}

}  // namespace

Result<std::vector<Log>> JointStatesOf(const std::string& path, ThreadPool& pool) {
  GS_ASSIGN(const nlohmann::ordered_json json, ReadJson(path));
  GS_ASSIGN(const ResultModel result, LoadWholeResult(json, {.path = path}));
  std::map<std::string, std::string> places;
  for (const MeasuredSpec& measured : result.model->experiment().measured) {
    if (const auto place = PlaceOf(measured, result.model->compiled())) places[measured.signal] = *place;
  }
  const std::vector<std::string> logs = JudgedBy(json);
  GS_ASSIGN(std::vector<Log> traces, ReadTraces(path, logs));
  if (traces.empty()) {
    GS_ASSIGN(traces, MakeTraces(result, logs, pool));
  }
  std::vector<Log> states;
  for (const Log& trace : traces) {
    GS_ASSIGN(states.emplace_back(), AsJointStates(trace, places));
  }
  return states;
}

}  // namespace gapscope::cli
