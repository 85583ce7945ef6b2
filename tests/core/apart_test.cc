#include "src/core/apart.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <stdexcept>

namespace gapscope {
namespace {

TEST(TryApartTest, SaysHowItEnded) {
  EXPECT_EQ(TryApart([] { return std::string(); }), "");
  const std::string long_text(100'000, 'x');  // more than a pipe holds
  EXPECT_EQ(TryApart([&] { return long_text; }), long_text);
  EXPECT_EQ(TryApart([]() -> std::string { throw std::runtime_error("no table"); }), "no table");
  EXPECT_EQ(TryApart([]() -> std::string { _exit(7); }), "it ends the program with status 7");
  EXPECT_EQ(TryApart([]() -> std::string {
              raise(SIGSEGV);
              return "";
            }),
            "it crashes: Segmentation fault");
  EXPECT_EQ(TryApart(
                []() -> std::string {
                  for (;;) pause();
                },
                1),
            "it does not return within 1 s");
}

TEST(TryApartTest, ChangesNothingHere) {
  int here = 1;
  TryApart([&] {
    here = 2;
    return std::string();
  });
  EXPECT_EQ(here, 1);
}

}  // namespace
}  // namespace gapscope
