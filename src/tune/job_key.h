// A key of everything that a fit's or a replay's numbers depend on: whether a journal or a finished task is of this
// job.
#ifndef GAPSCOPE_TUNE_JOB_KEY_H_
#define GAPSCOPE_TUNE_JOB_KEY_H_

#include "src/core/hash.h"
#include "src/experiment/recording.h"
#include "src/model/model.h"

namespace gapscope {

// The compiled MJCF to its last byte, parameters with bounds, settings of fields, commands and signals.
void AddModel(const Model& model, Hasher* hasher);
// Stamps, commands, measurements and the log's own values.
void AddRecording(const Recording& recording, Hasher* hasher);

}  // namespace gapscope

#endif  // GAPSCOPE_TUNE_JOB_KEY_H_
