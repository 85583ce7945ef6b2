// gapscope_twin: synthetic hardware logs with known causes, and their labels. See tests/twin/README.md.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "tests/twin/arm/case.h"
#include "tests/twin/case.h"
#include "tests/twin/output.h"

namespace gapscope::twin {
namespace {

struct Options {
  CaseRequest request;
  std::string kind = "auto", out, label, drive;
  std::vector<std::string> set, shapes;
  std::string drawing, shaping;  // the first option given that only a drawn case, or only a plant of one's own, heeds
  bool nominal = false, noise = true, loop = false, reference = false;
  double amplitude = 0, duration_s = 8, rate_hz = 500, low_hz = 0, high_hz = 0;
};

int Fail(const std::string& text) {
  std::fprintf(stderr, "gapscope_twin: %s\n", text.c_str());
  return 2;
}

// A plant of one's own: base and effects as set, one log per shape.
bool MakeManual(const Options& o, Case* c, std::string* problem) {
  const CaseRequest& r = o.request;
  if (!ParseRig(r.rig, &c->rig)) {
    *problem = "--set, --nominal and --excitation need --rig joint, qube, flexjoint or flexlink";
    return false;
  }
  Random base(r.seed, r.index, "base"), sensors(r.seed, r.index, "sensors"), random(r.seed, r.index, "case");
  c->seed = r.seed;
  c->index = r.index;
  c->base.rig = c->rig;
  c->base.base = o.nominal ? NominalBase(c->rig) : DrawBase(c->rig, &base);
  c->nominal_base = o.nominal;
  c->sensors = DrawSensors(c->rig, &sensors);
  c->truth = c->base;
  for (const std::string& assignment : o.set) {
    const std::size_t equals = assignment.find('=');
    const std::string name = assignment.substr(0, equals);
    const std::string text = equals == std::string::npos ? "" : assignment.substr(equals + 1);
    double value = 0;
    const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (code != std::errc() || end != text.data() + text.size()) {
      *problem = "--set " + assignment + ": expected NAME=NUMBER";
      return false;
    }
    if (!SetParameter(name, value, &c->truth)) {
      *problem = "--set " + assignment + ": unknown on rig " + r.rig + "; known:";
      for (const std::string& known : ParameterNames(c->rig)) *problem += " " + known;
      return false;
    }
  }
  c->base.base = c->truth.base;
  for (const std::string& text : o.shapes.empty() ? std::vector<std::string>{"chirp"} : o.shapes) {
    LogStyle style;
    if (!ParseShape(text, &style.shape)) {
      *problem = "--excitation " + text + ": one of zero chirp multisine steps triangle square ramps swept constant";
      return false;
    }
    const bool joint = c->rig == Rig::kJoint, slow = style.shape == Shape::kTriangle || style.shape == Shape::kRamps;
    style.low_hz = o.low_hz > 0 ? o.low_hz : joint ? 0.1 : slow ? 0.3 : 0.5;
    style.high_hz = o.high_hz > 0 ? o.high_hz : slow ? 1 : 10;
    style.as_reference = o.reference && !joint;
    style.loop = (o.loop || o.reference) && !joint;
    style.envelope = DrawEnvelope(c->rig, &random);
    LogSpec log = MakeLog(c->truth, style, o.duration_s, o.rate_hz, &random);
    log.dropped_share = o.noise ? log.dropped_share : 0;
    if (o.amplitude > 0) log.amplitude = o.amplitude;
    log.speed_column = log.torque_column = log.current_column = true;
    c->logs.push_back(log);
  }
  return true;
}

// One log of the case's plant, started at rest and driven by a CSV's first two columns: time, s, and the command, held
// from row to row.
bool DriveBy(const std::string& path, Case* c, std::string* problem) {
  std::ifstream file(path);
  std::string line;
  std::vector<double> time_s, level;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream row(line);
    double time = 0, value = 0;
    if (!(row >> time >> value)) break;
    time_s.push_back(time);
    level.push_back(value);
  }
  if (time_s.size() < 2 || !file.eof()) {
    *problem = "--drive " + path + ": expected a header and rows of time and command";
    return false;
  }
  LogSpec log = c->logs.back();
  log.session_s += log.excitation.duration_s;
  log.excitation = {.shape = Shape::kSteps, .duration_s = time_s.back(), .level = level};
  // A row's stamp may lie a rounding beside the substep's.
  for (std::size_t i = 0; i + 1 < time_s.size(); ++i)
    log.excitation.until_s.push_back(time_s[i] + 0.999 * (time_s[i + 1] - time_s[i]));
  log.excitation.until_s.push_back(kNever);
  log.amplitude = 1;
  log.as_reference = false;
  log.loop = {};
  log.feedforward_n_m = 0;
  log.rate_hz = std::round(static_cast<double>(time_s.size() - 1) / time_s.back());
  log.start = {};
  log.dropped_share = 0;
  ++log.seed;
  c->logs = {log};
  return true;
}

// Records of any rig as files, and the label where one is asked for.
template <class R>
int Write(const Options& o, const std::vector<R>& records, const Label& label) {
  std::string problem;
  std::vector<std::string> files;
  for (std::size_t i = 0; i < records.size(); ++i) {
    files.push_back("log_" + std::to_string(i) + ".csv");
    const std::string text = CsvText(records[i].names, records[i].rows);
    if (!WriteText(o.out + "/" + files.back(), text, &problem)) return Fail(problem);
  }
  if (!o.label.empty() && !WriteText(o.label, LabelText(label, files), &problem)) return Fail(problem);
  return 0;
}

int RunArm(const Options& o, const CaseRequest& request, ArmRig rig) {
  ArmCase c;
  std::string problem;
  if (!MakeArmCase(request, rig, &c, &problem)) return Fail(problem);
  return Write(o, MakeArmRecords(c, o.noise), LabelOf(c));
}

int Run(const Options& o) {
  Case c;
  std::string problem;
  CaseRequest request = o.request;
  if (!ParseKind(o.kind, &request.kind))
    return Fail("--kind " + o.kind + ": none, single, pair, triple, unknown, ambiguous, rough or auto");
  const bool manual = o.nominal || !o.set.empty() || !o.shapes.empty();
  if (ArmRig arm; ParseArmRig(request.rig, &arm)) {
    if (manual || !o.drive.empty() || !o.shaping.empty())
      return Fail("--rig " + request.rig + ": takes no --nominal, --set, --excitation, --drive" +
                  (o.shaping.empty() ? "" : ", " + o.shaping));
    return RunArm(o, request, arm);
  }
  if (manual && !o.drawing.empty())
    return Fail(o.drawing +
                ": not beside --nominal, --set or --excitation, which say the plant; leave one of them out");
  if (!manual && !o.shaping.empty())
    return Fail(o.shaping + ": a drawn case has logs of its own; say --excitation or --nominal too");
  if (!(manual ? MakeManual(o, &c, &problem) : MakeCase(request, &c, &problem))) return Fail(problem);
  if (!o.drive.empty() && !DriveBy(o.drive, &c, &problem)) return Fail(problem);
  return Write(o, MakeRecords(c, o.noise), LabelOf(c));
}

}  // namespace
}  // namespace gapscope::twin

int main(int argc, char** argv) {
  gapscope::twin::Options o;
  CLI::App app(
      "Synthetic hardware logs of the contract's rigs, each with a known cause.\n"
      "Example: gapscope_twin --seed 7 --index 3 --out case_3 --label sealed/case_3.json");
  app.add_option("--seed", o.request.seed, "Seed of the whole bank")->capture_default_str();
  app.add_option("--index", o.request.index, "Number of the case")->capture_default_str();
  app.add_option("--out", o.out, "Folder for log_N.csv")->required();
  app.add_option("--label", o.label, "File for the label (JSON); none without it");
  app.add_option("--kind", o.kind, "none, single, pair, triple, unknown, ambiguous, rough, auto")
      ->capture_default_str();
  app.add_option("--rig", o.request.rig,
                 "joint, qube, flexjoint, flexlink, one of which is drawn without it; or arm2, arm6");
  app.add_option("--effect", o.request.effect, "NAME or NAME@ON");
  app.add_option("--severity", o.request.severity, "Instead of searching one by effect-to-floor ratio");
  app.add_option("--set", o.set, "NAME=VALUE of a base parameter or EFFECT[@ON].PARAMETER")->take_all();
  app.add_option("--excitation", o.shapes, "One log per shape")->take_all();
  app.add_option("--drive", o.drive, "CSV of time and command: one more log of the case, driven by it, instead");
  app.add_flag("--nominal", o.nominal, "Base parameters exactly nominal");
  app.add_option("--noise", o.noise, "0: exact measurements, no dropped rows")->capture_default_str();
  app.add_flag("--loop", o.loop, "Weak position loop");
  app.add_flag("--reference", o.reference, "The excitation is the weak loop's reference");
  app.add_option("--amplitude", o.amplitude, "rad, V or A; sized to the rig without it");
  app.add_option("--duration", o.duration_s, "s")->capture_default_str();
  app.add_option("--rate", o.rate_hz, "Hz")->capture_default_str();
  app.add_option("--low-hz", o.low_hz, "Lowest frequency of the excitation");
  app.add_option("--high-hz", o.high_hz, "Highest frequency of the excitation");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  const auto first = [&](const std::vector<std::string>& names) {
    for (const std::string& name : names)
      if (app.count(name) > 0) return name;
    return std::string();
  };
  o.drawing = o.kind != "auto" && o.kind != "none" ? "--kind " + o.kind : first({"--effect", "--severity"});
  o.shaping = first({"--amplitude", "--duration", "--rate", "--low-hz", "--high-hz", "--loop", "--reference"});
  try {
    return gapscope::twin::Run(o);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "gapscope_twin: %s\n", e.what());
    return 3;
  }
}
