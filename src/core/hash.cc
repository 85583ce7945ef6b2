#include "src/core/hash.h"

namespace gapscope {

Hasher& Hasher::Bytes(const void* bytes, std::size_t size) {
  const auto* byte = static_cast<const unsigned char*>(bytes);
  for (std::size_t i = 0; i < size; ++i) hash_ = (hash_ ^ byte[i]) * 1099511628211ull;
  return *this;
}

Hasher& Hasher::Text(std::string_view text) {
  const std::uint64_t size = text.size();
  return Bytes(&size, sizeof size).Bytes(text.data(), text.size());
}

Hasher& Hasher::Numbers(std::span<const double> numbers) {
  const std::uint64_t size = numbers.size();
  return Bytes(&size, sizeof size).Bytes(numbers.data(), numbers.size_bytes());
}

}  // namespace gapscope
