#include "src/core/apart.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>

namespace gapscope {
namespace {

constexpr std::array kFaults{SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};
constexpr std::array kInterruptions{SIGINT, SIGTERM, SIGHUP};

void Tell(int pipe, const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t written = write(pipe, text.data() + done, text.size() - done);
    if (written <= 0) break;
    done += static_cast<std::size_t>(written);
  }
}

// In the copy: tells the pipe what `work` says, and ends without what this process does at its end.
[[noreturn]] void Work(const std::function<std::string()>& work, int pipe, unsigned most_s) {
  const rlimit no_core{};
  setrlimit(RLIMIT_CORE, &no_core);
  if (const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC); nowhere >= 0) dup2(nowhere, 1), dup2(nowhere, 2);
  signal(SIGALRM, SIG_DFL);
  for (const int sign : kFaults) signal(sign, SIG_DFL);
  alarm(most_s);
  std::string said;
  try {
    said = work();
  } catch (const std::exception& e) {
    said = e.what();
  }
  Tell(pipe, said);
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

volatile pid_t copy = 0;  // that is being waited for
void KillCopy(int sign) { kill(copy, sign); }

// Interruptions wait until the copy is there, and are passed on to it then.
class Interruptions {
 public:
  Interruptions() {
    sigset_t held;
    sigemptyset(&held);
    for (const int sign : kInterruptions) sigaddset(&held, sign);
    sigprocmask(SIG_BLOCK, &held, &mask_);
    for (std::size_t i = 0; i < kInterruptions.size(); ++i) sigaction(kInterruptions[i], nullptr, &actions_[i]);
  }
  ~Interruptions() {
    for (std::size_t i = 0; i < kInterruptions.size(); ++i) sigaction(kInterruptions[i], &actions_[i], nullptr);
    LetThrough();
  }
  Interruptions(const Interruptions&) = delete;
  Interruptions& operator=(const Interruptions&) = delete;

  void LetThrough() { sigprocmask(SIG_SETMASK, &mask_, nullptr); }
  void PassOnTo(pid_t child) {
    copy = child;
    struct sigaction pass_on{};
    pass_on.sa_handler = KillCopy;
    for (std::size_t i = 0; i < kInterruptions.size(); ++i) {
      if (actions_[i].sa_handler != SIG_IGN) sigaction(kInterruptions[i], &pass_on, nullptr);
    }
    LetThrough();
  }

 private:
  sigset_t mask_{};
  std::array<struct sigaction, kInterruptions.size()> actions_{};
};

// In the copy. A terminal's interruptions reach the process that waits, which passes them on.
[[noreturn]] void WorkOn(const std::function<int()>& work, int pipe, pid_t waits) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != waits) _exit(1);
  int status = 1;
  try {
    status = work();
  } catch (const std::exception& e) {
    Tell(pipe, *e.what() == '\0' ? "an error without text" : e.what());
  }
  std::fflush(nullptr);
  _exit(status);
}

int WaitFor(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
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
  const int status = WaitFor(child);
  if (WIFSIGNALED(status)) {
    const int sign = WTERMSIG(status);
    return sign == SIGALRM ? "it does not return within " + std::to_string(most_s) + " s"
                           : std::string("it crashes: ") + strsignal(sign);
  }
  if (WEXITSTATUS(status) == 0 || !said.empty()) return said;
  return "it ends the program with status " + std::to_string(WEXITSTATUS(status));
}

ApartEnd RunApart(const std::function<int()>& work) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return {.status = work()};
  std::fflush(nullptr);
  auto interruptions = std::make_unique<Interruptions>();
  const pid_t waits = getpid();
  const pid_t child = fork();
  if (child == 0) {
    interruptions->LetThrough();
    close(ends[0]);
    WorkOn(work, ends[1], waits);
  }
  close(ends[1]);
  if (child < 0) {
    close(ends[0]);
    interruptions.reset();
    return {.status = work()};
  }
  interruptions->PassOnTo(child);
  ApartEnd end{.crash = ReadAll(ends[0])};
  close(ends[0]);
  const int status = WaitFor(child);
  interruptions.reset();
  if (!WIFSIGNALED(status)) {
    end.status = WEXITSTATUS(status);
    return end;
  }
  const int sign = WTERMSIG(status);
  if (std::ranges::find(kFaults, sign) == kFaults.end()) {
    signal(sign, SIG_DFL);
    raise(sign);
  }
  end.crash = strsignal(sign);
  return end;
}

}  // namespace gapscope
