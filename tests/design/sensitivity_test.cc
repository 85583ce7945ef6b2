// What an input shows of a parameter, against the closed form of a cart on a spring.
#include "src/design/sensitivity.h"

#include <gtest/gtest.h>

#include <cmath>

#include "src/core/dense.h"
#include "src/fit/policy.h"
#include "tests/tune/fixture.h"

namespace gapscope::testing {
namespace {

constexpr double kFloor_m = 5e-4, kTolerance = 2e-3;

struct Cart {
  Rig rig = LoadCart();
  std::vector<double> command, position;
  explicit Cart(double amplitude) {
    for (int k = 0; k < 1000; ++k) command.push_back(amplitude * std::sin(2e-5 * k * k));
    position = CartMotion(1.5, 0, 0, command);
  }
  Recording Log() const { return MakeRecording(rig, command, position, kCartStep_s); }
  Hypothesis With(double gain) const {
    return {.name = "cart", .model = rig.model, .values = rig.Values({{"cart.gain", gain}})};
  }
  // Of the gain, with the position's zero and the command's shift as nuisances: rows are floors, 2.5 of them count
  // once.
  double Deviation() const {
    const double rows_per_reading = kNoiseCorrelation_s / kCartStep_s, half_sample_s = 0.5 * kCartStep_s;
    const std::vector<double> unit = CartMotion(1, 0, 0, command);
    Eigen::MatrixXd jacobian(static_cast<Eigen::Index>(unit.size()) - 1, 3);
    for (Eigen::Index k = 0; k < jacobian.rows(); ++k) {
      const auto row = static_cast<std::size_t>(k) + 1;
      const double speed = (position[row] - position[row - 1]) / kCartStep_s;
      jacobian.row(k) << unit[row], 1, -speed;
    }
    Eigen::MatrixXd information = jacobian.transpose() * jacobian / (kFloor_m * kFloor_m * rows_per_reading);
    information.diagonal() += Eigen::Vector3d(std::pow(1.0 / 20, 2), std::pow(1 / kFitPolicy.known_offset_rad, 2),
                                              std::pow(1 / half_sample_s, 2));
    return std::sqrt(Inverse(information)(0, 0));
  }
};

TEST(ForetoldFitTest, DeviationIsTheCartsClosedForm) {
  for (const double amplitude : {0.01, 1.0}) {
    const Cart cart(amplitude);
    ForetoldFit fit(cart.With(1.5), {cart.Log(), {kFloor_m}});
    const Coordinate& gain = fit.problem().space().coordinates().front();
    ASSERT_EQ(fit.Deviations({0}).size(), 1u);
    EXPECT_NEAR(fit.Deviations({0})[0] * gain.scale / cart.Deviation(), 1, kTolerance) << amplitude;
  }
}

// What an input does not show is known to lie within its bounds, and nothing else.
TEST(ForetoldFitTest, WhatStandsStillIsKnownByItsBounds) {
  const Cart cart(0);
  ForetoldFit fit(cart.With(1.5), {cart.Log(), {kFloor_m}});
  const Coordinate& gain = fit.problem().space().coordinates().front();
  EXPECT_NEAR(fit.Deviations({0})[0], gain.high - gain.low, kTolerance * (gain.high - gain.low));
}

// The cart is linear in its gain: a cart of another gain imitates it with one Jacobian, where what is known beforehand
// is little beside the log; a start beyond the bounds is a start. A few hundred floors of motion have 1e-10 of
// themselves from Runge-Kutta's steps.
TEST(ForetoldFitTest, AnotherGainIsImitated) {
  const Cart cart(1);
  const std::vector<double> floors = {kFloor_m};
  EXPECT_LT(ForetoldFit(cart.With(1.5), {cart.Log(), floors}).Misfit(1), 1e-7);
  const Hypothesis other = cart.With(12);
  const std::vector<double> far = CartMotion(12 - 1.5, 0, 0, cart.command);
  double square = 0;
  for (std::size_t k = 1; k < far.size(); ++k) square += far[k] * far[k] / (kFloor_m * kFloor_m);
  const double before = std::sqrt(square / static_cast<double>(far.size() - 1));
  EXPECT_NEAR(ForetoldFit(other, {cart.Log(), floors}).Misfit(0) / before, 1, 1e-6);
  EXPECT_LT(ForetoldFit(other, {cart.Log(), floors}).Misfit(2), 1e-3 * before);
}

TEST(FloorTest, OfEachKindOfSignal) {
  EXPECT_DOUBLE_EQ(FloorOf({.kind = SignalKind::kPosition, .resolution = 0}, {}), 5e-4);
  EXPECT_DOUBLE_EQ(FloorOf({.kind = SignalKind::kPosition, .resolution = 0.012}, {}),
                   std::hypot(5e-4, 0.012 / std::sqrt(12)));
  EXPECT_DOUBLE_EQ(FloorOf({.kind = SignalKind::kVelocity, .resolution = 0}, {}), 0.02);
  EXPECT_DOUBLE_EQ(FloorOf({.kind = SignalKind::kTorque, .resolution = 0}, {0.5, -3, NAN}), 0.03);
}

}  // namespace
}  // namespace gapscope::testing
