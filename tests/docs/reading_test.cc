// The pages that say how to read a diagnosis, and how far to believe it, use no word of the trade that
// docs/reference/glossary.md does not explain, no name that the program does not have, no figure that
// docs/results/diagnosis.md does not have. What needs no program (links, long sentences) is scripts/check_docs' task.
#include <gtest/gtest.h>

#include <cctype>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>

#include "src/core/file.h"
#include "src/report/explain_report.h"
#include "src/report/glossary.h"
#include "tests/report/pages.h"

namespace gapscope::testing {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;
using Problems = std::vector<std::string>;

const fs::path kRoot = GAPSCOPE_SOURCE_DIR;

std::string TextOf(const fs::path& path) {
  const auto file = ReadFile(path);
  EXPECT_TRUE(file.ok()) << file.error().Text();
  return file.ok() ? file.value() : "";
}

std::string Lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

Words SplitAtBlanks(const std::string& text) {
  std::istringstream stream(text);
  Words words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

// First groups of all matches.
Words Found(const std::string& text, const std::string& pattern) {
  const std::regex form(pattern);
  Words found;
  for (std::sregex_iterator match(text.begin(), text.end(), form), end; match != end; ++match)
    found.push_back((*match)[1]);
  return found;
}

bool IsHeading(const std::string& line) { return line.starts_with("#"); }

// A page in two: its indented or fenced examples, and the text around them.
struct Parts {
  std::string prose, code;
};

Parts PartsOf(const std::string& page) {
  Parts parts;
  bool fenced = false, after_blank = true, indented = false;
  std::istringstream lines(page);
  for (std::string line; std::getline(lines, line);) {
    const bool fence = line.starts_with("```"), blank = line.empty();
    if (fence) fenced = !fenced;
    indented = line.starts_with("    ") && (after_blank || indented);
    const bool code = fenced || fence || indented;
    (code ? parts.code : parts.prose) += fence ? "\n" : line + "\n";
    after_blank = blank;
  }
  return parts;
}

// Headings, paragraphs, items of lists, cells of tables, each in one line.
Words Blocks(const std::string& prose) {
  Words blocks = {""};
  std::istringstream lines(prose);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("|")) {
      std::istringstream cells(line);
      for (std::string cell; std::getline(cells, cell, '|');) blocks.push_back(cell);
      blocks.emplace_back();
    } else if (line.empty() || line.starts_with("- ") || IsHeading(line)) {
      blocks.push_back(line);
      if (IsHeading(line)) blocks.emplace_back();
    } else {
      blocks.back() += " " + line.substr(line.find_first_not_of(' '));
    }
  }
  return blocks;
}

// A word in bold is a term: one of the glossary, or its plural.
Problems UnknownTerms(const std::string& page) {
  std::set<std::string> terms;
  for (const Term& term : Glossary()) terms.insert({Lower(term.word), Lower(term.word) + "s"});
  Problems problems;
  for (const std::string& block : Blocks(PartsOf(page).prose)) {
    for (const std::string& bold : Found(block, R"(\*\*([^*]+)\*\*)")) {
      if (!terms.contains(Lower(bold))) problems.push_back("not in docs/reference/glossary.md: " + bold);
    }
  }
  return problems;
}

void AddWords(const nlohmann::ordered_json& json, std::set<std::string>* words) {
  if (json.is_string()) words->insert(json.get<std::string>());
  if (!json.is_structured()) return;
  for (const auto& [key, value] : json.items()) {
    if (json.is_object()) words->insert(key);
    AddWords(value, words);
  }
}

// Keys and words of results that have all that a diagnosis can have, and of their explanation.
std::set<std::string> WordsOfResults() {
  std::set<std::string> words;
  for (const Verdict verdict :
       {Verdict::kNone, Verdict::kParameters, Verdict::kEffects, Verdict::kAmbiguous, Verdict::kUnknown}) {
    DiagnoseRun run = MadeDiagnosis(verdict);
    Statement& first = run.diagnosis.statements.front();
    first.beside = EffectUse{"backlash", "arm"};
    first.sets = std::make_shared<ComparedSets>();
    AddWords(ToJson(run), &words);
    AddWords(ToJson(ExplainRun{.info = {}, .diagnosis = "found", .statement = first}), &words);
  }
  for (const Answer answer : {Answer::kPresent, Answer::kAbsent, Answer::kUnseen}) words.insert(AnswerName(answer));
  return words;
}

// "## diagnose" and what stands below it; empty: there is no such command.
std::string OptionsOf(const std::string& options, const std::string& command) {
  const std::size_t from = options.find("\n## " + command + "\n");
  return from == std::string::npos ? "" : options.substr(from, options.find("\n## ", from + 1) - from);
}

// `gapscope COMMAND ...`: the command is there and has these options.
Problems ProblemsOfCommand(const std::string& line, const std::string& options) {
  const Words words = SplitAtBlanks(line);
  std::string section;
  if (words.size() > 2) section = OptionsOf(options, words[1] + " " + words[2]);
  if (section.empty() && words.size() > 1) section = OptionsOf(options, words[1]);
  if (section.empty()) return {"no command: " + line};
  Problems problems;
  for (const std::string& flag : Found(line, R"((--[a-z][a-z-]*))")) {
    if (section.find("`" + flag + "`") == std::string::npos && section.find("`" + flag + " ") == std::string::npos)
      problems.push_back("no option of this command: " + flag + " in " + line);
  }
  return problems;
}

// A code span is a command, an option with or without a value, a choice of one, a file, an effect, or a word of a
// result.
Problems ProblemsOfName(const std::string& span, const std::string& options, const std::set<std::string>& known) {
  const std::string first = SplitAtBlanks(span).front();
  if (first == "gapscope") return ProblemsOfCommand(span, options);
  if (first.starts_with("--")) {
    const bool has =
        options.find("`" + first + "`") != std::string::npos || options.find("`" + first + " ") != std::string::npos;
    return has ? Problems() : Problems{"not in docs/reference/options.md: " + span};
  }
  if (known.contains(first) || fs::exists(kRoot / first)) return {};
  const std::string file = fs::path(first).filename();
  if (file.find('.') != std::string::npos && options.find(file) != std::string::npos) return {};
  return {"no name of the program: " + span};
}

Problems UnknownNames(const std::string& page) {
  const std::string options = TextOf(kRoot / "docs/reference/options.md");
  std::set<std::string> known = WordsOfResults();
  for (const Effect& effect : Catalogue()) known.insert(effect.name);
  for (const std::string& choices : Found(options, R"(\{([a-z,_]+)\})")) {
    std::istringstream stream(choices);
    for (std::string choice; std::getline(stream, choice, ',');) known.insert(choice);
  }
  const Parts parts = PartsOf(page);
  Problems problems;
  const auto add = [&](const Problems& more) { problems.insert(problems.end(), more.begin(), more.end()); };
  for (const std::string& block : Blocks(parts.prose)) {
    for (const std::string& span : Found(block, "`([^`]+)`")) add(ProblemsOfName(span, options, known));
  }
  std::istringstream lines(std::regex_replace(parts.code, std::regex(R"(\\\n)"), " "));
  for (std::string line; std::getline(lines, line);) {
    const Words words = SplitAtBlanks(line);
    if (words.empty()) continue;
    if (words[0] == "build/bin/gapscope") {
      add(ProblemsOfCommand(line, options));
    } else if (!fs::exists(kRoot / words[0])) {
      problems.push_back("no such program: " + words[0]);
    }
  }
  return problems;
}

// Numbers as they are quoted: "23 of 32" and "72 %" are one figure each.
Words FiguresOf(const std::string& text) {
  return Found(text, R"((?:^|[^\w.#])(\d+(?:[.,]\d+)*(?: of \d+| %)?)(?![\w]))");
}

// From a link to the results on, up to the next heading, every figure is quoted from there.
Problems FiguresWithoutSource(const std::string& page, const std::string& results) {
  const Words there = FiguresOf(std::regex_replace(results, std::regex(R"(\s+)"), " "));
  std::set<std::string> known(there.begin(), there.end());
  for (const std::string& figure : there) known.insert(figure.substr(0, figure.find(' ')));
  Problems problems;
  bool quoting = false;
  for (const std::string& block : Blocks(PartsOf(page).prose)) {
    const std::size_t link = block.find("results/diagnosis.md");
    if (IsHeading(block)) quoting = false;
    quoting = quoting || link != std::string::npos;
    if (!quoting) continue;
    for (const std::string& figure : FiguresOf(link == std::string::npos ? block : block.substr(link))) {
      if (!known.contains(figure)) problems.push_back("not in docs/results/diagnosis.md: " + figure);
    }
  }
  return problems;
}

// Those of the pages about a diagnosis that quote its results or name parts of a result.
const char* const kPages[] = {"how-to/read-a-verdict", "how-to/after-a-diagnosis",  "how-to/unknown",
                              "how-to/long-runs",      "explanation/probabilities", "explanation/limits"};

std::string PageText(const std::string& name) { return TextOf(kRoot / "docs" / (name + ".md")); }

TEST(DiagnosisPagesTest, BoldWordsAreInTheGlossary) {
  for (const char* page : kPages) EXPECT_EQ(UnknownTerms(PageText(page)), Problems()) << page;
}
TEST(DiagnosisPagesTest, NamesAreTheProgramsOwn) {
  for (const char* page : kPages) EXPECT_EQ(UnknownNames(PageText(page)), Problems()) << page;
}
TEST(DiagnosisPagesTest, FiguresAreThoseOfTheResults) {
  const std::string results = PageText("results/diagnosis");
  for (const char* page : kPages) EXPECT_EQ(FiguresWithoutSource(PageText(page), results), Problems()) << page;
}

// What the rules are worth: each fails where it should.
TEST(ReadingRulesTest, ABoldWordIsATerm) {
  EXPECT_EQ(UnknownTerms("the **gap** of **Rough twins**, **held\nout**"), Problems());
  EXPECT_EQ(UnknownTerms("a **quasi-likelihood**"), Problems{"not in docs/reference/glossary.md: quasi-likelihood"});
}

TEST(ReadingRulesTest, ANameIsOneThatTheProgramHas) {
  EXPECT_EQ(
      UnknownNames("`gapscope explain`, `--prior backlash=0.9`, `quick`, `seen_beside`, `cable_spring`, `unseen`, "
                   "`out/report.html`, `scripts/demo`\n\n    build/bin/gapscope diagnose a \\\n      --accept 1\n"),
      Problems());
  EXPECT_EQ(UnknownNames("`--guess`"), Problems{"not in docs/reference/options.md: --guess"});
  EXPECT_EQ(UnknownNames("`seen_behind`"), Problems{"no name of the program: seen_behind"});
  EXPECT_EQ(UnknownNames("`gapscope divine`"), Problems{"no command: gapscope divine"});
  EXPECT_EQ(UnknownNames("\n    build/bin/gapscope explain a \\\n      --effort quick\n").size(), 1u)
      << "of another one";
}

TEST(ReadingRulesTest, AFigureAfterTheLinkIsOneOfTheResults) {
  const std::string results = "| 23 of 32 | 72 % |\nand 0.5\n", link = "[there](../results/diagnosis.md): ";
  EXPECT_EQ(FiguresWithoutSource("99 " + link + "23 of\n32, 72 %, 0.5.\n\n# Next\n\n98\n", results), Problems());
  EXPECT_EQ(FiguresWithoutSource(link + "24 of 32 and 0.50", results),
            (Problems{"not in docs/results/diagnosis.md: 24 of 32", "not in docs/results/diagnosis.md: 0.50"}));
  EXPECT_EQ(FiguresWithoutSource(link + "\n\n| 73 % |\n", results).size(), 1u);
}

}  // namespace
}  // namespace gapscope::testing
