// An identification for people and programs.
#ifndef GAPSCOPE_REPORT_IDENTIFY_REPORT_H_
#define GAPSCOPE_REPORT_IDENTIFY_REPORT_H_

#include <string>

#include "src/identify/identification.h"

namespace gapscope {

std::string IdentifyTable(const Identification& result);
// gapscope.identify.METHOD/1
std::string IdentifyJson(const Identification& result, const std::vector<Recording>& recordings);
// One CSV per table in `folder`.
Status WritePoints(const std::string& folder, const Identification& result);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_IDENTIFY_REPORT_H_
