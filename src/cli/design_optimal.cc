#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "src/cli/commands.h"
#include "src/cli/design_rig.h"
#include "src/cli/print.h"
#include "src/report/design_report.h"
#include "src/report/json.h"

namespace gapscope::cli {
namespace {

struct OptimalFlags {
  RigFlags rig;
  std::vector<std::string> parameters, separate;
};

// The rig's own size, from a sweep as large as its limits allow.
Result<ScaleTable> ScalesOf(const DesignRig& rig, double duration_s) {
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
Result<Hypothesis> MakeRival(const DesignRig& rig, const EffectUse& use, const ScaleTable& scales,
                             const RigFlags& flags, std::vector<std::string>* assumed) {
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
    GS_ASSIGN(const auto assignment, ParseAssignment(text, "--set"));
    if (UseWithParameter(assignment.first, *rig.model->rig()) == use) own.push_back(text);
  }
  GS_RETURN_IF_ERROR(OverrideValues(*model, {}, own, &values));
  for (const auto& p : placed) assumed->push_back(fmt::format("{}={:.6g}", p.name, values[model->IndexOf(p.name)]));
  return Hypothesis{.name = use.Text(), .model = model, .values = std::move(values)};
}

// The input that tells --separate's effects apart.
Result<OptimalDesign> DesignToSeparate(const OptimalFlags& flags, const DesignRig& rig, const Hypothesis& base,
                                       const OptimalOptions& options, ThreadPool& pool) {
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
  GS_ASSIGN(OptimalDesign design, DesignForRivals(base, rivals, options, pool));
  design.values = std::move(assumed);
  return design;
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
  GS_ASSIGN(const DesignRig rig, LoadRig(flags.rig));
  ThreadPool pool(WorkersOf(flags.rig.common));
  const OptimalOptions options{.rehearsal = rig.rehearsal,
                               .duration_s = flags.rig.duration_s,
                               .margin = flags.rig.margin,
                               .amplitude = flags.rig.amplitude};
  const Hypothesis base{.name = "none", .model = rig.model, .values = rig.values};
  OptimalDesign design;
  if (!flags.parameters.empty()) {
    std::vector<int> indices;
    for (const auto& name : flags.parameters) {
      GS_ASSIGN(const int index, rig.model->Find(name, "--parameter"));
      indices.push_back(index);
    }
    GS_ASSIGN(design, DesignForParameters(base, indices, options, pool));
  } else {
    GS_ASSIGN(design, DesignToSeparate(flags, rig, base, options, pool));
  }
  GS_RETURN_IF_ERROR(
      WriteInput(flags.rig.out, InputCsv(rig.experiment, design.inputs.front().rehearsal), flags.rig.common.quiet));
  using Purpose = OptimalRun::Purpose;
  const OptimalRun run{
      .info = {.seed = flags.rig.common.seed},
      .purpose = flags.parameters.empty() ? Purpose::kEffects : Purpose::kParameters,
      .design = design,
      .unit = rig.unit,
      .command = CommandFor(flags.rig.experiment, rig.rehearsal, design.inputs.front()) + " --out input.csv"};
  Print(stdout, "{}", flags.rig.common.json ? JsonText(ToJson(run)) : ToTable(run));
  return kDone;
}

}  // namespace

Command OptimalCommand() {
  auto flags = std::make_shared<OptimalFlags>();
  flags->rig.duration_s = 6;
  flags->rig.rate_hz = 250;
  const std::vector<Option> own = {
      {.flag = "--parameter", .value = &flags->parameters, .help = "A parameter to be known well; more than once"},
      {.flag = "--separate",
       .value = &flags->separate,
       .help = "EFFECT@ON to be told apart from the others given, or none: from no effect; twice or more",
       .more = "An effect has --set's parameters, otherwise those of a typical size on this rig. Give --parameter or "
               "--separate, not both"}};
  return {.name = "optimal",
          .what = "The input that says most about parameters, or tells effects apart",
          .options = Join({OptionsOf(flags->rig), own}),
          .example =
              "gapscope design optimal models/qube/experiment.yaml --separate cable_spring@arm --separate "
              "torque_bias@arm --out input.csv",
          .run = [flags] { return RunOptimal(*flags); }};
}

}  // namespace gapscope::cli
