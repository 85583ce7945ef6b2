#include <fmt/core.h>

#include <nlohmann/json.hpp>
#include <numbers>

#include "src/cli/commands.h"
#include "src/cli/design_rig.h"
#include "src/cli/print.h"
#include "src/report/design_report.h"
#include "src/report/json.h"

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
    GS_RETURN_IF_ERROR(WriteInput(flags.out, csv, flags.common.quiet));
  }
  const ChirpRun run{.info = {}, .rows = rows};
  Print(stdout, "{}", flags.common.json ? JsonText(ToJson(run)) : ToTable(run));
  return kDone;
}

std::vector<Option> OptionsOf(ChirpFlags& flags) {
  ChirpRequest& r = flags.request;
  const std::vector<Option> own = {
      {.flag = "--inertia-kg-m2",
       .value = &r.inertia_kg_m2,
       .unit = "kg m2",
       .range = Above(0),
       .required = true,
       .help = "Inertia at the joint"},
      {.flag = "--natural-frequency-hz",
       .value = &r.natural_frequency_hz,
       .unit = "Hz",
       .range = Above(0),
       .required = true,
       .help = "Wanted natural frequency"},
      {.flag = "--damping-ratio",
       .value = &r.damping_ratios,
       .range = Above(0),
       .required = true,
       .commas = true,
       .help = "Wanted damping ratios, separated by commas"},
      {.flag = "--speed-limit-rpm",
       .value = &flags.speed_limit_rpm,
       .unit = "rpm",
       .range = Above(0),
       .required = true,
       .help = "Largest speed of the joint"},
      {.flag = "--amplitude-factor",
       .value = &r.amplitude_factor,
       .range = {.low = 0, .high = 1, .low_is_in = false},
       .help = "Share of the speed limit that is used"},
      {.flag = "--end-over-bandwidth",
       .value = &r.end_over_bandwidth,
       .range = Above(0),
       .commas = true,
       .help = "Ends of the chirp over the bandwidth, separated by commas"},
      {.flag = "--start-hz",
       .value = &flags.start_hz,
       .unit = "Hz",
       .range = Above(0),
       .help = "Where the chirp starts"},
      {.flag = "--duration",
       .value = &flags.duration_s,
       .unit = "s",
       .range = Above(0),
       .help = "Length of each chirp"},
      {.flag = "--rate", .value = &flags.rate_hz, .unit = "Hz", .range = Above(0), .help = "Rows a second"},
      {.flag = "--out",
       .value = &flags.out,
       .unset = "nothing is written",
       .help = "CSV file: time, target, limits, gains; several chirps after each other"}};
  return Join({own, PrintOptions(flags.common)});
}

}  // namespace

Command ChirpCommand() {
  auto flags = std::make_shared<ChirpFlags>();
  return {.name = "chirp",
          .what = "Gains and largest chirps of a position servo",
          .options = OptionsOf(*flags),
          .example =
              "gapscope design chirp --inertia-kg-m2 0.159221308 --natural-frequency-hz 5 --damping-ratio "
              "0.707,1.2,2 --speed-limit-rpm 116 --out chirp.csv",
          .run = [flags] { return RunChirp(*flags); }};
}

}  // namespace gapscope::cli
