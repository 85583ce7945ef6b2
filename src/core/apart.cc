#include "src/core/apart.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>

namespace gapscope {
namespace {

// In the copy: tells the pipe what `work` says, and ends without what this process does at its end.
[[noreturn]] void Work(const std::function<std::string()>& work, int pipe, unsigned most_s) {
  const rlimit no_core{};
  setrlimit(RLIMIT_CORE, &no_core);
  if (const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC); nowhere >= 0) dup2(nowhere, 1), dup2(nowhere, 2);
  for (const int sign : {SIGALRM, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) signal(sign, SIG_DFL);
  alarm(most_s);
  std::string said;
  try {
    said = work();
  } catch (const std::exception& e) {
    said = e.what();
  }
  for (std::size_t done = 0; done < said.size();) {
    const ssize_t written = write(pipe, said.data() + done, said.size() - done);
    if (written <= 0) break;
    done += static_cast<std::size_t>(written);
  }
  _exit(said.empty() ? 0 : 1);
}

std::string ReadAll(int pipe) {
  std::string text;
  char part[512];
  for (;;) {
    const ssize_t got = read(pipe, part, sizeof part);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return text;
    text.append(part, static_cast<std::size_t>(got));
  }
}

}  // namespace

std::string TryApart(const std::function<std::string()>& work, unsigned most_s) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return std::string("it cannot be tried: ") + strerror(errno);
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    Work(work, ends[1], most_s);
  }
  close(ends[1]);
  if (child < 0) {
    close(ends[0]);
    return std::string("it cannot be tried: ") + strerror(errno);
  }
  std::string said = ReadAll(ends[0]);
  close(ends[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFSIGNALED(status)) {
    const int sign = WTERMSIG(status);
    return sign == SIGALRM ? "it does not return within " + std::to_string(most_s) + " s"
                           : std::string("it crashes: ") + strsignal(sign);
  }
  if (WEXITSTATUS(status) == 0 || !said.empty()) return said;
  return "it ends the program with status " + std::to_string(WEXITSTATUS(status));
}

}  // namespace gapscope
