// A recording on fewer stamps: the search for effects simulates every log hundreds of times, and a motion sampled at
// 250 Hz tells as much about a mechanism that moves at some hertz as one sampled at 1 kHz.
#ifndef GAPSCOPE_DIAGNOSE_COARSEN_H_
#define GAPSCOPE_DIAGNOSE_COARSEN_H_

#include "src/experiment/recording.h"

namespace gapscope {

// Keeps stamps at least `least_step_s` apart. Measured values are those of the kept stamps; a command becomes its mean
// over the time until the next kept stamp, which keeps its impulse, sharpened by what means and their holding flatten.
// Of the timeline only the median step follows. Scored forces at the kept stamps follow the recording's own commands.
Recording Coarsen(const Recording& recording, double least_step_s);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_COARSEN_H_
