// Ownership of MuJoCo's C objects.
#ifndef GAPSCOPE_CORE_MUJOCO_HANDLES_H_
#define GAPSCOPE_CORE_MUJOCO_HANDLES_H_

#include <mujoco/mujoco.h>

#include <memory>

namespace gapscope {

struct MujocoDeleter {
  void operator()(mjModel* m) const { mj_deleteModel(m); }
  void operator()(mjData* d) const { mj_deleteData(d); }
  void operator()(mjSpec* s) const { mj_deleteSpec(s); }
};
using ModelPtr = std::unique_ptr<mjModel, MujocoDeleter>;
using DataPtr = std::unique_ptr<mjData, MujocoDeleter>;
using SpecPtr = std::unique_ptr<mjSpec, MujocoDeleter>;

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_MUJOCO_HANDLES_H_
