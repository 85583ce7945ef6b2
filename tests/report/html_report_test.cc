#include "src/report/html_report.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "src/core/digest.h"
#include "src/core/file.h"
#include "src/report/json.h"
#include "tests/experiment/scratch.h"
#include "tests/report/pages.h"

namespace gapscope::testing {
namespace {

nlohmann::json DataOf(const std::string& page) {
  const std::string open = "id=\"report-data\">";
  const std::size_t begin = page.find(open) + open.size();
  return nlohmann::json::parse(page.substr(begin, page.find("</script>", begin) - begin), nullptr, false);
}

// A backslash before a control character is one of its own.
TEST(ScriptTextTest, WhatHidesIsReadAsItsEscape) {
  const std::string text = ScriptText(nlohmann::ordered_json("a\\\033[2J\u202e\n</script>"));
  EXPECT_EQ(nlohmann::json::parse(text), "a\\\\u001b[2J\\u202e\n</script>");
  EXPECT_EQ(text.find('<'), std::string::npos);
}

std::string EffectsPage() {
  const auto page = DiagnosisPage(Verdict::kEffects);
  return ReportHtml(page->result, page->source);
}

TEST(HtmlReportTest, IsOneFileWithoutTheNetwork) {
  const std::string page = EffectsPage();
  // Nothing is fetched: no element names a source, and what the libraries mention in comments is never asked for.
  for (const char* fetching : {"<link", "<img", "src=\"http", "@import", "url(http", "fetch(", "XMLHttpRequest("}) {
    const std::string text = fetching;
    std::size_t count = 0;
    // dygraphs can load CSV files, which this page never asks for.
    for (std::size_t at = page.find(text); at != std::string::npos; at = page.find(text, at + 1)) ++count;
    EXPECT_LE(count, text == "XMLHttpRequest(" ? 1u : 0u) << text;
  }
  EXPECT_NE(page.find("default-src 'none'"), std::string::npos);
  for (const char* slot : {"/*style*/", "/*dygraphs*/", "/*script*/", "/*data*/"})
    EXPECT_EQ(page.find(slot), std::string::npos) << slot;
}

TEST(HtmlReportTest, TextFromOutsideCannotEndTheScript) {
  const std::string page = EffectsPage();
  EXPECT_EQ(page.find("</script><b>"), std::string::npos);
  const auto data = DataOf(page);
  ASSERT_FALSE(data.is_discarded());
  EXPECT_EQ(data["statements"][0]["why"], "its own evidence: </script><b>bold</b>");
}

TEST(HtmlReportTest, HoldsTheTracesAndWhatTheyWereMadeFrom) {
  const auto page = DiagnosisPage(Verdict::kEffects);
  const auto data = DataOf(ReportHtml(page->result, page->source));
  const auto& log = data["logs"][0];
  EXPECT_EQ(log["sha256"], Sha256OfFile(page->recordings[0].log_path).value());
  EXPECT_EQ(log["traces"]["signals"][0]["time"].size(), page->recordings[0].rows());
  EXPECT_EQ(log["traces"]["signals"][0]["predicted"].size(), 2u);
  EXPECT_NEAR(log["traces"]["signals"][0]["measured"][4000].get<double>(), page->recordings[0].measured[0].values[4000],
              1e-5);
  EXPECT_EQ(log["maps"].size(), 2u);
  EXPECT_GE(log["responses"].size(), 1u);
}

TEST(HtmlReportTest, SaysWhatTheProgramSays) {
  const auto page = DiagnosisPage(Verdict::kEffects);
  const auto data = DataOf(ReportHtml(page->result, page->source));
  EXPECT_EQ(data["result"].dump(), nlohmann::json(page->result).dump());
  EXPECT_EQ(data["subject"], "Diagnosis of qube.csv with qube.xml");
  EXPECT_EQ(data["headline"]["title"], page->source.content.headline.title);
  EXPECT_EQ(data["headline"]["stages"].size(), 5u);
  EXPECT_EQ(data["findings"][0]["what"], "cable spring on arm");
  EXPECT_EQ(data["statements"][2]["bound"], "0.0002 N m");
  EXPECT_EQ(data["statements"][2]["gains"], nullptr) << "it was not refitted";
  EXPECT_EQ(data["remainder"].size(), 3u) << "what cannot be said is left out";
  EXPECT_EQ(data["next"]["command"], "gapscope design triangle models/qube/experiment.yaml --duration 20");
  EXPECT_EQ(data["map_of"], "diagnosed model");
  EXPECT_EQ(DataOf(ReportHtml(ReplayPage()->result, ReplayPage()->source))["map_of"], "model");
}

TEST(HtmlReportTest, FittedParametersComeFirstThenTheOthersThatAreFree) {
  const auto page = DiagnosisPage(Verdict::kEffects);
  const auto data = DataOf(ReportHtml(page->result, page->source));
  std::set<std::string> names;
  for (const auto& p : data["parameters"]) {
    names.insert(p["name"]);
    EXPECT_EQ(p["name"].get<std::string>().find("scale@"), std::string::npos) << p;
  }
  EXPECT_EQ(names.size(), data["parameters"].size()) << "none stands twice";
  const auto& spring = data["parameters"][0];
  EXPECT_EQ(spring["name"], "cable_spring@arm.stiffness_n_m_per_rad");
  EXPECT_EQ(spring["unit"], "N m/rad");
  EXPECT_EQ(spring["value"], 0.0012);
  EXPECT_EQ(spring["from"], 0.0011);
  EXPECT_EQ(spring["to"], 0.0013);
  EXPECT_TRUE(names.contains("arm.damping"));
  EXPECT_FALSE(names.contains("motor.rotor_inertia")) << "frozen";
}

TEST(HtmlReportTest, ALongLogKeepsItsSpikeInFewRows) {
  const auto page = LongPage(1000000, 654321);
  const std::string text = ReportHtml(page->result, page->source);
  const auto data = DataOf(text);
  const auto& traces = data["logs"][0]["traces"];
  EXPECT_LT(traces["signals"][0]["time"].size(), 80000u);
  EXPECT_LT(text.size(), 8000000u);
  double greatest = 0;
  for (const auto& v : traces["signals"][0]["measured"]) greatest = std::max(greatest, v.get<double>());
  EXPECT_EQ(greatest, 9.75);
}

TEST(HtmlReportTest, ManySignalsComeWorstFirstEachWithItsCommandInASmallPage) {
  const auto page = ManyPage(29, 12000);
  const std::string text = ReportHtml(page->result, page->source);
  EXPECT_LT(text.size(), 5000000u) << "ten times that is in the log";
  const auto data = DataOf(text);
  const auto& traces = data["logs"][0]["traces"];
  ASSERT_EQ(traces["signals"].size(), 29u);
  for (int k = 0; k < 29; ++k) {
    const auto& signal = traces["signals"][k];
    EXPECT_EQ(signal["name"], page->recordings[0].measured[28 - k].spec.signal);
    EXPECT_NEAR(signal["error"].get<double>(), 0.02 * (28 - k), 0.01);
    const auto& command = traces["commands"][signal["command"].get<int>()];
    EXPECT_EQ(command["name"], signal["name"]);
    EXPECT_GT(signal["time"].size(), 400u);
  }
  ASSERT_GE(data["logs"][0]["maps"].size(), 1u);
  EXPECT_EQ(data["logs"][0]["maps"][0]["joint"], "joint_28");
  EXPECT_LE(data["logs"][0]["maps"].size(), 6u);
  for (const auto& response : data["logs"][0]["responses"]) EXPECT_EQ(response["command"], response["signal"]);
  for (const auto& share : data["where"][0]["shares"]) EXPECT_GE(share["signal"], "joint_23") << "of the worst alone";
}

TEST(HtmlReportTest, TheConsoleShowsTheWorstSignalsAndSumsUpTheRest) {
  const std::string table = ManyPage(29, 3000)->table;
  EXPECT_LT(table.find("joint_28"), table.find("joint_21"));
  EXPECT_EQ(table.find("joint_20 "), std::string::npos);
  EXPECT_NE(table.find("21 more signals, nRMSE "), std::string::npos) << table;
  EXPECT_EQ(ManyPage(8, 3000)->table.find("more signals"), std::string::npos);
}

TEST(HtmlReportTest, ShowsTheVideoBesideIt) {
  const Scratch scratch;
  const auto page = ReplayPage();
  ASSERT_TRUE(WriteReportHtml(scratch.Path("a"), page->result, page->source).ok());
  const std::string report = scratch.Path("a/report.html");
  EXPECT_NE(ReadAll(report).find("data-video=\"\""), std::string::npos);
  EXPECT_FALSE(AttachVideo(report, "\"><script>").value());
  EXPECT_TRUE(AttachVideo(report, "video.mp4").value());
  EXPECT_NE(ReadAll(report).find("data-video=\"video.mp4\""), std::string::npos);
  EXPECT_TRUE(AttachVideo(report, "video.mp4").value());
  EXPECT_FALSE(AttachVideo(scratch.Path("b/report.html"), "video.mp4").value());
  scratch.Write("c/video.mp4", "x");
  ASSERT_TRUE(WriteReportHtml(scratch.Path("c"), page->result, page->source).ok());
  EXPECT_NE(ReadAll(scratch.Path("c/report.html")).find("data-video=\"video.mp4\""), std::string::npos);
}

TEST(DigestTest, IsSha256) {
  // FIPS 180-2, example B.1.
  EXPECT_EQ(Sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

}  // namespace
}  // namespace gapscope::testing
