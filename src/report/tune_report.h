// A tuned model for people and programs: console table, JSON (gapscope.tune/1).
#ifndef GAPSCOPE_REPORT_TUNE_REPORT_H_
#define GAPSCOPE_REPORT_TUNE_REPORT_H_

#include <cstdint>
#include <string>

#include "src/report/console.h"
#include "src/tune/tune.h"

namespace gapscope {

std::string TuneTable(const TuneSummary& summary, const Model& model, const Console& console = {});
std::string TuneJson(const TuneSummary& summary, const Model& model, std::uint64_t seed);
// "only motor.kt / motor.resistance is known": what a flat direction leaves, in words.
std::string FlatText(const FlatDirection& flat, const Model& model);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_TUNE_REPORT_H_
