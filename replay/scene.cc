#include "replay/scene.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "replay/thin_meshes.h"

namespace gapscope {
namespace {

constexpr int kMaxGeoms = 20000;
constexpr float kGhostAlpha = 0.5f;
// Apart by this share of the model's size a ghost is at its clearest: about four pixels of a picture 500 high.
constexpr float kClearAt = 0.008f;
// Ghosts are drawn a little larger: where they touch the solid mechanism their skin is in front of it all over, instead
// of in stripes.
constexpr float kGhostGrowth = 1.012f;

constexpr int kSampledPoses = 200;                                     // of a track, to frame it
constexpr double kMargin = 1.22;                                       // free around the motion
constexpr double kTrackingZoom = 0.8;                                  // a camera that follows may come closer
constexpr double kMujocoAzimuth_deg = 90, kMujocoElevation_deg = -45;  // of an MJCF without <visual><global>
constexpr int kShadowMap = 1024;                                       // pixels across the table
// Of all meshes of a mechanism: about four pixels across in a picture 720 high.
constexpr std::size_t kMostTriangles = 40000;

using Vector = std::array<double, 3>;
double Dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

bool IsSeen(const mjModel& m, int geom) { return m.geom_group[geom] < kDrawnGroups; }
bool Moves(const mjModel& m, int geom) { return IsSeen(m, geom) && m.body_weldid[m.geom_bodyid[geom]] != 0; }

// Direction of sight of the view, as the free camera's angles.
void PointCamera(const mjModel& m, const mjData& d, Framing& framing) {
  const char* name = framing.view == View::kFixed ? "fixed" : framing.view == View::kTop ? "top" : "track";
  mjvCamera camera;
  mjv_defaultFreeCamera(&m, &camera);
  // Where the MJCF says nothing, from before and aside: of a robot seen straight from its side half is hidden.
  const bool told = camera.azimuth != kMujocoAzimuth_deg || camera.elevation != kMujocoElevation_deg;
  framing.azimuth_deg = told ? camera.azimuth : 125;
  framing.elevation_deg = framing.view == View::kTop ? -89.5 : told ? camera.elevation : -20;
  const int id = mj_name2id(&m, mjOBJ_CAMERA, name);
  if (id < 0) return;
  const mjtNum* x = d.cam_xmat + 9 * id;
  const Vector forward = {-x[2], -x[5], -x[8]}, up = {x[1], x[4], x[7]};
  framing.elevation_deg = std::asin(std::clamp(forward[2], -1.0, 1.0)) * 180 / mjPI;
  // Straight down, the heading is that of the picture's upper side.
  const bool steep = std::abs(forward[2]) > 0.999;
  framing.azimuth_deg = std::atan2(steep ? up[1] : forward[1], steep ? up[0] : forward[0]) * 180 / mjPI;
}

// The eight corners of each geom's box, in the world.
template <class Use>
void ForEachCorner(const mjModel& m, const mjData& d, int geom, const Use& use) {
  const mjtNum* box = m.geom_aabb + 6 * geom;
  for (int corner = 0; corner < 8; ++corner) {
    mjtNum local[3], world[3];
    for (int i = 0; i < 3; ++i) local[i] = box[i] + ((corner >> i & 1) ? box[3 + i] : -box[3 + i]);
    mju_mulMatVec3(world, d.geom_xmat + 9 * geom, local);
    use(Vector{world[0] + d.geom_xpos[3 * geom], world[1] + d.geom_xpos[3 * geom + 1],
               world[2] + d.geom_xpos[3 * geom + 2]});
  }
}

void SetPose(const mjModel& m, mjData& d, std::span<const double> qpos) {
  std::copy(qpos.begin(), qpos.end(), d.qpos);
  mj_kinematics(&m, &d);
  mj_comPos(&m, &d);
  mj_camlight(&m, &d);
  mj_tendon(&m, &d);
}

// The middle of what moves, in one pose.
Vector MovingCentre(const mjModel& m, const mjData& d) {
  Vector sum{};
  int count = 0;
  for (int g = 0; g < m.ngeom; ++g) {
    if (!Moves(m, g)) continue;
    for (std::size_t i = 0; i < 3; ++i) sum[i] += d.geom_xpos[3 * g + static_cast<int>(i)];
    ++count;
  }
  for (double& s : sum) s /= std::max(1, count);
  return sum;
}

// How far two geoms of one kind stand apart, m: their centres, and what a turn moves at their size.
float Apart(const mjvGeom& a, const mjvGeom& b) {
  float centres = 0, turn = 0;
  for (int i = 0; i < 3; ++i) centres += (a.pos[i] - b.pos[i]) * (a.pos[i] - b.pos[i]);
  for (int i = 0; i < 9; ++i) turn += (a.mat[i] - b.mat[i]) * (a.mat[i] - b.mat[i]);
  const float size = std::max({a.size[0], a.size[1], a.size[2], a.modelrbound});
  return std::sqrt(centres) + size * std::sqrt(turn / 2);
}

struct CameraAxes {
  Vector right, up, forward;
};

CameraAxes AxesOf(const Framing& framing) {
  const double azimuth = framing.azimuth_deg * mjPI / 180, elevation = framing.elevation_deg * mjPI / 180;
  const Vector forward = {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                          std::sin(elevation)};
  const Vector right = {std::sin(azimuth), -std::cos(azimuth), 0};
  const Vector up = {right[1] * forward[2] - right[2] * forward[1], right[2] * forward[0] - right[0] * forward[2],
                     right[0] * forward[1] - right[1] * forward[0]};
  return {.right = right, .up = up, .forward = forward};
}

// Corners of what moves in the camera's axes, of poses along the tracks. `about_centre`: about the middle of each pose,
// where a camera that follows looks; `first` becomes that of the first pose.
std::vector<Vector> CornersSeen(const mjModel& model, mjData& d, std::span<const PoseTrack* const> tracks,
                                bool about_centre, const CameraAxes& axes, Vector* first) {
  std::vector<Vector> seen;
  std::vector<double> qpos(static_cast<std::size_t>(model.nq));
  for (const PoseTrack* track : tracks) {
    if (track->time_s.empty()) continue;
    for (int k = 0; k < kSampledPoses; ++k) {
      const double t = track->time_s.front() + (track->time_s.back() - track->time_s.front()) * k / (kSampledPoses - 1);
      if (!PoseAt(model, *track, t, qpos)) continue;
      SetPose(model, d, qpos);
      const Vector about = about_centre ? MovingCentre(model, d) : Vector{};
      if (seen.empty()) *first = about;
      for (int g = 0; g < model.ngeom; ++g) {
        if (!Moves(model, g)) continue;
        ForEachCorner(model, d, g, [&](const Vector& p) {
          const Vector q = {p[0] - about[0], p[1] - about[1], p[2] - about[2]};
          seen.push_back({Dot(q, axes.right), Dot(q, axes.up), Dot(q, axes.forward)});
        });
      }
    }
  }
  return seen;
}

// How far what is drawn reaches about a point on the ground: a table of that size holds all of the mechanism.
double ReachAbout(const mjModel& model, const mjData& d, double x, double y) {
  double reach = 0;
  for (int g = 0; g < model.ngeom; ++g) {
    if (!IsSeen(model, g) || model.geom_type[g] == mjGEOM_PLANE || model.geom_type[g] == mjGEOM_HFIELD) continue;
    ForEachCorner(model, d, g, [&](const Vector& p) { reach = std::max(reach, std::hypot(p[0] - x, p[1] - y)); });
  }
  return reach;
}

}  // namespace

template <>
std::span<const EnumName<View>> EnumNames<View>() {
  static constexpr EnumName<View> kNames[] = {
      {View::kFixed, "fixed"}, {View::kTracking, "tracking"}, {View::kTop, "top"}};
  return kNames;
}

Framing FrameMotion(const mjModel& model, std::span<const PoseTrack* const> tracks, View view, double aspect) {
  Framing framing{.view = view};
  const DataPtr data(mj_makeData(&model));
  mjData& d = *data;
  SetPose(model, d, std::span<const double>(model.qpos0, static_cast<std::size_t>(model.nq)));
  PointCamera(model, d, framing);
  const CameraAxes axes = AxesOf(framing);
  Vector first{};
  const std::vector<Vector> seen = CornersSeen(model, d, tracks, view == View::kTracking, axes, &first);
  if (seen.empty()) {
    for (int i = 0; i < 3; ++i) framing.centre[static_cast<std::size_t>(i)] = model.stat.center[i];
    framing.distance_m = 1.5 * model.stat.extent;
    framing.ground_m = 2 * model.stat.extent;
    return framing;
  }
  Vector low = seen.front(), high = seen.front(), middle{};
  for (const Vector& p : seen) {
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], p[i]);
      high[i] = std::max(high[i], p[i]);
    }
  }
  for (std::size_t i = 0; i < 3; ++i) middle[i] = view == View::kTracking ? 0 : (low[i] + high[i]) / 2;
  const double tall = std::tan(model.vis.global.fovy * mjPI / 360) / kMargin, wide = tall * aspect;
  double distance = 0;
  for (const Vector& p : seen)
    distance = std::max(
        distance, std::max(std::abs(p[0] - middle[0]) / wide, std::abs(p[1] - middle[1]) / tall) - (p[2] - middle[2]));
  framing.distance_m = distance * (view == View::kTracking ? kTrackingZoom : 1);
  for (std::size_t i = 0; i < 3; ++i)
    framing.centre[i] = first[i] + middle[0] * axes.right[i] + middle[1] * axes.up[i] + middle[2] * axes.forward[i];
  framing.ground_m = 1.7 * ReachAbout(model, d, framing.centre[0], framing.centre[1]);
  return framing;
}

struct Scene::Impl {
  ModelPtr model;  // as given, but for what concerns drawing alone
  const mjModel* given = nullptr;
  Framing framing;
  int width = 0, height = 0;
  mjvScene scene;
  mjrContext context;
  mjvOption option;
  std::vector<std::pair<const mjModel*, DataPtr>> data;  // by position in the list of mechanisms
  std::vector<unsigned char> rgb;
  Redraw redraw = Redraw::kAll;
  Picture still;  // everything that does not move

  Impl() {
    mjv_defaultScene(&scene);
    mjr_defaultContext(&context);
    mjv_defaultOption(&option);
  }
  ~Impl() {
    mjr_freeContext(&context);
    mjv_freeScene(&scene);
  }

  mjData* Pose(std::size_t slot, const Mechanism& mechanism) {
    if (data.size() <= slot) data.resize(slot + 1);
    if (data[slot].first != mechanism.model) data[slot] = {mechanism.model, DataPtr(mj_makeData(mechanism.model))};
    mjData* d = data[slot].second.get();
    GS_CHECK(mechanism.qpos.size() == static_cast<std::size_t>(mechanism.model->nq));
    SetPose(*mechanism.model, *d, mechanism.qpos);
    return d;
  }

  // Infinite planes become tables.
  void LayTable() {
    for (int g = 0; g < scene.ngeom; ++g) {
      mjvGeom& geom = scene.geoms[g];
      if (geom.type != mjGEOM_PLANE || geom.objtype != mjOBJ_GEOM || given->geom_size[3 * geom.objid] > 0) continue;
      geom.size[0] = geom.size[1] = static_cast<float>(framing.ground_m);
      geom.pos[0] = static_cast<float>(framing.centre[0]);
      geom.pos[1] = static_cast<float>(framing.centre[1]);
    }
  }

  // Draws the part of the picture, given as OpenGL counts it (from the lower left), with a frustum of that part alone.
  Status DrawPart(const mjrRect& part, Picture& picture) {
    const mjvGLCamera cameras[] = {scene.camera[0], scene.camera[1]};
    for (mjvGLCamera& camera : scene.camera) {
      const float pixel = (camera.frustum_top - camera.frustum_bottom) / static_cast<float>(height);
      camera.frustum_center += pixel * (static_cast<float>(part.left) + 0.5f * static_cast<float>(part.width - width));
      camera.frustum_top = camera.frustum_bottom + pixel * static_cast<float>(part.bottom + part.height);
      camera.frustum_bottom += pixel * static_cast<float>(part.bottom);
    }
    const mjrRect viewport{0, 0, part.width, part.height};
    mjr_setBuffer(mjFB_OFFSCREEN, &context);  // another scene may have drawn in between
    mjr_render(viewport, &scene, &context);
    mjr_readPixels(rgb.data(), nullptr, viewport, &context);
    std::copy_n(cameras, 2, scene.camera);
    if (const int error = mjr_getError(); error != 0)
      return Error{.what = "OpenGL failed while drawing",
                   .actual = fmt::format("error {:#x}", error),
                   .cure = "try another --gl"};
    for (int row = 0; row < part.height; ++row) {
      const unsigned char* from = rgb.data() + 3 * static_cast<std::size_t>(row) * static_cast<std::size_t>(part.width);
      std::uint32_t* to = picture.pixels.data() +
                          static_cast<std::size_t>(height - 1 - part.bottom - row) * static_cast<std::size_t>(width) +
                          part.left;
      for (int x = 0; x < part.width; ++x, from += 3)
        to[x] = 0xff000000u | static_cast<std::uint32_t>(from[0]) << 16 | static_cast<std::uint32_t>(from[1]) << 8 |
                from[2];
    }
    return Ok();
  }

  Status DrawStill(const mjrRect& whole) {
    const std::vector<mjvGeom> all(scene.geoms, scene.geoms + scene.ngeom);
    scene.ngeom = static_cast<int>(std::remove_if(scene.geoms, scene.geoms + scene.ngeom,
                                                  [](const mjvGeom& g) { return g.category != mjCAT_STATIC; }) -
                                   scene.geoms);
    const Status drawn = DrawPart(whole, still);
    std::copy(all.begin(), all.end(), scene.geoms);
    scene.ngeom = static_cast<int>(all.size());
    return drawn;
  }

  // The part of the picture that holds all moving geoms and their shadows on the ground and on what stands before it.
  mjrRect WhereItMoves() const {
    const mjrRect whole{0, 0, width, height};
    const mjvGLCamera camera = mjv_averageCamera(&scene.camera[0], &scene.camera[1]);  // between the eyes
    const float* f = camera.forward;
    const float* u = camera.up;
    const float right[] = {f[1] * u[2] - f[2] * u[1], f[2] * u[0] - f[0] * u[2], f[0] * u[1] - f[1] * u[0]};
    const double pixel = (camera.frustum_top - camera.frustum_bottom) / static_cast<double>(height);
    double low[] = {1e9, 1e9}, high[] = {-1e9, -1e9};
    bool all = false;
    const auto see = [&](const Vector& p) {
      double x = 0, y = 0, z = 0;
      for (std::size_t i = 0; i < 3; ++i) {
        const double d = p[i] - camera.pos[i];
        x += d * right[i], y += d * u[i], z += d * f[i];
      }
      if (z < camera.frustum_near) return void(all = true);
      const double at[] = {(x / z * camera.frustum_near - camera.frustum_center) / pixel + 0.5 * width,
                           (y / z * camera.frustum_near - camera.frustum_bottom) / pixel};
      for (int i = 0; i < 2; ++i) low[i] = std::min(low[i], at[i]), high[i] = std::max(high[i], at[i]);
    };
    double ground = 1e9;
    for (int g = 0; g < scene.ngeom; ++g) {
      if (scene.geoms[g].type == mjGEOM_PLANE) ground = std::min(ground, static_cast<double>(scene.geoms[g].pos[2]));
    }
    for (int g = 0; g < scene.ngeom; ++g) {
      const mjvGeom& geom = scene.geoms[g];
      if (geom.category == mjCAT_STATIC) continue;
      if (geom.objtype != mjOBJ_GEOM) return whole;
      const mjtNum* box = given->geom_aabb + 6 * geom.objid;
      for (int corner = 0; corner < 8; ++corner) {
        Vector p{};
        for (int i = 0; i < 3; ++i) {
          p[static_cast<std::size_t>(i)] = geom.pos[i];
          for (int j = 0; j < 3; ++j)
            p[static_cast<std::size_t>(i)] +=
                geom.mat[3 * i + j] * (box[j] + kGhostGrowth * ((corner >> j & 1) ? box[3 + j] : -box[3 + j]));
        }
        see(p);
        for (int l = 0; geom.castshadow && l < scene.nlight; ++l) {
          const mjvLight& light = scene.lights[l];
          if (!light.castshadow || light.headlight || ground > p[2]) continue;
          if (light.type != mjLIGHT_DIRECTIONAL || light.dir[2] > -0.1f) return whole;
          const double reach = (p[2] - ground) / -light.dir[2];
          see({p[0] + reach * light.dir[0], p[1] + reach * light.dir[1], ground});
        }
      }
    }
    if (all) return whole;
    constexpr double kRim = 3;  // pixels
    mjrRect part;
    part.left = static_cast<int>(std::clamp(std::floor(low[0] - kRim), 0.0, static_cast<double>(width)));
    part.bottom = static_cast<int>(std::clamp(std::floor(low[1] - kRim), 0.0, static_cast<double>(height)));
    part.width = static_cast<int>(std::clamp(std::ceil(high[0] + kRim), 0.0, static_cast<double>(width))) - part.left;
    part.height =
        static_cast<int>(std::clamp(std::ceil(high[1] + kRim), 0.0, static_cast<double>(height))) - part.bottom;
    return part;
  }

  void AddGhost(std::size_t slot, const Mechanism& mechanism, int solid_geoms) {
    // Geoms are found again by their object; effects may have added bodies, so numbers need not agree, but names of the
    // rest do.
    std::map<int, const mjvGeom*> solid;
    for (int g = 0; g < solid_geoms; ++g) {
      if (scene.geoms[g].objtype == mjOBJ_GEOM) solid[scene.geoms[g].objid] = &scene.geoms[g];
    }
    const int begin = scene.ngeom;
    mjv_addGeoms(mechanism.model, Pose(slot, mechanism), &option, nullptr, mjCAT_DYNAMIC, &scene);
    int kept = begin;
    for (int g = begin; g < scene.ngeom; ++g) {
      mjvGeom geom = scene.geoms[g];
      const auto twin = solid.find(geom.objid);
      const float apart =
          twin == solid.end() ? kClearAt * static_cast<float>(model->stat.extent) : Apart(geom, *twin->second);
      const float clear = std::min(1.0f, apart / (kClearAt * static_cast<float>(model->stat.extent)));
      if (geom.objtype != mjOBJ_GEOM || clear <= 1e-4f) continue;
      for (int i = 0; i < 3; ++i) geom.rgba[i] = mechanism.ghost_rgb[static_cast<std::size_t>(i)];
      geom.rgba[3] = kGhostAlpha * clear;
      geom.matid = geom.texid = -1;
      geom.emission = 0.25f;
      geom.specular = 0.2f;
      geom.reflectance = 0;
      geom.castshadow = 0;
      geom.transparent = 1;
      for (float& size : geom.size) size *= kGhostGrowth;
      scene.geoms[kept++] = geom;
    }
    scene.ngeom = kept;
  }
};

Result<std::unique_ptr<Scene>> Scene::Make(const mjModel& model, const Framing& framing, int width, int height,
                                           Redraw redraw) {
  GS_CHECK(width > 0 && height > 0);
  std::unique_ptr<Scene> made(new Scene);
  made->impl_ = std::make_unique<Impl>();
  Impl& impl = *made->impl_;
  impl.framing = framing;
  impl.model.reset(mj_copyModel(nullptr, &model));
  impl.given = &model;
  mjModel& drawn = *impl.model;
  drawn.vis.global.offwidth = width;
  drawn.vis.global.offheight = height;
  // The renderer prepares planes from the model, and draws them where the scene says (LayTable).
  for (int g = 0; g < drawn.ngeom; ++g) {
    if (drawn.geom_type[g] == mjGEOM_PLANE && !(drawn.geom_size[3 * g] > 0))
      drawn.geom_size[3 * g] = drawn.geom_size[3 * g + 1] = framing.ground_m;
  }
  drawn.vis.quality.shadowsize = std::min(drawn.vis.quality.shadowsize, kShadowMap);
  drawn.vis.map.shadowclip = static_cast<float>(1.3 * framing.ground_m / drawn.stat.extent);
  double cell = 2 * framing.distance_m * std::tan(drawn.vis.global.fovy * mjPI / 360) / height;  // a pixel there
  for (; DrawnTriangles(drawn) > kMostTriangles; cell *= 1.25) ThinMeshes(&drawn, cell);
  impl.width = width;
  impl.height = height;
  mjv_makeScene(&drawn, &impl.scene, kMaxGeoms);
  mjr_makeContext(&drawn, &impl.context, mjFONTSCALE_100);
  mjr_setBuffer(mjFB_OFFSCREEN, &impl.context);
  if (impl.context.currentBuffer != mjFB_OFFSCREEN || mjr_getError() != 0) {
    return Error{.what = "OpenGL cannot draw off-screen",
                 .where = fmt::format("a picture of {} x {}", width, height),
                 .cure = "try a smaller --size or another --gl"};
  }
  impl.scene.flags[mjRND_REFLECTION] = 0;
  impl.redraw = framing.view == View::kTracking ? Redraw::kAll : redraw;
  impl.rgb.resize(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  return made;
}

Scene::~Scene() = default;

Status Scene::Draw(std::span<const Mechanism> mechanisms, Picture& picture) {
  Impl& impl = *impl_;
  GS_CHECK(!mechanisms.empty());
  const mjModel& solid_model = *mechanisms.front().model;
  mjData* data = impl.Pose(0, mechanisms.front());
  mjvCamera camera;
  mjv_defaultFreeCamera(&solid_model, &camera);
  camera.distance = impl.framing.distance_m;
  camera.azimuth = impl.framing.azimuth_deg;
  camera.elevation = impl.framing.elevation_deg;
  const Vector centre = impl.framing.view == View::kTracking ? MovingCentre(solid_model, *data) : impl.framing.centre;
  std::copy(centre.begin(), centre.end(), camera.lookat);
  mjv_updateScene(&solid_model, data, &impl.option, nullptr, &camera, mjCAT_ALL, &impl.scene);
  impl.LayTable();
  const int solid = impl.scene.ngeom;
  for (std::size_t i = 1; i < mechanisms.size(); ++i) impl.AddGhost(i, mechanisms[i], solid);
  picture.width = impl.width;
  picture.height = impl.height;
  picture.pixels.resize(static_cast<std::size_t>(impl.width) * static_cast<std::size_t>(impl.height));
  const mjrRect whole{0, 0, impl.width, impl.height};
  if (impl.redraw == Redraw::kAll) return impl.DrawPart(whole, picture);
  if (impl.still.pixels.empty()) {
    impl.still = picture;
    GS_RETURN_IF_ERROR(impl.DrawStill(whole));
  }
  std::copy(impl.still.pixels.begin(), impl.still.pixels.end(), picture.pixels.begin());
  const mjrRect part = impl.WhereItMoves();
  return part.width > 0 && part.height > 0 ? impl.DrawPart(part, picture) : Ok();
}

}  // namespace gapscope
