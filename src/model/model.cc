#include "src/model/model.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "src/core/collect.h"
#include "src/core/names.h"
#include "src/model/element_names.h"
#include "src/model/parameter_writer.h"
#include "src/model/sensor_facts.h"
#include "src/model/structure.h"
#include "src/plugins/motor/history.h"
#include "src/plugins/motor/motor_config.h"

namespace gapscope {
namespace {

// Where in plugin_state a gapscope.motor keeps its own torque estimate; -1 for any other actuator.
int EstimateAddress(const mjModel& m, int actuator) {
  const int instance = m.actuator_plugin[actuator];
  const mjpPlugin* plugin = instance < 0 ? nullptr : mjp_getPluginAtSlot(m.plugin[instance]);
  if (!plugin || std::string_view(plugin->name) != plugins::kMotorName) return -1;
  return m.plugin_stateadr[instance] + plugins::MotorState::kEstimate;
}

template <class Value>
bool AnyAboveZero(const Value* values, mjtSize count) {
  return std::any_of(values, values + count, [](Value value) { return value > 0; });
}

bool MayTouch(const mjModel& m) {
  return !(m.opt.disableflags & mjDSBL_CONTACT) &&
         (m.npair > 0 || m.nflex > 0 || AnyAboveZero(m.geom_contype, m.ngeom) ||
          AnyAboveZero(m.geom_conaffinity, m.ngeom));
}

// Whether anything in the model could ever push, stop or rub by MuJoCo's constraint solver.
bool MayConstrain(const mjModel& m) {
  return m.neq > 0 || MayTouch(m) || AnyAboveZero(m.jnt_limited, m.njnt) || AnyAboveZero(m.dof_frictionloss, m.nv) ||
         AnyAboveZero(m.tendon_limited, m.ntendon) || AnyAboveZero(m.tendon_frictionloss, m.ntendon);
}

// A replay takes shorter steps than the MJCF says where stamps lie closer: an actuator that is late must remember as
// far back all the same.
void GiveRoomToDelays(mjSpec* spec) {
  constexpr double kShorter = 16;
  for (mjsElement* e = mjs_firstElement(spec, mjOBJ_ACTUATOR); e; e = mjs_nextElement(spec, e)) {
    mjsActuator* actuator = mjs_asActuator(e);
    if (!(actuator->delay > 0) || !(spec->option.timestep > 0)) continue;
    const double samples = std::ceil(kShorter * actuator->delay / spec->option.timestep) + 1;
    actuator->nsample = std::max(actuator->nsample, static_cast<int>(std::min(samples, 1e5)));
  }
}

// A replay draws nothing: visual geometry takes 7 to 15 % of a step, lights and cameras 2 to 6 %. Cameras that a sensor
// is on stay.
void LeaveOutPictures(mjSpec* spec) {
  spec->compiler.discardvisual = 1;
  while (mjsElement* light = mjs_firstElement(spec, mjOBJ_LIGHT)) mjs_delete(spec, light);
  std::set<std::string> seen;
  for (mjsElement* e = mjs_firstElement(spec, mjOBJ_SENSOR); e; e = mjs_nextElement(spec, e)) {
    const mjsSensor* sensor = mjs_asSensor(e);
    if (sensor->objtype == mjOBJ_CAMERA) seen.insert(mjs_getString(sensor->objname));
    if (sensor->reftype == mjOBJ_CAMERA) seen.insert(mjs_getString(sensor->refname));
  }
  std::vector<mjsElement*> drawn;
  for (mjsElement* e = mjs_firstElement(spec, mjOBJ_CAMERA); e; e = mjs_nextElement(spec, e)) {
    if (!seen.contains(mjs_getString(mjs_getName(e)))) drawn.push_back(e);
  }
  for (mjsElement* camera : drawn) mjs_delete(spec, camera);
}

}  // namespace

Result<std::shared_ptr<const Model>> Model::Load(const Experiment& experiment) {
  GS_ASSIGN(std::shared_ptr<const Rig> rig, Rig::Load(experiment));
  return Build(std::move(rig));
}

Result<std::shared_ptr<const Model>> Model::Build(std::shared_ptr<const Rig> rig, const std::vector<EffectUse>& effects,
                                                  const ScaleTable& scales, Contacts contacts,
                                                  const std::map<std::string, DriveLaw>& drives) {
  std::shared_ptr<Model> model(new Model);
  model->rig_ = std::move(rig);
  model->effects_ = effects;
  Structure structure(*model->rig_);
  GS_RETURN_IF_ERROR(CheckTogether(effects, *model->rig_));
  for (const auto& use : effects) GS_RETURN_IF_ERROR(ApplyEffect(structure, use, scales));
  for (const auto& [drive, numbers] : drives) {
    for (const auto& [key, number] : numbers) GS_RETURN_IF_ERROR(structure.AddMotorTerm(drive, key, ExactText(number)));
  }
  GS_RETURN_IF_ERROR(structure.Finish());
  GiveRoomToDelays(structure.spec.get());
  LeaveOutPictures(structure.spec.get());
  if (contacts == Contacts::kNone) structure.spec->option.disableflags |= mjDSBL_CONTACT;
  GS_RETURN_IF_ERROR(model->Compile(&structure));
  model->FindMirrored();
  GS_RETURN_IF_ERROR(model->CheckInertias());
  GS_RETURN_IF_ERROR(model->ResolveNames());
  model->FindDelays(structure);
  model->FindMemories();
  return std::shared_ptr<const Model>(std::move(model));
}

bool Model::MayCollide() const { return MayTouch(*compiled_); }

Status Model::Compile(Structure* structure) {
  const std::string& path = experiment().model_path;
  parameters_ = structure->parameters;
  // MuJoCo's short cuts for a body whose frame is its inertia's hold for as long as it is.
  for (const FieldSetting& setting : structure->settings) {
    if (mjsBody* body = BodyOfInertia(*structure->spec, setting.field)) body->simple = 0;
  }
  try {
    compiled_.reset(mj_compile(structure->spec.get(), nullptr));
    if (!compiled_) {
      return Error{.what = "the MJCF does not compile: " + OneLine(mjs_getError(structure->spec.get())), .where = path};
    }
    if (!(compiled_->opt.timestep > 0)) {
      return Error{.what = "the MJCF's time step is not positive",
                   .where = path,
                   .actual = std::to_string(compiled_->opt.timestep),
                   .cure = "write <option timestep=\"0.002\"/>"};
    }
    const DataPtr probe(mj_makeData(compiled_.get()));  // runs the plugins' own checks
    if (!probe) return Error{.what = "the model cannot be simulated", .where = path};
  } catch (const std::exception& e) {
    return Error{.what = "MuJoCo refuses the model: " + OneLine(e.what()), .where = path};
  }
  GS_RETURN_IF_ERROR(ResolveSettings(std::move(structure->settings)));
  const bool written = std::any_of(settings_.begin(), settings_.end(),
                                   [](const auto& setting) { return setting.name.ends_with("/frictionloss"); });
  // A solver without a row costs 10 to 15 % of a step.
  if (!written && !MayConstrain(*compiled_)) compiled_->opt.disableflags |= mjDSBL_CONSTRAINT;
  for (const auto& split : structure->splits) {
    const auto joint = [&](const std::string& name) { return mj_name2id(compiled_.get(), mjOBJ_JOINT, name.c_str()); };
    splits_.push_back({joint(split.joint), joint(structure->motor_joint.at(split.joint)), split.share});
  }
  return Ok();
}

Status Model::ResolveSettings(std::vector<FieldSetting> settings) {
  const std::vector<std::string> names = VariableNames(parameters_, experiment());
  std::vector<double> ones(names.size(), 1.0);
  for (FieldSetting& setting : settings) {
    GS_ASSIGN(Field field, ResolveField(*compiled_, setting.field, setting.where));
    GS_RETURN_IF_ERROR(CheckCount(field, setting));
    for (const auto& text : setting.expressions) {
      if (const auto parsed = Expression::Parse(text, names, ones.data(), setting.where); !parsed.ok())
        return parsed.error();
    }
    settings_.push_back({setting.field, setting.where, std::move(setting.expressions), std::move(field)});
  }
  for (const Setting& whole : settings_) {
    if (!whole.field.inertial) continue;
    const std::string body = "body/" + ElementOfField(whole.name) + "/";
    for (const Setting& other : settings_) {
      const bool part = other.name == body + "mass" || other.name == body + "inertia" || other.name == body + "ipos";
      if (!part && (&other == &whole || other.name != whole.name)) continue;
      return Error{.what = "the inertia of the body '" + ElementOfField(whole.name) + "' is set twice",
                   .where = whole.where,
                   .actual = "'" + other.name + "' too (" + other.where + ")",
                   .allowed = "its ten numbers, or mass, inertia and ipos",
                   .cure = "drop one: alpha scales mass and inertia, t1 t2 t3 move the centre of mass"};
    }
  }
  return Ok();
}

Status Model::CheckInertias() const {
  std::map<std::string, double> nominal;
  for (const Parameter& p : parameters_) nominal[p.name] = p.nominal;
  for (const Setting& setting : settings_) {
    const bool of_mass = setting.name.ends_with("/mass"), of_inertia = setting.name.ends_with("/inertia");
    if (!setting.name.starts_with("body/") || (!of_mass && !of_inertia)) continue;
    std::vector<double> values;
    for (const std::string& text : setting.expressions) {
      const auto value = EvaluateOnce(text, nominal, setting.where);
      if (value.ok()) values.push_back(value.value());  // else a log's numbers decide
    }
    if (values.size() != setting.expressions.size()) continue;
    const std::string body = ElementOfField(setting.name);
    const int id = mj_name2id(compiled_.get(), mjOBJ_BODY, body.c_str());
    const bool has_inertia = mju_norm3(compiled_->body_inertia + 3 * id) > 0;
    const bool physical = of_inertia ? IsInertia(values.data()) : values[0] > 0 || (values[0] == 0 && !has_inertia);
    if (physical) continue;
    return Error{.what = std::string("the ") + (of_mass ? "mass" : "inertia") + " of the body '" + body +
                         "' is not physical at the parameters' nominal values",
                 .where = setting.where,
                 .actual = Join(Collect(values, [](double value) { return fmt::format("{:.6g}", value); })),
                 .allowed = of_mass ? "above 0, kg" : "three moments above 0, none larger than the other two together",
                 .cure = "correct the expression or a nominal value; body/" + body +
                         "/pseudo_inertia is physical whatever its numbers"};
  }
  return Ok();
}

Status Model::ResolveNames() {
  const mjModel& m = *compiled_;
  for (const auto& command : experiment().commands) {
    const int id = mj_name2id(&m, mjOBJ_ACTUATOR, command.actuator.c_str());
    GS_CHECK(id >= 0 && "an actuator of the rig");  // AddToSpec
    command_ctrl_.push_back(m.actuator_ctrladr[id]);
  }
  for (const auto& measured : experiment().measured) {
    SignalSource source{.kind = measured.kind};
    if (TraitsOf(measured.kind).site == SignalSite::kSensor) {
      GS_ASSIGN(source.sensor, AddressOfSensor(m, measured));
    } else if (TraitsOf(measured.kind).site == SignalSite::kActuator) {
      source.actuator = mj_name2id(&m, mjOBJ_ACTUATOR, measured.on.c_str());
      if (source.actuator < 0)
        return NoSuch("a measured torque is of an actuator that the MJCF lacks", measured.on,
                      ElementNames(m, mjOBJ_ACTUATOR), measured.where);
      if (m.actuator_trntype[source.actuator] == mjTRN_JOINT) source.joint = m.actuator_trnid[2 * source.actuator];
      source.estimate = EstimateAddress(m, source.actuator);
    } else {
      source.joint = mj_name2id(&m, mjOBJ_JOINT, measured.on.c_str());
      if (source.joint < 0)
        return NoSuch("a measured signal is of a joint that the MJCF lacks", measured.on, ElementNames(m, mjOBJ_JOINT),
                      measured.where);
    }
    if (source.joint >= 0) {
      if (m.jnt_type[source.joint] != mjJNT_HINGE && m.jnt_type[source.joint] != mjJNT_SLIDE) {
        return Error{.what = "the joint of signal '" + measured.signal + "' is neither hinge nor slide",
                     .where = measured.where,
                     .allowed = "hinge, slide"};
      }
      source.qpos = m.jnt_qposadr[source.joint];
      source.dof = m.jnt_dofadr[source.joint];
    }
    if (!measured.offset_parameter.empty()) {
      GS_ASSIGN(source.offset,
                Find(measured.offset_parameter, measured.where + ": offset of signal '" + measured.signal + "'"));
    }
    if (!measured.filter.cutoff.empty()) {
      const std::string where = measured.where + ": filter of signal '" + measured.signal + "'";
      GS_ASSIGN(source.cutoff, Find(measured.filter.cutoff, where));
      GS_ASSIGN(source.damping_ratio, Find(measured.filter.damping_ratio, where));
    }
    sources_.push_back(source);
  }
  GS_ASSIGN(const std::vector<FreeStart> starts, FindFreeStarts(m, experiment()));
  for (const FreeStart& start : starts) (start.qpos >= 0 ? free_starts_ : held_starts_).push_back(start);
  return Ok();
}

void Model::FindMirrored() {
  for (const auto& split : splits_) mirrored_.emplace_back(split.motor_joint, split.load_joint);
  // A file that `apply` or `export` wrote has the two sides already.
  for (int load = 0; load < compiled_->njnt; ++load) {
    const char* text = mj_id2name(compiled_.get(), mjOBJ_JOINT, load);
    if (!text) continue;
    const std::string name = text;
    const int motor = mj_name2id(compiled_.get(), mjOBJ_JOINT, (name + Structure::kMotorSide).c_str());
    const bool linked = mj_name2id(compiled_.get(), mjOBJ_TENDON, (name + Structure::kLink).c_str()) >= 0;
    const bool known = std::ranges::any_of(mirrored_, [&](const auto& pair) { return pair.second == load; });
    if (motor >= 0 && linked && !known) mirrored_.emplace_back(motor, load);
  }
}

void Model::FindDelays(const Structure& structure) {
  for (const auto& command : experiment().commands) {
    const auto found = structure.command_delay.find(rig_->ActuatorOf(rig_->JointOf(command.actuator)));
    command_delays_.push_back(found == structure.command_delay.end() ? -1 : IndexOf(found->second));
  }
  const auto& measured = experiment().measured;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    if (const auto found = structure.signal_delay.find(measured[i].signal); found != structure.signal_delay.end())
      sources_[i].delay = IndexOf(found->second);
  }
}

bool Model::DelaysEveryCommand() const {
  return !command_delays_.empty() &&
         std::none_of(command_delays_.begin(), command_delays_.end(), [](int parameter) { return parameter < 0; });
}

// A time that a remembering number of a drive is made of.
void Model::FindMemories() {
  for (const auto& setting : settings_) {
    const bool numeric = setting.name.starts_with("numeric/");
    const auto* spec =
        numeric ? plugins::FindSpec(plugins::kMotorSpecs, setting.name.substr(setting.name.rfind('.') + 1)) : nullptr;
    if (!spec || !spec->remembers) continue;
    for (int i = 0; i < static_cast<int>(parameters_.size()); ++i) {
      const bool known = std::find(memories_.begin(), memories_.end(), i) != memories_.end();
      if (!known && parameters_[i].unit == "s" && Mentions(setting.expressions.front(), parameters_[i].name))
        memories_.push_back(i);
    }
  }
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
  return NoSuch("no such parameter", name, names, where);
}

std::vector<double> Model::Nominal() const { return Collect(parameters_, &Parameter::nominal); }

std::vector<int> Model::FreeParameters() const {
  std::vector<int> free;
  for (std::size_t i = 0; i < parameters_.size(); ++i) {
    if (!parameters_[i].frozen && parameters_[i].low < parameters_[i].high) free.push_back(static_cast<int>(i));
  }
  return free;
}

}  // namespace gapscope
