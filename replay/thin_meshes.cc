#include "replay/thin_meshes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <set>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "src/core/rotation.h"

namespace gapscope {
namespace {

constexpr double kWellAlong = 0.5;  // cosine between a corner's normal and its triangle's

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
    for (int i = 0; i < 3; ++i) vertices[3 * head + i] = static_cast<float>(sum[static_cast<std::size_t>(i)] / sum[3]);
  }
  return stands_for;
}

Vector3 PointAt(const float* from, int index) {
  return {from[3 * static_cast<std::ptrdiff_t>(index)], from[3 * static_cast<std::ptrdiff_t>(index) + 1],
          from[3 * static_cast<std::ptrdiff_t>(index) + 2]};
}
double Along(const Vector3& a, const Vector3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// A triangle's corners as numbers of vertices, of normals and of texture points.
struct Triangle {
  std::array<int, 3> vertex, normal, texture;
};

// Triangles that joining has turned over are turned back: a renderer leaves out what shows its back. A corner whose
// normal lies far off the triangle takes the best of the three, else it would glint.
void Straighten(const float* vertices, const float* normals, Triangle* t) {
  const Vector3 a = PointAt(vertices, t->vertex[0]), b = PointAt(vertices, t->vertex[1]),
                c = PointAt(vertices, t->vertex[2]);
  const Vector3 face = Cross({b[0] - a[0], b[1] - a[1], b[2] - a[2]}, {c[0] - a[0], c[1] - a[1], c[2] - a[2]});
  const double size = std::sqrt(Along(face, face));
  if (size == 0) return;
  std::array<double, 3> along{};
  for (std::size_t i = 0; i < 3; ++i) along[i] = Along(face, PointAt(normals, t->normal[i])) / size;
  if (along[0] + along[1] + along[2] < 0) {
    for (auto* corners : {&t->vertex, &t->normal, &t->texture}) std::swap((*corners)[1], (*corners)[2]);
    along = {-along[0], -along[2], -along[1]};
  }
  const std::size_t best = static_cast<std::size_t>(std::max_element(along.begin(), along.end()) - along.begin());
  for (std::size_t i = 0; i < 3; ++i) {
    if (along[i] < kWellAlong) t->normal[i] = t->normal[best];
  }
}

void ThinMesh(mjModel* m, int mesh, double cell_m) {
  float* vertices = m->mesh_vert + 3 * static_cast<std::ptrdiff_t>(m->mesh_vertadr[mesh]);
  const float* normals = m->mesh_normal + 3 * static_cast<std::ptrdiff_t>(m->mesh_normaladr[mesh]);
  const std::vector<int> head = JoinVertices(vertices, m->mesh_vertnum[mesh], cell_m);
  const std::ptrdiff_t begin = 3 * static_cast<std::ptrdiff_t>(m->mesh_faceadr[mesh]);
  int *face = m->mesh_face + begin, *normal = m->mesh_facenormal + begin, *texture = m->mesh_facetexcoord + begin;
  // Triangles that have become the same one, seen from the same side, are drawn once.
  std::unordered_set<std::uint64_t> kept;
  int count = 0;
  for (int f = 0; f < m->mesh_facenum[mesh]; ++f, face += 3, normal += 3, texture += 3) {
    Triangle t{.vertex = {head[static_cast<std::size_t>(face[0])], head[static_cast<std::size_t>(face[1])],
                          head[static_cast<std::size_t>(face[2])]},
               .normal = {normal[0], normal[1], normal[2]},
               .texture = {texture[0], texture[1], texture[2]}};
    if (t.vertex[0] == t.vertex[1] || t.vertex[1] == t.vertex[2] || t.vertex[2] == t.vertex[0]) continue;
    Straighten(vertices, normals, &t);
    std::array<int, 3> turned = t.vertex;
    while (turned[0] > turned[1] || turned[0] > turned[2]) turned = {turned[1], turned[2], turned[0]};
    if (!kept.insert(Packed(turned)).second) continue;
    const std::ptrdiff_t to = begin + 3 * count++;
    std::copy(t.vertex.begin(), t.vertex.end(), m->mesh_face + to);
    std::copy(t.normal.begin(), t.normal.end(), m->mesh_facenormal + to);
    std::copy(t.texture.begin(), t.texture.end(), m->mesh_facetexcoord + to);
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
