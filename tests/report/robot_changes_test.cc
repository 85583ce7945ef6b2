// Called are the robots that changed, and of the stable ones at most one in a hundred.
#include "src/report/robot_changes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace gapscope {
namespace {

constexpr int kParameters = 6;

// What a day's fit says of a robot: a friction that is `friction` on that day, and other sizes that stay.
class SyntheticRobot {
 public:
  explicit SyntheticRobot(unsigned seed) : random_(seed) {}
  // `wander`: from day to day, over the standard error that each interval states.
  std::vector<UnitResult> Days(int days, double wander, const std::function<double(int)>& friction) {
    std::vector<UnitResult> units;
    for (int day = 0; day < days; ++day) {
      UnitResult unit{.nominal = 0.2 * std::exp(Normal(0.1)), .left = 0.02};
      unit.sizes.push_back(Size("coulomb_friction@arm.friction_n_m", friction(day), 0.1, wander));
      for (int k = 1; k < kParameters; ++k) unit.sizes.push_back(Size("p" + std::to_string(k), k, 0.02 * k, wander));
      units.push_back(std::move(unit));
    }
    return units;
  }

 private:
  double Normal(double deviation) { return std::normal_distribution<>(0, deviation)(random_); }
  UnitResult::Size Size(const std::string& name, double truth, double error, double wander) {
    // Days differ in how much their logs tell.
    const double stated = error * std::exp(Normal(0.3)), value = truth + Normal(stated) + Normal(wander * error);
    return {.name = name, .unit = "N m", .value = value, .low = value - 1.96 * stated, .high = value + 1.96 * stated};
  }
  std::mt19937 random_;
};

int CalledOf(int robots, int days, double wander) {
  int called = 0;
  for (int robot = 0; robot < robots; ++robot) {
    SyntheticRobot stable(static_cast<unsigned>(1000 * days + robot));
    called += !ChangesOf(stable.Days(days, wander, [](int) { return 1.0; })).empty();
  }
  return called;
}

TEST(RobotChanges, StableRobotsAreCalledAtMostOnceInAHundred) {
  // Of 400 at 1 % more than 10 are called once in 300 times; seeds are fixed.
  for (const int days : {6, 12, 30}) {
    for (const double wander : {0.0, 3.0}) EXPECT_LE(CalledOf(400, days, wander), 10) << days << " " << wander;
  }
}

TEST(RobotChanges, AFrictionThatDoublesIsFoundWithinTwoDays) {
  constexpr int kChange = 10;
  int found = 0;
  for (unsigned robot = 0; robot < 50; ++robot) {
    // Two days of the new friction, no more.
    const auto units = SyntheticRobot(robot).Days(kChange + 2, 0.3, [](int day) { return day < kChange ? 1.0 : 2.0; });
    const auto changes = ChangesOf(units);
    if (changes.empty()) continue;
    EXPECT_EQ(changes.front().series, "coulomb_friction@arm.friction_n_m");
    EXPECT_LE(std::abs(static_cast<int>(changes.front().first) - kChange), 2);
    EXPECT_NEAR(changes.front().before, 1, 0.2);
    EXPECT_NEAR(changes.front().after, 2, 0.4);
    ++found;
  }
  EXPECT_GE(found, 45);
}

TEST(RobotChanges, ARepairIsASecondChange) {
  const auto changes =
      ChangesOf(SyntheticRobot(3).Days(30, 0.3, [](int day) { return day >= 10 && day < 20 ? 2.0 : 1.0; }));
  std::vector<std::size_t> days;
  for (const auto& change : changes) days.push_back(change.first);
  std::sort(days.begin(), days.end());
  EXPECT_EQ(days, (std::vector<std::size_t>{10, 20}));
}

TEST(RobotChanges, AnEffectThatAppearsIsAChangeOfItsStatement) {
  std::vector<UnitResult> units(10);
  for (std::size_t day = 0; day < units.size(); ++day) {
    units[day].gap = 1;
    const bool there = day >= 7;
    units[day].statements.push_back({"backlash@joint", there ? "present" : "absent", there ? 0.98 : 0.02});
  }
  units[3].state = "failed";  // as if that day were not there
  const auto changes = ChangesOf(units);
  ASSERT_EQ(changes.size(), 1u);
  EXPECT_EQ(changes[0].series, "backlash@joint");
  EXPECT_EQ(changes[0].first, 7u);
}

TEST(RobotChanges, OneOddDayOrAFewDaysAreNoChange) {
  EXPECT_TRUE(ChangesOf(SyntheticRobot(1).Days(30, 0.3, [](int day) { return day == 12 ? 3.0 : 1.0; })).empty());
  EXPECT_TRUE(ChangesOf(SyntheticRobot(1).Days(5, 0.0, [](int day) { return day < 3 ? 1.0 : 9.0; })).empty());
  EXPECT_TRUE(ChangesOf({}).empty());
}

}  // namespace
}  // namespace gapscope
