#include "src/report/glossary.h"

#include <regex>
#include <sstream>

#include "src/report/html_assets.h"

namespace gapscope {

std::vector<Term> Glossary() {
  static const std::regex line_form(R"(\| \*\*(.+)\*\* \| (.+) \|)"), link(R"( ?\(\[[^\]]*\]\([^)]*\)\))");
  std::vector<Term> terms;
  std::istringstream lines(assets::kGlossary);
  for (std::string line; std::getline(lines, line);) {
    std::smatch parts;
    if (!std::regex_match(line, parts, line_form)) continue;
    std::string means = std::regex_replace(parts[2].str(), link, "");
    std::erase(means, '`');
    std::istringstream words(parts[1].str());
    for (std::string word; std::getline(words, word, ',');)
      terms.push_back({word.substr(word.find_first_not_of(' ')), means});
  }
  return terms;
}

}  // namespace gapscope
