// The targets' inputs that are kept: seeds, and what a fuzzer has found. None may crash, and each of a seed that is
// valid (good*) must go the whole way, or the seeds would slowly come to try nothing.
//   fuzz_corpus_LIBRARY CORPUS
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "tests/fuzz/fuzz.h"

// Declares them, and gives FuzzTargets(), name and function.
#include "fuzz_targets.inc"

namespace {

namespace fs = std::filesystem;

std::vector<fs::path> FilesIn(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: fuzz_corpus_LIBRARY CORPUS\n");
    return 2;
  }
  int refused = 0;
  for (const auto& [name, target] : FuzzTargets()) {
    const std::vector<fs::path> files = FilesIn(fs::path(argv[1]) / name);
    for (const auto& file : files) {
      std::ifstream stream(file, std::ios::binary);
      const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
      gapscope::fuzz::whole = false;
      target(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
      if (gapscope::fuzz::whole || !file.filename().string().starts_with("good")) continue;
      std::fprintf(stderr, "fuzz_corpus: a valid seed was refused: %s\n", file.c_str());
      ++refused;
    }
    std::printf("%s: %zu inputs\n", name, files.size());
  }
  return refused > 0;
}
