// What a model becomes outside a replay: an MJCF of its own, and a model to draw.
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>

#include "src/core/collect.h"
#include "src/core/statistics.h"
#include "src/experiment/expression.h"
#include "src/model/model.h"
#include "src/model/parameter_writer.h"
#include "src/model/structure.h"

namespace gapscope {
namespace {

// Those of `names` that any of the expressions reads.
std::vector<std::string> Read(const std::vector<std::string>& expressions, const std::vector<std::string>& names) {
  std::vector<std::string> read;
  std::copy_if(names.begin(), names.end(), std::back_inserter(read), [&](const std::string& name) {
    return std::any_of(expressions.begin(), expressions.end(),
                       [&](const std::string& expression) { return Mentions(expression, name); });
  });
  return read;
}

// Writes an inertia into an element, if it is another one than before; whether it is.
bool SetInertia(const BodyInertia& before, const BodyInertia& inertia, mjsBody* body) {
  const auto same = [](const auto& a, const auto& b) {
    constexpr double kRounding = 1e-12;
    return std::ranges::equal(a, b, [](double x, double y) { return std::abs(x - y) <= kRounding * std::abs(y); });
  };
  if (same(std::array{inertia.mass_kg}, std::array{before.mass_kg}) && same(inertia.centre_m, before.centre_m) &&
      same(inertia.moments_kg_m2, before.moments_kg_m2) && same(inertia.axes, before.axes))
    return false;
  body->mass = inertia.mass_kg;
  std::ranges::copy(inertia.centre_m, body->ipos);
  std::ranges::copy(inertia.axes, body->iquat);
  std::ranges::copy(inertia.moments_kg_m2, body->inertia);
  std::ranges::fill(body->fullinertia, std::numeric_limits<double>::quiet_NaN());
  body->ialt.type = mjORIENTATION_QUAT;
  body->explicitinertial = 1;
  return true;
}

// Of a rod or a plate a moment is the sum of the others. It must not be more once they are written with six digits.
void MakeRoomForDigits(mjsBody* body) {
  constexpr double kPrinted = 1e-5;
  double *most = std::ranges::max_element(body->inertia), *least = std::ranges::min_element(body->inertia);
  const double room = std::accumulate(body->inertia, body->inertia + 3, 0.0) - 2 * *most;
  *least += std::max(0.0, kPrinted * *most - room);
}

// Whether a body's frame is its inertia's decides what MuJoCo compiles: inertias that move go into the spec itself.
void BakeInertias(const Model& model, const mjModel& written, Structure* structure, ExportedModel* result) {
  std::erase_if(structure->settings, [&](const FieldSetting& setting) {
    mjsBody* body = BodyOfInertia(*structure->spec, setting.field);
    if (!body) return false;
    const int id = mj_name2id(&written, mjOBJ_BODY, ElementOfField(setting.field).c_str());
    const BodyInertia before = InertiaOf(model.compiled(), id), after = InertiaOf(written, id);
    if (setting.field.ends_with("/ipos")) {  // mass and moments may be settings too, of a log that is not here
      BodyInertia moved = before;
      moved.centre_m = after.centre_m;
      SetInertia(before, moved, body);
    } else if (SetInertia(before, after, body)) {
      MakeRoomForDigits(body);
    }
    result->origins.push_back(
        {setting.field, Read(setting.expressions, Collect(model.parameters(), &Parameter::name))});
    return true;
  });
}

// An MJCF that holds a robot alone has no sky: what is dark would be drawn on black.
void AddSky(mjSpec* spec) {
  for (mjsElement* e = mjs_firstElement(spec, mjOBJ_TEXTURE); e; e = mjs_nextElement(spec, e)) {
    if (mjs_asTexture(e)->type == mjTEXTURE_SKYBOX) return;
  }
  mjsTexture* sky = mjs_addTexture(spec, nullptr);
  sky->type = mjTEXTURE_SKYBOX;
  sky->builtin = mjBUILTIN_GRADIENT;
  sky->width = sky->height = 64;
  for (int i = 0; i < 3; ++i) {
    sky->rgb1[i] = 0.97 + 0.01 * i;
    sky->rgb2[i] = 0.80 + 0.05 * i;
  }
}

// What no term tells of is elements of any MJCF, or the log's own.
std::vector<NativeEffect> WhatBecame(const Model& model, const std::vector<NativeEffect>& told) {
  return Collect(model.effects(), [&](const EffectUse& use) -> NativeEffect {
    const auto of = std::ranges::find_if(told, [&](const NativeEffect& effect) { return effect.use == use; });
    if (of != told.end()) return *of;
    if (const Effect& effect = EffectOf(use, *model.rig()); effect.place == EffectPlace::kSignal)
      return {use, Fidelity::kHost, effect.host};
    return {use, Fidelity::kExact, "elements of the MJCF"};
  });
}

// The gains of drives with a law, of a spec with its numbers in it.
void AddGains(mjSpec* spec, std::map<std::string, DriveLaw>* laws) {
  for (auto& [drive, law] : *laws) {
    const mjsActuator* input = mjs_asActuator(mjs_findElement(spec, mjOBJ_ACTUATOR, drive.c_str()));
    law["gain"] = input->gainprm[0];
    law["bias_n_m"] = input->biasprm[0];
    law["kp"] = 0 - input->biasprm[1];
    law["kd"] = 0 - input->biasprm[2];
    if (input->gear[0] != 1) law["gear"] = input->gear[0];
  }
}

}  // namespace

Result<std::string> SpecToXml(const mjSpec& spec, const std::string& where) {
  std::string xml(1 << 20, '\0');
  char message[512] = "";
  const auto save = [&] {
    return mj_saveXMLString(&spec, xml.data(), static_cast<int>(xml.size()), message, sizeof message);
  };
  int status = save();
  if (status > 0) {  // the size that it takes
    xml.resize(static_cast<std::size_t>(status) + 1);
    status = save();
  }
  if (status != 0) return Error{.what = "cannot write the tuned model: " + OneLine(message), .where = where};
  xml.resize(std::char_traits<char>::length(xml.c_str()));
  return xml;
}

Result<ExportedModel> Model::Export(std::span<const double> values, const std::map<std::string, double>* log_values,
                                    const ScaleTable& scales, double time_step_s) const {
  Structure structure(*rig_);
  structure.form = Structure::Form::kPlugins;
  if (time_step_s > 0) structure.spec->option.timestep = time_step_s;
  return ExportFrom(structure, values, log_values, scales);
}

Result<ExportedModel> Model::ExportNative(std::span<const double> values,
                                          const std::map<std::string, double>* log_values,
                                          const NativeFeatures& features) const {
  Structure structure(*rig_);
  structure.form = Structure::Form::kNative;
  structure.features = features;
  mjOption& option = structure.spec->option;
  if (features.time_step_s > 0) option.timestep = features.time_step_s;
  if (!features.runge_kutta && option.integrator == mjINT_RK4) option.integrator = mjINT_IMPLICITFAST;
  return ExportFrom(structure, values, log_values, {});
}

// Built anew: what the host does itself during a replay must stand in the exported model.
Result<ExportedModel> Model::ExportFrom(Structure& structure, std::span<const double> values,
                                        const std::map<std::string, double>* log_values,
                                        const ScaleTable& scales) const {
  std::map<std::string, double> numbers;
  for (const auto& value : experiment().values) numbers[value.name] = value.fallback.value_or(1);
  for (const auto& [name, value] : log_values ? *log_values : std::map<std::string, double>{}) numbers[name] = value;
  for (std::size_t i = 0; i < parameters_.size(); ++i) numbers[parameters_[i].name] = values[i];
  structure.value_of = [numbers](const std::string& expression) {
    const auto value = EvaluateOnce(expression, numbers, "export");
    return value.ok() ? value.value() : kNaN;
  };
  const std::map<std::string, double> none;
  const ModelPtr written(mj_copyModel(nullptr, compiled_.get()));
  const DataPtr scratch(mj_makeData(written.get()));
  const bool good = ParameterWriter(*this, written.get(), scratch.get()).Write(values, log_values ? *log_values : none);
  structure.inertia_of = [&](const std::string& joint) {
    const int id = mj_name2id(written.get(), mjOBJ_JOINT, joint.c_str());
    return id < 0 ? kNaN : 1 / written->dof_invweight0[written->jnt_dofadr[id]];
  };
  for (const auto& use : effects_) GS_RETURN_IF_ERROR(ApplyEffect(structure, use, scales));
  GS_RETURN_IF_ERROR(structure.Finish());
  ExportedModel result;
  if (!log_values) {
    const std::vector<std::string> of_logs = Collect(experiment().values, &LogValue::name);
    std::erase_if(structure.settings, [&](const FieldSetting& setting) {
      const bool depends = !Read(setting.expressions, of_logs).empty();
      if (depends) result.left_out.push_back(setting.field);
      return depends;
    });
  }
  BakeInertias(*this, *written, &structure, &result);
  Model exported;
  exported.rig_ = rig_;
  GS_RETURN_IF_ERROR(exported.Compile(&structure));
  const DataPtr data(mj_makeData(exported.compiled_.get()));
  ParameterWriter writer(exported, exported.compiled_.get(), data.get());
  if (!writer.Write(values, log_values ? *log_values : none) || (log_values && !good))
    return Error{.what = "the tuned model has a parameter that is not finite", .where = experiment().model_path};
  mj_copyBack(structure.spec.get(), exported.compiled_.get());
  const std::vector<std::string> names = Collect(parameters_, &Parameter::name);
  for (const auto& setting : exported.settings_)
    result.origins.push_back({setting.name, Read(setting.expressions, names)});
  for (const auto& split : structure.splits) {
    for (const std::string& joint : {split.joint, structure.motor_joint.at(split.joint)})
      result.origins.push_back({"joint/" + joint + "/armature", Read({split.share}, names)});
  }
  result.native = WhatBecame(*this, structure.told);
  AddGains(structure.spec.get(), &structure.laws);
  result.laws = structure.laws;
  result.sent = structure.sent;
  for (const auto& [drive, delay_s] : structure.delays_s)
    result.delay_steps[drive] = static_cast<int>(std::lround(delay_s / structure.spec->option.timestep));
  result.spec = std::move(structure.spec);
  result.compiled = std::move(exported.compiled_);
  return result;
}

Result<std::string> Model::ToXml(std::span<const double> values, const std::map<std::string, double>& log_values,
                                 const ScaleTable& scales) const {
  GS_ASSIGN(const ExportedModel exported, Export(values, &log_values, scales));
  return SpecToXml(*exported.spec, experiment().model_path);
}

Result<ModelPtr> Model::CompileForDrawing(std::span<const double> values,
                                          const std::map<std::string, double>& log_values) const {
  const ModelPtr written(mj_copyModel(nullptr, compiled_.get()));
  const DataPtr data(mj_makeData(written.get()));
  ParameterWriter(*this, written.get(), data.get()).Write(values, log_values);
  // Built anew: compiling without what is drawn takes it out of the spec too.
  Structure structure(*rig_);
  for (const auto& use : effects_) GS_RETURN_IF_ERROR(ApplyEffect(structure, use, {}));
  GS_RETURN_IF_ERROR(structure.Finish());
  AddSky(structure.spec.get());
  ModelPtr drawn;
  try {
    drawn.reset(mj_compile(structure.spec.get(), nullptr));
  } catch (const std::exception& e) {
    return Error{.what = "MuJoCo refuses to draw the model: " + OneLine(e.what()), .where = experiment().model_path};
  }
  if (!drawn)
    return Error{.what = "the MJCF does not compile with what it draws: " + OneLine(mjs_getError(structure.spec.get())),
                 .where = experiment().model_path};
  GS_CHECK(drawn->nbody == written->nbody && drawn->njnt == written->njnt && drawn->nq == written->nq);
  std::copy_n(written->body_pos, 3 * written->nbody, drawn->body_pos);
  std::copy_n(written->body_quat, 4 * written->nbody, drawn->body_quat);
  std::copy_n(written->jnt_pos, 3 * written->njnt, drawn->jnt_pos);
  std::copy_n(written->jnt_axis, 3 * written->njnt, drawn->jnt_axis);
  return drawn;
}

}  // namespace gapscope
