// Logs: columns, rows, noise, delays, repeatability.
#include "tests/twin/recorder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tests/twin/output.h"
#include "tests/twin/plants.h"

namespace gapscope::twin {
namespace {

LogSpec Chirp(double duration_s = 1) {
  LogSpec log;
  Random random(1, 0, "test");
  log.excitation = MakeExcitation(Shape::kChirp, duration_s, 0.5, 5, &random);
  log.amplitude = 0.1;
  log.rate_hz = 500;
  log.seed = 11;
  return log;
}

Sensors Noisy() {
  Sensors sensors;
  for (Sensor& s : sensors.angle) s = {1.5e-3, 4e-3, 3e-4, 4e-4, 0.02};
  return sensors;
}

TEST(RecorderTest, ColumnsAreTheContracts) {
  LogSpec log = Chirp(0.1);
  const auto names = [&](Rig rig) { return MakeRecord(NominalPlant(rig), log, Sensors{}, {}).names; };
  using Names = std::vector<std::string>;
  EXPECT_EQ(names(Rig::kJoint), (Names{"time_s", "target_rad", "position_rad"}));
  EXPECT_EQ(names(Rig::kQube), (Names{"time_s", "voltage_v", "arm_rad", "pendulum_rad"}));
  EXPECT_EQ(names(Rig::kFlexJoint), (Names{"time_s", "voltage_v", "base_rad", "link_rad"}));
  EXPECT_EQ(names(Rig::kFlexLink), (Names{"time_s", "current_a", "hub_rad", "deflection_rad"}));
  log.speed_column = log.torque_column = log.feedforward_column = log.current_column = true;
  EXPECT_EQ(names(Rig::kJoint),
            (Names{"time_s", "target_rad", "position_rad", "velocity_rad_per_s", "torque_n_m", "feedforward_n_m"}));
  EXPECT_EQ(names(Rig::kQube).back(), "current_a");
}

TEST(RecorderTest, RowHoldsMeasurementAndCommandOfItsTime) {
  LogSpec log = Chirp(0.1);
  log.excitation.shape = Shape::kConstant;
  const Record record = MakeRecord(NominalPlant(Rig::kFlexLink), log, Sensors{}, {5e-5, false, 0});
  EXPECT_EQ(record.rows.size(), 51u);
  EXPECT_EQ(record.rows[0][1], 0.1);
  EXPECT_EQ(record.rows[0][2], 0);  // what the command does is seen one row later
  EXPECT_GT(record.rows[1][2], 0);
  EXPECT_NEAR(record.rows[50][0], 0.1, 1e-12);
}

TEST(RecorderTest, SameSeedSameBytesOtherSeedOtherNoise) {
  LogSpec log = Chirp();
  const auto text = [&] { return CsvText(MakeRecord(NominalPlant(Rig::kQube), log, Noisy(), {})); };
  const std::string first = text();
  EXPECT_EQ(first, text());
  log.seed = 12;
  EXPECT_NE(first, text());
}

TEST(RecorderTest, NoiseHasItsFloor) {
  LogSpec log = Chirp(10);
  log.excitation.shape = Shape::kZero;
  log.start = {0.1234, 0, 0, 0};
  Plant still = Free(Rig::kFlexJoint);
  Sensors sensors = Noisy();
  sensors.angle[0].resolution_rad = 2e-4;
  const Record record = MakeRecord(still, log, sensors, {1e-3, true, 0});
  double sum = 0, squares = 0;
  for (const auto& row : record.rows) {
    const double error = row[2] - 0.1234 - sensors.angle[0].offset_rad;
    sum += error;
    squares += error * error;
  }
  const double n = static_cast<double>(record.rows.size());
  EXPECT_NEAR(std::sqrt(squares / n), sensors.angle[0].Floor(), 0.1 * sensors.angle[0].Floor());
  EXPECT_LT(std::abs(sum / n), 1e-4);
}

TEST(RecorderTest, ReadingsAreWholeCounts) {
  const Record record = MakeRecord(NominalPlant(Rig::kQube), Chirp(), Noisy(), {});
  std::set<double> levels;
  for (const auto& row : record.rows) {
    const double counts = row[3] / 1.5e-3;
    ASSERT_NEAR(counts, std::round(counts), 1e-9);
    levels.insert(row[3]);
  }
  EXPECT_GT(levels.size(), 3u);
}

TEST(RecorderTest, SensorDelayShiftsOneColumnOnly) {
  const LogSpec log = Chirp();
  Plant plant = NominalPlant(Rig::kFlexJoint);
  const Record prompt = MakeRecord(plant, log, Sensors{}, {5e-5, false, 0});
  plant.sensor_delay_s[1] = 0.006;  // three rows
  const Record late = MakeRecord(plant, log, Sensors{}, {5e-5, false, 0});
  for (std::size_t k = 3; k < prompt.rows.size(); ++k) {
    ASSERT_EQ(late.rows[k][2], prompt.rows[k][2]);
    ASSERT_NEAR(late.rows[k][3], prompt.rows[k - 3][3], 1e-12);
  }
}

TEST(RecorderTest, JointSensorDelayEqualsCommandDelayInPosition) {
  const LogSpec log = Chirp();
  Plant sensor = NominalPlant(Rig::kJoint), command = NominalPlant(Rig::kJoint);
  sensor.sensor_delay_s[0] = command.drive.command_delay_s = 0.008;
  const Record a = MakeRecord(sensor, log, Sensors{}, {5e-5, false, 0});
  const Record b = MakeRecord(command, log, Sensors{}, {5e-5, false, 0});
  for (std::size_t k = 0; k < a.rows.size(); ++k) ASSERT_NEAR(a.rows[k][2], b.rows[k][2], 1e-9);
}

TEST(RecorderTest, MissedTickKeepsTheOldCommand) {
  LogSpec log = Chirp();
  log.dropped_share = 0.1;
  const Plant plant = NominalPlant(Rig::kFlexLink);
  const Record record = MakeRecord(plant, log, Sensors{}, {5e-5, false, 0});
  EXPECT_LT(record.rows.size(), 480u);
  EXPECT_GT(record.rows.size(), 420u);
  // A replay of the logged rows, each command held until the next row, meets the log.
  Simulator replay(plant, 5e-5);
  const Commands commands = Received(record, plant);
  for (std::size_t k = 0; k < record.time_s.size(); ++k) {
    while (replay.time_s() + 2.5e-5 < record.time_s[k]) replay.Step(commands);
    ASSERT_NEAR(replay.q1(), record.rows[k][2], 1e-12);
  }
}

TEST(RecorderTest, DelayMayVaryALittleFromCommandToCommand) {
  LogSpec log = Chirp();
  Plant plant = NominalPlant(Rig::kFlexLink);
  plant.drive.command_delay_s = 0.01;
  plant.drive.jitter = 0.05;
  const Record record = MakeRecord(plant, log, Sensors{}, {});
  const Commands commands = Received(record, plant);
  double low = 1, high = 0;
  for (const double late : commands.delay_s) {
    low = std::min(low, late);
    high = std::max(high, late);
  }
  EXPECT_GT(low, 0.005);
  EXPECT_LT(low, 0.0095);
  EXPECT_GT(high, 0.0105);
}

TEST(RecorderTest, WeakLoopHoldsTheArmAndLogsWhatItSent) {
  LogSpec log = Chirp(4);
  log.excitation.shape = Shape::kSteps;
  Random random(4, 0, "steps");
  log.excitation = MakeExcitation(Shape::kSteps, 4, 0, 0, &random);
  log.amplitude = 0.8;
  log.as_reference = true;
  log.loop = {4, 0.2};
  log.command_limit = 10;
  Plant plant = NominalPlant(Rig::kQube);
  plant.load.bias_n_m = 5e-4;
  const Record record = MakeRecord(plant, log, Noisy(), {});
  double farthest = 0, most = 0;
  for (const auto& row : record.rows) {
    farthest = std::max(farthest, std::abs(row[2]));
    most = std::max(most, std::abs(row[1]));
  }
  EXPECT_LT(farthest, 2);
  EXPECT_GT(most, 0.5);
  EXPECT_LE(most, 10);
}

}  // namespace
}  // namespace gapscope::twin
