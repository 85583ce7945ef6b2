#include "src/model/fields.h"

#include <map>

#include "src/core/collect.h"
#include "src/core/names.h"
#include "src/model/element_names.h"

namespace gapscope {
namespace {

// A field that is an array of the model: the address of element `id` and how many numbers it has.
struct ArrayField {
  mjtNum* (*array)(const mjModel&);
  int stride, count;
  bool derived;
};

#define GS_ARRAY(member) [](const mjModel& m) -> mjtNum* { return m.member; }
const std::map<std::string, ArrayField>& JointFields() {
  static const std::map<std::string, ArrayField> fields = {
      {"stiffness", {GS_ARRAY(jnt_stiffness), 1, 1, false}},
      {"stiffness_cubic", {GS_ARRAY(jnt_stiffnesspoly + 1), mjNPOLY, 1, false}},
  };
  return fields;
}
const std::map<std::string, ArrayField>& DofFields() {
  static const std::map<std::string, ArrayField> fields = {
      {"damping", {GS_ARRAY(dof_damping), 1, 1, false}},
      {"damping_quadratic", {GS_ARRAY(dof_dampingpoly), mjNPOLY, 1, false}},
      {"frictionloss", {GS_ARRAY(dof_frictionloss), 1, 1, false}},
      {"armature", {GS_ARRAY(dof_armature), 1, 1, true}},
  };
  return fields;
}
const std::map<std::string, ArrayField>& BodyFields() {
  static const std::map<std::string, ArrayField> fields = {
      {"mass", {GS_ARRAY(body_mass), 1, 1, true}},
      {"inertia", {GS_ARRAY(body_inertia), 3, 3, true}},
      {"ipos", {GS_ARRAY(body_ipos), 3, 3, true}},
      {"pos", {GS_ARRAY(body_pos), 3, 3, true}},
  };
  return fields;
}
const std::map<std::string, ArrayField>& TendonFields() {
  static const std::map<std::string, ArrayField> fields = {
      {"stiffness", {GS_ARRAY(tendon_stiffness), 1, 1, false}},
      {"damping", {GS_ARRAY(tendon_damping), 1, 1, false}},
      {"springlength", {GS_ARRAY(tendon_lengthspring), 2, 2, false}},
      {"range", {GS_ARRAY(tendon_range), 2, 2, false}},
      {"solref_limit", {GS_ARRAY(tendon_solref_lim), mjNREF, mjNREF, false}},
  };
  return fields;
}
#undef GS_ARRAY

std::ptrdiff_t OffsetOf(const mjModel& model, const mjtNum* number) {
  return reinterpret_cast<const char*>(number) - static_cast<const char*>(model.buffer);
}

Field ArrayAt(const mjModel& model, const ArrayField& array, int id) {
  Field field{.components = {}, .derived = array.derived};
  for (int i = 0; i < array.count; ++i)
    field.components.push_back({{.offset = OffsetOf(model, array.array(model) + id * array.stride + i)}});
  return field;
}

Field Single(const mjModel& model, std::initializer_list<std::pair<const mjtNum*, double>> slots) {
  Field field;
  field.components.emplace_back();
  for (const auto& [number, factor] : slots)
    field.components[0].push_back({.offset = OffsetOf(model, number), .factor = factor});
  return field;
}

// Of the elements that fields belong to.
template <class Map>
std::vector<std::string> Keys(const Map& map) {
  return Collect(map, [](const auto& entry) { return entry.first; });
}

// kp, kv, gain, bias0..2 of an actuator, wherever they stand: in a native actuator's prm, or in the numerics of a
// gapscope.motor instance.
Result<Field> ActuatorField(const mjModel& m, int id, const std::string& field, const std::string& where) {
  const mjtNum* gain = m.actuator_gainprm + id * mjNGAIN;
  const mjtNum* bias = m.actuator_biasprm + id * mjNBIAS;
  // The element's own, plugin or not.
  if (field == "forcerange" || field == "ctrlrange") {
    const mjtNum* range =
        field == "ctrlrange" ? m.actuator_ctrlrange + 2 * m.actuator_ctrladr[id] : m.actuator_forcerange + 2 * id;
    Field result;
    for (int i = 0; i < 2; ++i) result.components.push_back({{.offset = OffsetOf(m, range + i)}});
    return result;
  }
  if (m.actuator_plugin[id] >= 0) {
    const char* name = mj_id2name(&m, mjOBJ_PLUGIN, m.actuator_plugin[id]);
    const auto numeric = [&](const std::string& key) -> const mjtNum* {
      const int n = name ? mj_name2id(&m, mjOBJ_NUMERIC, (std::string(name) + "." + key).c_str()) : -1;
      return n < 0 ? nullptr : m.numeric_data + m.numeric_adr[n];
    };
    // A converted native actuator has the affine law.
    if (const mjtNum *g = numeric("gain"), *b1 = numeric("bias1"), *b2 = numeric("bias2"), *b0 = numeric("bias0");
        g && b0 && b1 && b2) {
      if (field == "kp") return Single(m, {{g, 1}, {b1, -1}});
      if (field == "kv") return Single(m, {{b2, -1}});
      if (field == "gain") return Single(m, {{g, 1}});
      if (field == "bias0") return Single(m, {{b0, 1}});
      if (field == "bias1") return Single(m, {{b1, 1}});
      if (field == "bias2") return Single(m, {{b2, 1}});
    }
    if (const mjtNum* value = numeric(field)) return Single(m, {{value, 1}});
    return Error{.what = "the plugin actuator has no live parameter",
                 .where = where,
                 .actual = "'" + field + "'",
                 .allowed = "a <numeric name=\"INSTANCE." + field + "\"> in the MJCF",
                 .cure = "add it, or write numeric/NAME"};
  }
  if (field == "kp") return Single(m, {{gain, 1}, {bias + 1, -1}});
  if (field == "kv") return Single(m, {{bias + 2, -1}});
  if (field == "gain") return Single(m, {{gain, 1}});
  if (field == "bias0" || field == "bias1" || field == "bias2") return Single(m, {{bias + (field[4] - '0'), 1}});
  if (field == "gear") return Single(m, {{m.actuator_gear + m.actuator_outadr[id] * 6, 1}});
  if (field == "delay") return Single(m, {{m.actuator_delay + id, 1}});
  return NoSuch("unknown field of an actuator", field,
                {"kp", "kv", "gain", "bias0", "bias1", "bias2", "gear", "delay", "forcerange", "ctrlrange"}, where);
}

Result<int> IdOf(const mjModel& m, mjtObj type, const char* kind, const std::string& name, const std::string& where) {
  const int id = mj_name2id(&m, type, name.c_str());
  if (id >= 0) return id;
  return NoSuch(std::string("no such ") + kind + " in the MJCF", name, ElementNames(m, type), where);
}

Field Gravity(const mjModel& m) {
  Field result{.components = {}, .derived = true};
  for (int i = 0; i < 3; ++i) {
    const auto offset = reinterpret_cast<const char*>(m.opt.gravity + i) - reinterpret_cast<const char*>(&m.opt);
    result.components.push_back({{.offset = offset, .in_options = true}});
  }
  return result;
}

// `name`: all that follows the kind, since a numeric has no fields.
Result<Field> NumericField(const mjModel& m, const std::string& name, const std::string& where) {
  GS_ASSIGN(const int id, IdOf(m, mjOBJ_NUMERIC, "numeric", name, where));
  Field result;
  for (int i = 0; i < m.numeric_size[id]; ++i)
    result.components.push_back({{.offset = OffsetOf(m, m.numeric_data + m.numeric_adr[id] + i)}});
  return result;
}

Result<Field> JointField(const mjModel& m, const std::string& name, const std::string& field,
                         const std::string& where) {
  GS_ASSIGN(const int id, IdOf(m, mjOBJ_JOINT, "joint", name, where));
  if (m.jnt_type[id] != mjJNT_HINGE && m.jnt_type[id] != mjJNT_SLIDE) {
    return Error{.what = "the joint '" + name + "' is neither hinge nor slide", .where = where};
  }
  if (field == "springref") return Single(m, {{m.qpos_spring + m.jnt_qposadr[id], 1}});
  if (const auto found = JointFields().find(field); found != JointFields().end()) return ArrayAt(m, found->second, id);
  if (const auto found = DofFields().find(field); found != DofFields().end())
    return ArrayAt(m, found->second, m.jnt_dofadr[id]);
  std::vector<std::string> names = Keys(DofFields());
  names.insert(names.end(), {"springref", "stiffness", "stiffness_cubic"});
  return NoSuch("unknown field of a joint", field, names, where);
}

Result<Field> BodyField(const mjModel& m, const std::string& name, const std::string& field, const std::string& where) {
  GS_ASSIGN(const int id, IdOf(m, mjOBJ_BODY, "body", name, where));
  if (const auto found = BodyFields().find(field); found != BodyFields().end()) return ArrayAt(m, found->second, id);
  if (field == "pseudo_inertia") {
    const BodyInertia inertia = InertiaOf(m, id);
    if (!(inertia.mass_kg > 0)) {
      return Error{.what = "the body '" + name + "' has no inertia that could be changed",
                   .where = where,
                   .actual = "mass 0",
                   .allowed = "a body with mass",
                   .cure = "give it an <inertial> in the MJCF, or name the body that carries the mass"};
    }
    return Field{.components = std::vector<std::vector<FieldSlot>>(kPseudoInertia.size()),
                 .derived = true,
                 .inertial = Field::Inertial{.body = id, .compiled = inertia}};
  }
  std::vector<std::string> names = Keys(BodyFields());
  names.emplace_back("pseudo_inertia");
  return NoSuch("unknown field of a body", field, names, where);
}

Result<Field> TendonField(const mjModel& m, const std::string& name, const std::string& field,
                          const std::string& where) {
  GS_ASSIGN(const int id, IdOf(m, mjOBJ_TENDON, "tendon", name, where));
  if (const auto found = TendonFields().find(field); found != TendonFields().end())
    return ArrayAt(m, found->second, id);
  return NoSuch("unknown field of a tendon", field, Keys(TendonFields()), where);
}

}  // namespace

Status CheckCount(const Field& field, const FieldSetting& setting) {
  const std::size_t count = field.components.size();
  if (setting.expressions.size() == count) return Ok();
  const std::vector<std::string> names(kPseudoInertia.begin(), kPseudoInertia.end());
  return Error{.what = "the field '" + setting.field + "' has " + std::to_string(count) + " numbers",
               .where = setting.where,
               .actual = std::to_string(setting.expressions.size()) + " expressions",
               .allowed = field.inertial ? "[" + Join(names) + "]" : "a list of " + std::to_string(count)};
}

std::string ElementOfField(const std::string& field) {
  const std::size_t first = field.find('/'), last = field.rfind('/');
  return field.substr(first + 1, last > first ? last - first - 1 : std::string::npos);
}

Result<Field> ResolveField(const mjModel& m, const std::string& text, const std::string& where) {
  const std::size_t first = text.find('/'), last = text.rfind('/');
  const std::string kind = text.substr(0, first);
  if (first == std::string::npos || kind.empty() || first + 1 == text.size()) {
    return Error{.what = "not a field",
                 .where = where,
                 .actual = "'" + text + "'",
                 .allowed = "KIND/NAME/FIELD, numeric/NAME or option/gravity"};
  }
  const std::string name = ElementOfField(text);
  const std::string field = last > first ? text.substr(last + 1) : "";
  if (kind == "option" && name == "gravity") return Gravity(m);
  if (kind == "numeric") return NumericField(m, text.substr(first + 1), where);
  if (kind == "joint") return JointField(m, name, field, where);
  if (kind == "body") return BodyField(m, name, field, where);
  if (kind == "tendon") return TendonField(m, name, field, where);
  if (kind == "actuator") {
    GS_ASSIGN(const int id, IdOf(m, mjOBJ_ACTUATOR, "actuator", name, where));
    return ActuatorField(m, id, field, where);
  }
  return NoSuch("unknown kind of field", kind, {"joint", "body", "actuator", "tendon", "numeric", "option"}, where);
}

}  // namespace gapscope
