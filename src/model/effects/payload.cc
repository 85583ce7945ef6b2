#include "src/model/effects/catalogue.h"

namespace gapscope {

// A point mass. The trials are corners of a cube: what any other point of it does is between theirs.
Effect Effect_payload() {
  const auto centre = [](const char* key, int axis) -> EffectParameter {
    return {.key = key,
            .unit = "m",
            .role = ParameterRole::kPlace,
            .scale = ScaleKind::kLength,
            .neutral = 0,
            .low = -2,
            .high = 2,
            .trials = {-0.7, 0.7},
            .start = 0,
            .from_centre = axis};
  };
  return {
      .name = "payload",
      .place = EffectPlace::kBody,
      .parameters = {{.key = "mass_kg",
                      .unit = "kg",
                      .scale = ScaleKind::kMass,
                      .neutral = 0,
                      .low = 0,
                      .high = 5,
                      .trials = {0.2},
                      .start = 0.2},
                     centre("x_m", 0),
                     centre("y_m", 1),
                     centre("z_m", 2)},
      .meaning = "a mass on a body",
      .signature = "weight and inertia of a point of the body, on all joints that carry it",
      .told_apart = "slow poses, then quick moves, of two joints",
      .partners = {"gravity_offset", "mount_tilt"},
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        return structure.AddPointMass(on, names[0], {names[1], names[2], names[3]});
      },
  };
}

}  // namespace gapscope
