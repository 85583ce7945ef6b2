// One log: a plant under an excitation (and, on drives without a position servo, possibly a weak position loop) seen
// through encoders with offset, coloured noise and quantisation. Row k holds the measurement at time k and the command
// sent at time k.
#ifndef GAPSCOPE_TESTS_TWIN_RECORDER_H_
#define GAPSCOPE_TESTS_TWIN_RECORDER_H_

#include <array>
#include <string>
#include <vector>

#include "tests/twin/excitation.h"
#include "tests/twin/plant.h"
#include "tests/twin/random.h"
#include "tests/twin/simulator.h"

namespace gapscope::twin {

struct Sensor {
  double resolution_rad = 0;
  double offset_rad = 0;
  double white_rad = 0;
  double coloured_rad = 0, colour_time_s = 0.02;  // AR(1)
  // Standard deviation of one reading about the offset.
  double Floor() const;
};

// Readings of one encoder, in order.
class Encoder {
 public:
  Encoder(const Sensor& sensor, double period_s, bool noise, Random* random);
  double Read(double angle_rad);

 private:
  Sensor sensor_;
  bool noise_;
  Random* random_;
  double keep_, colour_ = 0;
};
double Rounded(double value, double quantum);  // 0: as it is

// How late a command acts whose jitter, a standard normal draw, is that.
double Late(const Drive& drive, double jitter);

struct Sensors {
  std::array<Sensor, 2> angle;
  double speed_noise_rad_per_s = 0.02;
  double torque_noise_n_m = 0.2, torque_offset_n_m = 0;
  double current_noise_a = 0.005, current_offset_a = 0;
};

// u = excitation + kp (reference - angle) - kd speed, from the encoder's reading.
struct WeakLoop {
  double kp_per_rad = 0, kd_per_rad_per_s = 0;
  bool On() const { return kp_per_rad > 0; }
};

struct LogSpec {
  Excitation excitation;
  double amplitude = 0;       // rad (joint; reference), V or A
  bool as_reference = false;  // the excitation is the weak loop's reference
  Excitation feedforward;     // joint
  double feedforward_n_m = 0;
  WeakLoop loop;
  double command_limit = kNever;
  double rate_hz = 500;
  std::array<double, 4> start = {0, 0, 0, 0};  // q1, w1, q2, w2
  double dropped_share = 0;
  double session_s = 0;    // when the log began: what drifts goes on from log to log
  std::uint64_t seed = 0;  // noise, jitter, dropped rows
  bool speed_column = false, torque_column = false, feedforward_column = false, current_column = false;
};

struct Record {
  // As logged.
  std::vector<std::string> names;
  std::vector<std::vector<double>> rows;
  // What a replay needs: stamps and commands of the logged rows, and the standard normal jitter of each.
  std::vector<double> time_s, command, feedforward_n_m, jitter;
  // The angles at each logged row, sensor effects included, noise and offset not.
  std::vector<std::array<double, 2>> angle_rad;
  std::vector<DriveOutput> drive;
  std::vector<std::array<double, 4>> motion;  // q1, w1, q2, w2 of the plant itself
  // The plant at the beginning of every window, when asked for, its clock at the row's stamp.
  std::vector<Simulator> snapshots;
  std::vector<std::size_t> snapshot_rows;
};

struct RecordOptions {
  double step_s = 5e-5;
  bool noise = true;
  double snapshot_every_s = 0;  // 0: none
};

Record MakeRecord(const Plant& plant, const LogSpec& log, const Sensors& sensors, const RecordOptions& options);

// The record's commands as `plant` receives them.
Commands Received(const Record& record, const Plant& plant);

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_RECORDER_H_
