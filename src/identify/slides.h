// Rows of the logs in which a joint slides, with the torques on it: what friction, inertia and cable are read from.
#ifndef GAPSCOPE_IDENTIFY_SLIDES_H_
#define GAPSCOPE_IDENTIFY_SLIDES_H_

#include <vector>

#include "src/identify/identification.h"

namespace gapscope {

struct Slide {
  int log;
  double time_s, angle, speed, acceleration;  // rad, rad/s, rad/s^2
  double drive, demand, others;               // N m, as in Motion (torque.h)
};

struct Slides {
  std::vector<Slide> rows;
  double dt_s = 0, fastest = 0, least = 0;  // largest speed in the logs; least one that counts as sliding
  bool torque_logged = false;

  // Whether the joint stays within two turns: a cable's or a spring's pull is not friction; on a joint that turns round
  // and round there is none.
  bool MayPull() const;
};

// Errors: those of MotionOf; hardly any rows in one of the directions.
Result<Slides> LoadSlides(const IdentifyInput& input, int joint, const IdentifyOptions& options);

// `options`, with the cut-off that inertial torques want as regressors, where they are: no noise in the accelerations.
IdentifyOptions ForFreeInertia(const IdentifyInput& input, int joint, IdentifyOptions options);

// What to beware of where the drive's torque is the model's.
void RemarkUnloggedTorque(const Slides& slides, Identification* result);

}  // namespace gapscope

#endif  // GAPSCOPE_IDENTIFY_SLIDES_H_
