#include "replay/thin_meshes.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <set>
#include <unordered_map>
#include <unordered_set>
#include <vector>

namespace gapscope {
namespace {

bool IsDrawnMesh(const mjModel& m, int geom) {
  return m.geom_type[geom] == mjGEOM_MESH && m.geom_dataid[geom] >= 0 && m.geom_group[geom] < kDrawnGroups;
}

// Three numbers of up to 21 bits as one.
std::uint64_t Packed(const std::array<int, 3>& parts) {
  std::uint64_t key = 0;
  for (const int part : parts) key = key << 21 | (static_cast<std::uint64_t>(part) & 0x1fffff);
  return key;
}

// The vertex that stands for each one of the mesh: the first one of its cube, which moves to their mean.
std::vector<int> JoinVertices(float* vertices, int count, double cell_m) {
  std::unordered_map<std::uint64_t, int> first;
  std::vector<int> stands_for(static_cast<std::size_t>(count));
  std::vector<std::array<double, 4>> sums(static_cast<std::size_t>(count));  // x, y, z, how many
  for (int v = 0; v < count; ++v) {
    std::array<int, 3> cube{};
    for (std::size_t i = 0; i < 3; ++i)
      cube[i] = static_cast<int>(std::floor(vertices[3 * v + static_cast<int>(i)] / cell_m));
    const int head = stands_for[static_cast<std::size_t>(v)] = first.emplace(Packed(cube), v).first->second;
    auto& sum = sums[static_cast<std::size_t>(head)];
    for (std::size_t i = 0; i < 3; ++i) sum[i] += vertices[3 * v + static_cast<int>(i)];
    ++sum[3];
  }
  for (const auto& [cube, head] : first) {
    const auto& sum = sums[static_cast<std::size_t>(head)];
    for (int i = 0; i < 3; ++i)
      vertices[3 * head + i] = static_cast<float>(sum[static_cast<std::size_t>(i)] / sum[3]);
  }
  return stands_for;
}

void ThinMesh(mjModel* m, int mesh, double cell_m) {
  const std::vector<int> head = JoinVertices(m->mesh_vert + 3 * static_cast<std::ptrdiff_t>(m->mesh_vertadr[mesh]),
                                             m->mesh_vertnum[mesh], cell_m);
  const std::ptrdiff_t begin = 3 * static_cast<std::ptrdiff_t>(m->mesh_faceadr[mesh]);
  int *face = m->mesh_face + begin, *normal = m->mesh_facenormal + begin, *texture = m->mesh_facetexcoord + begin;
  // Triangles that have become the same one, seen from the same side, are drawn once.
  std::unordered_set<std::uint64_t> kept;
  int count = 0;
  for (int f = 0; f < m->mesh_facenum[mesh]; ++f) {
    std::array<int, 3> corners{};
    for (std::size_t i = 0; i < 3; ++i)
      corners[i] = head[static_cast<std::size_t>(face[3 * f + static_cast<int>(i)])];
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    std::array<int, 3> turned = corners;
    while (turned[0] > turned[1] || turned[0] > turned[2]) turned = {turned[1], turned[2], turned[0]};
    if (!kept.insert(Packed(turned)).second) continue;
    for (int i = 0; i < 3; ++i) {
      face[3 * count + i] = corners[static_cast<std::size_t>(i)];
      normal[3 * count + i] = normal[3 * f + i];
      texture[3 * count + i] = texture[3 * f + i];
    }
    ++count;
  }
  m->mesh_facenum[mesh] = count;
}

}  // namespace

std::size_t DrawnTriangles(const mjModel& model) {
  std::size_t count = 0;
  for (int g = 0; g < model.ngeom; ++g) {
    if (IsDrawnMesh(model, g)) count += static_cast<std::size_t>(model.mesh_facenum[model.geom_dataid[g]]);
  }
  return count;
}

void ThinMeshes(mjModel* model, double cell_m) {
  std::set<int> meshes;
  for (int g = 0; g < model->ngeom; ++g) {
    if (IsDrawnMesh(*model, g)) meshes.insert(model->geom_dataid[g]);
  }
  for (const int mesh : meshes) ThinMesh(model, mesh, cell_m);
}

}  // namespace gapscope
