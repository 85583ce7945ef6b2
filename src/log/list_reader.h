// CSV files whose cells hold lists, one number a joint: "[0.1, -0.2, 0.3]". SAGE records such a pair: state_motor.csv
// and, under stamps of its own, control.csv; joint_list.txt beside them names the joints, one a line.
#ifndef GAPSCOPE_LOG_LIST_READER_H_
#define GAPSCOPE_LOG_LIST_READER_H_

#include <string>
#include <string_view>
#include <vector>

#include "src/core/result.h"
#include "src/log/log.h"

namespace gapscope {

// Whether a cell of the first row is a list.
bool LooksLikeLists(const std::string& path, std::string_view bytes);

// Each list of a column `positions` becomes the columns positions/JOINT, by joint_list.txt in the file's folder, or
// positions[0], positions[1] ... without that file. Columns of words are left out (Finding "text_column"). Errors give
// path:line: a list that changes its length, is not closed or holds what is no number; a wrong number of fields; a
// joint_list.txt of another length.
Result<Log> ReadCsvLists(const std::string& path, std::string_view bytes);

// The state_motor.csv in it if `path` is a folder with one, else `path`.
std::string StateFileOf(const std::string& path);

// joint_list.txt and, of a state_motor.csv, control.csv beside the file, where they are there.
std::vector<std::string> FilesBesideLists(const std::string& path);

// Adds to the log of a state_motor.csv the columns of the control.csv beside it, if there is one, as control/NAME: at
// each row what was commanded last, NaN before the first command.
Status JoinControl(Log* log);

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_LIST_READER_H_
