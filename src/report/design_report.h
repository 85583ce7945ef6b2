// Designed inputs and feedback for people and programs.
#ifndef GAPSCOPE_REPORT_DESIGN_REPORT_H_
#define GAPSCOPE_REPORT_DESIGN_REPORT_H_

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "src/design/chirp.h"
#include "src/design/optimal.h"
#include "src/report/run.h"

namespace gapscope {

// The console table has the digits of the document "Motor System Identification", section 3.3; JSON
// (gapscope.design.chirp/1) is unrounded.
struct ChirpRun {
  RunInfo info;
  std::vector<ChirpRow> rows;
};
nlohmann::ordered_json ToJson(const ChirpRun& run);
std::string ToTable(const ChirpRun& run);
// All chirps after each other with a second of rest between, `rate_hz` rows a second: time, target and its speed, their
// limits, and the gains to be set. Errors: those of SampleWaveform.
Result<std::string> ChirpCsv(const std::vector<ChirpRow>& rows, const ChirpRequest& request, double start_hz,
                             double duration_s, double rate_hz);

// A value without the zeros behind it that carry nothing, but with one decimal at least: 12.0050 -> "12.005", 5.00 ->
// "5.0".
std::string TrimmedNumber(double value, int decimals);

// An input and what it does to the nominal model (gapscope.design.input/1).
struct InputRun {
  RunInfo info;
  Waveform wave;
  double amplitude = 0, offset = 0;  // of the command, in `unit`
  std::string unit;
  Rehearsal rehearsal;
};
nlohmann::ordered_json ToJson(const InputRun& run);
std::string ToTable(const InputRun& run);

// The inputs that were compared, best first (gapscope.design.optimal/1).
struct OptimalRun {
  enum class Purpose { kParameters, kEffects };  // to know parameters well, or to tell effects apart
  RunInfo info;
  Purpose purpose = Purpose::kParameters;
  OptimalDesign design;
  std::string unit;     // of the command
  std::string command;  // the line that makes the best input again
};
nlohmann::ordered_json ToJson(const OptimalRun& run);
std::string ToTable(const OptimalRun& run);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_DESIGN_REPORT_H_
