// The logs of one case: sensors, excitations of several kinds, and amplitudes found by simulation so that a rig moves
// as a careful experimenter would move it.
#ifndef GAPSCOPE_TESTS_TWIN_CAMPAIGN_H_
#define GAPSCOPE_TESTS_TWIN_CAMPAIGN_H_

#include <array>
#include <vector>

#include "tests/twin/effects.h"
#include "tests/twin/plant.h"
#include "tests/twin/random.h"
#include "tests/twin/recorder.h"

namespace gapscope::twin {

// What one log may reach; an amplitude is the largest that keeps all of them.
struct Envelope {
  double angle1_rad, angle2_rad, speed1_rad_per_s, command, torque_n_m;
};
// Beyond these a log is not one that anybody would have kept.
Envelope Tolerable(Rig rig);

struct Peaks {
  double angle1_rad = 0, angle2_rad = 0, speed1_rad_per_s = 0, command = 0, torque_n_m = 0;
  bool Within(const Envelope& envelope) const;
};
Peaks PeaksOf(const Plant& plant, const LogSpec& log);

// The shapes that make sense on a rig, with a weak loop and without.
struct LogStyle {
  Shape shape = Shape::kChirp;
  bool loop = false, as_reference = false;
  double low_hz = 0.2, high_hz = 5;
  Envelope envelope{};
};

Sensor DrawSensor(Random* random);  // all but its resolution
Sensors DrawSensors(Rig rig, Random* random);
// Base parameters within their spread.
Base DrawBase(Rig rig, Random* random);
// A log in a given style, its amplitude scaled on `plant`.
LogSpec MakeLog(const Plant& plant, const LogStyle& style, double duration_s, double rate_hz, Random* random);
// 3 to 6 logs of several styles; `loop_always` for plants that would drift away.
std::vector<LogSpec> DrawCampaign(const Plant& plant, bool loop_always, Random* random);
// Weak loop on, or amplitude down, until `plant` stays tolerable in the log. False when nothing helps.
bool Tame(const Plant& plant, LogSpec* log, Random* random);
WeakLoop DrawLoop(Rig rig, Random* random);
Envelope DrawEnvelope(Rig rig, Random* random);

Motion MotionOf(const Plant& plant, const std::vector<LogSpec>& logs);

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_CAMPAIGN_H_
