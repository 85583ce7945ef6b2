// Which signals a console table shows: all of a few, of many the worst, and the rest in a line.
#ifndef GAPSCOPE_REPORT_SIGNAL_TABLE_H_
#define GAPSCOPE_REPORT_SIGNAL_TABLE_H_

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "src/compare/score.h"

namespace gapscope {

// By number: all up to eight in the order given, of more the eight with the greatest nrmse, worst first.
std::vector<std::size_t> SignalsInTable(std::span<const SignalScore> scores);

// "21 more signals, nRMSE 0.051 .. 0.16 (--json: all)"; empty: none is left out.
std::string SignalsNotInTable(std::span<const SignalScore> scores);

std::size_t WidestSignal(std::span<const SignalScore> scores);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_SIGNAL_TABLE_H_
