// Designed inputs for people and programs.
#ifndef GAPSCOPE_REPORT_DESIGN_REPORT_H_
#define GAPSCOPE_REPORT_DESIGN_REPORT_H_

#include <string>
#include <vector>

#include "src/design/chirp.h"
#include "src/design/optimal.h"

namespace gapscope {

// The console table has the digits of the document "Motor System Identification", section 3.3; JSON
// (gapscope.design.chirp/1) is unrounded.
std::string ChirpTable(const std::vector<ChirpRow>& rows);
std::string ChirpJson(const std::vector<ChirpRow>& rows);
// All chirps after each other with a second of rest between, `rate_hz` rows a second: time, target and its speed, their
// limits, and the gains to be set. Errors: those of SampleWaveform.
Result<std::string> ChirpCsv(const std::vector<ChirpRow>& rows, const ChirpRequest& request, double start_hz,
                             double duration_s, double rate_hz);

// A value without the zeros behind it that carry nothing, but with one decimal at least: 12.0050 -> "12.005", 5.00 ->
// "5.0".
std::string TrimmedNumber(double value, int decimals);

std::string RehearsalTable(const Waveform& wave, double amplitude, const std::string& unit, const Rehearsal& rehearsal);
std::string RehearsalJson(const Waveform& wave, double amplitude, const std::string& unit, const Rehearsal& rehearsal);

// `command`: the line that makes the best input again.
std::string OptimalTable(const OptimalDesign& design, const std::string& unit, const std::string& command,
                         bool of_effects);
std::string OptimalJson(const OptimalDesign& design, const std::string& unit, const std::string& command,
                        bool of_effects);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_DESIGN_REPORT_H_
