// How a CSV file is written: its delimiter, the line of names, the lines of units, where the numbers begin.
#ifndef GAPSCOPE_LOG_CSV_DIALECT_H_
#define GAPSCOPE_LOG_CSV_DIALECT_H_

#include <string>
#include <string_view>
#include <vector>

#include "src/core/result.h"
#include "src/log/log.h"

namespace gapscope {

struct CsvDialect {
  char delimiter = ',';  // ' ' stands for runs of blanks
  std::vector<std::string> names, units;
  std::vector<bool> is_text;     // columns that hold words ("idle", "running") throughout the first rows
  std::string_view header_text;  // the line of names as written, to recognise it when it comes again
  std::size_t header_line = 1;
  std::size_t body_offset = 0, body_line = 1;  // where the first line after names and units begins
  std::vector<Finding> findings;
};

// Looks at the first lines. The delimiter is the first of tab, ';', ',' and blanks that splits the names into two or
// more fields and the following lines into as many. Errors: no names (numbers at once), only one column, a quote
// without its partner, a line of names beyond 1 MB or 10,000 columns, names that are not UTF-8.
Result<CsvDialect> DetectCsvDialect(const std::string& path, std::string_view bytes);

// "voltage [V]" and "voltage (V)" -> name and unit. Round brackets only around something that is a unit; "q[3]" is a
// name.
void SplitHeading(std::string_view heading, std::string* name, std::string* unit);

// Is this line (blanks at its start taken off) a comment: '#', '//' or '%'?
bool IsCsvComment(std::string_view line);

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_CSV_DIALECT_H_
