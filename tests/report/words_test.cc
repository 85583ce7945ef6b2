// Every verdict's words, as the page shows them.
#include "src/report/words.h"

#include <gtest/gtest.h>

#include <cmath>

#include "src/report/page_content.h"
#include "tests/report/pages.h"

namespace gapscope::testing {
namespace {

std::string Join(const std::vector<std::string>& sentences) {
  std::string text;
  for (const auto& sentence : sentences) text += (text.empty() ? "" : " ") + sentence;
  return text;
}

TEST(WordsTest, NumbersAsPeopleWriteThem) {
  EXPECT_EQ(ShortNumber(0.31249, 3), "0.312");
  EXPECT_EQ(ShortNumber(1234, 3), "1230");
  EXPECT_EQ(ShortNumber(0.0000412, 2), "0.000041");
  EXPECT_EQ(ShortNumber(0.5, 3), "0.5");
  EXPECT_EQ(ShortNumber(0, 3), "0");
  EXPECT_EQ(ShortNumber(-9.996, 3), "-10");
  EXPECT_EQ(ShortNumber(NAN, 3), "–");
  EXPECT_EQ(ShortNumber(INFINITY, 3), "–");
}

TEST(WordsTest, EffectsByTheirNames) {
  EXPECT_EQ(Words(EffectUse{"coulomb_friction", "arm"}), "Coulomb friction on arm");
  EXPECT_EQ(Words(EffectUse{"sensor_delay", "arm_rad"}), "sensor delay on arm_rad");
  EXPECT_EQ(Words(EffectUse{"command_delay", "all"}), "command delay on all drives");
  EXPECT_EQ(Words(EffectUse{"sensor_delay", "all"}), "sensor delay on all measured signals");
  EXPECT_EQ(Words(EffectUse{"stribeck_friction", "arm"}), "Stribeck friction on arm");
  EXPECT_EQ(Words(EffectUse{"of_another_version", "arm"}), "of another version on arm");
  EXPECT_EQ(Words(Explanation{}), "none");
  EXPECT_EQ(Listed({}), "");
  EXPECT_EQ(Listed({"a"}), "a");
  EXPECT_EQ(Listed({"a", "b", "c"}, "or"), "a, b or c");
}

TEST(HeadlineTest, OneTitleForEachVerdict) {
  const std::pair<Verdict, const char*> titles[] = {
      {Verdict::kNone, "Nothing is missing: the model explains these logs down to what the sensors can show."},
      {Verdict::kParameters, "No effect is missing: other parameter values close the gap."},
      {Verdict::kEffects, "The model lacks cable spring on arm and Coulomb friction on arm."},
      {Verdict::kAmbiguous,
       "The model lacks cable spring or gravity offset on arm and Coulomb friction on arm. These logs cannot tell "
       "which, where it says or."},
      {Verdict::kUnknown, "Something is missing that no known effect explains."}};
  for (const auto& [verdict, title] : titles) EXPECT_EQ(HeadlineOf(MadeDiagnosis(verdict)).title, title);
}

TEST(HeadlineTest, ASmallFindingIsNoCompleteOne) {
  for (const Verdict verdict : {Verdict::kEffects, Verdict::kAmbiguous}) {
    DiagnoseRun run = MadeDiagnosis(verdict);
    const std::string title = HeadlineOf(run).title;
    run.diagnosis.remainder = {.explained = 0.02, .systematic = 0.96, .sensors = 0.02};
    EXPECT_EQ(HeadlineOf(run).title, title + " Most of the misfit no known effect explains.");
    run.diagnosis.remainder = {.explained = 0.6, .systematic = 0.38, .sensors = 0.02};
    EXPECT_EQ(HeadlineOf(run).title, title);
  }
}

TEST(HeadlineTest, ADiagnosisSaysHowFarTheErrorGoesDown) {
  const Headline headline = HeadlineOf(MadeDiagnosis(Verdict::kEffects));
  EXPECT_EQ(Join(headline.sentences),
            "Held-out error 1.77 with nominal parameters, 1.2 with the best parameters, 0.01 with what was found. That "
            "closes 100 % of the gap down to the floor of 0.008.");
  EXPECT_EQ(headline.confidence, 0.91);
  std::string stages;
  for (const auto& s : headline.stages) stages += s.name + ": " + ShortNumber(s.error, 3) + " [" + s.change + "]\n";
  EXPECT_EQ(stages,
            "nominal: 1.77 []\n"
            "best parameters: 1.2 [−32 %]\n"
            "with cable spring on arm: 0.3 [−75 %, 80 % of what closes]\n"
            "with Coulomb friction on arm: 0.01 [30 times smaller, 20 % of what closes]\n"
            "floor of the sensors: 0.008 []\n");
  EXPECT_EQ(headline.stages[3].mark, Stage::Mark::kBest);
  EXPECT_EQ(headline.stages[4].mark, Stage::Mark::kFloor);
}

TEST(HeadlineTest, WithoutAGapNothingIsClosed) {
  const Headline headline = HeadlineOf(MadeDiagnosis(Verdict::kNone));
  EXPECT_EQ(headline.sentences.size(), 1u);
  ASSERT_EQ(headline.stages.size(), 3u) << "nominal, best parameters, floor";
}

ReplayRun Replayed(double error) {
  ReplayRun run;
  run.comparison = {.error = error,
                    .logs = {{.log_path = "a.csv",
                              .error = error,
                              .signals = {{.signal = "arm_rad", .nrmse = 0.5 * error},
                                          {.signal = "pendulum_rad", .nrmse = 1.5 * error}}}}};
  run.result.logs.resize(1);
  run.other_error = 0.02;
  return run;
}

TEST(HeadlineTest, AReplaySaysHowWellItFollows) {
  EXPECT_EQ(HeadlineOf(Replayed(0.049)).title, "The model follows the measured motion closely.");
  EXPECT_EQ(HeadlineOf(Replayed(0.05)).title, "The model follows the measured motion.");
  EXPECT_EQ(HeadlineOf(Replayed(0.3)).title, "The model is clearly off the measured motion.");
  EXPECT_EQ(HeadlineOf(Replayed(0.6)).title, "The model hardly follows the measured motion.");
  EXPECT_EQ(Join(HeadlineOf(Replayed(0.3)).sentences),
            "Error 0.3: root mean square of measured less predicted, over the motion's own spread. Largest in "
            "pendulum_rad (0.45). In windows that each start from the log it is 0.02.");
  ReplayRun run = Replayed(0.3);
  run.model.effects = {{"backlash", "joint"}};
  run.nominal_error = 0.6;
  run.result.mode = ReplayMode::kWindows;
  const Headline headline = HeadlineOf(run);
  EXPECT_EQ(headline.title, "The model with backlash on joint is clearly off the measured motion.");
  EXPECT_EQ(headline.sentences.back(), "In one free run over the log it is 0.02.");
  ASSERT_EQ(headline.stages.size(), 2u);
  EXPECT_EQ(headline.stages[1].name, "with backlash on joint");
  EXPECT_EQ(headline.stages[1].change, "−50 %");
  run.result.logs[0].outcome = Outcome::kDiverged;
  run.comparison.error = INFINITY;
  EXPECT_EQ(HeadlineOf(run).title, "The model with backlash on joint runs away.");
}

TEST(HeadlineTest, ATuningThatDoesNotHelpSaysSo) {
  TuneRun run{.starts_agree = false,
              .parameters = {{.name = "a"}, {.name = "b", .identifiable = false}},
              .flat = {{.direction = {}, .text = "b is not known"}, {.direction = {}, .text = "b is not known"}},
              .correlated = {{"a", "b", 0.96}},
              .error_nominal = 0.4,
              .error_train = 0.1,
              .error_held_out = 0.1,
              .held_out_by = "b.csv"};
  const Headline good = HeadlineOf(run);
  EXPECT_EQ(good.title, "Tuning 2 parameters cuts the held-out error by 75 %.");
  EXPECT_EQ(Join(good.sentences),
            "From 0.4 to 0.1 on data that the fit did not see (b.csv); 0.1 on what it saw. 1 of them cannot be known "
            "from these logs alone. The starting points end in different places: a better fit may exist.");
  EXPECT_EQ(good.notes, (std::vector<std::string>{"b is not known", "a and b go together (correlation 0.960)"}));
  for (const double worse : {0.39, 0.5, double(INFINITY)}) {
    run.error_held_out = worse;
    EXPECT_EQ(HeadlineOf(run).title, "Tuning 2 parameters does not help on held-out data.") << worse;
  }
}

TEST(PageContentTest, SaysWhatIsLeftAfterWhatWasFound) {
  const PageContent page = PageOf(MadeDiagnosis(Verdict::kEffects));
  ASSERT_EQ(page.where.size(), 2u);
  EXPECT_EQ(page.where[1].title, "Of what cable spring on arm and Coulomb friction on arm leave");
  EXPECT_EQ(page.where[1].shares[0].condition, "speed 4..9 rad/s");
  EXPECT_EQ(PageOf(MadeDiagnosis(Verdict::kUnknown)).where.size(), 1u);
}

TEST(PageContentTest, StatementsByProbabilityAndTheNextExperiment) {
  DiagnoseRun run = MadeDiagnosis(Verdict::kEffects);
  for (int i = 0; i < 50; ++i)
    run.diagnosis.statements.push_back({.use = {"backlash", "arm"}, .probability = 0.01, .rule = "gains too little"});
  const PageContent page = PageOf(run);
  EXPECT_EQ(page.statements[0].title, "cable spring on arm");
  EXPECT_EQ(page.statements[0].answer, "present");
  EXPECT_EQ(page.statements[2].title, "torque bias on arm");
  EXPECT_EQ(page.statements.size(), 53u);
  EXPECT_EQ(
      page.next_text,
      "These logs do not tell cable spring on arm from gravity offset on arm. With the proposed log beside these, P "
      "would be about 0.90 if it is cable spring on arm, and 0.10 if not.");
  EXPECT_EQ(page.fitted[0].name, "cable_spring@arm.stiffness_n_m_per_rad");
  EXPECT_EQ(page.fitted[0].high, 0.0013);
}

}  // namespace
}  // namespace gapscope::testing
