#include "src/core/file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

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

}  // namespace
}  // namespace gapscope
