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

TEST(ShortPathsTest, AreAsLongAsTellsThemApart) {
  using Paths = std::vector<std::string>;
  EXPECT_EQ(ShortPaths({"/logs/monday/run.csv", "/logs/tuesday/run.csv", "/logs/tuesday/other.csv"}),
            (Paths{"monday/run.csv", "tuesday/run.csv", "other.csv"}));
  EXPECT_EQ(ShortPaths({"a/x/run.csv", "b/x/run.csv", "run.csv"}), (Paths{"a/x/run.csv", "b/x/run.csv", "run.csv"}));
  // A name that ends like another one is another name; two parts of one log are one log.
  EXPECT_EQ(ShortPaths({"/a/run.csv", "/b/prerun.csv", "/a/run.csv"}), (Paths{"run.csv", "prerun.csv", "run.csv"}));
  EXPECT_EQ(ShortPaths({"/run.csv", "a/run.csv"}), (Paths{"/run.csv", "a/run.csv"}));
  EXPECT_TRUE(ShortPaths({}).empty());
}

class PartWriterTest : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(WriteFile(folder / "a", "old").ok()); }
  ~PartWriterTest() override { std::filesystem::remove_all(folder); }
  // No other file is there, and it says this.
  void ExpectAlone(const std::string& text) const {
    EXPECT_EQ(ReadFile(folder / "a").value(), text);
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1);
  }
  const std::filesystem::path folder = testing::TempDir() + "/parts." + std::to_string(getpid());
};

TEST_F(PartWriterTest, WhatIsKilledLeavesTheOldFileAlone) {
  const int nameless = open(folder.c_str(), O_TMPFILE | O_WRONLY, 0600);
  if (nameless < 0) GTEST_SKIP() << "this file system has no files without a name";
  close(nameless);
  const auto killed = [&] {
    auto file = PartWriter::Open(folder / "a");
    file.value().Write(std::string(1 << 20, 'x'));
    raise(SIGKILL);
  };
  EXPECT_EXIT(killed(), testing::KilledBySignal(SIGKILL), "");
  ExpectAlone("old");
}

TEST_F(PartWriterTest, WhatIsNotFinishedLeavesTheOldFileAlone) {
  {
    auto half = PartWriter::Open(folder / "a");
    half.value().Write("half");
  }
  ExpectAlone("old");
  auto whole = PartWriter::Open(folder / "a");
  whole.value().Write("new");
  ASSERT_TRUE(whole.value().Finish().ok());
  ExpectAlone("new");
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
