// The words of docs/reference/glossary.md, for who reads a page: the file itself is in the program.
#ifndef GAPSCOPE_REPORT_GLOSSARY_H_
#define GAPSCOPE_REPORT_GLOSSARY_H_

#include <string>
#include <vector>

namespace gapscope {

struct Term {
  std::string word, means;
};
// In the file's order; "free, frozen" are two words of one meaning. Markdown's links and code marks are taken out.
std::vector<Term> Glossary();

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_GLOSSARY_H_
