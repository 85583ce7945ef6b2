#include "src/model/model.h"

#include <algorithm>
#include <cmath>

#include "src/core/units.h"
#include "src/model/structure.h"
#include "src/plugins/motor/history.h"

namespace gapscope {
namespace {

std::string OneLine(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

// MuJoCo reports what it cannot refuse otherwise through mju_error, which by default ends the process.
[[noreturn]] void ThrowMujocoError(const char* message) { throw std::runtime_error(message); }
// What MuJoCo warns about (a state that blows up) is an outcome of a replay; by default it would write MUJOCO_LOG.TXT
// into the user's folder.
void DropMujocoWarning(const char*) {}

std::vector<std::string> NamesOf(const std::vector<Parameter>& parameters, const Experiment& experiment) {
  std::vector<std::string> names;
  for (const auto& p : parameters) names.push_back(p.name);
  for (const auto& v : experiment.values) names.push_back(v.name);
  return names;
}

// Where in plugin_state a gapscope.motor keeps its own torque estimate; -1 for any other actuator.
int EstimateAddress(const mjModel& m, int actuator) {
  const int instance = m.actuator_plugin[actuator];
  const mjpPlugin* plugin = instance < 0 ? nullptr : mjp_getPluginAtSlot(m.plugin[instance]);
  if (!plugin || std::string_view(plugin->name) != "gapscope.motor") return -1;
  return m.plugin_stateadr[instance] + plugins::MotorState::kEstimate;
}

std::vector<std::string> ElementNames(const mjModel& m, mjtObj type, int count) {
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) {
    if (const char* name = mj_id2name(&m, type, i)) names.emplace_back(name);
  }
  return names;
}

Error NoElement(const std::string& what, const std::string& name, const std::vector<std::string>& names,
                const std::string& file) {
  std::string all;
  for (const auto& n : names) all += (all.empty() ? "" : ", ") + n;
  const std::string nearest = Nearest(name, names);
  return Error{.what = what,
               .where = file,
               .actual = "'" + name + "'",
               .allowed = all,
               .cure = nearest.empty() ? "" : "did you mean '" + nearest + "'?"};
}

}  // namespace

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

Result<std::shared_ptr<const Model>> Model::Build(const Experiment& experiment, const std::vector<EffectUse>& effects,
                                                  const ScaleTable& scales) {
  mju_user_error = ThrowMujocoError;
  mju_user_warning = DropMujocoWarning;
  std::shared_ptr<Model> model(new Model);
  model->experiment_ = experiment;
  model->effects_ = effects;
  GS_ASSIGN(Structure structure, Structure::Load(model->experiment_));
  for (const auto& use : effects) GS_RETURN_IF_ERROR(ApplyEffect(structure, use, scales));
  GS_RETURN_IF_ERROR(structure.Finish());
  structure.spec->compiler.discardvisual = 1;  // a replay needs no pictures: 7-15 % of a step
  model->parameters_ = structure.parameters;
  try {
    model->compiled_.reset(mj_compile(structure.spec.get(), nullptr));
    if (!model->compiled_) {
      return Error{.what = "the MJCF does not compile: " + OneLine(mjs_getError(structure.spec.get())),
                   .where = experiment.model_path};
    }
    if (!(model->compiled_->opt.timestep > 0)) {
      return Error{.what = "the MJCF's time step is not positive",
                   .where = experiment.model_path,
                   .actual = std::to_string(model->compiled_->opt.timestep),
                   .cure = "write <option timestep=\"0.002\"/>"};
    }
    const DataPtr probe(mj_makeData(model->compiled_.get()));  // runs the plugins' own checks
    if (!probe) return Error{.what = "the model cannot be simulated", .where = experiment.model_path};
  } catch (const std::exception& e) {
    return Error{.what = "MuJoCo refuses the model: " + OneLine(e.what()), .where = experiment.model_path};
  }
  const std::vector<std::string> names = NamesOf(model->parameters_, experiment);
  std::vector<double> ones(names.size(), 1.0);
  for (auto& setting : structure.settings) {
    const std::string where = setting.where == "effect" ? "effect field " + setting.field : setting.where;
    GS_ASSIGN(Field field, ResolveField(*model->compiled_, setting.field, where));
    if (field.components.size() != setting.expressions.size()) {
      return Error{
          .what = "the field '" + setting.field + "' has " + std::to_string(field.components.size()) + " numbers",
          .where = where,
          .actual = std::to_string(setting.expressions.size()) + " expressions"};
    }
    for (const auto& text : setting.expressions) {
      if (const auto parsed = Expression::Parse(text, names, ones.data(), where); !parsed.ok()) return parsed.error();
    }
    model->settings_.push_back({where, std::move(setting.expressions), std::move(field)});
  }
  const mjModel& m = *model->compiled_;
  for (const auto& split : structure.splits) {
    const int load = mj_name2id(&m, mjOBJ_JOINT, split.joint.c_str()),
              motor = mj_name2id(&m, mjOBJ_JOINT, structure.motor_joint.at(split.joint).c_str());
    model->splits_.push_back({load, motor, split.share});
    model->mirrored_.emplace_back(motor, load);
  }
  if (!structure.command_delay.empty()) model->command_delay_ = model->IndexOf(structure.command_delay);
  GS_RETURN_IF_ERROR(model->ResolveNames());
  for (std::size_t i = 0; i < experiment.measured.size(); ++i) {
    if (const auto found = structure.signal_delay.find(experiment.measured[i].signal);
        found != structure.signal_delay.end()) {
      model->sources_[i].delay = model->IndexOf(found->second);
    }
  }
  model->spec_ = std::move(structure.spec);
  return std::shared_ptr<const Model>(std::move(model));
}

Status Model::ResolveNames() {
  const mjModel& m = *compiled_;
  const std::string& file = experiment_.path;
  for (const auto& command : experiment_.commands) {
    const int id = mj_name2id(&m, mjOBJ_ACTUATOR, command.actuator.c_str());
    if (id < 0)
      return NoElement("a command drives an actuator that the MJCF lacks", command.actuator,
                       ElementNames(m, mjOBJ_ACTUATOR, static_cast<int>(m.nactuator)), file);
    command_ctrl_.push_back(m.actuator_ctrladr[id]);
  }
  for (const auto& measured : experiment_.measured) {
    SignalSource source{.kind = measured.kind};
    if (measured.kind == SignalKind::kTorque) {
      source.actuator = mj_name2id(&m, mjOBJ_ACTUATOR, measured.on.c_str());
      if (source.actuator < 0)
        return NoElement("a measured torque is of an actuator that the MJCF lacks", measured.on,
                         ElementNames(m, mjOBJ_ACTUATOR, static_cast<int>(m.nactuator)), file);
      if (m.actuator_trntype[source.actuator] == mjTRN_JOINT) source.joint = m.actuator_trnid[2 * source.actuator];
      source.estimate = EstimateAddress(m, source.actuator);
    } else {
      source.joint = mj_name2id(&m, mjOBJ_JOINT, measured.on.c_str());
      if (source.joint < 0)
        return NoElement("a measured signal is of a joint that the MJCF lacks", measured.on,
                         ElementNames(m, mjOBJ_JOINT, static_cast<int>(m.njnt)), file);
    }
    if (source.joint >= 0) {
      if (m.jnt_type[source.joint] != mjJNT_HINGE && m.jnt_type[source.joint] != mjJNT_SLIDE) {
        return Error{.what = "the joint of signal '" + measured.signal + "' is neither hinge nor slide",
                     .where = file,
                     .allowed = "hinge, slide"};
      }
      source.qpos = m.jnt_qposadr[source.joint];
      source.dof = m.jnt_dofadr[source.joint];
    }
    if (!measured.offset_parameter.empty()) {
      GS_ASSIGN(source.offset, Find(measured.offset_parameter, file + ": offset of signal '" + measured.signal + "'"));
    }
    if (!measured.filter.cutoff.empty()) {
      const std::string where = file + ": filter of signal '" + measured.signal + "'";
      GS_ASSIGN(source.cutoff, Find(measured.filter.cutoff, where));
      GS_ASSIGN(source.damping_ratio, Find(measured.filter.damping_ratio, where));
    }
    sources_.push_back(source);
  }
  return Ok();
}

int Model::IndexOf(const std::string& name) const {
  for (std::size_t i = 0; i < parameters_.size(); ++i) {
    if (parameters_[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

Result<int> Model::Find(const std::string& name, const std::string& where) const {
  if (const int index = IndexOf(name); index >= 0) return index;
  std::vector<std::string> names;
  for (const auto& p : parameters_) {
    if (p.owner != Parameter::Owner::kScale) names.push_back(p.name);
  }
  return NoElement("no such parameter", name, names, where);
}

std::vector<double> Model::Nominal() const {
  std::vector<double> values;
  for (const auto& p : parameters_) values.push_back(p.nominal);
  return values;
}

Result<std::vector<EffectUse>> Model::ParseEffects(const std::vector<std::string>& texts) const {
  GS_ASSIGN(const Structure structure, Structure::Load(experiment_));
  std::vector<EffectUse> uses;
  for (const auto& text : texts) {
    GS_ASSIGN(EffectUse use, ParseEffectUse(text, structure));
    if (std::find(uses.begin(), uses.end(), use) != uses.end())
      return Error{.what = "the effect stands twice", .where = "--with " + text};
    uses.push_back(std::move(use));
  }
  return uses;
}

Result<std::vector<EffectUse>> Model::PossibleEffects() const {
  GS_ASSIGN(const Structure structure, Structure::Load(experiment_));
  return AllUses(structure);
}

Result<const Effect*> Model::EffectAt(const EffectUse& use) const {
  GS_ASSIGN(const Structure structure, Structure::Load(experiment_));
  return &EffectOf(use, structure);
}

Result<std::vector<PlacedParameter>> Model::EffectParameters(const EffectUse& use, const ScaleTable& scales) const {
  GS_ASSIGN(const Structure structure, Structure::Load(experiment_));
  return PlacedParameters(use, structure, scales);
}

Result<std::string> Model::ToXml(std::span<const double> values, const std::map<std::string, double>& log_values,
                                 const ScaleTable& scales) const {
  // Built anew: what the host does itself during a replay must stand in the exported model.
  GS_ASSIGN(Structure structure, Structure::Load(experiment_));
  structure.for_export = true;
  for (const auto& use : effects_) GS_RETURN_IF_ERROR(ApplyEffect(structure, use, scales));
  GS_RETURN_IF_ERROR(structure.Finish());
  std::unique_ptr<Model> exported(new Model);
  exported->experiment_ = experiment_;
  exported->parameters_ = structure.parameters;
  exported->compiled_.reset(mj_compile(structure.spec.get(), nullptr));
  if (!exported->compiled_)
    return Error{.what = "the tuned model does not compile: " + OneLine(mjs_getError(structure.spec.get())),
                 .where = experiment_.model_path};
  for (auto& setting : structure.settings) {
    GS_ASSIGN(Field field, ResolveField(*exported->compiled_, setting.field, setting.where));
    exported->settings_.push_back({setting.where, setting.expressions, std::move(field)});
  }
  const mjModel& m = *exported->compiled_;
  for (const auto& split : structure.splits) {
    exported->splits_.push_back({mj_name2id(&m, mjOBJ_JOINT, split.joint.c_str()),
                                 mj_name2id(&m, mjOBJ_JOINT, structure.motor_joint.at(split.joint).c_str()),
                                 split.share});
  }
  const DataPtr data(mj_makeData(&m));
  ParameterWriter writer(*exported, exported->compiled_.get(), data.get());
  if (!writer.Write(values, log_values))
    return Error{.what = "the tuned model has a parameter that is not finite", .where = experiment_.model_path};
  mj_copyBack(structure.spec.get(), exported->compiled_.get());
  std::string xml(1 << 20, '\0');
  char message[512] = "";
  const auto save = [&] {
    return mj_saveXMLString(structure.spec.get(), xml.data(), static_cast<int>(xml.size()), message, sizeof message);
  };
  int status = save();
  if (status > 0) {  // the size that it takes
    xml.resize(static_cast<std::size_t>(status) + 1);
    status = save();
  }
  if (status != 0) {
    return Error{.what = "cannot write the tuned model: " + OneLine(message), .where = experiment_.model_path};
  }
  xml.resize(std::char_traits<char>::length(xml.c_str()));
  return xml;
}

Result<ModelPtr> Model::CompileForDrawing(std::span<const double> values,
                                          const std::map<std::string, double>& log_values) const {
  const ModelPtr written(mj_copyModel(nullptr, compiled_.get()));
  const DataPtr data(mj_makeData(written.get()));
  ParameterWriter(*this, written.get(), data.get()).Write(values, log_values);
  // Built anew: compiling without what is drawn takes it out of the spec too.
  GS_ASSIGN(Structure structure, Structure::Load(experiment_));
  for (const auto& use : effects_) GS_RETURN_IF_ERROR(ApplyEffect(structure, use, {}));
  GS_RETURN_IF_ERROR(structure.Finish());
  ModelPtr drawn;
  try {
    drawn.reset(mj_compile(structure.spec.get(), nullptr));
  } catch (const std::exception& e) {
    return Error{.what = "MuJoCo refuses to draw the model: " + OneLine(e.what()), .where = experiment_.model_path};
  }
  if (!drawn)
    return Error{.what = "the MJCF does not compile with what it draws: " + OneLine(mjs_getError(structure.spec.get())),
                 .where = experiment_.model_path};
  GS_CHECK(drawn->nbody == written->nbody && drawn->njnt == written->njnt && drawn->nq == written->nq);
  std::copy_n(written->body_pos, 3 * written->nbody, drawn->body_pos);
  std::copy_n(written->body_quat, 4 * written->nbody, drawn->body_quat);
  std::copy_n(written->jnt_pos, 3 * written->njnt, drawn->jnt_pos);
  std::copy_n(written->jnt_axis, 3 * written->njnt, drawn->jnt_axis);
  return drawn;
}

ParameterWriter::ParameterWriter(const Model& model, mjModel* target, mjData* data)
    : model_(model), target_(target), data_(data) {
  const std::vector<std::string> names = NamesOf(model.parameters_, model.experiment_);
  for (const auto& value : model.experiment_.values) log_names_.push_back(value.name);
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
    for (std::size_t i = 0; i < bound.expressions.size(); ++i) {
      const double value = bound.expressions[i].Evaluate();
      if (std::isfinite(value)) {
        WriteComponent(*target_, bound.field->components[i], value);
      } else {
        good = false;
      }
    }
    derived = derived || bound.field->derived;
  }
  for (int body = 1; body < target_->nbody; ++body) {
    good = good && target_->body_mass[body] >= 0;
    for (int i = 0; i < 3; ++i) good = good && target_->body_inertia[3 * body + i] >= 0;
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
      return b.field->components[0][0].offset == offset && !b.field->components[0][0].in_options;
    });
    if (!written) target_->dof_armature[load] = model_.compiled_->dof_armature[load];
    const double moved = split.share.Evaluate() * DrivenInertia(*target_, split.load_joint);
    target_->dof_armature[load] -= moved;
    target_->dof_armature[motor] = moved;
  }
}

}  // namespace gapscope
