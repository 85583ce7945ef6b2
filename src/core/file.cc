#include "src/core/file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <utility>

namespace gapscope {
namespace {

constexpr char kOwnFiles[] = "/proc/self/fd";

Error SystemError(const char* what, const std::string& path) {
  return Error{.what = what, .where = path, .actual = std::strerror(errno)};
}

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

// The bytes of what was opened; `file` below zero: why it could not be.
Result<std::string> ReadOpened(int file, const std::string& path) {
  if (file < 0) return SystemError("cannot open the file", path);
  struct stat info{};
  if (fstat(file, &info) != 0) return SystemError("cannot read the file", path);
  if (S_ISDIR(info.st_mode)) {
    return Error{.what = "cannot read the file",
                 .where = path,
                 .actual = "a folder",
                 .allowed = "a regular file",
                 .cure = "name a file in it"};
  }
  std::string bytes;
  bytes.resize(info.st_size > 0 ? static_cast<std::size_t>(info.st_size) : 1 << 16);
  std::size_t used = 0;
  while (true) {
    if (used == bytes.size()) {
      char extra;
      const ssize_t more = read(file, &extra, 1);
      if (more < 0) return SystemError("cannot read the file", path);
      if (more == 0) break;
      bytes.resize(bytes.size() * 2);
      bytes[used++] = extra;
      continue;
    }
    const ssize_t got = read(file, bytes.data() + used, bytes.size() - used);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return SystemError("cannot read the file", path);
    if (got == 0) break;
    used += static_cast<std::size_t>(got);
  }
  bytes.resize(used);
  return bytes;
}

// The folder that `path` is to stand in. Where it cannot be made, opening the file says why.
std::string MakeFolderOf(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  if (folder.empty()) return ".";
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  return folder.string();
}

}  // namespace

std::vector<std::string> ShortPaths(const std::vector<std::string>& paths) {
  const auto ends_so = [](std::string_view path, std::string_view names) {
    return path.ends_with(names) && (path.size() == names.size() || path[path.size() - names.size() - 1] == '/');
  };
  std::vector<std::string> all;
  for (const std::string& path : paths) {
    std::size_t from = path.rfind('/') + 1;  // 0 where there is none
    const auto is_shared = [&](const std::string& other) {
      return other != path && ends_so(other, std::string_view(path).substr(from));
    };
    while (from > 0 && std::ranges::any_of(paths, is_shared)) from = from == 1 ? 0 : path.rfind('/', from - 2) + 1;
    all.push_back(path.substr(from));
  }
  return all;
}

Result<std::string> ReadFile(const std::string& path) {
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC));
  return ReadOpened(file.get(), path);
}

Result<MappedFile> MappedFile::Open(const std::string& path) {
  MappedFile file;
  const Descriptor descriptor(open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat info{};
  if (descriptor.get() >= 0 && fstat(descriptor.get(), &info) == 0 && S_ISREG(info.st_mode) && info.st_size > 0) {
    const auto size = static_cast<std::size_t>(info.st_size);
    void* const at = mmap(nullptr, size, PROT_READ, MAP_PRIVATE | MAP_POPULATE, descriptor.get(), 0);
    if (at != MAP_FAILED) {
      file.mapped_ = {static_cast<const char*>(at), size};
      return file;
    }
  }
  GS_ASSIGN(file.read_, ReadOpened(descriptor.get(), path));
  return file;
}

MappedFile::~MappedFile() {
  if (mapped_.data()) munmap(const_cast<char*>(mapped_.data()), mapped_.size());
}

MappedFile::MappedFile(MappedFile&& other) noexcept
    : mapped_(std::exchange(other.mapped_, {})), read_(std::move(other.read_)) {}

void EndWhereMappedFileIsCut() {
  struct sigaction action{};
  action.sa_flags = SA_SIGINFO | SA_RESETHAND;
  // Nothing but system calls is allowed here.
  action.sa_sigaction = [](int, siginfo_t* info, void*) {
    if (info->si_code != BUS_ADRERR) {  // no page of a file that is gone: as without this
      raise(SIGBUS);
      return;
    }
    constexpr std::string_view kText =
        "gapscope: a file was cut short while it was read; read it again when nobody writes to it\n";
    [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, kText.data(), kText.size());
    _exit(2);
  };
  sigaction(SIGBUS, &action, nullptr);
}

Result<std::string> TemporaryBeside(const std::string& path) {
  MakeFolderOf(path);
  std::string name = path + ".XXXXXX";
  const Descriptor file(mkostemp(name.data(), O_CLOEXEC));
  if (file.get() < 0) return SystemError("cannot write the file", path);
  fchmod(file.get(), 0644);
  return name;
}

PartWriter::PartWriter(std::string path, std::string temporary, FILE* file)
    : path_(std::move(path)), temporary_(std::move(temporary)), file_(file, &std::fclose) {}

Result<PartWriter> PartWriter::Open(const std::string& path) {
  const std::string folder = MakeFolderOf(path);
  // Without a name, so that whatever ends the program leaves nothing; not every file system has that.
  if (access(kOwnFiles, X_OK) == 0) {
    const int nameless = open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0644);
    if (FILE* file = nameless >= 0 ? fdopen(nameless, "w") : nullptr) return PartWriter(path, "", file);
  }
  GS_ASSIGN(std::string temporary, TemporaryBeside(path));
  FILE* file = std::fopen(temporary.c_str(), "we");
  if (file) return PartWriter(path, std::move(temporary), file);
  const Error error = SystemError("cannot write the file", path);
  unlink(temporary.c_str());
  return error;
}

PartWriter::~PartWriter() {
  if (file_ && !temporary_.empty()) unlink(temporary_.c_str());
}

void PartWriter::Write(std::string_view bytes) {
  if (status_.ok() && std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size())
    status_ = SystemError("cannot write the file", path_);
}

// A name cannot be given over an old file: the nameless one gets another first.
Status PartWriter::Name() {
  const std::string own = std::string(kOwnFiles) + "/" + std::to_string(fileno(file_.get()));
  for (int i = 0;; ++i) {
    temporary_ = path_ + "." + std::to_string(getpid()) + "-" + std::to_string(i);
    if (linkat(AT_FDCWD, own.c_str(), AT_FDCWD, temporary_.c_str(), AT_SYMLINK_FOLLOW) == 0) return Ok();
    if (errno == EEXIST) continue;
    const Error error = SystemError("cannot write the file", path_);
    temporary_.clear();
    return error;
  }
}

Status PartWriter::Finish() {
  // On the disk before it has its name: a machine that loses power keeps the old file or the new one.
  if (status_.ok() && (std::fflush(file_.get()) != 0 || fsync(fileno(file_.get())) != 0))
    status_ = SystemError("cannot write the file", path_);
  if (status_.ok() && temporary_.empty()) status_ = Name();
  if (std::fclose(file_.release()) != 0 && status_.ok()) status_ = SystemError("cannot write the file", path_);
  if (status_.ok() && rename(temporary_.c_str(), path_.c_str()) != 0)
    status_ = SystemError("cannot rename the finished file to its place", path_);
  if (!status_.ok() && !temporary_.empty()) unlink(temporary_.c_str());
  return status_;
}

Status WriteFile(const std::string& path, std::string_view bytes) {
  GS_ASSIGN(PartWriter file, PartWriter::Open(path));
  file.Write(bytes);
  return file.Finish();
}

}  // namespace gapscope
