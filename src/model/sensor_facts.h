// What MuJoCo's sensors measure, as far as a log can be compared with them.
#ifndef GAPSCOPE_MODEL_SENSOR_FACTS_H_
#define GAPSCOPE_MODEL_SENSOR_FACTS_H_

#include <mujoco/mujoco.h>

#include <string>

#include "src/core/result.h"
#include "src/experiment/experiment.h"

namespace gapscope {

// SI unit of a sensor's numbers; "1": none, or its plugin's own.
const char* UnitOfSensor(const mjModel& model, int sensor);

// Where the signal's number stands in sensordata; of an orientation the quaternion's first. Errors: no such sensor, or
// one that the model itself delays or samples; an element that it lacks, or none named of several; a unit that it has
// not; another number of columns than it has elements; an orientation whose numbers are measured one by one.
Result<int> AddressOfSensor(const mjModel& model, const MeasuredSpec& measured);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_SENSOR_FACTS_H_
