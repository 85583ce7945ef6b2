// What the named effects leave of the refitted base model's misfit, divided by whose it is.
#ifndef GAPSCOPE_DIAGNOSE_REMAINDER_H_
#define GAPSCOPE_DIAGNOSE_REMAINDER_H_

#include "src/diagnose/beside.h"

namespace gapscope {

// Both sets are scored. `held_out`: the final one's predictions. `floor`: the sensors' noise as a normalised error.
Remainder Divide(const Workbench& bench, const Candidate& base, const Candidate& final,
                 const std::vector<LogReplay>& held_out, double floor, const BesideTorques& beside);

// Mean square by which logs of the same commands differ from each other where one model predicts them, half of it (each
// has its part), in units of their signals' deviations; NaN: no two logs have the same commands.
double SquareBetweenRepeats(const std::vector<Recording>& recordings, const std::vector<LogReplay>& predicted);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_REMAINDER_H_
