// Which of the effects that were tried stands for the logs.
#include "src/diagnose/explore.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "src/diagnose/rules.h"
#include "tests/tune/fixture.h"

namespace gapscope {
namespace {

std::unique_ptr<Candidate> WithBlocks(const char* effect, std::size_t parameters, std::vector<double> blocks) {
  // What effects are to each other depends on where they act.
  static const std::shared_ptr<const Model> model = testing::LoadRig("joint").model;
  auto candidate = std::make_unique<Candidate>();
  candidate->model = model;
  if (*effect) candidate->effects = {{effect, "joint"}};
  candidate->parameters = parameters;
  candidate->block_floor = 1;
  candidate->held_out_floors =
      std::sqrt(std::accumulate(blocks.begin(), blocks.end(), 0.0) / static_cast<double>(blocks.size()));
  candidate->train_blocks = candidate->held_out_blocks = std::move(blocks);
  return candidate;
}

// A stick that few blocks show: without it, twice as much is left, at 2.98 standard errors.
TEST(ExploreTest, WhatLeavesTwiceAsMuchIsNoSimplerExplanation) {
  std::vector<double> without_stick(40, 1.0);
  std::fill_n(without_stick.begin(), 4, 12.0);
  const auto parent = WithBlocks("", 0, std::vector<double>(40, 100.0));
  Layer layer;
  layer.children.push_back(WithBlocks("stribeck_friction", 3, std::vector<double>(40, 1.0)));
  layer.children.push_back(WithBlocks("direction_asymmetry", 2, without_stick));
  layer.children.push_back(WithBlocks("coulomb_friction", 1, without_stick));
  EXPECT_EQ(Simplest(layer, *parent, kFirst)->effects.front().effect, "stribeck_friction");
}

TEST(ExploreTest, TheSimplerOfTwoThatDoAsWellIsTaken) {
  const auto parent = WithBlocks("", 0, std::vector<double>(40, 100.0));
  Layer layer;
  layer.children.push_back(WithBlocks("stribeck_friction", 3, std::vector<double>(40, 1.0)));
  layer.children.push_back(WithBlocks("coulomb_friction", 1, std::vector<double>(40, 1.005)));
  EXPECT_EQ(Simplest(layer, *parent, kFirst)->effects.front().effect, "coulomb_friction");
}

// What a model at the noise leaves has its own colour, which some effect always imitates a little.
TEST(ExploreTest, BesideAModelAtTheNoiseAFewPercentAreNoEffect) {
  const auto base = WithBlocks("", 0, std::vector<double>(40, 0.86)),
             better = WithBlocks("joint_compliance", 3, std::vector<double>(40, 0.77));
  base->held_out_floors = 1.1;
  EXPECT_TRUE(Convincing(Compare(*base, *better), FirstLimits(*base)));
  base->held_out_floors = 0.93;
  EXPECT_FALSE(Convincing(Compare(*base, *better), FirstLimits(*base)));
}

}  // namespace
}  // namespace gapscope
