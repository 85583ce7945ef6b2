// What a fit promises: known parameters come back, what cannot be known is named, and the held-out data is never looked
// at.
#include "src/tune/tune.h"

#include <gtest/gtest.h>

#include <cmath>

#include "src/model/parameter_writer.h"
#include "src/report/tune_report.h"
#include "tests/tune/fixture.h"

namespace gapscope::testing {
namespace {

Recording QubeLog(const Rig& rig, const std::vector<double>& values, int k, double duration_s = 3) {
  const auto command = [k](double t) { return (1.2 + 0.2 * k) * std::sin((4 + k) * t + 1.5 * t * t); };
  Recording log = MakeLog(rig, values, command, duration_s, 0.004, 1e-3, static_cast<unsigned long>(10 + k));
  log.log_path = "log" + std::to_string(k);
  return log;
}

const TunedParameter& Of(const TuneSummary& summary, int index) {
  for (const auto& t : summary.tuned) {
    if (t.index == index) return t;
  }
  throw std::logic_error("not tuned");
}

TEST(SplitDataTest, EveryThirdLogIsKept) {
  const Rig rig = LoadCart();
  std::vector<Recording> logs;
  for (int k = 0; k < 7; ++k) {
    logs.push_back(MakeRecording(rig, std::vector<double>(100, 0.0), {}, kCartStep_s));
    logs.back().log_path = std::to_string(k);
  }
  const DataSplit split = SplitData(logs, {});
  ASSERT_EQ(split.held_out.size(), 2u);
  EXPECT_EQ(split.held_out[0].log_path, "1");
  EXPECT_EQ(split.held_out[1].log_path, "4");
  EXPECT_EQ(split.train.size(), 5u);
  const DataSplit two = SplitData({logs[0], logs[1]}, {});
  ASSERT_EQ(two.held_out.size(), 1u);
  EXPECT_EQ(two.held_out[0].log_path, "1");
  const DataSplit asked = SplitData(logs, {0, 6});
  ASSERT_EQ(asked.held_out.size(), 2u);
  EXPECT_EQ(asked.held_out[1].log_path, "6");
  EXPECT_NE(asked.how.find("as asked"), std::string::npos);
}

TEST(SplitDataTest, SingleLogKeepsItsEnd) {
  const Rig rig = LoadCart();
  Recording log = MakeRecording(rig, std::vector<double>(101, 1.0), {}, kCartStep_s);
  for (std::size_t k = 0; k < log.rows(); ++k) log.measured[0].values[k] = static_cast<double>(k);
  const DataSplit split = SplitData({log}, {});
  ASSERT_EQ(split.train.size(), 1u);
  ASSERT_EQ(split.held_out.size(), 1u);
  EXPECT_EQ(split.train[0].rows() + split.held_out[0].rows(), 101u);
  EXPECT_EQ(split.held_out[0].measured[0].values.front(), 70.0);
  EXPECT_EQ(split.held_out[0].time_s.front(), 0.0);
  EXPECT_NEAR(split.held_out[0].duration_s(), 0.3 * log.duration_s(), 2 * kCartStep_s);
}

TEST(TuneTest, KnownParametersComeBackWithinTheirIntervals) {
  const Rig rig = LoadRig("qube");
  const auto truth =
      rig.Values({{"arm.damping", 4e-4}, {"pendulum.damping", 6e-5}, {"pendulum.length", 0.124}, {"arm.mass", 0.105}});
  ThreadPool pool(2);
  TuneOptions options{.starts = 1};
  for (const char* name : {"arm.damping", "pendulum.damping", "pendulum.length", "arm.mass"})
    options.free.push_back(rig.Index(name));
  const auto found =
      Tune(*rig.model, SplitData({QubeLog(rig, truth, 0), QubeLog(rig, truth, 1), QubeLog(rig, truth, 2)}, {}),
           rig.model->Nominal(), options, pool);
  ASSERT_TRUE(found.ok()) << found.error().Text();
  const TuneSummary& summary = found.value();
  EXPECT_EQ(summary.termination, Termination::kConverged);
  EXPECT_TRUE(summary.flat.empty());
  for (const int index : options.free) {
    const TunedParameter& t = Of(summary, index);
    const double true_value = truth[static_cast<std::size_t>(index)];
    EXPECT_TRUE(t.identifiable);
    EXPECT_LE(t.low, t.value);
    EXPECT_GE(t.high, t.value);
    // Five times the interval's half-width: one draw of noise in a test must not depend on luck; coverage is counted by
    // scripts/recovery.
    EXPECT_NEAR(t.value, true_value, 2.5 * (t.high - t.low))
        << rig.model->parameters()[static_cast<std::size_t>(index)].name;
    EXPECT_NEAR(t.value, true_value, 0.1 * true_value) << rig.model->parameters()[static_cast<std::size_t>(index)].name;
  }
  EXPECT_LT(summary.error_held_out, 0.05);
  EXPECT_GT(summary.error_nominal, 2 * summary.error_held_out);
}

TEST(TuneTest, TorqueConstantAndResistanceAreNamedAsFlat) {
  // Angles know kt / R and kt km / R alone, and masses only relative to them: with both constants tied, scaling is
  // open.
  const Rig rig = LoadRig("qube");
  ThreadPool pool(2);
  TuneOptions options{.starts = 1};
  for (const char* name : {"motor.resistance", "motor.kt", "motor.km"}) options.free.push_back(rig.Index(name));
  const auto truth = rig.Values();
  const auto found = Tune(*rig.model, SplitData({QubeLog(rig, truth, 0), QubeLog(rig, truth, 1)}, {}),
                          rig.model->Nominal(), options, pool);
  ASSERT_TRUE(found.ok()) << found.error().Text();
  ASSERT_EQ(found.value().flat.size(), 1u);
  const auto& parts = found.value().flat[0].parts;
  const int kt = rig.Index("motor.kt"), resistance = rig.Index("motor.resistance");
  double weight_kt = 0, weight_resistance = 0;
  for (const auto& [index, weight] : parts) {
    if (index == kt) weight_kt = weight;
    if (index == resistance) weight_resistance = weight;
  }
  // Along the flat direction both grow alike: kt / R stays.
  EXPECT_NEAR(weight_kt, weight_resistance, 0.05);
  const std::string text = FlatText(found.value().flat[0], *rig.model);
  EXPECT_TRUE(text.starts_with("only motor.kt / motor.resistance is known") ||
              text.starts_with("only motor.resistance / motor.kt is known"))
      << text;
  EXPECT_FALSE(Of(found.value(), kt).identifiable);
  EXPECT_FALSE(Of(found.value(), resistance).identifiable);
}

TEST(TuneTest, HeldOutDataIsNeverFitted) {
  const Rig rig = LoadRig("qube");
  const auto truth = rig.Values({{"arm.damping", 4e-4}});
  ThreadPool pool(2);
  TuneOptions options{.free = {rig.Index("arm.damping"), rig.Index("motor.kt")}, .starts = 2};
  const std::vector<Recording> logs = {QubeLog(rig, truth, 0, 2), QubeLog(rig, truth, 1, 2)};
  auto spoilt = logs;
  for (auto& measured : spoilt[1].measured) {
    for (double& y : measured.values) y = 3 * y + 0.5;
  }
  const auto a = Tune(*rig.model, SplitData(logs, {1}), rig.model->Nominal(), options, pool);
  const auto b = Tune(*rig.model, SplitData(spoilt, {1}), rig.model->Nominal(), options, pool);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a.value().values, b.value().values);
  EXPECT_EQ(a.value().stamps.commands_s, b.value().stamps.commands_s);
  EXPECT_EQ(a.value().time_step_s, b.value().time_step_s);
  EXPECT_EQ(a.value().error_train, b.value().error_train);
  EXPECT_GT(b.value().error_held_out, 5 * a.value().error_held_out);
}

TEST(TuneTest, SpentBudgetStillGivesAScoredResult) {
  const Rig rig = LoadRig("qube");
  ThreadPool pool(2);
  TuneOptions options{.starts = 3};
  options.solve.deadline.time = std::chrono::steady_clock::now();
  const auto found = Tune(*rig.model, SplitData({QubeLog(rig, rig.Values({{"arm.damping", 4e-4}}), 0, 2)}, {}),
                          rig.model->Nominal(), options, pool);
  ASSERT_TRUE(found.ok());
  EXPECT_EQ(found.value().termination, Termination::kBudget);
  EXPECT_EQ(found.value().start_costs.size(), 1u);
  EXPECT_TRUE(std::isfinite(found.value().error_held_out));
}

TEST(TuneTest, AnInterruptedFitGivesTheBestSoFar) {
  const Rig rig = LoadRig("qube");
  ThreadPool pool(2);
  std::atomic<bool> stop = false;
  TuneOptions options{.starts = 3};
  options.solve.deadline.stop = &stop;
  options.solve.progress = [&](const Progress&) { stop = true; };
  const auto found = Tune(*rig.model, SplitData({QubeLog(rig, rig.Values({{"arm.damping", 4e-4}}), 0, 2)}, {}),
                          rig.model->Nominal(), options, pool);
  ASSERT_TRUE(found.ok());
  EXPECT_EQ(found.value().termination, Termination::kInterrupted);
  EXPECT_EQ(TerminationText(found.value().termination), "interrupted");
  EXPECT_EQ(found.value().start_costs.size(), 1u);
  EXPECT_NE(found.value().values, rig.model->Nominal());  // the step that was under way was made
  EXPECT_TRUE(std::isfinite(found.value().error_held_out));
}

// A sensor that is slower than the commands: the same parameters come back, and the intervals know that there is less.
TEST(TuneTest, RowsWithoutAValueAreNotFitted) {
  const Rig rig = LoadRig("qube");
  const auto truth = rig.Values({{"arm.damping", 4e-4}});
  ThreadPool pool(2);
  const int damping = rig.Index("arm.damping");
  TuneOptions options{.free = {damping}, .starts = 1};
  std::vector<Recording> logs = {QubeLog(rig, truth, 0, 2), QubeLog(rig, truth, 1, 2)};
  const auto whole = Tune(*rig.model, SplitData(logs, {1}), rig.model->Nominal(), options, pool);
  for (Recording& log : logs) {
    for (auto& measured : log.measured) {
      for (std::size_t row = 0; row < measured.values.size(); ++row) {
        if (row % 3 != 1) measured.values[row] = std::nan("");
      }
    }
  }
  const auto third = Tune(*rig.model, SplitData(logs, {1}), rig.model->Nominal(), options, pool);
  ASSERT_TRUE(whole.ok() && third.ok());
  const TunedParameter a = Of(whole.value(), damping), b = Of(third.value(), damping);
  EXPECT_LT(b.low, 4e-4);
  EXPECT_GT(b.high, 4e-4);
  EXPECT_LT(b.low, a.value);
  EXPECT_GT(b.high, a.value);
  EXPECT_NEAR(third.value().error_held_out, whole.value().error_held_out, 0.3 * whole.value().error_held_out);
}

TEST(TuneTest, NothingFreeIsAnError) {
  const Rig rig = LoadCart(1.5, 1.5 + 1e-9);
  Experiment experiment = rig.experiment;
  for (auto& p : experiment.parameters) p.frozen = true;
  const auto model = Model::Load(experiment).value();
  ThreadPool pool(1);
  const auto found = Tune(*model,
                          SplitData({MakeRecording(rig, std::vector<double>(100, 1.0),
                                                   CartMotion(1, 0, 0, std::vector<double>(100, 1.0)), kCartStep_s)},
                                    {}),
                          model->Nominal(), {}, pool);
  ASSERT_FALSE(found.ok());
  EXPECT_NE(found.error().Text().find("--free"), std::string::npos);
}

// What a hinge about y sees of a body: m x, m z and the inertia about the axis.
std::array<double, 3> SeenByHinge(const Rig& rig, const std::vector<double>& values) {
  const ModelPtr written(mj_copyModel(nullptr, &rig.model->compiled()));
  const DataPtr data(mj_makeData(written.get()));
  EXPECT_TRUE(ParameterWriter(*rig.model, written.get(), data.get()).Write(values, {}));
  const BodyInertia b = InertiaOf(*written, 1);
  return {b.mass_kg * b.centre_m[0], b.mass_kg * b.centre_m[2], DrivenInertia(*written, 0)};
}

class TenNumbersTest : public ::testing::Test {
 protected:
  TenNumbersTest() {
    for (int k = 0; k < 3; ++k) {
      const auto command = [k](double t) { return 1.5 * std::sin((3 + k) * t + 1.2 * t * t); };
      logs_.push_back(MakeLog(rig_, truth_, command, 4, 0.004, 1e-3, static_cast<unsigned long>(k + 1)));
      logs_.back().log_path = "log" + std::to_string(k);
    }
  }
  TuneSummary Tuned(bool fit_offsets) {
    TuneOptions options{.fit_offsets = fit_offsets, .starts = 1};
    for (int i = 0; i < 10; ++i) options.if_known.push_back(i);
    ThreadPool pool(2);
    return Tune(*rig_.model, SplitData(logs_, {}), rig_.model->Nominal(), options, pool).value();
  }
  // `known` of ten numbers are tuned, the rest stays and is named.
  void ExpectKnown(const TuneSummary& summary, std::size_t known) {
    EXPECT_EQ(summary.tuned.size(), known);
    EXPECT_EQ(summary.left_frozen.size(), 10 - known);
    for (const TunedParameter& t : summary.tuned) EXPECT_TRUE(t.identifiable) << t.index;
    for (const int index : summary.left_frozen) EXPECT_EQ(summary.values[static_cast<std::size_t>(index)], 0);
    for (const char* unseen : {"link.d2", "link.s12", "link.s23", "link.t2"})
      EXPECT_NE(std::ranges::find(summary.left_frozen, rig_.Index(unseen)), summary.left_frozen.end()) << unseen;
    EXPECT_NE(ToTable(TuneRunOf(summary, *rig_.model, 0)).find("frozen, for these logs do not know them: link: "),
              std::string::npos);
  }
  static constexpr double kShare = 0.01;  // of the truth, at a noise of 1 mrad
  const Rig rig_ = LoadLink();
  const std::vector<double> truth_ =
      rig_.Values({{"link.alpha", 0.12}, {"link.d3", -0.1}, {"link.t1", 0.03}, {"link.t3", -0.02}, {"link.s12", 0.2}});
  std::vector<Recording> logs_;
};

TEST_F(TenNumbersTest, ThreeSayAllThatAHingeSees) {
  const TuneSummary summary = Tuned(/*fit_offsets=*/false);
  ExpectKnown(summary, 3);
  const auto wanted = SeenByHinge(rig_, truth_), found = SeenByHinge(rig_, summary.values),
             before = SeenByHinge(rig_, rig_.model->Nominal());
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(found[i], wanted[i], kShare * std::abs(wanted[i])) << i;
    EXPECT_GT(std::abs(before[i] - wanted[i]), 5 * kShare * std::abs(wanted[i])) << i;
  }
}

TEST_F(TenNumbersTest, ASensorsUnknownZeroHidesTheDirectionOfTheCentre) {
  const TuneSummary summary = Tuned(/*fit_offsets=*/true);
  ExpectKnown(summary, 2);
  const auto [x, z, inertia] = SeenByHinge(rig_, truth_);
  const auto [found_x, found_z, found_inertia] = SeenByHinge(rig_, summary.values);
  EXPECT_NEAR(std::hypot(found_x, found_z), std::hypot(x, z), kShare * std::hypot(x, z));
  EXPECT_NEAR(found_inertia, inertia, kShare * inertia);
}

TEST(TuneTest, NothingKnownIsSaid) {
  const Rig rig = LoadLink();
  TuneOptions options;
  options.if_known = {rig.Index("link.t2"), rig.Index("link.s23")};
  ThreadPool pool(1);
  const Recording log = MakeLog(rig, rig.model->Nominal(), [](double t) { return std::sin(4 * t); }, 2, 0.004, 1e-3, 1);
  const auto tuned = Tune(*rig.model, SplitData({log}, {}), rig.model->Nominal(), options, pool);
  ASSERT_FALSE(tuned.ok());
  EXPECT_NE(tuned.error().Text().find("these logs know none"), std::string::npos) << tuned.error().Text();
}

}  // namespace
}  // namespace gapscope::testing
