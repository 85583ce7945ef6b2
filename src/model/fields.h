// Fields of a compiled model by name: "joint/arm/damping". A field is resolved once on the compiled model and written
// in any copy of it.
#ifndef GAPSCOPE_MODEL_FIELDS_H_
#define GAPSCOPE_MODEL_FIELDS_H_

#include <mujoco/mujoco.h>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "src/core/result.h"
#include "src/model/pseudo_inertia.h"

namespace gapscope {

// One number of a model, and the factor that its field's value is multiplied with.
struct FieldSlot {
  std::ptrdiff_t offset = 0;  // bytes from mjModel::buffer, or from mjModel::opt
  bool in_options = false;
  double factor = 1;
};

struct Field {
  std::vector<std::vector<FieldSlot>> components;  // every slot of a component receives the component's value
  bool derived = false;                            // MuJoCo's derived constants depend on it (mj_setConst)
  // Of a body's pseudo-inertia: its numbers have no slots, for they change together what the body was when compiled.
  struct Inertial {
    int body = 0;
    BodyInertia compiled;
  };
  std::optional<Inertial> inertial = {};
};

// Resolves KIND/NAME/FIELD; the fields are listed in docs/reference/experiment.md. `where` is for errors: unknown kind,
// no such element (with the nearest name), unknown field (with the nearest one), a native actuator's gain on a plugin
// actuator without such a stage.
Result<Field> ResolveField(const mjModel& model, const std::string& field, const std::string& where);

// An error when the setting has another number of expressions than the field has numbers.
Status CheckCount(const Field& field, const FieldSetting& setting);

// What a component is, by its first slot; without slots nothing is changed yet.
inline double ReadComponent(const mjModel& model, const std::vector<FieldSlot>& slots) {
  if (slots.empty()) return 0;
  const FieldSlot& slot = slots.front();
  const char* base = slot.in_options ? reinterpret_cast<const char*>(&model.opt) : static_cast<char*>(model.buffer);
  return *reinterpret_cast<const mjtNum*>(base + slot.offset) / slot.factor;
}
// NAME of KIND/NAME/FIELD.
std::string ElementOfField(const std::string& field);

// Writes one component.
inline void WriteComponent(mjModel& model, const std::vector<FieldSlot>& slots, double value) {
  for (const FieldSlot& slot : slots) {
    char* base = slot.in_options ? reinterpret_cast<char*>(&model.opt) : static_cast<char*>(model.buffer);
    *reinterpret_cast<mjtNum*>(base + slot.offset) = slot.factor * value;
  }
}

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_FIELDS_H_
