// Mechanisms drawn off-screen with MuJoCo's renderer: a solid one, and others over it as translucent ghosts.
#ifndef GAPSCOPE_REPLAY_SCENE_H_
#define GAPSCOPE_REPLAY_SCENE_H_

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "replay/poses.h"
#include "src/core/enum_names.h"
#include "src/core/mujoco_handles.h"
#include "src/core/result.h"

namespace gapscope {

// Pixels row by row from the top; each is blue, green, red, unused (0xffRRGGBB in memory order of a little-endian
// machine).
struct Picture {
  int width = 0, height = 0;
  std::vector<std::uint32_t> pixels;
};

// Whence one looks: from the MJCF's camera "fixed", "track" or "top", or where it has none from MuJoCo's free camera's
// side or from above. Only the direction is taken from it: the distance is such that the motion fills the picture.
// kTracking follows the middle of what moves.
enum class View { kFixed, kTracking, kTop };
template <>
std::span<const EnumName<View>> EnumNames<View>();  // "fixed", "tracking", "top"

// A camera for a motion.
struct Framing {
  View view = View::kFixed;
  std::array<double, 3> centre{};  // in the middle of the picture (kTracking: of the first pose)
  double distance_m = 1, azimuth_deg = 90, elevation_deg = -45;
  double ground_m = 1;  // half the side of the ground that is drawn around the mechanism
};

// Frames everything that moves in the poses of `tracks` (qpos of `model`), with a margin, for pictures of `aspect` =
// width / height.
Framing FrameMotion(const mjModel& model, std::span<const PoseTrack* const> tracks, View view, double aspect);

enum class Look { kSolid, kGhost };

struct Mechanism {
  const mjModel* model = nullptr;  // of the same MJCF as the scene's: meshes and textures are found by number
  std::span<const double> qpos;    // model->nq
  Look look = Look::kSolid;
  std::array<float, 3> ghost_rgb{};  // of a ghost
};

// kWhatMoves: what stands still is drawn once, then only the part of the picture where something moves or casts its
// shadow, which takes a third of the time. The same picture but for rounding. (A camera that follows draws all.)
enum class Redraw { kWhatMoves, kAll };

// Not thread-safe, and bound to the GL context (gl_context.h) that is current when it is made, used and destroyed.
class Scene {
 public:
  // `model` must outlive the scene. Its infinite planes are drawn as a table of the framing's size: what lies far off
  // shows nothing and costs most of the time. Errors: the picture is larger than the renderer can draw, OpenGL fails.
  static Result<std::unique_ptr<Scene>> Make(const mjModel& model, const Framing& framing, int width, int height,
                                             Redraw redraw = Redraw::kWhatMoves);
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  // Draws the first mechanism with everything around it, and of the others what moves. A ghost is as clear as it is far
  // from the first: where both stand alike nothing is added, so that a picture of two equal motions is that of one, bit
  // by bit.
  Status Draw(std::span<const Mechanism> mechanisms, Picture& picture);

 private:
  Scene() = default;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gapscope

#endif  // GAPSCOPE_REPLAY_SCENE_H_
