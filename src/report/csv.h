// Columns of numbers as a CSV file: traces for PlotJuggler, points behind an identification.
#ifndef GAPSCOPE_REPORT_CSV_H_
#define GAPSCOPE_REPORT_CSV_H_

#include <span>
#include <string>
#include <vector>

namespace gapscope {

struct CsvColumn {
  std::string head;
  std::span<const double> values;
};

// As many rows as the first column has. `digits`: significant ones; 0: as many as it takes to read the same number
// back. What is not finite, or beyond a column's end, is an empty field.
std::string CsvText(const std::vector<CsvColumn>& columns, int digits = 0);

// A CSV file of a run; `path` from the run's folder on.
struct RunTable {
  std::string path;
  std::vector<CsvColumn> columns;
  int digits = 0;
};

// A file name for each log, its own without the extension; where several have the same, from the second on with its
// position in front.
std::vector<std::string> CsvNames(const std::vector<std::string>& log_paths);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_CSV_H_
