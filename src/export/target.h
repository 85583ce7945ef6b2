// Where a result can be taken to: engines that read MJCF, each with what it acts on.
#ifndef GAPSCOPE_EXPORT_TARGET_H_
#define GAPSCOPE_EXPORT_TARGET_H_

#include <span>
#include <string>

#include "src/core/options.h"
#include "src/model/native.h"

namespace gapscope {

enum class TargetName { kMujoco, kMujocoNative, kMujocoWarp, kMjx };

struct ExportTarget {
  TargetName name;
  std::string what;    // for people
  bool plugins;        // it runs our plugin library
  NativeFeatures has;  // where it does not
};

const ExportTarget& TargetOf(TargetName name);

template <>
std::span<const EnumName<TargetName>> EnumNames<TargetName>();

}  // namespace gapscope

#endif  // GAPSCOPE_EXPORT_TARGET_H_
