#include "src/core/result.h"

namespace gapscope {

std::string Error::Text() const {
  std::string text;
  if (!where.empty()) text += where + ": ";
  text += what;
  if (!actual.empty()) text += ": got " + actual;
  if (!allowed.empty()) text += (actual.empty() ? ": " : ", ") + ("allowed: " + allowed);
  if (!cure.empty()) text += "; " + cure;
  return text;
}

void ContractBroken(const char* condition, const char* file, int line) {
  throw std::logic_error(std::string(file) + ":" + std::to_string(line) + ": broken contract: " + condition);
}

}  // namespace gapscope
