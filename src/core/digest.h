// What a result was made from: the SHA-256 of its input files.
#ifndef GAPSCOPE_CORE_DIGEST_H_
#define GAPSCOPE_CORE_DIGEST_H_

#include <string>
#include <string_view>

#include "src/core/result.h"

namespace gapscope {

// 64 hexadecimal digits.
std::string Sha256(std::string_view bytes);
// Of a file's bytes. Errors as ReadFile.
Result<std::string> Sha256OfFile(const std::string& path);

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_DIGEST_H_
