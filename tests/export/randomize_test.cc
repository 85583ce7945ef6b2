// Draws and ranges of a tuned model, against the normal distribution that they are of.
#include "src/export/randomize.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "src/core/statistics.h"
#include "src/export/target.h"
#include "src/fit/covariance.h"
#include "tests/model/synthetic.h"

namespace gapscope::testing {
namespace {

// The Qube's arm with dry friction and a late command: two numbers of the MJCF, and one that MJX has no place for.
class RandomizeTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto base = MakeModel(ShippedExperiment("qube"));
    const auto uses = ParseEffects({"coulomb_friction@arm", "command_delay@motor"}, *base->rig());
    model_ = MakeModel(ShippedExperiment("qube"), uses.value());
    values_ = ValuesWith(*model_, {{"arm.damping", kDamping},
                                   {"coulomb_friction@arm.friction_n_m", kFriction},
                                   {"command_delay@motor.delay_s", 0.01}});
    const auto add = [&](const std::string& name, bool logarithmic, bool together) {
      uncertain_.parameters.push_back({model_->IndexOf(name), logarithmic, together});
    };
    add("arm.damping", true, true);
    add("coulomb_friction@arm.friction_n_m", false, true);
    add("command_delay@motor.delay_s", false, false);
    uncertain_.covariance = Eigen::Matrix3d{{kLog * kLog, kRho * kLog * kOfFriction, 0},
                                            {kRho * kLog * kOfFriction, kOfFriction * kOfFriction, 0},
                                            {0, 0, 1e-6}};
  }
  Result<Randomization> Draw(std::size_t draws, std::uint64_t seed, const std::string& target = "mjx") const {
    return Randomize(
        *model_, values_, uncertain_,
        [&](std::span<const double> values) { return model_->ExportNative(values, nullptr, TargetOf(target).has); },
        draws, seed);
  }
  // Column of the drawn parameters.
  static std::vector<double> Drawn(const Randomization& r, std::size_t parameter) {
    std::vector<double> column;
    for (std::size_t i = parameter; i < r.drawn.size(); i += r.ranges.size()) column.push_back(r.drawn[i]);
    return column;
  }
  static const DrawnField* Find(const Randomization& r, const std::string& name) {
    const auto found = std::ranges::find(r.fields, name, &DrawnField::name);
    return found == r.fields.end() ? nullptr : &*found;
  }

  static constexpr double kDamping = 1e-5, kFriction = 1e-3, kLog = 0.2, kOfFriction = 1e-4, kRho = -0.98;
  std::shared_ptr<const Model> model_;
  std::vector<double> values_;
  UncertainParameters uncertain_;
};

TEST_F(RandomizeTest, RangesHoldWithTheOthersAsTheyAre) {
  const auto drawn = Draw(1, 0);
  ASSERT_TRUE(drawn.ok()) << drawn.error().Text();
  const std::vector<ParameterRange>& ranges = drawn.value().ranges;
  const double left = kNormalQuantile * std::sqrt(1 - kRho * kRho);
  EXPECT_NEAR(ranges[0].low, kDamping * std::exp(-left * kLog), 1e-9 * kDamping);
  EXPECT_NEAR(ranges[0].high, kDamping * std::exp(left * kLog), 1e-9 * kDamping);
  EXPECT_NEAR(ranges[1].high, kFriction + left * kOfFriction, 1e-9 * kFriction);
  EXPECT_TRUE(ranges[0].conditional && ranges[1].conditional);
  EXPECT_FALSE(ranges[2].conditional);
  EXPECT_NEAR(ranges[2].low, 0.01 - 1e-3 * kNormalQuantile, 1e-9);
}

TEST_F(RandomizeTest, NumbersOfTheMjcfAreTold) {
  const auto mjx = Draw(1, 0), native = Draw(1, 0, "mujoco_native");
  ASSERT_TRUE(mjx.ok() && native.ok());
  const auto& ranges = mjx.value().ranges;
  ASSERT_EQ(ranges[0].numbers.size(), 1u);
  EXPECT_EQ(ranges[0].numbers[0].field, "dof_damping");
  EXPECT_EQ(ranges[0].numbers[0].row, 0u);
  EXPECT_DOUBLE_EQ(ranges[0].numbers[0].high, ranges[0].high);
  ASSERT_EQ(ranges[1].numbers.size(), 1u);
  EXPECT_EQ(ranges[1].numbers[0].field, "dof_frictionloss");
  EXPECT_TRUE(ranges[2].numbers.empty()) << "MJX's actuators have no delay";
  ASSERT_EQ(native.value().ranges[2].numbers.size(), 1u);
  EXPECT_EQ(native.value().ranges[2].numbers[0].field, "actuator_delay");
}

TEST_F(RandomizeTest, DrawsVaryTogether) {
  constexpr std::size_t kDraws = 500;
  const auto drawn = Draw(kDraws, 3);
  ASSERT_TRUE(drawn.ok());
  const std::vector<double> damping = Drawn(drawn.value(), 0), friction = Drawn(drawn.value(), 1);
  std::vector<double> logs;
  for (const double value : damping) logs.push_back(std::log(value / kDamping));
  const Moments of_logs = MomentsOf(logs), of_friction = MomentsOf(friction);
  constexpr double kSampling = 0.13;  // relative: 4 standard errors of a deviation from 500 draws
  EXPECT_NEAR(of_logs.deviation, kLog, kSampling * kLog);
  EXPECT_NEAR(of_friction.deviation, kOfFriction, kSampling * kOfFriction);
  double product = 0;
  for (std::size_t i = 0; i < kDraws; ++i) product += logs[i] * (friction[i] - kFriction) / kDraws;
  EXPECT_NEAR(product / (kLog * kOfFriction), kRho, kSampling);
  // The arrays are those of the drawn parameters.
  const DrawnField* field = Find(drawn.value(), "dof_damping");
  ASSERT_NE(field, nullptr);
  ASSERT_EQ(field->shape, (std::vector<std::size_t>{kDraws, 2}));
  for (std::size_t i = 0; i < kDraws; ++i) ASSERT_DOUBLE_EQ(field->values[2 * i], damping[i]);
  EXPECT_EQ(Find(drawn.value(), "body_mass"), nullptr) << "no mass varies";
}

TEST_F(RandomizeTest, DrawsOfIntervalsAreUniformAndStayTogether) {
  constexpr std::size_t kDraws = 500;
  uncertain_.from = DrawsFrom::kInterval;
  const auto drawn = Draw(kDraws, 3);
  ASSERT_TRUE(drawn.ok());
  const std::vector<double> damping = Drawn(drawn.value(), 0), friction = Drawn(drawn.value(), 1);
  const double half = kNormalQuantile * kOfFriction;
  std::size_t inner = 0;
  double unlike = 0;
  for (std::size_t i = 0; i < kDraws; ++i) {
    const double of_friction = (friction[i] - kFriction) / half,
                 of_damping = std::log(damping[i] / kDamping) / (kNormalQuantile * kLog);
    ASSERT_LE(std::abs(of_friction), 1);
    ASSERT_LE(std::abs(of_damping), 1);
    inner += std::abs(of_friction) < 0.5;
    unlike += std::pow(of_friction + of_damping, 2) / kDraws;
  }
  constexpr double kSampling = 0.09;  // 4 standard errors of a share of a half
  EXPECT_NEAR(static_cast<double>(inner) / kDraws, 0.5, kSampling);
  // Two uniform numbers whose ranks are as those of normal ones with correlation rho have 6 / pi asin(rho / 2).
  const double rho = 6 / std::numbers::pi * std::asin(kRho / 2);
  EXPECT_NEAR(unlike, 2.0 / 3 * (1 + rho), 0.2 * 2.0 / 3 * (1 + rho));
}

TEST_F(RandomizeTest, DrawsOfFitsAreTheFitsInTurn) {
  uncertain_.from = DrawsFrom::kFits;
  uncertain_.fits = Eigen::MatrixXd{{-0.1, 0.3}, {2e-5, -4e-5}, {0.001, -0.002}};
  const auto drawn = Draw(3, 3);
  ASSERT_TRUE(drawn.ok());
  for (std::size_t d = 0; d < 3; ++d) {
    const auto fit = static_cast<Eigen::Index>(d % 2);
    EXPECT_NEAR(Drawn(drawn.value(), 0)[d], kDamping * std::exp(uncertain_.fits(0, fit)), 1e-12 * kDamping);
    EXPECT_NEAR(Drawn(drawn.value(), 1)[d], kFriction + uncertain_.fits(1, fit), 1e-12 * kFriction);
    EXPECT_NEAR(Drawn(drawn.value(), 2)[d], 0.01 + uncertain_.fits(2, fit), 1e-12);
  }
}

TEST_F(RandomizeTest, TheSeedMakesTheDraws) {
  const auto first = Draw(5, 7), again = Draw(5, 7), other = Draw(5, 8);
  ASSERT_TRUE(first.ok() && again.ok() && other.ok());
  EXPECT_EQ(first.value().drawn, again.value().drawn);
  EXPECT_NE(first.value().drawn, other.value().drawn);
}

TEST_F(RandomizeTest, DrawsKeepToTheBounds) {
  uncertain_.covariance(2, 2) = 1;  // a second, where 0 .. 0.08 s is allowed
  const auto drawn = Draw(100, 1);
  ASSERT_TRUE(drawn.ok());
  for (const double delay : Drawn(drawn.value(), 2)) {
    EXPECT_GE(delay, 0);
    EXPECT_LE(delay, model_->parameters()[static_cast<std::size_t>(uncertain_.parameters[2].index)].high);
  }
}

TEST_F(RandomizeTest, ATorqueAboveThatOfASmallRigIsDrawnAsWell) {
  constexpr double kLarge = 30, kDeviation = 1;
  const auto index = static_cast<std::size_t>(uncertain_.parameters[1].index);
  ASSERT_LT(model_->parameters()[index].high, kLarge) << "the bound of a rig of one N m";
  values_[index] = kLarge;
  uncertain_.parameters = {{static_cast<int>(index), false, false}};
  uncertain_.covariance = Eigen::MatrixXd::Constant(1, 1, kDeviation * kDeviation);
  const auto drawn = Draw(200, 1);
  ASSERT_TRUE(drawn.ok()) << drawn.error().Text();
  EXPECT_NEAR(drawn.value().ranges[0].high, kLarge + kNormalQuantile * kDeviation, 1e-9);
  const Moments moments = MomentsOf(Drawn(drawn.value(), 0));
  EXPECT_NEAR(moments.mean, kLarge, 0.3);
  EXPECT_NEAR(moments.deviation, kDeviation, 0.2);
}

}  // namespace
}  // namespace gapscope::testing
