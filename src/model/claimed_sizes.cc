#include "src/model/claimed_sizes.h"

#include <cstdint>

namespace gapscope {
namespace {

constexpr std::int64_t kMostOfAnElement = 10'000, kMost = 100'000'000;

}  // namespace

Status CheckClaimedSizes(const mjSpec& spec, const std::string& where) {
  const auto check = [&](const char* what, std::int64_t size, std::int64_t most) -> Status {
    if (size <= most) return Ok();
    return Error{.what = std::string("the MJCF claims too much memory: ") + what,
                 .where = where,
                 .actual = std::to_string(size),
                 .allowed = "at most " + std::to_string(most)};
  };
  const struct {
    const char* what;
    int size;
  } sizes[] = {{"nuser_body", spec.nuser_body},         {"nuser_jnt", spec.nuser_jnt},
               {"nuser_geom", spec.nuser_geom},         {"nuser_site", spec.nuser_site},
               {"nuser_cam", spec.nuser_cam},           {"nuser_tendon", spec.nuser_tendon},
               {"nuser_actuator", spec.nuser_actuator}, {"nuser_sensor", spec.nuser_sensor}};
  for (const auto& [what, size] : sizes) GS_RETURN_IF_ERROR(check(what, size, kMostOfAnElement));
  GS_RETURN_IF_ERROR(check("nuserdata", spec.nuserdata, kMost));
  auto* all = const_cast<mjSpec*>(&spec);  // MuJoCo's look-ups take no const
  for (mjsElement* e = mjs_firstElement(all, mjOBJ_SENSOR); e; e = mjs_nextElement(all, e))
    GS_RETURN_IF_ERROR(check("the 'dim' of a sensor", mjs_asSensor(e)->dim, kMostOfAnElement));
  for (mjsElement* e = mjs_firstElement(all, mjOBJ_HFIELD); e; e = mjs_nextElement(all, e)) {
    const mjsHField* field = mjs_asHField(e);
    GS_RETURN_IF_ERROR(check("the points of a height field", std::int64_t{field->nrow} * field->ncol, kMost));
  }
  return Ok();
}

}  // namespace gapscope
