// CSV as users have it: any of the usual delimiters, quotes, decimal commas, units in the header, comments, sparse
// rows. One pass of std::from_chars over the bytes; what is not a plain number takes a slower way (csv_fields.h).
#ifndef GAPSCOPE_LOG_CSV_READER_H_
#define GAPSCOPE_LOG_CSV_READER_H_

#include <string>
#include <string_view>

#include "src/core/result.h"
#include "src/log/log.h"

namespace gapscope {

// Reads a log from the bytes of a file; `path` is for messages.
Result<Log> ReadCsv(const std::string& path, std::string_view bytes);

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_CSV_READER_H_
