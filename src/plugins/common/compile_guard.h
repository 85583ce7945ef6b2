// Tells the `init` of a model's compilation from that of a later mj_makeData.
//
// The engine compiles with a trial mjData: `nstate` of every instance, then `init` of every instance, errors caught and
// returned by mj_loadXML or mj_compile. A failing `init` in mj_makeData is an mju_error instead, which ends a C++ host.
// So a bad instance is refused while compiling and, after that (numbers edited in a compiled model), warned about and
// left without effect.
#ifndef GAPSCOPE_PLUGINS_COMMON_COMPILE_GUARD_H_
#define GAPSCOPE_PLUGINS_COMMON_COMPILE_GUARD_H_

#include <mujoco/mujoco.h>

#include <string>

namespace gapscope::plugins {

// One per plugin and thread.
class CompileGuard {
 public:
  // Call from `nstate`.
  void NoteState(const mjModel* m) {
    pending_ = m == model_ ? pending_ + 1 : 1;
    model_ = m;
  }

  // Call once from `init` with its problem, empty when all is well. Returns what `init` shall return when there is one.
  int Judge(const mjModel* m, const std::string& problem) {
    const bool compiling = m == model_ && pending_ > 0;
    if (compiling) --pending_;
    if (problem.empty()) return 0;
    if (compiling) pending_ = 0;
    mju_warning("%s%s", problem.c_str(), compiling ? "" : "; the instance is left without effect");
    return compiling ? -1 : 0;
  }

 private:
  const mjModel* model_ = nullptr;
  int pending_ = 0;
};

}  // namespace gapscope::plugins

#endif  // GAPSCOPE_PLUGINS_COMMON_COMPILE_GUARD_H_
