// ReadDecimal against std::from_chars: the same value, bit by bit, the same end, the same refusal.
#include "src/log/decimal.h"

#include <gtest/gtest.h>

#include <bit>
#include <random>
#include <string>

namespace gapscope {
namespace {

void ExpectAsFromChars(const std::string& text) {
  const char *begin = text.data(), *end = begin + text.size();
  double value = 7, expected = 7;
  const auto got = ReadDecimal(begin, end, value);
  const auto wanted = std::from_chars(begin, end, expected);
  EXPECT_EQ(got.ptr - begin, wanted.ptr - begin) << text;
  EXPECT_EQ(got.ec, wanted.ec) << text;
  EXPECT_EQ(std::bit_cast<std::uint64_t>(value), std::bit_cast<std::uint64_t>(expected)) << text;
}

// At the end of a text, and with enough behind it for the quick way.
void ExpectEverywhere(const std::string& number) {
  ExpectAsFromChars(number);
  for (const char* after : {",", ";", "\n", "\r\n", " ", "x", ".", "-", "\xff", "/", ":"})
    ExpectAsFromChars(number + after + std::string(40, '9'));
}

TEST(DecimalTest, OddSpellingsAreReadAsFromChars) {
  for (const char* text : {"",
                           "-",
                           "+1",
                           ".",
                           "-.",
                           ".5",
                           "-.5",
                           "5.",
                           "-5.",
                           "0",
                           "-0",
                           "-0.0",
                           "00012.50",
                           "1e5",
                           "1.5e-7",
                           "1.E3",
                           "1e",
                           "1e+",
                           "2.5E400",
                           "1e-400",
                           "inf",
                           "-inf",
                           "nan",
                           "0x1p3",
                           "1,5",
                           "1..2",
                           "1.2.3",
                           "--1",
                           "- 1",
                           "9007199254740993",
                           "0.1234567890123456789"})
    ExpectEverywhere(text);
}

TEST(DecimalTest, EveryCountOfDigitsBeforeAndBehindThePoint) {
  const std::string digits = "98765432109876543210987654321";
  for (std::size_t whole = 0; whole <= 24; ++whole) {
    for (std::size_t decimals = 0; decimals <= 24; ++decimals) {
      const std::string number = digits.substr(0, whole) + "." + digits.substr(3, decimals);
      ExpectEverywhere(number);
      ExpectEverywhere("-" + std::string(whole, '0') + "." + std::string(decimals, '0') + "7");
    }
    ExpectEverywhere(digits.substr(0, whole));
  }
}

TEST(DecimalTest, RandomDigitsAreTheSameBits) {
  std::mt19937_64 random(1);
  const std::string tail = "," + std::string(40, '1');
  for (int k = 0; k < 100'000; ++k) {
    std::string number = random() % 2 ? "-" : "";
    const std::size_t whole = random() % 12, decimals = random() % 14;
    for (std::size_t i = 0; i < whole; ++i) number += static_cast<char>('0' + random() % 10);
    number += '.';
    for (std::size_t i = 0; i < decimals; ++i) number += static_cast<char>('0' + random() % 10);
    ExpectAsFromChars(number + tail);
  }
}

TEST(DecimalTest, AnyByteBehindADigitEndsIt) {
  for (int byte = 0; byte < 256; ++byte) {
    ExpectAsFromChars("1.25" + std::string(1, static_cast<char>(byte)) + std::string(40, '3'));
    ExpectAsFromChars("1.1234567" + std::string(1, static_cast<char>(byte)) + std::string(40, '3'));
  }
}

}  // namespace
}  // namespace gapscope
