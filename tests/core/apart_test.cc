#include "src/core/apart.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
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

TEST(RunApartTest, GivesTheStatusOrTheCrash) {
  EXPECT_EQ(RunApart([] { return 3; }).status, 3);
  EXPECT_EQ(RunApart([] { return 3; }).crash, "");
  EXPECT_EQ(RunApart([] { return raise(SIGSEGV); }).crash, "Segmentation fault");
  EXPECT_EQ(RunApart([]() -> int { throw std::runtime_error("no table"); }).crash, "no table");
}

// The parent of both is the one that is interrupted.
TEST(RunApartTest, PassesInterruptionsOn) {
  const auto interrupted_in = [](int sign) {
    const pid_t tester = fork();
    if (tester == 0) {
      const pid_t waits = getpid();
      const ApartEnd end = RunApart([&] {
        static volatile sig_atomic_t caught = 0;
        signal(sign, [](int) { caught = 1; });
        kill(waits, sign);
        for (int i = 0; i < 100 && !caught; ++i) usleep(50'000);
        return caught ? 5 : 6;
      });
      _exit(end.status);
    }
    int status = 0;
    waitpid(tester, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  };
  EXPECT_EQ(interrupted_in(SIGINT), 5);
  EXPECT_EQ(interrupted_in(SIGTERM), 5);
}

}  // namespace
}  // namespace gapscope
