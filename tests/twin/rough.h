// Roughness: a smooth torque of one joint's angle and speed, drawn at random, which no law of the catalogue holds.
//
//   tau = scale (sum_i A_i sin(a_i x + b_i v + phase_i) - sum_k c_k law_k(q, w)),   x = (q - mean) / sd, v = w / sd w
//
// with a ~ N(0, 1.6), b ~ N(0, 1.1). The c_k are the least-squares combination of the laws (constant, linear in angle,
// sine and cosine of the angle, smooth sign of speed, speed, speed |speed|) over the plant's own motion: what is left
// has no part in their span. A draw of which another law (LargestHold) alone holds half is drawn again.
#ifndef GAPSCOPE_TESTS_TWIN_ROUGH_H_
#define GAPSCOPE_TESTS_TWIN_ROUGH_H_

#include <array>
#include <string>
#include <vector>

#include "tests/twin/plant.h"
#include "tests/twin/random.h"
#include "tests/twin/recorder.h"

namespace gapscope::twin {

// The waves at the angle that they see, seconds since the session's begin, before `scale_n_m`.
double Waves(const Rough& rough, double seen_rad, double speed_rad_per_s, double session_s);
// The part of the waves that the catalogue's laws hold.
double Held(const Rough& rough, double angle_rad, double speed_rad_per_s);
// The angle seen through the play, `angle_rad` being the joint's and `before_rad` what was seen until now.
double Remembered(const Rough& rough, double before_rad, double angle_rad);

// The torque on a joint that moves so, `before_rad` being what was seen of its angle until now.
struct AngleAndSpeed {
  double angle_rad, speed_rad_per_s;
};
double RoughTorque(const Rough& rough, double before_rad, const AngleAndSpeed& now, double session_s);

// One joint over all logs of a plant; `begins` are the indices at which logs begin.
struct JointMotion {
  std::vector<double> session_s, angle_rad, speed_rad_per_s;
  std::vector<double> drive_n_m;  // empty on the second joint
  std::vector<std::size_t> begins;
};
std::array<JointMotion, 2> JointMotions(const Plant& plant, const std::vector<LogSpec>& logs);

// Waves less what the laws hold, along the motion.
std::vector<double> Along(const Rough& rough, const JointMotion& motion);
double RootMeanSquare(const std::vector<double>& values);

// Sets `laws` to the least-squares combination over the motion.
void TakeOutLaws(const JointMotion& motion, Rough* rough);

// The largest share of the torque's square over the motion that one other law of the catalogue holds, and which.
struct Hold {
  std::string law;
  double share = 0;
};
Hold LargestHold(const Rough& rough, const JointMotion& motion);

// How a roughness came about: which of angle and speed, memory, drift.
enum class RoughKind { kAngle, kSpeed, kBoth };
const char* RoughKindName(RoughKind kind);
RoughKind KindOf(const Rough& rough);

// A wave of a kind with unit amplitude, neither drifting nor remembering.
RoughTerm DrawTerm(RoughKind kind, Random* random);
// A torque with its laws taken out, scaled so that the root mean square over the motion is `rms_n_m`.
Rough DrawRough(const JointMotion& motion, double rms_n_m, Random* random);

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_ROUGH_H_
