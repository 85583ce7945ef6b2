#include "src/model/effects/catalogue.h"

namespace gapscope {

// Turned by x about the base's x axis, then by y about its y axis; gravity is seen from the base.
Effect Effect_mount_tilt() {
  const EffectParameter about_x = {
      .key = "x_rad", .unit = "rad", .neutral = 0, .low = -0.5, .high = 0.5, .trials = {0, 0.05, -0.05}, .start = 0.02};
  EffectParameter about_y = about_x;
  about_y.key = "y_rad";
  return {
      .name = "mount_tilt",
      .place = EffectPlace::kModel,
      .parameters = {about_x, about_y},
      .meaning = "the whole rig stands tilted",
      .signature = "gravity's torque on all joints as of another vertical",
      .told_apart = "a spirit level; a slow sweep of two joints",
      .partners = {"gravity_offset", "torque_bias"},
      .apply = [](Structure& structure, const std::string&, const std::vector<std::string>& names) -> Status {
        const double* g = structure.rig().compiled().opt.gravity;
        const auto text = [](double value) { return "(" + ExactText(value) + ")"; };
        const std::string gx = text(g[0]), gy = text(g[1]), gz = text(g[2]);
        const std::string cx = "cos(" + names[0] + ")", sx = "sin(" + names[0] + ")";
        const std::string cy = "cos(" + names[1] + ")", sy = "sin(" + names[1] + ")";
        const std::string upright = "(" + gz + "*" + cx + "-" + gy + "*" + sx + ")";
        return structure.Replace("option/gravity",
                                 {gx + "*" + cy + "-" + upright + "*" + sy, gy + "*" + cx + "+" + gz + "*" + sx,
                                  upright + "*" + cy + "+" + gx + "*" + sy});
      },
  };
}

}  // namespace gapscope
