#include "src/model/parameter_writer.h"

#include <algorithm>
#include <cmath>

#include "src/core/collect.h"

namespace gapscope {

std::vector<std::string> VariableNames(const std::vector<Parameter>& parameters, const Experiment& experiment) {
  std::vector<std::string> names = Collect(parameters, &Parameter::name);
  for (const auto& v : experiment.values) names.push_back(v.name);
  return names;
}

double DrivenInertia(const mjModel& m, int joint) {
  const int body = m.jnt_bodyid[joint];
  mjtNum inertia[9], rotation[9], rotated[9], transposed[9];
  mju_quat2Mat(rotation, m.body_iquat + 4 * body);
  mju_zero(inertia, 9);
  for (int i = 0; i < 3; ++i) inertia[4 * i] = m.body_inertia[3 * body + i];
  mju_mulMatMat(rotated, rotation, inertia, 3, 3, 3);
  mju_transpose(transposed, rotation, 3, 3);
  mju_mulMatMat(inertia, rotated, transposed, 3, 3, 3);
  const mjtNum* axis = m.jnt_axis + 3 * joint;
  mjtNum product[3], arm[3], cross[3];
  mju_mulMatVec(product, inertia, axis, 3, 3);
  mju_sub3(arm, m.body_ipos + 3 * body, m.jnt_pos + 3 * joint);
  mju_cross(cross, axis, arm);
  return m.dof_armature[m.jnt_dofadr[joint]] + mju_dot3(axis, product) + m.body_mass[body] * mju_dot3(cross, cross);
}

ParameterWriter::ParameterWriter(const Model& model, mjModel* target, mjData* data)
    : model_(model), target_(target), data_(data) {
  const std::vector<std::string> names = VariableNames(model.parameters_, model.experiment());
  for (const auto& value : model.experiment().values) log_names_.push_back(value.name);
  variables_.assign(names.size(), 1.0);
  for (const auto& setting : model.settings_) {
    Bound bound{.expressions = {}, .field = &setting.field};
    for (const auto& text : setting.expressions)
      bound.expressions.push_back(Expression::Parse(text, names, variables_.data(), setting.where).value());
    bound_.push_back(std::move(bound));
  }
  for (const auto& split : model.splits_) {
    splits_.push_back({split.load_joint, split.motor_joint,
                       Expression::Parse(split.share, names, variables_.data(), "split").value()});
  }
}

bool ParameterWriter::Write(std::span<const double> values, const std::map<std::string, double>& log_values) {
  GS_CHECK(values.size() == model_.parameters_.size());
  std::copy(values.begin(), values.end(), variables_.begin());
  for (std::size_t i = 0; i < log_names_.size(); ++i) {
    const auto found = log_values.find(log_names_[i]);
    variables_[values.size() + i] = found == log_values.end() ? 0 : found->second;
  }
  bool good = true, derived = !splits_.empty();
  for (const auto& bound : bound_) {
    PseudoInertia change = {};
    for (std::size_t i = 0; i < bound.expressions.size(); ++i) {
      const double value = bound.expressions[i].Evaluate();
      if (!std::isfinite(value)) {
        good = false;
      } else if (bound.field->inertial) {
        change[i] = value;
      } else {
        WriteComponent(*target_, bound.field->components[i], value);
      }
    }
    if (const auto& inertial = bound.field->inertial)
      WriteInertia(Changed(inertial->compiled, change), inertial->body, target_);
    derived = derived || bound.field->derived;
  }
  for (int body = 1; body < target_->nbody; ++body) {
    good = good && std::isfinite(target_->body_mass[body]) && target_->body_mass[body] >= 0;
    good = good && IsInertia(target_->body_inertia + 3 * body);
  }
  if (!good) return false;
  WriteSplits();
  if (derived) mj_setConst(target_, data_);
  return true;
}

void ParameterWriter::WriteSplits() {
  for (const auto& split : splits_) {
    const int load = target_->jnt_dofadr[split.load_joint], motor = target_->jnt_dofadr[split.motor_joint];
    // The settings wrote the load's own armature anew, or never touch it: start from the compiled value in that case.
    const bool written = std::any_of(bound_.begin(), bound_.end(), [&](const Bound& b) {
      const auto offset =
          reinterpret_cast<const char*>(target_->dof_armature + load) - static_cast<const char*>(target_->buffer);
      const std::vector<FieldSlot>& slots = b.field->components[0];
      return !slots.empty() && slots[0].offset == offset && !slots[0].in_options;
    });
    if (!written) target_->dof_armature[load] = model_.compiled_->dof_armature[load];
    const double moved = split.share.Evaluate() * DrivenInertia(*target_, split.load_joint);
    target_->dof_armature[load] -= moved;
    target_->dof_armature[motor] = moved;
  }
}

}  // namespace gapscope
