// A log as NPZ, the table `gapscope.log/1` that npz_reader.h reads: to the last bit, whatever the log was read from.
#ifndef GAPSCOPE_LOG_NPZ_WRITER_H_
#define GAPSCOPE_LOG_NPZ_WRITER_H_

#include <string>

#include "src/log/log.h"

namespace gapscope {

// Writes `path`, whole or not at all, making its folders. Errors: a log above 4 GB; as WriteFile.
Status WriteNpz(const std::string& path, const Log& log);

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_NPZ_WRITER_H_
