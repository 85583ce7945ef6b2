// Pieces of the YAML that a draft is written in.
#ifndef GAPSCOPE_DRAFT_YAML_TEXT_H_
#define GAPSCOPE_DRAFT_YAML_TEXT_H_

#include <string>

namespace gapscope {

// Six digits.
std::string Num(double value);
// Quoted where YAML needs it.
std::string Quote(const std::string& text);

}  // namespace gapscope

#endif  // GAPSCOPE_DRAFT_YAML_TEXT_H_
