// Random smooth torques that no effect makes: what a model may miss is judged beside them.
#ifndef GAPSCOPE_DIAGNOSE_TORQUES_H_
#define GAPSCOPE_DIAGNOSE_TORQUES_H_

#include <vector>

#include "src/diagnose/candidate.h"

namespace gapscope {

// Random smooth torques on the joints of measured signals, in thirds of angle, of speed and of both. The same ones in
// every call.
std::vector<ProbeTorque> MakeTorques(const Workbench& bench);
// More of them, of the drive's command as well: together nearly any smooth torque.
std::vector<ProbeTorque> MakeFreeForm(const Workbench& bench);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_TORQUES_H_
