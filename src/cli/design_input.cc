#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "src/cli/commands.h"
#include "src/cli/design_rig.h"
#include "src/cli/print.h"
#include "src/report/design_report.h"
#include "src/report/json.h"

namespace gapscope::cli {
namespace {

struct InputFlags {
  RigFlags rig;
  WaveShape shape = WaveShape::kChirp;
  double low_hz = 0.1, high_hz = 5, period_s = 0.63, hold_s = 1, offset = 0;
  bool mirrored = false;
};

Error PassesLimits(const Rehearsal& rehearsal, const std::string& where, const std::string& cure) {
  std::string reached, allowed;
  for (const auto& e : rehearsal.extremes) {
    if (e.reached <= e.limit) continue;
    reached += fmt::format("{}{} {:.4g} {}", reached.empty() ? "" : ", ", e.name, e.reached, e.unit);
    allowed += fmt::format("{}{:.4g}", allowed.empty() ? "" : ", ", e.limit);
  }
  return {.what = "the input would pass the rig's limits on the nominal model",
          .where = where,
          .actual = reached.empty() ? "the simulation diverges" : reached,
          .allowed = allowed,
          .cure = cure};
}

Result<int> RunInput(const InputFlags& flags) {
  GS_ASSIGN(DesignRig rig, LoadRig(flags.rig));
  rig.rehearsal.offset = flags.offset;
  Waveform wave{.shape = flags.shape,
                .duration_s = flags.rig.duration_s,
                .low_hz = flags.low_hz,
                .high_hz = flags.high_hz,
                .seed = flags.rig.common.seed,
                .mirrored = flags.mirrored};
  if (flags.shape == WaveShape::kSquare || flags.shape == WaveShape::kTriangle) wave.low_hz = 1 / flags.period_s;
  if (flags.shape == WaveShape::kSteps) wave.low_hz = 1 / (2 * flags.hold_s);
  GS_ASSIGN(const std::vector<double> unit_wave, SampleWaveform(wave, flags.rig.rate_hz));
  Simulator simulator(*rig.model, 0);
  const LackedLoad lacks{.command = rig.driven, .value = flags.offset};
  const std::vector<ModelAndValues> models = {{rig.model.get(), &simulator, rig.values, lacks}};
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
  Rehearsal rehearsal = Rehearse(*rig.model, simulator, std::move(input), rig.values, lacks);
  if (!(rehearsal.worst <= 1)) {
    const auto largest = LargestAmplitude(models, rig.rehearsal, unit_wave, amplitude, 1);
    return PassesLimits(rehearsal, flags.rig.experiment,
                        largest.ok() ? fmt::format("--amplitude {:.3g} keeps them", largest.value()) : "");
  }
  GS_RETURN_IF_ERROR(WriteInput(flags.rig.out, InputCsv(rig.experiment, rehearsal), flags.rig.common.quiet));
  const InputRun run{.info = {.seed = flags.rig.common.seed},
                     .wave = wave,
                     .amplitude = amplitude,
                     .offset = flags.offset,
                     .unit = rig.unit,
                     .rehearsal = std::move(rehearsal)};
  Print(stdout, "{}", flags.rig.common.json ? JsonText(ToJson(run)) : ToTable(run));
  return kDone;
}

// The options of one shape.
std::vector<Option> ShapeOptions(InputFlags& flags) {
  switch (flags.shape) {
    case WaveShape::kChirp:
    case WaveShape::kMultisine:
      return {{.flag = "--low-hz",
               .value = &flags.low_hz,
               .unit = "Hz",
               .range = Above(0),
               .help = "Lowest (first) frequency"},
              {.flag = "--high-hz",
               .value = &flags.high_hz,
               .unit = "Hz",
               .range = Above(0),
               .help = "Highest (last) frequency"}};
    case WaveShape::kSquare:
    case WaveShape::kTriangle:
      return {{.flag = "--period", .value = &flags.period_s, .unit = "s", .range = Above(0), .help = "Of the wave"}};
    case WaveShape::kSteps:
      return {{.flag = "--hold-s",
               .value = &flags.hold_s,
               .unit = "s",
               .range = Above(0),
               .help = "Mean length of a level",
               .more = "A level is held for half to one and a half times this, by --seed"}};
  }
  return {};
}

Command InputCommand(const char* name, WaveShape shape, const char* what) {
  auto flags = std::make_shared<InputFlags>();
  flags->shape = shape;
  if (shape == WaveShape::kTriangle) flags->period_s = 10;
  return {.name = name,
          .what = what,
          .options = Join({OptionsOf(flags->rig),
                           ShapeOptions(*flags),
                           {{.flag = "--offset",
                             .value = &flags->offset,
                             .unit = "the command's SI unit",
                             .help = "A constant beside the wave, against a load that the nominal model lacks",
                             .more = "It is taken to cancel that load: the nominal model is driven without it"},
                            {.flag = "--mirror",
                             .value = &flags->mirrored,
                             .help = "The second half is the first one with its sign changed",
                             .more = "What integrates its command then goes to both sides"}}}),
          .example = fmt::format("gapscope design {} models/flexjoint/experiment.yaml --out input.csv", name),
          .run = [flags] { return RunInput(*flags); }};
}

}  // namespace

std::vector<Command> InputCommands() {
  return {InputCommand("sweep", WaveShape::kChirp, "Linear chirp of the command, rehearsed on the nominal model"),
          InputCommand("steps", WaveShape::kSteps, "Levels of either sign, rehearsed on the nominal model"),
          InputCommand("triangle", WaveShape::kTriangle, "Triangle wave, rehearsed on the nominal model"),
          InputCommand("multisine", WaveShape::kMultisine, "Up to 24 sines at once, rehearsed on the nominal model"),
          InputCommand("square", WaveShape::kSquare,
                       "Square wave (0.63 s: the flexible joint's), rehearsed on the nominal model")};
}

}  // namespace gapscope::cli
