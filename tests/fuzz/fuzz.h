// What the fuzz targets share. A target is one file here, FUZZ_TARGET(its name) { ... } of `data` and `size`: libFuzzer
// gives it inputs (scripts/fuzz), and fuzz_corpus those that are kept in corpus/.
#ifndef GAPSCOPE_TESTS_FUZZ_FUZZ_H_
#define GAPSCOPE_TESTS_FUZZ_FUZZ_H_

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "src/core/result.h"

#ifdef GAPSCOPE_FUZZER
#define FUZZ_TARGET(name) extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
#else
#define FUZZ_TARGET(name) extern "C" int Fuzz_##name(const std::uint8_t* data, std::size_t size)
#endif

namespace gapscope::fuzz {

// Whether the last input went the whole way; fuzz_corpus looks here.
inline bool whole = false;

// Something that no input may bring about.
[[noreturn]] inline void Complain(const std::string& what) {
  std::fprintf(stderr, "fuzz: %s\n", what.c_str());
  std::abort();
}

// A refusal says what, and begins its place with `where`; whatever the input holds, it stays readable.
inline void CheckRefusal(const Error& error, std::string_view where) {
  constexpr std::size_t kLongest = 20'000;
  if (error.what.empty() || !error.where.starts_with(where)) Complain("an error without a place: " + error.Text());
  if (error.Text().size() > kLongest) Complain("an error of " + std::to_string(error.Text().size()) + " characters");
}

inline std::string_view Text(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

// The path of a file in memory that holds these bytes until the next call.
inline const std::string& FileOf(std::string_view bytes) {
  static const int file = memfd_create("fuzz", 0);
  static const std::string path = "/proc/self/fd/" + std::to_string(file);
  if (ftruncate(file, 0) != 0 || pwrite(file, bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    Complain("no file in memory");
  return path;
}

}  // namespace gapscope::fuzz

#endif  // GAPSCOPE_TESTS_FUZZ_FUZZ_H_
