// Whole files: read at once, written to a temporary name and renamed, so that nothing is lost half-way.
#ifndef GAPSCOPE_CORE_FILE_H_
#define GAPSCOPE_CORE_FILE_H_

#include <cstdio>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "src/core/result.h"

namespace gapscope {

// As short an end of each path, in whole names, as no other path has: "run.csv", or "monday/run.csv" beside
// "tuesday/run.csv".
std::vector<std::string> ShortPaths(const std::vector<std::string>& paths);

// The bytes of a regular file. Errors: absent, a folder, unreadable.
Result<std::string> ReadFile(const std::string& path);

// The bytes of a file as long as this lives, without a copy of them: a regular file is mapped, another one read.
// Whoever cuts a mapped file short meanwhile ends the program by SIGBUS: EndWhereMappedFileIsCut().
class MappedFile {
 public:
  // Errors: those of ReadFile().
  static Result<MappedFile> Open(const std::string& path);
  ~MappedFile();
  MappedFile(MappedFile&& other) noexcept;
  MappedFile& operator=(MappedFile&& other) = delete;

  std::string_view bytes() const { return mapped_.data() ? mapped_ : read_; }

 private:
  MappedFile() = default;
  std::string_view mapped_;  // without data: not mapped
  std::string read_;
};

// From now on the program then ends with a message on stderr and exit status 2 instead.
void EndWhereMappedFileIsCut();

// A new empty file beside `path`, making its folders; its name. Errors: cannot create.
Result<std::string> TemporaryBeside(const std::string& path);

// Writes `path` atomically (as PartWriter), making its folders.
// Errors: cannot create, write (disk full) or rename; the old file stays.
Status WriteFile(const std::string& path, std::string_view bytes);

// A long file, written a part at a time without a name, or under a temporary one. Without Finish() nothing is left.
class PartWriter {
 public:
  // Errors: cannot create.
  static Result<PartWriter> Open(const std::string& path);
  ~PartWriter();
  PartWriter(PartWriter&& other) = default;
  PartWriter& operator=(PartWriter&& other) = delete;

  void Write(std::string_view bytes);
  // Gives it its name. Errors: some part could not be written (disk full), cannot rename; the old file stays.
  Status Finish();

 private:
  PartWriter(std::string path, std::string temporary, FILE* file);
  Status Name();

  std::string path_, temporary_;  // temporary_: empty while it has no name
  std::unique_ptr<FILE, int (*)(FILE*)> file_;
  Status status_ = Ok();  // of what was written so far
};

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_FILE_H_
