// What a model becomes outside a replay: an MJCF of its own, and a model to draw.
#include <algorithm>
#include <iterator>

#include "src/core/collect.h"
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
                                    const ScaleTable& scales) const {
  // Built anew: what the host does itself during a replay must stand in the exported model.
  Structure structure(*rig_);
  structure.for_export = true;
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
  Model exported;
  exported.rig_ = rig_;
  GS_RETURN_IF_ERROR(exported.Compile(&structure));
  const DataPtr data(mj_makeData(exported.compiled_.get()));
  ParameterWriter writer(exported, exported.compiled_.get(), data.get());
  if (!writer.Write(values, log_values ? *log_values : std::map<std::string, double>()))
    return Error{.what = "the tuned model has a parameter that is not finite", .where = experiment().model_path};
  mj_copyBack(structure.spec.get(), exported.compiled_.get());
  const std::vector<std::string> names = Collect(exported.parameters_, &Parameter::name);
  for (const auto& setting : exported.settings_)
    result.origins.push_back({setting.name, Read(setting.expressions, names)});
  for (const auto& split : structure.splits) {
    for (const std::string& joint : {split.joint, structure.motor_joint.at(split.joint)})
      result.origins.push_back({"joint/" + joint + "/armature", Read({split.share}, names)});
  }
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
