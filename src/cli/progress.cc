#include "src/cli/progress.h"

#include <fmt/core.h>
#include <signal.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string_view>

#include "src/core/visible.h"
#include "src/report/json.h"

namespace gapscope {

template <>
std::span<const EnumName<cli::ProgressForm>> EnumNames<cli::ProgressForm>() {
  static constexpr EnumName<cli::ProgressForm> kNames[] = {{cli::ProgressForm::kText, "text"},
                                                           {cli::ProgressForm::kJson, "json"}};
  return kNames;
}

namespace cli {
namespace {

using nlohmann::ordered_json;

std::atomic<bool> interrupted = false;
void Interrupt(int) { interrupted = true; }

// A count has no decimal point.
ordered_json NumberOrNull(double value) {
  if (value == std::floor(value) && std::abs(value) < 9e15) return static_cast<long long>(value);
  return JsonNumber(value);
}

// Paths may hold any bytes.
std::string Dumped(const ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace

ProgressLine::ProgressLine(const CommonFlags& flags, StageClock* clock)
    : people_(!flags.quiet && flags.progress == ProgressForm::kText && isatty(2)),
      json_(!flags.quiet && flags.progress == ProgressForm::kJson),
      clock_(clock),
      begin_(std::chrono::steady_clock::now()) {}

ProgressLine::~ProgressLine() {
  if (people_) fmt::print(stderr, "\r\033[K");
}

double ProgressLine::elapsed_s() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

void ProgressLine::Show(const ProgressPoint& point, const std::string& text) {
  if (clock_) clock_->EnterPart(point.stage, point.steps);
  if (people_) fmt::print(stderr, "\r\033[K{}", MadeVisible(text));
  const auto now = std::chrono::steady_clock::now();
  const bool soon = point.stage == stage_ && point.done != point.total && now - last_ < std::chrono::milliseconds(50);
  if (!json_ || soon) return;
  last_ = now;
  stage_ = point.stage;
  fmt::print(stderr, "{}",
             Dumped({{"stage", point.stage},
                     {"done", NumberOrNull(point.done)},
                     {"total", NumberOrNull(point.total)},
                     {"best", JsonNumber(point.best)},
                     {"elapsed_s", elapsed_s()}}));
}

void ShowReading(const std::vector<std::string>& files, ProgressLine* line) {
  constexpr double kMuch = 1e7;
  double bytes = 0;
  std::error_code failure;
  for (const std::string& file : files) {
    if (const auto size = std::filesystem::file_size(file, failure); !failure) bytes += static_cast<double>(size);
  }
  if (bytes < kMuch) return;
  const std::string text = fmt::format("reading {}, {:.0f} MB", files.size() == 1 ? "a log" : "logs", bytes / 1e6);
  line->Show({.stage = "reading"}, text);
}

const std::atomic<bool>* CatchInterrupts() {
  struct sigaction action{}, before{};
  action.sa_handler = Interrupt;
  action.sa_flags = static_cast<int>(SA_RESETHAND) | SA_RESTART;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    sigaction(signal, &action, &before);
    if (signal == SIGHUP && before.sa_handler == SIG_IGN) sigaction(signal, &before, nullptr);
  }
  return &interrupted;
}

bool AsksForJsonProgress(int argc, char** argv) {
  bool json = false;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word == "--progress") json = i + 1 < argc && std::strcmp(argv[i + 1], "json") == 0;
    if (word == "--progress=json") json = true;
  }
  return json;
}

std::string ErrorLine(const Error& error) {
  return Dumped({{"error",
                  {{"what", error.what},
                   {"where", error.where},
                   {"actual", error.actual},
                   {"allowed", error.allowed},
                   {"cure", error.cure}}}});
}

}  // namespace cli
}  // namespace gapscope
