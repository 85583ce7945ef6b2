// Meshes with fewer triangles, for pictures: a robot's CAD meshes have more of them than its picture has pixels, and a
// renderer without a graphics card takes its time for each.
#ifndef GAPSCOPE_REPLAY_THIN_MESHES_H_
#define GAPSCOPE_REPLAY_THIN_MESHES_H_

#include <mujoco/mujoco.h>

#include <cstddef>

namespace gapscope {

// Geoms of these groups are drawn, as MuJoCo's viewer does; the others are for collisions.
inline constexpr int kDrawnGroups = 3;

// Triangles of the meshes of all geoms that are drawn.
std::size_t DrawnTriangles(const mjModel& model);

// Joins all vertices of a mesh that lie in one cube of `cell_m` at their mean; triangles that lose an area go. Corners
// keep the normals they had, so that light falls as before. For drawing only: inertia, hulls and collisions of `model`
// stay those of the mesh as it was.
void ThinMeshes(mjModel* model, double cell_m);

}  // namespace gapscope

#endif  // GAPSCOPE_REPLAY_THIN_MESHES_H_
