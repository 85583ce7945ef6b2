#include "src/core/file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <thread>

namespace gapscope {
namespace {

TEST(MappedFileTest, EndsWithAMessageWhereTheFileIsCut) {
  const std::string path = testing::TempDir() + "/cut.csv";
  ASSERT_TRUE(WriteFile(path, std::string(1 << 16, 'x')).ok());
  const auto read = [&] {
    EndWhereMappedFileIsCut();
    const auto file = MappedFile::Open(path);
    if (!file.ok() || truncate(path.c_str(), 0) != 0) _exit(1);
    const volatile char last = file.value().bytes().back();
    _exit(last == 'x' ? 0 : 1);
  };
  EXPECT_EXIT(read(), testing::ExitedWithCode(2), "a file was cut short while it was read");
  std::filesystem::remove(path);
}

TEST(MappedFileTest, AnotherBusErrorStaysOne) {
  const auto raised = [] {
    EndWhereMappedFileIsCut();
    raise(SIGBUS);
  };
  EXPECT_EXIT(raised(), testing::KilledBySignal(SIGBUS), "^$");
}

// What is opened a second time has lost what was written meanwhile, or waits for ever.
TEST(MappedFileTest, ANamedPipeIsOpenedOnce) {
  const std::string path = testing::TempDir() + "/pipe." + std::to_string(getpid()), text(1 << 17, 'x');
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  signal(SIGPIPE, SIG_IGN);
  std::thread writer([&] {
    const int pipe = open(path.c_str(), O_WRONLY);
    EXPECT_EQ(write(pipe, text.data(), text.size()), static_cast<ssize_t>(text.size()));
    close(pipe);
  });
  const auto file = MappedFile::Open(path);
  writer.join();
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(file.value().bytes(), text);
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace gapscope
