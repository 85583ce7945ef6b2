// A 64-bit key of everything that a computation depends on: FNV-1a (Fowler, Noll, Vo), over bytes in the order added.
// Not cryptographic: it tells jobs apart, nothing more.
#ifndef GAPSCOPE_CORE_HASH_H_
#define GAPSCOPE_CORE_HASH_H_

#include <cstdint>
#include <span>
#include <string_view>

namespace gapscope {

class Hasher {
 public:
  explicit Hasher(std::uint64_t seed = 14695981039346656037ull) : hash_(seed) {}
  std::uint64_t value() const { return hash_; }

  Hasher& Bytes(const void* bytes, std::size_t size);
  // Its length too, so that neighbouring texts cannot swap letters.
  Hasher& Text(std::string_view text);
  Hasher& Numbers(std::span<const double> numbers);
  Hasher& Number(double number) { return Numbers({&number, 1}); }

 private:
  std::uint64_t hash_;
};

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_HASH_H_
