// bam JSON, the logs of "Better Actuator Models" (github.com/Rhoban/bam): one object whose numbers and texts are the
// header, and an array "entries" of one flat object per sample.
//   {"mass": 0.49, "kp": 100, "motor": "xl330", "entries": [{"timestamp": 0.0035, "position": -0.003, ...}, ...]}
// Each key of the entries becomes a column; true and false become 1 and 0, null (and Python's NaN) a missing value.
#ifndef GAPSCOPE_LOG_BAM_READER_H_
#define GAPSCOPE_LOG_BAM_READER_H_

#include <string>
#include <string_view>

#include "src/core/result.h"
#include "src/log/log.h"

namespace gapscope {

// Whether a file is one: by its extension, or by how it begins.
bool LooksLikeJson(const std::string& path, std::string_view bytes);

// Reads a log from the bytes of a file; `path` is for messages. The JSON is taken as a stream of events, so that memory
// stays within a small multiple of the file whatever it says. Errors give path:line:column: not JSON, no "entries",
// an entry that is not a flat object of numbers, a key twice, nesting deeper than 64, more than 1,000 columns.
Result<Log> ReadBamJson(const std::string& path, std::string_view bytes);

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_BAM_READER_H_
