#include "src/core/digest.h"

#include <sha2.h>
#include <sys/types.h>

#include "src/core/file.h"

namespace gapscope {

std::string Sha256(std::string_view bytes) {
  char digits[SHA256_DIGEST_STRING_LENGTH];
  SHA256Data(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size(), digits);
  return digits;
}

Result<std::string> Sha256OfFile(const std::string& path) {
  GS_ASSIGN(const std::string bytes, ReadFile(path));
  return Sha256(bytes);
}

}  // namespace gapscope
