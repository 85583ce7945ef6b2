// Versions that every result carries.
#ifndef GAPSCOPE_REPORT_VERSION_H_
#define GAPSCOPE_REPORT_VERSION_H_

#include <string>

namespace gapscope {

std::string GapscopeVersion();
std::string MujocoVersion();
// "gapscope 0.1.0 (MuJoCo 4.0.1)"
std::string VersionText();

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_VERSION_H_
