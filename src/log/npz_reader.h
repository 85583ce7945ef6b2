// NPZ, the archive of arrays that numpy.savez and numpy.savez_compressed write: a table of this program's own
// (`gapscope.log/1`, what its Python package hands over) or a user's own arrays. docs/reference/experiment.md says
// which arrays become which columns. Nothing in a file is executed: arrays of Python objects, which numpy would
// unpickle, are refused.
#ifndef GAPSCOPE_LOG_NPZ_READER_H_
#define GAPSCOPE_LOG_NPZ_READER_H_

#include <string>
#include <string_view>

#include "src/core/result.h"
#include "src/log/log.h"

namespace gapscope {

// Whether these are the bytes of a ZIP archive, whole or cut off.
bool LooksLikeZip(const std::string& path, std::string_view bytes);

// Reads a log from the bytes of a file; `path` is for messages. Errors name the array: a damaged or cut archive, a
// checksum, sizes that are not those of the array, an array of objects, records or big-endian numbers, no column at
// all, more than 10'000 columns, more bytes unpacked than a log of this size can have.
Result<Log> ReadNpz(const std::string& path, std::string_view bytes);

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_NPZ_READER_H_
