// What an earlier diagnosis said, read back; and the glossary that a page shows.
#include "src/report/read_diagnosis.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "src/report/diagnose_report.h"
#include "src/report/glossary.h"
#include "src/report/json.h"

namespace gapscope {
namespace {

// A statement that was refitted and one that was not.
nlohmann::ordered_json Written() {
  Diagnosis d;
  Statement friction{.use = {"coulomb_friction", "arm"}, .answer = Answer::kPresent, .probability = 0.8, .group = 2};
  friction.parameters = {{"friction_n_m", "N m", 0.0006, 0.0003, 0.0011}};
  friction.numbers = {.gain = 2, .gain_held_out = 1, .gain_free = NAN, .discrepancy = 50, .clear = 3, .dry = true};
  friction.sets = std::make_shared<const ComparedSets>(
      ComparedSets{.with = {.effects = {friction.use},
                            .values = {{"arm.damping", 0.1}, {"coulomb_friction@arm.friction_n_m", 0.0006}}},
                   .without = {.values = {{"arm.damping", 0.2}}},
                   .blocks = {{"a.csv", 1.5, 2, 0.7}}});
  friction.rivals = {{{"load_friction", "arm"}, 0.4}};
  friction.caveat = "may be the recording's own";
  d.statements = {friction, {.use = {"backlash", "arm"}, .bounds = {{"gap_rad", "rad", 0.01, 0.01, 0.01}}}};
  d.train_logs = {"a.csv", "b.csv"}, d.held_out_logs = {"c.csv"};
  auto json = ToJson(DiagnoseRun{.info = {}, .diagnosis = d});
  json["experiment"] = "qube.yaml";
  json["model"] = JsonModel(friction.sets->with);
  return json;
}

TEST(ReadDiagnosisTest, IsWhatWasWritten) {
  // As a file holds it.
  const auto read = ReadDiagnosis(nlohmann::ordered_json::parse(Written().dump()), "here");
  ASSERT_TRUE(read.ok()) << read.error().Text();
  const EarlierDiagnosis& d = read.value();
  EXPECT_EQ(d.model.experiment, "qube.yaml");
  EXPECT_EQ(d.held_out_logs, std::vector<std::string>{"c.csv"});
  ASSERT_EQ(d.statements.size(), 2u);
  const Statement& friction = d.statements[0];
  EXPECT_EQ(friction.answer, Answer::kPresent);
  EXPECT_EQ(friction.group, 2);
  EXPECT_EQ(friction.parameters[0].high, 0.0011);
  EXPECT_TRUE(std::isnan(friction.numbers.gain_free));
  EXPECT_TRUE(friction.numbers.dry);
  ASSERT_TRUE(friction.sets);
  EXPECT_EQ(friction.sets->with.effects, std::vector<EffectUse>{friction.use});
  EXPECT_EQ(friction.sets->without.values, (std::vector<std::pair<std::string, double>>{{"arm.damping", 0.2}}));
  EXPECT_EQ(friction.sets->blocks[0].from_s, 1.5);
  EXPECT_EQ(friction.rivals[0].behind, 0.4);
  EXPECT_EQ(friction.caveat, "may be the recording's own");
  EXPECT_EQ(d.statements[1].caveat, "");
  EXPECT_FALSE(d.statements[1].sets);
  EXPECT_EQ(d.statements[1].bounds[0].value, 0.01);
}

TEST(ReadDiagnosisTest, ASchemaThatIsNoTextIsRefused) {
  EXPECT_FALSE(ReadDiagnosis({{"schema", 3}}, "here").ok());
  EXPECT_FALSE(ReadDiagnosis({{"schema", nullptr}}, "here").ok());
}

TEST(ReadDiagnosisTest, AStatementIsNamedByItsNumberOrItsEffect) {
  const EarlierDiagnosis d = ReadDiagnosis(Written(), "here").value();
  EXPECT_EQ(FindStatement(d, "2", "").value(), 1u);
  EXPECT_EQ(FindStatement(d, "backlash@arm", "").value(), 1u);
  EXPECT_FALSE(FindStatement(d, "3", "").ok());
  EXPECT_FALSE(FindStatement(d, "-1", "").ok());
  EXPECT_FALSE(FindStatement(d, "1x", "").ok());
  EXPECT_FALSE(FindStatement(d, "", "").ok());
}

TEST(GlossaryTest, WordsOfOneLineShareTheirMeaning) {
  std::map<std::string, std::string> words;
  for (const Term& term : Glossary()) words[term.word] = term.means;
  EXPECT_EQ(words.at("free"), words.at("frozen"));
  EXPECT_EQ(words.at("free run"), "a replay from one initial state, first row to last");
  for (const auto& [word, means] : words) EXPECT_EQ(means.find_first_of("[]`*|"), std::string::npos) << means;
}

}  // namespace
}  // namespace gapscope
