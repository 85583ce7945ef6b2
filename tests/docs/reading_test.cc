// docs/how-to/read-a-verdict.md can be read by a stranger: short sentences, no word of the trade that
// docs/reference/glossary.md does not explain, no name that the program does not have, no figure that
// docs/results/diagnosis.md does not have. And links of all pages lead somewhere.
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

// Of a link its text counts. A sentence ends at its mark before a blank, or with its block.
Problems LongSentences(const std::string& page) {
  constexpr std::size_t kMostWords = 30;
  static const std::regex link(R"(!?\[([^\]]*)\]\([^)]*\))");
  Problems problems;
  for (const std::string& block : Blocks(PartsOf(page).prose)) {
    Words sentence;
    Words words = SplitAtBlanks(std::regex_replace(block, link, "$1"));
    for (std::size_t i = 0; i < words.size(); ++i) {
      const bool counts =
          std::any_of(words[i].begin(), words[i].end(), [](unsigned char c) { return std::isalnum(c); });
      if (counts) sentence.push_back(words[i]);
      const bool ends = std::string(".?!").find(words[i].back()) != std::string::npos;
      if (!ends && i + 1 < words.size()) continue;
      if (sentence.size() > kMostWords)
        problems.push_back(std::to_string(sentence.size()) + " words: " + sentence[0] + " " + sentence[1] + " " +
                           sentence[2] + " ...");
      sentence.clear();
    }
  }
  return problems;
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
    const std::size_t link = block.find("(results_diagnose.md");
    if (IsHeading(block)) quoting = false;
    quoting = quoting || link != std::string::npos;
    if (!quoting) continue;
    for (const std::string& figure : FiguresOf(link == std::string::npos ? block : block.substr(link))) {
      if (!known.contains(figure)) problems.push_back("not in docs/results/diagnosis.md: " + figure);
    }
  }
  return problems;
}

// Where "#..." leads, as GitHub makes it of a heading.
std::set<std::string> AnchorsOf(const std::string& page) {
  std::set<std::string> anchors;
  for (const std::string& block : Blocks(PartsOf(page).prose)) {
    if (!IsHeading(block)) continue;
    std::string anchor;
    for (const char c : Lower(block.substr(block.find_first_not_of("# ")))) {
      if (std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_') anchor += c;
      if (c == ' ') anchor += '-';
    }
    anchors.insert(anchor);
  }
  return anchors;
}

// `at`: where the page stands.
Problems DeadLinks(const std::string& page, const fs::path& at) {
  Problems problems;
  for (const std::string& target : Found(PartsOf(page).prose, R"(\]\(([^)\s]+)\))")) {
    if (target.find("://") != std::string::npos) continue;
    const std::string file = target.substr(0, target.find('#'));
    const fs::path path = file.empty() ? at : at.parent_path() / file;
    if (!file.empty() && !fs::exists(path)) {
      problems.push_back("no such file: " + target);
    } else if (const std::size_t anchor = target.find('#'); anchor != std::string::npos) {
      if (!AnchorsOf(file.empty() ? page : TextOf(path)).contains(target.substr(anchor + 1)))
        problems.push_back("no such heading: " + target);
    }
  }
  return problems;
}

const fs::path kPage = kRoot / "docs/how-to/read-a-verdict.md";

TEST(DiagnosisPageTest, SentencesAreShort) { EXPECT_EQ(LongSentences(TextOf(kPage)), Problems()); }
TEST(DiagnosisPageTest, BoldWordsAreInTheGlossary) { EXPECT_EQ(UnknownTerms(TextOf(kPage)), Problems()); }
TEST(DiagnosisPageTest, NamesAreTheProgramsOwn) { EXPECT_EQ(UnknownNames(TextOf(kPage)), Problems()); }
TEST(DiagnosisPageTest, FiguresAreThoseOfTheResults) {
  EXPECT_EQ(FiguresWithoutSource(TextOf(kPage), TextOf(kRoot / "docs/results/diagnosis.md")), Problems());
}

TEST(DocumentsTest, LinksLeadSomewhere) {
  std::vector<fs::path> pages = {kRoot / "README.md", kRoot / "CONTRIBUTING.md"};
  for (const auto& entry : fs::directory_iterator(kRoot / "docs")) {
    if (entry.path().extension() == ".md") pages.push_back(entry.path());
  }
  for (const fs::path& page : pages) EXPECT_EQ(DeadLinks(TextOf(page), page), Problems()) << page;
}

// What the rules are worth: each fails where it should.
std::string SentenceOf(int words) {
  std::string text = "One";
  for (int i = 1; i < words; ++i) text += i % 7 == 0 ? "\n[word](page.md)" : " word";
  return text + ".";
}

TEST(ReadingRulesTest, ASentenceMayHaveThirtyWords) {
  EXPECT_EQ(LongSentences("Short. " + SentenceOf(30) + " " + SentenceOf(30)), Problems());
  EXPECT_EQ(LongSentences("Short. " + SentenceOf(31)), Problems{"31 words: One word word ..."});
  EXPECT_EQ(LongSentences("- " + SentenceOf(31)).size(), 1u) << "in a list";
  EXPECT_EQ(LongSentences("- " + SentenceOf(20) + "\n- " + SentenceOf(20)), Problems());
  EXPECT_EQ(LongSentences("\n    " + std::regex_replace(SentenceOf(31), std::regex("\n"), " ")), Problems())
      << "an example is no sentence";
}

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
  const std::string results = "| 23 of 32 | 72 % |\nand 0.5\n", link = "[there](results_diagnose.md): ";
  EXPECT_EQ(FiguresWithoutSource("99 " + link + "23 of\n32, 72 %, 0.5.\n\n# Next\n\n98\n", results), Problems());
  EXPECT_EQ(FiguresWithoutSource(link + "24 of 32 and 0.50", results),
            (Problems{"not in docs/results/diagnosis.md: 24 of 32", "not in docs/results/diagnosis.md: 0.50"}));
  EXPECT_EQ(FiguresWithoutSource(link + "\n\n| 73 % |\n", results).size(), 1u);
}

TEST(ReadingRulesTest, ALinkLeadsToAFileAndAHeading) {
  const fs::path at = kRoot / "docs/page.md";
  const std::string page =
      "## 5. What `it` leaves\n\n[a](#5-what-it-leaves) [b](glossary.md) [c](https://example.com)\n";
  EXPECT_EQ(DeadLinks(page, at), Problems());
  EXPECT_EQ(DeadLinks(page + "[d](#6-nothing)", at), Problems{"no such heading: #6-nothing"});
  EXPECT_EQ(DeadLinks(page + "![e](nothing.png)", at), Problems{"no such file: nothing.png"});
}

}  // namespace
}  // namespace gapscope::testing
