// std::from_chars for the numbers that logs are full of: a sign, up to 15 digits, a decimal point. Those take half its
// time; all others are handed to it.
//
// The digits as an integer (below 10^15) and the power of ten (at most 10^15) are exact doubles, so their quotient is
// the double nearest to what is written, as std::from_chars gives it: the same bits (Clinger 1990, "How to read
// floating point numbers accurately", section 3).
#ifndef GAPSCOPE_LOG_DECIMAL_H_
#define GAPSCOPE_LOG_DECIMAL_H_

#include <array>
#include <bit>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace gapscope {

// Up to eight decimal digits at the start of a text.
struct Digits {
  std::uint64_t value = 0;
  int count = 0;
};

// All eight bytes at `text` are read, and taken at once: a loop that ends anywhere is what costs the time.
inline Digits EightDigits(const char* text) {
  static_assert(std::endian::native == std::endian::little, "the first digit is the lowest byte");
  std::uint64_t bytes;
  std::memcpy(&bytes, text, sizeof bytes);
  bytes ^= 0x3030303030303030;  // a digit becomes 0 .. 9, anything else more
  const std::uint64_t others =
      (((bytes & 0x7f7f7f7f7f7f7f7f) + 0x7676767676767676) | bytes) & 0x8080808080808080;  // the high bit of each
  const int count = std::countr_zero(others) / 8;
  if (count == 0) return {};
  bytes <<= 64 - 8 * count;  // as many zeros before them as make eight digits
  // Neighbours are joined to pairs, pairs to fours, fours to eight.
  bytes = 10 * bytes + (bytes >> 8);
  constexpr std::uint64_t kPairs = 0x000000ff000000ff;
  constexpr std::uint64_t kEven = 100 + (1'000'000ull << 32), kOdd = 1 + (10'000ull << 32);
  return {(((bytes & kPairs) * kEven + ((bytes >> 16) & kPairs) * kOdd) >> 32) & 0xffffffff, count};
}

// As std::from_chars(text, end, value), bit for bit.
inline std::from_chars_result ReadDecimal(const char* text, const char* end, double& value) {
  static constexpr std::array kPowers = {1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                         1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
  static constexpr std::array<std::uint64_t, 9> kShifts = {1,       10,        100,        1'000,      10'000,
                                                           100'000, 1'000'000, 10'000'000, 100'000'000};
  static constexpr std::array kSigns = {1.0, -1.0};
  constexpr std::ptrdiff_t kMostDigits = 15;
  constexpr std::ptrdiff_t kReads = 34;  // bytes looked at: sign, whole digits, point, twice eight, what follows
  const auto is_digit = [](char c) { return static_cast<unsigned char>(c - '0') < 10; };
  if (end - text < kReads) return std::from_chars(text, end, value);
  const std::size_t negative = *text == '-';
  const char* const first = text + negative;
  const char* p = first;
  std::uint64_t digits = 0;
  for (; is_digit(*p) && p - first < kMostDigits; ++p) digits = 10 * digits + static_cast<std::uint64_t>(*p - '0');
  std::ptrdiff_t count = p - first, decimals = 0;
  if (*p == '.') {
    const char* const point = p++;
    for (Digits part{.value = 0, .count = 8}; part.count == 8 && p - point < kMostDigits; p += part.count) {
      part = EightDigits(p);
      digits = digits * kShifts[static_cast<std::size_t>(part.count)] + part.value;
    }
    decimals = p - point - 1;
    count += decimals;
  }
  if (count == 0 || count > kMostDigits || is_digit(*p) || *p == 'e' || *p == 'E')
    return std::from_chars(text, end, value);
  // The sign by a product: half of a log's numbers have one, so that a branch would be guessed wrongly.
  value = kSigns[negative] * static_cast<double>(static_cast<std::int64_t>(digits)) /
          kPowers[static_cast<std::size_t>(decimals)];
  return {p, std::errc{}};
}

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_DECIMAL_H_
