#include "src/model/free_starts.h"

#include <algorithm>

#include "src/core/collect.h"
#include "src/core/mujoco_handles.h"
#include "src/core/names.h"
#include "src/model/element_names.h"

namespace gapscope {
namespace {

// The body of `bodies` that the sensor's object is fixed to; -1: none of them.
int CarrierOf(const mjModel& m, int sensor, const std::vector<int>& bodies) {
  if (m.sensor_refid[sensor] >= 0) return -1;
  for (int body = BodyOfSensor(m, sensor); body > 0; body = m.body_parentid[body]) {
    if (std::ranges::find(bodies, body) != bodies.end()) return body;
    if (m.body_jntnum[body] > 0) break;
  }
  return -1;
}

// What may start or stand where a log says.
std::vector<int> FreeAndHeld(const mjModel& m, const Experiment& experiment) {
  std::vector<int> bodies;
  for (int j = 0; j < m.njnt; ++j) {
    if (m.jnt_type[j] == mjJNT_FREE) bodies.push_back(m.jnt_bodyid[j]);
  }
  for (const NamedBody& held : experiment.hold) bodies.push_back(mj_name2id(&m, mjOBJ_BODY, held.name.c_str()));
  return bodies;
}

struct Frame {
  Vector3 place = {};
  Quaternion turn = kNoRotation;
};
Frame FrameOf(const mjtNum* place, const mjtNum* matrix) {
  Frame frame{.place = {place[0], place[1], place[2]}};
  mju_mat2Quat(frame.turn.data(), matrix);
  return frame;
}

// Of a sensor's object, in the world.
Frame ObjectFrame(const mjModel& m, const mjData& d, int sensor) {
  const int object = m.sensor_objid[sensor];
  switch (m.sensor_objtype[sensor]) {
    case mjOBJ_BODY:
      return FrameOf(d.xipos + 3 * object, d.ximat + 9 * object);
    case mjOBJ_SITE:
      return FrameOf(d.site_xpos + 3 * object, d.site_xmat + 9 * object);
    case mjOBJ_GEOM:
      return FrameOf(d.geom_xpos + 3 * object, d.geom_xmat + 9 * object);
    case mjOBJ_CAMERA:
      return FrameOf(d.cam_xpos + 3 * object, d.cam_xmat + 9 * object);
    default:
      return FrameOf(d.xpos + 3 * object, d.xmat + 9 * object);
  }
}

// As the body carries it.
Frame OnBody(const mjModel& m, int sensor, int body) {
  const DataPtr d(mj_makeData(&m));
  mj_kinematics(&m, d.get());
  mj_camlight(&m, d.get());
  const Frame carrier = FrameOf(d->xpos + 3 * body, d->xmat + 9 * body), object = ObjectFrame(m, *d, sensor);
  const Quaternion back = Conjugate(carrier.turn);
  const Vector3 apart = {object.place[0] - carrier.place[0], object.place[1] - carrier.place[1],
                         object.place[2] - carrier.place[2]};
  return {.place = Rotate(back, apart), .turn = back * object.turn};
}

bool SaysPlace(const mjModel& m, const MeasuredSpec& spec, int sensor) {
  return spec.kind == SignalKind::kSensor && m.sensor_type[sensor] == mjSENS_FRAMEPOS;
}
bool SaysTurn(const mjModel& m, const MeasuredSpec& spec, int sensor) {
  return spec.kind == SignalKind::kOrientation && m.sensor_type[sensor] == mjSENS_FRAMEQUAT;
}

// The signals of the sensor's three elements; -1 where one is not measured.
std::array<int, 3> ElementsOf(const Experiment& experiment, const std::string& sensor) {
  std::array<int, 3> found = {-1, -1, -1};
  for (std::size_t i = 0; i < experiment.measured.size(); ++i) {
    const MeasuredSpec& spec = experiment.measured[i];
    if (spec.kind == SignalKind::kSensor && spec.on == sensor && spec.element >= 0 && spec.element < 3 &&
        spec.starts.value_or(true) && found[spec.element] < 0)
      found[spec.element] = static_cast<int>(i);
  }
  return found;
}

// Why a signal that is asked to give a start gives none.
Error NoStart(const mjModel& m, const std::vector<int>& bodies, const MeasuredSpec& spec, int sensor) {
  const bool pose = SaysPlace(m, spec, sensor) || SaysTurn(m, spec, sensor);
  std::vector<std::string> free = Collect(bodies, [&](int body) { return NameOf(m, mjOBJ_BODY, body); });
  Error error{.what = "no window can start from the signal '" + spec.signal + "'", .where = spec.where};
  if (!pose) {
    error.actual = "the sensor '" + spec.on + "' measures no pose";
    error.allowed = "'framepos' and 'framequat'";
  } else if (CarrierOf(m, sensor, bodies) < 0) {
    const int body = BodyOfSensor(m, sensor);
    error.actual = m.sensor_refid[sensor] >= 0 ? "the sensor '" + spec.on + "' has a 'reftype'"
                   : body < 0                  ? "the sensor '" + spec.on + "' is on no body"
                              : "the body '" + NameOf(m, mjOBJ_BODY, body) + "' has no free joint and is not on 'hold'";
    error.allowed = free.empty() ? "a body with a free joint or on 'hold'; the model has none"
                                 : "sensors in the world's frame on " + Join(free);
  } else {
    error.actual =
        "not all of x, y, z of '" + spec.on + "' are measured, or another sensor of the body gives its start";
    error.allowed = "'columns_of_elements' with three columns, of one sensor a body";
  }
  error.cure = "drop 'start: true'";
  return error;
}

}  // namespace

int BodyOfSensor(const mjModel& m, int sensor) {
  const int object = m.sensor_objid[sensor];
  switch (m.sensor_objtype[sensor]) {
    case mjOBJ_BODY:
    case mjOBJ_XBODY:
      return object;
    case mjOBJ_SITE:
      return m.site_bodyid[object];
    case mjOBJ_GEOM:
      return m.geom_bodyid[object];
    case mjOBJ_CAMERA:
      return m.cam_bodyid[object];
    default:
      return -1;
  }
}

Result<std::vector<FreeStart>> FindFreeStarts(const mjModel& m, const Experiment& experiment) {
  std::vector<FreeStart> starts;
  const std::vector<int> bodies = FreeAndHeld(m, experiment);
  for (const int body : bodies) {
    FreeStart start{.body = body};
    if (m.body_jntnum[body] == 1 && m.jnt_type[m.body_jntadr[body]] == mjJNT_FREE) {
      start.qpos = m.jnt_qposadr[m.body_jntadr[body]];
      start.dof = m.jnt_dofadr[m.body_jntadr[body]];
    }
    for (std::size_t i = 0; i < experiment.measured.size(); ++i) {
      const MeasuredSpec& spec = experiment.measured[i];
      const int sensor =
          TraitsOf(spec.kind).site == SignalSite::kSensor ? mj_name2id(&m, mjOBJ_SENSOR, spec.on.c_str()) : -1;
      if (sensor < 0 || !spec.starts.value_or(true) || CarrierOf(m, sensor, bodies) != body) continue;
      if (SaysPlace(m, spec, sensor) && start.position[0] < 0) {
        const std::array<int, 3> elements = ElementsOf(experiment, spec.on);
        if (std::ranges::find(elements, -1) != elements.end()) continue;
        start.position = elements;
        start.place = OnBody(m, sensor, body).place;
      } else if (SaysTurn(m, spec, sensor) && start.rotation < 0) {
        start.rotation = static_cast<int>(i);
        start.mounted = OnBody(m, sensor, body).turn;
      }
    }
    if (start.position[0] >= 0 || start.rotation >= 0) starts.push_back(start);
  }
  for (int i = 0; i < static_cast<int>(experiment.measured.size()); ++i) {
    const MeasuredSpec& spec = experiment.measured[static_cast<std::size_t>(i)];
    const bool used = std::ranges::any_of(starts, [&](const FreeStart& start) {
      return std::ranges::find(start.position, i) != start.position.end() ||
             (start.rotation >= 0 && i >= start.rotation && i < start.rotation + 3);
    });
    if (spec.starts.value_or(false) && !used)
      return NoStart(m, bodies, spec, mj_name2id(&m, mjOBJ_SENSOR, spec.on.c_str()));
  }
  return starts;
}

}  // namespace gapscope
