// A folder of its own for one test, removed afterwards, and files in it. Shared by the tests that read what users
// write.
#ifndef GAPSCOPE_TESTS_EXPERIMENT_SCRATCH_H_
#define GAPSCOPE_TESTS_EXPERIMENT_SCRATCH_H_

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>

namespace gapscope::testing {

// What a program said. status: exit status, or minus the signal that ended it.
struct Answer {
  int status = -1;
  std::string out, err;
};

class Scratch {
 public:
  Scratch() {
    // In memory where there is such a place: some tests write thousands of files.
    const std::filesystem::path memory = "/dev/shm";
    std::string name =
        ((access(memory.c_str(), W_OK) == 0 ? memory : std::filesystem::temp_directory_path()) / "gapscope_test.XXXXXX")
            .string();
    if (!mkdtemp(name.data())) throw std::runtime_error("no scratch folder");
    folder_ = name;
  }
  ~Scratch() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  // Writes a file and returns its path.
  std::string Write(const std::string& name, std::string_view bytes) const {
    const std::string path = Path(name);
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
  }
  // Runs a line of the shell.
  Answer Shell(const std::string& line) const;

 private:
  std::filesystem::path folder_;
};

inline std::string ReadAll(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

inline Answer Scratch::Shell(const std::string& line) const {
  const std::string out = Path("stdout"), err = Path("stderr");
  const int raw = std::system(("( " + line + " ) > '" + out + "' 2> '" + err + "' < /dev/null").c_str());
  return {WIFEXITED(raw) ? WEXITSTATUS(raw) : -WTERMSIG(raw), ReadAll(out), ReadAll(err)};
}

// `text` with the first `from` replaced; fails the test when there is none.
inline std::string Replaced(std::string text, std::string_view from, std::string_view to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << "no '" << from << "'";
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

}  // namespace gapscope::testing

#endif  // GAPSCOPE_TESTS_EXPERIMENT_SCRATCH_H_
