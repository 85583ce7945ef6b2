// Logs as the contract's CSV files, labels as JSON.
#ifndef GAPSCOPE_TESTS_TWIN_OUTPUT_H_
#define GAPSCOPE_TESTS_TWIN_OUTPUT_H_

#include <string>
#include <vector>

#include "tests/twin/case.h"
#include "tests/twin/recorder.h"

namespace gapscope::twin {

std::string CsvText(const Record& record);
std::string LabelText(const Case& c, const std::vector<std::string>& files);
// Writes through a temporary name, making folders. False with a text on failure.
bool WriteText(const std::string& path, const std::string& text, std::string* problem);

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_OUTPUT_H_
