#include "src/model/sensor_facts.h"

#include <algorithm>

#include "src/core/names.h"
#include "src/model/element_names.h"

namespace gapscope {
namespace {

// Of a joint's, tendon's or actuator's scalar: angular on a hinge, linear elsewhere.
const char* Either(const mjModel& m, int sensor, const char* angular, const char* linear) {
  int joint = m.sensor_objid[sensor];
  if (m.sensor_objtype[sensor] == mjOBJ_TENDON) return linear;
  if (m.sensor_objtype[sensor] == mjOBJ_ACTUATOR) {
    if (m.actuator_trntype[joint] != mjTRN_JOINT) return linear;
    joint = m.actuator_trnid[2 * joint];
  }
  return m.jnt_type[joint] == mjJNT_SLIDE ? linear : angular;
}

}  // namespace

const char* UnitOfSensor(const mjModel& m, int sensor) {
  switch (m.sensor_type[sensor]) {
    case mjSENS_ACCELEROMETER:
    case mjSENS_FRAMELINACC:
      return "m/s^2";
    case mjSENS_VELOCIMETER:
    case mjSENS_FRAMELINVEL:
    case mjSENS_SUBTREELINVEL:
      return "m/s";
    case mjSENS_GYRO:
    case mjSENS_FRAMEANGVEL:
    case mjSENS_BALLANGVEL:
      return "rad/s";
    case mjSENS_FRAMEANGACC:
      return "rad/s^2";
    case mjSENS_TOUCH:
    case mjSENS_FORCE:
    case mjSENS_TENDONACTFRC:
    case mjSENS_TENDONLIMITFRC:
      return "N";
    case mjSENS_TORQUE:
      return "N m";
    case mjSENS_MAGNETOMETER:
      return "T";
    case mjSENS_FRAMEPOS:
    case mjSENS_SUBTREECOM:
    case mjSENS_RANGEFINDER:
    case mjSENS_GEOMDIST:
    case mjSENS_GEOMFROMTO:
      return "m";
    case mjSENS_JOINTPOS:
    case mjSENS_TENDONPOS:
    case mjSENS_ACTUATORPOS:
    case mjSENS_JOINTLIMITPOS:
    case mjSENS_TENDONLIMITPOS:
      return Either(m, sensor, "rad", "m");
    case mjSENS_JOINTVEL:
    case mjSENS_TENDONVEL:
    case mjSENS_ACTUATORVEL:
    case mjSENS_JOINTLIMITVEL:
    case mjSENS_TENDONLIMITVEL:
      return Either(m, sensor, "rad/s", "m/s");
    case mjSENS_ACTUATORFRC:
    case mjSENS_JOINTACTFRC:
    case mjSENS_JOINTLIMITFRC:
      return Either(m, sensor, "N m", "N");
    case mjSENS_CLOCK:
      return "s";
    default:
      return "1";
  }
}

Result<int> AddressOfSensor(const mjModel& m, const MeasuredSpec& measured) {
  const int sensor = mj_name2id(&m, mjOBJ_SENSOR, measured.on.c_str());
  const std::string of = "the sensor '" + measured.on + "' of signal '" + measured.signal + "'";
  if (sensor < 0)
    return NoSuch("a measured signal is of a sensor that the MJCF lacks", measured.on, ElementNames(m, mjOBJ_SENSOR),
                  measured.where);
  const int type = m.sensor_type[sensor], numbers = m.sensor_dim[sensor];
  if (type == mjSENS_USER) {
    return Error{.what = of + " has no model: a program's own callback gives its numbers",
                 .where = measured.where,
                 .cure = "take another sensor"};
  }
  if (m.sensor_delay[sensor] != 0 || m.sensor_interval[2 * sensor] != 0) {
    return Error{.what = of + " has a delay or an interval of its own",
                 .where = measured.where,
                 .cure = "take them out of the MJCF; '--with sensor_delay@" + measured.signal + "' adds a delay"};
  }
  if (measured.elements > 0 && measured.elements != numbers) {
    return Error{.what = of + " has another number of elements than 'columns_of_elements'",
                 .where = measured.where,
                 .actual = std::to_string(measured.elements),
                 .allowed = std::to_string(numbers)};
  }
  const bool orients = type == mjSENS_FRAMEQUAT || type == mjSENS_BALLQUAT;
  if (orients != (measured.kind == SignalKind::kOrientation)) {
    return Error{.what = of + (orients ? " is an orientation, whose numbers mean nothing one by one"
                                       : " is no orientation, though four columns are"),
                 .where = measured.where,
                 .cure = orients ? "name all four columns: 'columns_of_elements: [W, X, Y, Z]'"
                                 : "add 'kind: sensor', and the columns are numbers of their own"};
  }
  if (orients) return m.sensor_adr[sensor];
  if (measured.element >= numbers || (measured.element < 0 && numbers > 1)) {
    return Error{.what = of + (measured.element < 0 ? " has several elements" : " has no such element"),
                 .where = measured.where,
                 .actual = measured.element < 0 ? "no 'element'" : std::to_string(measured.element),
                 .allowed = "'element': 0 to " + std::to_string(numbers - 1)};
  }
  const std::string unit = UnitOfSensor(m, sensor);
  if (measured.unit != "1" && unit != "1" && measured.unit != unit) {
    return Error{.what = "the unit of the signal '" + measured.signal + "' does not fit its sensor",
                 .where = measured.where,
                 .actual = "'" + measured.unit + "'",
                 .allowed = "units of " + unit};
  }
  return m.sensor_adr[sensor] + std::max(measured.element, 0);
}

}  // namespace gapscope
