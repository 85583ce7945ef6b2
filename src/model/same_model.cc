#include "src/model/same_model.h"

#include <mujoco/mjxmacro.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>
#include <type_traits>
#include <utility>

#include "src/model/element_names.h"

namespace gapscope {
namespace {

constexpr double kAlike = 1e-4;
constexpr double kOfLargest = 1e-9;  // a number beside the largest of its kind: what arithmetic leaves of zero

// Derived from the others, drawn, an index that names stand for (plugins), what a command is called (ctrlspec), or
// compared elsewhere.
bool IsSkipped(std::string_view name) {
  for (const char* part : {"invweight0", "_M0",     "acc0",     "length0", "lengthrange", "dof_length", "subtreemass",
                           "_user",      "_plugin", "ctrlspec", "gainprm", "biasprm",     "bvh",        "_simple",
                           "sameframe",  "geomadr", "matid",    "width",   "rgba",        "group"}) {
    if (name.find(part) != std::string_view::npos) return true;
  }
  return false;
}

template <class T>
bool Same(const T* a, const T* b, mjtSize count) {
  double largest = 0;
  for (mjtSize i = 0; i < count; ++i) largest = std::max(largest, std::abs(static_cast<double>(a[i])));
  return std::equal(a, a + count, b, [&](T x, T y) {
    const double l = static_cast<double>(x), r = static_cast<double>(y);
    return x == y || (std::is_floating_point_v<T> &&
                      std::abs(l - r) <= std::max(kOfLargest * largest, kAlike * std::max(std::abs(l), std::abs(r))));
  });
}

// Numbers and texts, which plugins read by name, and what is a plugin.
std::string NamedDifference(const mjModel& a, const mjModel& b) {
  if (a.nplugin != b.nplugin) return "the number of plugins";
  for (int i = 0; i < a.nnumeric; ++i) {
    const std::string name = NameOf(a, mjOBJ_NUMERIC, i);
    const int other = mj_name2id(&b, mjOBJ_NUMERIC, name.c_str());
    if (other < 0 || a.numeric_size[i] != b.numeric_size[other] ||
        !Same(a.numeric_data + a.numeric_adr[i], b.numeric_data + b.numeric_adr[other], a.numeric_size[i]))
      return "the numeric " + name;
  }
  for (int i = 0; i < a.ntext; ++i) {
    const std::string name = NameOf(a, mjOBJ_TEXT, i);
    const int other = mj_name2id(&b, mjOBJ_TEXT, name.c_str());
    if (other < 0 || std::strcmp(a.text_data + a.text_adr[i], b.text_data + b.text_adr[other]) != 0)
      return "the text " + name;
  }
  const auto instance = [](const mjModel& m, int id) { return NameOf(m, mjOBJ_PLUGIN, id); };
  for (int i = 0; i < a.nbody; ++i) {
    if (instance(a, a.body_plugin[i]) != instance(b, b.body_plugin[i])) return "the plugin of a body";
  }
  for (int i = 0; i < a.nactuator; ++i) {
    if (instance(a, a.actuator_plugin[i]) != instance(b, b.actuator_plugin[i])) return "the plugin of an actuator";
    // A plugin's law is its own.
    if (a.actuator_plugin[i] < 0 &&
        !(Same(a.actuator_gainprm + mjNGAIN * i, b.actuator_gainprm + mjNGAIN * i, mjNGAIN) &&
          Same(a.actuator_biasprm + mjNBIAS * i, b.actuator_biasprm + mjNBIAS * i, mjNBIAS)))
      return "the law of actuator " + NameOf(a, mjOBJ_ACTUATOR, i);
  }
  return "";
}

std::string NameDifference(const mjModel& a, const mjModel& b) {
  for (const auto& [type, count] : {std::pair{mjOBJ_BODY, a.nbody}, std::pair{mjOBJ_JOINT, a.njnt},
                                    std::pair{mjOBJ_TENDON, a.ntendon}, std::pair{mjOBJ_ACTUATOR, a.nactuator}}) {
    for (int i = 0; i < static_cast<int>(count); ++i) {
      if (NameOf(a, type, i) != NameOf(b, type, i)) return "the order of '" + NameOf(a, type, i) + "'";
    }
  }
  return "";
}

}  // namespace

std::string DifferenceOf(const mjModel& a, const mjModel& b) {
  const std::pair<const char*, bool> sizes[] = {{"nq", a.nq == b.nq},
                                                {"nv", a.nv == b.nv},
                                                {"nu", a.nu == b.nu},
                                                {"nactuator", a.nactuator == b.nactuator},
                                                {"nout", a.nout == b.nout},
                                                {"na", a.na == b.na},
                                                {"nbody", a.nbody == b.nbody},
                                                {"njnt", a.njnt == b.njnt},
                                                {"ntendon", a.ntendon == b.ntendon},
                                                {"nwrap", a.nwrap == b.nwrap},
                                                {"neq", a.neq == b.neq}};
  for (const auto& [name, same] : sizes) {
    if (!same) return std::string("the size ") + name;
  }
  if (std::string difference = NameDifference(a, b); !difference.empty()) return difference;
  if (!Same(a.opt.gravity, b.opt.gravity, 3)) return "gravity";
  if (a.opt.timestep != b.opt.timestep || a.opt.integrator != b.opt.integrator) return "the time step or integrator";
  const mjModel* m = &a;
  MJMODEL_POINTERS_PREAMBLE(m)
#define X(type, name, rows, columns) \
  if (!IsSkipped(#name) && !Same(a.name, b.name, static_cast<mjtSize>(a.rows) * (columns))) return #name;
  MJMODEL_POINTERS_BODY
  MJMODEL_POINTERS_JOINT
  MJMODEL_POINTERS_DOF
  MJMODEL_POINTERS_TENDON
  MJMODEL_POINTERS_ACTUATOR
  MJMODEL_POINTERS_EQUALITY
  X(mjtNum, qpos0, nq, 1)
  X(mjtNum, qpos_spring, nq, 1)
  X(mjtNum, wrap_prm, nwrap, 1)
  X(int, wrap_objid, nwrap, 1)
#undef X
  return NamedDifference(a, b);
}

}  // namespace gapscope
