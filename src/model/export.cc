// What a model becomes outside a replay: an MJCF of its own, and a model to draw.
#include <algorithm>

#include "src/model/model.h"
#include "src/model/parameter_writer.h"
#include "src/model/structure.h"

namespace gapscope {
Result<std::string> Model::ToXml(std::span<const double> values, const std::map<std::string, double>& log_values,
                                 const ScaleTable& scales) const {
  // Built anew: what the host does itself during a replay must stand in the exported model.
  Structure structure(*rig_);
  structure.for_export = true;
  for (const auto& use : effects_) GS_RETURN_IF_ERROR(ApplyEffect(structure, use, scales));
  GS_RETURN_IF_ERROR(structure.Finish());
  Model exported;
  exported.rig_ = rig_;
  GS_RETURN_IF_ERROR(exported.Compile(&structure));
  const DataPtr data(mj_makeData(exported.compiled_.get()));
  ParameterWriter writer(exported, exported.compiled_.get(), data.get());
  if (!writer.Write(values, log_values))
    return Error{.what = "the tuned model has a parameter that is not finite", .where = experiment().model_path};
  mj_copyBack(structure.spec.get(), exported.compiled_.get());
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
    return Error{.what = "cannot write the tuned model: " + OneLine(message), .where = experiment().model_path};
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
  Structure structure(*rig_);
  for (const auto& use : effects_) GS_RETURN_IF_ERROR(ApplyEffect(structure, use, {}));
  GS_RETURN_IF_ERROR(structure.Finish());
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
