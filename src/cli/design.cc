#include <fmt/core.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "src/cli/commands.h"
#include "src/cli/feedback.h"
#include "src/cli/session.h"
#include "src/core/file.h"
#include "src/report/design_report.h"

namespace gapscope::cli {
namespace {

struct ChirpFlags {
  CommonFlags common;
  ChirpRequest request{.inertia_kg_m2 = 0,
                       .natural_frequency_hz = 0,
                       .damping_ratios = {},
                       .speed_limit_rad_per_s = 0,
                       .amplitude_factor = 0.8,
                       .end_over_bandwidth = {2, 3, 5}};
  double speed_limit_rpm = 0, start_hz = 0.1, duration_s = 20, rate_hz = 500;
  std::string out;
};

Result<int> RunChirp(ChirpFlags flags) {
  flags.request.speed_limit_rad_per_s = flags.speed_limit_rpm * 2 * std::numbers::pi / 60;
  GS_ASSIGN(const auto rows, DesignChirps(flags.request));
  if (!flags.out.empty()) {
    GS_ASSIGN(const std::string csv, ChirpCsv(rows, flags.request, flags.start_hz, flags.duration_s, flags.rate_hz));
    GS_RETURN_IF_ERROR(WriteFile(flags.out, csv));
    if (!flags.common.quiet) fmt::print(stderr, "wrote {}\n", flags.out);
  }
  const ChirpRun run{.info = {}, .rows = rows};
  fmt::print("{}", flags.common.json ? ToJson(run).dump(2) + "\n" : ToTable(run));
  return kDone;
}

// What the designs on an experiment share.
struct RigFlags {
  CommonFlags common;
  std::string experiment, actuator, out;
  std::vector<std::string> value, hold, set, params;
  double amplitude = 0, margin = 0.9, duration_s = 10, rate_hz = 500;
};

void AddRigFlags(CLI::App& command, RigFlags& flags) {
  command.add_option("experiment", flags.experiment, "Experiment file (YAML)")->required();
  AddCommonFlags(command, flags.common, false);
  command
      .add_option("--amplitude", flags.amplitude,
                  "Of the command, in its SI unit (default: the largest within the experiment's limits)")
      ->check(FinitePositive());
  command.add_option("--duration", flags.duration_s, "s")->check(FinitePositive())->capture_default_str();
  command.add_option("--rate", flags.rate_hz, "Rows a second")->check(FinitePositive())->capture_default_str();
  command.add_option("--margin", flags.margin, "Share of every limit that may be used")
      ->check(FiniteIn(0.01, 1))
      ->capture_default_str();
  command.add_option("--actuator", flags.actuator, "Which command is driven (default: the experiment's first)");
  command.add_option("--hold", flags.hold, "Another command's constant value: ACTUATOR=VALUE")->allow_extra_args(false);
  command.add_option("--value", flags.value, "A number that a log would bring: NAME=VALUE")->allow_extra_args(false);
  command.add_option("--set", flags.set, "Override a parameter: NAME=VALUE")->allow_extra_args(false);
  command.add_option("--params", flags.params, "YAML file of parameter values")->allow_extra_args(false);
  command.add_option("--out", flags.out, "CSV file of the input, in the experiment's own columns");
}

struct Rig {
  Experiment experiment;  // with limit signals
  std::shared_ptr<const Model> model;
  std::vector<double> values;
  RehearsalOptions rehearsal;
  std::string unit;  // of the driven command
  std::size_t driven = 0;
};

// Assignments of parameters that effects will add are left for later.
Result<Rig> LoadRig(const RigFlags& flags) {
  Rig rig;
  GS_ASSIGN(const Experiment experiment, LoadExperiment(flags.experiment));
  rig.experiment = WithLimitSignals(experiment);
  GS_ASSIGN(rig.model, Model::Load(rig.experiment));
  rig.values = rig.model->Nominal();
  std::vector<std::string> base;
  for (const auto& text : flags.set) {
    if (text.find('@') == std::string::npos) base.push_back(text);
  }
  GS_RETURN_IF_ERROR(OverrideValues(*rig.model, flags.params, base, &rig.values));
  rig.rehearsal.actuator = flags.actuator;
  rig.rehearsal.rate_hz = flags.rate_hz;
  for (const auto& text : flags.hold) {
    GS_ASSIGN(const auto assignment, ParseAssignment(text, "--hold"));
    rig.rehearsal.hold.insert(assignment);
  }
  for (const auto& text : flags.value) {
    GS_ASSIGN(const auto assignment, ParseAssignment(text, "--value"));
    rig.rehearsal.log_values.insert(assignment);
  }
  GS_ASSIGN(rig.driven, DrivenCommand(rig.experiment, rig.rehearsal));
  rig.unit = rig.experiment.commands[rig.driven].unit;
  return rig;
}

struct InputFlags {
  RigFlags rig;
  WaveShape shape = WaveShape::kChirp;
  double low_hz = 0.1, high_hz = 5, period_s = 0.63, hold_s = 1;
};

Result<int> RunInput(const InputFlags& flags) {
  GS_ASSIGN(const Rig rig, LoadRig(flags.rig));
  Waveform wave{.shape = flags.shape,
                .duration_s = flags.rig.duration_s,
                .low_hz = flags.low_hz,
                .high_hz = flags.high_hz,
                .seed = flags.rig.common.seed};
  if (flags.shape == WaveShape::kSquare || flags.shape == WaveShape::kTriangle) wave.low_hz = 1 / flags.period_s;
  if (flags.shape == WaveShape::kSteps) wave.low_hz = 1 / (2 * flags.hold_s);
  GS_ASSIGN(const std::vector<double> unit_wave, SampleWaveform(wave, flags.rig.rate_hz));
  Simulator simulator(*rig.model, 0);
  const std::vector<ModelAndValues> models = {{rig.model.get(), &simulator, rig.values}};
  double amplitude = flags.rig.amplitude;
  const double command_limit = CommandLimit(rig.experiment, rig.experiment.commands[rig.driven].actuator);
  if (amplitude == 0) {
    if (!(command_limit > 0))
      return Error{.what = "neither an amplitude nor a limit of the command is given",
                   .where = flags.rig.experiment,
                   .cure = "add --amplitude, or 'limits:' to the experiment"};
    GS_ASSIGN(amplitude,
              LargestAmplitude(models, rig.rehearsal, unit_wave, command_limit * flags.rig.margin, flags.rig.margin));
  }
  std::vector<double> values = unit_wave;
  for (double& value : values) value *= amplitude;
  GS_ASSIGN(Recording input, MakeInput(rig.experiment, rig.rehearsal, values));
  Rehearsal rehearsal = Rehearse(*rig.model, simulator, std::move(input), rig.values);
  if (!(rehearsal.worst <= 1)) {
    std::string reached, allowed;
    for (const auto& e : rehearsal.extremes) {
      if (e.reached <= e.limit) continue;
      reached += fmt::format("{}{} {:.4g} {}", reached.empty() ? "" : ", ", e.name, e.reached, e.unit);
      allowed += fmt::format("{}{:.4g}", allowed.empty() ? "" : ", ", e.limit);
    }
    const auto largest = LargestAmplitude(models, rig.rehearsal, unit_wave, amplitude, 1);
    return Error{.what = "the input would pass the rig's limits on the nominal model",
                 .where = flags.rig.experiment,
                 .actual = reached.empty() ? "the simulation diverges" : reached,
                 .allowed = allowed,
                 .cure = largest.ok() ? fmt::format("--amplitude {:.3g} keeps them", largest.value()) : ""};
  }
  if (!flags.rig.out.empty()) {
    GS_RETURN_IF_ERROR(WriteFile(flags.rig.out, InputCsv(rig.experiment, rehearsal)));
    if (!flags.rig.common.quiet) fmt::print(stderr, "wrote {}\n", flags.rig.out);
  }
  const InputRun run{.info = {.seed = flags.rig.common.seed},
                     .wave = wave,
                     .amplitude = amplitude,
                     .unit = rig.unit,
                     .rehearsal = std::move(rehearsal)};
  fmt::print("{}", flags.rig.common.json ? ToJson(run).dump(2) + "\n" : ToTable(run));
  return kDone;
}

struct OptimalFlags {
  RigFlags rig;
  std::vector<std::string> parameters, separate;
};

// The rig's own size, from a sweep as large as its limits allow.
Result<ScaleTable> ScalesOf(const Rig& rig, double duration_s) {
  GS_ASSIGN(const auto wave, SampleWaveform({.shape = WaveShape::kChirp,
                                             .duration_s = duration_s,
                                             .low_hz = 0.1,
                                             .high_hz = std::min(5.0, rig.rehearsal.rate_hz / 8)},
                                            rig.rehearsal.rate_hz));
  Simulator simulator(*rig.model, 0);
  const double limit = CommandLimit(rig.experiment, rig.experiment.commands[rig.driven].actuator);
  GS_ASSIGN(const double amplitude, LargestAmplitude({{rig.model.get(), &simulator, rig.values}}, rig.rehearsal, wave,
                                                     limit > 0 ? limit : 1, 0.9));
  std::vector<double> values = wave;
  for (double& value : values) value *= amplitude;
  GS_ASSIGN(Recording input, MakeInput(rig.experiment, rig.rehearsal, values));
  return EstimateScales(*rig.model, {Rehearse(*rig.model, simulator, std::move(input), rig.values).recording});
}

// A rival: the base model and one effect, at --set's values or else at a typical size.
Result<Hypothesis> MakeRival(const Rig& rig, const EffectUse& use, const ScaleTable& scales, const RigFlags& flags,
                             std::vector<std::string>* assumed) {
  GS_ASSIGN(const auto model, Model::Build(rig.model->rig(), {use}, scales));
  std::vector<double> values = model->Nominal();
  std::copy(rig.values.begin(), rig.values.end(), values.begin());
  const auto placed = PlacedParameters(use, *rig.model->rig(), scales);
  for (const auto& p : placed) {
    GS_ASSIGN(const int index, model->Find(p.name, use.Text()));
    values[index] = p.trials.empty() ? p.start : p.trials[p.trials.size() / 2];
  }
  std::vector<std::string> own;
  for (const auto& text : flags.set) {
    if (text.starts_with(use.Text() + ".")) own.push_back(text);
  }
  GS_RETURN_IF_ERROR(OverrideValues(*model, {}, own, &values));
  for (const auto& p : placed) assumed->push_back(fmt::format("{}={:.6g}", p.name, values[model->IndexOf(p.name)]));
  Hypothesis rival = MakeHypothesis(use.Text(), model, values);
  // A value outside the catalogue's range for this rig is the user's to choose: the range grows to hold it.
  for (std::size_t i = 0; i < rival.free.size(); ++i) {
    const double x = rival.ToSearch(i, values[rival.free[i].parameter]);
    rival.free[i].low = std::min(rival.free[i].low, x);
    rival.free[i].high = std::max(rival.free[i].high, x);
  }
  return rival;
}

std::string ReproducingCommand(const OptimalFlags& flags, const InputScore& best) {
  const Waveform& w = best.wave;
  std::string text = fmt::format("gapscope design {} {} --duration {:g} --rate {:g} --amplitude {:.6g}",
                                 w.shape == WaveShape::kChirp ? "sweep" : WaveShapeName(w.shape), flags.rig.experiment,
                                 w.duration_s, flags.rig.rate_hz, best.amplitude);
  switch (w.shape) {
    case WaveShape::kChirp:
    case WaveShape::kMultisine:
      text += fmt::format(" --low-hz {:.6g} --high-hz {:.6g}", w.low_hz, w.high_hz);
      break;
    case WaveShape::kSteps:
      text += fmt::format(" --hold-s {:.6g} --seed {}", 1 / (2 * w.low_hz), w.seed);
      break;
    default:
      text += fmt::format(" --period {:.6g}", 1 / w.low_hz);
  }
  for (const auto& [flag, list] : {std::pair{"--value", &flags.rig.value}, {"--hold", &flags.rig.hold}}) {
    for (const auto& item : *list) text += fmt::format(" {} {}", flag, item);
  }
  return text + " --out input.csv";
}

Result<int> RunOptimal(const OptimalFlags& flags) {
  if (flags.parameters.empty() == flags.separate.empty()) {
    return Error{.what = "say what the input is for",
                 .where = "design optimal",
                 .allowed = "--parameter NAME (one or more), or --separate EFFECT@ON twice or more"};
  }
  if (flags.separate.size() == 1)
    return Error{.what = "one effect has nothing to be told apart from",
                 .where = "--separate",
                 .cure = "add a second --separate EFFECT@ON, or --separate none"};
  GS_ASSIGN(const Rig rig, LoadRig(flags.rig));
  ThreadPool pool(flags.rig.common.jobs > 0 ? flags.rig.common.jobs : DefaultWorkers());
  const OptimalOptions options{.rehearsal = rig.rehearsal,
                               .duration_s = flags.rig.duration_s,
                               .margin = flags.rig.margin,
                               .amplitude = flags.rig.amplitude};
  const Hypothesis base = MakeHypothesis("none", rig.model, rig.values);
  OptimalDesign design;
  if (!flags.parameters.empty()) {
    std::vector<int> indices;
    for (const auto& name : flags.parameters) {
      GS_ASSIGN(const int index, rig.model->Find(name, "--parameter"));
      indices.push_back(index);
    }
    GS_ASSIGN(design, DesignForParameters(base, indices, options, pool));
  } else {
    GS_ASSIGN(const ScaleTable scales, ScalesOf(rig, flags.rig.duration_s));
    std::vector<Hypothesis> rivals;
    std::vector<std::string> assumed;
    for (const auto& text : flags.separate) {
      if (text == "none") {
        rivals.push_back(base);
        continue;
      }
      GS_ASSIGN(const auto uses, ParseEffects({text}, *rig.model->rig()));
      for (const auto& other : rivals) {
        if (other.name == uses.front().Text())
          return Error{.what = "the effect stands twice", .where = "--separate " + text};
      }
      GS_ASSIGN(Hypothesis rival, MakeRival(rig, uses.front(), scales, flags.rig, &assumed));
      rivals.push_back(std::move(rival));
    }
    GS_ASSIGN(design, DesignForRivals(base, rivals, options, pool));
    design.values = std::move(assumed);
  }
  if (!flags.rig.out.empty()) {
    GS_RETURN_IF_ERROR(WriteFile(flags.rig.out, InputCsv(rig.experiment, design.inputs.front().rehearsal)));
    if (!flags.rig.common.quiet) fmt::print(stderr, "wrote {}\n", flags.rig.out);
  }
  using Purpose = OptimalRun::Purpose;
  const OptimalRun run{.info = {.seed = flags.rig.common.seed},
                       .purpose = flags.parameters.empty() ? Purpose::kEffects : Purpose::kParameters,
                       .design = design,
                       .unit = rig.unit,
                       .command = ReproducingCommand(flags, design.inputs.front())};
  fmt::print("{}", flags.rig.common.json ? ToJson(run).dump(2) + "\n" : ToTable(run));
  return kDone;
}

}  // namespace

void AddDesign(CLI::App& program, Run& run) {
  CLI::App* design = program.add_subcommand("design", "Excitation for the next experiment, within the rig's limits");
  design->require_subcommand(1);
  design->footer(
      "Example: gapscope design optimal models/qube/experiment.yaml --separate cable_spring@arm --separate "
      "torque_bias@arm --out input.csv");

  auto chirp = std::make_shared<ChirpFlags>();
  CLI::App* c = design->add_subcommand("chirp", "Gains and largest chirps of a position servo");
  c->add_flag("--json", chirp->common.json, "Print the result as JSON on stdout, nothing else");
  c->add_flag("--quiet", chirp->common.quiet, "No messages on stderr but errors");
  c->add_option("--inertia-kg-m2", chirp->request.inertia_kg_m2, "Inertia at the joint")
      ->required()
      ->check(FinitePositive());
  c->add_option("--natural-frequency-hz", chirp->request.natural_frequency_hz, "Wanted natural frequency")
      ->required()
      ->check(FinitePositive());
  c->add_option("--damping-ratio", chirp->request.damping_ratios, "Wanted damping ratios, separated by commas")
      ->required()
      ->delimiter(',')
      ->check(FinitePositive());
  c->add_option("--speed-limit-rpm", chirp->speed_limit_rpm, "Largest speed of the joint")
      ->required()
      ->check(FinitePositive());
  c->add_option("--amplitude-factor", chirp->request.amplitude_factor, "Share of the speed limit that is used")
      ->check(FinitePositive())
      ->capture_default_str();
  c->add_option("--end-over-bandwidth", chirp->request.end_over_bandwidth,
                "Ends of the chirp over the bandwidth, separated by commas (default 2,3,5)")
      ->delimiter(',')
      ->check(FinitePositive());
  c->add_option("--start-hz", chirp->start_hz, "Where the chirp starts")
      ->check(FinitePositive())
      ->capture_default_str();
  c->add_option("--duration", chirp->duration_s, "Length of each chirp, s")
      ->check(FinitePositive())
      ->capture_default_str();
  c->add_option("--rate", chirp->rate_hz, "Rows a second")->check(FinitePositive())->capture_default_str();
  c->add_option("--out", chirp->out, "CSV file: time, target, limits, gains; several chirps after each other");
  c->footer(
      "Example: gapscope design chirp --inertia-kg-m2 0.159221308 --natural-frequency-hz 5 --damping-ratio 0.707,1.2,2 "
      "--speed-limit-rpm 116 --out chirp.csv");
  c->callback([chirp, &run] { run = [chirp] { return RunChirp(*chirp); }; });

  const auto add_input = [&](const char* name, WaveShape shape, const char* what) {
    auto flags = std::make_shared<InputFlags>();
    flags->shape = shape;
    CLI::App* command = design->add_subcommand(name, what);
    AddRigFlags(*command, flags->rig);
    if (shape == WaveShape::kChirp || shape == WaveShape::kMultisine) {
      command->add_option("--low-hz", flags->low_hz, "Lowest (first) frequency")
          ->check(FinitePositive())
          ->capture_default_str();
      command->add_option("--high-hz", flags->high_hz, "Highest (last) frequency")
          ->check(FinitePositive())
          ->capture_default_str();
    }
    if (shape == WaveShape::kTriangle) flags->period_s = 10;
    if (shape == WaveShape::kSquare || shape == WaveShape::kTriangle)
      command->add_option("--period", flags->period_s, "s")->check(FinitePositive())->capture_default_str();
    if (shape == WaveShape::kSteps)
      command->add_option("--hold-s", flags->hold_s, "Mean length of a level, s")
          ->check(FinitePositive())
          ->capture_default_str();
    command->footer(fmt::format("Example: gapscope design {} models/flexjoint/experiment.yaml --out input.csv", name));
    command->callback([flags, &run] { run = [flags] { return RunInput(*flags); }; });
  };
  add_input("sweep", WaveShape::kChirp, "Linear chirp of the command, rehearsed on the nominal model");
  add_input("steps", WaveShape::kSteps, "Levels of either sign, rehearsed on the nominal model");
  add_input("triangle", WaveShape::kTriangle, "Triangle wave, rehearsed on the nominal model");
  add_input("multisine", WaveShape::kMultisine, "Up to 24 sines at once, rehearsed on the nominal model");
  add_input("square", WaveShape::kSquare, "Square wave (0.63 s: the flexible joint's), rehearsed on the nominal model");

  AddFeedback(*design, run);

  auto optimal = std::make_shared<OptimalFlags>();
  optimal->rig.duration_s = 6;
  optimal->rig.rate_hz = 250;
  CLI::App* o = design->add_subcommand("optimal", "The input that says most about parameters, or tells effects apart");
  AddRigFlags(*o, optimal->rig);
  o->add_option("--parameter", optimal->parameters, "A parameter to be known well")->allow_extra_args(false);
  o->add_option("--separate", optimal->separate,
                "EFFECT@ON to be told apart from the others given; none: from no effect. --set gives its parameters")
      ->allow_extra_args(false);
  o->footer(
      "Example: gapscope design optimal models/qube/experiment.yaml --separate cable_spring@arm --separate "
      "torque_bias@arm --out input.csv");
  o->callback([optimal, &run] { run = [optimal] { return RunOptimal(*optimal); }; });
}

}  // namespace gapscope::cli
